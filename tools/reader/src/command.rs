//! The verbs, one file each: from arguments to a result, printing left to the command line.

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
