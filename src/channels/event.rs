//! `/event`: tension, rebound, separation and the like, in the step in which they occur.

use super::{Channel, FieldNote, Outlet};
use crate::{
    case::Case,
    contact::event::EventKind,
    message::percuss::{self, event::Kind},
    units::Units,
    view::View,
};

/// The event channel.
pub struct Event {
    units: Units,
}

impl Event {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { units: case.units() }
    }
}

impl Channel for Event {
    fn topic(&self) -> &'static str {
        "/event"
    }

    fn schema(&self) -> &'static str {
        "percuss.Event"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let since =
            "since when, for events that are known only later: when contact was lost, of a separation";
        vec![
            FieldNote::new("r", self.units.length.name, "where it happened, for events that have a place"),
            FieldNote::new("since", self.units.time.name, since),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        for event in &*view.events {
            let kind = match event.kind {
                EventKind::Extension => Kind::Extension,
                EventKind::Rebound => Kind::Rebound,
                EventKind::Separation => Kind::Separation,
                EventKind::Recontact => Kind::Recontact,
                EventKind::Stopped => Kind::Stopped,
                EventKind::Warning => Kind::Warning,
            };
            outlet.put(&percuss::Event {
                step: view.step,
                time: self.units.time.of(view.time),
                kind: kind.into(),
                text: event.text.clone(),
                r: event.r.map(|r| self.units.length.of(r)),
                since: event.since.map(|time| self.units.time.of(time)),
            });
        }
    }
}
