//! The verbs, one file each: their arguments, and what they do.
//!
//! A new verb is a file here with a [`Verb`](crate::verb::Verb), and its name in `cli.rs`.

pub mod animate;
pub mod cat;
pub mod diff;
pub mod export;
pub mod info;
pub mod plot;
mod points;
pub mod recover;
pub mod replay;
pub mod report;
pub mod schema;
pub mod summary;
pub mod trace;
pub mod verify;
mod view;
