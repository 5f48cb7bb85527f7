//! Files that are worth something before they are complete.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
};

use tempfile::TempPath;

use crate::{Place, counted::Counted, output::rename, repeated, synchronise_folder};

/// Why a file cannot be begun.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// The file exists and is not to be replaced.
    #[error("`{}` exists; choose another output with -o, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// An earlier attempt has left this, and it is not to be replaced.
    #[error("`{}` is left of an earlier run that did not end; overwrite it with --force", .0.display())]
    Left(PathBuf),
    /// Another process is writing the same file.
    #[error("`{}` is being written by another process", .0.display())]
    Busy(PathBuf),
    /// The system refuses.
    #[error("cannot create `{}`: {error}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// Cause.
        error: io::Error,
    },
}

/// Name under which `path` is written.
pub fn part_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, Into::into);
    name.push(".part");
    path.with_file_name(name)
}

/// A file that is written as `NAME.part` and gets its name when it is complete. Dropped before, it stays under that name.
///
/// It is locked while it is written: two processes cannot write the same file. Writes are not buffered.
#[derive(Debug)]
pub struct Part {
    file: Counted,
    /// Name of the part, and the name asked for; none for a device.
    names: Option<(PathBuf, PathBuf)>,
    overwrite: bool,
}

impl Part {
    /// Begins the file `path`.
    ///
    /// * `overwrite`: replace a file of this name, and a part that was left
    ///
    /// # Errors
    ///
    /// See [`PartError`].
    pub fn create(path: &Path, overwrite: bool) -> Result<Self, PartError> {
        let system = |error| PartError::System { path: path.into(), error };
        let path = match Place::of(path).map_err(system)? {
            Place::Device(file) => return Ok(Self { file: Counted::new(file), names: None, overwrite }),
            Place::File(path) => path,
        };
        if !overwrite && path.exists() {
            return Err(PartError::Exists(path));
        }
        let part = part_of(&path);
        let file = open_locked(&part, overwrite)?;
        // it may have been completed by another process since
        if !overwrite && path.exists() {
            drop(fs::remove_file(&part));
            return Err(PartError::Exists(path));
        }
        Ok(Self { file: Counted::new(file), names: Some((part, path)), overwrite })
    }

    /// Name of the file as long as it is written; none for a device.
    pub fn path(&self) -> Option<&Path> {
        self.names.as_ref().map(|(part, _)| part.as_path())
    }

    /// The same file, to synchronise it beside the writing.
    pub fn handle(&self) -> Counted {
        self.file.clone()
    }

    /// Synchronises the file with the disk.
    ///
    /// # Errors
    ///
    /// What the system says.
    pub fn synchronise(&self) -> io::Result<()> {
        self.file.synchronise()
    }

    /// Gives the file its name.
    ///
    /// * `lasting`: synchronise it and its folder with the disk
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AlreadyExists`] if there is one by now that is not to be replaced; else what the system says. In either
    /// case the file stays under the name of its part.
    pub fn commit(self, lasting: bool) -> io::Result<()> {
        if lasting {
            self.synchronise()?;
        }
        let Some((part, path)) = self.names else { return Ok(()) };
        if let Err((error, part)) = rename(TempPath::try_from_path(part)?, &path, self.overwrite) {
            // dropping it would remove the file
            part.keep()?;
            return Err(error);
        }
        if lasting { synchronise_folder(&path) } else { Ok(()) }
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Creates a part, or empties one that was left, and locks it.
fn open_locked(part: &Path, overwrite: bool) -> Result<File, PartError> {
    let system = |error| PartError::System { path: part.into(), error };
    loop {
        let mut options = OpenOptions::new();
        options.write(true);
        let created = options.clone().create_new(true).open(part);
        let (file, is_new) = match created {
            Ok(file) => (file, true),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => match options.open(part) {
                Ok(file) => (file, false),
                // the other process has completed or removed it in between
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(system(error)),
            },
            Err(error) => return Err(system(error)),
        };
        match repeated(|| match file.try_lock() {
            Ok(()) => Ok(true),
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(error)) => Err(error),
        }) {
            Ok(true) => {}
            Ok(false) => return Err(PartError::Busy(part.into())),
            // a file system without locks
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(error) => return Err(system(error)),
        }
        if !is_same(&file, part).map_err(system)? {
            continue;
        }
        // one that another process has just created, and not locked yet, is empty
        if !is_new && !overwrite && file.metadata().map_err(system)?.len() > 0 {
            return Err(PartError::Left(part.into()));
        }
        file.set_len(0).map_err(system)?;
        return Ok(file);
    }
}

/// True if a name still stands for an open file.
#[cfg(unix)]
fn is_same(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match fs::metadata(path) {
        Ok(named) => Ok((open.dev(), open.ino()) == (named.dev(), named.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Elsewhere an open file cannot be renamed by others.
#[cfg(not(unix))]
fn is_same(_: &File, path: &Path) -> io::Result<bool> {
    Ok(path.exists())
}
