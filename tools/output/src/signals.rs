//! Signals that end a program.

use std::{
    ffi::c_int,
    fs, io,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize},
    },
    thread,
};

use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    flag,
    iterator::Signals,
    low_level,
};

use crate::unfinished::discard;

/// SIGINT, SIGTERM, and SIGHUP unless the process was started with it ignored, as under `nohup`.
fn ending_signals() -> impl Iterator<Item = c_int> {
    [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| *signal != SIGHUP || !ignores_hangup())
}

/// The system's answer is the mask of ignored signals.
fn ignores_hangup() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (SIGHUP - 1)) != 0
}

/// Catches the signals that end a process: SIGINT, SIGTERM, SIGHUP, or on Windows Ctrl-C and Ctrl-Break as SIGINT. The value is the
/// signal, 0 for none. A second one ends the process at once.
///
/// # Errors
///
/// The system refuses the handlers.
pub fn watch_signals() -> io::Result<Arc<AtomicUsize>> {
    let seen = Arc::new(AtomicUsize::new(0));
    let armed = Arc::new(AtomicBool::new(false));
    for signal in ending_signals() {
        flag::register_conditional_default(signal, armed.clone())?;
        flag::register(signal, armed.clone())?;
        flag::register_usize(signal, seen.clone(), signal as usize)?;
    }
    Ok(seen)
}

/// Name of a signal that was caught.
pub fn signal_name(signal: usize) -> &'static str {
    low_level::signal_name(signal as c_int).unwrap_or("a signal")
}

/// Makes the [same signals](watch_signals) remove every [`Output`](crate::Output) that is not complete, before they
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
                let _ = low_level::emulate_default_handler(signal);
            });
        }
    })?;
    Ok(())
}
