//! Where output goes: standard output, or a file that is never overwritten unasked.

use std::{
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

use clap::Args;
use percuss_output::{OutputError, is_same_file};

use crate::{
    failure::Failure,
    text::{document, lines},
};

/// Where output goes, the same for every verb that writes a file.
#[derive(Clone, Debug, Args)]
pub struct Write {
    /// Output file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    pub(crate) force: bool,
}

impl Write {
    /// The file, if it is not standard output.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.output.as_deref()
    }

    /// The file, which has to be named.
    pub(crate) fn named(&self) -> Result<&Path, Failure> {
        self.path().ok_or_else(|| Failure::Usage("name the output with -o".into()))
    }

    /// Refuses to write where an input is.
    pub(crate) fn refuse_inputs<'a>(
        &self,
        inputs: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<(), Failure> {
        self.path().map_or(Ok(()), |output| refuse_inputs(output, inputs))
    }

    pub(crate) fn refuse_existing(&self) -> Result<(), Failure> {
        Ok(OutputError::refuse_existing(self.path(), self.force)?)
    }

    /// The output, to be begun with its first byte.
    pub(crate) fn begin(&self) -> BufWriter<Output> {
        BufWriter::new(Output::new(self.path(), self.force))
    }

    pub(crate) fn whole(&self, bytes: &[u8]) -> Result<(), Failure> {
        write(self.path(), self.force, bytes)
    }

    /// The format that is given, else that of the output's name; `plain` for standard output and names without an extension.
    ///
    /// * `known`: extensions and what they stand for
    pub(crate) fn format<T: Copy>(
        &self,
        given: Option<T>,
        known: &[(&str, T)],
        plain: T,
    ) -> Result<T, Failure> {
        match (given, self.path()) {
            (Some(format), _) => Ok(format),
            (None, Some(output)) => by_extension(output, known, Some(plain)),
            (None, None) => Ok(plain),
        }
    }
}

/// Refuses to write where an input is.
pub(crate) fn refuse_inputs<'a>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    match inputs.into_iter().any(|input| is_same_file(output, input)) {
        true => Err(same_file(output)),
        false => Ok(()),
    }
}

/// Output would go where the input is.
pub(crate) fn same_file(output: &Path) -> Failure {
    Failure::Usage(format!("`{}` is the recording itself; choose another output with -o", output.display()))
}

/// Standard output, or a file that is begun with the first byte and gets its name at the end: a request that fails leaves none.
pub(crate) struct Output {
    path: Option<PathBuf>,
    overwrite: bool,
    file: Option<percuss_output::Output>,
}

impl Output {
    fn new(path: Option<&Path>, overwrite: bool) -> Self {
        Self { path: path.map(Path::to_owned), overwrite, file: None }
    }

    /// What is written to; a file is begun if that is still to be done.
    fn writer(&mut self) -> io::Result<Box<dyn io::Write + '_>> {
        let Some(path) = &self.path else { return Ok(Box::new(io::stdout())) };
        let file = match self.file.take() {
            Some(file) => file,
            None => percuss_output::Output::create(path, self.overwrite)?,
        };
        Ok(Box::new(self.file.insert(file)))
    }

    fn commit(self) -> io::Result<()> {
        self.file.map_or_else(|| io::stdout().flush(), percuss_output::Output::commit)
    }
}

impl io::Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or_else(|| io::stdout().flush(), io::Write::flush)
    }
}

/// Completes an output that was written through a buffer.
pub(crate) fn commit(output: BufWriter<Output>) -> Result<(), Failure> {
    Ok(output.into_inner().map_err(io::IntoInnerError::into_error)?.commit()?)
}

/// What the extension of an output stands for, in any case.
///
/// * `known`: extensions and what they stand for
/// * `plain`: what a name without an extension stands for, if for anything
pub(crate) fn by_extension<T: Copy>(
    path: &Path,
    known: &[(&str, T)],
    plain: Option<T>,
) -> Result<T, Failure> {
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
        Failure::Usage(format!("`{}`: no format of this name; end it in {names}", path.display()))
    })
}

/// Writes a text to standard output, without what a file could command a terminal in it.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    print_painted(&lines(text))
}

pub(crate) fn print_document(json: &str) -> Result<(), Failure> {
    print_painted(&document(json))
}

pub(crate) fn show(text: &str, is_json: bool) -> Result<(), Failure> {
    if is_json { print_document(text) } else { print(text) }
}

/// The same for a text with colours, in which what is cited from a file is escaped already.
pub(crate) fn print_painted(text: &str) -> Result<(), Failure> {
    write(None, false, text.as_bytes())
}

/// What is printed beside an answer that does not depend on it: a reader of standard output may have had enough.
pub(crate) fn if_read(printed: Result<(), Failure>) -> Result<(), Failure> {
    printed.or_else(|failure| if failure.is_unread() { Ok(()) } else { Err(failure) })
}

/// Writes a whole file, a new one unless it may be overwritten; without a path to standard output.
pub(crate) fn write(path: Option<&Path>, overwrite: bool, bytes: &[u8]) -> Result<(), Failure> {
    let mut output = Output::new(path, overwrite);
    // even if there are no bytes
    let written = output.writer().and_then(|mut writer| writer.write_all(bytes));
    written.and_then(|()| output.commit()).map_err(|error| Failure::from(error).at(path))
}
