//! The verbs, one file each: their arguments, and what they do.
//!
//! A new verb is a file here with a [`Verb`](crate::verb::Verb), and its name in `cli.rs` with the files that it reads.

pub(crate) mod animate;
pub(crate) mod cat;
pub mod diff;
pub(crate) mod export;
pub mod info;
pub(crate) mod plot;
pub mod recover;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod schema;
pub mod summary;
pub mod trace;
pub mod verify;
mod view;
