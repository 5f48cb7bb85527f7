//! Messages of a channel that belong together.

use std::{
    collections::{HashMap, HashSet, VecDeque},
    sync::Arc,
};

use super::{
    ChannelReport, CompareError, FieldReport, Matched, Options, Watch,
    clock::{self, Start},
    measure::{Place, Scale},
    meter::{Meter, Sample},
    resample::{Field, is_key, measure, mix},
    stream::Item,
    structure::{Pair, WHOLE},
};
use crate::{
    axis::Axis,
    channel::Channel,
    convention,
    messages::Recording,
    wire::{Layout, Leaf, List, Type, Values},
};

/// How messages are brought together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Mode {
    /// Messages of the same step
    Step,
    /// Messages of exactly the same time
    Time,
    /// Messages of the same number in their channel
    Order,
    /// The new message nearest in time
    Nearest,
    /// The new recording interpolated linearly at the times of the reference
    Linear,
    /// The new recording interpolated by cubics at the times of the reference
    Cubic,
}

impl Mode {
    /// True if messages of other times are compared, not only those that belong together one by one.
    pub fn is_between(self) -> bool {
        matches!(self, Self::Nearest | Self::Linear | Self::Cubic)
    }
}

/// How messages were brought together, and why.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// The mode; `None` if there was nothing to bring together.
    pub mode: Option<Mode>,
    /// True if it was chosen by looking at the messages.
    pub by_itself: bool,
    /// Times of both recordings from which the times of their messages count; `None` if those are on one clock.
    pub starts: Option<[f64; 2]>,
}

/// Messages that may wait whatever their size: as many as interpolation needs, and some.
const LEAST_WAITING: usize = 8;

/// Messages that are looked at to choose a mode.
const LOOKED_AT: usize = 16;

/// The least of the key, or of the time, as an integer that grows with it.
fn ordered(time: f64) -> u64 {
    let bits = time.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// Leaf of the step of a message: a plain whole number named `step`.
fn step_leaf(layout: &Layout) -> Option<usize> {
    let leaf = layout.find(convention::STEP)?;
    let is_integer = matches!(layout.leaves[leaf].kind, Type::UInt | Type::Int);
    (is_integer && layout.leaves[leaf].is_single).then_some(leaf)
}

/// Memory that a message takes while it waits \[bytes\].
fn weight(item: &Item) -> usize {
    /// A queue grows to twice its length; a message of its own is a block.
    const BLOCK: usize = 2 * size_of::<Waiting>() + 32;
    BLOCK + item.bytes().len()
}

/// A message that waits.
struct Waiting {
    item: Item,
    step: Option<u64>,
    time: f64,
}

/// Brings the messages of two channels together and measures them.
pub(super) struct Aligner<'a> {
    a: &'a Channel,
    b: &'a Channel,
    ids: [u16; 2],
    layouts: Option<[Arc<Layout>; 2]>,
    /// The same bytes mean the same in both.
    interchangeable: bool,
    values: Vec<Values>,
    fields: Vec<Field>,
    mode: Option<Mode>,
    options: &'a Options,
    starts: Option<[Start; 2]>,
    room: usize,
    pairs: u64,
    waiting: [VecDeque<Waiting>; 2],
    held: [usize; 2],
    over: [bool; 2],
    report: ChannelReport,
}

impl<'a> Aligner<'a> {
    pub(super) fn new(
        a: &'a Recording,
        b: &'a Recording,
        pair: Pair,
        options: &'a Options,
        scales: &HashMap<(u16, usize), Scale>,
        room: usize,
    ) -> Self {
        let (channel_a, channel_b) = (&a.channels[&pair.a], &b.channels[&pair.b]);
        let topic = &channel_a.topic;
        let layouts = match (&channel_a.layout, &channel_b.layout) {
            // messages without any field are compared as bytes, which both must have at the same times
            (Some(a), Some(b)) if a.leaves.len().max(b.leaves.len()) > 1 => {
                Some([Arc::clone(a), Arc::clone(b)])
            }
            _ => None,
        };
        let places = channel_a.axis_parts();
        let field = |&(leaf_a, leaf_b): &(usize, usize)| {
            let [layout_a, layout_b] = layouts.as_ref()?;
            let path = layout_a.leaves[leaf_a].path.clone();
            let rule = options.rules.of(topic, &path).cloned();
            let ignored = !options.compares(topic, &path);
            let even = convention::is_even(&channel_a.metadata, &path);
            let known = scales.get(&(pair.a, leaf_a)).copied();
            Some(Field {
                unit: channel_a.unit(&path).map(str::to_owned),
                leaf_a,
                leaf_b,
                axis_a: Axis::of(leaf_a, layout_a, channel_a),
                axis_b: Axis::of(leaf_b, layout_b, channel_b),
                even,
                ignored,
                is_place: places.contains(&path.as_str()),
                is_key: is_key(layout_a, leaf_a),
                meter: Meter::new(rule, known, options.nan),
                leaf: layout_a.leaves[leaf_a].clone(),
                path,
            })
        };
        let mut fields: Vec<Field> = pair.leaves.iter().filter_map(field).collect();
        if layouts.is_none() {
            let rule = options.rules.of(topic, WHOLE).cloned();
            fields = vec![Field {
                path: WHOLE.into(),
                leaf: Leaf::whole(WHOLE),
                unit: None,
                leaf_a: 0,
                leaf_b: 0,
                axis_a: Axis::Unknown,
                axis_b: Axis::Unknown,
                even: false,
                ignored: !options.compares(topic, WHOLE),
                is_place: false,
                is_key: false,
                meter: Meter::new(rule, None, options.nan),
            }];
        }
        let interchangeable = layouts.as_ref().is_some_and(|[a, b]| a.is_like(b));
        // there is nothing between bytes
        let mode =
            options.mode.map(|mode| if layouts.is_none() && mode.is_between() { Mode::Time } else { mode });
        let values = layouts.iter().flatten().map(|layout| layout.values()).collect();
        Self {
            a: channel_a,
            b: channel_b,
            ids: [pair.a, pair.b],
            layouts,
            interchangeable,
            values,
            fields,
            mode,
            options,
            starts: pair.starts,
            room,
            pairs: 0,
            waiting: [VecDeque::new(), VecDeque::new()],
            held: [0; 2],
            over: [false; 2],
            report: ChannelReport { topic: topic.clone(), ..ChannelReport::default() },
        }
    }

    pub(super) fn has_failed(&self) -> bool {
        let report = &self.report;
        report.only_a + report.only_b + report.undecoded > 0
            || self.fields.iter().any(|field| !field.ignored && field.meter.measure.first_beyond.is_some())
    }

    /// Takes a message of the reference (side 0) or of the new recording (side 1).
    pub(super) fn push(
        &mut self,
        side: usize,
        item: Item,
        watch: &mut Option<Watch<'_>>,
    ) -> Result<(), CompareError> {
        let channel = [self.a, self.b][side];
        let start = self.starts.map(|starts| starts[side]);
        let time = clock::time(channel, start, item.bytes(), item.log_time);
        if !self.options.window.holds(time) {
            return Ok(());
        }
        self.report.messages[side] += 1;
        let (first, last) = self.report.spans[side].unwrap_or((time, time));
        self.report.spans[side] = Some((first.min(time), last.max(time)));
        let layout = channel.layout.as_ref();
        let step = layout.and_then(|layout| layout.peek(step_leaf(layout)?, item.bytes()));
        self.held[side] += weight(&item);
        let before = self.waiting[side].len();
        self.waiting[side].push_back(Waiting { item, step: step.map(|step| step as u64), time });
        self.advance(watch)?;
        if self.waiting[side].len() > before
            && let Some(last) = self.waiting[side].back_mut()
        {
            last.item.keep();
        }
        Ok(())
    }

    /// True if a side has more waiting than there is room for, and more than any way of comparing needs.
    fn is_full(&self, side: usize) -> bool {
        let room = if self.waiting[side].len() > LEAST_WAITING { self.room } else { 8 * self.room };
        self.held[side] > room
    }

    fn no_room(&self) -> CompareError {
        CompareError::Waiting { topic: self.report.topic.clone() }
    }

    /// No more messages will come from a side.
    pub(super) fn end(&mut self, side: usize, watch: &mut Option<Watch<'_>>) -> Result<(), CompareError> {
        self.over[side] = true;
        self.advance(watch)
    }

    fn advance(&mut self, watch: &mut Option<Watch<'_>>) -> Result<(), CompareError> {
        let mode = match self.mode {
            Some(mode) => mode,
            None => {
                let seen = |side: usize| self.waiting[side].len() >= LOOKED_AT || self.over[side];
                if !((seen(0) && seen(1)) || self.is_full(0) || self.is_full(1)) {
                    return Ok(());
                }
                *self.mode.insert(self.choose())
            }
        };
        match mode {
            Mode::Step | Mode::Time | Mode::Order => self.match_keys(mode, watch),
            Mode::Nearest | Mode::Linear | Mode::Cubic => self.interpolate(mode),
        }
    }

    /// The mode that fits the first messages.
    fn choose(&self) -> Mode {
        let [a, b] = &self.waiting;
        let (first_a, first_b) = (a.iter().take(LOOKED_AT), b.iter().take(LOOKED_AT));
        // equal steps mean the same only if they are at the same time: within a thousandth of a step
        let spacing = |side: &VecDeque<Waiting>| match (side.front(), side.get(LOOKED_AT.min(side.len()) - 1))
        {
            (Some(first), Some(last)) if side.len() > 1 => {
                (last.time - first.time).abs() / (side.len().min(LOOKED_AT) - 1) as f64
            }
            _ => 0.0,
        };
        if a.is_empty() || b.is_empty() {
            return if a.iter().chain(b).all(|waiting| waiting.step.is_some()) {
                Mode::Step
            } else {
                Mode::Time
            };
        }
        let near = 1e-3 * spacing(a).min(spacing(b));
        let times_of_b: HashMap<u64, f64> = first_b.clone().filter_map(|w| Some((w.step?, w.time))).collect();
        let common: Vec<(f64, f64)> =
            first_a.clone().filter_map(|w| Some((w.time, *times_of_b.get(&w.step?)?))).collect();
        let agreeing = common.iter().filter(|(x, y)| x == y || (x - y).abs() <= near).count();
        if !common.is_empty() && 2 * agreeing >= common.len() {
            return Mode::Step;
        }
        let exact: HashSet<u64> = first_b.clone().map(|w| ordered(w.time)).collect();
        let equal = first_a.clone().filter(|w| exact.contains(&ordered(w.time))).count();
        if 2 * equal > a.len().min(LOOKED_AT) && 2 * equal > b.len().min(LOOKED_AT) {
            return Mode::Time;
        }
        // a handful of messages is no series to interpolate in, and there is nothing between bytes
        match () {
            () if self.over == [true; 2] && a.len().min(b.len()) < 4 => Mode::Order,
            () if self.layouts.is_none() => Mode::Time,
            () => Mode::Linear,
        }
    }

    /// Messages of equal keys are compared; those in between are alone.
    fn match_keys(&mut self, mode: Mode, watch: &mut Option<Watch<'_>>) -> Result<(), CompareError> {
        let key = |waiting: &Waiting| match mode {
            Mode::Step => waiting.step.unwrap_or_else(|| ordered(waiting.time)),
            Mode::Time => ordered(waiting.time),
            _ => 0,
        };
        loop {
            let [a, b] = &self.waiting;
            let alone = match (a.front(), b.front()) {
                (Some(x), Some(y)) => match key(x).cmp(&key(y)) {
                    std::cmp::Ordering::Equal => {
                        self.compare_front(watch)?;
                        continue;
                    }
                    std::cmp::Ordering::Less => 0,
                    std::cmp::Ordering::Greater => 1,
                },
                (Some(_), None) if self.over[1] => 0,
                (None, Some(_)) if self.over[0] => 1,
                _ if self.is_full(0) || self.is_full(1) => return Err(self.no_room()),
                _ => return Ok(()),
            };
            self.alone(alone);
        }
    }

    fn pop(&mut self, side: usize) -> Option<Waiting> {
        let waiting = self.waiting[side].pop_front()?;
        self.held[side] -= weight(&waiting.item);
        Some(waiting)
    }

    /// The first message of a side has no counterpart.
    fn alone(&mut self, side: usize) {
        let Some(waiting) = self.pop(side) else { return };
        let report = &mut self.report;
        *[&mut report.only_a, &mut report.only_b][side] += 1;
        if report.first_alone.as_ref().is_none_or(|(place, _)| waiting.time < place.time) {
            let place =
                Place { sample: report.compared, step: waiting.step, time: waiting.time, ..Place::default() };
            report.first_alone = Some((place, side == 0));
        }
    }

    /// True if the pair of messages that was counted last is not one of those to compare.
    fn is_left_out(&self) -> bool {
        self.options.window.leaves_out(self.pairs - 1)
    }

    fn compare_front(&mut self, watch: &mut Option<Watch<'_>>) -> Result<(), CompareError> {
        let (Some(a), Some(b)) = (self.pop(0), self.pop(1)) else { return Ok(()) };
        self.pairs += 1;
        if self.is_left_out() {
            return Ok(());
        }
        if let Some(watch) = watch {
            let [channel, other] = self.ids;
            let log_time = a.item.log_time;
            let matched = Matched { channel, other, log_time, a: a.item.bytes(), b: b.item.bytes() };
            watch(&matched).map_err(CompareError::Watch)?;
        }
        let place = Place { sample: self.report.compared, step: a.step, time: a.time, ..Place::default() };
        self.report.compared += 1;
        let Some([layout_a, layout_b]) = &self.layouts else {
            let list = |item: &Item| List::Bytes(vec![item.bytes().to_vec()]);
            let sample = Sample { a: &list(&a.item), b: &list(&b.item), place, position: &|_| None };
            self.fields[0].meter.take(&sample);
            return Ok(());
        };
        let is_same = a.item.bytes() == b.item.bytes();
        let [values_a, values_b] = self.values.as_mut_slice() else { return Ok(()) };
        if layout_a.decode(a.item.bytes(), values_a).is_err() {
            // two misfits of the same bytes are still the same
            self.report.undecoded += u64::from(!is_same);
            return Ok(());
        }
        if is_same && self.interchangeable {
            for field in self.fields.iter_mut().filter(|field| !field.ignored) {
                field.meter.take_same(&values_a.lists[field.leaf_a], place.clone());
            }
            values_a.release();
            return Ok(());
        }
        if layout_b.decode(b.item.bytes(), values_b).is_err() {
            self.report.undecoded += 1;
            return Ok(());
        }
        let differ = measure(&mut self.fields, values_a, values_b, &place, false, self.starts.is_some());
        self.report.axes_differ |= differ;
        values_a.release();
        values_b.release();
        Ok(())
    }

    /// Interpolates the new recording at the times of the reference.
    fn interpolate(&mut self, mode: Mode) -> Result<(), CompareError> {
        let after = if mode == Mode::Cubic { 2 } else { 1 };
        loop {
            let Some(time) = self.waiting[0].front().map(|front| front.time) else {
                // what of the new recording lies before all that is left of the reference is not needed
                while self.over[0] && !self.waiting[1].is_empty() {
                    self.pass_by();
                }
                return if self.is_full(1) { Err(self.no_room()) } else { Ok(()) };
            };
            let later = self.waiting[1].iter().rev().take_while(|waiting| waiting.time >= time).count();
            if later < after && !self.over[1] {
                let is_full = self.is_full(0) || self.is_full(1);
                return if is_full { Err(self.no_room()) } else { Ok(()) };
            }
            // two messages before the time are enough for every mode
            while self.waiting[1].get(2).is_some_and(|third| third.time <= time) {
                self.pass_by();
            }
            // only once nothing more can come
            if self.report.messages[1] == 0 {
                self.alone(0);
                continue;
            }
            let Some(a) = self.pop(0) else { return Ok(()) };
            self.pairs += 1;
            if !self.is_left_out() {
                self.compare_between(&a, mode);
            }
        }
    }

    /// The first message of the new recording is not needed any more.
    fn pass_by(&mut self) {
        // only once nothing more can come
        let Some((first, last)) = self.report.spans[0] else { return self.alone(1) };
        let Some(passed) = self.pop(1) else { return };
        self.report.outside[1] += u64::from(passed.time < first || passed.time > last);
    }

    fn compare_between(&mut self, a: &Waiting, mode: Mode) {
        let Some([layout_a, layout_b]) = &self.layouts else { return };
        let b = &self.waiting[1];
        let next = b.iter().position(|waiting| waiting.time >= a.time);
        let Some(next) = next.filter(|&next| next > 0 || b[next].time == a.time) else {
            self.report.outside[0] += 1;
            return;
        };
        let exact = b[next].time == a.time;
        let chosen: Vec<usize> = match mode {
            _ if exact => vec![next],
            Mode::Nearest if a.time - b[next - 1].time <= b[next].time - a.time => vec![next - 1],
            Mode::Nearest => vec![next],
            Mode::Cubic => (next.saturating_sub(2)..(next + 2).min(b.len())).collect(),
            _ => vec![next - 1, next],
        };
        let [values_a, values_b] = self.values.as_mut_slice() else { return };
        let mut points = Vec::new();
        for &i in &chosen {
            let mut values = layout_b.values();
            if layout_b.decode(b[i].item.bytes(), &mut values).is_err() {
                self.report.undecoded += 1;
                return;
            }
            points.push((b[i].time, values));
        }
        if layout_a.decode(a.item.bytes(), values_a).is_err() {
            self.report.undecoded += 1;
            return;
        }
        mix(&points, a.time, layout_b, values_b);
        let place = Place { sample: self.report.compared, step: a.step, time: a.time, ..Place::default() };
        self.report.compared += 1;
        let differ = measure(&mut self.fields, values_a, values_b, &place, true, true);
        self.report.axes_differ |= differ;
        values_a.release();
        values_b.release();
    }

    /// Ends the comparison.
    pub(super) fn report(mut self) -> ChannelReport {
        let interval = {
            // the mean spacing of the samples, for the time of a shift
            let count = self.report.compared.saturating_sub(1).max(1) as f64;
            let times = self.fields.iter().find(|field| field.path == "time").map(|f| f.meter.measure.scale);
            times.map_or(f64::NAN, |scale| (scale.greatest - scale.least) / count)
        };
        let interpolated = self.mode.is_some_and(Mode::is_between);
        let without_keys = interpolated || self.starts.is_some();
        for mut field in self.fields {
            field.meter.finish();
            let only_place = (field.is_place && self.report.axes_differ) || (without_keys && field.is_key);
            let ignored = field.ignored || only_place;
            let within = ignored || field.meter.is_within();
            let shift = field.meter.shift.best().filter(|_| !interpolated && !ignored);
            self.report.fields.push(FieldReport {
                path: field.path,
                element: field.leaf,
                unit: field.unit,
                within,
                ignored,
                rule: field.meter.rule,
                measure: field.meter.measure,
                shift: shift.map(|(samples, left)| (samples, samples as f64 * interval, left)),
            });
        }
        let mode = self.mode.filter(|_| self.report.messages != [0; 2]);
        let starts = self.starts.map(|starts| starts.map(Start::time));
        self.report.alignment = Alignment { mode, by_itself: self.options.mode.is_none(), starts };
        self.report
    }
}
