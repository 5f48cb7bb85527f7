//! Checkpoints as files: written, restored, damaged, and those of other programs.

use std::fs;

use percuss_table::measures::Observations;

use super::*;
use crate::{
    advice::Advised,
    recording::{Destination, Written, copy::metadata},
    session::{self, Flow, Recording, Source, Steps},
    view::View,
};

fn case(settings: &[&str]) -> Case {
    Case::sound("fig5", &[&["mesh.cells=12", "run.end_time=8"], settings].concat())
}

/// What was seen of three steps of a contact.
fn seen() -> Observations {
    let mut seen = Observations::default();
    for step in 0..3 {
        let time = f64::from(step) * 0.1;
        seen.take_drag(time, Some(1.0 - time), Some(time));
        seen.take_motion(time, Some(1.0 - time), Some(time));
        seen.take_energy(time, Some(time), Some(0.3));
    }
    seen
}

/// Writes a checkpoint in the middle of a run, and returns its head.
fn written(path: &Path, case: &Case) -> Head {
    let mut simulation = Simulation::new(case);
    let mut last = (0, 0.0);
    while let Some(view) = simulation.step().expect("a sound case") {
        last = (view.step, view.time);
        if view.step == 10 {
            simulation.interrupt();
        }
    }
    let written = Written { messages: vec![3, 0, 11], bytes: 900, largest_chunk: 500, checksum: 7 };
    let recorded =
        Recorded { step: last.0, time: last.1, written, seen: seen(), held: vec![vec![0.5, 0.25]] };
    let head = Head::new(case, Engine::Blocked, recorded);
    let size = write(path, &head, &mut simulation).expect("room");
    assert_eq!(size, fs::metadata(path).expect("a file").len());
    head
}

fn refusal(path: &Path, case: &Case, engine: Engine) -> String {
    load(path, case, engine, &mut Simulation::new(case)).expect_err("it is refused").to_string()
}

#[test]
fn a_checkpoint_is_taken_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = checkpoint_of(&folder.path().join("a.mcap"));
    assert!(path.ends_with("a.mcap.checkpoint"));
    let head = written(&path, &case(&[]));
    // how often checkpoints are written is not part of the case
    let case = case(&["run.checkpoint_every=0.5"]);
    let mut simulation = Simulation::new(&case);
    let recorded = load(&path, &case, Engine::Blocked, &mut simulation).expect("a checkpoint");
    assert_eq!(recorded, head.recorded);
    assert_eq!(simulation.next_step(), head.recorded.step + 1);
    // nothing else is left, also by a second one
    written(&path, &case);
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    remove(&path).expect("it is there");
    remove(&path).expect("it is not there");
    assert!(!path.exists());
}

#[test]
fn checkpoints_of_others_are_refused_with_what_differs() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap.checkpoint");
    let here = case(&[]);
    written(&path, &case(&["mesh.cells=13", "record.frames=7"]));
    let text = refusal(&path, &here, Engine::Blocked);
    assert!(
        text.contains("mesh.cells is 13 there, 12 here") && text.contains("record.frames is 7"),
        "{text}"
    );
    written(&path, &Case::sound("layers", &["target.layer.2.thickness=0.8"]));
    let text = refusal(&path, &Case::sound("layers", &[]), Engine::Blocked);
    assert!(text.contains("target.layer.2.thickness is 0.8 there, 0.6 here;"), "{text}");
    written(&path, &here);
    let text = refusal(&path, &here, Engine::Reference);
    assert!(text.contains("--engine blocked, this is --engine reference"), "{text}");
    let mut head = written(&path, &here);
    head.percuss = "0.0.0".into();
    let mut simulation = Simulation::new(&here);
    write(&path, &head, &mut simulation).expect("room");
    let text = refusal(&path, &here, Engine::Blocked);
    assert!(text.contains("percuss 0.0.0, this is percuss"), "{text}");
    // the same version with other numerics
    (head.percuss, head.numerics) = (env!("CARGO_PKG_VERSION").into(), NUMERICS + 1);
    write(&path, &head, &mut simulation).expect("room");
    let text = refusal(&path, &here, Engine::Blocked);
    let there = NUMERICS + 1;
    let expected = format!("revision {there} of the numerics, this is revision {NUMERICS} of the numerics");
    assert!(text.contains(&expected) && text.contains("--force"), "{text}");
    // the head of another step
    (head.numerics, head.recorded.step) = (NUMERICS, 4);
    write(&path, &head, &mut simulation).expect("room");
    let text = refusal(&path, &here, Engine::Blocked);
    assert!(text.contains("number of the next step = 0"), "{text}");
}

#[test]
fn damage_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap.checkpoint");
    let case = case(&[]);
    written(&path, &case);
    let bytes = fs::read(&path).expect("a file");
    for place in (0..bytes.len()).step_by(1 + bytes.len() / 500).chain([8, bytes.len() - 1]) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        fs::write(&path, &damaged).expect("room");
        let text = refusal(&path, &case, Engine::Blocked);
        let expected = if place < MAGIC.len() { "no checkpoint of percuss" } else { "is damaged" };
        assert!(text.contains(expected) && text.contains("--force"), "{place}: {text}");
        fs::write(&path, &bytes[..place]).expect("room");
        let text = refusal(&path, &case, Engine::Blocked);
        assert!(text.contains("no checkpoint") || text.contains("is damaged"), "{place}: {text}");
    }
}

/// A file with a sound checksum.
fn sealed(path: &Path, content: &[u8]) {
    let checksum = crc32fast::hash(content).to_le_bytes();
    fs::write(path, [content, &checksum].concat()).expect("room");
}

#[test]
fn forged_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap.checkpoint");
    let case = case(&[]);
    written(&path, &case);
    let bytes = fs::read(&path).expect("a file");
    let content = &bytes[..bytes.len() - CHECKSUM as usize];
    let other = VERSION + 1;
    sealed(&path, &[&MAGIC[..], &other.to_le_bytes(), &content[12..]].concat());
    let text = refusal(&path, &case, Engine::Blocked);
    assert!(text.contains(&format!("format {other}, this is format {VERSION}")), "{text}");
    sealed(&path, &[&content[..12], &u32::MAX.to_le_bytes()].concat());
    let text = refusal(&path, &case, Engine::Blocked);
    assert!(text.contains("is damaged") && text.contains("4294967295 bytes"), "{text}");
    // the state is cut off, or another stream
    let head = 16 + u32::from_le_bytes(content[12..16].try_into().expect("four bytes")) as usize;
    for state in [&content[head..content.len() - 9], &b"no zstd"[..], &[]] {
        sealed(&path, &[&content[..head], state].concat());
        let text = refusal(&path, &case, Engine::Blocked);
        assert!(text.contains("is damaged"), "{text}");
    }
}

/// Runs a case, or goes on with it, up to a step.
fn run_up_to(step: u64, path: &Path, case: &Case) {
    let (destination, checkpoint) = (Destination::new(path), checkpoint_of(path));
    let mut simulation = Simulation::new(case);
    let recording = if checkpoint.exists() {
        let recorded = load(&checkpoint, case, Engine::Blocked, &mut simulation).expect("a checkpoint");
        Recording::resume(&destination, case, &recorded)
    } else {
        Recording::create(&destination, case, Source::Simulation)
    };
    let recording = recording.expect("a file");
    let mut recording = Checkpoints::new(recording, case, Engine::Blocked, Some(checkpoint), |_| ());
    let mut stop = |view: &View<'_>| match view.step >= step {
        true => Flow::Interrupt("a piece is done".into()),
        false => Flow::Continue,
    };
    session::run(&mut Advised::new(case, simulation), &mut [&mut recording, &mut stop]).expect("room");
}

#[test]
fn a_run_in_pieces_records_the_same_measures() {
    let folder = tempfile::tempdir().expect("a folder");
    let case = Case::sound("fig9-m1", &["mesh.cells=12", "record.frames=25"]);
    let measures = |path: &Path| {
        let [summary] = metadata(path, ["percuss.summary"]).expect("the record");
        summary
    };
    let [whole, pieces] = ["whole.mcap", "pieces.mcap"].map(|name| folder.path().join(name));
    run_up_to(u64::MAX, &whole, &case);
    let expected = measures(&whole);
    // it rebounds, so all that is known only at the end of the contact is there
    assert_eq!(expected["warnings"], "edge,mass");
    assert!(["rebound_velocity", "energy_left", "t_ext"].iter().all(|name| expected.contains_key(*name)));
    let mut step = 7;
    while !pieces.exists() {
        run_up_to(step, &pieces, &case);
        step += 31;
    }
    assert!(step > 100, "{step}");
    assert_eq!(measures(&pieces), expected);
}
