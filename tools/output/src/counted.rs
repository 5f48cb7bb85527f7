//! A file that counts what is written to it.

use std::{
    fs::File,
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use crate::synchronise;

/// A file that counts what is written to it, and says so in its errors. Its clones are the same file.
#[derive(Clone, Debug)]
pub struct Counted {
    file: Arc<File>,
    written: Arc<AtomicU64>,
}

impl Counted {
    pub(crate) fn new(file: File) -> Self {
        Self { file: Arc::new(file), written: Arc::default() }
    }

    /// Synchronises what is written so far with the disk.
    pub fn synchronise(&self) -> io::Result<()> {
        synchronise(&self.file).map_err(|error| self.explain("synchronising", &error))
    }

    /// An error with the bytes that were written before.
    fn explain(&self, doing: &str, error: &io::Error) -> io::Error {
        // a number for people
        let written = self.written.load(Ordering::Relaxed);
        io::Error::new(error.kind(), format!("{doing} after {written} bytes: {error}"))
    }
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match (&*self.file).write(bytes) {
            Ok(written) => {
                self.written.fetch_add(written as u64, Ordering::Relaxed);
                Ok(written)
            }
            // callers repeat the call
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Err(error),
            Err(error) => Err(self.explain("writing", &error)),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        (&*self.file).flush()
    }
}
