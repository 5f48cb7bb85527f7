//! `cat`: whole messages as JSON lines, also of a recording that is still being written.

use std::{
    io::{self, Write},
    path::Path,
    thread,
};

use prost_reflect::{DynamicMessage, SerializeOptions};
use serde_json::{Value, json};

use crate::{
    messages::{Message, POLL, Recording},
    overview::Channel,
    recording::{Damage, Limits, Next, OpenError},
    select::{self, Pattern, UnknownTopic},
};

/// What to show.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Topics; all if empty.
    pub topics: Vec<Pattern>,
    /// First time, of the field `time` or the log time in seconds.
    pub from: Option<f64>,
    /// Last time.
    pub to: Option<f64>,
    /// Every n-th message of each topic; 1 for all.
    pub every: u64,
    /// Keeps reading a file that is being written.
    pub follow: bool,
}

/// Why messages cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum CatError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such topic.
    #[error(transparent)]
    UnknownTopic(#[from] UnknownTopic),
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
}

/// Writes one JSON object per message: topic, log time, sequence, and the message in the JSON mapping of protobuf.
/// Messages that cannot be decoded come as the number of their bytes.
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
    let ids = |recording: &Recording| -> Result<Vec<u16>, UnknownTopic> {
        match request.topics.as_slice() {
            [] => Ok(recording.channels.keys().copied().collect()),
            topics => select::channels(recording, topics),
        }
    };
    // of a file that is being written, topics may still be to come
    while request.follow && (recording.channels.is_empty() || ids(&recording).is_err()) {
        thread::sleep(POLL);
        recording = Recording::open(path, limits)?;
    }
    let window = recording.log_window(request.from, request.to);
    let mut messages = recording.messages(ids(&recording)?, window)?;
    if request.follow {
        messages.follow();
    }
    let mut seen = std::collections::HashMap::<u16, u64>::new();
    loop {
        let next = messages.next(|message| {
            let channel = &recording.channels[&message.channel];
            let time = channel.time_of(message.data, message.log_time);
            if request.from.is_some_and(|from| time < from) || request.to.is_some_and(|to| time > to) {
                return Ok(());
            }
            let count = seen.entry(message.channel).or_default();
            *count += 1;
            if !(*count - 1).is_multiple_of(request.every.max(1)) {
                return Ok(());
            }
            serde_json::to_writer(&mut *output, &line(channel, &message))?;
            output.write_all(b"\n")
        })?;
        match next {
            Next::Record(result) => result?,
            Next::Pending => {
                output.flush()?;
                thread::sleep(POLL);
            }
            Next::End => break,
        }
    }
    output.flush()?;
    Ok(messages.damages().to_vec())
}

fn line(channel: &Channel, message: &Message<'_>) -> Value {
    let options = SerializeOptions::new().use_proto_field_name(true).skip_default_fields(false);
    let decoded = channel.layout.as_ref().and_then(|layout| {
        let message = DynamicMessage::decode(layout.descriptor().clone(), message.data).ok()?;
        message.serialize_with_options(serde_json::value::Serializer, &options).ok()
    });
    json!({
        "topic": channel.topic,
        "log_time": message.log_time,
        "sequence": message.sequence,
        "message": decoded.unwrap_or_else(|| json!({ "bytes": message.data.len() })),
    })
}
