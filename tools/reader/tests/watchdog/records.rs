//! Hostile records: lengths, indexes and chunks that lie, and very many of everything.

use super::{
    Case,
    types::{lab, lab_channel},
};
use crate::raw::{
    ChunkEntry, Counts, attachment, attachment_index, attachment_of, block, channel, chunk, chunk_at,
    compressed, compressed_repeats, file, first_offset, indexed, map, message, message_at, metadata,
    metadata_index, record, schema, statistics, text, whole,
};

pub const CASES: &[Case] = &[
    ("an empty file", Vec::new),
    ("the magic bytes alone", || mcap::MAGIC.to_vec()),
    ("the magic bytes twice", || mcap::MAGIC.repeat(2)),
    ("a header alone", || file(&[])),
    ("a footer alone", || footer_at(0)),
    ("a footer beyond the end", || footer_at(1 << 40)),
    ("a footer that points at itself", || footer_at(first_offset())),
    ("a footer that points at the header", || footer_at(8)),
    ("a record of 2^64 − 1 bytes", || of_length(u64::MAX)),
    ("a record of 2^63 bytes", || of_length(1 << 63)),
    ("records of opcode 0", || [file(&[]), vec![0; 1 << 20]].concat()),
    ("records of no length", || whole(&[many(300_000, |_| record(0x90, &[]))], &[])),
    ("records of no length in a chunk", || in_chunk(many(1_000_000, |_| record(0x90, &[])))),
    ("texts beyond their record", || {
        file(&(1..=0x0f).map(|opcode| record(opcode, &[0xff; 64])).collect::<Vec<_>>())
    }),
    ("a map of an odd number of texts", || {
        let odd = [text(b"key"), text(b"value"), text(b"key")].concat();
        file(&[channel(1, 0, "/a", &odd), record(0x0c, &[text(b"m"), text(&odd)].concat())])
    }),
    ("keys twice in a map", || {
        let twice = [("a", "1"), ("a", "2")];
        whole(&[metadata("m", &twice), channel(1, 0, "/a", &map(&twice))], &[])
    }),
    ("a million keys in a map", || {
        whole(&[record(0x0c, &[text(b"m"), text(&many(400_000, entry))].concat())], &[])
    }),
    ("summary offsets in circles", offsets_in_circles),
    ("a million channels", || {
        let part = |k: u32| compressed(&[many(250_000, |i| channel((250_000 * k + i) as u16, 0, "/t", &[]))]);
        whole(&(0..4).map(part).collect::<Vec<_>>(), &[])
    }),
    ("channels of one id, each different", || {
        whole(&[compressed(&[many(200_000, |i| channel(1, 0, &format!("/{i}"), &[]))]), message(1, &[])], &[])
    }),
    ("a million channels in the summary", || whole(&[], &many(300_000, |i| channel(i as u16, 0, "/t", &[])))),
    ("a million schemas", || in_chunk(many(300_000, |i| schema((i as u16).max(1), "", &[])))),
    ("a million schemas in the summary", || {
        whole(&[], &many(400_000, |i| schema((i as u16).max(1), "", &[])))
    }),
    ("channels with long names", || {
        let name = |i: u32| format!("/{i}{}", "x".repeat(60_000));
        let part =
            |k: u32| compressed(&[many(20, |i| channel((20 * k + i) as u16, 0, &name(20 * k + i), &[]))]);
        whole(&(0..150).map(part).collect::<Vec<_>>(), &[])
    }),
    ("a record that is longer than its chunk", || {
        // found by fuzzing: the decompressor subtracted what was not there
        let data = [&message(1, &[])[..], &[0x05], &1000_u64.to_le_bytes(), &[0; 20]].concat();
        whole(&[channel(1, 0, "/a", &[]), chunk(data.len() as u64, b"", &data)], &[])
    }),
    ("a million metadata records", || whole(&[many(200_000, |_| metadata("m", &[]))], &[])),
    ("a million entries of one metadata record", || {
        let index = many(150_000, |_| metadata_index(first_offset(), metadata("m", &[]).len() as u64, "m"));
        listed(metadata("m", &[]), index, Counts { metadata: 150_000, ..Counts::default() })
    }),
    ("entries of metadata that point at each other", || {
        let index = [metadata_index(1 << 50, u64::MAX, "m"), metadata_index(3, 0, "m")].concat();
        listed(metadata("m", &[]), index, Counts { metadata: 2, ..Counts::default() })
    }),
    ("attachments and as many entries", || {
        let (count, one) = (8_000, attachment("a", &[]));
        let entry = |at, length| attachment_index(at, length, 0, "a");
        repeated(count, &one, entry, Counts { attachments: count, ..Counts::default() })
    }),
    ("metadata records and as many entries", || {
        let (count, one) = (14_000, metadata("m", &[]));
        let entry = |at, length| metadata_index(at, length, "m");
        repeated(count, &one, entry, Counts { metadata: count, ..Counts::default() })
    }),
    ("a million entries of chunks", || {
        let entries = many(150_000, |i| entry_at(u64::from(i)).record());
        listed(vec![], entries, Counts { chunks: 150_000, ..Counts::default() })
    }),
    ("entries of chunks with very many channels", || {
        let entry = |i: u32| ChunkEntry { channels: vec![(1, 1); 10_000], ..entry_at(u64::from(i)) }.record();
        whole(&[], &many(100, entry))
    }),
    ("statistics of very many channels", || {
        let of_channels = (0..1_000_000).map(|i: u32| (i as u16, 1)).collect();
        whole(&[], &statistics(&Counts { channels: 1, of_channels, ..Counts::default() }))
    }),
    ("statistics of 2^64 messages", || {
        indexed(&[channel(1, 0, "/a", &[])], &[(message(1, b"a"), (0, 0))], |_, counts| {
            (counts.messages, counts.of_channels) = (u64::MAX, vec![(1, u64::MAX)]);
        })
    }),
    ("statistics that overflow", || {
        let two = [channel(1, 0, "/a", &[]), channel(2, 0, "/b", &[])];
        indexed(&two, &[(message(1, b"a"), (0, 0))], |_, counts| {
            counts.of_channels = vec![(1, u64::MAX), (2, u64::MAX)];
        })
    }),
    ("message indexes of very many entries", || {
        let entries = vec![0xff; 16 * 400_000];
        whole(&[channel(1, 0, "/a", &[]), compressed(&[message(1, &[])]), message_index(1, &entries)], &[])
    }),
    ("message indexes of odd lengths", || {
        let indexes = [0, 1, 15, 17, 1000].map(|length| message_index(1, &vec![1; length])).concat();
        whole(&[channel(1, 0, "/a", &[]), compressed(&[message(1, &[])]), indexes], &[])
    }),
    ("message indexes of 65 536 channels that are not there", || {
        let indexes = many(65_536, |id| message_index(id as u16, &[0; 16]));
        whole(&[compressed(&[message(1, &[])]), indexes], &[])
    }),
    ("an entry of a chunk that is none", || forged(|entries, _| entries[0].offset = first_offset())),
    ("an entry of a chunk beyond the end", || {
        forged(|entries, _| (entries[0].offset, entries[0].length) = (u64::MAX - 5, u64::MAX))
    }),
    ("an entry of a chunk inside a chunk", || {
        forged(|entries, counts| {
            let inner = ChunkEntry { offset: entries[0].offset + 20, ..entries[0].clone() };
            entries.push(inner);
            counts.chunks += 1;
        })
    }),
    ("an entry of a chunk in the summary", || forged(|entries, _| entries[0].offset += 4000)),
    ("an entry of a chunk with other sizes", || {
        forged(|entries, _| {
            (entries[0].compressed, entries[0].uncompressed, entries[0].index_length) =
                (0, u64::MAX, u64::MAX)
        })
    }),
    ("sizes of chunks that overflow", || {
        forged(|entries, _| {
            let one = entries[0].clone();
            let twin =
                |offset| ChunkEntry { offset, compressed: u64::MAX, uncompressed: u64::MAX, ..one.clone() };
            entries.extend([2, 3].map(twin));
        })
    }),
    ("a chunk of 2^64 − 1 bytes behind damage", || {
        let head = [&[0; 16][..], &u64::MAX.to_le_bytes(), &[0; 4], &text(b"zstd"), &u64::MAX.to_le_bytes()]
            .concat();
        [file(&[]), vec![0; 50], record(0x06, &head), record(0x06, &[&head[..], &[0; 64]].concat())].concat()
    }),
    ("an entry of a chunk with times from end to start", || {
        forged(|entries, _| entries[0].times = (u64::MAX, 0))
    }),
    ("entries of chunks that reach over each other", || {
        forged(|entries, counts| {
            entries[0].length = u64::MAX / 2;
            let twin = ChunkEntry { compression: "lz4", ..entries[0].clone() };
            entries.push(twin);
            counts.chunks += 1;
        })
    }),
    ("chunks that all overlap in time", || {
        let all: Vec<_> =
            (0..40).map(|i| (many(20_000, |k| message_at(1, u64::from(k), &[i; 30])), (0, 20_000))).collect();
        indexed(&[channel(1, 0, "/a", &[])], &all, |_, counts| counts.of_channels = vec![(1, 800_000)])
    }),
    ("chunks that claim 2^64 − 1 bytes", || {
        let one = |name: &[u8]| chunk(u64::MAX, name, b"abcdefgh");
        whole(&[one(b""), one(b"lz4"), one(b"zstd"), chunk(1 << 63, b"zstd", &zeros(1000))], &[])
    }),
    ("chunks that claim too little", || {
        let one = |name: &[u8], data: &[u8]| chunk(10, name, data);
        whole(&[one(b"", &[0; 4096]), one(b"lz4", &lz4_zeros()), one(b"zstd", &zeros(250_000_000))], &[])
    }),
    ("chunks that claim what is just allowed", || {
        let one = |name: &[u8]| chunk(16 << 20, name, &zeros(1000));
        whole(&(0..200).flat_map(|_| [one(b"zstd"), one(b"lz4"), one(b"")]).collect::<Vec<_>>(), &[])
    }),
    ("a chunk of 250 MB of zeros", || whole(&[chunk(250_000_000, b"zstd", &zeros(250_000_000))], &[])),
    ("a chunk of 20 MB of zeros in lz4", || whole(&[chunk(20_000_000, b"lz4", &lz4_zeros())], &[])),
    ("twenty chunks of 250 MB of empty messages", || {
        let one = message(1, &[]);
        let count = 250_000_000 / one.len();
        let chunk = chunk((count * one.len()) as u64, b"zstd", &compressed_repeats(&one, count));
        whole(&[channel(1, 0, "/a", &[]), chunk.repeat(20)], &[])
    }),
    ("chunks of empty messages as large as allowed", || {
        let one = message(1, &[]);
        let count = (8 << 20) / one.len() - 1;
        let chunk = chunk((count * one.len()) as u64, b"zstd", &compressed_repeats(&one, count));
        whole(&[channel(1, 0, "/a", &[]), chunk], &[])
    }),
    ("chunks in chunks", || {
        let nested = (0..100).fold(message(1, &[]), |inner, _| chunk(inner.len() as u64, b"", &inner));
        whole(&[channel(1, 0, "/a", &[]), nested], &[])
    }),
    ("a frame with a window of 2 GB", || {
        // magic, descriptor without content size, window descriptor of 2^31 bytes, one raw block of a byte
        let frame = [&[0x28, 0xb5, 0x2f, 0xfd][..], &[0x00, 0xa8], &[0x09, 0, 0], b"x"].concat();
        let smaller = [&frame[..5], &[0x88], &frame[6..]].concat();
        whole(&[frame, smaller].map(|frame| chunk(1, b"zstd", &frame)), &[])
    }),
    ("a million frames with nothing in them", || {
        whole(&[chunk(1, b"zstd", &[0x50, 0x2a, 0x4d, 0x18, 0, 0, 0, 0].repeat(500_000))], &[])
    }),
    ("chunks of other compressions", || {
        let long = vec![b'x'; 100_000];
        whole(&[chunk(4, &long, b"abcd"), chunk(4, b"\x1b[2J", b"abcd"), chunk(4, b"", b"")], &[])
    }),
    ("messages of 65 536 channels that are not there", || {
        in_chunk(many(200_000, |i| message(i as u16, &[])))
    }),
    ("channels whose schemas are not there", || {
        let channels = (1..100).map(|id| channel(id, 7 + id, "/a", &[]));
        whole(&channels.chain((1..100).map(|id| message(id, b"abc"))).collect::<Vec<_>>(), &[])
    }),
    ("a channel that changes its schema", || {
        let (scalar, note) =
            (lab_channel("Scalar", "/a", &[]), [lab(2, "Note"), channel(1, 2, "/a", &[])].concat());
        let text = message(1, &block(3, b"text"));
        whole(&[scalar, text.clone(), note, text, lab(1, "Profile")], &[])
    }),
    ("ten thousand channels of one topic", || {
        let channels = many(4000, |id| channel(id as u16, 1, "/a", &[]));
        whole(&[lab(1, "Note"), channels, compressed(&[many(4000, |id| message(id as u16, &[]))])], &[])
    }),
    ("an attachment that claims a gigabyte", || {
        file(&[1 << 30, u64::MAX, 0].map(|claimed| attachment_of(b"a", claimed, b"abc")))
    }),
    ("attachments with wicked names", || {
        let long = "n".repeat(300);
        let names = ["../../escaped", "/tmp/escaped", "a\0b", "", ".", "..", "\u{1b}[2J", &long, "con\n"];
        whole(&names.map(|name| attachment(name, b"content")), &[])
    }),
    ("an attachment with a name of 300 bytes", || whole(&[attachment(&"n".repeat(300), b"content")], &[])),
    ("ten thousand attachments of one name", || whole(&[many(10_000, |_| attachment("a", b"a"))], &[])),
    ("attachments whose numbers are taken", || {
        let numbered = many(3000, |i| attachment(&format!("a.{}", i + 2), b"a"));
        whole(&[numbered, attachment("a", b"a").repeat(3000)], &[])
    }),
];

pub fn many(count: u32, one: impl Fn(u32) -> Vec<u8>) -> Vec<u8> {
    let mut all = Vec::new();
    (0..count).for_each(|i| all.extend(one(i)));
    all
}

fn in_chunk(records: Vec<u8>) -> Vec<u8> {
    whole(&[compressed(&[records])], &[])
}

/// Records with entries of the summary, and what it counts.
fn listed(records: Vec<u8>, entries: Vec<u8>, counts: Counts) -> Vec<u8> {
    whole(&[records], &[entries, statistics(&counts)].concat())
}

/// A record over and over, each with its entry.
///
/// * `entry`: of its place and length
fn repeated(count: u32, one: &[u8], entry: impl Fn(u64, u64) -> Vec<u8>, counts: Counts) -> Vec<u8> {
    let length = one.len() as u64;
    let entries = many(count, |i| entry(first_offset() + length * u64::from(i), length));
    listed(one.repeat(count as usize), entries, counts)
}

fn message_index(id: u16, entries: &[u8]) -> Vec<u8> {
    record(0x07, &[&id.to_le_bytes()[..], &text(entries)].concat())
}

fn entry(i: u32) -> Vec<u8> {
    map(&[(&i.to_string(), "")])
}

fn footer_at(summary: u64) -> Vec<u8> {
    let footer = record(0x02, &[&summary.to_le_bytes()[..], &[0; 8 + 4]].concat());
    [&file(&[])[..], &footer, mcap::MAGIC].concat()
}

fn of_length(length: u64) -> Vec<u8> {
    let forged = [&[0x05][..], &length.to_le_bytes(), &[0; 100]].concat();
    whole(&[channel(1, 0, "/a", &[]), forged, compressed(&[message(1, b"later")])], &[])
}

fn offsets_in_circles() -> Vec<u8> {
    let start = file(&[record(0x0f, &[0; 4])]).len() as u64;
    let offset = |opcode: u8, at: u64| {
        record(0x0e, &[&[opcode][..], &at.to_le_bytes(), &u64::MAX.to_le_bytes()].concat())
    };
    whole(&[], &[offset(0x0e, start), offset(0x02, start + 26), offset(0x0e, start + 26)].concat())
}

fn entry_at(offset: u64) -> ChunkEntry {
    ChunkEntry { offset, length: 1, ..ChunkEntry::default() }
}

/// A message in a chunk, with a forged summary.
fn forged(change: impl FnOnce(&mut Vec<ChunkEntry>, &mut Counts)) -> Vec<u8> {
    let content = many(100, |i| message_at(1, u64::from(i), &[]));
    indexed(&[lab(1, "Scalar"), channel(1, 1, "/a", &[])], &[(content, (0, 99))], |entries, counts| {
        (counts.messages, counts.of_channels) = (100, vec![(1, 100)]);
        change(entries, counts);
    })
}

fn zeros(count: usize) -> Vec<u8> {
    compressed_repeats(&[0], count)
}

/// 20 MB of zeros as lz4 compresses them.
fn lz4_zeros() -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4)).chunk_size(None);
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).expect("a writer");
    let id = writer.add_channel(0, "/a", "", &Default::default()).expect("a channel");
    let header = mcap::records::MessageHeader { channel_id: id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, &vec![0; 20_000_000]).expect("room");
    writer.finish().expect("an end");
    let bytes = writer.into_inner().into_inner();
    let at = mcap::MAGIC.len();
    // the header, then the chunk
    let length = |at: usize| u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("a length")) as usize;
    let chunk = at + 9 + length(at);
    assert_eq!(bytes[chunk], 0x06);
    // its times, sizes, checksum, the name of the compression and the length of its data
    let data = chunk + 9 + 8 + 8 + 8 + 4 + 4 + 3 + 8;
    bytes[data..chunk + 9 + length(chunk)].to_vec()
}

/// A chunk of messages that says when they are.
pub fn timed(times: (u64, u64), records: &[u8]) -> Vec<u8> {
    let data = zstd::bulk::compress(records, 3).expect("compressed bytes");
    chunk_at(times, records.len() as u64, b"zstd", &data)
}
