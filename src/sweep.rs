//! Sweeps: a case with keys that vary, thousands of cases at a time, on all cores, restartable, alone or in shards.
//!
//! A sweep lives in a folder of its own:
//!
//! | File | What it is |
//! |---|---|
//! | `sweep.toml` | what was asked: the case, what is set and what varies |
//! | `case.toml` | a copy of the case, unless it is a built-in one |
//! | `manifest.jsonl` | the journal: a line for every case that is done, only ever appended to |
//! | `summary.csv`, `summary.parquet` | a row for every case, in their order: what varies, and what [`percuss_table::measures`] reads off the run |
//! | `runs/` | recordings, named by the number of the case and the beginning of its digest |
//! | `manifest-I-of-N.jsonl`, `summary-I-of-N.csv`, … | of shard I of N |
//!
//! A case is known by the digest of all that its results depend on ([`Digest`]): what the journals have of it is not computed again,
//! whatever its number in the sweep is now. The summary is made of the journals alone, so it is the same however often a sweep was stopped and
//! however it was cut into shards. A line of the journal is written when the recording of its case, if it is kept, has its name.
//!
//! * [`request`], [`spec`]: what is asked for; lists, ranges, tables, samples
//! * [`plan`]: the cases of a sweep, all checked before the first is run
//! * [`journal`], [`folder`]: what is done; the files of a sweep
//! * [`schedule`]: cases on threads, within a bound of memory
//! * `measure`, `summary`: what is read off a run on the way; the table of it
//! * [`script`]: job scripts for schedulers of clusters

pub mod folder;
pub mod journal;
mod measure;
pub mod plan;
pub mod request;
pub mod schedule;
pub mod script;
pub mod spec;
mod summary;

/// Largest number of cases of a sweep.
pub const MAX_CASES: usize = 1_000_000;
