//! Every way an MCAP file may be put together is read alike: with and without chunks, indexes, statistics, repeated
//! definitions, and with extra bytes at the ends of records, which a reader must skip.
//!
//! The files are those of the conformance suite of the format (its binary files are not to be had here, so they are
//! made from its description): each of the contents below with each combination of the features that apply to it.

use std::{fs, thread};

use mcap::records::Record;
use percuss_reader::recording::{Limits, Scan};
use serde_json::json;

use crate::{
    desk::Desk,
    forge,
    raw::{
        ChunkEntry, Counts, attachment, attachment_index, channel_of, chunk_at, double, map, message_at,
        metadata, metadata_index, record, statistics, text,
    },
    watchdog::types::lab,
};

/// Features of a file: those whose bits are set.
#[derive(Clone, Copy, Debug)]
struct Features(u32);

const CHUNKS: u32 = 1;
const MESSAGE_INDEX: u32 = 1 << 1;
const STATISTICS: u32 = 1 << 2;
const REPEATED_SCHEMAS: u32 = 1 << 3;
const REPEATED_CHANNELS: u32 = 1 << 4;
const ATTACHMENT_INDEX: u32 = 1 << 5;
const METADATA_INDEX: u32 = 1 << 6;
const CHUNK_INDEX: u32 = 1 << 7;
const SUMMARY_OFFSETS: u32 = 1 << 8;
const PADDING: u32 = 1 << 9;
const ALL: Features = Features((1 << 10) - 1);

impl Features {
    fn has(self, feature: u32) -> bool {
        self.0 & feature != 0
    }
}

#[derive(Clone, Copy, Debug)]
struct Content {
    schema: bool,
    messages: u32,
    attachment: bool,
    metadata: bool,
}

const CONTENTS: [Content; 6] = [
    Content { schema: false, messages: 0, attachment: false, metadata: false },
    Content { schema: false, messages: 0, attachment: true, metadata: false },
    Content { schema: false, messages: 0, attachment: false, metadata: true },
    Content { schema: true, messages: 1, attachment: false, metadata: false },
    Content { schema: false, messages: 1, attachment: false, metadata: false },
    Content { schema: true, messages: 10, attachment: true, metadata: true },
];

/// Appends a record, with bytes behind its fields if they are asked for; its offset and length.
fn put(bytes: &mut Vec<u8>, mut record: Vec<u8>, padding: bool) -> (u64, u64) {
    // the footer has a fixed size, and a message ends with its data
    if padding && !matches!(record[0], 0x02 | 0x05) {
        record.extend([1, 2, 3]);
        let length = (record.len() - 9) as u64;
        record[1..9].copy_from_slice(&length.to_le_bytes());
    }
    let offset = bytes.len() as u64;
    bytes.extend(&record);
    (offset, record.len() as u64)
}

fn build(content: Content, features: Features) -> Vec<u8> {
    let put = |bytes: &mut Vec<u8>, record| put(bytes, record, features.has(PADDING));
    let mut file = mcap::MAGIC.to_vec();
    put(&mut file, record(0x01, &[text(b""), text(b"tests")].concat()));
    let has_messages = content.messages > 0;
    let schema = Some(lab(1, "Scalar")).filter(|_| has_messages && content.schema);
    let encoding = if content.schema { "protobuf" } else { "bytes" };
    let unit = map(&[("unit.force", "N")]);
    let channel = channel_of(1, content.schema.into(), "/scalar", encoding, &unit);
    let channel = Some(channel).filter(|_| has_messages);
    let message =
        |k: u32| message_at(1, k.into(), &[double(2, f64::from(k) * 0.5), double(3, f64::from(k))].concat());
    let mut data = Vec::new();
    for definition in [&schema, &channel].into_iter().flatten() {
        put(&mut data, definition.clone());
    }
    let entry = |k: u32| [u64::from(k).to_le_bytes(), put(&mut data, message(k)).0.to_le_bytes()].concat();
    let entries: Vec<u8> = (0..content.messages).flat_map(entry).collect();
    let times = (0, u64::from(content.messages.saturating_sub(1)));
    let mut chunk_index = None;
    if has_messages && features.has(CHUNKS) {
        let size = data.len() as u64;
        let (offset, length) = put(&mut file, chunk_at(times, size, b"", &data));
        let (compressed, uncompressed) = (size, size);
        let mut entry =
            ChunkEntry { times, offset, length, compressed, uncompressed, ..ChunkEntry::default() };
        if features.has(MESSAGE_INDEX) {
            entry.channels = vec![(1, file.len() as u64)];
            let index = record(0x07, &[&1u16.to_le_bytes()[..], &text(&entries)].concat());
            (_, entry.index_length) = put(&mut file, index);
        }
        chunk_index = Some(entry.record());
    } else {
        file.extend(data);
    }
    let attachment = content.attachment.then(|| {
        let (offset, length) = put(&mut file, attachment("myFile", &[7, 8, 9]));
        attachment_index(offset, length, 3, "myFile")
    });
    let metadata = content.metadata.then(|| {
        let (offset, length) = put(&mut file, metadata("myMetadata", &[("foo", "bar")]));
        metadata_index(offset, length, "myMetadata")
    });
    put(&mut file, record(0x0f, &[0; 4]));
    let summary_start = file.len() as u64;
    let statistics = statistics(&Counts {
        messages: content.messages.into(),
        schemas: schema.is_some().into(),
        channels: channel.is_some().into(),
        attachments: content.attachment.into(),
        metadata: content.metadata.into(),
        chunks: (has_messages && features.has(CHUNKS)).into(),
        times,
        of_channels: channel.iter().map(|_| (1, content.messages.into())).collect(),
    });
    let is_described = !content.schema || features.has(REPEATED_SCHEMAS);
    let summary = [
        schema.filter(|_| features.has(REPEATED_SCHEMAS)),
        // a channel is of no use without its schema
        channel.filter(|_| features.has(REPEATED_CHANNELS) && is_described),
        features.has(STATISTICS).then_some(statistics),
        attachment.filter(|_| features.has(ATTACHMENT_INDEX)),
        metadata.filter(|_| features.has(METADATA_INDEX)),
        chunk_index.filter(|_| features.has(CHUNK_INDEX)),
    ];
    let groups = summary.into_iter().flatten().map(|record| (record[0], put(&mut file, record)));
    let groups: Vec<(u8, (u64, u64))> = groups.collect();
    let offsets_start = file.len() as u64;
    for (opcode, (start, length)) in groups.iter().filter(|_| features.has(SUMMARY_OFFSETS)) {
        let body = [&[*opcode][..], &start.to_le_bytes(), &length.to_le_bytes()].concat();
        put(&mut file, record(0x0e, &body));
    }
    let has_offsets = features.has(SUMMARY_OFFSETS) && !groups.is_empty();
    let starts =
        [if groups.is_empty() { 0 } else { summary_start }, if has_offsets { offsets_start } else { 0 }];
    put(&mut file, record(0x02, &[starts.map(u64::to_le_bytes).concat(), vec![0; 4]].concat()));
    file.extend(mcap::MAGIC);
    file
}

/// Checks what the verbs say of a file `a.mcap`.
fn check(desk: &Desk, content: Content, what: &str) {
    let report = desk.json(0, &["verify", "a.mcap", "--json"]);
    assert_eq!((&report["sound"], &report["problems"]), (&true.into(), &json!([])), "{what}");
    assert_eq!(report["messages"], content.messages, "{what}");
    let info = desk.json(0, &["info", "a.mcap", "--json"]);
    assert_eq!((&info["complete"], &info["damages"]), (&true.into(), &json!([])), "{what}");
    let number = |key: &str| info[key].as_array().expect("a list").len();
    assert_eq!(number("channels"), usize::from(content.messages > 0), "{what}");
    assert_eq!(number("metadata"), usize::from(content.metadata), "{what}");
    assert_eq!(number("attachments"), usize::from(content.attachment), "{what}");
    let channels = info["channels"].as_array().expect("a list");
    assert!(channels.iter().all(|channel| channel["decodable"] == content.schema), "{what}");
    if content.attachment {
        assert_eq!(desk.read(&["export", "a.mcap", "--attachment", "myFile"]).stdout, [7, 8, 9], "{what}");
    }
    if content.schema {
        let rows = desk.lines(&["trace", "a.mcap", "--topic", "/scalar", "--field", "force"]);
        let expected = (0..content.messages).map(|k| format!("{:?},{:?}", f64::from(k) * 0.5, f64::from(k)));
        assert_eq!(rows[0], "time,force [N]", "{what}");
        assert!(rows[1..].iter().cloned().eq(expected), "{what}: {rows:?}");
    }
}

#[test]
fn all_combinations_of_features() {
    let all = CONTENTS.into_iter().flat_map(|content| (0..=ALL.0).map(move |bits| (content, Features(bits))));
    // features that a content has no use for make no other files
    let is_needed = |(content, features): &(Content, Features)| {
        !(content.messages == 0 && features.has(CHUNKS)
            || !features.has(CHUNKS) && (features.has(MESSAGE_INDEX) || features.has(CHUNK_INDEX))
            || !content.attachment && features.has(ATTACHMENT_INDEX)
            || !content.metadata && features.has(METADATA_INDEX))
    };
    let files: Vec<(Content, Features)> = all.filter(is_needed).collect();
    assert!(files.len() > 600, "{}", files.len());
    thread::scope(|scope| {
        for part in files.chunks(files.len().div_ceil(2)) {
            scope.spawn(move || {
                let desk = Desk::new(&[]);
                for &(content, features) in part {
                    desk.put("a.mcap", build(content, features));
                    check(&desk, content, &format!("{content:?} {features:?}"));
                }
            });
        }
    });
}

#[test]
fn a_growing_file_is_read_to_its_last_whole_chunk_and_on() {
    let bytes = forge::forge(400, 1).write(forge::plain());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    fs::write(&path, &bytes[..bytes.len() / 2]).expect("a file");
    let mut scan = Scan::open(&path, Limits::default()).expect("a file");
    scan.follow();
    let (mut first, mut rest) = (0, 0);
    let count = |seen: &mut u32, scan: &mut Scan| {
        let each = scan.for_each(|found| *seen += u32::from(matches!(found.record, Record::Message { .. })));
        each.expect("records");
        scan.is_over()
    };
    assert!(!count(&mut first, &mut scan));
    assert!(first > 100 && scan.damages().is_empty());
    assert!(!count(&mut first, &mut scan), "there is nothing new");
    let mut all = fs::OpenOptions::new().append(true).open(&path).expect("the file");
    std::io::Write::write_all(&mut all, &bytes[bytes.len() / 2..]).expect("the rest");
    assert!(count(&mut rest, &mut scan));
    assert_eq!(first + rest, 400 + 400 + 40 + 16);
    assert!(scan.damages().is_empty());
}
