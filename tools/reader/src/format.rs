//! Output formats, one file each.

pub mod aligned;
pub mod csv;
pub mod json;
pub mod json_lines;
pub mod npy;
pub mod parquet;
pub mod vtk;
