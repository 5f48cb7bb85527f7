//! Recordings of closed forms: what percuss writes of what it knows is sound, though it is not all that a run records.

use std::{fs, path::Path};

use percuss::{
    case::{Case, builtin},
    recording::Destination,
    session::{self, ExactSteps, Recording},
};
use percuss_reader::{messages::Recording as Recorded, recording::Limits};

use crate::desk::Desk;

/// Records the closed form of a case; false if there is none.
fn record(name: &str, path: &Path) -> bool {
    // physical cases count their time in seconds
    let is_physical = Case::load(name, &[]).expect("a built-in case").scales.is_some();
    let end = if is_physical { "run.end_time=2 us" } else { "run.end_time=1.5" };
    let overrides = ["mesh.cells=20".to_owned(), end.to_owned()];
    let text = builtin::find(name).expect("a built-in case");
    let case =
        Case::parse(name, &text, &overrides, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let Ok(mut steps) = ExactSteps::new(&case) else { return false };
    let mut recording =
        Recording::create(&Destination::new(path), &case, steps.source()).expect("a new file");
    session::run(&mut steps, &mut [&mut recording]).expect("room on the disk");
    true
}

#[test]
fn every_closed_form_is_sound() {
    let desk = Desk::new(&[]);
    let (mut with_drag, mut without) = (0, 0);
    for name in builtin::names() {
        let file = format!("{name}.mcap");
        if !record(name, &desk.path(&file)) {
            continue;
        }
        let verdict = desk.json(0, &["verify", &file, "--json"]);
        assert_eq!(
            (&verdict["sound"], &verdict["partial"]),
            (&true.into(), &false.into()),
            "{name}: {verdict}"
        );
        let has_drag = desk.json(0, &["info", &file, "--json"])["channels"]
            .as_array()
            .is_some_and(|channels| channels.iter().any(|channel| channel["topic"] == "/drag"));
        *(if has_drag { &mut with_drag } else { &mut without }) += 1;
        desk.text(0, &["report", &file]);
        let page = fs::read_to_string(desk.path(&format!("{name}.html"))).expect("a page");
        assert!(page.contains("\"sound\":true"), "{name}");
        assert!(page.contains("\"x\":\"time ["), "{name}: charts say what is along x");
    }
    assert!(with_drag >= 4 && without >= 9, "{with_drag} forms know the drag, {without} do not");
}

/// Readers that go by the index read metadata records alone, without the rest that the checksum of the file covers.
#[test]
fn a_flipped_bit_in_a_metadata_record_is_found_by_the_index() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    assert!(record("fig2-prescribed", &path));
    let sound = fs::read(&path).expect("the recording");
    let summary = mcap::Summary::read(&sound).expect("a sound file").expect("a summary");
    let whole = Recorded::open(&path, Limits::default()).expect("a recording");
    assert!(whole.damages.is_empty());
    assert!(whole.metadata.iter().all(|record| record.is_sound && !record.entries.contains_key("checksum")));
    let place = summary.metadata_indexes.iter().find(|index| index.name == "percuss.run").expect("a record");
    let damaged = folder.path().join("b.mcap");
    let entries = |recording: &Recorded| -> Vec<_> {
        recording.metadata.iter().map(|record| (record.name.clone(), record.entries.clone())).collect()
    };
    let mut harmless = 0;
    for byte in place.offset..place.offset + place.length {
        for bit in [0, 3, 6] {
            let mut bytes = sound.clone();
            bytes[byte as usize] ^= 1 << bit;
            fs::write(&damaged, bytes).expect("a file");
            let Ok(recording) = Recorded::open(&damaged, Limits::default()) else { continue };
            // a length that is too long by what follows changes nothing that is read
            let is_harmless = entries(&recording) == entries(&whole);
            assert!(is_harmless || !recording.damages.is_empty(), "bit {bit} of byte {byte}");
            harmless += usize::from(is_harmless && recording.damages.is_empty());
        }
    }
    assert!(harmless < 10, "{harmless} flips are silent");
}
