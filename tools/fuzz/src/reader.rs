//! What the targets of the reader share.

use std::io;

use percuss_reader::recording::Limits;
use percuss_table::{Cell, Heading, Sink};

/// Memory that reading may take.
pub const LIMITS: Limits = Limits { memory: 64 << 20 };

/// Takes rows and keeps none.
#[derive(Default)]
pub struct Nowhere;

impl Sink for Nowhere {
    fn begin(&mut self, _headings: &[Heading]) -> io::Result<()> {
        Ok(())
    }

    fn row(&mut self, _cells: &[Cell]) -> io::Result<()> {
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}
