//! Which topics, which times, which of many messages: chosen alike by every verb.

use clap::Args;
use globset::{GlobBuilder, GlobMatcher};
use percuss_output::number::whole;
use percuss_table::units::TIME;

use crate::{
    channel::Channel,
    convention,
    failure::Failure,
    instant::Instant,
    messages::Recording,
    prefix::{UnitError, typed},
    wire::Type,
};

/// A pattern of topics or fields: `*` stands for anything, `?` for one character, `[ab]` for one of some.
#[derive(Clone, Debug)]
pub struct Pattern {
    text: String,
    matcher: Option<GlobMatcher>,
}

impl std::str::FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains(['*', '?', '[', '{']) {
            return Ok(Self { text: text.into(), matcher: None });
        }
        let glob = GlobBuilder::new(text).literal_separator(false).build().map_err(|e| e.to_string())?;
        Ok(Self { text: text.into(), matcher: Some(glob.compile_matcher()) })
    }
}

impl Pattern {
    /// That of one name.
    pub(crate) fn exact(name: &str) -> Self {
        Self { text: name.into(), matcher: None }
    }

    /// True if a name fits; the pattern's own text always does.
    pub fn fits(&self, name: &str) -> bool {
        name == self.text || self.matcher.as_ref().is_some_and(|matcher| matcher.is_match(name))
    }

    /// The pattern as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// First or last time of a window: a number, and if log times are meant, exactly what was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    number: f64,
    /// Whole nanoseconds not after it.
    floor: i128,
    /// Whole nanoseconds not before it.
    ceil: i128,
    /// True if it was written with a unit: then it is in seconds.
    has_unit: bool,
}

impl Bound {
    /// As a number.
    pub fn number(self) -> f64 {
        self.number
    }

    /// True if `a` is nearer to it than `b`; of log times, to the nanosecond.
    pub(crate) fn is_nearer(self, a: Instant, b: Instant) -> bool {
        let whole = |time: i128| (2 * time).abs_diff(self.floor.saturating_add(self.ceil));
        match (a, b) {
            (Instant::Log(a), Instant::Log(b)) => whole(a) < whole(b),
            _ => (a.number() - self.number).abs() < (b.number() - self.number).abs(),
        }
    }

    /// Refuses a unit where the times of a channel are in another than seconds.
    pub(crate) fn check(self, channel: &Channel) -> Result<(), UnitError> {
        UnitError::check(self.has_unit, TIME, &channel.topic, "times", channel.time_unit())
    }

    /// The log time in seconds at which a step of this time is.
    ///
    /// * `clock`: log time that passes in a unit of the time of steps \[s\], and that unit
    pub(crate) fn of_step(self, topic: &str, (rate, unit): (f64, Option<&str>)) -> Result<Self, UnitError> {
        UnitError::check(self.has_unit, TIME, topic, "times", unit)?;
        Ok(Self::from(self.number * rate))
    }

    /// Whole nanoseconds not after and not before it.
    pub(crate) fn nanoseconds(self) -> (i128, i128) {
        (self.floor, self.ceil)
    }
}

impl From<f64> for Bound {
    /// The shortest decimal fraction that is this number.
    fn from(number: f64) -> Self {
        let (floor, ceil) = nanoseconds(&number.to_string()).unwrap_or(match number > 0.0 {
            true => (i128::MAX, i128::MAX),
            false => (i128::MIN, i128::MIN),
        });
        Self { number, floor, ceil, has_unit: false }
    }
}

impl std::str::FromStr for Bound {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (text, has_unit) = typed(text, TIME)?;
        let number = text.parse::<f64>().map_err(|_| "not a number")?;
        let (floor, ceil) = nanoseconds(&text).unwrap_or_else(|| Self::from(number).nanoseconds());
        Ok(Self { number, floor, ceil, has_unit })
    }
}

/// Whole nanoseconds not after and not before a decimal number of seconds; `None` beyond all log times.
fn nanoseconds(text: &str) -> Option<(i128, i128)> {
    /// Digits before the point of any number with an exponent that is read at all: no log time has as many.
    const DIGITS: i64 = 400;
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let is_negative = mantissa.starts_with('-');
    let mantissa = mantissa.strip_prefix(['-', '+']).unwrap_or(mantissa);
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{fraction}");
    let point = i64::try_from(whole.len()).ok()?.checked_add(exponent.parse().ok()?)?.checked_add(9)?;
    if point > DIGITS || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let kept = usize::try_from(point.max(0)).ok()?;
    let (known, rest) = digits.split_at(kept.min(digits.len()));
    let size = format!("0{known}{}", "0".repeat(kept - known.len())).parse::<i128>().ok()?;
    let more = i128::from(rest.bytes().any(|digit| digit != b'0'));
    Some(if is_negative { (-size - more, -size) } else { (size, size.saturating_add(more)) })
}

/// A time of a frame.
pub(crate) fn finite_time(text: &str) -> Result<Bound, String> {
    let bound: Bound = text.parse()?;
    if bound.number.is_finite() { Ok(bound) } else { Err("not a finite number".into()) }
}

/// Which times, and which of many messages.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// First time, in the unit that is recorded or with one, 32us; of log times that are dates, from the start of the recording
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub from: Option<Bound>,
    /// Last time, like the first
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub to: Option<Bound>,
    /// Every n-th message of that time, and the last one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1_u64..))]
    pub every: u64,
}

impl Window {
    /// True if a time is not before the first or after the last; of log times, to the nanosecond.
    pub(crate) fn holds(&self, time: Instant) -> bool {
        let is_after = |to: Bound| time.nanoseconds().map_or(time.number() > to.number, |ns| ns > to.floor);
        !(self.is_before(time) || self.to.is_some_and(is_after))
    }

    /// True if a time is before the first.
    pub(crate) fn is_before(&self, time: Instant) -> bool {
        let is_before =
            |from: Bound| time.nanoseconds().map_or(time.number() < from.number, |ns| ns < from.ceil);
        self.from.is_some_and(is_before)
    }

    /// First and last log time of the messages of some channels \[ns\]; `None` if that is not known.
    pub(crate) fn log_times_of(
        &self,
        recording: &Recording,
        ids: impl IntoIterator<Item = u16>,
    ) -> Option<(u64, u64)> {
        let channels: Vec<&Channel> = ids.into_iter().filter_map(|id| recording.channels.get(&id)).collect();
        let timed = channels.iter().filter(|channel| channel.has_time()).count();
        let (from, to) = self.numbers();
        match timed {
            0 => Some(self.log_times(channels.iter().map(|channel| channel.origin).max().unwrap_or(0))),
            timed if timed == channels.len() => recording.log_window(from, to),
            _ => None,
        }
    }

    /// First and last log time, where its times are seconds from an origin \[ns\].
    pub(crate) fn log_times(&self, origin: u64) -> (u64, u64) {
        let at = |time: i128| {
            let sum = time.saturating_add(origin.into()).clamp(0, u64::MAX.into());
            u64::try_from(sum).unwrap_or(u64::MAX)
        };
        (self.from.map_or(0, |from| at(from.ceil)), self.to.map_or(u64::MAX, |to| at(to.floor)))
    }

    /// Refuses a unit where the times of a channel are in another than seconds.
    pub(crate) fn check(&self, channel: &Channel) -> Result<(), UnitError> {
        [self.from, self.to].into_iter().flatten().try_for_each(|bound| bound.check(channel))
    }

    /// First and last time as numbers.
    pub fn numbers(&self) -> (Option<f64>, Option<f64>) {
        (self.from.map(Bound::number), self.to.map(Bound::number))
    }

    /// True if the message of a number, from 0, among those of the window is not one of every n-th; 0 means all, as 1 does. The last
    /// one stays whatever its number.
    pub fn leaves_out(&self, number: u64) -> bool {
        !number.is_multiple_of(self.every.max(1))
    }
}

/// Ids of the channels whose topics fit any of the patterns, in the order of the patterns; all if there are none.
///
/// # Errors
///
/// A pattern fits no topic.
pub fn channels(recording: &Recording, patterns: &[Pattern]) -> Result<Vec<u16>, Failure> {
    if patterns.is_empty() {
        return Ok(recording.channels.keys().copied().collect());
    }
    let mut ids = Vec::new();
    for pattern in patterns {
        let fitting = || recording.channels.iter().filter(|(_, channel)| pattern.fits(&channel.topic));
        if fitting().next().is_none() {
            let (path, topic) = (recording.path.display(), &pattern.text);
            let known = known(recording);
            return Err(Failure::Usage(format!("`{path}` has no topic `{topic}`; it has {known}")));
        }
        let new: Vec<u16> = fitting().map(|(&id, _)| id).filter(|id| !ids.contains(id)).collect();
        ids.extend(new);
    }
    Ok(ids)
}

/// Topics of a recording, in words.
fn known(recording: &Recording) -> String {
    let known: Vec<&str> = recording.channels.values().map(|channel| channel.topic.as_str()).collect();
    if known.is_empty() { "none".to_owned() } else { known.join(", ") }
}

/// Ids of the channels whose topics fit any of the patterns; if there are none, the channel that says most without being
/// asked for: the drag of percuss, else the first in the order of the file with messages that hold floating-point numbers,
/// else other numbers, apart from those that only say when, else the first that is decoded.
///
/// # Errors
///
/// A pattern fits no topic, or nothing is decoded.
pub fn channels_or_default(recording: &Recording, patterns: &[Pattern]) -> Result<Vec<u16>, Failure> {
    if !patterns.is_empty() {
        return channels(recording, patterns);
    }
    let all = || recording.channels.iter().filter(|(_, channel)| channel.layout.is_some());
    if recording.is_percuss() || all().any(|(_, channel)| channel.topic == convention::DRAG) {
        let drag = Pattern::exact(convention::DRAG);
        return channels(recording, &[drag]);
    }
    let is_full = |(_, channel): &(&u16, &Channel)| channel.count > 0 || channel.span.is_some();
    let first = |fits: fn(&Type) -> bool| all().filter(is_full).find(|(_, channel)| holds(channel, fits));
    let found = first(|kind| matches!(kind, Type::Double | Type::Float));
    let found = found.or_else(|| first(|kind| kind.is_number() || matches!(kind, Type::Enum(_))));
    let found = found.or_else(|| all().find(is_full)).or_else(|| all().next());
    let nothing = || {
        let (path, known) = (recording.path.display(), known(recording));
        Failure::Usage(format!("`{path}` has no topic whose messages can be decoded; it has {known}"))
    };
    found.map(|(id, _)| vec![*id]).ok_or_else(nothing)
}

/// True if messages hold values of some types that do not only say which message it is, when it was, and where its arrays
/// are.
fn holds(channel: &Channel, fits: fn(&Type) -> bool) -> bool {
    let Some(layout) = &channel.layout else { return false };
    let (axes, time) = (channel.axis_parts(), channel.time_leaf());
    layout.leaves.iter().enumerate().any(|(index, leaf)| {
        let is_plain = leaf.is_data() && leaf.path != convention::STEP && Some(index) != time;
        fits(&leaf.kind) && is_plain && !axes.contains(leaf.path.as_str()) && !layout.says_when(index)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_whole_nanoseconds() {
        for (text, expected) in [
            ("1700000000.123456789", (1_700_000_000_123_456_789, 1_700_000_000_123_456_789)),
            ("1.7000000001234567891e9", (1_700_000_000_123_456_789, 1_700_000_000_123_456_790)),
            ("-0.5e-9", (-1, 0)),
            ("+.25", (250_000_000, 250_000_000)),
            ("-3", (-3_000_000_000, -3_000_000_000)),
            ("1e-300", (0, 1)),
            ("-0", (0, 0)),
            ("1e300", (i128::MAX, i128::MAX)),
            ("-inf", (i128::MIN, i128::MIN)),
        ] {
            assert_eq!(text.parse().map(Bound::nanoseconds), Ok(expected), "{text}");
        }
        assert!("nan".parse::<Bound>().is_err() && "1,5".parse::<Bound>().is_err());
        assert_eq!(Bound::from(0.1 + 0.2).nanoseconds(), (300_000_000, 300_000_001));
    }
}
