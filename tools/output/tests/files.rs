//! Output files are atomic.

use std::{
    fs,
    io::{self, ErrorKind, Read, Write},
    path::Path,
};

use percuss_output::{Output, OutputError, Part, PartError, file_of, part_of, write};

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The error of the system that an output has failed with.
fn system_error(result: Result<(), OutputError>) -> io::Error {
    match result {
        Err(OutputError::System { error, .. }) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_file_gets_its_name_when_it_is_complete() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.csv");
    let mut output = Output::create(&path, false).expect("a file");
    output.write_all(b"half").expect("room");
    assert!(!path.exists());
    drop(output);
    assert!(names(folder.path()).is_empty());

    write(&path, b"whole", false).expect("a file");
    assert_eq!(names(folder.path()), ["a.csv"]);
    assert!(matches!(write(&path, b"other", false), Err(OutputError::Exists(_))));
    assert_eq!(fs::read(&path).expect("a file"), b"whole");
    let mut output = Output::create(&path, true).expect("a file");
    output.write_all(b"new").expect("room");
    assert_eq!(fs::read(&path).expect("the old file"), b"whole");
    output.commit().expect("a name");
    assert_eq!(fs::read(&path).expect("the new file"), b"new");
    assert_eq!(names(folder.path()), ["a.csv"]);
}

#[test]
fn a_name_that_is_taken_meanwhile_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.csv");
    let output = Output::create(&path, false).expect("a file");
    fs::write(&path, "mine").expect("a file");
    assert_eq!(output.commit().expect_err("it exists").kind(), ErrorKind::AlreadyExists);
    assert_eq!(fs::read(&path).expect("a file"), b"mine");
    assert_eq!(names(folder.path()), ["a.csv"]);

    let path = folder.path().join("b.mcap");
    let mut part = Part::create(&path, false).expect("a file");
    part.write_all(b"part").expect("room");
    fs::write(&path, "mine").expect("a file");
    assert_eq!(part.commit(true).expect_err("it exists").kind(), ErrorKind::AlreadyExists);
    assert_eq!(fs::read(&path).expect("a file"), b"mine");
    assert_eq!(fs::read(part_of(&path)).expect("the part"), b"part");
}

#[test]
fn long_names_and_names_without_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = format!("{}ü.csv", "ä".repeat(120));
    write(&folder.path().join(&long), b"x", false).expect("a file");
    assert_eq!(names(folder.path()), [long]);
    assert_eq!(part_of(Path::new("a.mcap")), Path::new("a.mcap.part"));
}

#[test]
fn a_part_stays_until_it_is_complete() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    let mut part = Part::create(&path, false).expect("a file");
    part.write_all(b"one").expect("room");
    for overwrite in [false, true] {
        let refused = Part::create(&path, overwrite).expect_err("the first one is writing");
        assert!(matches!(refused, PartError::Busy(_)), "{refused}");
    }
    drop(part);
    assert_eq!(names(folder.path()), ["a.mcap.part"]);
    assert!(matches!(Part::create(&path, false), Err(PartError::Left(_))));
    assert_eq!(fs::read(part_of(&path)).expect("the part"), b"one");

    let mut part = Part::create(&path, true).expect("a file");
    part.write_all(b"2").expect("room");
    part.commit(true).expect("a name");
    assert_eq!(names(folder.path()), ["a.mcap"]);
    assert_eq!(fs::read(&path).expect("the file"), b"2");
    assert!(matches!(Part::create(&path, false), Err(PartError::Output(OutputError::Exists(_)))));
    // an empty one says nothing
    let other = folder.path().join("b.mcap");
    fs::write(part_of(&other), "").expect("a file");
    Part::create(&other, false).expect("a file").commit(false).expect("a name");
    assert!(other.exists());
}

#[test]
#[cfg(target_os = "linux")]
fn links_are_followed_and_devices_written_to() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};

    let folder = tempfile::tempdir().expect("a folder");
    let (target, link) = (folder.path().join("target.csv"), folder.path().join("link.csv"));
    fs::write(&target, "old").expect("a file");
    std::os::unix::fs::symlink(&target, &link).expect("a link");
    assert!(write(&link, b"new", false).is_err());
    write(&link, b"new", true).expect("a file");
    assert_eq!(fs::read(&target).expect("the target"), b"new");
    assert!(fs::symlink_metadata(&link).expect("the link").is_symlink());
    fs::remove_file(&target).expect("a file");
    assert_eq!(system_error(write(&link, b"new", true)).kind(), ErrorKind::NotFound);

    write(Path::new("/dev/null"), b"x", false).expect("a device");
    let mut part = Part::create(Path::new("/dev/null"), false).expect("a device");
    part.write_all(b"x").expect("a device");
    part.commit(true).expect("a device");
    assert_eq!(system_error(write(folder.path(), b"x", true)).kind(), ErrorKind::IsADirectory);
    assert_eq!(names(folder.path()), ["link.csv"]);

    let pipe = folder.path().join("pipe");
    // no program: while it starts it holds the locks of the other tests
    mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
    // asking does not open it: its reader would see an end
    assert_eq!(file_of(&pipe).expect("a pipe"), None);
    let reader = {
        let pipe = pipe.clone();
        std::thread::spawn(move || fs::read(pipe).expect("the pipe"))
    };
    write(&pipe, b"through", false).expect("a pipe");
    assert_eq!(reader.join().expect("the reader"), b"through");
}

#[test]
#[cfg(target_os = "linux")]
fn errors_say_how_much_was_written() {
    let error = system_error(write(Path::new("/dev/full"), b"x", false));
    assert_eq!(error.kind(), ErrorKind::StorageFull);
    assert_eq!(error.to_string(), "writing after 0 bytes: No space left on device (os error 28)");
}

#[test]
fn what_was_left_stays_until_it_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    assert!(matches!(Part::resume(&path, false), Err(PartError::Nothing(_))));
    let mut part = Part::create(&path, false).expect("a file");
    part.write_all(b"left").expect("room");
    assert!(matches!(Part::resume(&path, false), Err(PartError::Busy(_))));
    drop(part);

    // given up
    let (mut new, left) = Part::resume(&path, false).expect("a part");
    assert!(matches!(Part::resume(&path, false), Err(PartError::Busy(_))));
    new.write_all(b"half").expect("room");
    drop((new, left));
    assert_eq!(names(folder.path()), ["a.mcap.part"]);
    assert_eq!(fs::read(part_of(&path)).expect("a part"), b"left");

    // killed, then complete
    fs::write(folder.path().join("a.mcap.part.new"), b"of one that was killed").expect("room");
    let (mut new, mut left) = Part::resume(&path, false).expect("a part");
    let mut text = String::new();
    left.file().read_to_string(&mut text).expect("a part");
    assert_eq!(text, "left");
    new.write_all(b"left and").expect("room");
    left.replace().expect("a name");
    assert_eq!(names(folder.path()), ["a.mcap.part"]);
    assert!(matches!(Part::create(&path, true), Err(PartError::Busy(_))));
    new.write_all(b" more").expect("room");
    new.commit(true).expect("a name");
    assert_eq!(names(folder.path()), ["a.mcap"]);
    assert_eq!(fs::read(&path).expect("a file"), b"left and more");
    assert!(matches!(Part::resume(&path, false), Err(PartError::Output(OutputError::Exists(_)))));
}
