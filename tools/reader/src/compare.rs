//! Compares two recordings, number by number.
//!
//! ```text
//! structure: channels and fields that both have       (units, types, names: reported before any number)
//! stream:    one thread per file decompresses it and hands on the messages of those channels
//! align:     messages that belong together: by step, by time, or interpolated
//! measure:   one meter per field: first and largest difference, norms, tolerance
//! ```
//!
//! Memory does not grow with the length of the recordings: messages wait only until their counterparts are read.

mod align;
mod clock;
mod convert;
mod field;
mod measure;
mod meter;
mod mode;
mod offset;
mod options;
mod report;
mod resample;
mod stream;
mod structure;
mod sums;
mod tolerance;
mod tube;
mod values;

use std::collections::HashMap;

pub(crate) use measure::{Divergence, Location, Measure};
pub use mode::Mode;
pub use options::{Matched, NanRule, Offset, Options, Watch};
pub use report::{ChannelReport, Comparison, Verdict};
pub(crate) use report::{Converted, FieldReport};
pub(crate) use structure::{Change, Difference};
pub use tolerance::{Rule, Rules, Tolerance, Tube};
pub(crate) use values::shorten;

use crate::{
    failure::Failure,
    messages::{Message, Recording},
};
use align::Aligner;
use stream::{Input, Order};
use structure::Pair;
use sums::Scale;

/// Memory that comparing a field takes: sums, places, recent samples, numbers of the last message \[bytes\].
const FIELD: usize = 4096;

/// Compares two recordings; `a` is the reference. The messages of a channel are those in the order of their log times,
/// whatever their order in the file; where it is another they are read again and sorted.
///
/// # Errors
///
/// A file cannot be read, or `watch` failed.
pub fn compare(
    a: &Recording,
    b: &Recording,
    options: &Options,
    mut watch: Option<Watch<'_>>,
) -> Result<Comparison, Failure> {
    let first = if options.file_order { Order::File } else { Order::Checked };
    match compare_in(first, a, b, options, &mut watch) {
        Err(Failure::Unsorted(_)) => compare_in(Order::Sorted, a, b, options, &mut watch),
        compared => compared,
    }
}

fn compare_in(
    order: Order,
    a: &Recording,
    b: &Recording,
    options: &Options,
    watch: &mut Option<Watch<'_>>,
) -> Result<Comparison, Failure> {
    structure::find_chosen(a, b, options)?;
    let (mut pairs, structure) = structure::pair(a, b, options);
    pairs.iter().try_for_each(|pair| options.window.check(&a.channels[&pair.a]))?;
    let starts = clock::starts(a, b, options, &pairs)?;
    for (pair, starts) in pairs.iter_mut().zip(starts) {
        pair.starts = starts;
    }
    let offset = match options.time_offset {
        None => None,
        Some(Offset::Time(offset)) => Some(offset),
        Some(Offset::Fit) => Some(offset::fit(a, b, &pairs)?),
    };
    let fields = pairs.iter().map(|pair| pair.leaves.len() + 1).sum::<usize>();
    if fields.saturating_mul(FIELD) > a.limits().record() {
        return Err(Failure::Failed(format!(
            "the recordings have {fields} fields, too many to compare at once; choose some (--topic), or raise --max-memory"
        )));
    }
    let converted = pairs.iter().map(|pair| &pair.converter).find(|converter| !converter.is_empty());
    let converted =
        converted.map(|converter| if converter.is_from_si() { Converted::FromSi } else { Converted::ToSi });
    if watch.is_some() && converted.is_some() {
        return Err(Failure::Failed(
            "--write-diff needs recordings in the same units: one of these is in SI, the other dimensionless"
                .into(),
        ));
    }
    let files = inputs(order, [a, b], &pairs, options);
    // what a watcher has seen cannot be taken back
    if watch.is_some() && order == Order::Checked {
        for (input, pair) in files.iter().zip([a, b]) {
            if !input.is_ordered()? {
                return Err(Failure::Unsorted(pair.path.display().to_string()));
            }
        }
    }
    let residuals = structure::residuals(a, &pairs, options);
    let remarks: Vec<Change> = pairs.iter().flat_map(|pair| structure::remarks(a, b, pair)).collect();
    let scales = scales(a, &pairs, options, files[0].window)?;
    let room = a.limits().waiting() / pairs.len().max(1);
    let mut channels: Vec<Aligner<'_>> =
        pairs.into_iter().map(|pair| Aligner::new(a, b, pair, options, offset, &scales, room)).collect();
    let (damages, stopped_early) = stream::run(files, |side, next| {
        match next {
            Some((slot, item)) => {
                channels[slot].push(side, item, watch)?;
                return Ok(!(options.fail_fast && channels[slot].has_failed()));
            }
            None => channels.iter_mut().try_for_each(|channel| channel.end(side, watch))?,
        }
        Ok(true)
    })?;
    let mut comparison = Comparison {
        structure,
        provenance: [structure::provenance(a, b)?, remarks].concat(),
        residuals,
        derived: structure::derived(a, b, options),
        fitting: structure::fitting(a, b, &options.rules),
        damages,
        stopped_early,
        converted,
        offset,
        // of what comes after an early stop nothing is said
        channels: channels
            .into_iter()
            .map(Aligner::report)
            .filter(|channel| !stopped_early || channel.compared > 0 || channel.only != [0; 2])
            .collect(),
        ..Comparison::default()
    };
    [a, b].into_iter().for_each(|recording| comparison.add_state(recording));
    comparison.add_stamps();
    if !stopped_early {
        comparison.gaps = gaps(&comparison, options);
    }
    Ok(comparison)
}

/// What is read of both recordings. Times just outside the window are needed where something is interpolated.
fn inputs<'a>(
    order: Order,
    recordings: [&'a Recording; 2],
    pairs: &[Pair],
    options: &Options,
) -> [Input<'a>; 2] {
    let [a, b] = recordings;
    let [origin_a, origin_b] = clock::origins(a, b, options);
    let (from, to) = options.window.numbers();
    // times that count from a start are not those of the file
    let is_relative = pairs.iter().any(|pair| pair.starts.is_some());
    let is_converted = pairs.iter().any(|pair| !pair.converter.is_empty());
    let between = options.mode.map_or(!options.rules.rules.is_empty(), Mode::is_between);
    let input = |recording: &'a Recording, origin, pace, reaches_beyond: bool, id: fn(&Pair) -> u16| Input {
        recording,
        slots: pairs.iter().map(id).zip(0..).collect(),
        // times of another unit are not those of the window
        window: match is_relative || is_converted || reaches_beyond {
            true => None,
            false => recording.log_window(from, to),
        },
        origin,
        pace,
        order,
    };
    let pace = if is_converted { clock::pace(a, b).unwrap_or(1.0) } else { 1.0 };
    [input(a, origin_a, 1.0, false, |pair| pair.a), input(b, origin_b, pace, between, |pair| pair.b)]
}

/// What was to be compared and could not be; that nothing was, only if nothing else says why.
fn gaps(comparison: &Comparison, options: &Options) -> Vec<String> {
    let mut gaps: Vec<String> = comparison.channels.iter().flat_map(ChannelReport::gaps).collect();
    let values: u64 = comparison.channels.iter().map(ChannelReport::values).sum();
    if values > 0 || !gaps.is_empty() || comparison.verdict() == Verdict::Different {
        return gaps;
    }
    let messages: u64 = comparison.channels.iter().flat_map(|channel| channel.messages).sum();
    let why = match (comparison.channels.is_empty(), messages) {
        (true, _) if !comparison.derived.is_empty() => {
            let topics: Vec<&str> = comparison.derived.iter().map(String::as_str).collect();
            format!(
                "all topics are derived from others; name those to compare (--topic {})",
                topics.join(",")
            )
        }
        (true, _) if options.rules.rules.iter().any(|rule| rule.tolerance.ignore) => {
            "--ignore leaves no topic".into()
        }
        (true, _) => "neither recording has a topic".into(),
        (false, 0) => match options.window.numbers() {
            (None, None) => "neither recording has a message".into(),
            (from, to) => {
                let from = from.map_or(String::new(), |from| format!(" from {from}"));
                let to = to.map_or(String::new(), |to| format!(" to {to}"));
                format!("neither recording has a message at times{from}{to}; `info` shows their times")
            }
        },
        (false, _) => "no field that was chosen has a value (--topic, --field, --ignore, --skip-nan)".into(),
    };
    gaps.push(format!("nothing was compared: {why}"));
    gaps
}

/// Scale of every field of the reference over the time compared, by channel and leaf, if a tolerance needs any.
fn scales(
    a: &Recording,
    pairs: &[Pair],
    options: &Options,
    window: Option<(u64, u64)>,
) -> Result<HashMap<(u16, usize), Scale>, Failure> {
    let needs_scale = |pair: &Pair| {
        let channel = &a.channels[&pair.a];
        let Some(layout) = &channel.layout else { return false };
        let rule = |(leaf, _): &(usize, usize)| options.rules.of(&channel.topic, &layout.leaves[*leaf].path);
        let mut rules = pair.leaves.iter().filter_map(rule);
        rules.any(|rule| rule.tolerance.needs_scale())
    };
    let mut scales: HashMap<(u16, usize), Scale> = HashMap::new();
    if !pairs.iter().any(needs_scale) {
        return Ok(scales);
    }
    let starts: HashMap<_, _> =
        pairs.iter().map(|pair| (pair.a, pair.starts.map(|[start, _]| start))).collect();
    let mut messages = a.messages(starts.keys().copied(), window)?;
    let mut numbers = Vec::new();
    messages.for_each(|next| {
        let Message { channel, log_time, data, .. } = next.message;
        let time = clock::time(next.channel, starts[&channel], data, log_time);
        let values = if options.window.holds(time) { next.values() } else { None };
        for (leaf, list) in values.iter().flat_map(|values| &values.lists).enumerate() {
            if list.numbers(&mut numbers) {
                scales.entry((channel, leaf)).or_default().add(&numbers);
            }
        }
        Ok(())
    })?;
    Ok(scales)
}
