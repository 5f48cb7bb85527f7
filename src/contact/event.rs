//! What happens once in a contact: tension, rebound, separation.
//!
//! A single node can lose contact for a step or two and be pressed again: a mesh that shows a contact as one node lets it
//! chatter. And an indenter that still moves into the target meets it again. So they are apart only when the indenter does not move
//! inwards and nothing has touched it for the time in which a wave along r passes a node, `Δr/c_s`, since contact was lost; the
//! event comes then, and says since when.

use super::Touch;

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The interface first needs tension: t_ext of the paper.
    Extension,
    /// The velocity of the indenter changes sign.
    Rebound,
    /// Nothing has touched the indenter, which moves away, for the time that a wave takes from one node to the next.
    Separation,
    /// The indenter touches again after a separation.
    Recontact,
    /// The run stops before its end time.
    Stopped,
}

/// An event and where it happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The same in words.
    pub text: String,
    /// Radius, for events that have a place \[R\].
    pub r: Option<f64>,
    /// Time since when, for events that are known only later: when contact was lost, of a separation \[R/c_p\].
    pub since: Option<f64>,
}

/// Watches the steps of a contact for events.
#[derive(Clone, Debug)]
pub struct Watch {
    hold: f64,
    extended: bool,
    rebounded: bool,
    touched: bool,
    /// Time of the first step without contact after the last one with it.
    lost: Option<f64>,
    apart: bool,
}

/// Share of a time that may be rounding.
const SLIVER: f64 = 1e-9;

impl Watch {
    /// Nothing has happened yet.
    ///
    /// * `hold`: time without contact that makes a separation, Δr/c_s \[R/c_p\]
    pub fn new(hold: f64) -> Self {
        Self { hold, extended: false, rebounded: false, touched: false, lost: None, apart: false }
    }

    /// Events of one step.
    ///
    /// * `time`: t of the step \[R/c_p\]
    /// * `r`: gives the radius of a node \[R\]
    pub fn observe(&mut self, touch: &Touch, time: f64, r: impl Fn(usize) -> f64) -> Vec<Event> {
        let mut events = Vec::new();
        let mut report = |kind, r, text: String| events.push(Event { kind, text, r, since: None });
        if let Some(i) = touch.extended.filter(|_| !self.extended) {
            self.extended = true;
            let r = r(i);
            let text = format!("extension: the interface first needs tension at r = {r:.4}, t = {time:.4}");
            report(EventKind::Extension, Some(r), text);
        }
        if touch.velocity <= 0.0 && !self.rebounded {
            self.rebounded = true;
            let text = format!("rebound: the indenter stops and turns back at t = {time:.4}");
            report(EventKind::Rebound, None, text);
        }
        if touch.touching > 0 {
            self.lost = None;
            if self.apart {
                self.apart = false;
                let text = format!("recontact: the target meets the indenter again at t = {time:.4}");
                report(EventKind::Recontact, None, text);
            }
        } else if self.touched {
            let lost = *self.lost.get_or_insert(time);
            let is_held = time - lost >= self.hold * (1.0 - SLIVER);
            if !self.apart && is_held && touch.velocity <= 0.0 {
                self.apart = true;
                let text = format!("separation: the last node has left the indenter at t = {lost:.4}");
                events.push(Event { kind: EventKind::Separation, text, r: None, since: Some(lost) });
            }
        }
        self.touched |= touch.touching > 0;
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kinds of events but the rebound, with the times of their steps and since when.
    fn watch(touching: &[usize], hold: f64, velocity: f64) -> Vec<(EventKind, f64, Option<f64>)> {
        let mut watch = Watch::new(hold);
        let mut seen = Vec::new();
        for (step, &touching) in touching.iter().enumerate() {
            let touch = Touch {
                drag: 0.0,
                contact_radius: 0.0,
                velocity,
                depth: 0.0,
                work: 0.0,
                dissipated: 0.0,
                extended: None,
                touching,
            };
            let time = 0.5 * step as f64;
            let events = watch.observe(&touch, time, |_| 0.0);
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
        // on its way in it comes back
        assert_eq!(watch(&[1, 0, 0, 0, 0, 0, 0], 0.5, 1.0), []);
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
