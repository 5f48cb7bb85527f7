//! Frames as a GIF: one palette, and of every frame the part that is another than before.

use std::{collections::HashMap, io::Write};

use percuss_canvas::FREE;

use crate::film::{CURVE, Raster, colours};

/// Shades between white and the colour of curves.
const SHADES: u32 = 10;
/// Number of the colour that is none: what was there before stays.
const NOTHING: u8 = u8::MAX;

/// The colours of films, and the number of each.
struct Colours {
    palette: [[u8; 3]; 256],
    known: HashMap<[u8; 3], u8>,
}

impl Colours {
    fn new() -> Self {
        let shade = |i: u32| CURVE.map(|c| (255 - (255 - u32::from(c)) * i / SHADES) as u8);
        let mut palette = colours();
        for (colour, i) in palette[FREE..].iter_mut().zip(1..=SHADES) {
            *colour = shade(i);
        }
        Self { palette, known: HashMap::new() }
    }

    /// Number of the colour nearest to a pixel.
    fn number(&mut self, rgb: [u8; 3]) -> u8 {
        let palette = &self.palette;
        *self.known.entry(rgb).or_insert_with(|| {
            let distance = |other: &[u8; 3]| -> i32 {
                rgb.iter().zip(other).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2)).sum()
            };
            let numbered = palette.iter().enumerate();
            numbered.min_by_key(|(_, other)| distance(other)).map_or(0, |(number, _)| number as u8)
        })
    }
}

/// A moving picture that is being written.
pub struct Moving<W: Write> {
    colours: Colours,
    encoder: gif::Encoder<W>,
    size: (u32, u32),
    /// Colours of the frame before.
    before: Vec<u8>,
    /// Hundredths of a second that a frame is shown.
    delay: u16,
}

impl<W: Write> Moving<W> {
    /// Begins a picture that repeats for ever.
    ///
    /// * `size`: columns and rows of its frames
    /// * `delay`: how long each is shown \[1/100 s\]
    ///
    /// # Errors
    ///
    /// It cannot be written, or is too large for its form.
    pub fn new(output: W, size: (u32, u32), delay: u16) -> Result<Self, String> {
        let colours = Colours::new();
        let (Ok(width), Ok(height)) = (u16::try_from(size.0), u16::try_from(size.1)) else {
            return Err("a GIF has 65535 columns at most".into());
        };
        let mut encoder =
            gif::Encoder::new(output, width, height, colours.palette.as_flattened()).map_err(text)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(text)?;
        Ok(Self { colours, encoder, size, before: Vec::new(), delay })
    }

    /// Adds a frame.
    ///
    /// # Errors
    ///
    /// It cannot be written, or is not of the size of the picture.
    pub fn add(&mut self, frame: &Raster) -> Result<(), String> {
        if (frame.width, frame.height) != self.size {
            return Err("frames of several sizes".into());
        }
        let pixels = frame.rgba.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]);
        let numbers: Vec<u8> = pixels.map(|pixel| self.colours.number(pixel)).collect();
        let frame = self.changed(&numbers);
        self.before = numbers;
        self.encoder.write_frame(&frame).map_err(text)
    }

    /// The smallest rectangle of what is another than before; in it what has stayed is nothing.
    fn changed(&self, numbers: &[u8]) -> gif::Frame<'static> {
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        // of the first frame all is
        let differs = |at: usize| self.before.get(at) != Some(&numbers[at]);
        let rows: Vec<usize> = (0..height).filter(|j| (0..width).any(|i| differs(j * width + i))).collect();
        let columns: Vec<usize> =
            (0..width).filter(|i| rows.iter().any(|j| differs(j * width + i))).collect();
        // a part has one pixel at least
        let ends = |of: &[usize]| (of.first().copied().unwrap_or(0), of.last().copied().unwrap_or(0));
        let ((top, bottom), (left, right)) = (ends(&rows), ends(&columns));
        let number = |at: usize| if differs(at) { numbers[at] } else { NOTHING };
        let part = (top..=bottom).flat_map(|j| (left..=right).map(move |i| number(j * width + i)));
        gif::Frame {
            delay: self.delay,
            dispose: gif::DisposalMethod::Keep,
            transparent: Some(NOTHING),
            left: left as u16,
            top: top as u16,
            width: (right - left + 1) as u16,
            height: (bottom - top + 1) as u16,
            buffer: part.collect(),
            ..gif::Frame::default()
        }
    }

    /// Completes the picture.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn finish(self) -> Result<(), String> {
        self.encoder.into_inner().map_err(text)?.flush().map_err(text)
    }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}
