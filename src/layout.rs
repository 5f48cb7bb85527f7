//! Layouts for viewers, made for a case: which panels, what they show, titles, units, ranges.
//!
//! They are made from the topics that a recording of the case has, so that nothing in them points nowhere.

use crate::{case::Case, channels::view::Stage};

mod lichtblick;
mod plotjuggler;

/// Name of the attachment in a recording.
pub const ATTACHMENT: &str = "layout.json";

/// Curves of a panel, at most: more are no picture any more.
const MAX_CURVES: usize = 16;

/// What a layout is made from.
#[derive(Debug)]
pub struct Scenery<'a> {
    case: &'a Case,
    topics: &'a [String],
    stage: Stage,
}

impl<'a> Scenery<'a> {
    /// The scenery of a recording of `case` with these topics.
    pub fn new(case: &'a Case, topics: &'a [String]) -> Self {
        Self { case, topics, stage: Stage::new(case) }
    }

    /// Layout for Lichtblick and Foxglove, as JSON text.
    pub fn lichtblick(&self) -> String {
        format!("{:#}\n", lichtblick::layout(self))
    }

    /// Layout for PlotJuggler, as XML text.
    pub fn plotjuggler(&self) -> String {
        plotjuggler::layout(self)
    }

    fn has(&self, topic: &str) -> bool {
        self.topics.iter().any(|known| known == topic)
    }

    /// Numbers and radii of the probes that a panel shows.
    fn probes(&self) -> impl Iterator<Item = (usize, f64)> {
        let probes: &[f64] = if self.has("/probes") { &self.case.record.probes } else { &[] };
        probes.iter().copied().enumerate().take(MAX_CURVES)
    }
}
