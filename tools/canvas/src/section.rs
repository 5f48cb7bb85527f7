//! A section on a raster: values in colours, interfaces of layers, and the indenter above them.
//!
//! The only painter of sections: recorded images, films, plots and pages differ in where its pixels are and what stands around them.

use crate::raster::{BLACK, Raster, WHITE};

/// Level of the value 0.
pub const ZERO: u8 = 128;
/// Levels from 0 to the end of the scale on either side; levels 0 and 1 are no values.
pub const SIDE: f64 = 126.0;
/// Level where there is no body.
pub const EMPTY: u8 = 1;
/// Colour of the indenter.
pub const BODY: u8 = 16;
const UNKNOWN: u8 = 17;
/// Colours from this one to before [`LEVELS`] are for the caller to fill.
pub const FREE: usize = 18;
/// Colours of levels, one for every two of them, begin here.
const LEVELS: u8 = 64;
/// Thickness of the contact \[pixels\].
const CONTACT: i64 = 3;
/// Length that is as good as infinite \[pixels\].
const FAR: f64 = 1e6;

/// Level of a value in units of a level, held within the scale; 0 if it is no number.
#[must_use]
pub fn level(value: f32) -> u8 {
    // a cast from a float saturates at 0 and 255; NaN becomes 0, which is no value
    (value.clamp(-SIDE as f32, SIDE as f32) + (f32::from(ZERO) + 0.5)) as u8
}

/// Value of a level relative to the end of the scale, −1 to 1.
#[must_use]
pub fn share(level: u8) -> f64 {
    (f64::from(level) - f64::from(ZERO)) / SIDE
}

/// Number of the colour of a level in a [`palette`].
#[must_use]
pub fn colour(level: u8) -> u8 {
    match level {
        0 => UNKNOWN,
        EMPTY => WHITE,
        level => LEVELS + level / 2,
    }
}

/// The colours of sections: white, greys, black, the indenter, no value, levels. Shape `(256, [red, green, blue])`.
///
/// * `shade`: colour of a value relative to the end of the scale, −1 to 1
#[must_use]
pub fn palette(shade: impl Fn(f64) -> [u8; 3]) -> [[u8; 3]; 256] {
    let mut palette = [[255; 3]; 256];
    for grey in WHITE..=BLACK {
        palette[usize::from(grey)] = [255 - 15 * grey; 3];
    }
    palette[usize::from(BODY)] = [200, 200, 204];
    palette[usize::from(UNKNOWN)] = [160; 3];
    for level in (2..=254).step_by(2) {
        palette[usize::from(colour(level))] = shade(share(level));
    }
    palette
}

/// Where a section is on a raster.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// First column of pixels.
    pub left: usize,
    /// First row of pixels, that of the room above the values.
    pub top: usize,
    /// The column of the values that a column of pixels shows; none where nothing is drawn.
    pub columns: Vec<Option<usize>>,
    /// The same of every row of pixels.
    pub rows: Vec<Option<usize>>,
    /// Rows of pixels in which a layer begins.
    pub interfaces: Vec<i64>,
    /// First column of pixels at r > 0.
    pub axis: i64,
    /// First row of pixels at z > 0.
    pub surface: i64,
}

impl Section {
    /// Paints values and interfaces.
    ///
    /// * `level`: of a row and a column of the values
    pub fn paint(&self, raster: &mut Raster, level: impl Fn(usize, usize) -> u8) {
        let width = self.columns.len();
        let mut before = None;
        for (j, &row) in (self.top..).zip(&self.rows) {
            let start = j * raster.width + self.left;
            if let Some(row) = row.filter(|_| row != before) {
                for (pixel, column) in raster.pixels[start..][..width].iter_mut().zip(&self.columns) {
                    if let Some(column) = *column {
                        *pixel = colour(level(row, column));
                    }
                }
            } else if row.is_some() {
                let above = start - raster.width;
                raster.pixels.copy_within(above..above + width, start);
            }
            before = row;
        }
        let columns = [self.left as i64, self.right()];
        for &row in &self.interfaces {
            raster.fill(columns, [row, row + 1], BLACK);
        }
    }

    fn right(&self) -> i64 {
        (self.left + self.columns.len()) as i64
    }

    /// Height of a face over its tip at each column from the axis on, as far as the indenter reaches \[pixels\].
    ///
    /// * `outline`: from the axis outwards, shape `(n, [radius, height over the tip])`
    /// * `scale`: pixels of a radius and of a height of 1
    #[must_use]
    pub fn face(&self, outline: &[[f64; 2]], scale: [f64; 2]) -> Vec<i64> {
        let [_, .., last] = outline else { return Vec::new() };
        // a face that goes on has its edge beyond the section
        let most = (self.right() - self.axis).max(0) as usize + 2;
        let height = |column: usize| {
            let r = (column as f64 + 0.5) / scale[0];
            let next = outline.partition_point(|point| point[0] < r).clamp(1, outline.len() - 1);
            let ([r0, y0], [r1, y1]) = (outline[next - 1], outline[next]);
            pixels((y0 + (y1 - y0) * ((r - r0) / (r1 - r0)).min(1.0)) * scale[1])
        };
        (0..((last[0] * scale[0]).round() as usize).min(most)).map(height).collect()
    }

    /// Draws the indenter from its face to the top of the section.
    ///
    /// * `face`: as [`Section::face`] has it
    /// * `depth`: of the tip \[pixels\]
    pub fn indenter(&self, raster: &mut Raster, face: &[i64], depth: f64) {
        let (tip, top) = (self.surface + pixels(depth), self.top as i64);
        let mut before = tip;
        for (column, height) in (0..).zip(face) {
            let bottom = (tip - height).max(top);
            let is_edge = column + 2 > face.len() as i64;
            for column in [self.axis + column, self.axis - column - 1] {
                raster.fill([column, column + 1], [top, bottom], BODY);
                // its outline, joined to that of the column before
                let ink =
                    if is_edge { [top, bottom] } else { [bottom.min(before - 1) - 1, before.max(bottom)] };
                raster.fill([column, column + 1], [ink[0].max(top), ink[1]], BLACK);
            }
            before = bottom;
        }
    }

    /// Draws the contact.
    ///
    /// * `radius`: \[pixels\]
    pub fn contact(&self, raster: &mut Raster, radius: f64) {
        let radius = pixels(radius).min(self.right() - self.axis);
        let row = self.surface - 1;
        raster.fill([self.axis - radius, self.axis + radius], [row, row + CONTACT], BLACK);
    }
}

/// A length in whole pixels.
fn pixels(length: f64) -> i64 {
    length.round().clamp(-FAR, FAR) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diverging;

    #[test]
    fn levels_are_steps_of_values() {
        assert_eq!([-1e9, -126.0, -0.4, 0.0, 1.6, 1e9].map(level), [2, 2, 128, 128, 130, 254]);
        assert_eq!(level(f32::NAN), 0);
        let palette = palette(diverging);
        let rgb = |level: u8| palette[usize::from(colour(level))];
        assert_eq!([2, ZERO, 254].map(rgb), [-1.0, 0.0, 1.0].map(diverging));
        assert_eq!((rgb(0), palette[usize::from(BLACK)]), ([160; 3], [30; 3]));
    }

    #[test]
    fn pixels_show_their_values_under_the_indenter() {
        let rows = [None, None, Some(0), Some(0), Some(1)];
        let section = Section {
            columns: [Some(1), Some(0), Some(0), Some(1), None].into(),
            rows: rows.into(),
            interfaces: vec![4],
            axis: 2,
            surface: 2,
            ..Section::default()
        };
        let mut raster = Raster::new(5, 5);
        section.paint(&mut raster, |row, column| 100 + 20 * row as u8 + 10 * column as u8);
        let row = |raster: &Raster, j: usize| raster.pixels[5 * j..][..5].to_vec();
        assert_eq!(row(&raster, 1), [WHITE; 5]);
        assert_eq!(row(&raster, 2), [119, 114, 114, 119, WHITE]);
        assert_eq!((row(&raster, 3), row(&raster, 4)), (row(&raster, 2), vec![BLACK; 5]));
        // a punch of one column on both sides, and a contact of two
        let face = section.face(&[[0.0, 0.0], [0.5, 0.0]], [2.0, 1.0]);
        section.indenter(&mut raster, &face, 0.0);
        assert_eq!(row(&raster, 0), [WHITE, BLACK, BLACK, WHITE, WHITE]);
        section.contact(&mut raster, 9.0);
        assert_eq!(row(&raster, 1), [BLACK; 5]);
        // what a file may say is drawn, too
        for wild in [f64::NAN, f64::INFINITY, -1e300] {
            let face = section.face(&[[0.0, 0.0], [wild.abs(), wild]], [2.0, wild]);
            section.indenter(&mut raster, &face, wild);
            section.contact(&mut raster, wild);
        }
    }
}
