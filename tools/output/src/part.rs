//! Files that are worth something before they are complete.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
};

use tempfile::TempPath;

use crate::{
    OutputError, counted::Counted, file_of, open_device, output::rename, repeated, synchronise_folder,
};

/// Why a file cannot be begun.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// The file exists and is not to be replaced.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// An earlier attempt has left this, and it is not to be replaced.
    #[error(
        "`{}` is left of an earlier run that did not end; `percuss run` continues it with --resume, --force overwrites it",
        .0.display()
    )]
    Left(PathBuf),
    /// There is nothing of an earlier attempt.
    #[error("`{}` does not exist: nothing is left of an earlier run", .0.display())]
    Nothing(PathBuf),
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
        let Some(path) = target(path, overwrite)? else {
            let file = open_device(path).map_err(system(path))?;
            return Ok(Self { file: Counted::new(file), names: None, overwrite });
        };
        let part = part_of(&path);
        let file = open_locked(&part, overwrite)?;
        // it may have been completed by another process since
        OutputError::refuse_existing(Some(&path), overwrite).inspect_err(|_| drop(fs::remove_file(&part)))?;
        Ok(Self { file: Counted::new(file), names: Some((part, path)), overwrite })
    }

    /// Begins the file `path` anew, in place of the part that an earlier attempt has left. That one stays until
    /// [`Left::replace`].
    ///
    /// * `overwrite`: replace a file of this name
    ///
    /// # Errors
    ///
    /// See [`PartError`].
    pub fn resume(path: &Path, overwrite: bool) -> Result<(Self, Left), PartError> {
        let Some(path) = target(path, overwrite)? else { return Err(PartError::Nothing(part_of(path))) };
        let part = part_of(&path);
        let left = match OpenOptions::new().read(true).write(true).open(&part) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(PartError::Nothing(part)),
            left => left.map_err(system(&part))?,
        };
        lock(&left, &part)?;
        if !has_name(&left, &part).map_err(system(&part))? {
            return Err(PartError::Busy(part));
        }
        // one name: what an attempt leaves of it, which was killed here, the next one replaces; the holder of the lock above is the only one
        let mut new = part.clone().into_os_string();
        new.push(".new");
        let new = PathBuf::from(new);
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(&new);
        let file = file.map_err(system(&new))?;
        lock(&file, &new)?;
        let file = Counted::new(file);
        let temporary = TempPath::try_from_path(&new).map_err(system(&new))?;
        let left = Left { file: left, new: file.clone(), temporary, part: part.clone() };
        Ok((Self { file, names: Some((part, path)), overwrite }, left))
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

/// What an earlier attempt has left of a file, while another one is written that is to take its place.
#[derive(Debug)]
pub struct Left {
    /// The part that was left, locked.
    file: File,
    new: Counted,
    /// Name of the new file until it takes the place of the part. Dropped before, it is removed.
    temporary: TempPath,
    part: PathBuf,
}

impl Left {
    /// The part that was left.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Puts what has been written of the new file in its place.
    ///
    /// # Errors
    ///
    /// What the system says; the part stays.
    pub fn replace(self) -> io::Result<()> {
        self.new.synchronise()?;
        if cfg!(windows) {
            // an open file is not replaced there
            drop(self.file);
        }
        rename(self.temporary, &self.part, true).map_err(|(error, _)| error)?;
        synchronise_folder(&self.part)
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

/// The error of a call of the system.
fn system(path: &Path) -> impl Fn(io::Error) -> PartError + Copy {
    move |error| PartError::System { path: path.into(), error }
}

/// The file that is to be written, refused if there is one; `None` for a device.
fn target(path: &Path, overwrite: bool) -> Result<Option<PathBuf>, PartError> {
    let file = file_of(path).map_err(system(path))?;
    OutputError::refuse_existing(file.as_deref(), overwrite)?;
    Ok(file)
}

/// Creates a part, or empties one that was left, and locks it.
fn open_locked(part: &Path, overwrite: bool) -> Result<File, PartError> {
    loop {
        let mut options = OpenOptions::new();
        // the content stays until it is known to be of no use
        let file = options.write(true).create(true).truncate(false).open(part).map_err(system(part))?;
        lock(&file, part)?;
        // another process may have completed or removed it in between
        if !has_name(&file, part).map_err(system(part))? {
            continue;
        }
        // one that another process has just created, and not locked yet, is empty
        if !overwrite && file.metadata().map_err(system(part))?.len() > 0 {
            return Err(PartError::Left(part.into()));
        }
        file.set_len(0).map_err(system(part))?;
        return Ok(file);
    }
}

/// Locks a file as long as it is open.
fn lock(file: &File, path: &Path) -> Result<(), PartError> {
    match repeated(|| match file.try_lock() {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }) {
        Ok(true) => Ok(()),
        Ok(false) => Err(PartError::Busy(path.into())),
        // a file system without locks
        Err(error) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        Err(error) => Err(system(path)(error)),
    }
}

/// True if a name still stands for an open file.
#[cfg(unix)]
pub fn has_name(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match fs::metadata(path) {
        Ok(named) => Ok((open.dev(), open.ino()) == (named.dev(), named.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// True if a name still stands for an open file, which elsewhere others cannot rename.
#[cfg(not(unix))]
pub fn has_name(_: &File, path: &Path) -> io::Result<bool> {
    Ok(path.exists())
}
