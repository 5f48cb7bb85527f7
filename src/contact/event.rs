//! Events of a contact: tension, rebound, separation.
//!
//! A contact of one node chatters: the node opens for a step or two and closes again. And an indenter that still moves into the
//! target reaches it again. So a separation needs an indenter that does not move inwards and no node in contact for the time
//! `Δr/c_s` in which a wave along r passes a node; the event is reported then, with the time at which contact was lost.

use std::io;

use serde::{Deserialize, Serialize};

use super::{
    ContactState, Rule,
    turn::{Top, Turn},
};
use crate::{
    state::{StateError, StateReader, StateWriter},
    units::Units,
};

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The interface first needs tension: t_ext of the paper. Under a head that spreads: the contact is widest and turns back, see
    /// [`Turn`].
    Extension,
    /// The velocity of the indenter changes sign.
    Rebound,
    /// No node has been in contact with the indenter, which moves away, for the time that a wave takes from node to node.
    Separation,
    /// Contact begins again after a separation.
    Recontact,
    /// Layers of target or indenter first pull at each other.
    LayerTension,
    /// The stress of von Mises first passes the yield strength.
    Yield,
    /// The first principal stress first passes the tensile strength.
    Tensile,
    /// Tension and shear at an interface first pass the strength of its bond.
    Bond,
    /// The run stops before its end time.
    Stopped,
    /// Results are outside the range of validity; the code is that of a finding.
    Warning(&'static str),
}

/// An event and where it happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Kind.
    pub kind: EventKind,
    /// Description in words.
    pub text: String,
    /// Radius, of an extension (the largest one of a contact that turns back) the tension of an interface, or a strength that is passed \[R\].
    pub r: Option<f64>,
    /// Time at which contact was lost, of a separation, or turned back, of an extension: both are reported later \[R/c_p\].
    pub since: Option<f64>,
    /// Number of the interface between layers of the target, from 1 on, of a tension there and of the strength of its bond.
    pub interface: Option<u32>,
}

impl Event {
    pub(crate) fn warning(about: &'static str, text: &str) -> Self {
        let text = format!("warning: {text}");
        Self { kind: EventKind::Warning(about), text, r: None, since: None, interface: None }
    }
}

/// Finds the events in the steps of a contact.
#[derive(Clone, Debug)]
pub struct Watch {
    hold: f64,
    rule: Rule,
    units: Units,
    turn: Option<Turn>,
    seen: Seen,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Seen {
    extended: bool,
    rebounded: bool,
    had_contact: bool,
    /// Time of the first step without contact after the last one with it.
    lost: Option<f64>,
    apart: bool,
    top: Top,
}

/// Share of a time that may be rounding.
const SLIVER: f64 = 1e-9;

impl Watch {
    /// State before the first step.
    ///
    /// * `hold`: time without contact that makes a separation, Δr/c_s \[R/c_p\]
    /// * `rule`: how surface and indenter touch
    /// * `units`: of the numbers in the texts
    /// * `turn`: of a contact that spreads, which is its extension
    pub fn new(hold: f64, rule: Rule, units: Units, turn: Option<Turn>) -> Self {
        Self { hold, rule, units, turn, seen: Seen::default() }
    }

    /// Events of one step.
    ///
    /// * `time`: t of the step \[R/c_p\]
    /// * `r`: gives the radius of a node \[R\]
    pub fn observe(&mut self, state: &ContactState, time: f64, r: impl Fn(usize) -> f64) -> Vec<Event> {
        let mut events = Vec::new();
        if self.rule == Rule::Load {
            return events;
        }
        let at = self.units.time.text(time);
        let mut report =
            |kind, r, since, text: String| events.push(Event { kind, text, r, since, interface: None });
        if let Some(turn) = self.turn.filter(|_| !self.seen.extended) {
            if let Some((since, r)) = turn.observe(&mut self.seen.top, time, state.contact_radius) {
                self.seen.extended = true;
                self.seen.top = Top::default();
                let [place, at] = [self.units.length.text(r), self.units.time.text(since)];
                let text =
                    format!("extension: the contact is widest, r = {place}, and turns back at t = {at}");
                report(EventKind::Extension, Some(r), Some(since), text);
            }
        } else if let Some(i) = state.extended.filter(|_| !self.seen.extended) {
            self.seen.extended = true;
            let r = r(i);
            // a contact that only pushes opens there; one that is glued, or whose motion is given, pulls
            let what = match self.rule {
                Rule::Unilateral => "the target first leaves the indenter",
                Rule::Bilateral | Rule::Prescribed | Rule::Load => "the target first pulls at the indenter",
            };
            let text = format!("extension: {what}, at r = {}, t = {at}", self.units.length.text(r));
            report(EventKind::Extension, Some(r), None, text);
        }
        if state.velocity <= 0.0 && !self.seen.rebounded {
            self.seen.rebounded = true;
            let text = format!("rebound: the indenter stops and turns back at t = {at}");
            report(EventKind::Rebound, None, None, text);
        }
        if state.nodes > 0 {
            self.seen.lost = None;
            if self.seen.apart {
                self.seen.apart = false;
                let text = format!("recontact: the target meets the indenter again at t = {at}");
                report(EventKind::Recontact, None, None, text);
            }
        } else if self.seen.had_contact {
            let lost = *self.seen.lost.get_or_insert(time);
            let is_held = time - lost >= self.hold * (1.0 - SLIVER);
            if !self.seen.apart && is_held && state.velocity <= 0.0 {
                self.seen.apart = true;
                let since = self.units.time.text(lost);
                let text = format!("separation: the last node has left the indenter at t = {since}");
                report(EventKind::Separation, None, Some(lost), text);
            }
        }
        self.seen.had_contact |= state.nodes > 0;
        events
    }

    /// Writes what has happened so far.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    pub fn save(&self, out: &mut StateWriter<'_>) -> io::Result<()> {
        out.put(&self.seen)
    }

    /// Restores the state written by [`Watch::save`].
    ///
    /// # Errors
    ///
    /// The stream cannot be read.
    pub fn load(&mut self, from: &mut StateReader<'_>) -> Result<(), StateError> {
        self.seen = from.get()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Geometry;

    /// Kinds of events but the rebound, with the times of their steps and of the loss of contact.
    fn watch(nodes: &[usize], hold: f64, velocity: f64) -> Vec<(EventKind, f64, Option<f64>)> {
        let mut watch = Watch::new(hold, Rule::Unilateral, Units::new(Geometry::Axisymmetric, None), None);
        let mut seen = Vec::new();
        for (step, &nodes) in nodes.iter().enumerate() {
            let state = ContactState { velocity, nodes, ..ContactState::default() };
            let time = 0.5 * step as f64;
            let events = watch.observe(&state, time, |_| 0.0);
            let others = events.into_iter().filter(|event| event.kind != EventKind::Rebound);
            seen.extend(others.map(|event| (event.kind, time, event.since)));
        }
        seen
    }

    #[test]
    fn a_node_that_opens_for_a_step_is_no_separation() {
        // steps of 0.5; the wave along r takes one step, then two
        assert_eq!(watch(&[1, 0, 1, 0, 1, 0], 0.5, -1.0), []);
        assert_eq!(watch(&[1, 0, 0, 1, 0, 0, 1], 1.0, -1.0), []);
        let apart = |time, since| (EventKind::Separation, time, Some(since));
        assert_eq!(watch(&[1, 0, 1, 0, 0, 0], 0.5, -1.0), [apart(2.0, 1.5)]);
        assert_eq!(watch(&[0, 2, 1, 0, 0, 0, 0], 1.0, 0.0), [apart(2.5, 1.5)]);
        // an indenter that moves inwards comes back
        assert_eq!(watch(&[1, 0, 0, 0, 0, 0, 0], 0.5, 1.0), []);
    }

    #[test]
    fn an_extension_is_of_the_contact_with_the_indenter() {
        for (rule, expected) in [
            (Rule::Unilateral, "extension: the target first leaves the indenter, at r = 2"),
            (Rule::Bilateral, "extension: the target first pulls at the indenter, at r = 2"),
        ] {
            let mut watch = Watch::new(1.0, rule, Units::new(Geometry::Axisymmetric, None), None);
            let state =
                ContactState { velocity: 1.0, nodes: 5, extended: Some(4), ..ContactState::default() };
            let events = watch.observe(&state, 3.0, |node| 0.5 * node as f64);
            assert!(events.len() == 1 && events[0].text.starts_with(expected), "{events:?}");
        }
    }

    #[test]
    fn there_is_a_recontact_only_after_a_separation() {
        let events = watch(&[1, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0], 0.5, -1.0);
        let expected = [
            (EventKind::Separation, 2.0, Some(1.5)),
            (EventKind::Recontact, 3.0, None),
            (EventKind::Separation, 5.0, Some(4.5)),
        ];
        assert_eq!(events, expected);
    }
}
