//! The `percuss-read` program on recordings of other writers: made here with the `mcap` crate and dynamic messages.

use std::{collections::BTreeMap, fs, io::Cursor, process::Output};

use mcap::{
    WriteOptions,
    records::{MessageHeader, Metadata},
};
use prost_reflect::{
    DescriptorPool, DynamicMessage, MessageDescriptor, Value,
    prost::Message,
    prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    },
};

use crate::desk::Desk;

/// `message lab.Sample { double time = 1; float load = 2; repeated double strain = 3; double x0 = 4; double dx = 5; }`
fn schema() -> FileDescriptorSet {
    let field = |name: &str, number, label: Label, kind: Type| FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        ..Default::default()
    };
    let message = DescriptorProto {
        name: Some("Sample".into()),
        field: vec![
            field("time", 1, Label::Optional, Type::Double),
            field("load", 2, Label::Optional, Type::Float),
            field("strain", 3, Label::Repeated, Type::Double),
            field("x0", 4, Label::Optional, Type::Double),
            field("dx", 5, Label::Optional, Type::Double),
        ],
        ..Default::default()
    };
    let file = FileDescriptorProto {
        name: Some("sample.proto".into()),
        package: Some("lab".into()),
        syntax: Some("proto3".into()),
        message_type: vec![message],
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }
}

fn sample(descriptor: &MessageDescriptor, k: u32) -> Vec<u8> {
    let mut message = DynamicMessage::new(descriptor.clone());
    message.set_field_by_name("time", Value::F64(f64::from(k) * 0.1));
    message.set_field_by_name("load", Value::F32(k as f32 * 0.1));
    let strain = (0..3).map(|i| Value::F64(f64::from(k * 10 + i))).collect();
    message.set_field_by_name("strain", Value::List(strain));
    message.set_field_by_name("x0", Value::F64(0.5));
    message.set_field_by_name("dx", Value::F64(1.0));
    message.encode_to_vec()
}

/// A recording of 20 samples on `/lab`, and an empty channel of another encoding.
fn recording(options: WriteOptions) -> Vec<u8> {
    let schema = schema();
    let bytes = schema.encode_to_vec();
    let pool = DescriptorPool::from_file_descriptor_set(schema).expect("a sound schema");
    let descriptor = pool.get_message_by_name("lab.Sample").expect("the message");
    let mut writer = options.library("another program").create(Cursor::new(Vec::new())).expect("a writer");
    let id = writer.add_schema("lab.Sample", "protobuf", &bytes).expect("a schema");
    let entries = [("unit.load", "N"), ("unit.time", "s"), ("axis.strain", "x0,dx")];
    let metadata = entries.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
    let lab = writer.add_channel(id, "/lab", "protobuf", &metadata).expect("a channel");
    writer.add_channel(0, "/other", "json", &BTreeMap::new()).expect("a channel");
    for k in 0..20 {
        let log_time = u64::from(k) * 1_000_000;
        let header = MessageHeader { channel_id: lab, sequence: k, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &sample(&descriptor, k)).expect("a message");
    }
    let entries = BTreeMap::from([("who".to_owned(), "me".to_owned())]);
    writer.write_metadata(&Metadata { name: "notes".into(), metadata: entries }).expect("metadata");
    writer.finish().expect("the end");
    writer.into_inner().into_inner()
}

fn lab_of(bytes: impl AsRef<[u8]>) -> Desk {
    Desk::new(&[("a.mcap", bytes.as_ref().to_vec())])
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn every_kind_of_container_is_read_alike() {
    let options = || WriteOptions::new().compression(None);
    let kinds = [
        options(),
        options().compression(Some(mcap::Compression::Zstd)),
        options().compression(Some(mcap::Compression::Lz4)),
        options().use_chunks(false),
        options().emit_summary_records(false).emit_summary_offsets(false),
        options()
            .calculate_chunk_crcs(false)
            .calculate_data_section_crc(false)
            .calculate_summary_section_crc(false),
        options().chunk_size(Some(64)),
    ];
    let expected = lab_of(recording(options())).lines(&["trace", "a.mcap", "--topic", "/lab"]);
    assert_eq!(expected.len(), 21);
    assert_eq!(expected[0], "time [s],load [N],strain[0],strain[1],strain[2]");
    assert_eq!(expected[4], "0.30000000000000004,0.3,30.0,31.0,32.0");
    for kind in kinds {
        let lab = lab_of(recording(kind));
        assert_eq!(lab.lines(&["trace", "a.mcap", "--topic", "/lab"]), expected);
    }
}

#[test]
fn verify_says_what_has_no_checksum() {
    let bare = || WriteOptions::new().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    let verify = |kind| lab_of(recording(kind)).text(0, &["verify", "a.mcap"]);
    let remark = "remark: 20 of 20 messages have no checksum";
    for kind in [bare(), bare().use_chunks(false)] {
        let text = verify(kind);
        assert!(text.contains(remark), "{text}");
    }
    // that of the whole data section, or of every chunk, is enough
    for kind in [bare().use_chunks(false).calculate_data_section_crc(true), bare().calculate_chunk_crcs(true)]
    {
        let text = verify(kind);
        assert!(!text.contains("remark"), "{text}");
    }
}

#[test]
fn fields_positions_and_times_are_chosen() {
    let lab = lab_of(recording(WriteOptions::new()));
    let trace =
        |arguments: &[&str]| lab.lines(&[&["trace", "a.mcap", "--topic", "/lab"], arguments].concat());
    let rows = trace(&["--at", "x=0.5,1.25", "--from", "0.45", "--to", "1.05", "--every", "3"]);
    assert_eq!(rows[0], "time [s],load [N],strain@x=0.5,strain@x=1.25");
    // the last one stays
    assert_eq!(rows[1..], ["0.5,0.5,50.0,50.75", "0.8,0.8,80.0,80.75", "1.0,1.0,100.0,100.75"]);
    let plain = trace(&["--field", "load"]);
    assert_eq!(trace(&["--field", "load", "--every", "1000"])[1..], [plain[1].clone(), plain[20].clone()]);
    assert_eq!(trace(&["--field", "load", "--every", "19"])[1..], [plain[1].clone(), plain[20].clone()]);
    let cat = lab.lines(&["cat", "a.mcap", "--topic", "/lab", "--every", "1000"]);
    assert!(cat.len() == 2 && cat[1].contains("\"load\":1.9"), "{cat:?}");
    assert_eq!(trace(&["--field", "strain[2],load"])[2], "0.1,12.0,0.1");
    let json = trace(&["--format", "jsonl", "--field", "load"]);
    assert_eq!(json[1], "{\"time\":0.1,\"load\":0.1}");
}

#[test]
fn output_files_are_kept_unless_forced() {
    let lab = lab_of(recording(WriteOptions::new()));
    let trace = |arguments: &[&str]| lab.read(&[&["trace", "a.mcap", "--topic", "/lab"], arguments].concat());
    assert!(trace(&["-o", "out.jsonl"]).status.success());
    let text = fs::read_to_string(lab.path("out.jsonl")).expect("the output");
    assert!(text.starts_with("{\"time\":0.0,"), "the name of the output chooses the format");
    assert_eq!(trace(&["-o", "out.jsonl"]).status.code(), Some(1));
    assert!(trace(&["-o", "out.jsonl", "--force"]).status.success());
    let before = fs::read(lab.path("a.mcap")).expect("the recording");
    assert_eq!(trace(&["-o", "a.mcap", "--force"]).status.code(), Some(2));
    assert_eq!(fs::read(lab.path("a.mcap")).expect("the recording"), before);
    // a request that fails leaves no file
    assert_eq!(trace(&["--field", "nothing", "-o", "none.csv"]).status.code(), Some(2));
    assert!(!lab.path("none.csv").exists());
}

#[test]
fn info_tells_what_is_there() {
    let lab = lab_of(recording(WriteOptions::new()));
    let output = lab.read(&["info", "a.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["version"], 2);
    assert_eq!(json["complete"], true);
    assert_eq!(json["percuss"], false);
    assert_eq!(json["library"], "another program");
    assert_eq!(json["messages"], 20);
    assert_eq!(json["end_ns"], 19_000_000);
    let channels = json["channels"].as_array().expect("a list");
    assert_eq!(channels[0]["metadata"]["unit.load"], "N");
    assert_eq!(channels[1]["decodable"], false);
    assert_eq!(json["metadata"][0]["entries"]["who"], "me");
    let text = lab.lines(&["info", "a.mcap"]).join("\n");
    for part in ["complete", "/lab", "lab.Sample", "load [N]", "who = me"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn damage_is_found_and_what_comes_before_is_read() {
    let bytes = recording(WriteOptions::new().chunk_size(Some(256)).compression(None));
    let whole = lab_of(&bytes).lines(&["trace", "a.mcap", "--topic", "/lab"]);
    // cut off: rows of whole chunks are there, and the loss is reported
    let lab = lab_of(&bytes[..bytes.len() / 2]);
    let output = lab.read(&["trace", "a.mcap", "--topic", "/lab"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let rows: Vec<String> = String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
    assert!(rows.len() > 2 && rows.len() < whole.len());
    assert_eq!(rows[..], whole[..rows.len()]);
    assert!(stderr(&output).contains("middle of a record"), "{}", stderr(&output));
    assert_eq!(lab.read(&["info", "a.mcap"]).status.code(), Some(3));

    // one bit flipped in a message: nothing of its chunk comes out
    let text = b"lab.Sample";
    let after_schema =
        bytes.windows(text.len()).position(|window| window == text).expect("the schema") + 1000;
    let mut spoiled = bytes.clone();
    spoiled[after_schema] ^= 1;
    let output = lab_of(spoiled).read(&["trace", "a.mcap", "--topic", "/lab"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("CRC"), "{}", stderr(&output));
    let rows = String::from_utf8_lossy(&output.stdout).lines().count();
    assert!(rows < whole.len());
}

#[test]
fn files_that_are_no_recordings() {
    let lab = lab_of(b"not a recording at all");
    for verb in ["info", "trace"] {
        let output = lab.read(&[verb, "a.mcap"]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("not an MCAP file"), "{}", stderr(&output));
        assert_eq!(lab.read(&[verb, "nowhere.mcap"]).status.code(), Some(1));
    }
    fs::write(lab.path("empty.mcap"), b"").expect("a file");
    assert_eq!(lab.read(&["info", "empty.mcap"]).status.code(), Some(1));
    // a length of 2^62 is refused, not allocated
    let mut forged = mcap::MAGIC.to_vec();
    forged.push(0x01);
    forged.extend((1u64 << 62).to_le_bytes());
    fs::write(lab.path("forged.mcap"), forged).expect("a file");
    let output = lab.read(&["info", "forged.mcap"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("middle of a record of 4611686018427387904 bytes"),
        "{}",
        stderr(&output)
    );
    // an attachment whose parts do not fit into it
    let mut short = mcap::MAGIC.to_vec();
    short.push(0x09);
    short.extend(20u64.to_le_bytes());
    short.extend([0; 20]);
    fs::write(lab.path("short.mcap"), short).expect("a file");
    assert_eq!(lab.read(&["info", "short.mcap"]).status.code(), Some(3));
}

#[test]
fn mismatches_are_usage_errors() {
    let lab = lab_of(recording(WriteOptions::new()));
    for (arguments, expected) in [
        (&["--topic", "/none"] as &[&str], "/lab"),
        (&["--topic", "/lab", "--field", "stress"], "strain"),
        (&["--topic", "/lab", "--at", "r=1"], "axis named `r`"),
        (&["--topic", "/lab", "--at", "x=9"], "from x=0 to x=3"),
        (&["--topic", "/other"], "json"),
        (&["--at", "r=x"], "not a number"),
    ] {
        let output = lab.read(&[&["trace", "a.mcap"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}
