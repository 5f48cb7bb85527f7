//! What stays in the images of a run: title, axes, colour bar; and where the section is.

use percuss_canvas::{Align, BLACK, Raster, SIDE, Section, Text, colour, diverging, level, palette};

use super::{
    Viewport,
    viewport::{range, round_down},
};
use crate::case::Case;

/// Margins of the plot \[pixels\]: left with the vertical axis, right with the colour bar, top with title and values, bottom with
/// the horizontal axis.
const LEFT: i64 = 84;
const RIGHT: i64 = 132;
const TOP: i64 = 74;
const BOTTOM: i64 = 60;
/// Least width of an image, and of a section where that is not too high \[pixels\].
const WIDTH: i64 = 1200;
const SECTION: usize = (WIDTH - LEFT - RIGHT) as usize;
/// Greatest height of a section, unless a pixel of the viewport is one of the image \[pixels\].
const HEIGHT: usize = 700;
/// Room for the indenter above the section, relative to the smaller side of the viewport.
const HEADROOM: f64 = 0.35;
/// Size of the letters of the title, and of what is at ticks \[pixels\].
const TITLE: f64 = 21.0;
const TICK: f64 = 15.0;
/// Most letters of a title: longer ones are cut.
const LONGEST: usize = 90;
/// Most letters at a tick of the colour bar.
const LONGEST_TICK: usize = 6;
/// Length of a tick and width of the colour bar \[pixels\].
const MARK: i64 = 6;
const BAR: i64 = 20;

/// The part of the images of a run that stays.
pub struct Plate {
    pub base: Raster,
    /// Shape `(256, [red, green, blue])`.
    pub palette: [[u8; 3]; 256],
    /// Pixels of a length of R.
    pub scale: f64,
    pub section: Section,
    pub values: [f64; 2],
    /// Pixels of the viewport in a row of the section.
    columns: usize,
}

impl Plate {
    /// Size of the letters of labels and values \[pixels\].
    pub const LETTERS: f64 = 17.0;

    pub fn new(case: &Case, viewport: &Viewport) -> Self {
        let (columns, rows) = (2 * viewport.columns, viewport.rows);
        let block = SECTION.div_ceil(columns).min(HEIGHT / (rows + viewport.above)).max(1);
        let (half, depth) = ((viewport.columns * block) as i64, (rows * block) as i64);
        let scale = block as f64 / viewport.pixel;
        let headroom = match viewport.above {
            0 => (HEADROOM * viewport.depth.min(viewport.half_width) * scale).ceil() as i64,
            above => (above * block) as i64,
        };
        let width = (2 * half + LEFT + RIGHT).max(WIDTH);
        let axis = LEFT + (width - LEFT - RIGHT) / 2;
        let surface = TOP + headroom;
        let interface = |(_, top): &(String, f64)| surface + (top * scale).round() as i64;
        let shown = |length: usize| (0..length * block).map(move |pixel| Some(pixel / block));
        let section = Section {
            left: (axis - half) as usize,
            top: TOP as usize,
            columns: shown(columns).collect(),
            // rows of levels begin at the bottom
            rows: match viewport.above {
                0 => std::iter::repeat_n(None, headroom as usize).chain(shown(rows).rev()).collect(),
                above => shown(rows + above).rev().collect(),
            },
            interfaces: viewport.layers.iter().skip(1).map(interface).collect(),
            axis,
            surface,
        };
        let mut plate = Self {
            base: Raster::new(width as usize, (surface + depth + BOTTOM) as usize),
            palette: palette(diverging),
            scale,
            section,
            values: [LEFT as f64, 54.0],
            columns,
        };
        plate.axes(case, viewport, [half, depth]);
        plate.bar(case, [half, depth]);
        plate
    }

    fn write(&mut self, label: &str, at: [i64; 2], size: f64, align: Align, is_upright: bool) {
        let at = at.map(|place| place as f64);
        self.base.text(&Text { label, at, size, align, is_upright });
    }

    /// Title and axes.
    ///
    /// * `size`: half of the width of the section, and its depth \[pixels\]
    fn axes(&mut self, case: &Case, viewport: &Viewport, [half, depth]: [i64; 2]) {
        let Section { axis, surface, .. } = self.section;
        let mut title = case.title.clone();
        if let Some((end, _)) = title.char_indices().nth(LONGEST) {
            title.replace_range(end.., "…");
        }
        self.write(&title, [LEFT, 26], TITLE, Align::Start, false);
        let (left, right, bottom) = (axis - half, axis + half, surface + depth);
        for [columns, rows] in [
            [[left - 1, left], [surface, bottom + 1]],
            [[right, right + 1], [surface, bottom + 1]],
            [[left - 1, right + 1], [bottom, bottom + 1]],
        ] {
            self.base.fill(columns, rows, BLACK);
        }
        let (name, per) = viewport.world.unit.for_axis(viewport.half_width.max(viewport.depth));
        // along r at least seven ticks, along z one every 28 to 70 pixels
        let pixels = self.scale / per;
        let ticks = |span: f64, count: f64| {
            let step = round_down(span / count);
            (0..)
                .map(move |i| f64::from(i) * step)
                .take_while(move |tick| *tick <= span * (1.0 + 1e-9))
                .map(move |tick| (tick, shown(tick, step)))
        };
        for (tick, text) in ticks(half as f64 / pixels, 3.0) {
            for side in [-1.0, 1.0] {
                let column = axis + (side * tick * pixels).round() as i64;
                self.base.fill([column, column + 1], [bottom, bottom + MARK], BLACK);
                if tick > 0.0 || side > 0.0 {
                    let text = if side < 0.0 { format!("−{text}") } else { text.clone() };
                    self.write(&text, [column, bottom + MARK + 15], TICK, Align::Middle, false);
                }
            }
        }
        for (tick, text) in ticks(depth as f64 / pixels, (depth as f64 / 70.0).max(1.0)) {
            let row = surface + (tick * pixels).round() as i64;
            self.base.fill([left - MARK, left], [row, row + 1], BLACK);
            self.write(&text, [left - MARK - 4, row + 5], TICK, Align::End, false);
        }
        self.write(&format!("r [{name}]"), [axis, bottom + 52], Self::LETTERS, Align::Middle, false);
        let middle = surface + depth / 2;
        self.write(&format!("z [{name}]"), [left - 56, middle], Self::LETTERS, Align::Middle, true);
    }

    fn bar(&mut self, case: &Case, [half, depth]: [i64; 2]) {
        let Section { axis, surface, .. } = self.section;
        let field = case.record.fields[0];
        let unit = field.unit(&case.units());
        let end = range(case, field);
        // the end of the range is in the unit of the recording
        let (name, per) = unit.for_axis(end / unit.scale);
        let end = end * per / unit.scale;
        let left = axis + half + 24;
        let right = left + BAR;
        let (top, height) = (TOP, surface + depth - TOP);
        for row in 0..height {
            let share = 1.0 - 2.0 * (row as f64 + 0.5) / height as f64;
            self.base.fill([left, right], [top + row, top + row + 1], colour(level((share * SIDE) as f32)));
        }
        for rows in [[top - 1, top], [top + height, top + height + 1]] {
            self.base.fill([left - 1, right + 1], rows, BLACK);
        }
        for column in [left - 1, right] {
            self.base.fill([column, column + 1], [top, top + height], BLACK);
        }
        for part in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            let row = top + (0.5 * (1.0 - part) * height as f64).round() as i64;
            self.base.fill([right, right + MARK], [row, row + 1], BLACK);
            let text = (part * end).to_string();
            // a range far from 1 without a unit
            let text = if text.len() > LONGEST_TICK { format!("{:e}", part * end) } else { text };
            let text = text.replace('-', "−");
            self.write(&text, [right + MARK + 4, row + 5], TICK, Align::Start, false);
        }
        let label = format!("{} [{name}]", field.name().replace('_', " "));
        self.write(&label, [left + 96, top + height / 2], Self::LETTERS, Align::Middle, true);
    }

    /// Paints a section over the base.
    ///
    /// * `levels`: of the section, shape `(rows, columns, fields)`; the first field is shown
    pub fn paint(&self, levels: &[u8], fields: usize, image: &mut Raster) {
        self.section.paint(image, |row, column| levels[(row * self.columns + column) * fields]);
    }
}

/// A tick with the digits that its distance from the next one needs.
fn shown(tick: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{tick:.decimals$}")
}

#[cfg(test)]
mod tests {
    use percuss_canvas::{DIVERGING, WHITE};

    use super::*;

    fn plate(name: &str, settings: &[&str]) -> (Viewport, Plate) {
        let case = Case::sound(name, settings);
        let viewport = Viewport::new(&case);
        let plate = Plate::new(&case, &viewport);
        (viewport, plate)
    }

    #[test]
    fn pixels_of_the_viewport_are_squares_of_their_colour() {
        let (viewport, plate) = plate("fig5", &[]);
        let (columns, rows) = (2 * viewport.columns, viewport.rows);
        let mut image = plate.base.clone();
        // two fields; the right column of the deepest row is pulled, the rest pressed
        let mut levels = vec![254; 2 * columns * rows];
        levels[2 * (columns - 1)] = 2;
        plate.paint(&levels, 2, &mut image);
        let Section { axis, surface, .. } = plate.section;
        let [half, block] = [plate.section.columns.len() / 2, plate.section.columns.len() / columns];
        assert!(image.width >= 1200 && block > 1);
        let rgb = |column: i64, row: i64| {
            plate.palette[usize::from(image.pixels[row as usize * image.width + column as usize])]
        };
        let (block, right, bottom) = (block as i64, axis + half as i64, surface + (rows * block) as i64);
        for (column, row) in [(1, 1), (block, block)] {
            assert_eq!(rgb(right - column, bottom - row), DIVERGING[0]);
        }
        for (column, row) in [(block + 1, 1), (1, block + 1), (2 * half as i64, 1)] {
            assert_eq!(rgb(right - column, bottom - row), DIVERGING[4]);
        }
        assert_eq!(rgb(axis, surface - 1), [255; 3], "room for the indenter");
    }

    #[test]
    fn a_narrow_section_has_room_aside_and_is_not_too_high() {
        let (_, plate) = plate("fig9-minf", &["record.r_max=1.5"]);
        assert_eq!(plate.base.width, WIDTH as usize);
        assert!(plate.base.height < 1200 && plate.section.columns.len() < 400, "{}", plate.base.height);
    }

    #[test]
    fn the_colour_bar_has_white_in_the_middle() {
        let (_, plate) = plate("fig5", &[]);
        let column = plate.section.left + plate.section.columns.len() + 24 + BAR as usize / 2;
        let bar: Vec<u8> = plate.base.pixels.iter().skip(column).step_by(plate.base.width).copied().collect();
        let bar: Vec<[u8; 3]> = bar
            .into_iter()
            .filter(|pixel| *pixel > 17)
            .map(|pixel| plate.palette[usize::from(pixel)])
            .collect();
        let place =
            |colour: [u8; 3]| bar.iter().position(|shade| *shade == colour).expect("a colour of the bar");
        let (white, blue) = (place(DIVERGING[2]), place(DIVERGING[0]));
        assert!(white.abs_diff(bar.len() / 2) <= 2 && blue + 1 >= bar.len() - 1, "{white} {blue}");
        assert!(bar[0][0] > bar[0][2], "red is above");
        assert!(plate.base.pixels.contains(&BLACK) && plate.base.pixels[0] == WHITE);
    }
}
