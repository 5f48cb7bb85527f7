//! Samples of several channels brought into common rows.

use std::{
    collections::{BTreeMap, HashMap, VecDeque},
    io,
};

use percuss_table::{Cell, Sink};

use super::request::{Align, Clock};
use crate::{instant::Instant, select::Window};

/// Cells that may wait for others of their row.
const WAITING_CELLS: usize = 1 << 20;

/// Memory of a row that waits, besides its cells: its place in the order of times, and a place for every channel \[bytes\].
const ROW: usize = 128;
const GROUP: usize = size_of::<Option<Vec<Cell>>>();

/// Memory of the cells of a sample \[bytes\].
fn weight(cells: &[Cell]) -> usize {
    let text = |cell: &Cell| if let Cell::Text(text) = cell { 16 + text.len() } else { 0 };
    GROUP + 16 + size_of_val(cells) + cells.iter().map(text).sum::<usize>()
}

/// A time, and the cells of every channel that has some then.
type Row = (Instant, Vec<Option<Vec<Cell>>>);

pub(super) struct Rows<'a> {
    pub(super) window: Window,
    pub(super) clock: Clock,
    pub(super) seen: u64,
    pub(super) written: u64,
    pub(super) label: Option<Cell>,
    pub(super) sink: &'a mut dyn Sink,
    /// Which columns have had a value.
    pub(super) filled: &'a mut Vec<bool>,
    pub(super) cells: Vec<Cell>,
    /// The newest row, if it is not one of every n-th: the last one stays.
    pub(super) left_out: Option<Row>,
}

impl Rows<'_> {
    fn take(&mut self, time: Instant, groups: Vec<Option<Vec<Cell>>>, widths: &[usize]) -> io::Result<()> {
        self.seen += 1;
        self.left_out = None;
        if self.window.leaves_out(self.seen - 1) {
            self.left_out = Some((time, groups));
            return Ok(());
        }
        self.write(time, groups, widths)
    }

    fn write(&mut self, time: Instant, groups: Vec<Option<Vec<Cell>>>, widths: &[usize]) -> io::Result<()> {
        self.cells.clear();
        self.cells.extend(self.label.clone());
        self.cells.push(self.clock.cell(time));
        for (group, &width) in groups.into_iter().zip(widths) {
            self.cells.extend(group.unwrap_or_else(|| vec![Cell::Empty; width]));
        }
        self.written += 1;
        self.filled.resize(self.cells.len(), false);
        for (filled, cell) in self.filled.iter_mut().zip(&self.cells) {
            *filled |= *cell != Cell::Empty;
        }
        self.sink.row(&self.cells)
    }
}

pub(super) struct Joiner {
    align: Align,
    widths: Vec<usize>,
    room: usize,
    /// Memory for what waits, and what of it is taken \[bytes\].
    memory: usize,
    taken: usize,
    /// Exact: rows by time, and by number among rows of the same time.
    rows: BTreeMap<(i128, usize), Row>,
    /// Exact: samples that each slot has had at the times of these rows.
    counts: HashMap<i128, Vec<usize>>,
    /// Otherwise: samples of every slot that are still needed.
    queues: Vec<VecDeque<(Instant, Vec<Cell>)>>,
    over: Vec<bool>,
}

impl Joiner {
    /// * `memory`: for samples that wait for others \[bytes\]
    pub(super) fn new(align: Align, widths: Vec<usize>, memory: usize) -> Self {
        let room = (WAITING_CELLS / (1 + widths.len() + widths.iter().sum::<usize>())).max(16);
        // one channel needs no company
        let room = if widths.len() == 1 { 0 } else { room };
        let (queues, over) = (vec![VecDeque::new(); widths.len()], vec![false; widths.len()]);
        let align = if widths.len() == 1 { Align::Exact } else { align };
        let (rows, counts) = (BTreeMap::new(), HashMap::new());
        Self { align, widths, room, memory, taken: 0, rows, counts, queues, over }
    }

    pub(super) fn put(&mut self, slot: usize, time: Instant, cells: Vec<Cell>) {
        self.taken += weight(&cells);
        if self.align != Align::Exact {
            self.queues[slot].push_back((time, cells));
            return;
        }
        let key = time.key();
        let slots = self.widths.len();
        // the n-th sample of a slot at a time goes into the n-th row of that time
        let count = &mut self.counts.entry(key).or_insert_with(|| vec![0; slots])[slot];
        let row = self.rows.entry((key, *count)).or_insert_with(|| {
            self.taken += ROW + slots * (GROUP + size_of::<usize>());
            (time, vec![None; slots])
        });
        row.1[slot] = Some(cells);
        *count += 1;
    }

    pub(super) fn ended(&mut self, slots: std::ops::Range<usize>) {
        self.over[slots].iter_mut().for_each(|over| *over = true);
    }

    /// Hands on all rows; no more are to come.
    pub(super) fn finish(mut self, rows: &mut Rows<'_>) -> io::Result<()> {
        self.drain(true, rows)?;
        match rows.left_out.take() {
            Some((time, groups)) => rows.write(time, groups, &self.widths),
            None => Ok(()),
        }
    }

    /// Hands on rows that are finished, or all of them.
    pub(super) fn drain(&mut self, all: bool, rows: &mut Rows<'_>) -> io::Result<()> {
        if self.align != Align::Exact {
            return self.drain_queues(all, rows);
        }
        while self.rows.len() > if all { 0 } else { self.room } || self.taken > self.memory {
            let Some(((key, _), (time, groups))) = self.rows.pop_first() else { break };
            self.taken -= ROW + groups.len() * (GROUP + size_of::<usize>());
            self.taken -= groups.iter().flatten().map(|cells| weight(cells)).sum::<usize>();
            if self.rows.first_key_value().is_none_or(|((next, _), _)| *next != key) {
                self.counts.remove(&key);
            }
            rows.take(time, groups, &self.widths)?;
        }
        Ok(())
    }

    fn drain_queues(&mut self, all: bool, rows: &mut Rows<'_>) -> io::Result<()> {
        loop {
            // without any channel there are no rows
            let Some(first) = self.queues.first() else { return Ok(()) };
            let Some(&(time, _)) = first.front() else {
                if self.over[0] {
                    // no more rows: what the others have is not needed
                    self.queues.iter_mut().for_each(VecDeque::clear);
                    self.taken = 0;
                }
                if self.taken > self.memory {
                    return Err(io::Error::new(
                        io::ErrorKind::OutOfMemory,
                        "too many messages wait for one of the first topic; name a topic first that begins early, trace \
                         them one by one, or raise --max-memory",
                    ));
                }
                return Ok(());
            };
            let reached =
                |queue: &VecDeque<(Instant, Vec<Cell>)>| queue.back().is_some_and(|last| last.0 >= time);
            let ready = self.queues.iter().zip(&self.over).all(|(queue, &over)| over || reached(queue));
            if !ready && !all && self.queues[0].len() <= self.room && self.taken <= self.memory {
                return Ok(());
            }
            let first = self.queues[0].pop_front().map(|(_, cells)| cells);
            self.taken -= first.as_ref().map_or(0, |cells| weight(cells));
            let mut groups = vec![first];
            for queue in &mut self.queues[1..] {
                // what lies before the sample before this time is not needed any more
                while queue.get(1).is_some_and(|next| next.0 <= time) {
                    self.taken -= queue.pop_front().map_or(0, |(_, cells)| weight(&cells));
                }
                groups.push(between(queue, time, self.align));
            }
            rows.take(time, groups, &self.widths)?;
        }
    }
}

/// The cells of a slot at a time: `queue` begins with the last sample not after it, if there is one.
fn between(queue: &VecDeque<(Instant, Vec<Cell>)>, time: Instant, align: Align) -> Option<Vec<Cell>> {
    let (first, next) = (queue.front()?, queue.get(1));
    if first.0 == time {
        return Some(first.1.clone());
    }
    let Some(next) = next.filter(|_| first.0 < time) else {
        return (align == Align::Nearest).then(|| first.1.clone());
    };
    let share = time.since(first.0) / next.0.since(first.0);
    if align == Align::Nearest {
        return Some(if share <= 0.5 { first.1.clone() } else { next.1.clone() });
    }
    let interpolate = |(a, b): (&Cell, &Cell)| match (a.number(), b.number()) {
        (Some(a), Some(b)) => Cell::Double(a + (b - a) * share),
        _ => Cell::Empty,
    };
    Some(first.1.iter().zip(&next.1).map(interpolate).collect())
}
