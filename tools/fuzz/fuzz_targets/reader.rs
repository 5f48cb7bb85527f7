//! A recording: verified, described, listed, traced and summarised.

#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use percuss_fuzz::{LIMITS, Nowhere, file};
use percuss_reader::{
    command::{
        info::info,
        summary::summary,
        trace::{Request, trace},
        verify::verify_scan,
    },
    messages::Recording,
    failure::Failure,
    recording::Scan,
    units::Units,
};

fuzz_target!(|bytes: &[u8]| {
    let path = file("reader.mcap", bytes);
    let Ok(scan) = Scan::of(Box::new(Cursor::new(bytes.to_vec())), &path, LIMITS) else { return };
    drop(verify_scan(scan, LIMITS));
    drop(info(&path, true, LIMITS));
    if let Ok(recording) = Recording::open(&path, LIMITS)
        && let Ok(mut messages) = recording.messages(recording.channels.keys().copied(), None)
    {
        drop(messages.for_each(|_| -> Result<(), Failure> { Ok(()) }));
    }
    let request = Request { topics: vec!["*".parse().expect("a pattern")], ..Request::default() };
    drop(trace(&[path.clone()], &request, LIMITS, &mut Nowhere));
    drop(summary(&[path], true, &Units::default(), LIMITS, &mut Nowhere));
});
