//! Images of cameras, as they are recorded.
//!
//! A channel holds images if its messages have the fields of `foxglove.CompressedImage`, `format` and `data`, whatever their type is
//! named.

use std::path::Path;

use super::several;
use crate::{
    failure::Failure,
    messages::Recording,
    recording::Limits,
    select::{self, Pattern},
    wire::{Layout, List, Type, Values},
};

/// Extensions of images, and the bytes they begin with.
const FORMATS: [(&str, &[u8]); 3] = [("png", b"\x89PNG"), ("jpg", &[0xff, 0xd8]), ("webp", b"RIFF")];

/// A channel with images.
pub(super) struct Camera {
    pub(super) recording: Recording,
    pub(super) id: u16,
    /// Leaves of the format and of the content.
    leaves: [usize; 2],
}

impl Camera {
    /// The channel with images that a pattern fits; `None` if it holds none.
    pub(super) fn find(path: &Path, topic: &Pattern, limits: Limits) -> Result<Option<Self>, Failure> {
        let recording = Recording::open(path, limits)?;
        let leaves = |id: u16| Some((id, recording.channels[&id].layout.as_deref().and_then(leaves)?));
        let ids = select::channels(&recording, std::slice::from_ref(topic))?;
        match ids.into_iter().filter_map(leaves).collect::<Vec<_>>().as_slice() {
            [] => Ok(None),
            &[(id, leaves)] => Ok(Some(Self { recording, id, leaves })),
            found => {
                let topics = found.iter().map(|(id, _)| recording.channels[id].topic.as_str());
                Err(several(topic, "topics with images", topics))
            }
        }
    }

    pub(super) fn topic(&self) -> &str {
        &self.recording.channels[&self.id].topic
    }

    pub(super) fn refuse(&self, why: impl std::fmt::Display) -> Failure {
        Failure::Failed(format!("an image of `{}` cannot be written: {why}", self.topic()))
    }

    /// The image in a message, and its extension.
    pub(super) fn read<'a>(&self, values: &'a Values) -> Result<(&'static str, &'a [u8]), Failure> {
        let (format, bytes) = match self.leaves.map(|leaf| &values.lists[leaf]) {
            [List::Text(formats), List::Bytes(images)] => {
                (formats.first().map_or("", String::as_str), images.first().map_or(&[][..], Vec::as_slice))
            }
            _ => ("", &[][..]),
        };
        let extension = extension(format, bytes).ok_or_else(|| {
            self.refuse(format!(
                "its format is `{format}`, which its bytes are not, or which is not png, jpeg or webp"
            ))
        })?;
        Ok((extension, bytes))
    }
}

fn leaves(layout: &Layout) -> Option<[usize; 2]> {
    let leaf = |name: &str, kind: Type| {
        let leaf = layout.find(name)?;
        (layout.leaves[leaf].lists == 0 && layout.leaves[leaf].kind == kind).then_some(leaf)
    };
    Some([leaf("format", Type::Text)?, leaf("data", Type::Bytes)?])
}

/// Extension of an image; `None` if it is not what its format says. ROS writes `rgb8; jpeg compressed bgr8`.
fn extension(format: &str, bytes: &[u8]) -> Option<&'static str> {
    let format = format.to_lowercase();
    let is_named = |name: &str| format.contains(name) || (name == "jpg" && format.contains("jpeg"));
    let (extension, begin) = FORMATS.into_iter().find(|(name, _)| is_named(name))?;
    bytes.starts_with(begin).then_some(extension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_what_they_say() {
        let jpeg = [0xff, 0xd8, 0xff];
        assert_eq!(extension("rgb8; jpeg compressed bgr8", &jpeg), Some("jpg"));
        assert!(extension("png", &jpeg).is_none());
        assert!(extension("h264", &jpeg).is_none());
    }
}
