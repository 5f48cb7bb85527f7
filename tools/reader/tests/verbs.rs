//! What is not told by a table of commands: a recording that grows while it is followed, an address that is taken.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    process::Stdio,
    sync::mpsc,
    thread,
    time::Duration,
};

use crate::{
    desk::Desk,
    forge::{forge, plain},
};

/// Number of messages on `/scalar` in the chunks that end before a place in a recording.
fn scalars_in_whole_chunks(bytes: &[u8], end: usize) -> usize {
    let summary = mcap::Summary::read(bytes).expect("a sound file").expect("a summary");
    let is_whole =
        |chunk: &&mcap::records::ChunkIndex| (chunk.chunk_start_offset + chunk.chunk_length) as usize <= end;
    let scalars = |chunk| {
        let messages = summary.stream_chunk(bytes, chunk).expect("a chunk");
        messages.filter(|message| message.as_ref().expect("a message").channel.topic == "/scalar").count()
    };
    summary.chunk_indexes.iter().filter(is_whole).map(scalars).sum()
}

#[test]
fn a_verdict_does_not_depend_on_who_reads_it() {
    let [a, b] = [1, 2].map(|seed| forge(20, seed).write(plain()));
    let cut = a[..a.len() / 2].to_vec();
    let desk = Desk::new(&[("a.mcap", a), ("b.mcap", b), ("cut.mcap", cut)]);
    let commands: [&[&str]; 2] =
        [&["diff", "a.mcap", "b.mcap", "--junit", "report.xml"], &["verify", "cut.mcap", "a.mcap"]];
    for arguments in commands {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let status = desk.command(arguments).stdout(writer).status().expect("the program starts");
        assert_eq!(status.code(), Some(1), "{arguments:?}");
    }
    assert!(desk.path("report.xml").exists());
}

#[test]
fn a_recording_is_followed_while_it_is_written() {
    /// Longest wait for lines that are due.
    const PATIENCE: Duration = Duration::from_secs(60);
    let desk = Desk::new(&[]);
    let bytes = forge(400, 1).write(plain());
    let growing = desk.path("growing.mcap");
    // inside of chunks, between them and inside of the summary
    let parts: Vec<&[u8]> = bytes.chunks(bytes.len().div_ceil(9)).collect();
    for (verb, head) in [("cat", 0), ("trace", 1)] {
        fs::write(&growing, parts[0]).expect("a file");
        let arguments = [verb, "growing.mcap", "--topic", "/scalar", "--follow"];
        let mut child = desk
            .command(&arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let (line, lines) = mpsc::channel();
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let reader = thread::spawn(move || output.lines().try_for_each(|text| line.send(text)));
        let mut seen = 0;
        for (i, part) in parts.iter().enumerate() {
            if i > 0 {
                let mut file = fs::OpenOptions::new().append(true).open(&growing).expect("the file");
                file.write_all(part).expect("a part");
            }
            // what is whole by now is shown while the rest is still to come
            let whole = scalars_in_whole_chunks(&bytes, (i + 1) * parts[0].len());
            while whole > 0 && seen < head + whole {
                lines.recv_timeout(PATIENCE).expect("a line is due").expect("text");
                seen += 1;
            }
        }
        reader.join().expect("it reads").expect("the test listens");
        seen += lines.iter().count();
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(seen, head + 400, "{verb}");
    }
}

#[test]
fn an_address_that_is_taken_is_named() {
    let desk = Desk::new(&[("a.mcap", forge(60, 1).write(plain()))]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    assert!(desk.error(1, &["replay", "a.mcap", "--addr", &address]).contains(&address));
}
