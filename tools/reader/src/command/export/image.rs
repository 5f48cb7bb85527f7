//! Images of cameras: compressed ones as they are, raw ones as PNG.
//!
//! A channel holds images if its messages have the fields of `foxglove.CompressedImage` (`format`, `data`) or of
//! `foxglove.RawImage` (`encoding`, `width`, `height`, `step`, `data`), whatever their type is named.

use std::{borrow::Cow, path::Path};

use png::{BitDepth, ColorType, Encoder};

use super::{ExportError, moment};
use crate::{
    messages::Recording,
    recording::{Damage, Limits},
    select::{self, Bound, Pattern},
    slice::Moment,
    wire::{Layout, List, Type, Values},
};

/// Extensions of compressed images, and the bytes they begin with.
const COMPRESSED: [(&str, &[u8]); 3] = [("png", b"\x89PNG"), ("jpg", &[0xff, 0xd8]), ("webp", b"RIFF")];

/// A channel with images.
pub struct Camera {
    recording: Recording,
    id: u16,
    leaves: Leaves,
}

/// Where the parts of an image are.
#[derive(Clone, Copy)]
enum Leaves {
    Compressed { format: usize, data: usize },
    Raw { encoding: usize, width: usize, height: usize, step: usize, data: usize, big_endian: Option<usize> },
}

impl Leaves {
    fn of(layout: &Layout) -> Option<Self> {
        let leaf = |name: &str, fits: fn(&Type) -> bool| {
            layout
                .find(name)
                .filter(|&leaf| layout.leaves[leaf].lists == 0 && fits(&layout.leaves[leaf].kind))
        };
        let is_text: fn(&Type) -> bool = |kind| *kind == Type::Text;
        let data = leaf("data", |kind| *kind == Type::Bytes)?;
        if let Some(format) = leaf("format", is_text) {
            return Some(Self::Compressed { format, data });
        }
        Some(Self::Raw {
            encoding: leaf("encoding", is_text)?,
            width: leaf("width", Type::is_number)?,
            height: leaf("height", Type::is_number)?,
            step: leaf("step", Type::is_number)?,
            data,
            big_endian: leaf("is_bigendian", |_| true),
        })
    }
}

/// An image as a file.
pub struct Image<'a> {
    /// Extension of its name.
    pub extension: &'static str,
    /// Content.
    pub bytes: Cow<'a, [u8]>,
}

impl Camera {
    /// The channel with images that a pattern fits; `None` if it holds none.
    ///
    /// # Errors
    ///
    /// The file cannot be read, no topic fits, or there are several with images.
    pub fn find(path: &Path, topic: &Pattern, limits: Limits) -> Result<Option<Self>, ExportError> {
        let recording = Recording::open(path, limits)?;
        let mut found = Vec::new();
        for id in select::channels(&recording, std::slice::from_ref(topic))? {
            if let Some(leaves) = recording.channels[&id].layout.as_deref().and_then(Leaves::of) {
                found.push((id, leaves));
            }
        }
        match found.as_slice() {
            [] => Ok(None),
            &[(id, leaves)] => Ok(Some(Self { recording, id, leaves })),
            several => {
                let topics = several.iter().map(|(id, _)| recording.channels[id].topic.as_str());
                Err(ExportError::several(topic, "topics with images", topics))
            }
        }
    }

    /// The message nearest to a time, or the last.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or there is no such message.
    pub fn moment(&self, time: Option<Bound>) -> Result<(Moment, Vec<Damage>), ExportError> {
        moment(&self.recording, self.id, time)
    }

    /// Hands all images to `take`, with their log times.
    ///
    /// # Errors
    ///
    /// The file cannot be read, a message is no image, or `take` fails.
    pub fn images<E: From<ExportError>>(
        &self,
        mut take: impl FnMut(u64, Image<'_>) -> Result<(), E>,
    ) -> Result<Vec<Damage>, E> {
        let channel = &self.recording.channels[&self.id];
        let Some(layout) = &channel.layout else { return Ok(Vec::new()) };
        let mut values = layout.values();
        let mut messages = self.recording.messages([self.id], None).map_err(ExportError::Open)?;
        loop {
            let next = messages.next(|message| {
                let decoded = layout.decode(message.data, &mut values);
                (message.log_time, decoded)
            });
            let Some((log_time, decoded)) = next.map_err(ExportError::Open)? else { break };
            decoded.map_err(|error| self.refuse(error.to_string()))?;
            take(log_time, self.read(&values)?)?;
        }
        Ok(messages.damages().to_vec())
    }

    fn refuse(&self, why: impl Into<String>) -> ExportError {
        let topic = self.recording.channels[&self.id].topic.clone();
        ExportError::NoImage { topic, why: why.into() }
    }

    /// The image in a message.
    ///
    /// # Errors
    ///
    /// It is none.
    pub fn read<'a>(&self, values: &'a Values) -> Result<Image<'a>, ExportError> {
        match self.leaves {
            Leaves::Compressed { format, data } => {
                let (format, bytes) = (text(values, format), content(values, data));
                let image = compressed(format, bytes);
                image.ok_or_else(|| {
                    self.refuse(format!(
                        "its format is `{format}`, which its bytes are not, or which is not png, jpeg or webp"
                    ))
                })
            }
            Leaves::Raw { encoding, width, height, step, data, big_endian } => {
                let number = |leaf: usize| values.lists[leaf].number(0).unwrap_or(0.0) as usize;
                let is_big_endian = big_endian.is_some_and(|leaf| match &values.lists[leaf] {
                    List::Bool(list) => list.first() == Some(&true),
                    list => list.number(0).is_some_and(|value| value != 0.0),
                });
                let raw = Raw {
                    encoding: text(values, encoding),
                    width: number(width),
                    height: number(height),
                    step: number(step),
                    data: content(values, data),
                    is_big_endian,
                };
                let bytes = raw.png().map_err(|why| self.refuse(why))?;
                Ok(Image { extension: "png", bytes: bytes.into() })
            }
        }
    }
}

fn text(values: &Values, leaf: usize) -> &str {
    if let List::Text(list) = &values.lists[leaf] { list.first().map_or("", String::as_str) } else { "" }
}

fn content(values: &Values, leaf: usize) -> &[u8] {
    if let List::Bytes(list) = &values.lists[leaf] { list.first().map_or(&[], Vec::as_slice) } else { &[] }
}

/// An image that is compressed already; `None` if it is not what its format says. ROS writes `rgb8; jpeg compressed bgr8`.
fn compressed<'a>(format: &str, bytes: &'a [u8]) -> Option<Image<'a>> {
    let format = format.to_lowercase();
    let (extension, begin) = COMPRESSED
        .into_iter()
        .find(|(name, _)| format.contains(name) || (*name == "jpg" && format.contains("jpeg")))?;
    bytes.starts_with(begin).then_some(Image { extension, bytes: bytes.into() })
}

/// An image that is not compressed.
struct Raw<'a> {
    encoding: &'a str,
    width: usize,
    height: usize,
    /// Bytes from row to row; 0 if there is nothing between rows.
    step: usize,
    data: &'a [u8],
    is_big_endian: bool,
}

impl Raw<'_> {
    fn png(&self) -> Result<Vec<u8>, String> {
        let (colour, depth, size) = match self.encoding {
            "rgb8" | "bgr8" => (ColorType::Rgb, BitDepth::Eight, 3),
            "rgba8" | "bgra8" => (ColorType::Rgba, BitDepth::Eight, 4),
            "mono8" | "8UC1" => (ColorType::Grayscale, BitDepth::Eight, 1),
            "mono16" | "16UC1" => (ColorType::Grayscale, BitDepth::Sixteen, 2),
            other => {
                let known = "rgb8, bgr8, rgba8, bgra8, mono8 and mono16";
                return Err(format!("its encoding is `{other}`; {known} are written"));
            }
        };
        let pixels = self.pixels(size)?;
        let side = |side: usize| u32::try_from(side).map_err(|_| format!("a side has {side} pixels"));
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, side(self.width)?, side(self.height)?);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&pixels)?;
            writer.finish()
        });
        written.map_err(|error| error.to_string())?;
        Ok(bytes)
    }

    /// The rows without what is between them, in the order of bytes that PNG has.
    ///
    /// * `size`: of a pixel \[bytes\]
    fn pixels(&self, size: usize) -> Result<Vec<u8>, String> {
        let row = self.width.checked_mul(size).filter(|row| *row > 0 && self.height > 0);
        let step = row.map(|row| if self.step == 0 { row } else { self.step });
        let needed =
            row.zip(step).and_then(|(row, step)| step.checked_mul(self.height - 1)?.checked_add(row));
        let (Some(row), Some(step), Some(_)) =
            (row, step, needed.filter(|needed| *needed <= self.data.len()))
        else {
            let (width, height, step, length) = (self.width, self.height, self.step, self.data.len());
            return Err(format!("{width} by {height} pixels with {step} bytes a row are not {length} bytes"));
        };
        if step < row {
            return Err(format!("its rows have {row} bytes, but follow each other after {step}"));
        }
        let mut pixels: Vec<u8> =
            self.data.chunks(step).take(self.height).flat_map(|line| &line[..row]).copied().collect();
        if self.encoding.starts_with("bgr") {
            pixels.chunks_exact_mut(size).for_each(|pixel| pixel.swap(0, 2));
        }
        if size == 2 && !self.is_big_endian {
            pixels.chunks_exact_mut(2).for_each(<[u8]>::reverse);
        }
        Ok(pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw<'a>(encoding: &'a str, width: usize, height: usize, step: usize, data: &'a [u8]) -> Raw<'a> {
        Raw { encoding, width, height, step, data, is_big_endian: false }
    }

    #[test]
    fn rows_and_bytes_are_put_in_order() {
        let data = [1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12];
        assert_eq!(raw("bgr8", 2, 2, 8, &data).pixels(3), Ok(vec![3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10]));
        assert_eq!(raw("mono16", 2, 1, 0, &data).pixels(2), Ok(vec![2, 1, 4, 3]));
        assert_eq!(Raw { is_big_endian: true, ..raw("mono16", 1, 1, 0, &data) }.pixels(2), Ok(vec![1, 2]));
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let data = [0; 12];
        for (width, height, step) in
            [(0, 1, 0), (4, 2, 12), (2, 2, 4), (usize::MAX, 2, 0), (1, usize::MAX, 3)]
        {
            assert!(raw("rgb8", width, height, step, &data).png().is_err(), "{width} {height} {step}");
        }
        assert!(raw("yuv422", 1, 1, 0, &data).png().is_err());
    }

    #[test]
    fn packed_images_are_what_they_say() {
        let jpeg = [0xff, 0xd8, 0xff];
        assert_eq!(compressed("rgb8; jpeg compressed bgr8", &jpeg).map(|image| image.extension), Some("jpg"));
        assert!(compressed("png", &jpeg).is_none());
        assert!(compressed("h264", &jpeg).is_none());
    }
}
