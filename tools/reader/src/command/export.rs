//! `export`: attachments, matrices at one time, and images of cameras, as files of their own.

mod image;

use std::{
    collections::{HashMap, HashSet},
    error::Error,
    fs,
    io::Cursor,
    mem,
    path::{Component, Path, PathBuf},
};

use clap::Args;
use ndarray::{Array1, Array2, ShapeError};
use ndarray_npy::{NpzWriter, WriteNpyExt};
use percuss_output::{is_same_file, synchronise_all, text::printable, write_later};
use percuss_picture::{Medium, draw_image};

use crate::{
    axis::Axis,
    channel::Channel,
    command::trace::{Request, trace},
    extent::{Extent, Extents},
    failure::Failure,
    format::vtk::{pvd, vti, vtr},
    messages::{Attachment, Recording},
    pass::{Moment, Pass},
    recording::{Damage, Limits},
    select::{self, Bound, Pattern, Window, finite_time},
    slice::{Slice, mismatch, moments, slice},
    verb::{Exit, TableFormat, Verb, Write, by_extension, commit, loss, print, same_file, say},
};

use image::Camera;

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
    pub(crate) file: PathBuf,
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
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs([&self.file])?;
        if let Some(name) = &self.attachment {
            return self.attachment(name, limits);
        }
        let output = self.write.named()?;
        let Some(topic) = &self.topic else { return self.all(output, limits) };
        if let Some(camera) = Camera::find(&self.file, topic, limits)? {
            let is_folder = output.is_dir() || output.as_os_str().as_encoded_bytes().ends_with(b"/");
            return if is_folder { self.images(&camera, output) } else { self.image(&camera, output) };
        }
        if output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("sac")) {
            return self.sac(topic, limits);
        }
        let Some(form) = by_extension(output, &FORMS, None)? else {
            return self.series(topic, output, limits);
        };
        let (slice, damages) = self.matrix(topic, limits)?;
        self.write.whole(&form(&slice)?)?;
        say(&slice.title());
        Ok(loss(&self.file, &damages))
    }
}

/// Makes a file of a matrix.
type Form = fn(&Slice) -> Result<Vec<u8>, Failure>;

/// Forms of matrices by the extensions of files; the one of all times is none of these.
const FORMS: [(&str, Option<Form>); 7] = [
    ("npy", Some(|slice| npy(slice).map_err(Failure::drawing))),
    ("npz", Some(|slice| npz(slice).map_err(Failure::drawing))),
    ("vti", Some(even_vti)),
    ("vtr", Some(|slice| Ok(vtr(slice)))),
    ("png", Some(|slice| draw_image(&slice.image(), None, Medium::Png).map_err(Failure::drawing))),
    ("svg", Some(|slice| draw_image(&slice.image(), None, Medium::Svg).map_err(Failure::drawing))),
    ("pvd", None),
];

/// A folder for files, made with the first of them.
struct Folder<'a> {
    path: &'a Path,
    overwrite: bool,
    is_made: bool,
}

impl<'a> Folder<'a> {
    fn new(path: &'a Path, overwrite: bool) -> Self {
        Self { path, overwrite, is_made: false }
    }

    fn make(&mut self) -> Result<(), Failure> {
        match mem::replace(&mut self.is_made, true) {
            true => Ok(()),
            false => fs::create_dir_all(self.path).map_err(|error| Failure::from(error).at(Some(self.path))),
        }
    }

    fn write(&mut self, name: impl AsRef<Path>, bytes: &[u8]) -> Result<PathBuf, Failure> {
        self.make()?;
        let path = self.path.join(name);
        write_later(&path, bytes, self.overwrite)?;
        Ok(path)
    }

    /// Waits until all files are on the disk.
    fn end(&self) -> Result<(), Failure> {
        match self.is_made {
            true => synchronise_all(self.path).map_err(|error| Failure::from(error).at(Some(self.path))),
            false => Ok(()),
        }
    }
}

impl Export {
    /// Refuses a time where all are written.
    fn refuse_time(&self, why: &str) -> Result<(), Failure> {
        if self.at_time.is_some() { Err(Failure::Usage(why.into())) } else { Ok(()) }
    }

    fn sac(&self, topic: &Pattern, limits: Limits) -> Result<Exit, Failure> {
        self.refuse_time("a .sac is of all times; leave out --at-time")?;
        let request = Request { topics: vec![topic.clone()], ..Request::default() };
        let mut output = self.write.begin();
        let files = std::slice::from_ref(&self.file);
        let written = trace(files, &request, limits, &mut *TableFormat::Sac.sink(&mut output, limits));
        let outcome = written.map_err(|failure| failure.at(self.write.path()))?;
        commit(output)?;
        Ok(outcome.losses.report())
    }

    /// The matrix of a topic at the time nearest to the one asked for, or of its last message, with all rows and columns that it has in
    /// any message.
    fn matrix(&self, topic: &Pattern, limits: Limits) -> Result<(Slice, Vec<Damage>), Failure> {
        let recording = Recording::open(&self.file, limits)?;
        let (id, leaf) = only_matrix(&recording, topic)?;
        let channel = &recording.channels[&id];
        let (mut moments, extents, damages) = moments(&recording, id, self.at_time.as_slice(), true)?;
        let moment = moments.pop().ok_or_else(|| no_messages(&channel.topic))?;
        let slice = whole(channel, leaf, &moment, &extents.get(id, leaf), limits)?;
        let layers = recording.layers(&slice.axes[0].name);
        Ok((Slice { layers, ..slice }, damages))
    }

    /// All matrices of a topic as a time series for ParaView: the frames into a folder, by names padded so that they are in the order of
    /// times, and after them the file that names them.
    fn series(&self, topic: &Pattern, output: &Path, limits: Limits) -> Result<Exit, Failure> {
        self.refuse_time("a .pvd is of all times; leave out --at-time, or write a .vti")?;
        self.write.refuse_existing()?;
        let folder = output.with_extension("");
        let seen_from_output = folder.file_name().unwrap_or_default().to_string_lossy();
        let recording = Recording::open(&self.file, limits)?;
        let (id, leaf) = only_matrix(&recording, topic)?;
        let channel = &recording.channels[&id];
        let extent = Extents::read(&recording, &[id])?.get(id, leaf);
        let (mut frames, mut files) = (Vec::new(), Folder::new(&folder, self.write.force));
        let mut pass = Pass::over(&recording, Window::default());
        pass.each(id, |moment, _| {
            let slice = whole(channel, leaf, moment, &extent, limits)?;
            let (bytes, extension) = match vti(&slice) {
                Ok(bytes) => (bytes, "vti"),
                Err(_) => (vtr(&slice), "vtr"),
            };
            let name = format!("{:06}.{extension}", frames.len());
            files.write(&name, &bytes)?;
            frames.push((slice.time, format!("{seen_from_output}/{name}")));
            Ok(())
        });
        let damages = pass.run()?.damages;
        if frames.is_empty() {
            return Err(no_messages(&channel.topic));
        }
        files.end()?;
        self.write.whole(pvd(&frames).as_bytes())?;
        say(&format!("{}: {} frames in {}", output.display(), frames.len(), folder.display()));
        Ok(loss(&self.file, &damages))
    }

    fn image(&self, camera: &Camera, output: &Path) -> Result<Exit, Failure> {
        const EXTENSIONS: [(&str, &str); 4] =
            [("png", "png"), ("jpg", "jpg"), ("jpeg", "jpg"), ("webp", "webp")];
        let named = by_extension(output, &EXTENSIONS, None)?;
        let (mut moments, _, damages) =
            moments(&camera.recording, camera.id, self.at_time.as_slice(), false)?;
        let moment = moments.pop().ok_or_else(|| no_messages(camera.topic()))?;
        let (extension, bytes) = camera.read(&moment.values)?;
        if extension != named {
            let path = output.display();
            let text = format!("`{path}`: the image is a .{extension}; name the output like that");
            return Err(Failure::Usage(text));
        }
        self.write.whole(bytes)?;
        say(&format!("image at {}", moment.time));
        Ok(loss(&self.file, &damages))
    }

    /// All images into a folder, named by their log times, padded so that names are in the order of times.
    fn images(&self, camera: &Camera, folder: &Path) -> Result<Exit, Failure> {
        self.refuse_time("name a file with -o for the image of one time, not a folder")?;
        let (mut files, mut last) = (Folder::new(folder, self.write.force), None);
        files.make()?;
        let mut pass = Pass::over(&camera.recording, Window::default());
        pass.each(camera.id, |moment, _| {
            let ((extension, bytes), time) = (camera.read(&moment.values)?, moment.log_time);
            // several at a time are numbered
            let number = match last {
                Some((known, number)) if known == time => number + 1,
                _ => 1_u64,
            };
            last = Some((time, number));
            let number = if number > 1 { format!(".{number}") } else { String::new() };
            print_path(&files.write(format!("{time:019}{number}.{extension}"), bytes)?)
        });
        let seen = pass.run()?;
        if seen.undecoded > 0 {
            return Err(camera.refuse("a message does not fit its schema"));
        }
        files.end()?;
        Ok(loss(&self.file, &seen.damages))
    }

    /// The first attachment of a name.
    fn attachment(&self, name: &str, limits: Limits) -> Result<Exit, Failure> {
        let recording = Recording::open(&self.file, limits)?;
        let names = || recording.attachments.iter().map(|attachment| attachment.name.as_str());
        let Some(content) = recording.attachment(name)? else {
            let known = if names().next().is_none() { "none".into() } else { list(names()) };
            let text = format!("there is no attachment `{name}`; the recording has {known}");
            return Err(Failure::Usage(text));
        };
        let others = names().filter(|known| *known == name).count().saturating_sub(1);
        if others > 0 {
            say(&format!("{others} more attachments have this name; --attachments writes them all"));
        }
        self.write.whole(&content)?;
        Ok(Exit::Done)
    }

    /// All attachments into a folder, but for those whose names would lead out of it. Of several with the same name, all but the first
    /// get a number: `case.2.toml`.
    fn all(&self, folder: &Path, limits: Limits) -> Result<Exit, Failure> {
        let recording = Recording::open(&self.file, limits)?;
        let name = |attachment: &Attachment| attachment.name.clone();
        let mut names: HashSet<String> = recording.attachments.iter().map(name).collect();
        // by the name of an attachment, the number that the next of this name may have
        let mut written = HashMap::<String, u64>::new();
        let (mut damages, mut skipped) = (recording.damages.clone(), false);
        let mut files = Folder::new(folder, self.write.force);
        let mut write = |of: &str, name: &str, content: &[u8]| {
            if !is_safe(name) {
                skipped = true;
                say(&format!(
                    "warning: the attachment `{of}` is not written: its name is a path; --attachment names it"
                ));
                return Ok(());
            }
            let path = folder.join(name);
            if is_same_file(&path, &self.file) {
                return Err(same_file(&path));
            }
            files.write(name, content)?;
            if name != of {
                say(&format!("another attachment is named `{of}` as well; this one is `{}`", path.display()));
            }
            print_path(&path)
        };
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
            let failed = write(name, &file, content).err();
            names.insert(file);
            written.entry(name.to_owned()).or_insert(2);
            failed
        })?;
        failed.map_or(Ok(()), Err)?;
        files.end()?;
        let exit = loss(&self.file, &damages);
        Ok(if skipped { Exit::Loss } else { exit })
    }
}

fn print_path(path: &Path) -> Result<(), Failure> {
    print(&format!("{}\n", printable(&path.to_string_lossy())))
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

fn several<'a>(topic: &Pattern, what: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    Failure::Usage(format!("`{}` names several {what}, {}; choose one of them", topic.text(), list(known)))
}

fn no_messages(topic: &str) -> Failure {
    Failure::Failed(format!("`{topic}` has no messages"))
}

/// True for the name of an attachment that names a file in a folder, never one that leads elsewhere.
fn is_safe(name: &str) -> bool {
    let mut components = Path::new(name).components();
    let is_plain = matches!((components.next(), components.next()), (Some(Component::Normal(_)), None));
    // separators and drives of other systems
    is_plain && !name.contains(['/', '\\', ':', '\0'])
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

fn whole(
    channel: &Channel,
    leaf: usize,
    moment: &Moment,
    extent: &Extent,
    limits: Limits,
) -> Result<Slice, Failure> {
    let slice =
        slice(channel, leaf, moment).ok_or_else(|| Failure::Failed(mismatch(channel, leaf, moment)))?;
    slice.whole(extent, limits).ok_or_else(|| {
        let topic = &channel.topic;
        Failure::Failed(format!("`{topic}` with all its rows and columns is larger than --max-memory allows"))
    })
}

fn even_vti(slice: &Slice) -> Result<Vec<u8>, Failure> {
    vti(slice).map_err(|axis| {
        Failure::Usage(format!(
            "the {} of `{}` are not evenly apart, as in a .vti; write a .vtr",
            axis.name, slice.topic
        ))
    })
}

fn array(slice: &Slice) -> Result<Array2<f64>, ShapeError> {
    Array2::from_shape_vec((slice.rows.length(), slice.columns.length()), slice.values.clone())
}

fn npy(slice: &Slice) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    array(slice)?.write_npy(&mut bytes)?;
    Ok(bytes)
}

/// The array of `.npy` by its name, and the positions of rows and columns by the names of their coordinates.
fn npz(slice: &Slice) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut archive = NpzWriter::new(Cursor::new(Vec::new()));
    archive.add_array(slice.name.as_str(), &array(slice)?)?;
    for (side, axis) in [&slice.rows, &slice.columns].into_iter().zip(&slice.axes) {
        archive.add_array(axis.name.as_str(), &Array1::from_shape_fn(side.length(), |i| side.at(i)))?;
    }
    Ok(archive.finish()?.into_inner())
}
