//! Every way an MCAP file may be put together is read alike: with and without chunks, indexes, statistics, repeated
//! definitions, and with extra bytes at the ends of records, which a reader must step over.
//!
//! The files are those of the conformance suite of the format (its binary files are not to be had here, so they are
//! made from its description): each of the contents below with each combination of the features that apply to it.

use std::{fs, path::Path};

use mcap::records::Record;
use percuss_reader::{
    command::{trace, verify::verify},
    messages::Recording,
    recording::{Limits, Scan},
    select::{Bound, Window},
    slice::moments,
    table::{Cell, Heading, Sink},
};

use crate::forge;

/// Features of a file.
#[derive(Clone, Copy, Debug, Default)]
struct Features {
    chunks: bool,
    message_index: bool,
    statistics: bool,
    repeated_schemas: bool,
    repeated_channels: bool,
    attachment_index: bool,
    metadata_index: bool,
    chunk_index: bool,
    summary_offsets: bool,
    padding: bool,
}

impl Features {
    const COUNT: u32 = 10;

    fn of(bits: u32) -> Self {
        let bit = |i: u32| bits >> i & 1 == 1;
        Self {
            chunks: bit(0),
            message_index: bit(1),
            statistics: bit(2),
            repeated_schemas: bit(3),
            repeated_channels: bit(4),
            attachment_index: bit(5),
            metadata_index: bit(6),
            chunk_index: bit(7),
            summary_offsets: bit(8),
            padding: bit(9),
        }
    }
}

/// What a file holds.
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

#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    padding: bool,
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

fn map(entries: &[(&str, &str)]) -> Vec<u8> {
    let entries: Vec<u8> =
        entries.iter().flat_map(|(key, value)| [text(key), text(value)].concat()).collect();
    [&(entries.len() as u32).to_le_bytes()[..], &entries].concat()
}

impl File {
    fn record(&mut self, opcode: u8, body: &[u8]) -> (u64, u64) {
        let start = self.bytes.len() as u64;
        let padding: &[u8] = if self.padding { &[1, 2, 3] } else { &[] };
        // the footer has a fixed size, and a message ends with its data
        let padding = if matches!(opcode, 0x02 | 0x05) { &[] } else { padding };
        self.bytes.push(opcode);
        self.bytes.extend(((body.len() + padding.len()) as u64).to_le_bytes());
        self.bytes.extend(body);
        self.bytes.extend(padding);
        (start, self.bytes.len() as u64 - start)
    }
}

fn schema_body() -> Vec<u8> {
    use prost_reflect::prost::Message;
    let set = prost_reflect::prost_types::FileDescriptorSet { file: vec![forge::file()] }.encode_to_vec();
    let data = [&(set.len() as u32).to_le_bytes()[..], &set].concat();
    [1u16.to_le_bytes().to_vec(), text("lab.Scalar"), text("protobuf"), data].concat()
}

fn channel_body(schema: bool) -> Vec<u8> {
    let ids = [1u16.to_le_bytes(), u16::from(schema).to_le_bytes()].concat();
    let encoding = if schema { "protobuf" } else { "json" };
    [ids, text("/scalar"), text(encoding), map(&[("unit.force", "N")])].concat()
}

fn message_body(k: u32) -> Vec<u8> {
    let head = [&1u16.to_le_bytes()[..], &k.to_le_bytes(), &u64::from(k).to_le_bytes(), &1u64.to_le_bytes()];
    let time = [&[0x11][..], &(f64::from(k) * 0.5).to_le_bytes()].concat();
    let force = [&[0x19][..], &f64::from(k).to_le_bytes()].concat();
    [head.concat(), time, force].concat()
}

/// A file with a content and features.
fn build(content: Content, features: Features) -> Vec<u8> {
    let mut file = File { bytes: mcap::MAGIC.to_vec(), padding: features.padding };
    file.record(0x01, &[text(""), text("tests")].concat());
    let mut data = File { bytes: Vec::new(), padding: features.padding };
    let mut offsets = Vec::new();
    if content.messages > 0 {
        if content.schema {
            data.record(0x03, &schema_body());
        }
        data.record(0x04, &channel_body(content.schema));
        for k in 0..content.messages {
            let (offset, _) = data.record(0x05, &message_body(k));
            offsets.push((u64::from(k), offset));
        }
    }
    let last = u64::from(content.messages.saturating_sub(1));
    let mut chunk_index = None;
    if content.messages > 0 && features.chunks {
        let size = data.bytes.len() as u64;
        let head = [0u64.to_le_bytes(), last.to_le_bytes(), size.to_le_bytes()].concat();
        let body =
            [head, 0u32.to_le_bytes().to_vec(), text(""), size.to_le_bytes().to_vec(), data.bytes].concat();
        let (chunk, chunk_length) = file.record(0x06, &body);
        let mut index = (file.bytes.len() as u64, 0);
        if features.message_index {
            let entries: Vec<u8> = offsets
                .iter()
                .flat_map(|(time, at)| [time.to_le_bytes(), at.to_le_bytes()].concat())
                .collect();
            let body = [&1u16.to_le_bytes()[..], &(entries.len() as u32).to_le_bytes(), &entries].concat();
            index = file.record(0x07, &body);
        }
        let listed = if features.message_index {
            [&10u32.to_le_bytes()[..], &1u16.to_le_bytes(), &index.0.to_le_bytes()].concat()
        } else {
            0u32.to_le_bytes().to_vec()
        };
        let head = [0, last, chunk, chunk_length].map(u64::to_le_bytes).concat();
        let tail = [size.to_le_bytes(), size.to_le_bytes()].concat();
        chunk_index = Some([head, listed, index.1.to_le_bytes().to_vec(), text(""), tail].concat());
    } else {
        file.bytes.extend(data.bytes);
    }
    let (mut attachment, mut metadata) = (None, None);
    if content.attachment {
        let times = [2u64.to_le_bytes(), 1u64.to_le_bytes()].concat();
        let body = [times.clone(), text("myFile"), text("text"), 3u64.to_le_bytes().to_vec(), vec![7, 8, 9]]
            .concat();
        let crc = crc32fast::hash(&body);
        let (offset, length) = file.record(0x09, &[body, crc.to_le_bytes().to_vec()].concat());
        let places = [offset.to_le_bytes(), length.to_le_bytes()].concat();
        attachment =
            Some([places, times, 3u64.to_le_bytes().to_vec(), text("myFile"), text("text")].concat());
    }
    if content.metadata {
        let (offset, length) = file.record(0x0c, &[text("myMetadata"), map(&[("foo", "bar")])].concat());
        metadata =
            Some([offset.to_le_bytes().to_vec(), length.to_le_bytes().to_vec(), text("myMetadata")].concat());
    }
    file.record(0x0f, &0u32.to_le_bytes());
    let summary_start = file.bytes.len() as u64;
    let mut groups = Vec::new();
    let mut group = |file: &mut File, opcode: u8, body: Option<Vec<u8>>| {
        if let Some(body) = body {
            let (start, length) = file.record(opcode, &body);
            groups.push((opcode, start, length));
        }
    };
    let with_messages = content.messages > 0;
    group(&mut file, 0x03, (features.repeated_schemas && with_messages && content.schema).then(schema_body));
    let channel = (features.repeated_channels && with_messages).then(|| channel_body(content.schema));
    // a channel is of no use without its schema
    let channel = channel.filter(|_| !content.schema || features.repeated_schemas);
    group(&mut file, 0x04, channel);
    let statistics = features.statistics.then(|| {
        let one = |flag: bool| u32::from(flag).to_le_bytes();
        let schemas = u16::from(with_messages && content.schema).to_le_bytes();
        let counts = if with_messages {
            [&10u32.to_le_bytes()[..], &1u16.to_le_bytes(), &u64::from(content.messages).to_le_bytes()]
                .concat()
        } else {
            0u32.to_le_bytes().to_vec()
        };
        let chunks = with_messages && features.chunks;
        let numbers =
            [one(with_messages), one(content.attachment), one(content.metadata), one(chunks)].concat();
        let times = [0u64.to_le_bytes(), last.to_le_bytes()].concat();
        [u64::from(content.messages).to_le_bytes().to_vec(), schemas.to_vec(), numbers, times, counts]
            .concat()
    });
    group(&mut file, 0x0b, statistics);
    group(&mut file, 0x0a, attachment.filter(|_| features.attachment_index));
    group(&mut file, 0x0d, metadata.filter(|_| features.metadata_index));
    group(&mut file, 0x08, chunk_index.filter(|_| features.chunk_index));
    let offsets_start = file.bytes.len() as u64;
    if features.summary_offsets {
        for (opcode, start, length) in &groups {
            file.record(0x0e, &[&[*opcode][..], &start.to_le_bytes(), &length.to_le_bytes()].concat());
        }
    }
    let has_offsets = features.summary_offsets && !groups.is_empty();
    let starts =
        [if groups.is_empty() { 0 } else { summary_start }, if has_offsets { offsets_start } else { 0 }];
    file.record(0x02, &[starts.map(u64::to_le_bytes).concat(), vec![0; 4]].concat());
    file.bytes.extend(mcap::MAGIC);
    file.bytes
}

#[derive(Default)]
struct Rows(Vec<Vec<Cell>>);

impl Sink for Rows {
    fn begin(&mut self, _: &[Heading]) -> std::io::Result<()> {
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> std::io::Result<()> {
        self.0.push(cells.to_vec());
        Ok(())
    }

    fn end(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn check(path: &Path, content: Content, what: &str) {
    let limits = Limits::default();
    let report = verify(path, limits).expect("a file");
    assert!(report.is_sound(), "{what}: {:?}", report.problems);
    assert_eq!(report.messages, u64::from(content.messages), "{what}");
    let read = Recording::read(path, limits).expect("a file");
    assert!(read.complete, "{what}: {:?}", read.damages);
    let recording = Recording::open(path, limits).expect("a file");
    for (channels, metadata, attachments) in [
        (&read.channels, &read.metadata, &read.attachments),
        (&recording.channels, &recording.metadata, &recording.attachments),
    ] {
        assert_eq!(channels.len(), usize::from(content.messages > 0), "{what}");
        assert!(channels.values().all(|channel| channel.layout.is_some() == content.schema), "{what}");
        assert_eq!(metadata.len(), usize::from(content.metadata), "{what}");
        assert_eq!(attachments.len(), usize::from(content.attachment), "{what}");
    }
    if content.attachment {
        let attachment = recording.attachment("myFile").expect("a file");
        assert_eq!(attachment.as_deref(), Some(&[7, 8, 9][..]), "{what}");
    }
    if content.schema {
        let request =
            trace::Request { topics: vec!["/scalar".parse().expect("a topic")], ..trace::Request::default() };
        let mut rows = Rows::default();
        trace::trace(&[path.to_path_buf()], &request, limits, &mut rows).expect("a trace");
        assert_eq!(rows.0.len() as u32, content.messages, "{what}");
        let is_right = |(k, row): (usize, &Vec<Cell>)| {
            row[0] == Cell::Double(k as f64 * 0.5) && row.contains(&Cell::Double(k as f64))
        };
        assert!(rows.0.iter().enumerate().all(is_right), "{what}: {:?}", rows.0);
    }
}

#[test]
fn all_combinations_of_features() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    let mut files = 0;
    for content in CONTENTS {
        for bits in 0..1 << Features::COUNT {
            let features = Features::of(bits);
            // features that a content has no use for make no other files
            let needless = (content.messages == 0 && features.chunks)
                || (!features.chunks && (features.message_index || features.chunk_index))
                || (!content.attachment && features.attachment_index)
                || (!content.metadata && features.metadata_index);
            if needless {
                continue;
            }
            fs::write(&path, build(content, features)).expect("a file");
            check(&path, content, &format!("{content:?} {features:?}"));
            files += 1;
        }
    }
    assert!(files > 600, "{files}");
}

#[test]
fn only_chunks_that_hold_the_topic_are_read() {
    // /scalar in one chunk of 40, the rest on /profile
    let mut recording = forge::forge(4000, 1);
    recording.channels.truncate(2);
    recording.channel("/scalar").messages.truncate(20);
    let bytes = recording.write(forge::plain());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    fs::write(&path, &bytes).expect("a file");
    let run = |topic: &str, from: Option<f64>| {
        let topics = vec![topic.parse().expect("a topic")];
        let request = trace::Request {
            topics,
            window: Window { from: from.map(Into::into), ..Window::default() },
            ..trace::Request::default()
        };
        let mut rows = Rows::default();
        let outcome = trace::trace(std::slice::from_ref(&path), &request, Limits::default(), &mut rows)
            .expect("a trace");
        assert_eq!(outcome.rows, rows.0.len() as u64);
        (outcome.rows, outcome.bytes_read)
    };
    let length = bytes.len() as u64;
    let (rows, read) = run("/scalar", None);
    assert_eq!(rows, 20);
    assert!(read < 20_000 && length > 500_000, "{read} of {length} bytes");
    let (rows, read) = run("/profile", None);
    assert_eq!(rows, 4000);
    assert!(read > length / 2, "{read} of {length} bytes");
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

/// Topics whose messages know no time but their log time, so many nanoseconds after a start: they are the values.
fn by_log_time(start: u64, topics: &[(&str, &[u64])]) -> Vec<u8> {
    let mut recording = forge::forge(1, 3);
    recording.channels.clear();
    let place = forge::pool(&recording.file).get_message_by_name("lab.Place").expect("the message");
    for (topic, times) in topics {
        let message = |&time: &u64| {
            let mut message = prost_reflect::DynamicMessage::new(place.clone());
            message.set_field_by_name("x", prost_reflect::Value::F64(time as f64));
            (start + time, message)
        };
        recording.channels.push(forge::Channel {
            topic: (*topic).into(),
            message: "Place".into(),
            metadata: Default::default(),
            messages: times.iter().map(message).collect(),
        });
    }
    recording.write(forge::plain())
}

#[test]
fn messages_at_a_time_are_the_nearest_to_the_nanosecond() {
    // seconds as floating-point numbers are the same
    const LATE: u64 = 300 * 86_400 * 1_000_000_000;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    fs::write(&path, by_log_time(LATE, &[("/p", &[0, 1, 2, 3, 9])])).expect("a file");
    let recording = Recording::open(&path, Limits::default()).expect("a recording");
    let (&id, channel) = recording.channels.iter().next().expect("the channel");
    let x = channel.layout.as_ref().and_then(|layout| layout.find("x")).expect("the field");
    let times = ["25920000.000000001", "25920000.000000003", "25920000.000000007"];
    let times = times.map(|time| time.parse().expect("a time"));
    let at = |times: &[Bound]| -> Vec<Option<f64>> {
        let (moments, _) = moments(&recording, id, times).expect("messages");
        moments.iter().map(|moment| moment.values.lists[x].number(0)).collect()
    };
    assert_eq!(at(&times), [1.0, 3.0, 9.0].map(Some));
    assert_eq!(at(&[]), [Some(9.0)]);
}

#[test]
fn log_times_are_joined_and_chosen_to_the_nanosecond() {
    const DATE: u64 = 1_700_000_000_123_456_789;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    let recording = by_log_time(DATE, &[("/p", &[0, 10, 20, 30, 40]), ("/q", &[1, 11, 21, 31, 41])]);
    fs::write(&path, recording).expect("a file");
    let run = |align, from: Option<&str>| {
        let request = trace::Request {
            topics: vec!["/p".parse().expect("a topic"), "/q".parse().expect("a topic")],
            selection: percuss_reader::field::Selection { fields: vec!["x".into()], ..Default::default() },
            window: Window { from: from.map(|from| from.parse().expect("a time")), ..Window::default() },
            epoch: true,
            time: trace::TimeForm::Ns,
            align,
            ..trace::Request::default()
        };
        let mut rows = Rows::default();
        trace::trace(std::slice::from_ref(&path), &request, Limits::default(), &mut rows).expect("a trace");
        rows.0
    };
    let exact = run(trace::Align::Exact, None);
    let times: Vec<Cell> = exact.iter().map(|row| row[0].clone()).collect();
    let expected: Vec<Cell> =
        (0..5).flat_map(|k| [0, 1].map(|late| Cell::UInt(DATE + 10 * k + late))).collect();
    assert_eq!(times, expected);
    assert_eq!(exact[1][1..], [Cell::Empty, Cell::Double(1.0)]);
    let since = run(trace::Align::Exact, Some("1700000000.123456820"));
    assert_eq!(since.first().map(|row| row[0].clone()), Some(Cell::UInt(DATE + 31)));
    // between 1 and 11 there is 10
    let linear = run(trace::Align::Linear, None);
    assert_eq!(linear[1], [Cell::UInt(DATE + 10), Cell::Double(10.0), Cell::Double(10.0)]);
}
