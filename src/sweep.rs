//! Sweeps: a case with keys that vary, thousands of cases at a time, on all cores, restartable, alone or in shards.
//!
//! A sweep lives in a folder of its own:
//!
//! | File | What it is |
//! |---|---|
//! | `sweep.toml` | what was asked: the case with its text, what is set and what varies. Its first line marks the folder as one of a sweep |
//! | `manifest.jsonl` | the journal: a line for every case that is done, only ever appended to |
//! | `summary.csv`, `summary.parquet` | a row for every case, in their order: what varies, and what [`percuss_table::measures`] reads off the run |
//! | `uncertainty.csv` | of a sample by `--lhs`: mean and 5–95 % band of every measure, and which input explains it |
//! | `runs/` | recordings, named by the number of the case and the beginning of its digest |
//! | `tasks-JOB/` | which task of an array of Slurm has which shard |
//! | `manifest-I-of-N.jsonl`, `summary-I-of-N.csv`, … | of shard I of N |
//!
//! A case is known by the digest of all that its results depend on ([`plan::Digest`]): what the journals have of it is not computed again,
//! whatever its number in the sweep is now. The summary is made of the journals alone, so it is the same however often a sweep was stopped and
//! however it was cut into shards. A line of the journal is written when the recording of its case, if it is kept, is on the disk and has its name;
//! all lines are on the disk before the summary is written. A recording without its end, as a failing disk leaves one, is computed again.
//!
//! A sweep replaces nothing that a sweep has not made: it begins in a new or empty folder, and goes on in one that has the mark. What is in the
//! folder is read and written once the journal is locked, so a process that is refused changes nothing. Names of recordings follow from the
//! cases; what a journal says of them is for people and reports.
//!
//! # Files
//!
//! A line of `manifest.jsonl` is an object: `case`, the number; `digest`; `state`, `completed`, `stopped` (as `run.stop` asks) or `failed`, then with a
//! `message`; `file`, the recording from the folder of the sweep, or null; `seconds`; `host`; `measures` by name, in the units of the case;
//! `warnings`, their subjects; last `crc32`, the checksum of what stands before it. Damaged lines are reported, and their cases computed again.
//! The summary has the columns `case`, the keys that vary (numbers where all values are, quantities in SI), `status` (the state), the measures,
//! each with its unit, empty where there is none (`percuss-read summary --help` says what they are), and `warnings`: the subjects of the
//! [warnings](crate::advice::Finding) of the case and its results, `base;strain`. Cases that failed have a row without measures.
//!
//! Folders that are shared need no locks: every shard writes its own journal. Two processes on one machine cannot write the same one.
//!
//! The guide has an example, `tools/guide/src/sweeps.md`.
//!
//! # Modules
//!
//! * [`request`], [`spec`]: what is asked for; lists, ranges, tables, samples
//! * [`plan`]: the cases of a sweep, all checked before the first is run
//! * [`journal`], [`folder`]: what is done; the files of a sweep
//! * [`schedule`]: cases on threads, within a bound of memory
//! * `measure`, `summary`, `uncertainty`: what is read off a run on the way; the table of it, and of a random sample what it comes to
//! * [`script`]: job scripts for schedulers of clusters

use std::{
    io,
    path::{Path, PathBuf},
};

use percuss_output::OutputError;

use crate::{case::CaseErrors, session::RunError};

pub(crate) mod folder;
pub mod journal;
mod measure;
pub(crate) mod plan;
pub(crate) mod request;
pub(crate) mod schedule;
pub(crate) mod script;
pub(crate) mod spec;
mod summary;
pub(crate) mod uncertainty;

/// Why a sweep cannot be planned, or does not go on; none of it is the fault of a case that is computed.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The case that all others vary is wrong.
    #[error(transparent)]
    Case(#[from] CaseErrors),
    /// Some cases are wrong.
    #[error(transparent)]
    Cases(#[from] plan::WrongCases),
    /// What is asked for is not possible.
    #[error("{0}")]
    Usage(String),
    /// Another process works on the same cases.
    #[error("another percuss works on this sweep: `{}` is locked", .0.display())]
    Busy(PathBuf),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The recording of a case failed, as on a full disk.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The folder is another one, a case has changed, or the system refuses.
    #[error("{0}")]
    Failed(String),
}

impl SweepError {
    /// Why the system refuses a file or folder.
    fn system(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::Failed(format!("`{}`: {error}", path.display()))
    }

    /// Why a file that is read cannot be.
    fn unread(path: &Path) -> impl Fn(String) -> Self {
        move |what| Self::Usage(format!("cannot read `{}`: {what}", path.display()))
    }
}

/// Largest number of cases of a sweep.
pub const MAX_CASES: usize = 1_000_000;
