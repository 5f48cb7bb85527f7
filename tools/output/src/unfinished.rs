//! Temporary files of this process, for the signal that ends it: a process that dies drops nothing.

use std::{
    collections::BTreeSet,
    fs::File,
    io,
    path::PathBuf,
    sync::{Mutex, MutexGuard, PoisonError},
};

use tempfile::NamedTempFile;

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Entry of a temporary file, for as long as it is one.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes a temporary file and its entry.
    pub fn begin(
        make: impl FnOnce() -> io::Result<NamedTempFile<File>>,
    ) -> io::Result<(NamedTempFile<File>, Self)> {
        let mut entries = unfinished();
        let named = make()?;
        entries.insert(named.path().to_owned());
        let entry = Self(named.path().to_owned());
        Ok((named, entry))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().remove(&self.0);
    }
}

#[cfg(feature = "signals")]
/// Removes every [`Output`](crate::Output) of this process that is not complete, and does `then` before another can begin: that is to
/// end the process.
pub fn discard(then: impl FnOnce()) {
    let mut entries = unfinished();
    for path in &*entries {
        // one that has just got its name is no longer there
        let _ = std::fs::remove_file(path);
    }
    entries.clear();
    then();
}
