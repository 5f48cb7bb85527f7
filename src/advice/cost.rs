//! Estimates of a run: memory, bytes, time. They follow from the sizes of the case; nothing is computed.
//!
//! ```text
//! time       node updates inside the light cone of the contact over their rate on all cores, and bytes of messages over theirs
//! messages   what each channel says of its own
//! recording  messages over their usual compression
//! ```
//!
//! Time depends on the machine and on what else it does, compression on the waves. A run that its stop condition ends earlier takes
//! less of both.

use crate::{
    case::Case,
    channels::Catalogue,
    model::{GAUGES_UNDER_WAY, GaugePlan, scheme::Order},
    recording::Compression,
};

/// Node updates per second and core: full theory, simplified theory of order 2 and 4. Measured on an AMD EPYC (Zen 4): runs of 0.1 to 24 s
/// of all kinds took 0.7 to 1.6 times the estimate.
const ELASTIC_RATE: f64 = 2.5e8;
const SECOND_RATE: f64 = 2e9;
const FOURTH_RATE: f64 = 1e9;
/// The same of the full theory on a graded mesh, which one core computes.
const GRADED_RATE: f64 = 2e8;
/// Time of a step beside its nodes \[s\].
const STEP_TIME: f64 = 1e-5;
/// Rate at which messages are compressed and written, beside the computing threads \[bytes/s\].
const WRITING_RATE: f64 = 3e8;

/// Usual ratio of a compressed recording to its messages: 0.13 to 0.5 in the built-in cases with frames.
const COMPRESSED: f64 = 0.3;
/// The same, at least: a recording that is even so larger than the disk is refused.
const LEAST_COMPRESSED: f64 = 0.1;

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
        let messages = Catalogue::new(case).estimated_size(case);
        let file = compressed(case, messages, COMPRESSED);
        let threads = rayon::current_num_threads() as f64;
        let rate = match case.mesh.order {
            _ if !case.is_tiled() => GRADED_RATE,
            None => ELASTIC_RATE * threads,
            Some(Order::Second) => SECOND_RATE * threads,
            Some(Order::Fourth) => FOURTH_RATE * threads,
        };
        let computing = case.node_updates() / rate;
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
    compressed(case, Catalogue::new(case).estimated_size(case), LEAST_COMPRESSED)
}

fn compressed(case: &Case, messages: u64, ratio: f64) -> u64 {
    if case.record.compression == Compression::None { messages } else { (ratio * messages as f64) as u64 }
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
        let settings = ["record.points=[[0.0, 0.5]]", "record.lines=[{ r = 0.0 }]"];
        for name in ["fig5", "fig8-m5"] {
            let [with, without] = [&settings[..], &[]].map(|settings| Case::sound(name, settings));
            assert!(gauge_memory(&with) > 0 && gauge_memory(&without) == 0);
            assert!(least_bytes(&with) > least_bytes(&without));
        }
    }
}
