//! Checkpoints: the state of a run in a file, from which `percuss run --resume` continues.
//!
//! A checkpoint of `NAME.mcap` is `NAME.mcap.checkpoint` beside it. It belongs to the messages that the part of the recording has
//! by then, which are on the disk before it is, and is written atomically: the one before stays until it is complete. When the recording is
//! complete it is removed.
//!
//! ```text
//! magic · version of this format · length of the head · head · zstd(state) · CRC-32 of all before
//! ```
//!
//! all little-endian. The head has the version of percuss, the revision of its numerics, the engine, the complete case, the step, and of what is recorded the
//! number of messages of every channel, their size, their checksum and what was measured of them; the state is that of the [`Simulation`]. Channels have none.
//!
//! A state is restored only if percuss, numerics, engine and case are the same, and if the part begins with the messages that the checkpoint
//! belongs to (what follows them, an end or what was recorded since, is cut off; whatever does not fit is an error that changes neither file): then the run gives the same messages, bit for bit, as one
//! that was never interrupted, whatever the number of threads is. When checkpoints are written, and how often, changes no message, so
//! `run.checkpoint_every` may differ.
//!
//! A file is not trusted: its checksum is compared before anything of it is decoded, and no length in it takes memory before
//! as many bytes have been read.

use std::{
    collections::BTreeMap,
    fmt::Display,
    fs::File,
    io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use crc32fast::Hasher;
use percuss_output::{Part, PartError, part_of, text::clipped};
use serde::{Deserialize, Serialize};

use crate::{
    case::Case,
    recording::NUMERICS,
    session::Recorded,
    simulation::{Engine, Simulation},
    state::{SaveState, StateError, StateReader, StateWriter},
};

mod observer;

pub use observer::Checkpoints;

const MAGIC: [u8; 8] = *b"\x89percpt\n";

/// Version of the format.
///
/// * 1: the first.
/// * 2: with the largest strain of cells.
/// * 3: the head has the revision of the numerics.
/// * 4: the head has size and checksum of what was recorded.
/// * 5: and what was measured of it.
/// * 6: and what it was warned of.
/// * 7: and under the plain stepper the largest tractions of interfaces.
/// * 8: the head has what sensors hold back.
/// * 9: and under the plain stepper the largest ratios of stresses to strengths.
/// * 10: these under the fast engine too, with the first beyond 1; of an indenter that gives the largest tractions of interfaces.
const VERSION: u32 = 10;

/// Size of magic and version, and of the checksum \[bytes\].
const BEGINNING: u64 = MAGIC.len() as u64 + 4;
const CHECKSUM: u64 = 4;

/// Zstandard's fast level: waves hardly compress, and what is at rest does at any level.
const ZSTD_LEVEL: i32 = 1;

/// Differences of two cases that an error names, and characters of their values.
const MOST_DIFFERENCES: usize = 5;
const LONGEST: usize = 60;

/// What a checkpoint belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    percuss: String,
    numerics: u32,
    engine: String,
    /// The case with every default written out.
    case: String,
    recorded: Recorded,
}

/// Why a checkpoint cannot be written or restored.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The system refuses.
    #[error("cannot {0} the checkpoint `{path}`: {2}", path = .1.display())]
    System(&'static str, PathBuf, io::Error),
    /// It is damaged, or belongs to another program or case.
    #[error("{0} begin the run anew with --force in place of --resume")]
    Unfit(String),
}

/// Name of the checkpoint of a recording.
pub fn checkpoint_of(recording: &Path) -> PathBuf {
    let mut name = recording.file_name().unwrap_or_default().to_owned();
    name.push(".checkpoint");
    recording.with_file_name(name)
}

/// Writes a checkpoint, in place of an earlier one once it is on the disk; an earlier one stays if that fails. Returns its size \[bytes\].
fn write(path: &Path, head: &Head, state: &mut dyn SaveState) -> Result<u64, CheckpointError> {
    write_file(path, head, state).map_err(|error| {
        // delete the unfinished file: the disk space is needed
        drop(std::fs::remove_file(part_of(path)));
        CheckpointError::System("write", path.into(), error)
    })
}

fn write_file(path: &Path, head: &Head, state: &mut dyn SaveState) -> io::Result<u64> {
    // unfinished checkpoints share one name, so leftovers are overwritten
    let output = Part::create(path, true).map_err(|error| match error {
        PartError::System { error, .. } => error,
        error => io::Error::other(error),
    })?;
    let mut file = Checked { out: BufWriter::new(output), hasher: Hasher::new(), size: 0 };
    file.write_all(&MAGIC)?;
    file.write_all(&VERSION.to_le_bytes())?;
    StateWriter::new(&mut file).put(head)?;
    let mut compressed = zstd::Encoder::new(&mut file, ZSTD_LEVEL)?;
    state.save(&mut StateWriter::new(&mut compressed))?;
    compressed.finish()?;
    let Checked { mut out, hasher, size } = file;
    out.write_all(&hasher.finalize().to_le_bytes())?;
    out.into_inner().map_err(|error| error.into_error())?.commit(true)?;
    Ok(size + CHECKSUM)
}

/// A stream whose checksum is computed while it is written.
struct Checked<W> {
    out: W,
    hasher: Hasher,
    size: u64,
}

impl<W: Write> Write for Checked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.size += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// True if the first `content` bytes of a file have the checksum that follows them.
fn is_sound(file: &mut File, content: u64) -> io::Result<bool> {
    file.seek(SeekFrom::Start(0))?;
    let mut checked = Checked { out: io::sink(), hasher: Hasher::new(), size: 0 };
    io::copy(&mut BufReader::with_capacity(1 << 16, &mut *file).take(content), &mut checked)?;
    file.seek(SeekFrom::Start(content))?;
    let mut checksum = [0; CHECKSUM as usize];
    file.read_exact(&mut checksum)?;
    Ok(checked.size == content && checked.hasher.finalize() == u32::from_le_bytes(checksum))
}

/// Removes a checkpoint, if there is one, and what a kill may have left of the next.
///
/// # Errors
///
/// The system refuses.
pub fn remove(path: &Path) -> Result<(), CheckpointError> {
    [path.to_owned(), part_of(path)].into_iter().try_for_each(|path| match std::fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(CheckpointError::System("remove", path, error))
        }
        _ => Ok(()),
    })
}

/// Puts a simulation of `case` into the state of a checkpoint, and returns what was recorded by then.
///
/// # Errors
///
/// There is no checkpoint, it is damaged, or of another program or case. The simulation is of no use then.
pub fn load(
    path: &Path,
    case: &Case,
    engine: Engine,
    simulation: &mut Simulation,
) -> Result<Recorded, CheckpointError> {
    let system = |error| CheckpointError::System("read", path.into(), error);
    let damaged = |what: &dyn Display| {
        CheckpointError::Unfit(format!("the checkpoint `{}` is damaged: {what};", path.display()))
    };
    let mut file = File::open(path).map_err(system)?;
    let length = file.metadata().map_err(system)?.len();
    let mut magic = [0; MAGIC.len()];
    let is_ours = length >= magic.len() as u64 && {
        file.read_exact(&mut magic).map_err(system)?;
        magic == MAGIC
    };
    if !is_ours {
        return Err(CheckpointError::Unfit(format!("`{}` is no checkpoint of percuss;", path.display())));
    }
    let content = length.checked_sub(CHECKSUM).filter(|content| *content >= BEGINNING);
    let content = content.ok_or_else(|| damaged(&"it is cut off"))?;
    if !is_sound(&mut file, content).map_err(system)? {
        return Err(damaged(&"its checksum is another one"));
    }
    file.seek(SeekFrom::Start(MAGIC.len() as u64)).map_err(system)?;
    let mut compressed = BufReader::new(file.take(content - MAGIC.len() as u64));
    let mut version = [0; 4];
    compressed.read_exact(&mut version).map_err(system)?;
    let other = |found: String, here: String| {
        CheckpointError::Unfit(format!(
            "the checkpoint `{}` is of {found}, this is {here}: only the same gives the same numbers; continue the run with that, or",
            path.display()
        ))
    };
    let [found, here] = [u32::from_le_bytes(version), VERSION].map(|version| format!("format {version}"));
    if found != here {
        return Err(other(found, here));
    }
    let head: Head = StateReader::new(&mut compressed).get().map_err(|error| damaged(&error))?;
    let found = programs(&head.percuss, head.numerics, &head.engine);
    let here = programs(env!("CARGO_PKG_VERSION"), NUMERICS, engine.name());
    if let Some((found, here)) = found.into_iter().zip(here).find(|(found, here)| found != here) {
        return Err(other(found, here));
    }
    if let Some(differences) = differences(&head.case, case).map_err(|error| damaged(&error.message()))? {
        return Err(CheckpointError::Unfit(format!(
            "the checkpoint `{}` belongs to another case: {differences}; restore the case, or",
            path.display()
        )));
    }
    let load = || -> Result<(), StateError> {
        let mut state = zstd::Decoder::with_buffer(compressed)?;
        simulation.load(&mut StateReader::new(&mut state))?;
        let (next, expected) = (simulation.next_step(), head.recorded.step + 1);
        StateError::unless(next == expected, "number of the next step", next)
    };
    load().map_err(|error| damaged(&error))?;
    Ok(head.recorded)
}

impl Head {
    fn new(case: &Case, engine: Engine, recorded: Recorded) -> Self {
        Self {
            percuss: env!("CARGO_PKG_VERSION").into(),
            numerics: NUMERICS,
            engine: engine.name().into(),
            case: case.resolved_toml(),
            recorded,
        }
    }
}

/// What must be the same for the same numbers, in words.
fn programs(percuss: &str, numerics: u32, engine: &str) -> [String; 3] {
    [
        format!("percuss {percuss}"),
        format!("revision {numerics} of the numerics"),
        format!("--engine {engine}"),
    ]
}

/// Where a resolved case that was recorded differs from one that is to be computed, but for what changes no result; `None` if nowhere.
///
/// # Errors
///
/// The text is no TOML.
pub(crate) fn differences(recorded: &str, case: &Case) -> Result<Option<String>, toml::de::Error> {
    let parse = |text: &str| {
        let mut table: toml::Table = toml::from_str(text)?;
        if let Some(toml::Value::Table(run)) = table.get_mut("run") {
            run.remove("checkpoint_every");
        }
        Ok(toml::Value::Table(table))
    };
    let mut differences = Vec::new();
    compare("", Some(&parse(recorded)?), Some(&parse(&case.resolved_toml())?), &mut differences);
    if differences.is_empty() {
        return Ok(None);
    }
    let more = differences.len().saturating_sub(MOST_DIFFERENCES);
    differences.truncate(MOST_DIFFERENCES);
    let mut differences = differences.join(", ");
    if more > 0 {
        differences += &format!(", and {more} more");
    }
    Ok(Some(differences))
}

/// Collects where two values differ.
fn compare(key: &str, there: Option<&toml::Value>, here: Option<&toml::Value>, found: &mut Vec<String>) {
    if there == here {
        return;
    }
    let [Some(there), Some(here)] = [there, here].map(|value| value.and_then(entries)) else {
        let text = |value: Option<&toml::Value>| match value {
            Some(value) => clipped(&value.to_string(), LONGEST).into_owned(),
            None => "none".to_owned(),
        };
        found.push(format!("{key} is {} there, {} here", text(there), text(here)));
        return;
    };
    let others = here.keys().filter(|name| !there.contains_key(*name));
    for name in there.keys().chain(others) {
        let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
        compare(&key, there.get(name).copied(), here.get(name).copied(), found);
    }
}

/// The entries of a table, or of a list of tables by their numbers from 1 on.
fn entries(value: &toml::Value) -> Option<BTreeMap<String, &toml::Value>> {
    match value {
        toml::Value::Table(table) => Some(table.iter().map(|(name, value)| (name.clone(), value)).collect()),
        toml::Value::Array(list) if list.iter().all(toml::Value::is_table) => {
            Some((1..).zip(list).map(|(number, value): (usize, _)| (number.to_string(), value)).collect())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests;
