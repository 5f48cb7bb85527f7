//! The channels under `/view`: pictures for viewers, at frames.
//!
//! They show the same run as the other channels: downsampled, rounded, mirrored to r < 0, with displacements exaggerated.
//! The exact numbers are in the other channels.
//!
//! World frame of all pictures: x = r, y up (depth is −y), z towards the viewer, in the unit of length of the recording.
//! The frame `indenter` moves with the indenter, one that gives with its centre of mass, whose deformed face is in the world frame; displacements are drawn [`Viewport::exaggeration`] times their size,
//! which the metadata of the channels state. Overlapping parts lie on [`Sheet`]s one above the other, the field lowest,
//! so that no two surfaces coincide and every viewer shows the same one.

use std::sync::{Arc, Mutex};

use prost_types::Timestamp;

use super::{Channel, Outlet};
use crate::{
    case::{Case, ViewChannel},
    message::foxglove,
};

mod fronts;
mod grid;
mod image;
mod plate;
mod profile;
mod scene;
mod section;
mod tf;
mod viewport;
mod world;

pub use profile::MARGIN as PROFILE_MARGIN;
pub use viewport::{Sheet, Viewport, range};

use section::Section;

/// Prefix of the topics of these channels.
pub const TOPICS: &str = "/view/";
/// Name of the frame of reference at rest.
pub const WORLD: &str = "world";
/// Name of the frame of reference that moves with the indenter.
pub const INDENTER: &str = "indenter";

pub(super) fn channels(case: &Case) -> Vec<Channel> {
    let viewport = Arc::new(Viewport::new(case));
    let section = Arc::new(Mutex::new(Section::new(case, &viewport)));
    let wanted = |view: &&ViewChannel| match view {
        // these show recorded fields
        ViewChannel::Field | ViewChannel::Image => !case.record.fields.is_empty(),
        ViewChannel::Tf => case.load.is_none(),
        ViewChannel::Scene | ViewChannel::Fronts | ViewChannel::Profile => true,
    };
    let channel = |view: &ViewChannel| match view {
        ViewChannel::Field => grid::channel(case, &viewport, &section),
        ViewChannel::Image => image::channel(case, &viewport, &section),
        ViewChannel::Scene => scene::channel(case, &viewport),
        ViewChannel::Fronts => fronts::channel(case, &viewport),
        ViewChannel::Tf => tf::channel(&viewport),
        ViewChannel::Profile => profile::channel(case),
    };
    case.record.views.iter().filter(wanted).map(channel).collect()
}

fn timestamp(outlet: &Outlet<'_>) -> Timestamp {
    super::log::timestamp(outlet.log_time)
}

/// An empty entity of a scene.
fn entity(id: &str, frame: &str, outlet: &Outlet<'_>) -> foxglove::SceneEntity {
    foxglove::SceneEntity {
        timestamp: Some(timestamp(outlet)),
        frame_id: frame.into(),
        id: id.into(),
        lifetime: Some(prost_types::Duration::default()),
        frame_locked: true,
        ..foxglove::SceneEntity::default()
    }
}
