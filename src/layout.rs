//! Layouts for viewers, built for a case: panels with their topics, titles, units, ranges.
//!
//! They refer only to topics that a recording of the case has.
//!
//! # Viewers
//!
//! One unit of dimensionless time plays as one second (`record.playback_rate`); physical cases play in 2 to 20 s, in a slow motion by a
//! power of ten that `percuss run` prints. Of more than 60 steps in a second Lichtblick has an alert, which is harmless: the same case
//! on a finer mesh plays as fast, so that recordings of both can be compared. Pictures have x = r and y up; displacements and the
//! shape of the head are drawn `exaggeration` times their size, a round number in the metadata of `/view/scene`. Pictures are
//! downsampled; exact numbers are in the other channels. The colours of a field have one range in all pictures of a run, the
//! report included: `colour_range.<field>` in the metadata of `/view/field`, estimated from the case before the run (stress:
//! 1.25·V0 for a front, and the rise behind it by reflections, or by the stiffness of the half-space), a round number. In the
//! built-in cases 0 to 0.8 % of the moved section exceeds it, under edges. On `fig5` with 100 cells and 200 frames the views take a quarter of the
//! file, on fine meshes less; they are drawn on the writer thread.
//!
//! **Lichtblick, Foxglove.** Open the file, then import its layout (Layout menu, "Import from file"):
//!
//! ```text
//! $ percuss-read export fig5.mcap --attachment layout.json -o layout.json     # or: percuss layout fig5 -o layout.json
//! ```
//!
//! It has panels for the section with indenter, surface and wave fronts; for drag, velocity and probes against time; for stress and
//! for surface and indenter along the surface at the current time; for the log. Topics of the section are switched on and off in the
//! panel's settings. Viewers have no colours with white in the middle: `/view/field` brings its own, blue tension, red
//! compression. Of a punch with a sharp edge the stress along the surface is shown in the range of the colours, and probes
//! at the edge are left out, as the stress there grows with the mesh and would flatten the rest.
//!
//! **Rerun.** `rerun fig5.mcap` shows image and log. With drag, velocity and probes as well:
//!
//! ```text
//! $ pip install rerun-sdk==0.41.0 mcap
//! $ python tools/viewers/rerun_view.py fig5.mcap      # fig5.rrd: the recording and a blueprint
//! $ rerun fig5.rrd
//! ```
//!
//! **PlotJuggler.** Load the file, then the layout of `percuss layout fig5 --viewer plotjuggler -o fig5.xml`.
//!
//! **Live and replay.** `percuss run CASE --live [ADDR]` and `percuss-read replay FILE [--addr ADDR]` serve viewers over the Foxglove
//! WebSocket protocol: in Foxglove or Lichtblick "Open connection", "Foxglove WebSocket", `ws://127.0.0.1:8765`. Without an
//! address only this machine can connect. Viewers neither slow nor change a run: a viewer that is too slow loses pictures, the file
//! gets the same bytes. `--pace 0.5` runs at half a second of log time per second, `--wait` begins 1.5 s after the last
//! subscription of a viewer, since viewers subscribe panel by panel. A replay begins in the same way; options `--speed`, `--loop`,
//! `--from`, `--to`; viewers with playback control (Foxglove) play, pause and seek.
//!
//! Every message follows its own time, at which Lichtblick places it. A later viewer, or a new panel, gets the run so far: all
//! numbers, events and log lines, and the last of the pictures (messages above 4 KiB). This uses 96 MiB of memory; beyond 64 MiB of
//! numbers the largest channel is downsampled to every second of its older messages, then every fourth. At the end of a run, or
//! of a replay with `--once`, the program waits until viewers have left, 60 s at most (`--hold SECONDS`).
//!
//! **Report.** `percuss-read report fig5.mcap` writes one self-contained page: verdict, field, profile and values at the time of a
//! slider, energy ledger, the case. It loads no other files.
//!
//! `tests/viewers/run` checks this with other programs: the Python libraries of MCAP, Rerun, a WebSocket client, Chromium. The
//! layout is checked against the recording, path by path, not in Lichtblick itself.

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

    /// Numbers and radii of the probes in a panel: all but those at a sharp edge, where the stress grows with the mesh and would
    /// flatten the others.
    fn probes(&self) -> impl Iterator<Item = (usize, f64)> {
        let probes: &[f64] = if self.has("/probes") { &self.case.record.probes } else { &[] };
        let edge = if self.case.indenter.head.is_flat() { self.viewport.reach } else { f64::INFINITY };
        let is_within = move |(_, r): &(usize, f64)| *r < edge * (1.0 - 1e-9);
        probes.iter().copied().enumerate().filter(is_within).take(MAX_CURVES)
    }
}
