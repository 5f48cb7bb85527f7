//! Atomic output files, for the programs of percuss.
//!
//! A file is written under another name beside the one asked for, synchronised with the disk and renamed; then its folder is
//! synchronised. So whatever happens, a crash or a full disk, the name asked for stands for what was there before or for the whole new
//! file, never for a half one.
//!
//! | Type | Written as | What a failure leaves |
//! |---|---|---|
//! | [`Output`] | `NAME.XXXXXX.part` | nothing; kill −9 leaves the file of that name, and so does a signal without `discard_at_signals` |
//! | [`Part`] | `NAME.part`, locked | that file: what is in it may be worth keeping |
//!
//! Pipes and devices, `/dev/stdout` for example, are written to as they are. A symbolic link is followed: what it points to is replaced.
//!
//! Errors of the system, which every function here may return, are reported with the number of bytes that were written before; interrupted
//! calls are repeated, short writes are continued.
//!
//! What such programs show of the files that they read goes through [`text`]; [`COMMIT`] is what is built.
//!
//! The feature `signals` has what signals do to a program with such files, the feature `manual` what
//! programs say of themselves, and of the numbers that they expect.

use std::{
    error::Error,
    fs::{self, File, FileType, OpenOptions},
    io,
    path::{Path, PathBuf},
};

mod counted;
#[cfg(feature = "manual")]
pub mod manual;
#[cfg(feature = "manual")]
pub mod number;
mod output;
mod part;
#[cfg(feature = "signals")]
#[cfg_attr(windows, path = "interrupts.rs")]
mod signals;
pub mod text;
mod unfinished;

pub use counted::Counted;
pub use output::{Output, OutputError, write, write_later};
pub use part::{Left, Part, PartError, has_name, part_of};
#[cfg(feature = "signals")]
pub use signals::{discard_at_signals, signal_name, watch_signals};

/// The commit that is built, with `-dirty` if files have changed since; `None` where it is not known, as in unoptimised programs.
pub const COMMIT: Option<&str> = option_env!("PERCUSS_COMMIT");

/// Room for a new file \[bytes\]; `None` for a device.
pub fn available(path: &Path) -> io::Result<Option<u64>> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => Ok(None),
        _ => fs4::available_space(folder(path)).map(Some),
    }
}

/// The file that an output of this name is, there or not yet, through a symbolic link; `None` for a pipe or a device.
///
/// # Errors
///
/// It is a folder, or the system does not say.
pub fn file_of(path: &Path) -> io::Result<Option<PathBuf>> {
    let is_link = path.is_symlink();
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_file() && is_link => fs::canonicalize(path).map(Some),
        Ok(metadata) if metadata.is_file() => Ok(Some(path.to_owned())),
        Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(_) => Ok(None),
        // a link to nothing: the name is taken, and what it stands for cannot be created beside it
        Err(error) if is_link => Err(error),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Some(path.to_owned())),
        Err(error) => Err(error),
    }
}

/// True if two names are of one file, through links of any kind.
#[cfg(unix)]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |path| fs::metadata(path).map(|metadata| (metadata.dev(), metadata.ino()));
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

/// True if two names are of one file, through symbolic links.
#[cfg(not(unix))]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// What a thing with a name is that is no regular file, in words.
#[cfg(unix)]
pub fn kind_name(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match () {
        () if kind.is_dir() => "a folder",
        () if kind.is_fifo() => "a pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

/// What a thing with a name is that is no regular file, in words.
#[cfg(not(unix))]
pub fn kind_name(kind: FileType) -> &'static str {
    if kind.is_dir() { "a folder" } else { "a device" }
}

/// Opens a pipe or a device. Only a writer does: the reader of a pipe sees its end when it is closed.
fn open_device(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

/// The innermost cause of an error: some libraries say only that there is one.
pub fn cause(error: &(dyn Error + 'static)) -> String {
    let mut inner = error;
    while let Some(source) = inner.source() {
        inner = source;
    }
    inner.to_string()
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Synchronises the folder of a file with the disk, so that a new name in it lasts. Folders that cannot be opened or synchronised, as
/// of some network file systems, are left to the system.
pub fn synchronise_folder(path: &Path) -> io::Result<()> {
    let Ok(folder) = File::open(folder(path)) else { return Ok(()) };
    ignore_unfit(folder.sync_all())
}

/// Synchronises many files of a folder, those of [`Output::commit_later`], and their names with the disk.
pub fn synchronise_all(folder: &Path) -> io::Result<()> {
    if cfg!(windows) {
        // it has no such call for folders, and the files are synchronised one by one
        return Ok(());
    }
    let folder = File::open(folder)?;
    #[cfg(target_os = "linux")]
    rustix::fs::syncfs(&folder)?;
    ignore_unfit(folder.sync_all())
}

/// Synchronises a file with the disk. Pipes and devices that have none are left alone.
pub fn synchronise(file: &File) -> io::Result<()> {
    ignore_unfit(repeated(|| file.sync_all()))
}

/// Ignores that pipes, devices and some folders cannot be synchronised.
fn ignore_unfit(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {
            Ok(())
        }
        result => result,
    }
}

/// Repeats a call that a signal has interrupted.
fn repeated<T>(mut call: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match call() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}
