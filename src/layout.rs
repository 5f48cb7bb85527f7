//! Layouts for viewers, built for a case: panels with their topics, titles, units, ranges.
//!
//! They refer only to topics that a recording of the case has.

use crate::{case::Case, channels::view::Viewport, units::Units};

mod lichtblick;
#[cfg(feature = "cli")]
mod plotjuggler;

/// Name of the attachment in a recording.
pub const ATTACHMENT: &str = "layout.json";

/// Largest number of curves in a panel.
const MAX_CURVES: usize = 16;

/// Builds the layouts for a recording.
#[derive(Debug)]
pub struct LayoutBuilder<'a> {
    case: &'a Case,
    topics: &'a [String],
    viewport: Viewport,
    units: Units,
}

impl<'a> LayoutBuilder<'a> {
    /// A builder for a recording of `case` with these topics.
    pub fn new(case: &'a Case, topics: &'a [String]) -> Self {
        Self { case, topics, viewport: Viewport::new(case), units: case.units() }
    }

    /// Layout for Lichtblick and Foxglove, as JSON text.
    pub fn lichtblick(&self) -> String {
        format!("{:#}\n", lichtblick::layout(self))
    }

    /// Layout for PlotJuggler, as XML text.
    #[cfg(feature = "cli")]
    pub fn plotjuggler(&self) -> String {
        plotjuggler::layout(self)
    }

    fn has(&self, topic: &str) -> bool {
        self.topics.iter().any(|known| known == topic)
    }

    /// True if the recording is in SI: numbers of different units then differ by powers of ten, and have panels of their own.
    fn is_physical(&self) -> bool {
        self.case.scales.is_some()
    }

    /// Numbers and radii of the probes in a panel.
    fn probes(&self) -> impl Iterator<Item = (usize, f64)> {
        let probes: &[f64] = if self.has("/probes") { &self.case.record.probes } else { &[] };
        probes.iter().copied().enumerate().take(MAX_CURVES)
    }
}
