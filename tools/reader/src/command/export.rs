//! `export`: attachments, matrices at one time, and images of cameras, as files of their own.

mod image;

use std::{
    collections::{HashMap, HashSet},
    error::Error,
    io::Cursor,
    path::{Component, Path},
};

use ndarray::{Array1, Array2};
use ndarray_npy::{NpzWriter, WriteNpyExt};

use percuss_picture::{Medium, draw_image};

use crate::{
    axis::Axis,
    extent::Extents,
    format::vtk::{pvd, vti, vtr},
    messages::Recording,
    pass::Pass,
    recording::{Damage, Limits, OpenError},
    select::{self, Bound, Pattern, Window},
    slice::{MomentError, Slice, mismatch, moments, slice},
};

pub use image::{Camera, Image};

/// Why there is nothing to export.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such attachment.
    #[error("there is no attachment `{name}`; the recording has {known}")]
    NoAttachment {
        /// Name asked for.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A name that would lead out of the folder.
    #[error("the attachment `{0}` has a name that is a path; name the output with -o to write it")]
    UnsafeName(String),
    /// There is no matrix.
    #[error("`{0}` holds no matrix (an array with two axes in its metadata) and no images")]
    NoMatrix(String),
    /// There are several.
    #[error("`{topic}` names several {what}, {known}; choose one of them")]
    Several {
        /// Pattern asked for.
        topic: String,
        /// What there are several of.
        what: &'static str,
        /// Their topics.
        known: String,
    },
    /// A message holds no image that can be written.
    #[error("an image of `{topic}` cannot be written: {why}")]
    NoImage {
        /// Topic.
        topic: String,
        /// What is wrong with it.
        why: String,
    },
    /// The channel has no message that could be taken.
    #[error("`{0}` has no messages")]
    NoMessages(String),
    /// The message is no matrix at places that are sound, for a reason.
    #[error("{0}")]
    Misshapen(String),
    /// Places that are not evenly apart, in a form that knows no others.
    #[error("the {coordinate} of `{topic}` are not evenly apart, as in a .vti; write a .vtr")]
    Uneven {
        /// Topic.
        topic: String,
        /// Coordinate of the places.
        coordinate: String,
    },
    /// With all rows and columns it is too large.
    #[error("`{0}` with all its rows and columns is larger than --max-memory allows")]
    TooLarge(String),
    /// There are no messages at the time.
    #[error(transparent)]
    Moment(#[from] MomentError),
    /// The picture cannot be drawn.
    #[error("cannot draw: {0}")]
    Draw(String),
}

impl ExportError {
    fn several<'a>(topic: &Pattern, what: &'static str, known: impl Iterator<Item = &'a str>) -> Self {
        Self::Several { topic: topic.text().into(), what, known: known.collect::<Vec<_>>().join(", ") }
    }
}

/// A form for matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Array of NumPy.
    Npy,
    /// Arrays of NumPy: that of `.npy` by its name, and the positions of rows and columns by the names of their coordinates.
    Npz,
    /// Image data of VTK.
    Vti,
    /// Rectilinear grid of VTK.
    Vtr,
    /// Picture with a colour bar.
    Png,
    /// Picture with a colour bar.
    Svg,
}

/// Forms by the extensions of files.
pub const FORMS: [(&str, Form); 6] = [
    ("npy", Form::Npy),
    ("npz", Form::Npz),
    ("vti", Form::Vti),
    ("vtr", Form::Vtr),
    ("png", Form::Png),
    ("svg", Form::Svg),
];

/// The name of an attachment as a file in a folder: never one that leads elsewhere.
///
/// # Errors
///
/// The name is a path.
pub fn safe_name(name: &str) -> Result<&Path, ExportError> {
    let path = Path::new(name);
    let mut components = path.components();
    let is_plain = matches!((components.next(), components.next()), (Some(Component::Normal(_)), None));
    // separators and drives of other systems
    let is_plain = is_plain && !name.contains(['/', '\\', ':', '\0']);
    if is_plain { Ok(path) } else { Err(ExportError::UnsafeName(name.into())) }
}

/// The content of the first attachment with a name, and how many others have it too.
///
/// # Errors
///
/// The file cannot be read, or there is no such attachment.
pub fn attachment(path: &Path, name: &str, limits: Limits) -> Result<(Vec<u8>, usize), ExportError> {
    let recording = Recording::open(path, limits)?;
    let same = recording.attachments.iter().filter(|attachment| attachment.name == name).count();
    match recording.attachment(name)? {
        Some(content) => Ok((content, same.saturating_sub(1))),
        None => {
            let known = recording.attachments.iter().map(|attachment| attachment.name.as_str());
            let known = known.collect::<Vec<_>>().join(", ");
            let known = if known.is_empty() { "none".into() } else { known };
            Err(ExportError::NoAttachment { name: name.into(), known })
        }
    }
}

/// Hands every attachment to `write`, with the name of its file if that is safe, else with `None`. Of several with
/// the same name, all but the first get a number: `case.2.toml`. Answers what of the recording is damaged or was refused.
///
/// # Errors
///
/// The file cannot be read, or `write` failed.
pub fn attachments<E: From<ExportError>>(
    path: &Path,
    limits: Limits,
    mut write: impl FnMut(&str, Option<&Path>, &[u8]) -> Result<(), E>,
) -> Result<Vec<Damage>, E> {
    let recording = Recording::open(path, limits).map_err(ExportError::Open)?;
    let mut names: HashSet<String> =
        recording.attachments.iter().map(|attachment| attachment.name.clone()).collect();
    // by the name of an attachment, the number that the next of this name may have
    let mut written = HashMap::<String, u64>::new();
    let mut damages = recording.damages.clone();
    let failed = recording.find_attachment(|name, content| {
        let content = match content {
            Ok(content) => content,
            Err(left_out) => {
                damages.push(Damage::refusal(left_out.refusal(name)));
                return None;
            }
        };
        let file = match written.get_mut(name) {
            Some(next) => numbered(name, &names, next),
            None => name.to_owned(),
        };
        let result = write(name, safe_name(&file).ok(), content).err();
        names.insert(file);
        written.entry(name.to_owned()).or_insert(2);
        result
    });
    failed.map_err(ExportError::Open)?.map_or(Ok(damages), Err)
}

/// A name with a number that makes it another than all `known`.
///
/// * `next`: least number that may be free
fn numbered(name: &str, known: &HashSet<String>, next: &mut u64) -> String {
    let (stem, extension) = match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() => (stem, format!(".{extension}")),
        _ => (name, String::new()),
    };
    loop {
        let numbered = format!("{stem}.{next}{extension}");
        *next += 1;
        if !known.contains(&numbered) {
            return numbered;
        }
    }
}

/// The matrix of a topic at the time nearest to `time`, or of its last message, with all rows and columns that it has in
/// any message.
///
/// # Errors
///
/// The file cannot be read, there is no such matrix or more than one, or the time lies outside the recording.
pub fn matrix(
    path: &Path,
    topic: &Pattern,
    time: Option<Bound>,
    limits: Limits,
) -> Result<(Slice, Vec<Damage>), ExportError> {
    let recording = Recording::open(path, limits)?;
    let (id, leaf) = only_matrix(&recording, topic)?;
    let channel = &recording.channels[&id];
    let name = || channel.topic.clone();
    let (mut moments, extents, damages) = moments(&recording, id, time.as_slice(), true)?;
    let moment = moments.pop().ok_or_else(|| ExportError::NoMessages(name()))?;
    let slice = slice(channel, leaf, &moment)
        .ok_or_else(|| ExportError::Misshapen(mismatch(channel, leaf, &moment)))?;
    let slice = slice.whole(&extents.of(id, leaf), limits).ok_or_else(|| ExportError::TooLarge(name()))?;
    let layers = recording.layers(&slice.axes[0].name);
    Ok((Slice { layers, ..slice }, damages))
}

/// Channel and leaf of the one matrix of a topic.
fn only_matrix(recording: &Recording, topic: &Pattern) -> Result<(u16, usize), ExportError> {
    let mut matrices = Vec::new();
    for id in select::channels(recording, std::slice::from_ref(topic))? {
        matrices.extend(Axis::matrices(&recording.channels[&id]).map(|leaf| (id, leaf)));
    }
    match matrices.as_slice() {
        [] => Err(ExportError::NoMatrix(topic.text().into())),
        [matrix] => Ok(*matrix),
        several => {
            let topics = several.iter().map(|(id, _)| recording.channels[id].topic.as_str());
            Err(ExportError::several(topic, "matrices", topics))
        }
    }
}

/// All matrices of a topic as a time series for ParaView: hands the files of the frames to `write`, by names padded so that they are in
/// the order of times, and answers the text that names them, and what of the recording is damaged.
///
/// * `folder`: of the frames, as seen from the text
///
/// # Errors
///
/// As of [`matrix`], or `write` has failed.
pub fn series<E: From<ExportError> + From<OpenError>>(
    path: &Path,
    topic: &Pattern,
    folder: &str,
    limits: Limits,
    mut write: impl FnMut(&str, &[u8]) -> Result<(), E>,
) -> Result<(String, Vec<Damage>), E> {
    let recording = Recording::open(path, limits).map_err(ExportError::Open)?;
    let (id, leaf) = only_matrix(&recording, topic)?;
    let channel = &recording.channels[&id];
    let extent = Extents::read(&recording, &[id]).map_err(ExportError::Open)?.of(id, leaf);
    let mut frames = Vec::new();
    let mut pass: Pass<'_, E> = Pass::over(&recording, Window::default());
    pass.each(id, |moment, _| {
        let slice = slice(channel, leaf, moment)
            .ok_or_else(|| ExportError::Misshapen(mismatch(channel, leaf, moment)))?;
        let slice =
            slice.whole(&extent, limits).ok_or_else(|| ExportError::TooLarge(channel.topic.clone()))?;
        let (bytes, extension) = match vti(&slice) {
            Ok(bytes) => (bytes, "vti"),
            Err(_) => (vtr(&slice), "vtr"),
        };
        let name = format!("{:06}.{extension}", frames.len());
        write(&name, &bytes)?;
        frames.push((slice.time, format!("{folder}/{name}")));
        Ok(())
    });
    let damages = pass.run()?.damages;
    if frames.is_empty() {
        return Err(ExportError::NoMessages(channel.topic.clone()).into());
    }
    Ok((pvd(&frames), damages))
}

/// A matrix in a form.
///
/// # Errors
///
/// It cannot be drawn, or its places do not fit the form.
pub fn form(slice: &Slice, form: Form) -> Result<Vec<u8>, ExportError> {
    match form {
        Form::Vti => vti(slice).map_err(|axis| ExportError::Uneven {
            topic: slice.topic.clone(),
            coordinate: axis.name.clone(),
        }),
        Form::Vtr => Ok(vtr(slice)),
        Form::Png => draw_image(&slice.image(), None, Medium::Png).map_err(ExportError::Draw),
        Form::Svg => draw_image(&slice.image(), None, Medium::Svg).map_err(ExportError::Draw),
        Form::Npy | Form::Npz => arrays(slice, form).map_err(|error| ExportError::Draw(error.to_string())),
    }
}

/// A matrix as one array of NumPy, or as several.
fn arrays(slice: &Slice, form: Form) -> Result<Vec<u8>, Box<dyn Error>> {
    let shape = (slice.rows.length(), slice.columns.length());
    let array = Array2::from_shape_vec(shape, slice.values.clone())?;
    if form == Form::Npy {
        let mut bytes = Vec::new();
        array.write_npy(&mut bytes)?;
        return Ok(bytes);
    }
    let mut archive = NpzWriter::new(Cursor::new(Vec::new()));
    archive.add_array(slice.name.as_str(), &array)?;
    for (side, axis) in [&slice.rows, &slice.columns].into_iter().zip(&slice.axes) {
        archive.add_array(axis.name.as_str(), &Array1::from_shape_fn(side.length(), |i| side.at(i)))?;
    }
    Ok(archive.finish()?.into_inner())
}
