//! `/event`: tension, rebound, separation and the like, in the step in which they occur.

use super::{Channel, FieldNote, Outlet};
use crate::{
    contact::event::EventKind,
    message::percuss::{self, event::Kind},
    view::View,
};

/// The event channel.
pub struct Event;

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
            FieldNote::new("r", "R", "where it happened, for events that have a place"),
            FieldNote::new("since", "R/c_p", since),
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
            };
            outlet.put(&percuss::Event {
                step: view.step,
                time: view.time,
                kind: kind.into(),
                text: event.text.clone(),
                r: event.r,
                since: event.since,
            });
        }
    }
}
