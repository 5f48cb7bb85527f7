//! Damaged, cut off and hostile files: nothing panics, nothing is taken for sound that is not, no memory beyond the cap.

use std::{
    collections::hash_map::DefaultHasher,
    fs,
    hash::{Hash, Hasher},
    io::Cursor,
    path::{Path, PathBuf},
};

use mcap::{Compression, WriteOptions};
use percuss_reader::{
    command::{recover::recover, verify::verify_scan},
    messages::Recording,
    recording::{Limits, OpenError, Scan},
};
use tempfile::TempDir;

use crate::{
    forge::{self, Dice, forge},
    raw::{channel, chunk, file, folder, message, record, run, schema, text, varint},
};

fn options(compression: Option<Compression>) -> WriteOptions {
    WriteOptions::new().compression(compression).chunk_size(Some(6 << 10))
}

/// Three recordings of about 50 kB.
fn files() -> [Vec<u8>; 3] {
    let files = [
        forge(270, 1).write(options(Some(Compression::Zstd))),
        forge(260, 2).write(options(Some(Compression::Lz4))),
        forge(150, 3).write(options(None)),
    ];
    for file in &files {
        assert!((40_000..60_000).contains(&file.len()), "{}", file.len());
    }
    files
}

fn scan(bytes: Vec<u8>) -> Option<Scan> {
    Scan::of(Box::new(Cursor::new(bytes)), Path::new("a.mcap"), Limits { memory: 64 << 20 }).ok()
}

/// True if a file is reported to be sound.
fn is_sound(bytes: Vec<u8>) -> bool {
    let Some(scan) = scan(bytes) else { return false };
    verify_scan(scan, Limits { memory: 64 << 20 }).expect("no error of the system").is_sound()
}

/// A hash of everything that comes out of a file: records with their content.
fn content(bytes: Vec<u8>) -> (u64, bool) {
    let Some(mut scan) = scan(bytes) else { return (0, false) };
    let mut hasher = DefaultHasher::new();
    let each = scan.for_each(|found| format!("{:?}", found.record).hash(&mut hasher));
    each.expect("no error of the system");
    (hasher.finish(), scan.is_complete())
}

#[test]
fn cut_off_at_every_byte() {
    for file in files() {
        assert!(is_sound(file.clone()));
        for length in 0..file.len() {
            assert!(!is_sound(file[..length].to_vec()), "cut off at {length} of {}", file.len());
        }
    }
}

#[test]
fn twenty_thousand_flipped_bits() {
    let mut dice = Dice(7);
    let mut harmless = 0;
    for (file, flips) in files().into_iter().zip([7000, 7000, 6000]) {
        let whole = content(file.clone());
        for _ in 0..flips {
            let (byte, bit) = (dice.below(file.len()), dice.below(8));
            let mut spoiled = file.clone();
            spoiled[byte] ^= 1 << bit;
            if is_sound(spoiled.clone()) {
                harmless += 1;
                assert_eq!(content(spoiled), whole, "bit {bit} of byte {byte} was not reported");
            }
        }
    }
    println!("{harmless} flips were harmless");
}

/// A folder with a file in it.
fn messages(path: &Path) -> Vec<(u16, u64, Vec<u8>)> {
    let recording = Recording::open(path, Limits::default()).expect("a recording");
    let mut messages = recording.messages(recording.channels.keys().copied(), None).expect("messages");
    let mut all = Vec::new();
    let each = messages.for_each(|message| -> Result<(), OpenError> {
        all.push((message.channel, message.log_time, message.data.to_vec()));
        Ok(())
    });
    each.expect("messages");
    all
}

#[test]
fn what_is_sound_is_recovered_and_what_is_lost_is_reported() {
    let mut dice = Dice(11);
    for (round, file) in files().iter().cycle().take(60).enumerate() {
        let mut spoiled = file.clone();
        if round % 2 == 0 {
            spoiled.truncate(100 + dice.below(file.len() - 100));
        } else {
            let byte = 100 + dice.below(file.len() - 100);
            spoiled[byte] ^= 1 << dice.below(8);
        }
        let (folder, path) = folder(&spoiled);
        let target = folder.path().join("recovered.mcap");
        let output = fs::File::create(&target).expect("a file");
        let recovered = recover(&path, output, Limits::default()).expect("a recovered file");
        assert!(!recovered.lost.is_empty(), "round {round}: the loss is reported");
        let bytes = fs::read(&target).expect("the recovered file");
        assert!(is_sound(bytes), "round {round}: the recovered file is sound");
        // everything in it was in the original; chunks are lost as wholes
        let original = messages(&folder_of(file, &folder));
        let kept = messages(&target);
        assert_eq!(kept.len() as u64, recovered.messages);
        let mut rest = original.iter();
        assert!(kept.iter().all(|message| rest.any(|other| other == message)), "round {round}");
        if round % 2 == 1 {
            assert!(kept.len() * 10 > original.len() * 5, "round {round}: one bit costs one chunk at most");
        }
    }
}

fn folder_of(file: &[u8], folder: &TempDir) -> PathBuf {
    let path = folder.path().join("whole.mcap");
    fs::write(&path, file).expect("a file");
    path
}

const VERBS: [&[&str]; 8] = [
    &["info", "a.mcap"],
    &["verify", "a.mcap"],
    &["trace", "a.mcap", "--topic", "*"],
    &["cat", "a.mcap"],
    &["schema", "a.mcap"],
    &["diff", "a.mcap", "a.mcap"],
    &["recover", "a.mcap", "-o", "r.mcap", "--force"],
    &["export", "a.mcap", "--attachments", "-o", "out", "--force"],
];

#[test]
fn hostile_files_are_refused_within_the_cap() {
    use prost_reflect::prost::Message;
    let zeros = vec![0; 40_000_000];
    let bomb = mcap_zstd(&zeros);
    assert!(zeros.len() / bomb.len() > 10_000, "{}", bomb.len());
    let mut nested = vec![];
    // message A { message A { … } }: field 3 of DescriptorProto is nested_type
    for _ in 0..10_000 {
        let mut outer = vec![0x0a, 1, b'A', 0x1a];
        let mut length = nested.len();
        while length >= 0x80 {
            outer.push(length as u8 | 0x80);
            length >>= 7;
        }
        outer.push(length as u8);
        outer.extend(&nested);
        nested = outer;
    }
    let deep_file = [&[0x22][..], &varint(nested.len()), &nested].concat();
    let deep = [&[0x0a][..], &varint(deep_file.len()), &deep_file].concat();
    // a message inside itself, 10 000 times over
    let set = prost_reflect::prost_types::FileDescriptorSet { file: vec![forge::file()] }.encode_to_vec();
    let mut inner = vec![];
    for _ in 0..10_000 {
        inner = [&[0x4a][..], &varint(inner.len()), &inner].concat();
    }
    // a file that imports itself, and a field of a type that is not there
    let mut selfish = forge::file();
    selfish.dependency.push("lab.proto".into());
    let selfish = prost_reflect::prost_types::FileDescriptorSet { file: vec![selfish] }.encode_to_vec();
    let mut dangling = forge::file();
    dangling.message_type[4].field[4].type_name = Some(".lab.Nowhere".into());
    let dangling = prost_reflect::prost_types::FileDescriptorSet { file: vec![dangling] }.encode_to_vec();
    let channels = |count: u32| -> Vec<Vec<u8>> {
        (0..count).map(|i| channel(i as u16, 0, &format!("/topic/{i}"), &[])).collect()
    };
    let long = "x".repeat(60_000);
    let forged_length = |opcode: u8| [&[opcode][..], &(1u64 << 62).to_le_bytes()].concat();
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("a record of 2^62 bytes", file(&[forged_length(0x05)])),
        ("an attachment of 2^62 bytes", {
            let body =
                [&[0; 16][..], &text(b"a"), &text(b"b"), &(1u64 << 62).to_le_bytes(), &[0; 8]].concat();
            file(&[record(0x09, &body)])
        }),
        ("a string of 2^32 bytes", file(&[record(0x04, &[&[1, 0, 0, 0][..], &[0xff; 4], b"abc"].concat())])),
        ("a map of 2^32 bytes", {
            let body = [&[1, 0, 0, 0][..], &text(b"/t"), &text(b"protobuf"), &[0xff; 4]].concat();
            file(&[record(0x04, &body)])
        }),
        ("a chunk of 2^62 bytes unpacked", file(&[chunk(1 << 62, b"zstd", &bomb)])),
        ("a chunk bomb", file(&[chunk(zeros.len() as u64, b"zstd", &bomb)])),
        ("a chunk bomb that lies", file(&[chunk(100, b"zstd", &bomb)])),
        ("a chunk in a chunk", {
            let inner = chunk(0, b"", &[]);
            file(&[chunk(inner.len() as u64, b"", &inner)])
        }),
        ("a chunk of unknown compression", file(&[chunk(4, b"brotli", b"abcd")])),
        ("a million channels", file(&channels(1_000_000))),
        ("many metadata records", {
            let one = |i: u32| record(0x0c, &[text(format!("m{i}").as_bytes()), text(&[])].concat());
            file(&(0..300_000).map(one).collect::<Vec<_>>())
        }),
        ("many attachments", {
            let one = |i: u32| {
                let head = [&[0; 16][..], &text(format!("a{i}").as_bytes()), &text(b"b"), &[0; 8]].concat();
                record(0x09, &[head, vec![0; 4]].concat())
            };
            file(&(0..40_000).map(one).collect::<Vec<_>>())
        }),
        ("channels with long names", {
            let one = |i: u16| channel(i, 0, &format!("/{i}{long}"), &[]);
            file(&(0..3000).map(one).collect::<Vec<_>>())
        }),
        (
            "messages nested 10 000 deep in a schema",
            file(&[schema(1, "A", &deep), channel(1, 1, "/a", &[]), message(1, &[])]),
        ),
        (
            "a message nested 10 000 deep",
            file(&[schema(1, "lab.Note", &set), channel(1, 1, "/a", &[]), message(1, &inner)]),
        ),
        (
            "a schema that imports itself",
            file(&[schema(1, "lab.Note", &selfish), channel(1, 1, "/a", &[]), message(1, &[])]),
        ),
        (
            "a schema with a missing type",
            file(&[schema(1, "lab.Note", &dangling), channel(1, 1, "/a", &[]), message(1, &[])]),
        ),
        (
            "groups 10 000 deep",
            file(&[schema(1, "lab.Note", &set), channel(1, 1, "/a", &[]), message(1, &[0x7b; 10_000])]),
        ),
        ("a packed list of wrong length", {
            file(&[schema(1, "lab.Profile", &set), channel(1, 1, "/a", &[]), message(1, &[0x2a, 3, 1, 2, 3])])
        }),
    ];
    for (what, bytes) in cases {
        let (folder, _) = folder(&bytes);
        for verb in VERBS {
            let (status, stderr) = run(folder.path(), verb);
            // damaged or not sound or nothing to trace: said, and no crash
            assert!(matches!(status, Some(0..=3)), "{what}: {verb:?} ends with {status:?}: {stderr}");
            assert!(!stderr.contains("panicked"), "{what}: {verb:?}: {stderr}");
            if verb[0] == "verify" {
                assert_eq!(status, Some(1), "{what} is not sound");
            }
            if what.starts_with("many ") && verb[0] == "info" {
                assert!(stderr.contains("--max-memory"), "{what}: {stderr}");
            }
        }
    }
}

/// Bytes packed by zstd: what the `mcap` crate makes of an attachment's worth of zeros in a chunk.
fn mcap_zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::bulk::compress(bytes, 19).expect("packed bytes")
}

#[test]
fn attachments_cannot_lead_out_of_their_folder() {
    for name in ["../escaped", "/tmp/escaped", "a/b", "..", "", "c:escaped", "a\\b"] {
        let mut recording = forge(5, 1);
        recording.attachments = vec![(name.into(), b"content".to_vec())];
        let (folder, _) = folder(&recording.write(options(None)));
        let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachments", "-o", "out"]);
        assert_eq!(status, Some(1), "{name:?}: {stderr}");
        assert!(stderr.contains("is a path"), "{name:?}: {stderr}");
        assert!(!folder.path().join("out").exists(), "{name:?}: nothing is written");
        // named by the user, it can be had
        let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachment", name, "-o", "kept"]);
        assert_eq!(status, Some(0), "{name:?}: {stderr}");
        assert_eq!(fs::read(folder.path().join("kept")).expect("the output"), b"content");
    }
}
