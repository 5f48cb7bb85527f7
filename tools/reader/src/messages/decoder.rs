//! From bytes to values: the one place where messages are decoded.

use std::sync::Arc;

use crate::{
    channel::Channel,
    wire::{DecodeError, Layout, Values},
};

/// Decodes the messages of a channel, one after the other into the same memory.
///
/// Messages that wait for others, in another file or in another order, wait as bytes and are decoded when their turn comes: as
/// values a message may take many times the memory that it takes in the file, a packed number of one byte eight.
#[derive(Clone, Debug)]
pub(crate) struct Decoder {
    layout: Arc<Layout>,
    values: Values,
}

impl Decoder {
    /// `None` for a channel without a layout.
    pub(crate) fn of(channel: &Channel) -> Option<Self> {
        channel.layout.clone().map(|layout| Self { layout, values: Values::default() })
    }

    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }

    pub(crate) fn next(&mut self) -> Decoded<'_> {
        Decoded { decoder: self, fit: None }
    }

    /// The values of a message, to be kept.
    pub(crate) fn take(&mut self, bytes: &[u8]) -> Result<Values, DecodeError> {
        self.next().values(bytes).map(std::mem::take)
    }
}

/// A message that is decoded when its values are asked for, at most once. Its values last as long as this.
pub(crate) struct Decoded<'a> {
    decoder: &'a mut Decoder,
    fit: Option<Result<(), DecodeError>>,
}

impl Decoded<'_> {
    /// The decoded message.
    ///
    /// * `bytes`: the message, always the same
    pub(crate) fn values(&mut self, bytes: &[u8]) -> Result<&mut Values, DecodeError> {
        let Decoder { layout, values } = &mut *self.decoder;
        if values.lists.is_empty() {
            *values = layout.values();
        }
        self.fit.get_or_insert_with(|| layout.decode(bytes, values)).map(|()| values)
    }

    pub(crate) fn layout(&self) -> &Layout {
        &self.decoder.layout
    }

    /// True if it was decoded in vain.
    pub(crate) fn is_undecoded(&self) -> bool {
        matches!(self.fit, Some(Err(_)))
    }
}

impl Drop for Decoded<'_> {
    fn drop(&mut self) {
        if self.fit.is_some() {
            self.decoder.values.release();
        }
    }
}
