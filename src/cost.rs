//! Estimates of a run: memory, bytes, time. They follow from the sizes of the case; nothing is computed.
//!
//! ```text
//! time       node updates inside the light cone of the contact over their rate on all cores, and bytes of messages over theirs
//! messages   what each channel has for a step, a column, a node or a pixel
//! recording  messages over their usual compression
//! ```
//!
//! Time depends on the machine and on what else it does, compression on the waves. A run that its stop condition ends earlier takes
//! less of both.

use crate::{
    case::{Case, ViewChannel},
    channels::view::Viewport,
    model::{GAUGES_UNDER_WAY, GaugePlan, ModelKind, scheme::Order},
    recording::{Compression, MESSAGE_HEADER},
};

/// Node updates per second and core: full theory, simplified theory of order 2 and 4. Measured on an AMD EPYC (Zen 4): runs of 0.1 to 24 s
/// of all kinds took 0.7 to 1.6 times the estimate.
const ELASTIC_RATE: f64 = 2.5e8;
const SECOND_RATE: f64 = 2e9;
const FOURTH_RATE: f64 = 1e9;
/// Time of a step beside its nodes \[s\].
const STEP_TIME: f64 = 1e-5;
/// Rate at which messages are compressed and written, beside the computing threads \[bytes/s\].
const WRITING_RATE: f64 = 3e8;

/// Usual ratio of a compressed recording to its messages: 0.13 to 0.5 in the built-in cases with frames.
const COMPRESSED: f64 = 0.3;
/// The same, at least: a recording that is even so larger than the disk is refused.
const LEAST_COMPRESSED: f64 = 0.1;

/// Bytes that a message takes beside its payload: record header and index entry.
const MESSAGE_OVERHEAD: u64 = MESSAGE_HEADER + 16;
/// Payload of numbers that a message begins with, and that the messages of drag and velocity have \[bytes\].
const HEAD: u64 = 36;
/// Size of an image beside its section, of which a pixel takes 0.75 bytes \[bytes\].
const IMAGE: u64 = 6 << 10;
/// Payload of a scene, of fronts, of a transform and of a profile \[bytes\].
const SCENE: u64 = 6 << 10;
const FRONTS: u64 = 4 << 10;
const TRANSFORM: u64 = 128;
const PROFILE: u64 = 6 << 10;

/// Estimated number of frames in memory if they are computed faster than written: sampled, and in the queue of the recorder.
const FRAMES_IN_MEMORY: u64 = 9;

/// Estimate of a run.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Memory for the field and for frames on their way to the file \[bytes\].
    pub memory: u64,
    /// Size of all messages before compression \[bytes\].
    pub messages: u64,
    /// Size of the recording \[bytes\].
    pub file: u64,
    /// Time of the run on all cores \[s\].
    pub seconds: f64,
}

impl Estimate {
    /// Estimates a run of `case`.
    pub fn new(case: &Case) -> Self {
        let frames = case.frames().count().min(FRAMES_IN_MEMORY);
        let frame = if frames > 0 { case.frame_size() as u64 } else { 0 };
        let memory = case.field_memory() + frames * frame + gauge_memory(case);
        let messages = messages(case);
        let file = compressed(case, messages, COMPRESSED);
        let rate = match (case.model, case.mesh.order) {
            (ModelKind::Elastic, _) => ELASTIC_RATE,
            (ModelKind::Rakhmatulin, Some(Order::Fourth)) => FOURTH_RATE,
            (ModelKind::Rakhmatulin, _) => SECOND_RATE,
        };
        let computing = case.node_updates() / (rate * rayon::current_num_threads() as f64);
        let seconds = computing + case.sizes.steps as f64 * STEP_TIME + messages as f64 / WRITING_RATE;
        Self { memory, messages, file, seconds }
    }
}

/// Estimated size of the recording of a case whose fields show the whole mesh; `None` if those of the case do \[bytes\].
#[cfg(feature = "cli")]
pub(crate) fn whole_file(case: &Case) -> Option<u64> {
    let is_narrower = case.shown_radius().is_some();
    let whole = is_narrower.then(|| case.vary().set("record.r_max", f64::INFINITY).build().ok()).flatten();
    whole.map(|whole| Estimate::new(&whole).file)
}

/// Size that the recording of a case has at least, if its stop condition does not end it earlier \[bytes\].
pub fn least_bytes(case: &Case) -> u64 {
    compressed(case, messages(case), LEAST_COMPRESSED)
}

fn compressed(case: &Case, messages: u64, ratio: f64) -> u64 {
    if case.record.compression == Compression::None { messages } else { (ratio * messages as f64) as u64 }
}

/// Size of all messages before compression \[bytes\].
fn messages(case: &Case) -> u64 {
    let (sizes, record) = (&case.sizes, &case.record);
    let message = |payload: u64| MESSAGE_OVERHEAD + payload;
    let steps = sizes.steps + 1;
    let probes = 8 * record.probes.len() as u64;
    let points = if record.points.is_empty() { 0 } else { message(HEAD + 24 * record.points.len() as u64) };
    let step = 2 * message(HEAD) + message(HEAD + probes) + points;
    let columns = case.column(sizes.contact_reach) as u64;
    let gauges = case.gauges();
    // a sweep estimates each of its cases: the mesh is not made for nothing
    let along = if gauges.is_empty() { 0 } else { GaugePlan::new(&gauges, &case.grid()).size() as u64 };
    let interface = message(HEAD + 8 * columns) + gauges.lines.len() as u64 * message(HEAD) + along;
    let frames = match case.frames().count() {
        0 => 0,
        frames => frames * frame_messages(case),
    };
    steps * step + (sizes.steps.div_ceil(record.interface_every) + 1) * interface + frames
}

/// Size of the messages of a frame before compression \[bytes\].
fn frame_messages(case: &Case) -> u64 {
    let record = &case.record;
    let message = |payload: u64| MESSAGE_OVERHEAD + payload;
    let viewport = Viewport::new(case);
    let pixels = 2 * (viewport.columns * viewport.rows) as u64;
    let fields = record.fields.len() as u64;
    let view = |view: &ViewChannel| {
        message(match view {
            // a byte for each field, four for the colour
            ViewChannel::Field => pixels * (fields + 4) * fields.min(1),
            ViewChannel::Image => (IMAGE + pixels * 3 / 4) * fields.min(1),
            ViewChannel::Scene => SCENE,
            ViewChannel::Fronts => FRONTS,
            ViewChannel::Tf => TRANSFORM,
            ViewChannel::Profile => PROFILE,
        })
    };
    message(2 * HEAD)
        + fields * message(2 * HEAD)
        + case.frame_size() as u64
        + record.views.iter().map(view).sum::<u64>()
}

/// Memory of points and lines of steps that are under way, at most \[bytes\].
fn gauge_memory(case: &Case) -> u64 {
    let gauges = case.gauges();
    if gauges.is_empty() {
        return 0;
    }
    let each = GaugePlan::new(&gauges, &case.grid()).size() as u64;
    // the bound holds for the steps that wait; one more is being computed
    (each * (case.sizes.steps + 1)).min((GAUGES_UNDER_WAY as u64).max(2 * each) + each)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauges_take_memory() {
        let settings = ["record.points=[[0.0, 0.5]]", "record.lines=[{ r = 0.0 }]"].map(String::from);
        for name in ["fig5", "fig8-m5"] {
            let [with, without] =
                [&settings[..], &[]].map(|settings| Case::load(name, settings).expect("a built-in case"));
            assert!(gauge_memory(&with) > 0 && gauge_memory(&without) == 0);
            assert!(messages(&with) > messages(&without));
        }
    }
}
