//! Messages of a channel that belong together.

use std::{
    cmp::Ordering,
    collections::{HashMap, VecDeque},
    ops::Range,
};

use super::{
    clock,
    convert::Converter,
    field::ComparedField,
    measure::Location,
    meter::Sample,
    mode::{LOOKED_AT, Mode, Moment, choose, have_common_step},
    options::{Matched, Options, Watch},
    report::{ChannelReport, FieldReport, Hint, Verdict},
    resample::interpolate,
    structure::Pair,
    sums::Scale,
};
use crate::{
    channel::Channel,
    convention,
    failure::Failure,
    instant::Instant,
    messages::{Decoder, Kept, Recording},
    wire::{Layout, List, Type, Values},
};

/// Messages that may wait whatever their size: as many as interpolation needs, and some.
const LEAST_WAITING: usize = 8;

/// Leaf of the step of a message: a plain whole number named `step`.
fn step_leaf(layout: &Layout) -> Option<usize> {
    let leaf = layout.find(convention::STEP)?;
    let is_integer = matches!(layout.leaves[leaf].kind, Type::UInt | Type::Int);
    (is_integer && layout.leaves[leaf].is_single).then_some(leaf)
}

/// Memory that a message takes while it waits \[bytes\].
fn weight(item: &Kept) -> usize {
    /// A queue grows to twice its length; a message of its own is a block.
    const BLOCK: usize = 2 * size_of::<Waiting>() + 32;
    BLOCK + item.data.len()
}

/// A message that waits.
struct Waiting {
    item: Kept,
    moment: Moment,
    /// Outside the times asked for: what is inside may be interpolated with it, itself it is not compared.
    outside: bool,
    /// It was compared, or interpolated with, and what is not interpolated is that of a message that was compared.
    used: bool,
}

/// Aligns the messages of two channels and measures them.
pub(super) struct Aligner<'a> {
    channels: [&'a Channel; 2],
    /// Of the reference.
    id: u16,
    /// None where messages are compared as bytes.
    decoders: Option<[Decoder; 2]>,
    /// The same bytes mean the same in both.
    interchangeable: bool,
    /// Puts messages of the new channel into the units of the reference.
    converter: Converter,
    fields: Vec<ComparedField>,
    mode: Option<Mode>,
    /// Something is allowed of one of the fields.
    is_tolerant: bool,
    /// Messages of the reference at exactly the time of one of the new recording.
    exact: u64,
    /// The time of the last message of the reference, and its number among those of that time.
    at: Option<(Instant, usize)>,
    /// Only one of the channels is timed by its log time.
    is_mixed: bool,
    options: &'a Options,
    /// What is added to the times of the new recording.
    offset: f64,
    starts: Option<[Instant; 2]>,
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
        offset: Option<f64>,
        scales: &HashMap<(u16, usize), Scale>,
        room: usize,
    ) -> Self {
        let channels = [&a.channels[&pair.a], &b.channels[&pair.b]];
        let topic = &channels[0].topic;
        let decoders = Decoder::of(channels[0]).zip(Decoder::of(channels[1])).map(<[Decoder; 2]>::from);
        // messages without any field are compared as bytes, which both must have at the same times
        let decoders = decoders.filter(|both| both.iter().any(|decoder| decoder.layout().leaves.len() > 1));
        let layouts = decoders.as_ref().map(|both| both.each_ref().map(Decoder::layout));
        let fields = match layouts {
            None => vec![ComparedField::whole(topic, options)],
            Some(layouts) => {
                let known = |leaf: usize| scales.get(&(pair.a, leaf)).copied();
                ComparedField::all(channels, layouts, &pair.leaves, &pair.converter, options, known)
            }
        };
        let interchangeable = pair.converter.is_empty() && layouts.is_some_and(|[a, b]| a.is_like(b));
        // there is nothing between bytes
        let mode =
            options.mode.map(|mode| if layouts.is_none() && mode.is_between() { Mode::Time } else { mode });
        let is_tolerant = fields.iter().any(|field| !field.is_key && field.is_tolerant());
        Self {
            channels,
            id: pair.a,
            decoders,
            interchangeable,
            converter: pair.converter,
            fields,
            mode,
            is_tolerant,
            exact: 0,
            at: None,
            is_mixed: channels[0].has_time() != channels[1].has_time(),
            options,
            offset: offset.unwrap_or(0.0),
            starts: pair.starts,
            room,
            pairs: 0,
            waiting: [VecDeque::new(), VecDeque::new()],
            held: [0; 2],
            over: [false; 2],
            report: ChannelReport {
                topic: topic.clone(),
                common: options.common,
                ..ChannelReport::default()
            },
        }
    }

    pub(super) fn has_failed(&self) -> bool {
        self.report.lacks_messages()
            || self.fields.iter().any(|field| !field.ignored && field.meter.measure.first_beyond.is_some())
    }

    /// Takes a message of the reference (side 0) or of the new recording (side 1).
    pub(super) fn push(
        &mut self,
        side: usize,
        item: Kept,
        watch: &mut Option<Watch<'_>>,
    ) -> Result<(), Failure> {
        let channel = self.channels[side];
        let start = self.starts.map(|starts| starts[side]);
        let mut time = clock::time(channel, start, &item.data, item.log_time);
        if let (1, Instant::Number(number)) = (side, &mut time) {
            *number = self.converter.time(*number);
        }
        if side == 1 && self.offset != 0.0 {
            time = time.later(self.offset);
        }
        let outside = !self.options.window.holds(time);
        if outside && !(side == 1 && self.mode.map_or(self.is_tolerant, Mode::is_between)) {
            return Ok(());
        }
        let time = if self.is_mixed { Instant::Number(time.number()) } else { time };
        let layout = channel.layout.as_ref();
        let step = layout.and_then(|layout| layout.peek(step_leaf(layout)?, &item.data));
        let moment = Moment { step: step.map(|step| step as u64), time };
        self.held[side] += weight(&item);
        self.waiting[side].push_back(Waiting { item, moment, outside, used: false });
        if outside {
            self.keep_supports();
            return self.advance(watch);
        }
        self.report.messages[side] += 1;
        let (first, last) = self.report.spans[side].get_or_insert((time, time));
        // NaN is neither first nor last, if there is another
        if time < *first || first.number().is_nan() {
            *first = time;
        }
        if time > *last || last.number().is_nan() {
            *last = time;
        }
        self.advance(watch)
    }

    /// Of messages outside the times asked for, keeps the two before and the two after: no mode needs more.
    fn keep_supports(&mut self) {
        let is_before = |waiting: &Waiting| self.options.window.is_before(waiting.moment.time);
        let waiting = &self.waiting[1];
        let Some(new) = waiting.back().map(is_before) else { return };
        let alike = waiting.iter().rev().take_while(|other| other.outside && is_before(other) == new).count();
        if alike > 2 {
            let index = waiting.len() - if new { alike } else { 1 };
            self.held[1] -= self.waiting[1].remove(index).map_or(0, |left_out| weight(&left_out.item));
        }
    }

    /// True if a side has more waiting than there is room for, and more than any way of comparing needs.
    fn is_full(&self, side: usize) -> bool {
        let room = if self.waiting[side].len() > LEAST_WAITING { self.room } else { 8 * self.room };
        self.held[side] > room
    }

    /// No more messages will come from a side.
    pub(super) fn end(&mut self, side: usize, watch: &mut Option<Watch<'_>>) -> Result<(), Failure> {
        self.over[side] = true;
        self.advance(watch)
    }

    fn advance(&mut self, watch: &mut Option<Watch<'_>>) -> Result<(), Failure> {
        let mode = match self.mode {
            Some(mode) => mode,
            None => {
                let seen = |side: usize| self.report.messages[side] >= LOOKED_AT as u64 || self.over[side];
                if !((seen(0) && seen(1)) || self.is_full(0) || self.is_full(1)) {
                    return Ok(());
                }
                let mode = self.choose();
                if !mode.is_between() {
                    self.waiting[1].retain(|waiting| !waiting.outside);
                    self.held[1] = self.waiting[1].iter().map(|waiting| weight(&waiting.item)).sum();
                }
                *self.mode.insert(mode)
            }
        };
        match mode {
            Mode::Step | Mode::Time => self.match_keys(mode, watch),
            Mode::Nearest | Mode::Linear | Mode::Cubic => self.interpolate(mode),
        }
    }

    /// The mode that fits the first messages: one in which something else than messages of the same step or time is
    /// compared only with a tolerance.
    fn choose(&mut self) -> Mode {
        let first = |waiting: &VecDeque<Waiting>| -> Vec<Moment> {
            let inside = waiting.iter().filter(|waiting| !waiting.outside);
            inside.take(LOOKED_AT).map(|waiting| waiting.moment).collect()
        };
        let [a, b] = self.waiting.each_ref().map(first);
        let mode = choose([&a, &b], self.decoders.is_some());
        if self.is_tolerant || matches!(mode, Mode::Step | Mode::Time) {
            return mode;
        }
        self.report.hint = Some(Hint::Between);
        if have_common_step([&a, &b]) { Mode::Step } else { Mode::Time }
    }

    /// Messages of equal keys are compared; those in between are unmatched.
    fn match_keys(&mut self, mode: Mode, watch: &mut Option<Watch<'_>>) -> Result<(), Failure> {
        let key = |waiting: &Waiting| match (mode, waiting.moment) {
            (Mode::Step, Moment { step: Some(step), .. }) => step.into(),
            (_, Moment { time, .. }) => time.key(),
        };
        loop {
            let [a, b] = &self.waiting;
            match (a.front(), b.front()) {
                (Some(x), Some(y)) => match key(x).cmp(&key(y)) {
                    Ordering::Equal if self.may_be_last(0..2) => return self.wait(),
                    Ordering::Equal => self.compare_front(watch)?,
                    Ordering::Less => self.unmatched(0),
                    Ordering::Greater => self.unmatched(1),
                },
                (Some(_), None) if self.over[1] => self.unmatched(0),
                (None, Some(_)) if self.over[0] => self.unmatched(1),
                _ => return self.wait(),
            }
        }
    }

    /// Fails if there is no room to wait for more messages.
    fn wait(&self) -> Result<(), Failure> {
        if !self.is_full(0) && !self.is_full(1) {
            return Ok(());
        }
        Err(Failure::Failed(format!(
            "messages of `{}` are too far from their counterparts in the other recording to be kept until those come; \
             compare only that topic (--topic), or raise --max-memory",
            self.report.topic
        )))
    }

    fn pop(&mut self, side: usize) -> Option<Waiting> {
        let waiting = self.waiting[side].pop_front()?;
        self.held[side] -= weight(&waiting.item);
        Some(waiting)
    }

    /// The first message of a side has no counterpart.
    fn unmatched(&mut self, side: usize) {
        if let Some(waiting) = self.pop(side) {
            self.alone(side, waiting.moment);
        }
    }

    /// Counts a message without counterpart.
    fn alone(&mut self, side: usize, moment: Moment) {
        let report = &mut self.report;
        report.only[side] += 1;
        if report.first_unmatched.as_ref().is_none_or(|(place, _)| moment.time < place.time) {
            report.first_unmatched = Some((moment.place(report.compared), side == 0));
        }
    }

    /// The place of a sample, which is counted.
    fn sample(&mut self, a: &Waiting) -> Location {
        self.report.compared += 1;
        a.moment.place(self.report.compared - 1)
    }

    /// True if the pair of messages that was counted last is not one of those to compare.
    ///
    /// * `sides`: those of which every message counts
    fn is_left_out(&self, mut sides: Range<usize>) -> bool {
        let is_last = sides.any(|side| self.over[side] && self.waiting[side].is_empty());
        self.options.window.leaves_out(self.pairs - 1) && !is_last
    }

    /// True if the next pair of messages is compared only if it is the last one, which is not known yet.
    fn may_be_last(&self, mut sides: Range<usize>) -> bool {
        let is_open = sides.any(|side| !self.over[side] && self.waiting[side].len() == 1);
        self.options.window.leaves_out(self.pairs) && is_open
    }

    fn compare_front(&mut self, watch: &mut Option<Watch<'_>>) -> Result<(), Failure> {
        let (Some(a), Some(b)) = (self.pop(0), self.pop(1)) else { return Ok(()) };
        self.pairs += 1;
        if self.is_left_out(0..2) {
            return Ok(());
        }
        if let Some(watch) = watch {
            watch(&Matched {
                channel: self.id,
                log_time: a.item.log_time,
                a: &a.item.data,
                b: &b.item.data,
            })?;
        }
        self.compare_stamps(&a.item, &b.item);
        let place = self.sample(&a);
        let Some(mut decoders) = self.decoders.take() else {
            let [a, b] = [a, b].map(|waiting| List::Bytes(vec![waiting.item.data]));
            self.fields[0].meter.take(&a, &b, &Sample { place, position: &|_| None });
            return Ok(());
        };
        self.compare_values(&mut decoders, [&a.item.data, &b.item.data], &place);
        self.decoders = Some(decoders);
        Ok(())
    }

    /// Compares two messages; equal bytes are decoded once.
    fn compare_values(&mut self, decoders: &mut [Decoder; 2], [a, b]: [&[u8]; 2], place: &Location) {
        let is_same = a == b && self.interchangeable && !self.is_moved();
        let [mut decoded_a, mut decoded_b] = decoders.each_mut().map(Decoder::next);
        let Ok(values_a) = decoded_a.values(a) else {
            // equal bytes that do not fit are still equal
            self.report.undecoded += u64::from(a != b);
            return;
        };
        if is_same {
            for field in self.fields.iter_mut().filter(|field| !field.ignored) {
                field.meter.take_same(&values_a.lists[field.leaf_a], place.clone());
            }
        } else if let Ok(values_b) = decoded_b.values(b) {
            self.converter.apply(values_b);
            self.measure([values_a, values_b], place, false);
        } else {
            self.report.undecoded += 1;
        }
    }

    /// Counts what differs of the headers of two messages.
    fn compare_stamps(&mut self, a: &Kept, b: &Kept) {
        let of = |item: &Kept| [item.log_time, item.publish_time, item.sequence.into()];
        for (stamp, (a, b)) in self.report.stamps.iter_mut().zip(of(a).into_iter().zip(of(b))) {
            if a != b {
                stamp.count += 1;
                stamp.first.get_or_insert((a, b));
            }
        }
    }

    /// True if the same time in both messages is not the same.
    fn is_moved(&self) -> bool {
        self.offset != 0.0 || self.starts.is_some_and(|[a, b]| a != b)
    }

    /// Measures the decoded messages.
    fn measure(&mut self, [a, b]: [&Values; 2], place: &Location, interpolated: bool) {
        // asked for, or with a tolerance, times count from the start; else they are compared as they are
        let is_moved = self.options.relative || self.offset != 0.0;
        let is_from_start = |field: &ComparedField| is_moved || field.is_tolerant();
        let mut starts = self.starts.map(|[a, b]| [a.number(), self.converter.time(b.number())]);
        if self.offset != 0.0 {
            let [a, b] = starts.unwrap_or_default();
            starts = Some([a, b - self.offset]);
        }
        for field in self.fields.iter_mut().filter(|field| !field.ignored) {
            let starts = starts.filter(|_| is_from_start(field));
            self.report.axes_differ |= field.measure(a, b, place, interpolated, starts);
        }
    }

    /// Interpolates the new recording at the times of the reference.
    fn interpolate(&mut self, mode: Mode) -> Result<(), Failure> {
        let after = if mode == Mode::Cubic { 2 } else { 1 };
        loop {
            let Some(time) = self.waiting[0].front().map(|front| front.moment.time) else {
                while self.over[0] && !self.waiting[1].is_empty() {
                    self.pass_by();
                }
                return self.wait();
            };
            let later = self.waiting[1].iter().rev().take_while(|waiting| waiting.moment.time > time).count();
            if later < after && !self.over[1] {
                return self.wait();
            }
            // two messages before the time are enough for every mode
            while self.waiting[1].get(2).is_some_and(|third| third.moment.time < time) {
                self.pass_by();
            }
            if self.may_be_last(0..1) {
                return self.wait();
            }
            let Some(a) = self.pop(0) else { return Ok(()) };
            self.pairs += 1;
            self.compare_between(&a, mode);
        }
    }

    /// The first message of the new recording is not needed any more: nothing was compared with it unless it was used. That is
    /// what a mode that was asked for says of those between the times of the reference.
    fn pass_by(&mut self) {
        let Some(Waiting { moment, .. }) = self.pop(1).filter(|passed| !passed.used && !passed.outside)
        else {
            return;
        };
        let is_inside =
            self.report.spans[0].is_some_and(|(first, last)| (first..=last).contains(&moment.time));
        match is_inside && self.options.mode.is_some() {
            true => self.report.between += 1,
            false => self.alone(1, moment),
        }
    }

    /// The messages of the new recording that a message of the reference is compared with; none if it is outside of them.
    ///
    /// * `ordinal`: number of the message among those of its time
    fn partners(&self, at: Instant, ordinal: usize, mode: Mode) -> Option<Range<usize>> {
        let (b, time) = (&self.waiting[1], |i: usize| self.waiting[1][i].moment.time);
        let next = (0..b.len()).find(|&i| time(i) >= at)?;
        let equal = (next..b.len()).take_while(|&i| time(i) == at).count();
        if equal > 0 {
            // of several at one time each belongs to that of its number
            let same = next + ordinal.min(equal - 1);
            return Some(same..same + 1);
        }
        let before = next.checked_sub(1)?;
        Some(match mode {
            Mode::Nearest if at.since(time(before)) <= time(next).since(at) => before..next,
            Mode::Nearest => next..next + 1,
            Mode::Cubic => {
                // two messages at one time are a jump: nothing smooth leads beyond it
                let first = before.checked_sub(1).filter(|&i| time(i) < time(before)).unwrap_or(before);
                let has_second = next + 1 < b.len() && time(next + 1) > time(next);
                first..next + 1 + usize::from(has_second)
            }
            _ => before..next + 1,
        })
    }

    fn compare_between(&mut self, a: &Waiting, mode: Mode) {
        let at = a.moment.time;
        let ordinal = self.at.filter(|(time, _)| *time == at).map_or(0, |(_, number)| number + 1);
        self.at = Some((at, ordinal));
        let partners = self.partners(at, ordinal, mode);
        let Some(chosen) = partners else {
            if !self.is_left_out(0..1) {
                self.alone(0, a.moment);
            }
            return;
        };
        let b = &self.waiting[1];
        let time = |i: usize| b[i].moment.time;
        self.exact += u64::from(chosen.len() == 1 && time(chosen.start) == at);
        if self.is_left_out(0..1) {
            self.waiting[1].range_mut(chosen).for_each(|waiting| waiting.used = true);
            return;
        }
        // log times are small and exact from the time that is wanted
        let number = |time: Instant| time.nanoseconds().map_or(time.number(), |_| time.since(at));
        let Some([mut decoder_a, mut decoder_b]) = self.decoders.take() else { return };
        let point = |i: usize| {
            let mut values = decoder_b.take(&b[i].item.data).ok()?;
            self.converter.apply(&mut values);
            Some((number(time(i)), values))
        };
        let points: Option<Vec<(f64, Values)>> = chosen.clone().map(point).collect();
        let points = points.unwrap_or_default();
        let between = interpolate(&points, number(at), decoder_b.layout());
        for (i, waiting) in self.waiting[1].range_mut(chosen).enumerate() {
            let nearest = between.as_ref().map(|between| &points[between.nearest].1);
            let is_alike = |nearest| self.fields.iter().all(|field| field.is_alike(&points[i].1, nearest));
            waiting.used |= nearest.is_none_or(is_alike);
        }
        match (decoder_a.next().values(&a.item.data), between) {
            (Ok(values_a), Some(between)) => {
                let place = self.sample(a);
                self.fields.iter_mut().for_each(|field| field.cut(&between.cut));
                self.measure([values_a, &between.values], &place, true);
            }
            _ => self.report.undecoded += 1,
        }
        self.decoders = Some([decoder_a, decoder_b]);
    }

    /// Ends the comparison.
    pub(super) fn report(mut self) -> ChannelReport {
        let samples = self.report.compared;
        let between = self.mode.is_some_and(Mode::is_between);
        self.report.interpolated = between && samples > 0 && self.report.messages != [self.exact; 2];
        let fields = self.fields.into_iter().map(|field| {
            let is_from_start = self.starts.is_some() && (self.options.relative || field.is_tolerant());
            field.report(&self.report, self.is_tolerant, between, is_from_start || self.offset != 0.0)
        });
        self.report.fields = fields.collect();
        let is_moved = self.starts.is_some() && !self.options.relative;
        let is_late = |field: &FieldReport| field.leaf.path == convention::TIME && !field.within;
        if self.report.fields.iter().any(|field| field.untolerated) {
            self.report.hint = Some(Hint::Tolerance);
        } else if is_moved && self.report.fields.iter().any(is_late) {
            self.report.hint = Some(Hint::Relative);
        }
        let lacks_elements = |field: &FieldReport| !field.ignored && field.measure.dropped > 0;
        let lacks = self.report.only != [0; 2] || self.report.fields.iter().any(lacks_elements);
        self.report.hint = self.report.hint.or((between && lacks).then_some(Hint::Common));
        self.report.hint = self.report.hint.filter(|_| self.report.verdict() == Verdict::Different);
        self.report.mode = self.mode.filter(|_| self.report.messages != [0; 2]);
        self.report.automatic = self.options.mode.is_none();
        self.report.starts = self.starts.map(|starts| starts.map(Instant::number));
        self.report
    }
}
