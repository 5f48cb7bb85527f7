//! `/view/tf`: position of the indenter in the pictures.

use std::sync::Arc;

use super::{INDENTER, Viewport, WORLD, timestamp, world::UPRIGHT};
use crate::{
    channels::{Channel, FieldNote, Rate},
    message::foxglove::{self, FrameTransform},
};

pub fn channel(viewport: &Arc<Viewport>) -> Channel {
    let viewport = Arc::clone(viewport);
    let meaning = "place of the indenter: y = -exaggeration * displacement w, y up";
    let fields = vec![FieldNote::new("transforms", viewport.world.unit.name, meaning)];
    let exaggeration = viewport.exaggeration.to_string();
    Channel::new("/view/tf", "foxglove.FrameTransforms", fields, move |view, outlet| {
        if view.frame.is_none() {
            return;
        }
        let transform = FrameTransform {
            timestamp: Some(timestamp(outlet)),
            parent_frame_id: WORLD.into(),
            child_frame_id: INDENTER.into(),
            translation: Some(viewport.world.vector(0.0, viewport.height(view.depth))),
            rotation: Some(UPRIGHT),
        };
        outlet.put(&foxglove::FrameTransforms { transforms: vec![transform] });
    })
    .emits(Rate::Frame(128))
    .remark("exaggeration", exaggeration)
}
