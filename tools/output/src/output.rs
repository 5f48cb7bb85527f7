//! Files that leave nothing when they fail.

use std::{
    ffi::OsString,
    fs::OpenOptions,
    io::{self, Write},
    path::{Path, PathBuf},
};

use tempfile::{Builder, TempPath};

use crate::{
    counted::Counted, file_of, folder, open_device, repeated, synchronise_folder, unfinished::Unfinished,
};

/// Longest part of the name of a file in that of its temporary file \[bytes\]: file systems allow 255 in all.
const LONGEST_NAME: usize = 200;

/// A file that gets its name when it is complete. Dropped before, it leaves nothing.
///
/// Writes are not buffered.
#[derive(Debug)]
pub struct Output {
    file: Counted,
    /// Temporary name and its entry, and the name asked for; none for a device.
    names: Option<(TempPath, Unfinished, PathBuf)>,
    overwrite: bool,
}

impl Output {
    /// Begins the file `path`.
    ///
    /// * `overwrite`: replace a file of this name
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AlreadyExists`] if it is not to be replaced; else what the system says.
    pub fn create(path: &Path, overwrite: bool) -> io::Result<Self> {
        let Some(path) = file_of(path)? else {
            return Ok(Self { file: Counted::new(open_device(path)?), names: None, overwrite });
        };
        if !overwrite && path.exists() {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let create = |path: &Path| OpenOptions::new().write(true).create_new(true).open(path);
        let prefix = prefix(&path);
        let make = || Builder::new().prefix(&prefix).suffix(".part").make_in(folder(&path), create);
        let (named, entry) = Unfinished::begin(make)?;
        let (file, temporary) = named.into_parts();
        Ok(Self { file: Counted::new(file), names: Some((temporary, entry, path)), overwrite })
    }

    /// Synchronises the file with the disk and gives it its name.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AlreadyExists`] if there is one by now that is not to be replaced; else what the system says. In either
    /// case nothing new is left.
    pub fn commit(self) -> io::Result<()> {
        self.file.synchronise()?;
        match self.rename()? {
            Some(path) => synchronise_folder(&path),
            None => Ok(()),
        }
    }

    /// Gives one of many files its name: they are synchronised together by [`synchronise_all`](crate::synchronise_all), in a second where
    /// each by itself takes minutes.
    pub fn commit_later(self) -> io::Result<()> {
        if cfg!(target_os = "linux") { self.rename().map(drop) } else { self.commit() }
    }

    /// The name that the file has got, unless it is a device.
    fn rename(self) -> io::Result<Option<PathBuf>> {
        let Some((temporary, _entry, path)) = self.names else { return Ok(None) };
        rename(temporary, &path, self.overwrite).map_err(|(error, _)| error)?;
        Ok(Some(path))
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Why there is no output.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The file exists and is not to be replaced.
    #[error("`{}` exists; choose another output with -o, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// The system refuses.
    #[error("cannot write `{}`: {error}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// Cause.
        error: io::Error,
    },
}

impl OutputError {
    /// An error of the system, which also says that a file exists.
    pub fn new(path: impl Into<PathBuf>, error: io::Error) -> Self {
        let path = path.into();
        match error.kind() {
            io::ErrorKind::AlreadyExists => Self::Exists(path),
            _ => Self::System { path, error },
        }
    }

    /// Refuses an output that exists, unless it may be overwritten.
    ///
    /// # Errors
    ///
    /// [`OutputError::Exists`].
    pub fn refuse_existing(output: Option<&Path>, overwrite: bool) -> Result<(), Self> {
        match output.filter(|output| !overwrite && output.exists()) {
            Some(output) => Err(Self::Exists(output.into())),
            None => Ok(()),
        }
    }
}

/// Writes a whole file, see [`Output`].
///
/// # Errors
///
/// Those of [`Output::create`] and [`Output::commit`].
pub fn write(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), OutputError> {
    write_and(Output::commit, path, bytes, overwrite)
}

/// Writes one of many whole files, see [`Output::commit_later`].
pub fn write_later(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), OutputError> {
    write_and(Output::commit_later, path, bytes, overwrite)
}

fn write_and(
    commit: fn(Output) -> io::Result<()>,
    path: &Path,
    bytes: &[u8],
    overwrite: bool,
) -> Result<(), OutputError> {
    let write = || {
        let mut output = Output::create(path, overwrite)?;
        output.write_all(bytes)?;
        commit(output)
    };
    write().map_err(|error| OutputError::new(path, error))
}

/// Beginning of the temporary name of a file.
fn prefix(path: &Path) -> OsString {
    let name = path.file_name().unwrap_or_default();
    if name.len() <= LONGEST_NAME {
        let mut prefix = name.to_owned();
        prefix.push(".");
        return prefix;
    }
    let name = name.to_string_lossy();
    let end = (0..=LONGEST_NAME).rev().find(|&end| name.is_char_boundary(end));
    format!("{}.", &name[..end.unwrap_or_default()]).into()
}

/// Gives a file its name; an existing one is an error unless `overwrite`.
pub fn rename(temporary: TempPath, path: &Path, overwrite: bool) -> Result<(), (io::Error, TempPath)> {
    let mut temporary = Some(temporary);
    let renamed = repeated(|| {
        let from = temporary.take().expect("a failed renaming gives the name back");
        let result = if overwrite { from.persist(path) } else { from.persist_noclobber(path) };
        result.map_err(|failure| {
            temporary = Some(failure.path);
            failure.error
        })
    });
    renamed.map_err(|error| (error, temporary.expect("a failed renaming gives the name back")))
}
