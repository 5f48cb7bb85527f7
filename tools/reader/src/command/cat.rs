//! `cat`: whole messages as JSON lines, also of a recording that is still being written.

use std::{
    collections::HashMap,
    io::{self, BufWriter, Write},
    path::PathBuf,
    thread,
};

use clap::Args;
use prost_reflect::MessageDescriptor;
use serde_json::value::RawValue;

use crate::{
    channel::Channel,
    failure::Failure,
    format::mapping::Mapped,
    messages::{Kept, Message, POLL, Recording},
    recording::{Damage, Limits},
    select::{self, Bound, Pattern, Window, finite_time},
    slice::kept_at,
    verb::{Exit, Verb, loss},
    wire::dynamic,
};

const CAT_EXAMPLES: &str = "\
Examples:
  percuss-read cat fig5.mcap --topic '/event,/log'
  percuss-read cat fig5.mcap --topic /drag --from 1 --to 1.1
  percuss-read cat running.mcap.part --topic /drag --every 100 --follow";

/// Whole messages as JSON lines, also of a recording that is still being written
#[derive(Debug, Args)]
#[command(after_help = CAT_EXAMPLES)]
pub struct Cat {
    /// Recording
    pub(crate) file: PathBuf,
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<Pattern>,
    /// Times, of the field `time`, or of the log time in seconds from the start of the recording, and every n-th message of each topic; where that
    /// leaves out the last one, it comes at the end.
    #[command(flatten)]
    window: Window,
    /// Times: of every topic the messages nearest to them, in the unit that is recorded or with one, 87us
    #[arg(long = "at-time", value_name = "T", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite_time)]
    #[arg(conflicts_with_all = ["from", "to", "every", "follow"])]
    at_times: Vec<Bound>,
    /// Keep reading a recording that is still being written, until it is finished
    #[arg(long)]
    follow: bool,
}

impl Verb for Cat {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let mut output = BufWriter::new(io::stdout());
        let damages = self.write(limits, &mut output).map_err(|failure| failure.at(None))?;
        output.flush().map_err(|error| Failure::from(error).at(None))?;
        Ok(loss(&self.file, &damages))
    }
}

impl Cat {
    /// Writes one JSON object per message: topic, log time, sequence, and the message, in the JSON mapping of protobuf
    /// where it is that.
    /// Messages that cannot be decoded, or unpack to more than there is memory for, come as the number of their bytes.
    fn write(&self, limits: Limits, output: &mut dyn Write) -> Result<Vec<Damage>, Failure> {
        let mut recording = Recording::open(&self.file, limits)?;
        // of a file that is being written, topics may still be to come
        while self.follow
            && (recording.channels.is_empty() || select::channels(&recording, &self.topics).is_err())
        {
            thread::sleep(POLL);
            recording = Recording::open(&self.file, limits)?;
        }
        let ids = select::channels(&recording, &self.topics)?;
        ids.iter().try_for_each(|id| self.window.check(&recording.channels[id]))?;
        let mut text = Text { bytes: Vec::new(), room: limits.kept() };
        let mut line = |message: &Message<'_>, output: &mut dyn Write| {
            line(&recording.channels[&message.channel], message, limits, &mut text, output)
        };
        if !self.at_times.is_empty() {
            let (kept, damages) = kept_at(&recording, &ids, &self.at_times)?;
            kept.iter().try_for_each(|kept| line(&kept.message(), output))?;
            return Ok(damages);
        }
        let window = self.window.log_times_of(&recording, ids.iter().copied());
        let mut messages = recording.messages(ids, window)?;
        if self.follow {
            messages.follow();
        }
        let (mut seen, mut left_out) = (HashMap::<u16, u64>::new(), LeftOut::default());
        loop {
            messages.for_each(|next| {
                let message = next.message;
                if !self.window.holds(next.instant()) {
                    return Ok(());
                }
                let count = seen.entry(message.channel).or_default();
                *count += 1;
                if self.window.leaves_out(*count - 1) {
                    return Ok(left_out.keep(&message, limits.kept())?);
                }
                left_out.forget(message.channel);
                Ok(line(&message, output)?)
            })?;
            output.flush()?;
            if messages.is_over() {
                left_out.in_order().try_for_each(|message| line(&message, output))?;
                return Ok(messages.seen().damages);
            }
            thread::sleep(POLL);
        }
    }
}

/// The newest message of every channel of which it was left out.
#[derive(Default)]
struct LeftOut {
    /// By channel, each with its number among all that were kept.
    newest: HashMap<u16, (u64, Kept)>,
    kept: u64,
    bytes: usize,
}

impl LeftOut {
    /// Keeps a message in place of the one before.
    ///
    /// * `room`: for the contents of all of them \[bytes\]
    fn keep(&mut self, message: &Message<'_>, room: usize) -> io::Result<()> {
        let (number, newest) = self.newest.entry(message.channel).or_default();
        self.bytes = self.bytes - newest.data.len() + message.data.len();
        if self.bytes > room {
            let text = "the last messages of so many topics take more memory than --max-memory allows; choose topics";
            return Err(io::Error::new(io::ErrorKind::OutOfMemory, text));
        }
        self.kept += 1;
        *number = self.kept;
        *newest = message.into();
        Ok(())
    }

    /// A later message of the channel was not left out.
    fn forget(&mut self, channel: u16) {
        self.bytes -= self.newest.remove(&channel).map_or(0, |(_, kept)| kept.data.len());
    }

    fn in_order(&self) -> impl Iterator<Item = Message<'_>> {
        let mut newest: Vec<_> = self.newest.values().collect();
        newest.sort_by_key(|(number, _)| *number);
        newest.into_iter().map(|(_, kept)| kept.message())
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
    let message = dynamic(descriptor, bytes, limits.values()).ok()?;
    serde_json::to_writer(text, &Mapped::new(&message, limits.values())).ok()
}
