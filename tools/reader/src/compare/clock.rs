//! The clocks that messages are timed by: one for both recordings, or each recording from its own start.
//!
//! A message is timed by its field `time`, else by its log time. Wall clocks of two recordings have no time in common,
//! and the difference of their starts says nothing: then times count from the first message of each recording on that
//! clock. All channels of a recording on a clock share the start, so one that is late against the others stays late.

use super::{options::Options, structure::Pair};
use crate::{
    channel::Channel, convention, failure::Failure, instant::Instant, messages::Recording, scales::Scales,
};

/// When a message is, from the start if there is one. Log times stay whole numbers.
pub(super) fn time(channel: &Channel, start: Option<Instant>, bytes: &[u8], log_time: u64) -> Instant {
    let time = channel.instant(bytes, log_time, 0);
    match (time, start) {
        (_, None) => time,
        (Instant::Log(time), Some(Instant::Log(start))) => Instant::Log(time - start),
        (time, Some(start)) => Instant::Number(time.number() - start.number()),
    }
}

/// First and last time of a recording by the fields `time` of its messages and by its log times. The messages are read only
/// if that is needed; the log times are known.
fn spans(recording: &Recording, by_message: bool) -> Result<[Option<(Instant, Instant)>; 2], Failure> {
    let log = recording.span.map(|(first, last)| (Instant::log(first, 0), Instant::log(last, 0)));
    let mut span: Option<(f64, f64)> = None;
    if by_message {
        let timed = recording.channels.iter().filter(|(_, channel)| channel.has_time()).map(|(&id, _)| id);
        let mut messages = recording.messages(timed, None)?;
        messages.for_each(|next| {
            let time = next.channel.instant(next.message.data, next.message.log_time, 0).number();
            if time.is_finite() {
                let (first, last) = span.unwrap_or((time, time));
                span = Some((first.min(time), last.max(time)));
            }
            Ok(())
        })?;
    }
    Ok([span.map(|(first, last)| (Instant::Number(first), Instant::Number(last))), log])
}

/// True if no time is in both spans.
fn are_apart<T: PartialOrd>(a: (T, T), b: (T, T)) -> bool {
    a.1 < b.0 || b.1 < a.0
}

/// True if the log times of the recordings have none in common.
fn logs_are_apart(a: &Recording, b: &Recording) -> bool {
    a.span.zip(b.span).is_some_and(|(a, b)| are_apart(a, b))
}

/// Log times that messages of the two files are read in step from \[ns\].
pub(super) fn origins(a: &Recording, b: &Recording, options: &Options) -> [u64; 2] {
    if options.relative || logs_are_apart(a, b) {
        [a, b].map(|recording| recording.span.map_or(0, |span| span.0))
    } else {
        [0; 2]
    }
}

/// Log time of the reference that passes in one of the new recording, where the time of one is in SI and that of the other not.
pub(super) fn pace(a: &Recording, b: &Recording) -> Option<f64> {
    let rate = |recording: &Recording| convention::playback_rate(recording.entries(convention::RUN)?);
    let scales = Scales::between(b, a);
    let conversion = scales.conversion("s", "R/c_p").or_else(|| scales.conversion("R/c_p", "s"))?;
    let pace = conversion.apply(1.0) * rate(a)? / rate(b)?;
    (pace.is_finite() && pace > 0.0).then_some(pace)
}

/// Where the times of every pair of channels count from, if that is asked for, or if the mode is free and the recordings
/// have no time in common; `None` for pairs on one clock.
pub(super) fn starts(
    a: &Recording,
    b: &Recording,
    options: &Options,
    pairs: &[Pair],
) -> Result<Vec<Option<[Instant; 2]>>, Failure> {
    // runs of percuss: their message times follow from their log times, so that the messages need not be read
    let follow = [a, b].iter().all(|recording| recording.log_window(None, None).is_some());
    let is_asked = options.relative;
    if !is_asked
        && (options.mode.is_some() || options.time_offset.is_some() || (follow && !logs_are_apart(a, b)))
    {
        return Ok(vec![None; pairs.len()]);
    }
    let has_time = |recording: &Recording, id: u16| recording.channels[&id].has_time();
    let spans_a = spans(a, pairs.iter().any(|pair| has_time(a, pair.a)))?;
    let spans_b = spans(b, pairs.iter().any(|pair| has_time(b, pair.b)))?;
    let starts = pairs.iter().map(|pair| {
        let span_a = spans_a[usize::from(!has_time(a, pair.a))]?;
        let span_b = spans_b[usize::from(!has_time(b, pair.b))]?;
        (is_asked || are_apart(span_a, span_b)).then_some([span_a.0, span_b.0])
    });
    Ok(starts.collect())
}
