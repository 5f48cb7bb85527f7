//! Recordings that grow, fail and are opened often; the table `parts` has what is said of those that are not complete, and of files
//! that are none.

use std::{
    fs::{self, OpenOptions},
    io::{Cursor, Read, Seek, SeekFrom, Write},
    path::Path,
};

use percuss_reader::{
    failure::Failure,
    messages::Recording,
    recording::{Limits, Scan},
};

use crate::{desk::Desk, forge};

#[test]
fn a_file_that_grows_is_read_as_far_as_it_was() {
    let whole = forge::forge(200, 1).write(forge::plain());
    let desk = Desk::new(&[("a.mcap.part", whole[..whole.len() / 2].to_vec())]);
    let path = desk.path("a.mcap.part");
    let mut scan = Scan::open(&path, Limits::default()).expect("a recording");
    let (mut records, mut rest) = (0, whole[whole.len() / 2..].chunks(997));
    let mut file = OpenOptions::new().append(true).open(&path).expect("the file");
    while scan.next(|_| ()).expect("no error of the system").is_some() {
        records += 1;
        if let Some(more) = rest.next() {
            file.write_all(more).expect("room");
        }
    }
    assert!(records > 100 && !scan.is_complete(), "{records} records: {:?}", scan.damages());
    rest.for_each(|more| file.write_all(more).expect("room"));
    desk.text(0, &["verify", "a.mcap.part"]);
}

#[test]
fn ten_gigabytes_of_nothing_end_at_once() {
    let desk = Desk::new(&[("a.mcap", forge::forge(3, 1).write(forge::plain()))]);
    let file = OpenOptions::new().write(true).open(desk.path("a.mcap")).expect("the file");
    file.set_len(10_000_000_000).expect("a sparse file");
    drop(file);
    let said = desk.text(1, &["verify", "a.mcap"]);
    assert!(said.contains("NOT SOUND"), "{said}");
}

/// A source that fails, or ends, at some byte; what is behind another one can be read.
struct Failing {
    bytes: Cursor<Vec<u8>>,
    at: u64,
    tail: u64,
    kind: std::io::ErrorKind,
}

impl Read for Failing {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let position = self.bytes.position();
        if position >= self.tail {
            return self.bytes.read(into);
        }
        let left = self.at.saturating_sub(position);
        if left == 0 && self.kind == std::io::ErrorKind::UnexpectedEof {
            return Ok(0);
        }
        if left == 0 {
            // EIO
            return Err(std::io::Error::from_raw_os_error(5));
        }
        let most = into.len().min(left as usize);
        self.bytes.read(&mut into[..most])
    }
}

impl Seek for Failing {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(to)
    }
}

#[test]
fn errors_of_the_system_say_what_where_and_why() {
    let whole = forge::forge(200, 1).write(forge::plain());
    let bytes = whole[..whole.len() / 2].to_vec();
    let cases = [
        (std::io::ErrorKind::Other, "Input/output error (os error 5) (near byte "),
        (std::io::ErrorKind::UnexpectedEof, "the file has become shorter while it was read (near byte "),
    ];
    for (kind, expected) in cases {
        // the end is read first, to find the summary
        let at = bytes.len() as u64 / 2;
        let tail = bytes.len() as u64 - 37;
        let source = Failing { bytes: Cursor::new(bytes.clone()), at, tail, kind };
        let mut scan =
            Scan::of(Box::new(source), Path::new("a.mcap"), Limits::default()).expect("a beginning");
        let error = loop {
            match scan.next(|_| ()) {
                Ok(Some(())) => {}
                Ok(None) => panic!("the fault is not noticed"),
                Err(error) => break error,
            }
        };
        let said = error.to_string();
        assert!(said.starts_with("cannot read `a.mcap`: ") && said.contains(expected), "{said}");
    }
}

#[test]
fn five_thousand_opens_leave_no_file_open() {
    let sound = forge::forge(3, 1).write(forge::plain());
    let mut damaged = sound.clone();
    damaged[300..400].fill(0xff);
    let files = [
        ("a.mcap", sound.clone()),
        ("b.mcap", damaged),
        ("c.mcap", sound[..500].to_vec()),
        ("d.mcap", vec![]),
    ];
    let desk = Desk::new(&files);
    let open_files = || fs::read_dir("/proc/self/fd").expect("the files that are open").count();
    let before = open_files();
    let (mut read, mut refused, mut most) = (0, 0, before);
    for round in 0..5000 {
        let name = ["a.mcap", "b.mcap", "c.mcap", "d.mcap", "none.mcap"][round % 5];
        let ends = Recording::open(&desk.path(name), Limits::default()).and_then(|recording| {
            let mut messages = recording.messages(recording.channels.keys().copied(), None)?;
            // left in the middle
            messages.next(|_| ()).map(drop)
        });
        match ends {
            Ok(()) => read += 1,
            Err(Failure::Read { .. } | Failure::Failed(_)) => refused += 1,
            Err(error) => panic!("{name}: {error}"),
        }
        if round % 1000 == 0 {
            most = most.max(open_files());
        }
    }
    assert_eq!((read, refused), (3000, 2000));
    // other tests of this program have files open for a moment
    assert!(most.max(open_files()) < before + 60, "{before} files were open, then up to {most}");
}
