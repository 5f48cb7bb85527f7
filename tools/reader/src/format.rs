//! Output formats, one file each.

pub mod csv;
pub mod json_lines;
