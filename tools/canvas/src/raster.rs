//! A picture of palette colours, drawn without a scene: for pictures of which hundreds are made in a run.

use ab_glyph_rasterizer::{Point, Rasterizer, point};
use ttf_parser::OutlineBuilder;

use crate::letters::{Pen, outline, set};

/// Colour of the background, white.
pub const WHITE: u8 = 0;
/// Colour of text and axes. Colours between [`WHITE`] and this one are the greys of their edges.
pub const BLACK: u8 = 15;

/// Where a text is, relative to its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// To the right of it.
    Start,
    /// Centred on it.
    Middle,
    /// To the left of it.
    End,
}

/// A text at a position.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    /// What it says, with subscripts and superscripts as `γc_p²` and `10^-3` have them.
    pub label: &'a str,
    /// Position on its baseline \[pixels\].
    pub at: [f64; 2],
    /// Size of its letters \[pixels\].
    pub size: f64,
    /// Where it is, relative to the position.
    pub align: Align,
    /// Turned to run upwards.
    pub is_upright: bool,
}

/// Pixels of a picture, each the number of its colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Numbers of colours, row by row from the top.
    pub pixels: Vec<u8>,
}

impl Raster {
    /// A white picture.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![WHITE; width * height] }
    }

    /// Fills a rectangle; what is outside of the picture is left out.
    ///
    /// * `columns`, `rows`: from the first to before the last \[pixels\]
    pub fn fill(&mut self, columns: [i64; 2], rows: [i64; 2], colour: u8) {
        let within = |[from, to]: [i64; 2], length: usize| {
            let [from, to] = [from, to].map(|place| place.clamp(0, length as i64) as usize);
            from..to.max(from)
        };
        let columns = within(columns, self.width);
        for row in within(rows, self.height) {
            self.pixels[row * self.width..][columns.clone()].fill(colour);
        }
    }

    /// Writes a text in black. It covers nothing: where it is, the picture is white.
    pub fn text(&mut self, text: &Text<'_>) {
        let Some((placed, width)) = set(text.label) else { return };
        let start = match text.align {
            Align::Start => 0.0,
            Align::Middle => -0.5 * width,
            Align::End => -width,
        };
        // the letters are within a box from above the superscripts to below the subscripts
        let (along, [above, below]) = (start * text.size, [1.3 * text.size, 0.6 * text.size]);
        let (length, across) = (width * text.size + 2.0, above + below);
        let [left, base] = text.at;
        let (corner, size) = if text.is_upright {
            ([left - above, base - along - length + 1.0], [across, length])
        } else {
            ([left + along - 1.0, base - above], [length, across])
        };
        let corner = corner.map(f64::floor);
        let [columns, rows] = size.map(|length| length as usize + 2);
        let mut pen = Glyphs {
            rasterizer: Rasterizer::new(columns, rows),
            text: Text { at: [left - corner[0], base - corner[1]], ..*text },
            origin: (0.0, 0.0),
            scale: 0.0,
            from: point(0.0, 0.0),
            first: point(0.0, 0.0),
        };
        placed.iter().for_each(|part| outline(part, start, &mut pen));
        pen.rasterizer.for_each_pixel_2d(|x, y, coverage| {
            let grey = (coverage.min(1.0) * f32::from(BLACK) + 0.5) as u8;
            let [column, row] = [(x, corner[0]), (y, corner[1])].map(|(pixel, from)| f64::from(pixel) + from);
            if grey > WHITE
                && (0.0..self.width as f64).contains(&column)
                && (0.0..self.height as f64).contains(&row)
            {
                self.pixels[row as usize * self.width + column as usize] = grey;
            }
        });
    }
}

struct Glyphs<'a> {
    rasterizer: Rasterizer,
    text: Text<'a>,
    /// Origin of the glyph and size of a unit of the font \[sizes of the text\].
    origin: (f64, f64),
    scale: f64,
    from: Point,
    first: Point,
}

impl Glyphs<'_> {
    fn at(&self, x: f32, y: f32) -> Point {
        let Text { at: [left, base], size, is_upright, .. } = self.text;
        let along = size * (self.origin.0 + self.scale * f64::from(x));
        let down = size * (self.origin.1 - self.scale * f64::from(y));
        let [x, y] = if is_upright { [left + down, base - along] } else { [left + along, base + down] };
        point(x as f32, y as f32)
    }
}

impl Pen for Glyphs<'_> {
    fn place(&mut self, origin: (f64, f64), scale: f64) {
        (self.origin, self.scale) = (origin, scale);
    }
}

impl OutlineBuilder for Glyphs<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.from = self.at(x, y);
        self.first = self.from;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.at(x, y);
        self.rasterizer.draw_line(self.from, to);
        self.from = to;
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (middle, to) = (self.at(x1, y1), self.at(x, y));
        self.rasterizer.draw_quad(self.from, middle, to);
        self.from = to;
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (first, second, to) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.rasterizer.draw_cubic(self.from, first, second, to);
        self.from = to;
    }

    fn close(&mut self) {
        self.rasterizer.draw_line(self.from, self.first);
        self.from = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns and rows that are not white: the first, and the one after the last.
    fn extent(raster: &Raster) -> [[usize; 2]; 2] {
        let inked: Vec<usize> = (0..raster.pixels.len()).filter(|&i| raster.pixels[i] != WHITE).collect();
        let ends = |place: &dyn Fn(usize) -> usize| {
            let places = || inked.iter().map(|&i| place(i));
            [places().min().expect("ink"), places().max().expect("ink") + 1]
        };
        [ends(&|i| i % raster.width), ends(&|i| i / raster.width)]
    }

    #[test]
    fn texts_are_where_they_are_aligned() {
        let drawn = |align, is_upright| {
            let mut raster = Raster::new(120, 120);
            raster.text(&Text { label: "HH", at: [60.0, 60.0], size: 20.0, align, is_upright });
            assert!(raster.pixels.contains(&BLACK));
            extent(&raster)
        };
        let [columns, rows] = drawn(Align::Start, false);
        assert!(columns[0] > 60 && columns[1] < 92 && rows[0] > 43 && rows[1] == 60, "{columns:?} {rows:?}");
        let [columns, _] = drawn(Align::End, false);
        assert!(columns[0] > 28 && columns[1] < 60, "{columns:?}");
        let [columns, rows] = drawn(Align::Middle, true);
        assert!(columns[0] > 43 && columns[1] == 60, "{columns:?}");
        assert!(rows[0] + rows[1] > 117 && rows[0] + rows[1] < 123, "{rows:?}");
    }

    #[test]
    fn what_is_outside_is_left_out() {
        let mut raster = Raster::new(30, 8);
        let text =
            Text { label: "γc_p²", at: [-5.0, 2.0], size: 20.0, align: Align::Start, is_upright: false };
        raster.text(&text);
        raster.text(&Text { at: [29.0, 9.0], ..text });
        raster.fill([-4, 2], [6, 99], 40);
        assert_eq!(raster.pixels.iter().filter(|&&pixel| pixel == 40).count(), 4);
    }
}
