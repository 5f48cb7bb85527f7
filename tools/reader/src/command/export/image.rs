//! Images of cameras, as they are recorded.
//!
//! A channel holds images if its messages have the fields of `foxglove.CompressedImage`, `format` and `data`, whatever their type is
//! named.

use std::path::Path;

use super::{no_messages, several};
use crate::{
    failure::Failure,
    messages::Recording,
    pass::{Moment, Pass},
    recording::{Damage, Limits},
    select::{self, Bound, Pattern, Window},
    slice::moments,
    wire::{Layout, List, Type, Values},
};

/// Extensions of images, and the bytes they begin with.
const FORMATS: [(&str, &[u8]); 3] = [("png", b"\x89PNG"), ("jpg", &[0xff, 0xd8]), ("webp", b"RIFF")];

/// A channel with images.
pub struct Camera {
    recording: Recording,
    id: u16,
    /// Leaves of the format and of the content.
    leaves: [usize; 2],
}

/// An image as a file.
pub struct Image<'a> {
    /// Extension of its name.
    pub extension: &'static str,
    /// Content.
    pub bytes: &'a [u8],
}

impl Camera {
    /// The channel with images that a pattern fits; `None` if it holds none.
    ///
    /// # Errors
    ///
    /// The file cannot be read, no topic fits, or there are several with images.
    pub fn find(path: &Path, topic: &Pattern, limits: Limits) -> Result<Option<Self>, Failure> {
        let recording = Recording::open(path, limits)?;
        let mut found = Vec::new();
        for id in select::channels(&recording, std::slice::from_ref(topic))? {
            if let Some(leaves) = recording.channels[&id].layout.as_deref().and_then(leaves) {
                found.push((id, leaves));
            }
        }
        match found.as_slice() {
            [] => Ok(None),
            &[(id, leaves)] => Ok(Some(Self { recording, id, leaves })),
            found => {
                let topics = found.iter().map(|(id, _)| recording.channels[id].topic.as_str());
                Err(several(topic, "topics with images", topics))
            }
        }
    }

    /// The message nearest to a time, or the last.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or there is no such message.
    pub fn moment(&self, time: Option<Bound>) -> Result<(Moment, Vec<Damage>), Failure> {
        let (mut moments, _, damages) = moments(&self.recording, self.id, time.as_slice(), false)?;
        let none = || no_messages(&self.recording.channels[&self.id].topic);
        Ok((moments.pop().ok_or_else(none)?, damages))
    }

    /// Hands all images to `take`, with their log times.
    ///
    /// # Errors
    ///
    /// The file cannot be read, a message is no image, or `take` fails.
    pub fn images(
        &self,
        mut take: impl FnMut(u64, Image<'_>) -> Result<(), Failure>,
    ) -> Result<Vec<Damage>, Failure> {
        let mut pass = Pass::over(&self.recording, Window::default());
        pass.each(self.id, |moment, _| take(moment.log_time, self.read(&moment.values)?));
        let seen = pass.run()?;
        if seen.undecoded > 0 {
            return Err(self.refuse("a message does not fit its schema"));
        }
        Ok(seen.damages)
    }

    fn refuse(&self, why: impl std::fmt::Display) -> Failure {
        let topic = &self.recording.channels[&self.id].topic;
        Failure::Failed(format!("an image of `{topic}` cannot be written: {why}"))
    }

    /// The image in a message.
    ///
    /// # Errors
    ///
    /// It is none.
    pub fn read<'a>(&self, values: &'a Values) -> Result<Image<'a>, Failure> {
        let [format, data] = self.leaves;
        let format = if let List::Text(list) = &values.lists[format] {
            list.first().map_or("", String::as_str)
        } else {
            ""
        };
        let bytes = if let List::Bytes(list) = &values.lists[data] {
            list.first().map_or(&[][..], Vec::as_slice)
        } else {
            &[]
        };
        image(format, bytes).ok_or_else(|| {
            self.refuse(format!(
                "its format is `{format}`, which its bytes are not, or which is not png, jpeg or webp"
            ))
        })
    }
}

/// Leaves of the format and the content of images.
fn leaves(layout: &Layout) -> Option<[usize; 2]> {
    let leaf = |name: &str, kind: Type| {
        let leaf = layout.find(name)?;
        (layout.leaves[leaf].lists == 0 && layout.leaves[leaf].kind == kind).then_some(leaf)
    };
    Some([leaf("format", Type::Text)?, leaf("data", Type::Bytes)?])
}

/// An image; `None` if it is not what its format says. ROS writes `rgb8; jpeg compressed bgr8`.
fn image<'a>(format: &str, bytes: &'a [u8]) -> Option<Image<'a>> {
    let format = format.to_lowercase();
    let (extension, begin) = FORMATS
        .into_iter()
        .find(|(name, _)| format.contains(name) || (*name == "jpg" && format.contains("jpeg")))?;
    bytes.starts_with(begin).then_some(Image { extension, bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_what_they_say() {
        let jpeg = [0xff, 0xd8, 0xff];
        assert_eq!(image("rgb8; jpeg compressed bgr8", &jpeg).map(|image| image.extension), Some("jpg"));
        assert!(image("png", &jpeg).is_none());
        assert!(image("h264", &jpeg).is_none());
    }
}
