//! A damaged recording: what is recovered from it is sound.

#![no_main]

use libfuzzer_sys::fuzz_target;
use percuss_fuzz::{LIMITS, file, output};
use percuss_reader::{command::recover::recover, recording::Scan};

fuzz_target!(|bytes: &[u8]| {
    let path = file("recover.mcap", bytes);
    let (copy, target) = output("recovered.mcap");
    if recover(&path, target, LIMITS).is_err() {
        return;
    }
    let mut scan = Scan::open(&copy, LIMITS).expect("a recording");
    scan.for_each(|_| {}).expect("no error of the system");
    assert!(scan.is_complete(), "{:?}", scan.damages());
});
