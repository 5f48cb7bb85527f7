//! Output formats, one file each, beside those of `percuss-table`: CSV and Parquet.

pub mod aligned;
pub mod json;
pub(crate) mod mapping;
pub mod npy;
pub mod sac;
pub mod vtk;
