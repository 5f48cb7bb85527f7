//! `/event`: tension, rebound, separation and the like, in the step in which they occur.

use super::{Channel, FieldNote};
use crate::{
    case::Case,
    contact::event::EventKind,
    message::percuss::{self, event::Kind},
    units::Units,
};

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, .. } = case.units();
    let since = "since when, for events that are known only later: when contact was lost, of a separation, or turned back, of an extension";
    let mut fields = vec![
        FieldNote::new("r", length.name, "where it happened, for events that have a place"),
        FieldNote::new("since", time.name, since),
    ];
    if case.sizes.layers.len() > 1 {
        let note = "number of the interface between layers, from the struck surface down, for events at one";
        fields.push(FieldNote::new("interface", "1", note));
    }
    Channel::new("/event", "percuss.Event", fields, move |view, outlet| {
        for event in &*view.events {
            let kind = match event.kind {
                EventKind::Extension => Kind::Extension,
                EventKind::Rebound => Kind::Rebound,
                EventKind::Separation => Kind::Separation,
                EventKind::Recontact => Kind::Recontact,
                EventKind::LayerTension => Kind::LayerTension,
                EventKind::Yield => Kind::Yield,
                EventKind::Tensile => Kind::Tensile,
                EventKind::Bond => Kind::Bond,
                EventKind::Stopped => Kind::Stopped,
                EventKind::Warning(_) => Kind::Warning,
            };
            outlet.put(&percuss::Event {
                step: view.step,
                time: time.of(view.time),
                kind: kind.into(),
                text: event.text.clone(),
                r: event.r.map(|r| length.of(r)),
                since: event.since.map(|since| time.of(since)),
                interface: event.interface,
            });
        }
    })
}
