//! The verbs, one file each: from arguments to a result, printing left to [`crate::cli`].

pub mod info;
pub mod trace;
