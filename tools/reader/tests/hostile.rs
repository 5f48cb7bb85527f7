//! What is said of hostile files, those of the watchdog, and what they cannot do: escape from a folder, command a terminal.

use std::fs;

use crate::{
    forge,
    raw::{
        self, attachment, channel, compressed, double, file, folder, map, message, message_at, metadata,
        record, run, run_all, text, whole,
    },
    watchdog::{self, types::lab},
};

/// What a verb is to say, and its status.
type Said = (&'static str, i32, &'static str);

/// Hostile files of the watchdog, and what is said of them.
const SAID: &[(&[&str], &[Said])] = &[
    (
        &[
            "empty submessages",
            "entries of a map",
            "packed numbers of a byte",
            "fields that are not known",
            "parts that have to be merged",
        ],
        &[
            ("verify", 3, "a message of `/note` at log time 0 unpacks to more than --max-memory allows"),
            ("trace", 3, "--max-memory"),
            ("cat", 0, "{\"bytes\":"),
            ("recover", 0, "1 messages"),
        ],
    ),
    // kept as bytes by all that only measure
    (&["submessages of a type inside itself"], &[("verify", 0, "sound"), ("cat", 0, "{\"bytes\":")]),
    (
        &[
            "descriptors of very many empty types",
            "descriptors of four million empty types",
            "descriptors that unpack 400 times",
            "very many comments",
        ],
        &[
            ("info", 3, "no room for the schema `A`"),
            ("verify", 1, "--max-memory"),
            ("cat", 3, "{\"bytes\":0}"),
            ("schema", 0, "is not a sound protobuf schema"),
        ],
    ),
    (
        &["a package of very many parts"],
        &[("verify", 1, "does not describe its message"), ("trace", 2, "sound schema")],
    ),
    (&["an empty file"], &[("info", 1, "not an MCAP file"), ("verify", 1, "")]),
    (&["very many places without a comment"], &[("verify", 0, "sound"), ("trace", 0, "")]),
    (&["editions"], &[("verify", 1, "`editions`"), ("info", 0, "messages are not decoded")]),
    (&["files that import each other"], &[("verify", 1, "circles"), ("info", 0, "messages are not decoded")]),
    (
        &["a million channels in the summary"],
        &[("info", 3, "--max-memory"), ("verify", 1, "--max-memory"), ("recover", 3, "--max-memory")],
    ),
    (
        &["a million schemas in the summary", "types that hold the next one twice"],
        &[("verify", 1, "--max-memory")],
    ),
    (&["a million metadata records"], &[("info", 3, "--max-memory")]),
    (&["channels with long names", "axes of two million points"], &[("info", 3, "--max-memory")]),
    (&["axes of a million points"], &[("trace", 0, "left out: `p`"), ("verify", 0, "sound")]),
    (&["units of 70 000 letters"], &[("info", 0, "xxxxxxxx")]),
    (&["matrices whose elements have no size"], &[("report", 0, "")]),
    (
        &["depths that are not sound"],
        &[("verify", 1, "lists the position 1 behind 2 along z"), ("trace", 0, ""), ("report", 0, "")],
    ),
    (&["depths that all stand twice"], &[("trace", 2, "is a matrix"), ("report", 0, "")]),
    (
        &["a record that is longer than its chunk"],
        &[
            ("verify", 1, "a record that is longer than its chunk"),
            ("info", 3, "a record that is longer than its chunk"),
        ],
    ),
    (
        &[
            "a record of 2^63 bytes",
            "an attachment that claims a gigabyte",
            "texts beyond their record",
            "chunks that claim 2^64 − 1 bytes",
            "chunks that claim too little",
            "a chunk of 250 MB of zeros",
            "chunks in chunks",
            "chunks of other compressions",
            "a million channels",
            "a million metadata records",
            "channels with long names",
            "types nested 10 000 deep",
            "imports that are not there",
            "groups and extensions",
        ],
        &[("verify", 1, "")],
    ),
    // messages that cannot be decoded
    (&["lists that cannot be packed", "messages that are broken"], &[("verify", 3, "")]),
];

#[test]
fn what_is_wrong_is_said() {
    for (name, said) in SAID.iter().flat_map(|(names, said)| names.iter().map(move |name| (name, said))) {
        let (folder, _) = folder(&watchdog::make(name));
        for (verb, expected, part) in *said {
            let verb = watchdog::VERBS.iter().find(|command| command.starts_with(verb)).expect("a verb");
            let (status, stdout, stderr) = run_all(folder.path(), &verb.split(' ').collect::<Vec<_>>());
            let all = format!("{stdout}{stderr}");
            assert_eq!(status, Some(*expected), "{name}: {verb}: {all:.1000}");
            assert!(all.contains(part), "{name}: {verb} does not say `{part}`: {all:.1000}");
        }
    }
    // replay reads by the index, and would wait for viewers otherwise
    let (folder, _) = folder(&watchdog::make("a million channels in the summary"));
    let (status, stderr) = run(folder.path(), &["replay", "a.mcap", "--addr", "127.0.0.1:0", "--once"]);
    assert!(status == Some(1) && stderr.contains("--max-memory"), "{stderr}");
    let attachments = (0..40_000).map(|i| attachment(&format!("a{i}"), &[]));
    let (folder, _) = raw::folder(&whole(&attachments.collect::<Vec<_>>(), &[]));
    let (status, stderr) = run(folder.path(), &["info", "a.mcap"]);
    assert!(status == Some(3) && stderr.contains("--max-memory"), "{stderr}");
}

#[test]
fn definitions_count_wherever_they_stand() {
    let own = |topic: &str| raw::channel_of(1, 0, topic, "json", &[]);
    let said = |i: u64| message_at(1, i, format!("{{\"v\":{i}}}").as_bytes());
    let early = [said(1), said(2), own("/d"), said(3)];
    let twice = [own("/d"), said(1), own("/other"), said(2), said(3)];
    for (records, what, kept) in [
        (&early[..], "2 messages of channel 1 stand before its definition", 0),
        (&twice[..], "channel 1 is defined again as `/other`: it stays `/d`", 3),
    ] {
        let (folder, _) = folder(&whole(records, &[]));
        for verb in ["info a.mcap", "trace a.mcap", "cat a.mcap", "plot a.mcap"] {
            let (status, stderr) = run(folder.path(), &verb.split(' ').collect::<Vec<_>>());
            assert!(status == Some(3) && stderr.contains(what), "{verb}: {stderr}");
        }
        let (_, table, _) = run_all(folder.path(), &["trace", "a.mcap"]);
        assert_eq!(table.lines().count(), 4, "{table}");
        let recover = ["recover", "a.mcap", "-o", "r.mcap"];
        let (status, all, _) = run_all(folder.path(), &recover);
        assert!(status == Some(kept) && all.contains("3 messages"), "{all}");
        let (_, all, _) = run_all(folder.path(), &["info", "r.mcap"]);
        assert!(all.contains("/d         3"), "{all}");
    }
}

#[test]
fn chunks_full_of_empty_messages() {
    // a chunk of them fits into what each of two files may take
    const MANY: u64 = 200_000;
    let full = |time: u64, chunks: usize| {
        let messages = message_at(1, time, &[]).repeat(MANY as usize);
        let entries = (0..MANY).flat_map(|i| [time.to_le_bytes(), (31 * i).to_le_bytes()].concat());
        let index = record(0x07, &[&1_u16.to_le_bytes()[..], &text(&entries.collect::<Vec<u8>>())].concat());
        let chunk = compressed(&[messages]);
        let mut records = vec![channel(1, 0, "/empty", &[])];
        records.extend((0..chunks).map(|_| chunk.clone()));
        records.push(index);
        whole(&records, &[])
    };
    for (time, status) in [(0, 0), (5, 1)] {
        let (folder, _) = folder(&full(time, 1));
        let (found, stderr) = run(folder.path(), &["verify", "a.mcap"]);
        assert_eq!((found, stderr.as_str()), (Some(status), ""), "the header of the chunk says time 0");
    }
    let (folder, _) = folder(&[]);
    // each waits for a counterpart that does not come
    for (name, time) in [("a.mcap", 0), ("b.mcap", 1 << 40)] {
        fs::write(folder.path().join(name), full(time, 40)).expect("a file");
    }
    for mode in ["time", "linear"] {
        let (status, stderr) = run(folder.path(), &["diff", "a.mcap", "b.mcap", "--align", mode]);
        assert_eq!(status, Some(2), "{mode}: {stderr}");
        assert!(stderr.contains("raise --max-memory"), "{mode}: {stderr}");
    }
}

#[test]
fn messages_that_all_have_one_time() {
    const MANY: usize = 60_000;
    let topics = ["/a", "/b", "/c"];
    let mut records = vec![lab(1, "Scalar")];
    records.extend((1..).zip(topics).map(|(id, topic)| channel(id, 1, topic, &[])));
    // force = 1, at time 0
    records.extend((0..MANY).flat_map(|_| (1..=3).map(|id| message(id, &double(3, 1.0)))));
    let (folder, _) = folder(&whole(&[compressed(&records)], &[]));
    let plot = ["plot", "a.mcap", "--topic", "*", "-o", "p.svg"];
    let (status, stderr) = run(folder.path(), &plot);
    assert!(status == Some(1) && stderr.contains("more points than --max-memory allows"), "{stderr}");
    let (status, stderr) = run(folder.path(), &[&plot[..], &["--field", "force"]].concat());
    assert_eq!(status, Some(0), "{stderr}");
    for align in ["exact", "nearest", "linear"] {
        let verb = ["trace", "a.mcap", "--topic", "/a,/b", "--field", "force", "--align", align];
        let (status, stdout, stderr) = run_all(folder.path(), &verb);
        assert_eq!(status, Some(0), "{align}: {stderr}");
        // a row for every message of the first topic, and the names
        assert_eq!(stdout.lines().count(), MANY + 1, "{align}");
    }
}

#[test]
fn names_command_no_terminal() {
    let wicked = "::warning::a\n::error::b\u{1b}[2J\u{9b}1m\u{202e}\r##[error]\u{200b}";
    let bytes = |force: f64| {
        let records = [
            metadata(wicked, &[(wicked, wicked)]),
            lab(1, "Scalar"),
            channel(1, 1, wicked, &map(&[("unit.force", wicked)])),
            channel(2, 7, wicked, &[]),
            message(1, &double(3, force)),
        ];
        file(&records)
    };
    let (folder, _) = folder(&bytes(1.0));
    fs::write(folder.path().join("b.mcap"), bytes(2.0)).expect("a file");
    let named = format!("{wicked}.mcap");
    fs::write(folder.path().join(&named), &bytes(1.0)[..200]).expect("a file");
    fs::write(folder.path().join("t.csv"), format!("\"{wicked}\",b\n1,2\n")).expect("a file");
    let verbs: [&[&str]; 25] = [
        &["diff", "a.mcap", &named, "--github"],
        &["info", &named],
        &["verify", &named],
        &["trace", &named],
        &["cat", &named, "--topic", "/nowhere"],
        &["recover", &named, "-o", "r.mcap"],
        &["diff", &named, "b.mcap"],
        &["diff", "a.mcap", &named],
        &["export", "a.mcap", "--attachment", "/nowhere"],
        &["plot", "a.mcap", "--topic", "/nowhere"],
        &["plot", "a.mcap", "--topic", wicked, "--field", "force", "--width", "60"],
        &["plot", "t.csv", "--x", "b", "--y", "c"],
        &["trace", "a.mcap", "--topic", wicked, "--field", "nothing"],
        &["trace", "a.mcap", "--topic", wicked, "--format", "text"],
        &["summary", "a.mcap"],
        &["report", "a.mcap", "-o", "p.html"],
        &["info", "a.mcap"],
        &["info", "a.mcap", "--json"],
        &["verify", "a.mcap"],
        &["verify", "a.mcap", "--json"],
        &["trace", "a.mcap", "--topic", "/nowhere"],
        &["schema", "a.mcap"],
        &["diff", "a.mcap", "b.mcap"],
        &["diff", "a.mcap", "b.mcap", "--summary"],
        &["diff", "a.mcap", "b.mcap", "--json"],
    ];
    for verb in verbs {
        let (_, stdout, stderr) = run_all(folder.path(), verb);
        let all = format!("{stdout}{stderr}");
        let is_command = |c: char| (c.is_control() && c != '\n') || "\u{202e}\u{200b}".contains(c);
        assert!(!all.contains(is_command), "{verb:?}: {all:?}");
        // on a line of its own, or anywhere: a command to the machine that runs a job
        let is_own = |line: &str| verb.contains(&"--github") && line.starts_with("::error title=");
        let is_job =
            |line: &str| (line.trim_start().starts_with("::") && !is_own(line)) || line.contains("##[");
        assert_eq!(all.lines().any(is_own), verb.contains(&"--github"), "{verb:?}: {all:?}");
        assert!(!all.is_empty() && !all.lines().any(is_job), "{verb:?}: {all:?}");
        if verb.contains(&"--json") {
            let json: serde_json::Value = serde_json::from_str(&stdout).expect("a document");
            assert!(json.to_string().contains("[2J"), "{verb:?}: {json}");
        } else if verb[0] == "info" || verb[0] == "verify" {
            assert!(all.contains("\\u{1b}[2J"), "{verb:?}: {all}");
        }
    }
}

#[test]
fn attachments_of_one_name_are_all_exported() {
    let all = [("a.txt", "1"), ("a.txt", "2"), ("a.2.txt", "3"), ("a.txt", "4"), ("b", "5"), ("b", "6")];
    let records: Vec<Vec<u8>> =
        all.iter().map(|(name, content)| attachment(name, content.as_bytes())).collect();
    let (folder, _) = folder(&whole(&records, &[]));
    let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachments", "-o", "out", "--force"]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("another attachment is named `a.txt` as well"), "{stderr}");
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).expect(name);
    let names = ["a.txt", "a.3.txt", "a.2.txt", "a.4.txt", "b", "b.2"];
    assert_eq!(names.map(read), ["1", "2", "3", "4", "5", "6"]);
    let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachment", "a.txt"]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("2 more attachments have this name"), "{stderr}");
}

#[test]
fn attachments_cannot_lead_out_of_their_folder() {
    for name in ["../escaped", "/tmp/escaped", "a/b", "..", "", "c:escaped", "a\\b"] {
        let mut recording = forge::forge(5, 1);
        recording.attachments =
            vec![(name.into(), b"content".to_vec()), ("sound.txt".into(), b"content".to_vec())];
        let (folder, _) = folder(&recording.write(forge::plain()));
        let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachments", "-o", "out"]);
        assert_eq!(status, Some(3), "{name:?}: {stderr}");
        assert!(stderr.contains("is a path"), "{name:?}: {stderr}");
        let written = fs::read_dir(folder.path().join("out")).expect("the folder");
        let written: Vec<_> = written.map(|entry| entry.expect("a file").file_name()).collect();
        assert_eq!(written, ["sound.txt"], "{name:?}: the others are written");
        // named by the user, it can be had
        let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachment", name, "-o", "kept"]);
        assert_eq!(status, Some(0), "{name:?}: {stderr}");
        assert_eq!(fs::read(folder.path().join("kept")).expect("the output"), b"content");
    }
}

#[test]
fn thousands_of_attachments_are_exported() {
    const MANY: usize = 5_000;
    let attachments: Vec<Vec<u8>> = (0..MANY).map(|i| attachment(&format!("a{i}"), b"content")).collect();
    let (folder, _) = folder(&whole(&attachments, &[]));
    let (status, _, stderr) = run_all(folder.path(), &["export", "a.mcap", "--attachments", "-o", "out"]);
    assert_eq!(status, Some(0), "{stderr}");
    let names: Vec<_> = fs::read_dir(folder.path().join("out")).expect("the folder").collect();
    assert_eq!(names.len(), MANY);
    assert_eq!(fs::read(folder.path().join("out/a4999")).expect("the last"), b"content");
}

#[test]
fn attachments_that_have_no_room_are_verified_in_pieces() {
    const SIZE: usize = 20 << 20;
    let content: Vec<u8> = (0..SIZE).map(|i| ((i * i) >> 7) as u8).collect();
    let mut recording = forge::forge(5, 1);
    recording.attachments =
        vec![("large.bin".into(), content.clone()), ("small.txt".into(), b"small".to_vec())];
    let sound = recording.write(forge::plain());
    let (folder, _) = folder(&sound);
    let little = |arguments: &str| run_all(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    let (status, text, stderr) = little("verify a.mcap");
    assert_eq!(status, Some(0), "{text}{stderr}");
    let (status, text, _) = little("info a.mcap --json");
    assert!(status == Some(0) && text.contains(&SIZE.to_string()), "{text}");
    let (status, _, stderr) = little("export a.mcap --attachment large.bin");
    assert!(status == Some(1) && stderr.contains("--max-memory"), "{stderr}");
    let (status, text, stderr) = little("export a.mcap --attachments -o out");
    assert!(
        status == Some(3) && text.contains("small.txt") && stderr.contains("large.bin"),
        "{text}{stderr}"
    );
    let (status, text, _) = little("recover a.mcap -o r.mcap");
    assert!(status == Some(3) && text.contains("attachment `large.bin`"), "{text}");
    let (status, text, _) = little("diff a.mcap a.mcap");
    assert_eq!(status, Some(0), "{text}");
    // a byte in the middle, in the last piece, in the checksum
    let begin = sound.windows(64).position(|bytes| bytes == &content[..64]).expect("the content");
    for at in [begin + SIZE / 2, begin + SIZE - 1, begin + SIZE + 1] {
        let mut damaged = sound.clone();
        damaged[at] ^= 0x10;
        fs::write(folder.path().join("d.mcap"), &damaged).expect("a file");
        let (status, text, _) = little("verify d.mcap");
        assert!(status == Some(1) && text.contains("CRC of an attachment failed"), "{at}: {text}");
    }
}
