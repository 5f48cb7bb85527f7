//! Two recordings: the input, cut where its last two bytes say. A seed is one sound recording; crossed over they are two.

#![no_main]

use libfuzzer_sys::fuzz_target;
use percuss_fuzz::{LIMITS, file};
use percuss_reader::{command::diff::diff, compare::Options, measured::Sources};

fuzz_target!(|bytes: &[u8]| {
    // without a second recording it is compared with itself
    let (bytes, cut) = bytes.split_last_chunk().map_or((bytes, 0), |(rest, cut)| (rest, u16::from_le_bytes(*cut)));
    let cut = usize::from(cut);
    let (a, b) = if cut > 0 && cut < bytes.len() { bytes.split_at(cut) } else { (bytes, bytes) };
    let (a, b) = (file("a.mcap", a), file("b.mcap", b));
    for relative in [false, true] {
        let options = Options { relative, ..Options::default() };
        if let Ok(comparison) = diff(&a, &b, &options, LIMITS, &Sources::default(), None) {
            comparison.verdict();
        }
    }
});
