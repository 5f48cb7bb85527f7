//! What commands that write a recording share: output path, threads, signals.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use clap::Args;
use indicatif::BinaryBytes;
use percuss_output::{
    available, file_of, is_same_file,
    number::{finite, whole},
    part_of, signal_name,
    text::printable,
};
use rayon::ThreadPool;

use super::{CliError, Exit, default_output, progress::LINE_INTERVAL};
use crate::{
    advice::cost::{Estimate, least_bytes},
    case::Case,
    recording::{Destination, Synchronise},
    session::{Flow, Status},
};

/// Path of a recording and how it is computed.
#[derive(Debug, Args)]
pub(super) struct OutputArguments {
    /// Recording to write [default: the name of the case with .mcap, of a closed form with -exact.mcap]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) threads: ThreadArguments,
    /// Overwrite an existing recording, and what an earlier run has left of one
    #[arg(long)]
    force: bool,
    /// When the recording is synchronised with the disk: what has been is there after a power failure too
    #[arg(long, value_name = "WHEN", value_enum, default_value_t)]
    sync: Synchronise,
    /// Leave out what differs from run to run, time, machine and number of threads: the recording of a case by the same version of
    /// percuss has one hash, if it takes less than --set run.checkpoint_every and is not resumed
    #[arg(long)]
    reproducible: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
    #[command(flatten)]
    pub(super) progress: ProgressArguments,
}

/// How often progress is shown.
#[derive(Debug, Args)]
pub(super) struct ProgressArguments {
    /// Time between lines of progress where stderr is no terminal, in s
    #[arg(long = "progress-every", value_name = "SECONDS", default_value_t = LINE_INTERVAL, value_parser = finite(0.0..=1e6))]
    pub(super) every: f64,
}

/// Number of threads.
#[derive(Debug, Args)]
pub(super) struct ThreadArguments {
    /// Number of threads [default: all cores]; results do not depend on it
    #[arg(long, value_name = "N", value_parser = whole(1..=MAX_THREADS))]
    threads: Option<usize>,
}

const MAX_THREADS: usize = 1024;

impl OutputArguments {
    /// Where the recording of a case goes, which is not read from it.
    ///
    /// * `name`: of the case, as it is given
    /// * `suffix`: what the default name adds to that of the case
    pub(super) fn destination(&self, name: &str, case: &Case, suffix: &str) -> Result<Destination, CliError> {
        let path = self.output.clone().unwrap_or_else(|| default_output(name, &format!("{suffix}.mcap")));
        if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("mcap")) {
            let text = format!("`{}`: recordings are .mcap; choose another output with -o", path.display());
            return Err(CliError::Usage(text));
        }
        refuse_inputs(Some(&path), case)?;
        let Self { force: overwrite, sync: synchronise, reproducible, .. } = *self;
        Ok(Destination { path, overwrite, synchronise, reproducible })
    }
}

impl ThreadArguments {
    pub(super) fn count(&self) -> usize {
        self.threads.unwrap_or_else(rayon::current_num_threads).min(MAX_THREADS)
    }

    pub(super) fn pool(&self) -> Result<ThreadPool, CliError> {
        let threads = self.count();
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| CliError::system(format!("cannot start {threads} threads"), error))
    }
}

/// Refuses a run whose recording is certainly larger than what is free.
pub(super) fn check_room(path: &Path, case: &Case) -> Result<(), CliError> {
    // where the system does not say what is free, writing will
    let Some(free) = available(path).ok().flatten().filter(|free| *free < least_bytes(case)) else {
        return Ok(());
    };
    let (needed, free) = (BinaryBytes(Estimate::new(case).file), BinaryBytes(free));
    let text = format!(
        "`{}` would take about {needed}, and {free} are free there; choose another output with -o, or record less (record.frames, record.field_every, record.interface_every)",
        path.display()
    );
    Err(CliError::Failed(text))
}

/// See [`percuss_output::watch_signals`].
pub(super) fn watch_signals() -> Result<Arc<AtomicUsize>, CliError> {
    percuss_output::watch_signals().map_err(|error| CliError::system("cannot watch for signals", error))
}

/// Interrupts a run after a signal.
pub(super) fn flow(signal: &AtomicUsize) -> Flow {
    match signal.load(Ordering::Relaxed) {
        0 => Flow::Continue,
        signal => Flow::Interrupt(format!("interrupted by {}", signal_name(signal))),
    }
}

/// The signal that was caught, if there was one.
pub(super) fn signalled(signal: &AtomicUsize) -> Option<u8> {
    Some(signal.load(Ordering::Relaxed) as u8).filter(|signal| *signal != 0)
}

/// The exit of a command that has recorded a run.
pub(super) fn exit(status: &Status, signal: &AtomicUsize) -> Exit {
    match status {
        Status::Interrupted(_) => signalled(signal).map_or(Exit::Done, Exit::Interrupted),
        _ => Exit::Done,
    }
}

/// Name, status and size of a recording.
pub(super) fn written(path: &Path, status: &Status) -> String {
    // a device has no part, that of a link is beside what it points to
    let part = file_of(path).ok().flatten().map(|file| part_of(&file));
    let path = part.as_deref().filter(|_| !status.is_finished()).unwrap_or(path);
    let size = fs::metadata(path).map_or(0, |metadata| metadata.len());
    format!("{}: {}, {}", printable(&path.to_string_lossy()), status.name(), BinaryBytes(size))
}

/// Refuses an output that is a file which the case was read from, under whatever name.
pub(super) fn refuse_inputs(output: Option<&Path>, case: &Case) -> Result<(), CliError> {
    let is_input = |output: &&Path| case.inputs().any(|input| is_same_file(output, input));
    let Some(output) = output.filter(is_input).map(Path::display) else { return Ok(()) };
    let text = format!("`{output}` is what the case is read from; choose another output with -o");
    Err(CliError::Usage(text))
}
