//! What happens once in a contact: tension, rebound, separation.

use super::Touch;

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The interface first needs tension: t_ext of the paper.
    Extension,
    /// The velocity of the indenter changes sign.
    Rebound,
    /// The last node has left the indenter.
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
}

/// Watches the steps of a contact for events.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    extended: bool,
    rebounded: bool,
    touched: bool,
    apart: bool,
}

impl Watch {
    /// Events of one step.
    ///
    /// * `time`: t of the step \[R/c_p\]
    /// * `r`: gives the radius of a node \[R\]
    pub fn observe(&mut self, touch: &Touch, time: f64, r: impl Fn(usize) -> f64) -> Vec<Event> {
        let mut events = Vec::new();
        let mut report = |kind, r, text: String| events.push(Event { kind, text, r });
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
        if touch.touching == 0 && self.touched && !self.apart {
            self.apart = true;
            let text = format!("separation: the last node leaves the indenter at t = {time:.4}");
            report(EventKind::Separation, None, text);
        } else if touch.touching > 0 && self.apart {
            self.apart = false;
            let text = format!("recontact: the target meets the indenter again at t = {time:.4}");
            report(EventKind::Recontact, None, text);
        }
        self.touched |= touch.touching > 0;
        events
    }
}
