//! Tables with units, and what is measured of an impact: shared by the solver and the reader, so that both write the same table of
//! the same numbers.
//!
//! | Module | Owns |
//! |---|---|
//! | `table` | named columns with units, cells, and what takes the rows |
//! | [`csv`], [`parquet`] | what takes rows, one file per output format |
//! | [`measures`] | measures of an impact, from its numbers step by step |
//! | [`units`] | units, dimensionless and of the SI, and their prefixes |
//!
//! [`csv`] and [`parquet`] belong to the default feature `formats`.

#[cfg(feature = "formats")]
pub mod csv;
pub mod measures;
#[cfg(feature = "formats")]
pub mod parquet;
mod table;
pub mod units;

pub use table::{Cell, CellType, Heading, Sink};
