//! What the JSON messages of a recording look like: by their schemas, and by the first messages where those leave it open.

use std::{collections::BTreeMap, sync::Arc};

use super::Recording;
use crate::{
    failure::Failure,
    recording::{Budget, Damage},
    text::short,
    wire::{Layout, List, json::Shape},
};

/// Messages of a channel that say what the others look like.
const FIRST: u32 = 100;

impl Recording {
    /// Gives the channels with JSON messages their layouts.
    ///
    /// * `shapes`: what the schemas say of them
    pub(super) fn learn_json(
        &mut self,
        mut shapes: BTreeMap<u16, Shape>,
        mut budget: Budget,
    ) -> Result<(), Failure> {
        // of a recording that is open by its index, empty channels are known
        let is_open =
            |id: &u16| !self.from_index || self.channels.get(id).is_some_and(|channel| channel.count > 0);
        let open = shapes.iter().filter(|(id, shape)| !shape.is_whole() && is_open(id));
        let mut left: BTreeMap<u16, u32> = open.map(|(&id, _)| (id, FIRST)).collect();
        if !left.is_empty() {
            let mut messages = self.messages(left.keys().copied(), None)?;
            while !left.is_empty() {
                let seen = messages.next(|next| {
                    let message = next.message;
                    if let (Some(shape), Some(left)) =
                        (shapes.get_mut(&message.channel), left.get_mut(&message.channel))
                    {
                        shape.observe(message.data, &mut budget);
                        *left -= 1;
                    }
                    message.channel
                })?;
                let Some(id) = seen else { break };
                left.retain(|known, left| *known != id || *left > 0);
            }
        }
        for (id, shape) in shapes {
            let Some(channel) = self.channels.get_mut(&id) else { continue };
            let Some(layout) = Layout::of_json(&shape, &channel.schema) else { continue };
            if budget.spend(layout.weight + layout.leaves.len() * size_of::<List>()) {
                channel.layout = Some(Arc::new(layout.within(self.limits.values())));
            } else {
                let reason = format!("no room for the fields of `{}` (--max-memory)", short(&channel.topic));
                self.refused.push(Damage::refusal(reason));
            }
        }
        Ok(())
    }
}
