//! Files put together record by record, as no writer would, and the reader run on them with little memory.
#![allow(dead_code, reason = "each test program uses some of it")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use tempfile::TempDir;

/// A folder with one file in it.
pub fn folder(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    fs::write(&path, bytes).expect("a file");
    (folder, path)
}

/// Runs the reader with little memory; answers its exit status and what it says. A process that aborts, or does not come
/// to an end, has no status.
pub fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let (status, _, stderr) = run_all(folder, arguments);
    (status, stderr)
}

/// The same with what it prints.
pub fn run_all(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    // addresses, not only memory in use: what asks for more than this is refused by the system and aborts
    const ADDRESSES_KIB: u64 = 600_000;
    /// The machine may be busy: what takes longer than this takes for ever \[s\].
    const LONGEST: u64 = 120;
    let program = assert_cmd::cargo::cargo_bin!("percuss-read");
    let script =
        format!("ulimit -v {ADDRESSES_KIB}; exec timeout -s KILL {LONGEST} \"$0\" --max-memory 64MiB \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &script])
        .arg(program)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("a shell");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    // that of a shell whose child was killed
    let status = output.status.code().filter(|status| *status < 128);
    (status, text(&output.stdout), text(&output.stderr))
}

/// A record with a forged length, or not.
pub fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![opcode];
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

pub fn text(text: &[u8]) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text].concat()
}

/// Records behind a header; the file ends with the last of them.
pub fn file(records: &[Vec<u8>]) -> Vec<u8> {
    let header = record(0x01, &[text(b""), text(b"test")].concat());
    [mcap::MAGIC, &header, &records.concat()].concat()
}

/// Records behind a header, and a summary, up to the magic bytes at the end; without checksums.
pub fn whole(records: &[Vec<u8>], summary: &[u8]) -> Vec<u8> {
    let mut bytes = file(records);
    bytes.extend(record(0x0f, &[0; 4]));
    let start = if summary.is_empty() { 0 } else { bytes.len() as u64 };
    bytes.extend(summary);
    bytes.extend(record(0x02, &[&start.to_le_bytes()[..], &[0; 8 + 4]].concat()));
    bytes.extend(mcap::MAGIC);
    bytes
}

pub fn map(entries: &[(&str, &str)]) -> Vec<u8> {
    entries.iter().flat_map(|(key, value)| [text(key.as_bytes()), text(value.as_bytes())].concat()).collect()
}

pub fn channel(id: u16, schema: u16, topic: &str, metadata: &[u8]) -> Vec<u8> {
    let head = [&id.to_le_bytes()[..], &schema.to_le_bytes()].concat();
    record(0x04, &[head, text(topic.as_bytes()), text(b"protobuf"), text(metadata)].concat())
}

pub fn schema(id: u16, name: &str, data: &[u8]) -> Vec<u8> {
    record(0x03, &[id.to_le_bytes().to_vec(), text(name.as_bytes()), text(b"protobuf"), text(data)].concat())
}

pub fn message(channel: u16, data: &[u8]) -> Vec<u8> {
    message_at(channel, 0, data)
}

/// * `time`: log time \[ns\]
pub fn message_at(channel: u16, time: u64, data: &[u8]) -> Vec<u8> {
    let times = [time.to_le_bytes(), time.to_le_bytes()].concat();
    record(0x05, &[&channel.to_le_bytes()[..], &[0; 4], &times, data].concat())
}

pub fn metadata(name: &str, entries: &[(&str, &str)]) -> Vec<u8> {
    record(0x0c, &[text(name.as_bytes()), text(&map(entries))].concat())
}

pub fn chunk(unpacked: u64, compression: &[u8], data: &[u8]) -> Vec<u8> {
    let head = [&[0; 16][..], &unpacked.to_le_bytes(), &0u32.to_le_bytes()].concat();
    record(
        0x06,
        &[head, text(compression), (data.len() as u64).to_le_bytes().to_vec(), data.to_vec()].concat(),
    )
}

/// Records in a chunk that is packed as tightly as can be.
pub fn packed(records: &[Vec<u8>]) -> Vec<u8> {
    let records = records.concat();
    chunk(records.len() as u64, b"zstd", &zstd::bulk::compress(&records, 3).expect("packed bytes"))
}

pub fn varint(mut value: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field of a protobuf message that has a length.
pub fn block(number: usize, content: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(content.len()), content.to_vec()].concat()
}
