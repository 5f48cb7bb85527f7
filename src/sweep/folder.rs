//! The folder of a sweep: its files, what of it is done, its summary.

use std::{
    collections::BTreeSet,
    fmt, fs, io,
    path::{Path, PathBuf},
    str::FromStr,
};

use percuss_output::OutputError;
use percuss_table::{Sink, csv::Csv, parquet::Parquet};

use super::{
    journal::{Done, Entry, Journal, JournalError, State, line},
    plan::Plan,
    request::{Keep, Request},
    schedule::Job,
    summary,
};

/// Name of the sweep file in a folder.
const SWEEP_FILE: &str = "sweep.toml";
/// Name of the case among the files, unless it is a built-in one.
const CASE_FILE: &str = "case.toml";
/// Name of the folder of recordings.
const RUNS: &str = "runs";
/// Memory for the rows of a Parquet file \[bytes\].
const ROOM: usize = 1 << 30;

/// A part of a sweep: the cases whose numbers, counted from it on, are multiples of the number of parts apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            _ => Err(format!("`{text}` is no shard: I/N, with I from 1 to N")),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Why the folder of a sweep cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It is there, with something else in it.
    #[error("`{}` is there and is no folder of a sweep; choose another one with -o", .0.display())]
    Occupied(PathBuf),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The system refuses.
    #[error("`{}`: {error}", path.display())]
    System {
        /// The file or folder.
        path: PathBuf,
        /// Cause.
        error: io::Error,
    },
}

/// The folder of a sweep, or of a shard of it.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    shard: Option<Shard>,
}

impl Folder {
    /// * `shard`: the part of the sweep that is worked on, if it is not the whole
    pub fn new(path: &Path, shard: Option<Shard>) -> Self {
        Self { path: path.into(), shard }
    }

    /// The sweep file of a folder, if it has one.
    pub fn sweep_file(path: &Path) -> Option<PathBuf> {
        Some(path.join(SWEEP_FILE)).filter(|file| file.is_file())
    }

    fn system(path: &Path, error: io::Error) -> FolderError {
        FolderError::System { path: path.into(), error }
    }

    /// Makes the folder and writes what is asked for into it.
    ///
    /// # Errors
    ///
    /// There is something else in it, or it cannot be written.
    pub fn prepare(&self, plan: &Plan) -> Result<(), FolderError> {
        let fail = |error| Self::system(&self.path, error);
        if self.path.exists() && Self::sweep_file(&self.path).is_none() && !self.is_begun().map_err(fail)? {
            return Err(FolderError::Occupied(self.path.clone()));
        }
        fs::create_dir_all(&self.path).map_err(fail)?;
        let case = plan.text.as_ref().map_or_else(|| plan.request.case.clone(), |_| CASE_FILE.to_owned());
        let request = Request { case, ..plan.request.clone() };
        if let Some(text) = &plan.text {
            self.write(CASE_FILE, text.as_bytes())?;
        }
        let text = toml::to_string(&request).expect("a request is plain tables, text and numbers");
        self.write(SWEEP_FILE, text.as_bytes())
    }

    /// True of a folder with nothing in it but what a sweep leaves that was killed before it had its sweep file.
    fn is_begun(&self) -> io::Result<bool> {
        let is_ours = |name: &str| {
            let of = |file: &str| {
                name.strip_prefix(file).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            of(CASE_FILE) || of(SWEEP_FILE)
        };
        for entry in fs::read_dir(&self.path)? {
            if !entry?.file_name().to_str().is_some_and(is_ours) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Writes a file whole, unless it says the same.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let path = self.path.join(name);
        if fs::read(&path).is_ok_and(|old| old == bytes) {
            return Ok(());
        }
        Ok(percuss_output::write(&path, bytes, true)?)
    }

    /// Name of a file of the sweep or the shard.
    fn name(&self, stem: &str, extension: &str) -> String {
        match self.shard {
            None => format!("{stem}.{extension}"),
            Some(Shard { number, of }) => format!("{stem}-{number}-of-{of}.{extension}"),
        }
    }

    /// The journal that this process writes.
    ///
    /// # Errors
    ///
    /// Another process has it, or it cannot be written.
    pub fn journal(&self) -> Result<Journal, FolderError> {
        Ok(Journal::open(&self.path.join(self.name("manifest", "jsonl")))?)
    }

    /// What all journals say.
    ///
    /// # Errors
    ///
    /// One cannot be read.
    pub fn done(&self) -> Result<Done, FolderError> {
        let mut journals: Vec<PathBuf> = fs::read_dir(&self.path)
            .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect())
            .map_err(|error| Self::system(&self.path, error))?;
        journals.retain(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name == "manifest.jsonl" || (name.starts_with("manifest-") && name.ends_with(".jsonl"))
        });
        journals.sort();
        let mut done = Done::default();
        journals.iter().try_for_each(|path| done.read(path))?;
        Ok(done)
    }

    /// True if a case belongs to the shard.
    fn has(&self, number: usize) -> bool {
        self.shard.is_none_or(|shard| (number - 1) % shard.of == shard.number - 1)
    }

    /// Recording of a case: its path, and its name in the journal.
    fn recording(&self, plan: &Plan, number: usize) -> (PathBuf, String) {
        let digest = plan.cases[number - 1].digest.to_string();
        let name = format!("{RUNS}/{number:06}-{}.mcap", &digest[..8]);
        (self.path.join(&name), name)
    }

    /// What is left to do of the sweep or the shard, cases that are the same once. What an earlier sweep in the folder has done under
    /// another number is taken over: recordings get the names they would have, and the journal says so.
    ///
    /// * `again`: computes cases that have failed once more
    ///
    /// # Errors
    ///
    /// A file cannot be renamed, or the journal not written.
    pub fn jobs(
        &self,
        plan: &Plan,
        done: &mut Done,
        again: bool,
        journal: &mut Journal,
    ) -> Result<Vec<Job>, FolderError> {
        let keeps = plan.request.keep == Keep::All;
        let (mut seen, mut jobs) = (BTreeSet::new(), Vec::new());
        for (number, planned) in (1..).zip(&plan.cases) {
            if !seen.insert(planned.digest) || !self.has(number) {
                continue;
            }
            let (path, name) = self.recording(plan, number);
            let entry = done.entries.get_mut(&planned.digest);
            let is_done = match entry {
                Some(entry) if entry.state == State::Failed => !again,
                Some(entry) => self.take_over(entry, number, (&path, &name), journal)? || !keeps,
                None => false,
            };
            if !is_done {
                jobs.push(Job { number, recording: keeps.then_some((path, name)) });
            }
        }
        self.make_room(&jobs)?;
        Ok(jobs)
    }

    /// Makes the folder of recordings, if any are to be written.
    fn make_room(&self, jobs: &[Job]) -> Result<(), FolderError> {
        let runs = self.path.join(RUNS);
        match jobs.iter().any(|job| job.recording.is_some()) {
            true => fs::create_dir_all(&runs).map_err(|error| Self::system(&runs, error)),
            false => Ok(()),
        }
    }

    /// Gives what is done the number it has now; true if its recording is there.
    fn take_over(
        &self,
        entry: &mut Entry,
        number: usize,
        (path, name): (&Path, &str),
        journal: &mut Journal,
    ) -> Result<bool, FolderError> {
        if let Some(old) = entry.file.as_deref().filter(|old| *old != name && !path.exists()) {
            match fs::rename(self.path.join(old), path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(Self::system(path, error));
                }
                _ => {}
            }
        }
        let is_there = path.exists();
        let file = is_there.then(|| name.to_owned());
        if entry.case != number || entry.file != file {
            (entry.case, entry.file) = (number, file);
            journal.append(entry)?;
        }
        Ok(is_there)
    }

    /// What is left to do once all cases are done: that whose recording is kept alone, the first with the largest value of the measure,
    /// if it is not there yet.
    ///
    /// # Errors
    ///
    /// The folder of recordings cannot be made.
    pub fn last_jobs(&self, plan: &Plan, done: &Done) -> Result<Vec<Job>, FolderError> {
        let Keep::Worst(key) = &plan.request.keep else { return Ok(Vec::new()) };
        let value = |number: &usize| done.entries.get(&plan.cases[number - 1].digest)?.measures.get(key);
        let cases = (1..=plan.cases.len()).filter_map(|number| Some((number, value(&number)?)));
        let worst = cases.reduce(|worst, other| if other.1 > worst.1 { other } else { worst });
        let job = |(number, _)| Job { number, recording: Some(self.recording(plan, number)) };
        let is_there = |job: &Job| job.recording.as_ref().is_some_and(|(path, _)| path.exists());
        let jobs: Vec<Job> = worst.map(job).filter(|job| !is_there(job)).into_iter().collect();
        self.make_room(&jobs)?;
        Ok(jobs)
    }

    /// Writes the summary of the sweep or the shard.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn write_summary(&self, plan: &Plan, done: &Done) -> Result<(), FolderError> {
        let written = |sink: &mut dyn Sink| {
            let numbers = (1..=plan.cases.len()).filter(|number| self.has(*number));
            summary::write(plan, done, numbers, sink)
        };
        let (mut csv, mut parquet) = (Vec::new(), Vec::new());
        let creator = concat!("percuss ", env!("CARGO_PKG_VERSION"));
        written(&mut Csv::new(&mut csv))
            .and_then(|()| written(&mut Parquet::new(&mut parquet, creator, ROOM)))
            .map_err(|error| Self::system(&self.path, error))?;
        self.write(&self.name("summary", "csv"), &csv)?;
        self.write(&self.name("summary", "parquet"), &parquet)
    }

    /// Writes the journals of all shards as one.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn write_journal(&self, plan: &Plan, done: &Done) -> Result<(), FolderError> {
        // no other process may be appending to it
        drop(self.journal()?);
        let mut seen = BTreeSet::new();
        let new = plan.cases.iter().map(|case| case.digest).filter(|digest| seen.insert(*digest));
        let ours: Vec<&Entry> = new.filter_map(|digest| done.entries.get(&digest)).collect();
        // what the sweep had when it was another one
        let others = done.entries.iter().filter(|(digest, _)| !seen.contains(digest)).map(|(_, entry)| entry);
        let lines: String = others.chain(ours).map(line).collect();
        self.write(&self.name("manifest", "jsonl"), lines.as_bytes())
    }
}

/// Number of cases that journals say nothing of.
pub fn missing(plan: &Plan, done: &Done) -> usize {
    plan.cases.iter().filter(|case| !done.entries.contains_key(&case.digest)).count()
}
