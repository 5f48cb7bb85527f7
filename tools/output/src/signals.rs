//! Signals that end a program.

use std::{ffi::c_int, fs, io, thread};

use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    iterator::Signals,
    low_level::emulate_default_handler,
};

use crate::unfinished::discard;

/// SIGINT, SIGTERM, and SIGHUP unless the process was started with it ignored, as under `nohup`.
pub fn ending_signals() -> impl Iterator<Item = c_int> {
    [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| *signal != SIGHUP || !ignores_hangup())
}

/// The system's answer is the mask of ignored signals.
fn ignores_hangup() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (SIGHUP - 1)) != 0
}

/// Makes the [signals](ending_signals) that end this process remove every [`Output`](crate::Output) that is not complete, before they
/// end it. For programs that do nothing else about signals.
///
/// # Errors
///
/// The system refuses the handlers or the thread that waits for them.
pub fn discard_at_signals() -> io::Result<()> {
    let mut signals = Signals::new(ending_signals())?;
    thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in &mut signals {
            discard(|| {
                // ends the process; were it refused, the next signal would come here again
                let _ = emulate_default_handler(signal);
            });
        }
    })?;
    Ok(())
}
