//! Messages by log time: from files whose chunks overlap, from any time on, of any encoding.

use std::{collections::BTreeMap, io::Cursor, path::Path};

use mcap::{WriteOptions, Writer, records::MessageHeader};
use percuss_reader::{
    recording::Limits,
    timeline::{Event, Timeline},
};

/// A file with the given log times \[ns\], chunk by chunk, on two channels in turn; messages say their own time.
fn file(chunks: &[&[u64]], options: WriteOptions) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = Writer::with_options(&mut bytes, options).expect("a writer");
    let schema = writer.add_schema("time", "jsonschema", b"{}").expect("a schema");
    let channels = ["/a", "/b"]
        .map(|topic| writer.add_channel(schema, topic, "json", &BTreeMap::new()).expect("a channel"));
    for (sequence, chunk) in chunks.iter().enumerate() {
        for (i, &log_time) in chunk.iter().enumerate() {
            let (channel_id, sequence) = (channels[i % 2], sequence as u32);
            let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, log_time.to_string().as_bytes()).expect("room");
        }
        writer.flush().expect("a chunk");
    }
    writer.finish().expect("an end");
    drop(writer);
    bytes.into_inner()
}

fn open(bytes: Vec<u8>) -> Option<Timeline> {
    Timeline::open(Box::new(Cursor::new(bytes)), Path::new("test.mcap"), Limits::default())
        .expect("an MCAP file")
}

fn times(events: &[Event]) -> Vec<u64> {
    events.iter().map(|event| event.log_time).collect()
}

fn rest(timeline: &mut Timeline) -> Vec<u64> {
    let mut events = Vec::new();
    while let Some(event) = timeline.next_event().expect("a sound file") {
        assert_eq!(event.data, event.log_time.to_string().as_bytes());
        events.push(event);
    }
    times(&events)
}

#[test]
fn overlapping_chunks_come_in_the_order_of_time() {
    let chunks: [&[u64]; 4] = [&[10, 30, 20], &[15, 70], &[5, 90, 40], &[95, 60]];
    let mut timeline = open(file(&chunks, WriteOptions::new())).expect("an index");
    assert_eq!(timeline.span(), Some((5, 95)));
    assert_eq!(rest(&mut timeline), [5, 10, 15, 20, 30, 40, 60, 70, 90, 95]);
    timeline.go_to(30);
    assert_eq!(rest(&mut timeline), [30, 40, 60, 70, 90, 95]);
    timeline.go_to(96);
    assert_eq!(rest(&mut timeline), [0; 0]);
    timeline.go_to(0);
    assert_eq!(rest(&mut timeline).len(), 10, "and back");
    let channel = timeline.channels().values().next().expect("a channel");
    assert_eq!((channel.topic.as_str(), channel.encoding.as_str()), ("/a", "json"));
    assert_eq!(channel.schema.as_ref().map(|schema| schema.1.as_str()), Some("jsonschema"));
    assert!(timeline.damages().is_empty());
}

#[test]
fn the_last_messages_before_a_time() {
    // /a gets the first and third of every chunk, /b the second
    let chunks: [&[u64]; 3] = [&[10, 20, 30], &[40, 50, 60], &[70, 80, 90]];
    let mut timeline = open(file(&chunks, WriteOptions::new())).expect("an index");
    let mut before = |time| times(&timeline.latest_before(time).expect("a sound file"));
    assert_eq!(before(10), [0; 0]);
    assert_eq!(before(21), [10, 20]);
    assert_eq!(before(65), [50, 60]);
    assert_eq!(before(75), [50, 70], "from two chunks");
    assert_eq!(before(u64::MAX), [80, 90]);
}

#[test]
fn files_without_an_index_have_no_timeline() {
    let chunks: [&[u64]; 2] = [&[1, 2], &[3, 4]];
    assert!(open(file(&chunks, WriteOptions::new().use_chunks(false))).is_none());
    let whole = file(&chunks, WriteOptions::new());
    assert!(open(whole[..whole.len() - 40].to_vec()).is_none());
    // a schema that is not repeated in the summary cannot be reported to viewers
    assert!(open(file(&chunks, WriteOptions::new().repeat_schemas(false))).is_none());
}

#[test]
fn damage_is_stepped_over() {
    let chunks: [&[u64]; 3] = [&[1, 2], &[3, 4], &[5, 6]];
    let mut bytes = file(&chunks, WriteOptions::new().compression(None));
    let place =
        bytes.windows(1).enumerate().position(|(i, byte)| i > 300 && byte == b"3").expect("a message");
    bytes[place] ^= 1;
    let mut timeline = open(bytes).expect("an index");
    let mut seen = 0;
    while timeline.next_event().expect("a readable file").is_some() {
        seen += 1;
    }
    assert!(!timeline.damages().is_empty() && seen < 6, "{seen}");
}
