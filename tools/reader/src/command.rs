//! The verbs, one file each: from arguments to a result, printing left to [`crate::cli`].

pub mod cat;
pub mod diff;
pub mod export;
pub mod info;
pub mod plot;
pub mod recover;
pub mod schema;
pub mod trace;
pub mod verify;
