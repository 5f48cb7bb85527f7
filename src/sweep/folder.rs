//! The folder of a sweep: its files, what of it is done, its summary.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    str::FromStr,
};

use percuss_table::{Sink, csv::Csv, parquet::Parquet};

use super::{
    SweepError,
    journal::{Done, Entry, Journal, State},
    plan::{Digest, Plan},
    request::Keep,
    schedule::Job,
    spec::Combine,
    summary,
    uncertainty::{self, Columns, Spread},
};

const SWEEP_FILE: &str = "sweep.toml";
/// Beginning of the sweep file in a folder of a sweep, by which it is known: in a folder without it nothing is replaced.
const MARK: &str = "# The folder of a sweep: percuss sweep replaces this file, summaries and runs.\n";
const RUNS: &str = "runs";
/// Memory for the rows of a Parquet file \[bytes\].
const ROOM: usize = 1 << 30;

/// A part of a sweep: the cases whose numbers, counted from it on, are multiples of the number of parts apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub number: usize,
    pub of: usize,
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

    pub fn sweep_file(path: &Path) -> Result<PathBuf, SweepError> {
        let file = path.join(SWEEP_FILE);
        match fs::read(&file) {
            Ok(bytes) if bytes.starts_with(MARK.as_bytes()) => Ok(file),
            Ok(_) => {
                let file = file.display();
                Err(SweepError::Usage(format!(
                    "`{file}` was not written by a sweep; `percuss sweep {file} -o FOLDER` computes it in another folder"
                )))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let text = format!("`{}` is a folder without a sweep: it has no sweep.toml", path.display());
                Err(SweepError::Usage(text))
            }
            Err(error) => Err(SweepError::system(&file)(error)),
        }
    }

    /// Makes the folder, if it is not there, and locks the journal of the sweep or the shard. What is in the folder is read and written
    /// after that.
    pub fn lock(&self) -> Result<Journal, SweepError> {
        let fail = SweepError::system(&self.path);
        if self.path.exists() && !self.is_begun().map_err(&fail)? && Self::sweep_file(&self.path).is_err() {
            let path = self.path.display();
            return Err(SweepError::Failed(format!(
                "`{path}` is there and is no folder of a sweep; choose another one with -o"
            )));
        }
        fs::create_dir_all(&self.path).map_err(fail)?;
        Journal::open(&self.path.join(self.name("manifest", "jsonl")))
    }

    pub fn write_request(&self, plan: &Plan) -> Result<(), SweepError> {
        let text = toml::to_string(&plan.request).expect("a request is plain tables, text and numbers");
        self.write(SWEEP_FILE, format!("{MARK}{text}").as_bytes())
    }

    /// True of a folder with nothing in it but what a sweep leaves that was killed before it had its sweep file: journals without a line.
    fn is_begun(&self) -> io::Result<bool> {
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let name = entry.file_name();
            let is_part = |name: &str| name.starts_with("sweep.toml.") && name.ends_with(".part");
            let is_ours = |name: &str| is_part(name) || is_journal(name);
            if !name.to_str().is_some_and(is_ours)
                || (!is_part(&name.to_string_lossy()) && entry.metadata()?.len() > 0)
            {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Writes a file whole, unless it says the same.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SweepError> {
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

    /// What all journals say.
    pub fn done(&self) -> Result<Done, SweepError> {
        let mut journals: Vec<PathBuf> = fs::read_dir(&self.path)
            .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect())
            .map_err(SweepError::system(&self.path))?;
        journals.retain(|path| is_journal(&path.file_name().unwrap_or_default().to_string_lossy()));
        journals.sort();
        let mut done = Done::default();
        journals.iter().try_for_each(|path| done.read(path))?;
        Ok(done)
    }

    fn has(&self, number: usize) -> bool {
        self.shard.is_none_or(|shard| (number - 1) % shard.of == shard.number - 1)
    }

    /// Recording of a case that has this number: its path, and its name in the journal.
    fn recording(&self, number: usize, digest: Digest) -> (PathBuf, String) {
        let name = format!("{RUNS}/{number:06}-{}.mcap", &String::from(digest)[..8]);
        (self.path.join(&name), name)
    }

    /// What is left to do of the sweep or the shard, cases that are the same once. What an earlier sweep in the folder has done under
    /// another number is taken over: recordings get the names they would have, and the journal says so.
    ///
    /// * `again`: computes cases that have failed once more
    pub fn jobs(
        &self,
        plan: &Plan,
        done: &mut Done,
        again: bool,
        journal: &mut Journal,
    ) -> Result<Vec<Job>, SweepError> {
        let keeps = plan.request.keep == Keep::All;
        let (mut seen, mut jobs) = (BTreeSet::new(), Vec::new());
        for (number, planned) in (1..).zip(&plan.cases) {
            if !seen.insert(planned.digest) || !self.has(number) {
                continue;
            }
            let (path, name) = self.recording(number, planned.digest);
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
    fn make_room(&self, jobs: &[Job]) -> Result<(), SweepError> {
        let runs = self.path.join(RUNS);
        match jobs.iter().any(|job| job.recording.is_some()) {
            true => fs::create_dir_all(&runs).map_err(SweepError::system(&runs)),
            false => Ok(()),
        }
    }

    /// Gives what is done the number it has now; true if its recording is there, whole.
    fn take_over(
        &self,
        entry: &mut Entry,
        number: usize,
        (path, name): (&Path, &str),
        journal: &mut Journal,
    ) -> Result<bool, SweepError> {
        let (old, _) = self.recording(entry.case, entry.digest);
        if entry.case != number && !is_whole(path) && is_whole(&old) {
            fs::rename(&old, path).map_err(SweepError::system(path))?;
        }
        let is_there = is_whole(path);
        let file = is_there.then(|| name.to_owned());
        if entry.case != number || entry.file != file {
            (entry.case, entry.file) = (number, file);
            journal.append(entry)?;
        }
        Ok(is_there)
    }

    /// What is left to do once all cases are done: that whose recording is kept alone, the first with the largest value of the measure,
    /// if it is not there yet.
    pub fn last_jobs(&self, plan: &Plan, done: &Done) -> Result<Vec<Job>, SweepError> {
        let Keep::Worst(key) = &plan.request.keep else { return Ok(Vec::new()) };
        let value = |number: &usize| done.entries.get(&plan.cases[number - 1].digest)?.measures.get(key);
        let cases = (1..=plan.cases.len()).filter_map(|number| Some((number, value(&number)?)));
        let worst = cases.reduce(|worst, other| if other.1 > worst.1 { other } else { worst });
        let job = |(number, _): (usize, _)| Job {
            number,
            recording: Some(self.recording(number, plan.cases[number - 1].digest)),
        };
        let is_there = |job: &Job| job.recording.as_ref().is_some_and(|(path, _)| is_whole(path));
        let jobs: Vec<Job> = worst.map(job).filter(|job| !is_there(job)).into_iter().collect();
        self.make_room(&jobs)?;
        Ok(jobs)
    }

    /// Numbers of the cases of the sweep or the shard.
    fn numbers(&self, plan: &Plan) -> impl Iterator<Item = usize> {
        (1..=plan.cases.len()).filter(|number| self.has(*number))
    }

    /// How many cases of the sweep or the shard are warned of what.
    pub fn warnings(&self, plan: &Plan, done: &Done) -> BTreeMap<String, usize> {
        let mut counts = BTreeMap::new();
        let entries =
            self.numbers(plan).filter_map(|number| done.entries.get(&plan.cases[number - 1].digest));
        for warning in entries.flat_map(|entry| &entry.warnings) {
            *counts.entry(warning.clone()).or_default() += 1;
        }
        counts
    }

    pub fn write_summary(&self, plan: &Plan, done: &Done) -> Result<(), SweepError> {
        let written = |sink: &mut dyn Sink| summary::write(plan, done, self.numbers(plan), sink);
        let (mut csv, mut parquet) = (Vec::new(), Vec::new());
        let creator = concat!("percuss ", env!("CARGO_PKG_VERSION"));
        written(&mut Csv::new(&mut csv))
            .and_then(|()| written(&mut Parquet::new(&mut parquet, creator, ROOM)))
            .map_err(SweepError::system(&self.path))?;
        self.write(&self.name("summary", "csv"), &csv)?;
        self.write(&self.name("summary", "parquet"), &parquet)
    }

    /// Writes what a random sample comes to, if the sweep is one, and returns it.
    pub fn write_uncertainty(&self, plan: &Plan, done: &Done) -> Result<Vec<Spread>, SweepError> {
        if !matches!(plan.request.combine, Combine::Lhs(_)) {
            return Ok(Vec::new());
        }
        let (mut columns, mut csv) = (Columns::default(), Vec::new());
        let error = SweepError::system(&self.path);
        summary::write(plan, done, self.numbers(plan), &mut columns).map_err(&error)?;
        let spreads = columns.spreads(plan.keys().count());
        uncertainty::write(&spreads, &mut Csv::new(&mut csv)).map_err(error)?;
        self.write(&self.name("uncertainty", "csv"), &csv)?;
        Ok(spreads)
    }
}

/// True for the name of a journal, of the whole or of a shard.
fn is_journal(name: &str) -> bool {
    name == "manifest.jsonl" || (name.starts_with("manifest-") && name.ends_with(".jsonl"))
}

/// True for a recording that is complete: it ends with a footer. It has its name once it is, but a disk may lose what is behind the name.
fn is_whole(path: &Path) -> bool {
    /// Opcode and length of a footer, its content, and what every file of the format ends with.
    const END: usize = 1 + 8 + FOOTER + mcap::MAGIC.len();
    const FOOTER: usize = 20;
    let end = || -> io::Result<[u8; END]> {
        let mut end = [0; END];
        let mut file = File::open(path)?;
        file.seek(SeekFrom::End(-(END as i64)))?;
        file.read_exact(&mut end)?;
        Ok(end)
    };
    let is_footer = |end: [u8; END]| {
        end[0] == mcap::records::op::FOOTER
            && end[1..9] == (FOOTER as u64).to_le_bytes()
            && end.ends_with(mcap::MAGIC)
    };
    path.is_file() && end().is_ok_and(is_footer)
}

/// Number of cases that journals say nothing of.
pub fn missing(plan: &Plan, done: &Done) -> usize {
    plan.cases.iter().filter(|case| !done.entries.contains_key(&case.digest)).count()
}
