//! Runs cases through the command line of percuss and reads their recordings as any user would.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use clap::Parser;
use percuss::cli::{Arguments, Exit};
use percuss_reader::{
    channel::Channel,
    command::trace::{Align, Request, trace},
    messages::Recording,
    pass::Moment,
    recording::Limits,
    select::Bound,
    slice::{moments, profile, slice},
};
use percuss_table::{Cell, Heading, Sink};

use crate::{Failure, Progress};

/// The folder of recordings, and the progress shown.
pub struct Lab<'a> {
    folder: PathBuf,
    /// Meshes are so many times as coarse as they are asked for.
    coarser: usize,
    progress: &'a Progress,
}

/// Points of a curve.
pub type Points = Vec<(f64, f64)>;

/// A recording and the command that makes it.
#[derive(Clone, Debug)]
pub struct Made {
    /// The file.
    pub path: PathBuf,
    /// The command, as it would be typed.
    pub command: String,
}

impl<'a> Lab<'a> {
    /// A lab that keeps its recordings in `folder`.
    ///
    /// * `coarser`: meshes are so many times as coarse as they are asked for
    pub fn new(folder: PathBuf, coarser: usize, progress: &'a Progress) -> Self {
        Self { folder, coarser, progress }
    }

    /// The recording of a name.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.mcap"))
    }

    /// A setting, of cells fewer if meshes are to be coarser.
    fn set(&self, set: &str) -> String {
        let (key, value) = set.split_once('=').unwrap_or((set, ""));
        let is_mesh = ["mesh.cells", "mesh.contact_cells"].contains(&key);
        let cells = value.parse::<usize>().ok().filter(|_| is_mesh);
        cells.map_or_else(|| set.to_owned(), |cells| format!("{key}={}", cells / self.coarser))
    }

    /// Computes a case.
    pub fn run(&self, name: &str, case: &str, sets: &[&str]) -> Result<Made, Failure> {
        self.make("run", name, case, sets)
    }

    /// Records the closed form of a case.
    pub fn exact(&self, name: &str, case: &str, sets: &[&str]) -> Result<Made, Failure> {
        self.make("exact", name, case, sets)
    }

    fn make(&self, verb: &str, name: &str, case: &str, sets: &[&str]) -> Result<Made, Failure> {
        let sets = sets.iter().flat_map(|set| ["--set".to_owned(), self.set(set)]);
        self.percuss(&[verb, case], sets, &format!("{name}.mcap"), &["--force", "--quiet"])
    }

    /// Computes a case with keys that vary.
    ///
    /// * `varied`: what varies, `KEY=SPEC`, or a file with a row for each case
    /// * `keep`: which recordings are kept
    pub fn sweep(
        &self,
        name: &str,
        case: &str,
        sets: &[&str],
        varied: &[&str],
        keep: &str,
    ) -> Result<Swept, Failure> {
        let path = self.folder.join(name);
        if path.exists() {
            fs::remove_dir_all(&path)?;
        }
        let sets = sets.iter().flat_map(|set| ["--set".to_owned(), self.set(set)]);
        let varied = varied.iter().flat_map(|vary| {
            let Some((key, values)) = vary.split_once('=') else {
                return ["--vary".to_owned(), (*vary).to_owned()];
            };
            let values: Vec<String> = match key {
                "mesh.cells" => values.split(',').map(|n| self.set(&format!("{key}={n}"))).collect(),
                _ => vec![format!("{key}={values}")],
            };
            let values: Vec<&str> = values.iter().filter_map(|set| Some(set.split_once('=')?.1)).collect();
            ["--vary".to_owned(), format!("{key}={}", values.join(","))]
        });
        let keep = ["--keep".to_owned(), keep.to_owned()];
        let Made { path, command } =
            self.percuss(&["sweep", case], sets.chain(varied).chain(keep), name, &["--quiet"])?;
        Swept::read(&path, command)
    }

    /// Runs a command of percuss that writes `output`.
    fn percuss(
        &self,
        start: &[&str],
        arguments: impl Iterator<Item = String>,
        output: &str,
        silent: &[&str],
    ) -> Result<Made, Failure> {
        let start = ["percuss"].iter().chain(start).map(|word| (*word).to_owned());
        let mut words: Vec<String> =
            start.chain(arguments).chain(["-o".to_owned(), output.to_owned()]).collect();
        let command = words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
        self.progress.next(&command);
        let path = self.folder.join(output);
        if let Some(last) = words.last_mut() {
            *last = path.display().to_string();
        }
        words.extend(silent.iter().map(|word| (*word).to_owned()));
        let arguments = Arguments::try_parse_from(&words).map_err(|error| Failure(error.to_string()))?;
        match arguments.run().map_err(|error| Failure(format!("{command}: {error}")))? {
            Exit::Done => Ok(Made { path, command }),
            Exit::Interrupted(_) => Err(Failure("interrupted".into())),
        }
    }
}

/// A word as it would be typed.
fn quoted(word: &str) -> String {
    if word.contains([' ', '"', '[']) { format!("'{word}'") } else { word.to_owned() }
}

/// A sweep and the command that makes it.
pub struct Swept {
    /// The command, as it would be typed.
    pub command: String,
    headings: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Recordings that are kept, by the number of their case.
    recordings: BTreeMap<usize, PathBuf>,
}

impl Swept {
    fn read(folder: &Path, command: String) -> Result<Self, Failure> {
        let mut table = csv::Reader::from_path(folder.join("summary.csv"))?;
        // names without units
        let name = |heading: &str| heading.split(" [").next().unwrap_or_default().to_owned();
        let headings = table.headers()?.iter().map(name).collect();
        let row = |record: csv::Result<csv::StringRecord>| Ok(record?.iter().map(str::to_owned).collect());
        let rows = table.records().map(row).collect::<Result<_, csv::Error>>()?;
        let mut recordings = BTreeMap::new();
        for line in fs::read_to_string(folder.join("manifest.jsonl"))?.lines() {
            let entry: serde_json::Value = serde_json::from_str(line)?;
            if let (Some(number), Some(file)) = (entry["case"].as_u64(), entry["file"].as_str()) {
                recordings.insert(number as usize, folder.join(file));
            }
        }
        Ok(Self { command, headings, rows, recordings })
    }

    /// The recording of a case, by its number from 1 on.
    pub fn recording(&self, number: usize) -> Result<Made, Failure> {
        let path = self.recordings.get(&number).cloned();
        let nothing = || Failure(format!("{}: no recording of case {number}", self.command));
        Ok(Made { path: path.ok_or_else(nothing)?, command: self.command.clone() })
    }

    /// A column, in the order of the cases that have it.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let place = self.headings.iter().position(|heading| heading == name);
        let number = |row: &Vec<String>| row.get(place?)?.parse().ok();
        self.rows.iter().filter_map(number).collect()
    }

    /// A column over another, of rows that have both, and of a value of a third column if one is chosen.
    pub fn points(&self, x: &str, y: &str, chosen: Option<(&str, &str)>) -> Points {
        let place = |name: &str| self.headings.iter().position(|heading| heading == name);
        let (Some(x), Some(y)) = (place(x), place(y)) else { return Points::new() };
        let fits = |row: &&Vec<String>| {
            chosen.is_none_or(|(name, value)| place(name).is_some_and(|place| row[place] == value))
        };
        let point = |row: &Vec<String>| Some((row[x].parse().ok()?, row[y].parse().ok()?));
        self.rows.iter().filter(fits).filter_map(point).collect()
    }
}

/// Takes all columns of a table.
#[derive(Default)]
struct Columns {
    headings: Vec<Heading>,
    columns: Vec<Points>,
}

impl Sink for Columns {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        self.columns = vec![Vec::new(); headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        let time = cells.first().and_then(Cell::number).unwrap_or(f64::NAN);
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            column.push((time, cell.number().unwrap_or(f64::NAN)));
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A field of a topic against time: `name` is a column as `percuss-read trace` names it.
pub fn series(made: &Made, topic: &str, name: &str) -> Result<Points, Failure> {
    let request = Request {
        topics: vec![topic.parse().map_err(|error| Failure(format!("{topic}: {error}")))?],
        align: Align::Exact,
        ..Request::default()
    };
    let mut table = Columns::default();
    trace(std::slice::from_ref(&made.path), &request, Limits::default(), &mut table)?;
    let found = table.headings.iter().position(|heading| heading.name == name);
    let column = found.ok_or_else(|| {
        let names: Vec<&str> = table.headings.iter().map(|heading| heading.name.as_str()).collect();
        Failure(format!("{}: no column {name} among {}", made.path.display(), names.join(", ")))
    })?;
    Ok(table.columns.swap_remove(column))
}

/// Interface stress at a probe against time.
pub fn probe(made: &Made, r: f64) -> Result<Points, Failure> {
    series(made, "/probes", &format!("stress@r={r}"))
}

/// Interface stress over r at the time nearest to `time`, and that time.
pub fn surface(made: &Made, time: f64) -> Result<(f64, Points), Failure> {
    let found = fields(made, "/interface/stress", &[time], profile)?.remove(0);
    Ok((found.time, found.points))
}

/// A field over r at a depth, at the frame nearest to `time`.
pub fn section(made: &Made, field: &str, time: f64, z: f64) -> Result<(f64, Points), Failure> {
    let (time, mut rows) = sections(made, field, &[time], &[z])?.remove(0);
    Ok((time, rows.remove(0)))
}

/// A field over r at some depths, at the frames nearest to some times, in one reading of the file.
pub fn sections(
    made: &Made,
    field: &str,
    times: &[f64],
    depths: &[f64],
) -> Result<Vec<(f64, Vec<Points>)>, Failure> {
    let found = fields(made, &format!("/field/{field}"), times, |channel, leaf, moment| {
        let slice = slice(channel, leaf, moment)?;
        let rows = depths.iter().map(|&z| Some(slice.line("z", z)?.points)).collect::<Option<_>>()?;
        Some((moment.time, rows))
    })?;
    Ok(found)
}

/// Results of `take` for a field of a topic, at the messages nearest to some times.
fn fields<T>(
    made: &Made,
    topic: &str,
    times: &[f64],
    take: impl Fn(&Channel, usize, &Moment) -> Option<T>,
) -> Result<Vec<T>, Failure> {
    let nothing = || Failure(format!("{}: nothing of {topic} at t = {times:?}", made.path.display()));
    let recording = Recording::open(&made.path, Limits::default())?;
    let (id, channel) =
        recording.channels.iter().find(|(_, channel)| channel.topic == topic).ok_or_else(nothing)?;
    let leaves = channel.layout.as_ref().map_or(0, |layout| layout.leaves.len());
    let bounds: Vec<Bound> = times.iter().copied().map(Bound::from).collect();
    let (moments, ..) = moments(&recording, *id, &bounds, false)?;
    let taken = moments.iter().map(|moment| (0..leaves).find_map(|leaf| take(channel, leaf, moment)));
    let taken = taken.collect::<Option<Vec<T>>>().ok_or_else(nothing)?;
    if taken.len() == times.len() { Ok(taken) } else { Err(nothing()) }
}

/// Entry of a metadata record.
pub fn metadata(made: &Made, record: &str, key: &str) -> Result<f64, Failure> {
    let recording = Recording::open(&made.path, Limits::default())?;
    let entry = recording.metadata.iter().find(|known| known.name == record);
    let value = entry.and_then(|entry| entry.entries.get(key)).and_then(|text| text.parse().ok());
    value.ok_or_else(|| Failure(format!("{}: no number {record} {key}", made.path.display())))
}

/// Value at `t`, linear between points.
pub fn at(points: &Points, t: f64) -> f64 {
    let i = points.partition_point(|point| point.0 < t).clamp(1, points.len() - 1);
    let ((t0, v0), (t1, v1)) = (points[i - 1], points[i]);
    v0 + (v1 - v0) * (t - t0) / (t1 - t0)
}

/// Largest value and its place.
pub fn largest(points: &Points) -> (f64, f64) {
    points
        .iter()
        .copied()
        .filter(|p| p.1.is_finite())
        .fold((f64::NAN, f64::NEG_INFINITY), |best, p| if p.1 > best.1 { p } else { best })
}

/// Slope of the straight line nearest to the points from `t0` to `t1`.
pub fn slope(points: &Points, t0: f64, t1: f64) -> f64 {
    let inside: Vec<&(f64, f64)> = points.iter().filter(|p| (t0..=t1).contains(&p.0)).collect();
    let n = inside.len() as f64;
    let (st, sv) = inside.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (tv, tt) = inside
        .iter()
        .fold((0.0, 0.0), |sum, p| (sum.0 + (p.0 - st) * (p.1 - sv), sum.1 + (p.0 - st) * (p.0 - st)));
    tv / tt
}

/// Relative rms difference of `points` from `reference`, which has the same times, over those that `choose` accepts.
pub fn rms(points: &Points, reference: &Points, choose: impl Fn(f64) -> bool) -> f64 {
    let pairs = points.iter().zip(reference).filter(|(p, e)| choose(p.0) && e.1.is_finite());
    let (error, norm) = pairs.fold((0.0, 0.0), |sum, (p, e)| {
        debug_assert!((p.0 - e.0).abs() < 1e-9, "the same steps");
        (sum.0 + (p.1 - e.1) * (p.1 - e.1), sum.1 + e.1 * e.1)
    });
    f64::sqrt(error / norm)
}
