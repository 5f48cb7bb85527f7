//! `cat`: whole messages as JSON lines, also of a recording that is still being written.

use std::{
    io::{self, Write},
    path::Path,
    thread,
};

use clap::Args;
use prost_reflect::{MessageDescriptor, SerializeOptions};
use serde_json::value::RawValue;

use crate::{
    channel::Channel,
    messages::{Message, POLL, Recording},
    recording::{Damage, Limits, OpenError},
    select::{self, Pattern, Window},
    wire::dynamic,
};

/// What to show.
#[derive(Args, Clone, Debug, Default)]
pub struct Request {
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    pub topics: Vec<Pattern>,
    /// Times, of the field `time`, or of the log time in seconds from the start of the recording, and every n-th message of each topic.
    #[command(flatten)]
    pub window: Window,
    /// Keep reading a recording that is still being written, until it is finished
    #[arg(long)]
    pub follow: bool,
}

/// Why messages cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum CatError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
}

/// Writes one JSON object per message: topic, log time, sequence, and the message, in the JSON mapping of protobuf
/// where it is that.
/// Messages that cannot be decoded, or unpack to more than there is memory for, come as the number of their bytes.
///
/// # Errors
///
/// The file cannot be read or the output not written.
pub fn cat(
    path: &Path,
    request: &Request,
    limits: Limits,
    output: &mut dyn Write,
) -> Result<Vec<Damage>, CatError> {
    let mut recording = Recording::open(path, limits)?;
    // of a file that is being written, topics may still be to come
    while request.follow
        && (recording.channels.is_empty() || select::channels(&recording, &request.topics).is_err())
    {
        thread::sleep(POLL);
        recording = Recording::open(path, limits)?;
    }
    let (from, to) = request.window.numbers();
    let window = recording.log_window(from, to);
    let mut messages = recording.messages(select::channels(&recording, &request.topics)?, window)?;
    if request.follow {
        messages.follow();
    }
    let mut seen = std::collections::HashMap::<u16, u64>::new();
    let mut text = Text { bytes: Vec::new(), room: limits.kept() };
    loop {
        messages.for_each(|message| {
            let channel = &recording.channels[&message.channel];
            if !request.window.holds_instant(channel.instant(message.data, message.log_time, channel.origin))
            {
                return Ok(());
            }
            let count = seen.entry(message.channel).or_default();
            *count += 1;
            if request.window.leaves_out(*count - 1) {
                return Ok(());
            }
            line(channel, &message, limits, &mut text, output).map_err(CatError::Output)
        })?;
        output.flush()?;
        if messages.is_over() {
            return Ok(messages.damages().to_vec());
        }
        thread::sleep(POLL);
    }
}

/// Text that does not grow beyond what there is room for: of an empty message all fields are written, with their names.
struct Text {
    bytes: Vec<u8>,
    room: usize,
}

impl Write for Text {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.len() + bytes.len() > self.room {
            return Err(io::ErrorKind::OutOfMemory.into());
        }
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes a message on a line.
fn line(
    channel: &Channel,
    message: &Message<'_>,
    limits: Limits,
    text: &mut Text,
    output: &mut dyn Write,
) -> io::Result<()> {
    /// Memory for text that is kept for the next message \[bytes\].
    const KEPT: usize = 1 << 20;
    text.bytes.clear();
    text.bytes.shrink_to(KEPT);
    let is_decoded = match &channel.layout {
        _ if channel.encoding == "json" => put_json(message.data, text).is_some(),
        Some(layout) => put(layout.descriptor(), message.data, limits, text).is_some(),
        None => false,
    };
    write!(output, "{{\"log_time\":{},\"message\":", message.log_time)?;
    if is_decoded {
        output.write_all(&text.bytes)?;
    } else {
        write!(output, "{{\"bytes\":{}}}", message.data.len())?;
    }
    write!(output, ",\"sequence\":{},\"topic\":", message.sequence)?;
    serde_json::to_writer(&mut *output, &channel.topic)?;
    output.write_all(b"}\n")
}

/// Writes a message that is JSON, on one line; `None` if it is not sound.
fn put_json(bytes: &[u8], text: &mut Text) -> Option<()> {
    let value: &RawValue = serde_json::from_slice(bytes).ok()?;
    // inside texts, JSON has no line breaks
    let line = value.get().split(['\n', '\r']).map(str::as_bytes);
    line.into_iter().try_for_each(|part| text.write_all(part)).ok()
}

/// Writes a message in the JSON mapping of protobuf; `None` if it cannot be decoded, or not written.
fn put(descriptor: &MessageDescriptor, bytes: &[u8], limits: Limits, text: &mut Text) -> Option<()> {
    let options = SerializeOptions::new().use_proto_field_name(true).skip_default_fields(false);
    let message = dynamic(descriptor, bytes, limits.values()).ok()?;
    message.serialize_with_options(&mut serde_json::Serializer::new(text), &options).ok()
}
