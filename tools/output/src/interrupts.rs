//! Ctrl-C and Ctrl-Break, which are what Windows has of the signals that end a program. Here they are SIGINT.

use std::{
    io, process,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use crate::unfinished::discard;

const SIGINT: usize = 2;

/// See `watch_signals` of other systems.
pub fn watch_signals() -> io::Result<Arc<AtomicUsize>> {
    let seen = Arc::new(AtomicUsize::new(0));
    let caught = seen.clone();
    let catch = move || {
        if caught.swap(SIGINT, Ordering::Relaxed) != 0 {
            end();
        }
    };
    ctrlc::set_handler(catch).map_err(io::Error::other)?;
    Ok(seen)
}

/// Name of a signal that was caught.
pub fn signal_name(_: usize) -> &'static str {
    "SIGINT"
}

/// See `discard_at_signals` of other systems.
pub fn discard_at_signals() -> io::Result<()> {
    ctrlc::set_handler(|| discard(end)).map_err(io::Error::other)
}

fn end() {
    process::exit(128 + SIGINT as i32)
}
