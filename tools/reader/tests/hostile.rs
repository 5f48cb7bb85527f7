//! Small files that unpack to very many things, or that lead a reader in circles: every verb ends with a documented status
//! and stays within its memory.

use prost_reflect::{
    prost::Message,
    prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    },
};

use crate::{
    forge,
    raw::{
        block, channel, chunk, file, folder, map, message, message_at, metadata, packed, record, run,
        run_all, schema, text, whole,
    },
};

const VERBS: [&[&str]; 10] = [
    &["info", "a.mcap"],
    &["verify", "a.mcap"],
    &["trace", "a.mcap", "--topic", "*", "-o", "t.csv", "--force"],
    &["plot", "a.mcap", "--topic", "*", "-o", "p.svg", "--force"],
    &["cat", "a.mcap"],
    &["schema", "a.mcap"],
    &["diff", "a.mcap", "a.mcap"],
    &["recover", "a.mcap", "-o", "r.mcap", "--force"],
    &["export", "a.mcap", "--attachments", "-o", "out", "--force"],
    &["report", "a.mcap", "-o", "r.html", "--force"],
];

/// What a verb is to say, and its status.
type Expected<'a> = (&'a str, i32, &'a str);

/// Runs every verb on a file: each ends with a documented status, and none crashes. Some are to say something.
fn check(what: &str, bytes: &[u8], expected: &[Expected<'_>]) {
    let (folder, _) = folder(bytes);
    for verb in VERBS {
        let (status, stdout, stderr) = run_all(folder.path(), verb);
        assert!(matches!(status, Some(0..=3)), "{what}: {verb:?} ends with {status:?}: {stderr}");
        assert!(!stderr.contains("panicked"), "{what}: {verb:?}: {stderr}");
        for (_, wanted, said) in expected.iter().filter(|(name, ..)| *name == verb[0]) {
            assert_eq!(status, Some(*wanted), "{what}: {verb:?}: {stderr}");
            let all = format!("{stdout}{stderr}");
            assert!(all.contains(said), "{what}: {verb:?} does not say `{said}`: {all}");
        }
    }
}

fn set(file: Vec<FileDescriptorProto>) -> Vec<u8> {
    FileDescriptorSet { file }.encode_to_vec()
}

/// The schema of the other tests, a channel and a message of it, in a chunk.
fn of_note(data: &[u8]) -> Vec<u8> {
    let definitions = [schema(1, "lab.Note", &set(vec![forge::file()])), channel(1, 1, "/note", &[])];
    whole(&[packed(&[definitions.concat(), message(1, data)])], &[])
}

#[test]
fn messages_that_unpack_to_very_many_things() {
    const MANY: usize = 1 << 20;
    let tags = block(2, &[0].repeat(8 * MANY));
    let cases = [
        ("empty submessages", block(6, &[]).repeat(MANY)),
        ("entries of a map", block(8, &[]).repeat(MANY)),
        ("packed numbers of a byte", block(5, &tags)),
        ("unknown fields", [0x78, 0].repeat(MANY)),
        ("parts that have to be merged", block(5, &[]).repeat(MANY)),
        ("submessages of a type inside itself", block(9, &block(9, &[]).repeat(MANY))),
    ];
    for (what, data) in cases {
        let bytes = of_note(&data);
        assert!(bytes.len() < 100_000, "{what}: {}", bytes.len());
        let is_bytes = what.ends_with("itself");
        let reported = "a message of `/note` at log time 0 unpacks to more than --max-memory allows";
        let expected: &[Expected<'_>] = match is_bytes {
            // kept as bytes by all that only measure
            true => &[("verify", 0, "sound"), ("cat", 0, "{\"bytes\":")],
            false => &[
                ("verify", 1, reported),
                ("trace", 3, "--max-memory"),
                ("cat", 0, "{\"bytes\":"),
                ("recover", 0, "1 messages"),
            ],
        };
        check(what, &bytes, expected);
    }
}

fn field(name: &str, number: i32, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    forge::field(name, number, Label::Optional, kind, type_name)
}

fn file_of(name: &str, message_type: Vec<DescriptorProto>) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.into()),
        syntax: Some("proto3".into()),
        message_type,
        ..Default::default()
    }
}

fn type_of(name: &str, field: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto { name: Some(name.into()), field, ..Default::default() }
}

/// A schema, a channel and an empty message of it.
fn of_schema(name: &str, data: &[u8]) -> Vec<u8> {
    whole(&[packed(&[schema(1, name, data), channel(1, 1, "/a", &[]), message(1, &[])])], &[])
}

#[test]
fn descriptor_sets_that_unpack_to_very_much() {
    let in_file = |content: &[u8]| block(1, &[&block(1, b"a")[..], &block(12, b"proto3"), content].concat());
    let refused = [("verify", 1, "does not describe its message"), ("trace", 2, "sound schema")];
    let too_large = [
        ("info", 3, "no room for the schema `A`"),
        ("verify", 1, "--max-memory"),
        ("cat", 3, "{\"bytes\":0}"),
        ("schema", 0, "is not a sound protobuf schema"),
    ];
    check("empty messages", &of_schema("A", &in_file(&block(4, &[]).repeat(60_000))), &too_large);
    check("very many empty messages", &of_schema("A", &in_file(&block(4, &[]).repeat(4 << 20))), &too_large);
    let long = block(4, &[block(1, &[b'A'; 4000]), block(2, &[]).repeat(50_000)].concat());
    check("fields with long names around them", &of_schema("A", &in_file(&long)), &too_large);
    let endless = block(2, &b"a.".repeat(100_000));
    check("a package of very many parts", &of_schema("A", &in_file(&endless)), &refused);

    // places in the source mean nothing without a comment; with them they count
    let one = block(4, &block(1, b"A"));
    let places = block(9, &block(1, &[]).repeat(4 << 20));
    let bytes = of_schema("A", &in_file(&[&one[..], &places].concat()));
    check("empty places in the source", &bytes, &[("verify", 0, "sound"), ("trace", 0, "")]);
    let comments = block(9, &block(1, &[block(1, &[4, 0]), block(3, b"x")].concat()).repeat(200_000));
    check("comments", &of_schema("A", &in_file(&[&one[..], &comments].concat())), &too_large);
}

#[test]
fn types_that_unfold_without_end() {
    // each type holds the next one twice, and nothing else
    let types = (0..32).map(|i| {
        let next = format!(".T{}", i + 1);
        let fields = match i {
            31 => vec![],
            _ => ["a", "b"]
                .iter()
                .zip(1..)
                .map(|(name, n)| field(name, n, Type::Message, Some(&next)))
                .collect(),
        };
        type_of(&format!("T{i}"), fields)
    });
    let bytes = of_schema("T0", &set(vec![file_of("t.proto", types.collect())]));
    check("types that hold the next one twice", &bytes, &[("verify", 0, "sound")]);

    let mut editions = file_of("e.proto", vec![type_of("A", vec![field("x", 1, Type::Double, None)])]);
    editions.syntax = Some("editions".into());
    let reported = [("verify", 1, "`editions`"), ("info", 0, "messages are not decoded")];
    check("an unknown syntax", &of_schema("A", &set(vec![editions])), &reported);

    let mut circle = file_of("c.proto", vec![type_of("A", vec![])]);
    (circle.dependency, circle.public_dependency) = (vec!["c.proto".into()], vec![0]);
    let reported = [("verify", 1, "circles"), ("info", 0, "messages are not decoded")];
    check("a file that hands itself on", &of_schema("A", &set(vec![circle])), &reported);
}

#[test]
fn summaries_of_very_many_definitions() {
    const MANY: u32 = 400_000;
    let data =
        [schema(1, "lab.Note", &set(vec![forge::file()])), channel(1, 1, "/note", &[]), message(1, &[])];
    let repeated = |one: &dyn Fn(u16) -> Vec<u8>| (0..MANY).flat_map(|i| one(i as u16)).collect::<Vec<u8>>();
    let reported =
        [("info", 3, "--max-memory"), ("verify", 1, "--max-memory"), ("recover", 3, "--max-memory")];
    let channels = whole(&data, &repeated(&|id| channel(id, 0, "/t", &[])));
    check("channels in the summary", &channels, &reported);
    let schemas = whole(&data, &repeated(&|id| schema(id.max(1), "", &[])));
    check("schemas in the summary", &schemas, &[("verify", 1, "--max-memory")]);
    // replay reads by the index, and would wait for viewers otherwise
    let (folder, _) = folder(&channels);
    let (status, stderr) = run(folder.path(), &["replay", "a.mcap", "--addr", "127.0.0.1:0", "--once"]);
    assert_eq!(status, Some(1), "{stderr}");
    assert!(stderr.contains("--max-memory"), "{stderr}");
}

#[test]
fn chunks_full_of_empty_messages() {
    // a chunk of them fits into what each of two files may take
    const MANY: u64 = 200_000;
    let full = |time: u64, chunks: usize| {
        let messages = message_at(1, time, &[]).repeat(MANY as usize);
        let entries = (0..MANY).flat_map(|i| [time.to_le_bytes(), (31 * i).to_le_bytes()].concat());
        let index = record(0x07, &[&1_u16.to_le_bytes()[..], &text(&entries.collect::<Vec<u8>>())].concat());
        let chunk = packed(&[messages]);
        let mut records = vec![channel(1, 0, "/empty", &[])];
        records.extend((0..chunks).map(|_| chunk.clone()));
        records.push(index);
        whole(&records, &[])
    };
    check("empty messages", &full(0, 1), &[("verify", 0, "sound; 200000 messages")]);
    let (folder, _) = folder(&full(5, 1));
    let (status, stderr) = run(folder.path(), &["verify", "a.mcap"]);
    assert_eq!((status, stderr.as_str()), (Some(1), ""), "the header of the chunk says time 0");
    // each waits for a counterpart that does not come
    for (name, time) in [("a.mcap", 0), ("b.mcap", 1 << 40)] {
        std::fs::write(folder.path().join(name), full(time, 40)).expect("a file");
    }
    for mode in ["time", "linear"] {
        let (status, stderr) = run(folder.path(), &["diff", "a.mcap", "b.mcap", "--align", mode]);
        assert_eq!(status, Some(2), "{mode}: {stderr}");
        assert!(stderr.contains("raise --max-memory"), "{mode}: {stderr}");
    }
}

#[test]
fn axes_of_very_many_points() {
    let set = set(vec![forge::file()]);
    let with_axis = |points: usize| {
        let axis = "0,".repeat(points) + "0";
        whole(
            &[
                schema(1, "lab.Profile", &set),
                channel(1, 1, "/a", &map(&[("axis.p", &axis)])),
                message(1, &block(5, &[0; 8 * 20])),
            ],
            &[],
        )
    };
    check("200 000 points", &with_axis(200_000), &[("trace", 0, "left out: `p`"), ("verify", 0, "sound")]);
    check("two million points", &with_axis(2_000_000), &[("info", 3, "--max-memory")]);
}

#[test]
fn messages_that_all_have_one_time() {
    const MANY: usize = 60_000;
    let topics = ["/a", "/b", "/c"];
    let set = set(vec![forge::file()]);
    let mut records = vec![schema(1, "lab.Scalar", &set)];
    records.extend((1..).zip(topics).map(|(id, topic)| channel(id, 1, topic, &[])));
    // force = 1, at time 0
    let data = [&[0x19][..], &1_f64.to_le_bytes()].concat();
    records.extend((0..MANY).flat_map(|_| (1..=3).map(|id| message(id, &data))));
    let bytes = whole(&[packed(&records)], &[]);
    let many_points = ("plot", 1, "more points than --max-memory allows");
    check("messages at one time", &bytes, &[("trace", 0, ""), many_points]);
    let (folder, _) = folder(&bytes);
    let verb = ["plot", "a.mcap", "--topic", "*", "--field", "force", "-o", "q.svg"];
    let (status, stderr) = run(folder.path(), &verb);
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
fn texts_that_are_too_long() {
    let long = "x".repeat(70_000);
    let schema = schema(1, &long, &set(vec![forge::file()]));
    let entries = map(&[("unit.x", &long)]);
    let bytes = whole(&[metadata("m", &[("key", &long)]), schema, channel(1, 1, &long, &entries)], &[]);
    check("a topic of 70 000 letters", &bytes, &[("info", 0, &long)]);
}

#[test]
fn fields_of_no_size_make_no_picture() {
    let set = set(vec![forge::file()]);
    let double = |number: u8, value: f64| [&[number << 3 | 1][..], &value.to_le_bytes()].concat();
    let slice = |dr: f64, dz: f64| {
        // nr = nz = 2, values 1
        let values = block(9, &1_f32.to_le_bytes().repeat(4));
        [double(4, dr), double(7, dz), vec![5 << 3, 2, 8 << 3, 2], values].concat()
    };
    for (dr, dz) in [(1e-300, 1e300), (1e300, 1e-300), (f64::NAN, 1.0), (f64::INFINITY, 1.0), (0.0, 0.0)] {
        let records = [
            metadata("percuss.run", &[("format_version", "1.0")]),
            schema(1, "lab.Slice", &set),
            channel(1, 1, "/field/stress", &map(&[("axis.values", "z0,dz,nz;r0,dr,nr")])),
            message(1, &slice(dr, dz)),
        ];
        check(&format!("a field of {dr} by {dz}"), &file(&records), &[("report", 3, "")]);
    }
}

#[test]
fn names_command_no_terminal() {
    let wicked = "/a\u{1b}[2J\u{9b}1m\u{202e}\r";
    let set = set(vec![forge::file()]);
    let bytes = |force: f64| {
        let records = [
            metadata(wicked, &[(wicked, wicked)]),
            schema(1, "lab.Scalar", &set),
            channel(1, 1, wicked, &map(&[("unit.force", wicked)])),
            channel(2, 7, wicked, &[]),
            message(1, &[&[0x19][..], &force.to_le_bytes()].concat()),
        ];
        file(&records)
    };
    let (folder, _) = folder(&bytes(1.0));
    std::fs::write(folder.path().join("b.mcap"), bytes(2.0)).expect("a file");
    let verbs: [&[&str]; 9] = [
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
        let is_command = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!all.contains(is_command), "{verb:?}: {all:?}");
        if verb.contains(&"--json") {
            let json: serde_json::Value = serde_json::from_str(&stdout).expect("a document");
            assert!(json.to_string().contains("[2J"), "{verb:?}: {json}");
        } else if verb[0] != "schema" {
            assert!(all.contains("\\u{1b}[2J"), "{verb:?}: {all}");
        }
    }
}

#[test]
fn attachments_of_one_name_are_all_exported() {
    let attachment = |name: &str, content: &[u8]| {
        let head = [&[0; 16][..], &text(name.as_bytes()), &text(b"text/plain")].concat();
        let body =
            [head, (content.len() as u64).to_le_bytes().to_vec(), content.to_vec(), vec![0; 4]].concat();
        record(0x09, &body)
    };
    let all = [("a.txt", "1"), ("a.txt", "2"), ("a.2.txt", "3"), ("a.txt", "4"), ("b", "5"), ("b", "6")];
    let records: Vec<Vec<u8>> =
        all.iter().map(|(name, content)| attachment(name, content.as_bytes())).collect();
    let (folder, _) = folder(&whole(&records, &[]));
    let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachments", "-o", "out", "--force"]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("another attachment is named `a.txt` as well"), "{stderr}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).expect(name);
    let names = ["a.txt", "a.3.txt", "a.2.txt", "a.4.txt", "b", "b.2"];
    assert_eq!(names.map(read), ["1", "2", "3", "4", "5", "6"]);
    let (status, stderr) = run(folder.path(), &["export", "a.mcap", "--attachment", "a.txt"]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("2 more attachments have this name"), "{stderr}");
}

#[test]
fn records_that_are_longer_than_their_chunk() {
    // found by fuzzing: the unpacker subtracted what was not there
    let data = [&message(1, &[])[..], &[0x05], &1000_u64.to_le_bytes(), &[0; 20]].concat();
    let bytes = whole(&[channel(1, 0, "/a", &[]), chunk(data.len() as u64, b"", &data)], &[]);
    let reported = "a record that is longer than its chunk";
    check(
        "a record that is longer than its chunk",
        &bytes,
        &[("verify", 1, reported), ("info", 3, reported)],
    );
}
