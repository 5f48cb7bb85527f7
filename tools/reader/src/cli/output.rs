//! Where output goes: standard output, or a file that is never overwritten unasked.

use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use clap::ValueEnum;
use percuss_output::{OutputError, is_same_file};

use super::outcome::CliError;
use crate::{
    command::{cat::CatError, summary::SummaryError, trace::TraceError},
    text::{document, lines},
};

/// Name and version of the program, for files that say what made them.
pub(super) const PROGRAM: &str = concat!("percuss-read ", env!("CARGO_PKG_VERSION"));

/// Units of SI columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum UnitChoice {
    /// With the prefix that suits the largest number of a column: µs, kN, MPa
    #[default]
    Prefixed,
    /// As they are recorded: s, N, Pa
    Base,
}

/// Standard output, or a file that is begun with the first byte and gets its name at the end: a request that fails leaves none.
pub(super) struct Output {
    path: Option<PathBuf>,
    overwrite: bool,
    opened: Option<Opened>,
}

enum Opened {
    Stdout(io::Stdout),
    File(percuss_output::Output),
}

impl Opened {
    fn writer(&mut self) -> &mut dyn Write {
        match self {
            Self::Stdout(stdout) => stdout,
            Self::File(file) => file,
        }
    }
}

impl Output {
    pub(super) fn new(path: Option<&Path>, overwrite: bool) -> Self {
        Self { path: path.map(Path::to_owned), overwrite, opened: None }
    }

    /// The output, which is begun if that is still to be done.
    fn open(&mut self) -> io::Result<&mut Opened> {
        let opened = match (self.opened.take(), &self.path) {
            (Some(opened), _) => opened,
            (None, Some(path)) => Opened::File(percuss_output::Output::create(path, self.overwrite)?),
            (None, None) => Opened::Stdout(io::stdout()),
        };
        Ok(self.opened.insert(opened))
    }

    /// Completes the output.
    fn commit(self) -> io::Result<()> {
        match self.opened {
            Some(Opened::File(file)) => file.commit(),
            Some(Opened::Stdout(mut stdout)) => stdout.flush(),
            None => Ok(()),
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open()?.writer().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.opened.as_mut().map_or(Ok(()), |opened| opened.writer().flush())
    }
}

/// Completes an output that was written through a buffer.
pub(super) fn commit(output: BufWriter<Output>) -> io::Result<()> {
    output.into_inner().map_err(io::IntoInnerError::into_error)?.commit()
}

/// Refuses to write where an input is.
pub(super) fn refuse_inputs<'a>(
    output: Option<&Path>,
    mut inputs: impl Iterator<Item = &'a PathBuf>,
) -> Result<(), CliError> {
    match output {
        Some(output) if inputs.any(|input| is_same_file(output, input)) => {
            Err(CliError::SameFile(output.into()))
        }
        _ => Ok(()),
    }
}

/// What the extension of an output stands for, in any case.
///
/// * `known`: extensions and what they stand for
/// * `plain`: what a name without an extension stands for, if for anything
pub(super) fn by_extension<T: Copy>(
    path: &Path,
    known: &[(&str, T)],
    plain: Option<T>,
) -> Result<T, CliError> {
    let found = match path.extension() {
        None => plain,
        Some(extension) => {
            let extension = extension.to_string_lossy().to_lowercase();
            known.iter().find(|(name, _)| *name == extension).map(|(_, value)| *value)
        }
    };
    found.ok_or_else(|| {
        let names: Vec<String> = known.iter().map(|(name, _)| format!(".{name}")).collect();
        let names = names.join(", ");
        CliError::Usage(format!("`{}`: no format of this name; end it in {names}", path.display()))
    })
}

/// The format that is given, else that of the output's name; `plain` for standard output and names without an extension.
///
/// * `known`: extensions and what they stand for
pub(super) fn chosen_format<T: Copy>(
    given: Option<T>,
    output: Option<&Path>,
    known: &[(&str, T)],
    plain: T,
) -> Result<T, CliError> {
    match (given, output) {
        (Some(format), _) => Ok(format),
        (None, Some(output)) => by_extension(output, known, Some(plain)),
        (None, None) => Ok(plain),
    }
}

/// Writes a text to standard output, without what a file could command a terminal in it; a reader of it that has had
/// enough is no error.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    print_painted(&lines(text))
}

/// Writes a JSON document to standard output.
pub(super) fn print_document(json: &str) -> Result<(), CliError> {
    print_painted(&document(json))
}

/// Writes a text or a JSON document to standard output.
pub(super) fn show(text: &str, is_json: bool) -> Result<(), CliError> {
    if is_json { print_document(text) } else { print(text) }
}

/// The same for a text with colours, in which what is cited from a file is escaped already.
pub(super) fn print_painted(text: &str) -> Result<(), CliError> {
    write(None, false, text.as_bytes())
}

/// Writes a whole file, a new one unless it may be overwritten; without a path to standard output.
pub(super) fn write(path: Option<&Path>, overwrite: bool, bytes: &[u8]) -> Result<(), CliError> {
    let mut output = Output::new(path, overwrite);
    // even if there are no bytes
    match output.open().and_then(|output| output.writer().write_all(bytes)).and_then(|()| output.commit()) {
        Err(error) if path.is_some() || error.kind() != io::ErrorKind::BrokenPipe => {
            Err(explain(path, error))
        }
        _ => Ok(()),
    }
}

/// Why an output could not be written.
pub(super) fn explain(path: Option<&Path>, error: io::Error) -> CliError {
    OutputError::new(path.unwrap_or("standard output".as_ref()), error).into()
}

/// What came of a command that writes as it reads; nothing if the reader of its output has had enough.
pub(super) fn unless_closed<T>(
    result: Result<T, impl Into<CliError>>,
    path: Option<&Path>,
) -> Result<Option<T>, CliError> {
    let error = match result.map_err(Into::into) {
        Ok(done) => return Ok(Some(done)),
        Err(
            CliError::Cat(CatError::Output(error))
            | CliError::Summary(SummaryError::Output(error))
            | CliError::Trace(TraceError::Output(error)),
        ) => error,
        Err(error) => return Err(error),
    };
    if error.kind() == io::ErrorKind::BrokenPipe { Ok(None) } else { Err(explain(path, error)) }
}
