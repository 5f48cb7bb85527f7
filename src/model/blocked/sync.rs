//! Synchronisation primitives: atomics, locks and pauses.
//!
//! Those of the standard library; in tests under `--cfg loom` those of loom, so that the models check the code that runs. Reference
//! counts are the standard library's in both cases: they keep memory alive, and no order between threads rests on them.

#[cfg(not(all(test, loom)))]
pub use std::{
    hint::spin_loop,
    sync::{
        Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicPtr, AtomicUsize},
    },
    thread::yield_now,
};

#[cfg(all(test, loom))]
pub use loom::{
    hint::spin_loop,
    sync::{
        Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicPtr, AtomicUsize},
    },
    thread::yield_now,
};

pub use std::sync::{PoisonError, atomic::Ordering};
