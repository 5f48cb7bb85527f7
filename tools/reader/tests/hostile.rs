//! What is said of hostile files, those of the watchdog, and what they cannot do: escape from a folder, command a terminal.

use std::fs;

use crate::{
    desk::Desk,
    forge::{Forged, forge, plain},
    raw::{
        attachment, channel, channel_of, compressed, double, file, map, message, message_at, metadata,
        record, text, whole,
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
    (&["a syntax without a name"], &[("verify", 1, "its syntax is ``")]),
    (&["a syntax of the future"], &[("verify", 1, "its syntax is `proto9")]),
    (
        &[
            "a file that imports itself",
            "files that import each other",
            "files that import the next one twice",
        ],
        &[("verify", 1, "circles or too often"), ("info", 0, "messages are not decoded")],
    ),
    (
        &[
            "maps that are none",
            "a map without keys and values",
            "a map without values",
            "a map of numbers as keys",
        ],
        &[("verify", 1, "`E` is no entry of a map")],
    ),
    (&["options that mean something else"], &[("verify", 0, "sound")]),
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

/// A recording with attachments, as a writer makes it.
fn attached(attachments: &[(&str, &[u8])]) -> Vec<u8> {
    let own = |&(name, content): &(&str, &[u8])| (name.to_owned(), content.to_vec());
    Forged { attachments: attachments.iter().map(own).collect(), ..forge(5, 1) }.write(plain())
}

#[test]
fn what_is_wrong_is_said() {
    for (name, said) in SAID.iter().flat_map(|(names, said)| names.iter().map(move |name| (name, said))) {
        let desk = Desk::limited(watchdog::make(name));
        for (verb, expected, part) in *said {
            let verb = watchdog::VERBS.iter().find(|command| command.starts_with(verb)).expect("a verb");
            println!("{name}: {verb}");
            let all = desk.all(*expected, verb);
            assert!(all.contains(part), "{name}: {verb} does not say `{part}`: {all:.1000}");
        }
    }
    // replay reads by the index, and would wait for viewers otherwise
    let desk = Desk::limited(watchdog::make("a million channels in the summary"));
    let said = desk.all(1, "replay a.mcap --addr 127.0.0.1:0 --once");
    assert!(said.contains("--max-memory"), "{said}");
    let attachments = (0..40_000).map(|i| attachment(&format!("a{i}"), &[]));
    let said = Desk::limited(whole(&attachments.collect::<Vec<_>>(), &[])).all(3, "info a.mcap");
    assert!(said.contains("--max-memory"), "{said}");
}

#[test]
fn definitions_count_wherever_they_stand() {
    let own = |topic: &str| channel_of(1, 0, topic, "json", &[]);
    let said = |i: u64| message_at(1, i, format!("{{\"v\":{i}}}").as_bytes());
    let early = [said(1), said(2), own("/d"), said(3)];
    let twice = [own("/d"), said(1), own("/other"), said(2), said(3)];
    for (records, what, kept) in [
        (&early[..], "2 messages of channel 1 stand before its definition", 0),
        (&twice[..], "channel 1 is defined again as `/other`: it stays `/d`", 3),
    ] {
        let desk = Desk::limited(whole(records, &[]));
        for verb in ["info a.mcap", "trace a.mcap", "cat a.mcap", "plot a.mcap"] {
            let said = desk.all(3, verb);
            assert!(said.contains(what), "{verb}: {said}");
        }
        assert_eq!(desk.text(3, &["trace", "a.mcap"]).lines().count(), 4);
        assert!(desk.all(kept, "recover a.mcap -o r.mcap").contains("3 messages"));
        assert!(desk.all(0, "info r.mcap").contains("/d         3"));
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
        whole(&[channel(1, 0, "/empty", &[]), compressed(&[messages]).repeat(chunks), index], &[])
    };
    for (time, status) in [(0, 0), (5, 1)] {
        let said = Desk::limited(full(time, 1)).error(status, &["verify", "a.mcap"]);
        assert_eq!(said, "", "the header of the chunk says time 0");
    }
    // each waits for a counterpart that does not come
    let desk = Desk::limited(full(0, 40));
    desk.put("b.mcap", full(1 << 40, 40));
    for mode in ["time", "linear"] {
        let said = desk.all(2, &format!("diff a.mcap b.mcap --align {mode}"));
        assert!(said.contains("raise --max-memory"), "{mode}: {said}");
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
    let desk = Desk::limited(whole(&[compressed(&records)], &[]));
    let said = desk.all(1, "plot a.mcap --topic * -o p.svg");
    assert!(said.contains("more points than --max-memory allows"), "{said}");
    desk.all(0, "plot a.mcap --topic * -o p.svg --field force");
    for align in ["exact", "nearest", "linear"] {
        let verb = ["trace", "a.mcap", "--topic", "/a,/b", "--field", "force", "--align", align];
        // a row for every message of the first topic, and the names
        assert_eq!(desk.lines(&verb).len(), MANY + 1, "{align}");
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
    let desk = Desk::limited(bytes(1.0));
    desk.put("b.mcap", bytes(2.0));
    let named = format!("{wicked}.mcap");
    desk.put(&named, &bytes(1.0)[..200]);
    desk.put("t.csv", format!("\"{wicked}\",b\n1,2\n"));
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
        let output = desk.read(verb);
        let [stdout, stderr] =
            [output.stdout, output.stderr].map(|said| String::from_utf8(said).expect("text"));
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
    let records = all.map(|(name, content)| attachment(name, content.as_bytes()));
    let desk = Desk::limited(whole(&records, &[]));
    let said = desk.all(0, "export a.mcap --attachments -o out --force");
    assert!(said.contains("another attachment is named `a.txt` as well"), "{said}");
    let names = ["a.txt", "a.3.txt", "a.2.txt", "a.4.txt", "b", "b.2"];
    assert_eq!(names.map(|name| desk.bytes(&format!("out/{name}"))).concat(), b"123456");
    let said = desk.all(0, "export a.mcap --attachment a.txt");
    assert!(said.contains("2 more attachments have this name"), "{said}");
}

#[test]
fn attachments_cannot_lead_out_of_their_folder() {
    for name in ["../escaped", "/tmp/escaped", "a/b", "..", "", "c:escaped", "a\\b"] {
        let desk = Desk::limited(attached(&[(name, b"content"), ("sound.txt", b"content")]));
        let said = desk.all(3, "export a.mcap --attachments -o out");
        assert!(said.contains("is a path"), "{name:?}: {said}");
        let written = fs::read_dir(desk.path("out")).expect("the folder");
        let written: Vec<_> = written.map(|entry| entry.expect("a file").file_name()).collect();
        assert_eq!(written, ["sound.txt"], "{name:?}: the others are written");
        // named by the user, it can be had
        desk.text(0, &["export", "a.mcap", "--attachment", name, "-o", "kept"]);
        assert_eq!(desk.bytes("kept"), b"content");
    }
}

#[test]
fn thousands_of_attachments_are_exported() {
    const MANY: usize = 5_000;
    let attachments: Vec<Vec<u8>> = (0..MANY).map(|i| attachment(&format!("a{i}"), b"content")).collect();
    let desk = Desk::limited(whole(&attachments, &[]));
    desk.all(0, "export a.mcap --attachments -o out");
    assert_eq!(fs::read_dir(desk.path("out")).expect("the folder").count(), MANY);
    assert_eq!(desk.bytes("out/a4999"), b"content");
}

#[test]
fn attachments_that_have_no_room_are_verified_in_pieces() {
    const SIZE: usize = 20 << 20;
    let content: Vec<u8> = (0..SIZE).map(|i| ((i * i) >> 7) as u8).collect();
    let sound = attached(&[("large.bin", &content), ("small.txt", b"small")]);
    let desk = Desk::limited(sound.clone());
    let size = SIZE.to_string();
    for (status, verb, parts) in [
        (0, "verify a.mcap", ["sound"; 2]),
        (0, "info a.mcap --json", [&size; 2]),
        (1, "export a.mcap --attachment large.bin", ["--max-memory"; 2]),
        (3, "export a.mcap --attachments -o out", ["small.txt", "large.bin"]),
        (3, "recover a.mcap -o r.mcap", ["attachment `large.bin`"; 2]),
        (0, "diff a.mcap a.mcap", [""; 2]),
    ] {
        let said = desk.all(status, verb);
        assert!(parts.iter().all(|part| said.contains(part)), "{verb}: {said}");
    }
    // a byte in the middle, in the last piece, in the checksum
    let begin = sound.windows(64).position(|bytes| bytes == &content[..64]).expect("the content");
    for at in [begin + SIZE / 2, begin + SIZE - 1, begin + SIZE + 1] {
        let mut damaged = sound.clone();
        damaged[at] ^= 0x10;
        desk.put("d.mcap", &damaged);
        let said = desk.all(1, "verify d.mcap");
        assert!(said.contains("CRC of an attachment failed"), "{at}: {said}");
    }
}
