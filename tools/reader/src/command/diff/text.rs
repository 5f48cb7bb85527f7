//! A comparison for people.

use std::collections::HashSet;

use super::shown::Shown;
use crate::compare::{
    Change, ChannelReport, Comparison, Divergence, FieldReport, Location, Mode, Verdict, shorten,
};
use crate::instant::exact_seconds;

/// How a text is laid out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Style {
    /// Colours of a terminal.
    pub(super) colour: bool,
    /// Also fields that are equal, with the rule that applied.
    pub(super) explain: bool,
}

impl Style {
    fn paint(self, code: &str, text: &str) -> String {
        if self.colour { format!("\u{1b}[{code}m{text}\u{1b}[0m") } else { text.to_owned() }
    }

    fn verdict(self, verdict: Verdict) -> String {
        self.paint(if verdict.has_failed() { "1;31" } else { "32" }, verdict.name())
    }
}

/// Largest number of provenance changes and findings that are listed.
const MAX_LISTED: usize = 40;

/// That the rest was not compared.
const STOPPED: &str = "\nstopped at the first difference beyond tolerance (--fail-fast)\n";

/// All that is different, with the verdict first.
pub(super) fn to_text(shown: &Shown, style: Style) -> String {
    let Shown { a, b, comparison } = shown;
    let mut text = format!("{a} -> {b}: {}\n", style.verdict(comparison.verdict()));
    text.push_str(&counts(comparison));
    for (what, line, rest) in comparison.losses() {
        text.push_str(&format!("  {} {line}; {rest}\n", style.paint("33", what)));
    }
    text.push_str(&conversions(shown, style));
    if let Some(offset) = comparison.offset {
        text.push_str(&format!("  {offset} is added to the times of the new recording\n"));
    }
    if !comparison.structure.is_empty() {
        text.push_str("\nstructure\n");
        list(&mut text, comparison.structure.iter().map(ToString::to_string));
    }
    if !comparison.provenance.is_empty() {
        text.push_str("\nfor information: case, metadata, headers of messages\n");
        let show = |value: &Option<String>| {
            value.as_ref().map_or("(none)".into(), |value| shorten(&value.replace('\n', " ")))
        };
        let line = |change: &Change| {
            format!("{} {}: {} -> {}", change.place, change.key, show(&change.a), show(&change.b))
        };
        list(&mut text, comparison.provenance.iter().map(line));
    }
    for (beyond, what) in [(false, "first difference"), (true, "first beyond tolerance")] {
        if let Some((topic, field, divergence)) = comparison.first(beyond) {
            let (name, place) = (field.leaf.element(divergence.place.element), &divergence.place);
            let position = place.position.as_ref().map_or(String::new(), |position| format!(" ({position})"));
            text.push_str(&format!("\n{what}: {topic}.{name}{position} {}", when(place)));
            text.push_str(&format!("\n  {} -> {}\n", divergence.a, divergence.b));
        }
    }
    let (shown, silent): (Vec<&ChannelReport>, Vec<_>) =
        comparison.channels.iter().partition(|channel| style.explain || channel.verdict() != Verdict::Equal);
    for channel in shown {
        text.push('\n');
        text.push_str(&channel_text(channel, style));
    }
    text.push_str(&silent_text(&silent));
    if !comparison.derived.is_empty() {
        let topics: Vec<&str> = comparison.derived.iter().map(String::as_str).collect();
        text.push_str(&format!("not compared, made from the others: {}\n", topics.join(", ")));
    }
    for residual in &comparison.residuals {
        text.push_str(&format!(
            "not compared, a residual of rounding: {residual} (--tol {residual}:abs=1e-12)\n"
        ));
    }
    let stamps = comparison.unseen_stamps();
    if !stamps.is_empty() {
        text.push_str(&format!("not compared, stamps of messages at other times: {}\n", stamps.join(", ")));
    }
    if comparison.stopped_early {
        text.push_str(STOPPED);
    }
    text
}

/// What was compared, in numbers.
fn counts(comparison: &Comparison) -> String {
    let [values, differing, beyond] = comparison.counts();
    let channels = comparison.channels.len();
    let structure = match comparison.structure.len() {
        0 => String::new(),
        findings => format!(", {findings} differences of structure"),
    };
    format!(
        "  {values} values of {channels} channels compared: {differing} differ, {beyond} beyond tolerance{structure}\n"
    )
}

/// Topics of channels of which there is nothing more to say.
fn silent_text(silent: &[&ChannelReport]) -> String {
    let topics = |what: &str, is_wanted: fn(&ChannelReport) -> bool| {
        let topics = silent.iter().filter(|channel| is_wanted(channel)).map(|channel| channel.topic.as_str());
        let topics = topics.collect::<Vec<_>>().join(", ");
        if topics.is_empty() { String::new() } else { format!("{what}: {topics}\n") }
    };
    [
        topics("\nequal", |channel| channel.values() > 0),
        topics("\nno value compared", |channel| channel.values() == 0 && channel.messages != [0; 2]),
        topics("\nno message in either", |channel| channel.messages == [0; 2]),
    ]
    .concat()
}

/// How the new recording was put into other units, and where times count from, where that is the start of each recording.
fn conversions(Shown { a, b, comparison }: &Shown, style: Style) -> String {
    let units = comparison.converted.map(|converted| converted.text(a, b));
    let mut lines: Vec<String> =
        units.map(|line| format!("  {} {line}\n", style.paint("33", "units"))).into_iter().collect();
    for [a, b] in comparison.channels.iter().filter_map(|channel| channel.starts) {
        lines.push(format!("  times count from the start of each recording: {a} and {b}\n"));
    }
    let mut known = HashSet::new();
    lines.retain(|line| known.insert(line.clone()));
    lines.concat()
}

/// One line per channel.
pub(super) fn summary(shown: &Shown, style: Style) -> String {
    let Shown { a, b, comparison } = shown;
    let mut text = format!("{}  {a} -> {b}\n", style.verdict(comparison.verdict()));
    text.push_str(&counts(comparison));
    for finding in &comparison.structure {
        text.push_str(&format!("{}  {finding}\n", style.verdict(Verdict::Different)));
    }
    for channel in &comparison.channels {
        let verdict = match channel.verdict() {
            verdict if verdict.has_failed() => style.verdict(verdict),
            _ if channel.messages == [0; 2] => "no message".into(),
            _ if channel.values() == 0 => "no value".into(),
            verdict => style.verdict(verdict),
        };
        let largest = largest(channel);
        let detail = if largest.is_empty() { String::new() } else { format!("  {largest}") };
        text.push_str(&format!("{verdict}  {}  {}{detail}\n", channel.topic, alignment(channel)));
    }
    text.push_str(&conversions(shown, style));
    if comparison.stopped_early {
        text.push_str(STOPPED);
    }
    text
}

/// The largest difference of a channel in words; empty if there is none.
pub(super) fn largest(channel: &ChannelReport) -> String {
    let worst = channel.fields.iter().filter(|field| field.measure.differing > 0 && !field.ignored);
    let worst = worst.max_by(|a, b| rank(a).total_cmp(&rank(b)));
    worst.map_or(String::new(), |field| match &field.measure.max {
        Some((max, _)) => format!("largest {max:.3e} in {}", field.leaf.path),
        // texts differ by no number
        None => format!("{} values differ in {}", field.measure.differing, field.leaf.path),
    })
}

fn rank(field: &FieldReport) -> f64 {
    field.measure.peak_relative().unwrap_or(f64::INFINITY)
}

fn list(text: &mut String, lines: impl ExactSizeIterator<Item = String>) {
    let more = lines.len().saturating_sub(MAX_LISTED);
    lines.take(MAX_LISTED).for_each(|line| text.push_str(&format!("  {line}\n")));
    if more > 0 {
        text.push_str(&format!("  … and {more} more (--json lists all)\n"));
    }
}

pub(super) fn channel_text(channel: &ChannelReport, style: Style) -> String {
    let mut text = format!("{}  {}\n", style.paint("1", &channel.topic), alignment(channel));
    let mut remarks: Vec<String> = alone(channel).filter(|_| !channel.common).collect();
    remarks.extend(channel.apart());
    remarks.extend(channel.hint.map(|hint| hint.to_string()));
    if channel.undecoded > 0 {
        remarks.push(format!("{} messages do not fit their schema", channel.undecoded));
    }
    for remark in remarks {
        text.push_str(&format!("  {} {remark}\n", style.paint("1;31", "!")));
    }
    alone(channel)
        .filter(|_| channel.common)
        .for_each(|line| text.push_str(&format!("  {line} (--common)\n")));
    if channel.axes_differ {
        text.push_str("  the axes differ: arrays are compared on their common range, interpolated\n");
    }
    let shown = |field: &&FieldReport| {
        let measure = &field.measure;
        style.explain
            || (!field.ignored && (measure.differing + measure.apart + measure.dropped > 0 || !field.within))
    };
    for field in channel.fields.iter().filter(shown) {
        text.push_str(&field_text(field, style));
    }
    text
}

/// Messages without a counterpart, of either recording.
fn alone(channel: &ChannelReport) -> impl Iterator<Item = String> {
    let [only_a, only_b] = channel.only;
    let sides = [(only_a, "the reference", true), (only_b, "the new recording", false)];
    sides.into_iter().filter(|(count, ..)| *count > 0).map(move |(count, of, of_a)| {
        let first = channel.first_unmatched.as_ref().filter(|(_, in_a)| *in_a == of_a);
        let first = first.map_or(String::new(), |(place, _)| format!(", the first {}", when(place)));
        match channel.is_between() {
            true => format!("{count} messages of {of} are not compared{first}"),
            false => format!("{count} messages only in {of}{first}"),
        }
    })
}

fn alignment(channel: &ChannelReport) -> String {
    let how = match channel.mode {
        None => return "no message in either".into(),
        Some(Mode::Step) => "by step",
        Some(Mode::Time) => "by exact time",
        Some(Mode::Nearest) if channel.interpolated => "interpolated by the nearest in time",
        Some(Mode::Nearest) => "nearest in time",
        Some(Mode::Linear) => "interpolated linearly in time",
        Some(Mode::Cubic) => "interpolated by cubics in time",
    };
    let counts = match (channel.interpolated, channel.messages) {
        (true, [a, b]) => {
            let between = match channel.between {
                0 => String::new(),
                between => format!(", {between} of them between the times compared"),
            };
            format!(", {a} messages in the reference and {b} in the new recording{between}")
        }
        (false, _) => String::new(),
    };
    format!("{} samples {how}{counts}", channel.compared)
}

fn field_text(field: &FieldReport, style: Style) -> String {
    let measure = &field.measure;
    let rule = match &field.rule {
        Some(rule) => format!("{} ({})", rule.tolerance, rule.origin),
        None => "bitwise".into(),
    };
    let unit = field.unit.as_ref().map_or(String::new(), |unit| format!(" [{unit}]"));
    let state = match field {
        _ if field.ignored => "not compared".to_owned(),
        _ if field.untolerated => style.paint("1;31", "BEYOND, interpolated without a tolerance"),
        _ if !field.within => style.paint("1;31", "BEYOND"),
        _ if measure.elements == 0 && measure.apart > 0 => style.paint("1;31", "NOT COMPARED"),
        _ if measure.elements == measure.skipped => "no value".to_owned(),
        _ if measure.differing > 0 => style.paint("32", "within"),
        _ => style.paint("32", "equal"),
    };
    let mut text = format!("  {}{unit}  {state}", field.leaf.path);
    if style.explain {
        text.push_str(&format!("  rule {rule}"));
    }
    text.push('\n');
    if !field.ignored && measure.apart > 0 {
        text.push_str(&format!("    {} samples have no part of their axes in common\n", measure.apart));
    }
    if !field.ignored && measure.dropped > 0 {
        let dropped = measure.dropped;
        text.push_str(&format!("    {dropped} elements without a counterpart are not compared\n"));
    }
    if !field.ignored && (measure.differing > 0 || !field.within) {
        text.push_str(&measure_text(field));
    }
    text
}

/// How far the values of a field are apart.
fn measure_text(field: &FieldReport) -> String {
    let (measure, mut text) = (&field.measure, String::new());
    let (differing, elements, beyond) = (measure.differing, measure.elements, measure.beyond);
    text.push_str(&format!("    {differing} of {elements} values differ, {beyond} beyond tolerance\n"));
    if measure.lengths > 0 {
        text.push_str(&format!("    {} samples have different numbers of elements\n", measure.lengths));
    }
    if let Some((max, place)) = &measure.max {
        let relative = measure.peak_relative().map_or(String::new(), |r| format!(", {r:.3e} of the peak"));
        text.push_str(&format!("    largest {max:.6e}{relative} {}\n", located(field, place)));
    }
    let beyond = measure.first_beyond.as_ref().filter(|first| Some(*first) != measure.first.as_ref());
    for (what, divergence) in [("first", measure.first.as_ref()), ("first beyond", beyond)] {
        if let Some(Divergence { place, a, b }) = divergence {
            text.push_str(&format!("    {what} {}: {a} -> {b}\n", located(field, place)));
        }
    }
    if let (Some(l1), Some(l2)) = (measure.l1_relative(), measure.l2_relative()) {
        text.push_str(&format!("    relative: L1 {l1:.3e}, L2 {l2:.3e}"));
        if let Some([magnitude, phase, combined]) = measure.sprague_geers() {
            text.push_str(&format!(
                "; Sprague-Geers magnitude {magnitude:.3e}, phase {phase:.3e}, combined {combined:.3e}"
            ));
        }
        text.push_str(&measure.correlation().map_or(String::new(), |c| format!("; correlation {c:.9}")));
        text.push('\n');
    }
    text
}

fn located(field: &FieldReport, place: &Location) -> String {
    let mut text = when(place);
    if field.leaf.lists > 0 {
        text.push_str(&format!(", {}", field.leaf.element(place.element)));
    }
    text + &place.position.as_ref().map_or(String::new(), |position| format!(", {position}"))
}

fn when(place: &Location) -> String {
    let time = place.time.nanoseconds().map_or_else(|| place.time.number().to_string(), exact_seconds);
    match place.step {
        Some(step) => format!("at step {step}, time {time}"),
        None => format!("at time {time}"),
    }
}
