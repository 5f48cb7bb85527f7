//! `/view/tf`: position of the indenter in the pictures.

use std::sync::Arc;

use super::{INDENTER, Viewport, WORLD, timestamp, world::UPRIGHT};
use crate::{
    channels::{Channel, FieldNote, Outlet},
    message::foxglove::{self, FrameTransform},
    view::View,
};

/// The channel.
pub struct Transforms {
    viewport: Arc<Viewport>,
}

impl Transforms {
    /// The channel of a viewport.
    pub fn new(viewport: &Arc<Viewport>) -> Self {
        Self { viewport: Arc::clone(viewport) }
    }
}

impl Channel for Transforms {
    fn topic(&self) -> &'static str {
        "/view/tf"
    }

    fn schema(&self) -> &'static str {
        "foxglove.FrameTransforms"
    }

    fn fields(&self) -> Vec<FieldNote> {
        vec![FieldNote::new(
            "transforms",
            self.viewport.world.unit.name,
            "place of the indenter: y = -exaggeration * displacement w, y up",
        )]
    }

    fn remarks(&self) -> Vec<(String, String)> {
        vec![self.viewport.remark()]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        if view.frame.is_none() {
            return;
        }
        let transform = FrameTransform {
            timestamp: Some(timestamp(outlet)),
            parent_frame_id: WORLD.into(),
            child_frame_id: INDENTER.into(),
            translation: Some(self.viewport.world.vector(0.0, self.viewport.height(view.depth))),
            rotation: Some(UPRIGHT),
        };
        outlet.put(&foxglove::FrameTransforms { transforms: vec![transform] });
    }
}
