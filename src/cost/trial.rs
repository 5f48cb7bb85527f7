//! A trial: a recording of a case on one mesh, and the laws by which it is scaled to another.

use std::{collections::BTreeMap, time::Instant};

use mcap::{Channel, McapResult, MessageStream, Summary, records::MessageHeader, write::NoSeek};

use super::{RunEstimate, interface_messages, run, until};
use crate::{
    case::Case,
    channels::view::{self, Viewport},
    model::CORNER_MARGIN,
    recording::{CHUNK_TARGET, Compression, Destination, MESSAGE_HEADER, Synchronise, writer::write_options},
    session::{Recording, Source},
    validity::Validity,
};

/// Bytes a message takes beside its payload: record header and index entry.
const MESSAGE_OVERHEAD: f64 = MESSAGE_HEADER as f64 + 16.0;

/// What the size of a channel grows with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Law {
    /// Nothing: it is recorded once.
    Once,
    /// A message every step.
    Steps,
    /// A number for every column under the indenter or every node along a line, every `interface_every` steps.
    Columns,
    /// A message every frame.
    Frames,
    /// A number for every shown node, every frame.
    Nodes,
    /// A byte for every pixel of a picture, every frame.
    Pixels,
}

impl Law {
    /// The law of a topic; an unknown one has a message every step.
    fn of(topic: &str) -> Self {
        match topic {
            "/event" | "/log" => Self::Once,
            "/energy" => Self::Frames,
            "/interface/stress" => Self::Columns,
            "/view/field" | "/view/image" => Self::Pixels,
            _ if topic.starts_with("/line/") => Self::Columns,
            _ if topic.starts_with("/field/") => Self::Nodes,
            _ if topic.starts_with(view::TOPICS) => Self::Frames,
            _ => Self::Steps,
        }
    }

    /// How many times the number of messages and the length of each grow from one mesh to another.
    fn growth(self, from: &Case, to: &Case) -> [f64; 2] {
        let ratio = |amount: fn(&Case) -> f64| amount(to) / amount(from);
        let steps = ratio(|case| case.sizes.steps as f64 + 1.0);
        // a case without frames has none on any mesh
        let frames = ratio(|case| case.frames().count().max(1) as f64);
        match self {
            Self::Once => [1.0, 1.0],
            Self::Steps => [steps, 1.0],
            Self::Columns => {
                [ratio(|case| interface_messages(case) as f64), ratio(|case| 1.0 / case.sizes.dr)]
            }
            Self::Frames => [frames, 1.0],
            Self::Nodes => [frames, ratio(|case| case.frame_size() as f64)],
            Self::Pixels => [frames, ratio(pixels)],
        }
    }

    /// Ratio of compressed to plain size of the messages of one mesh, relative to that of another. What remains of a picture lies along
    /// lines, whose length grows as the root of the number of pixels; of a field, the numbers that are not 0, of which the precursor of waves is a smaller part on a finer mesh.
    fn compression_growth(self, from: &Case, to: &Case) -> f64 {
        match self {
            Self::Pixels => (pixels(from) / pixels(to)).sqrt(),
            Self::Nodes => precursor_factor(to) / precursor_factor(from),
            _ => 1.0,
        }
    }
}

/// Ratio of the nonzero numbers of a field, in all frames together, to those inside the light cone.
fn precursor_factor(case: &Case) -> f64 {
    if case.corner().is_none() {
        return 1.0;
    }
    let every = case.record.field_every;
    let inside = case.estimated_nodes(every, |_| 0.0);
    // the outer half of the margin is too small to be seen in single precision
    let ahead = |step: f64| step.min(0.5 * CORNER_MARGIN as f64);
    case.estimated_nodes(every, ahead).max(1.0) / inside.max(1.0)
}

fn pixels(case: &Case) -> f64 {
    let stage = Viewport::new(case);
    (stage.columns * stage.rows) as f64
}

/// A recording of a case on one mesh.
pub(super) struct Trial {
    pub(super) case: Case,
    /// Time that frames and recording add to that of computing \[s\].
    pub(super) recording: f64,
    /// Part of the run after which its stop condition holds; 1 if it never does.
    part: f64,
    /// Largest stress, strain and drag.
    validity: Validity,
    /// The recording.
    pub(super) file: Vec<u8>,
    /// Number and payload of the messages of every law \[bytes\].
    messages: BTreeMap<Law, [f64; 2]>,
}

impl Trial {
    /// Records a case. `None` if the run fails or is not done by `deadline`.
    ///
    /// * `computing`: time of computing it without its frames \[s\]
    pub(super) fn of(case: &Case, computing: f64, deadline: Instant) -> Option<Self> {
        let folder = tempfile::tempdir().ok()?;
        let path = folder.path().join("trial.mcap");
        let start = Instant::now();
        let destination = Destination { synchronise: Synchronise::Never, ..Destination::new(&path) };
        let mut recording = Recording::create(&destination, case, Source::Simulation).ok()?;
        let outcome = run(case, &mut [&mut recording, &mut until(deadline)])?;
        let recording = (start.elapsed().as_secs_f64() - computing).max(0.0);
        let part = outcome.last_step as f64 / case.sizes.steps as f64;
        let file = std::fs::read(&path).ok()?;
        let messages = messages_of(&file).ok()?;
        Some(Self { case: case.clone(), recording, part, validity: outcome.validity, file, messages })
    }

    /// Size of all messages of a run before compression \[bytes\].
    pub(super) fn message_bytes(&self, case: &Case) -> f64 {
        self.messages.keys().map(|law| self.bytes_of(*law, case)).sum()
    }

    /// Size of the messages of one law before compression \[bytes\].
    fn bytes_of(&self, law: Law, case: &Case) -> f64 {
        let [number, payload] = self.messages[&law];
        let [messages, length] = law.growth(&self.case, case);
        messages * (number * MESSAGE_OVERHEAD + payload * length)
    }

    /// Scales the trial to a run of `case`.
    ///
    /// * `seconds`: its estimated time \[s\]
    pub(super) fn estimate(&self, case: &Case, seconds: f64) -> McapResult<RunEstimate> {
        let summary = Summary::read(&self.file)?.unwrap_or_default();
        let in_chunks: u64 =
            summary.chunk_indexes.iter().map(|chunk| chunk.chunk_length + chunk.message_index_length).sum();
        // schemas, attachments, metadata
        let beside = self.file.len() as f64 - in_chunks as f64;
        let (mut here, mut there) = (0.0, 0.0);
        for law in self.messages.keys() {
            let size = compressed(&self.file, *law, self.case.record.compression)?;
            let growth = self.bytes_of(*law, case) / self.bytes_of(*law, &self.case);
            here += size;
            there += size * growth * law.compression_growth(&self.case, case);
        }
        // together messages compress a little better than law by law
        let together = if here > 0.0 { in_chunks as f64 / here } else { 1.0 };
        let end = case.sizes.steps as f64 * case.sizes.dt;
        Ok(RunEstimate {
            messages: self.message_bytes(case) as u64,
            file: (beside + together * there).round() as u64,
            seconds,
            stops_at: (self.part < 1.0).then_some(self.part * end),
            trial_cells: self.case.mesh.cells,
            validity: self.validity,
        })
    }
}

/// Number and payload of the messages of every law in a recording \[bytes\].
fn messages_of(file: &[u8]) -> McapResult<BTreeMap<Law, [f64; 2]>> {
    let mut messages = BTreeMap::new();
    for message in MessageStream::new(file)? {
        let message = message?;
        let [number, payload] = messages.entry(Law::of(&message.channel.topic)).or_insert([0.0; 2]);
        *number += 1.0;
        *payload += message.data.len() as f64;
    }
    Ok(messages)
}

/// Size of the messages of one law in chunks of their own \[bytes\].
fn compressed(file: &[u8], law: Law, compression: Compression) -> McapResult<f64> {
    let options = write_options(compression).chunk_size(Some(CHUNK_TARGET)).emit_summary_records(false);
    let mut writer = options.create(NoSeek::new(Vec::new()))?;
    for message in MessageStream::new(file)? {
        let message = message?;
        let Channel { id, topic, .. } = message.channel.as_ref();
        if Law::of(topic) == law {
            writer.add_channel_with_id(*id, 0, topic, "", &BTreeMap::new())?;
            let header = MessageHeader {
                channel_id: *id,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer.write_to_known_channel(&header, &message.data)?;
        }
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner().len() as f64)
}
