//! Every way an MCAP file may be put together is read alike: with and without chunks, indexes, statistics, repeated
//! definitions, and with extra bytes at the ends of records, which a reader must skip.
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
};
use percuss_table::{Cell, Heading, Sink};

use crate::{
    forge,
    raw::{
        ChunkEntry, Counts, attachment, attachment_index, channel_of, chunk_at, double, map, message_at,
        metadata, metadata_index, record, statistics, text,
    },
    watchdog::types::lab,
};

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

/// A file with a content and features.
fn build(content: Content, features: Features) -> Vec<u8> {
    let put = |bytes: &mut Vec<u8>, record| put(bytes, record, features.padding);
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
    if has_messages && features.chunks {
        let size = data.len() as u64;
        let (offset, length) = put(&mut file, chunk_at(times, size, b"", &data));
        let (mut channels, mut index_length) = (Vec::new(), 0);
        if features.message_index {
            channels = vec![(1, file.len() as u64)];
            let index = record(0x07, &[&1u16.to_le_bytes()[..], &text(&entries)].concat());
            (_, index_length) = put(&mut file, index);
        }
        let (compression, compressed, uncompressed) = ("", size, size);
        let entry = ChunkEntry {
            times,
            offset,
            length,
            channels,
            index_length,
            compression,
            compressed,
            uncompressed,
        };
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
        chunks: (has_messages && features.chunks).into(),
        times,
        of_channels: channel.iter().map(|_| (1, content.messages.into())).collect(),
    });
    let is_described = !content.schema || features.repeated_schemas;
    let summary = [
        schema.filter(|_| features.repeated_schemas),
        // a channel is of no use without its schema
        channel.filter(|_| features.repeated_channels && is_described),
        features.statistics.then_some(statistics),
        attachment.filter(|_| features.attachment_index),
        metadata.filter(|_| features.metadata_index),
        chunk_index.filter(|_| features.chunk_index),
    ];
    let groups = summary.into_iter().flatten().map(|record| (record[0], put(&mut file, record)));
    let groups: Vec<(u8, (u64, u64))> = groups.collect();
    let offsets_start = file.len() as u64;
    for (opcode, (start, length)) in groups.iter().filter(|_| features.summary_offsets) {
        let body = [&[*opcode][..], &start.to_le_bytes(), &length.to_le_bytes()].concat();
        put(&mut file, record(0x0e, &body));
    }
    let has_offsets = features.summary_offsets && !groups.is_empty();
    let starts =
        [if groups.is_empty() { 0 } else { summary_start }, if has_offsets { offsets_start } else { 0 }];
    put(&mut file, record(0x02, &[starts.map(u64::to_le_bytes).concat(), vec![0; 4]].concat()));
    file.extend(mcap::MAGIC);
    file
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
    let channel = |(topic, times): &(&str, &[u64])| {
        forge::by_log_time(topic, times.iter().map(|time| (start + time, *time as f64)))
    };
    recording.channels = topics.iter().map(channel).collect();
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
        let (moments, ..) = moments(&recording, id, times, false).expect("messages");
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
