//! `export`: attachments, matrices at one time, and images of cameras, as files of their own.

mod image;

use std::{
    collections::{HashMap, HashSet},
    error::Error,
    fs,
    io::Cursor,
    path::{Component, Path, PathBuf},
};

use clap::Args;
use ndarray::{Array1, Array2};
use ndarray_npy::{NpzWriter, WriteNpyExt};
use percuss_output::{is_same_file, synchronise_all, text::printable, write_later};
use percuss_picture::{Medium, draw_image};

use crate::{
    axis::Axis,
    command::trace::{Request, trace},
    extent::Extents,
    failure::Failure,
    format::vtk::{pvd, vti, vtr},
    messages::Recording,
    pass::Pass,
    recording::{Damage, Limits},
    select::{self, Bound, Pattern, Window, finite_time},
    slice::{Slice, mismatch, moments, slice},
    verb::{Exit, TableFormat, Verb, Write, by_extension, commit, loss, losses, print, same_file, say},
};

pub use image::{Camera, Image};

/// A line for each of what can be exported: together they are too long for one.
const EXPORT_USAGE: &str = "\
percuss-read export [OPTIONS] --topic <TOPIC> <FILE>
       percuss-read export [OPTIONS] --attachment <NAME> <FILE>
       percuss-read export [OPTIONS] --attachments <FILE>";

const EXPORT_EXAMPLES: &str = "\
Examples:
  percuss-read export fig5.mcap --attachment case.toml   # to standard output
  percuss-read export fig5.mcap --attachments -o folder  # all, into a folder
  percuss-read export fig5.mcap --topic /field/stress --at-time 2.5 \\
      -o field.npy
  # the last, for ParaView
  percuss-read export fig5.mcap --topic /field/stress -o field.vti
  # all, for ParaView
  percuss-read export fig5.mcap --topic /field/stress -o series.pvd
  percuss-read export fig5.mcap --topic /field/stress --at-time 1 \\
      -o field.png
  # a sensor, for seismologists
  percuss-read export plate.mcap --topic /sensor/0 -o sensor.sac
  # an image, 2.5 s after the start
  percuss-read export robot.mcap --topic /camera --at-time 2.5 -o image.jpg
  # all images, named by log time
  percuss-read export robot.mcap --topic /camera -o images/";

/// Attachments, fields at one time (NPY, VTK, PNG, SVG), and traces (SAC)
#[derive(Debug, Args)]
#[command(after_help = EXPORT_EXAMPLES, override_usage = EXPORT_USAGE)]
#[command(mut_arg("output", |output| output.help(
    "Output: a folder with --attachments; .npy, .npz (with positions), .vti, .vtr (also of layers), .png or .svg with --topic, \
     or .pvd for all times; .sac of numbers over time; of images .png, .jpg or .webp as they are recorded, or a folder, with a slash at the end if it is new, \
     for all of them"
)))]
#[command(group(clap::ArgGroup::new("what").required(true).args(["attachment", "attachments", "topic"])))]
pub struct Export {
    /// Recording
    file: PathBuf,
    /// Name of an attachment
    #[arg(long, value_name = "NAME")]
    attachment: Option<String>,
    /// All attachments
    #[arg(long)]
    attachments: bool,
    /// Topic of a field with two axes, or of images
    #[arg(long, value_name = "TOPIC")]
    topic: Option<Pattern>,
    /// Time of the field, in the unit that is recorded or with one, 87us; the nearest message is taken [default: the last]
    #[arg(long, value_name = "T", requires = "topic", allow_negative_numbers = true, value_parser = finite_time)]
    at_time: Option<Bound>,
    #[command(flatten)]
    write: Write,
}

impl Verb for Export {
    fn files(&self) -> &[PathBuf] {
        std::slice::from_ref(&self.file)
    }

    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs(self.files())?;
        if let Some(name) = &self.attachment {
            let (content, others) = attachment(&self.file, name, limits)?;
            if others > 0 {
                say(&format!("{others} more attachments have this name; --attachments writes them all"));
            }
            self.write.whole(&content)?;
            return Ok(Exit::Done);
        }
        let output = self.write.named()?;
        if let Some(topic) = &self.topic {
            if let Some(camera) = Camera::find(&self.file, topic, limits)? {
                let is_folder = output.is_dir() || output.as_os_str().as_encoded_bytes().ends_with(b"/");
                return if is_folder { self.images(&camera, output) } else { self.image(&camera, output) };
            }
            if output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("sac")) {
                return self.sac(topic, limits);
            }
            // a file of one time, or the time series
            let mut forms = FORMS.map(|(extension, form)| (extension, Some(form))).to_vec();
            forms.push(("pvd", None));
            let Some(kind) = by_extension(output, &forms, None)? else {
                return self.series(topic, output, limits);
            };
            let (slice, damages) = matrix(&self.file, topic, self.at_time, limits)?;
            self.write.whole(&form(&slice, kind)?)?;
            say(&slice.title());
            return Ok(loss(&self.file, &damages));
        }
        self.all(output, limits)
    }
}

impl Export {
    /// All of a topic over time.
    fn sac(&self, topic: &Pattern, limits: Limits) -> Result<Exit, Failure> {
        if self.at_time.is_some() {
            return Err(Failure::Usage("a .sac is of all times; leave out --at-time".into()));
        }
        let request = Request { topics: vec![topic.clone()], ..Request::default() };
        let mut output = self.write.begin();
        let files = std::slice::from_ref(&self.file);
        let written = trace(files, &request, limits, &mut *TableFormat::Sac.sink(&mut output, limits));
        let outcome = written.map_err(|failure| failure.at(self.write.path()))?;
        commit(output)?;
        Ok(losses(&outcome.damages, outcome.undecoded))
    }

    /// A time series: its frames into a folder of its name, and after them the file that names them.
    fn series(&self, topic: &Pattern, output: &Path, limits: Limits) -> Result<Exit, Failure> {
        if self.at_time.is_some() {
            return Err(Failure::Usage(
                "a .pvd is of all times; leave out --at-time, or write a .vti".into(),
            ));
        }
        self.write.refuse_existing()?;
        let folder = output.with_extension("");
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let mut count = 0;
        let (text, damages) = series(&self.file, topic, &name, limits, |file, bytes| {
            count += 1;
            fs::create_dir_all(&folder).map_err(|error| Failure::from(error).at(Some(&folder)))?;
            Ok::<_, Failure>(write_later(&folder.join(file), bytes, self.write.force)?)
        })?;
        synchronise_all(&folder).map_err(|error| Failure::from(error).at(Some(&folder)))?;
        self.write.whole(text.as_bytes())?;
        say(&format!("{}: {count} frames in {}", output.display(), folder.display()));
        Ok(loss(&self.file, &damages))
    }

    /// One image.
    fn image(&self, camera: &Camera, output: &Path) -> Result<Exit, Failure> {
        const EXTENSIONS: [(&str, &str); 4] =
            [("png", "png"), ("jpg", "jpg"), ("jpeg", "jpg"), ("webp", "webp")];
        let named = by_extension(output, &EXTENSIONS, None)?;
        let (moment, damages) = camera.moment(self.at_time)?;
        let image = camera.read(&moment.values)?;
        if image.extension != named {
            let (path, extension) = (output.display(), image.extension);
            let text = format!("`{path}`: the image is a .{extension}; name the output like that");
            return Err(Failure::Usage(text));
        }
        self.write.whole(image.bytes)?;
        say(&format!("image at {}", moment.time));
        Ok(loss(&self.file, &damages))
    }

    /// All images into a folder, named by their log times, padded so that names are in the order of times.
    fn images(&self, camera: &Camera, folder: &Path) -> Result<Exit, Failure> {
        if self.at_time.is_some() {
            return Err(Failure::Usage("name a file with -o for the image of one time, not a folder".into()));
        }
        fs::create_dir_all(folder).map_err(|error| Failure::from(error).at(Some(folder)))?;
        let mut last = None;
        let damages = camera.images(|log_time, image| {
            // several at a time are numbered
            let number = match last {
                Some((time, number)) if time == log_time => number + 1,
                _ => 1_u64,
            };
            last = Some((log_time, number));
            let number = if number > 1 { format!(".{number}") } else { String::new() };
            let path = folder.join(format!("{log_time:019}{number}.{}", image.extension));
            write_later(&path, image.bytes, self.write.force)?;
            print(&format!("{}\n", printable(&path.to_string_lossy())))
        })?;
        synchronise_all(folder).map_err(|error| Failure::from(error).at(Some(folder)))?;
        Ok(loss(&self.file, &damages))
    }

    /// All attachments into a folder, but for those whose names would lead out of it.
    fn all(&self, folder: &Path, limits: Limits) -> Result<Exit, Failure> {
        let (mut skipped, mut is_new) = (0, true);
        let damages = attachments(&self.file, limits, |of, name, content| {
            let Some(name) = name else {
                skipped += 1;
                say(&format!(
                    "warning: the attachment `{of}` is not written: its name is a path; --attachment names it"
                ));
                return Ok(());
            };
            if std::mem::take(&mut is_new) {
                fs::create_dir_all(folder).map_err(|error| Failure::from(error).at(Some(folder)))?;
            }
            let path = folder.join(name);
            if is_same_file(&path, &self.file) {
                return Err(same_file(&path));
            }
            write_later(&path, content, self.write.force)?;
            if name != Path::new(of) {
                say(&format!("another attachment is named `{of}` as well; this one is `{}`", path.display()));
            }
            print(&format!("{}\n", printable(&path.to_string_lossy())))
        })?;
        if !is_new {
            synchronise_all(folder).map_err(|error| Failure::from(error).at(Some(folder)))?;
        }
        let exit = loss(&self.file, &damages);
        Ok(if skipped > 0 { Exit::Loss } else { exit })
    }
}

/// A pattern that should name one of something names several.
fn several<'a>(topic: &Pattern, what: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    let (topic, known) = (topic.text(), known.collect::<Vec<_>>().join(", "));
    Failure::Usage(format!("`{topic}` names several {what}, {known}; choose one of them"))
}

/// A channel has no message that could be taken.
fn no_messages(topic: &str) -> Failure {
    Failure::Failed(format!("`{topic}` has no messages"))
}

/// A field with all its rows and columns has no room.
fn too_large(topic: &str) -> Failure {
    Failure::Failed(format!("`{topic}` with all its rows and columns is larger than --max-memory allows"))
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
pub fn safe_name(name: &str) -> Result<&Path, Failure> {
    let path = Path::new(name);
    let mut components = path.components();
    let is_plain = matches!((components.next(), components.next()), (Some(Component::Normal(_)), None));
    // separators and drives of other systems
    let is_plain = is_plain && !name.contains(['/', '\\', ':', '\0']);
    if is_plain {
        Ok(path)
    } else {
        Err(Failure::Failed(format!(
            "the attachment `{name}` has a name that is a path; name the output with -o to write it"
        )))
    }
}

/// The content of the first attachment with a name, and how many others have it too.
///
/// # Errors
///
/// The file cannot be read, or there is no such attachment.
pub fn attachment(path: &Path, name: &str, limits: Limits) -> Result<(Vec<u8>, usize), Failure> {
    let recording = Recording::open(path, limits)?;
    let same = recording.attachments.iter().filter(|attachment| attachment.name == name).count();
    match recording.attachment(name)? {
        Some(content) => Ok((content, same.saturating_sub(1))),
        None => {
            let known = recording.attachments.iter().map(|attachment| attachment.name.as_str());
            let known = known.collect::<Vec<_>>().join(", ");
            let known = if known.is_empty() { "none".into() } else { known };
            Err(Failure::Usage(format!("there is no attachment `{name}`; the recording has {known}")))
        }
    }
}

/// Hands every attachment to `write`, with the name of its file if that is safe, else with `None`. Of several with
/// the same name, all but the first get a number: `case.2.toml`. Answers what of the recording is damaged or was refused.
///
/// # Errors
///
/// The file cannot be read, or `write` failed.
pub fn attachments(
    path: &Path,
    limits: Limits,
    mut write: impl FnMut(&str, Option<&Path>, &[u8]) -> Result<(), Failure>,
) -> Result<Vec<Damage>, Failure> {
    let recording = Recording::open(path, limits)?;
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
    failed?.map_or(Ok(damages), Err)
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
) -> Result<(Slice, Vec<Damage>), Failure> {
    let recording = Recording::open(path, limits)?;
    let (id, leaf) = only_matrix(&recording, topic)?;
    let channel = &recording.channels[&id];
    let name = || channel.topic.clone();
    let (mut moments, extents, damages) = moments(&recording, id, time.as_slice(), true)?;
    let moment = moments.pop().ok_or_else(|| no_messages(&name()))?;
    let slice =
        slice(channel, leaf, &moment).ok_or_else(|| Failure::Failed(mismatch(channel, leaf, &moment)))?;
    let slice = slice.whole(&extents.of(id, leaf), limits).ok_or_else(|| too_large(&name()))?;
    let layers = recording.layers(&slice.axes[0].name);
    Ok((Slice { layers, ..slice }, damages))
}

/// Channel and leaf of the one matrix of a topic.
fn only_matrix(recording: &Recording, topic: &Pattern) -> Result<(u16, usize), Failure> {
    let mut matrices = Vec::new();
    for id in select::channels(recording, std::slice::from_ref(topic))? {
        matrices.extend(Axis::matrices(&recording.channels[&id]).map(|leaf| (id, leaf)));
    }
    match matrices.as_slice() {
        [] => Err(Failure::Usage(format!(
            "`{}` holds no matrix (an array with two axes in its metadata) and no images",
            topic.text()
        ))),
        [matrix] => Ok(*matrix),
        found => {
            let topics = found.iter().map(|(id, _)| recording.channels[id].topic.as_str());
            Err(several(topic, "matrices", topics))
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
pub fn series(
    path: &Path,
    topic: &Pattern,
    folder: &str,
    limits: Limits,
    mut write: impl FnMut(&str, &[u8]) -> Result<(), Failure>,
) -> Result<(String, Vec<Damage>), Failure> {
    let recording = Recording::open(path, limits)?;
    let (id, leaf) = only_matrix(&recording, topic)?;
    let channel = &recording.channels[&id];
    let extent = Extents::read(&recording, &[id])?.of(id, leaf);
    let mut frames = Vec::new();
    let mut pass = Pass::over(&recording, Window::default());
    pass.each(id, |moment, _| {
        let slice =
            slice(channel, leaf, moment).ok_or_else(|| Failure::Failed(mismatch(channel, leaf, moment)))?;
        let slice = slice.whole(&extent, limits).ok_or_else(|| too_large(&channel.topic))?;
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
        return Err(no_messages(&channel.topic));
    }
    Ok((pvd(&frames), damages))
}

/// A matrix in a form.
///
/// # Errors
///
/// It cannot be drawn, or its places do not fit the form.
pub fn form(slice: &Slice, form: Form) -> Result<Vec<u8>, Failure> {
    match form {
        Form::Vti => vti(slice).map_err(|axis| {
            Failure::Usage(format!(
                "the {} of `{}` are not evenly apart, as in a .vti; write a .vtr",
                axis.name, slice.topic
            ))
        }),
        Form::Vtr => Ok(vtr(slice)),
        Form::Png => draw_image(&slice.image(), None, Medium::Png).map_err(Failure::drawing),
        Form::Svg => draw_image(&slice.image(), None, Medium::Svg).map_err(Failure::drawing),
        Form::Npy | Form::Npz => arrays(slice, form).map_err(Failure::drawing),
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
