//! Pictures that move: axes, scales and colours stay; a section, curves and a body beside it move.

use kuva::{
    Palette,
    render::{
        color::Color,
        render::{Primitive, Scene, TextAnchor},
    },
};
use resvg::tiny_skia::{FillRule, Mask, Paint, PathBuilder, Pixmap, PixmapPaint, Rect, Stroke, Transform};

use crate::{
    LARGEST,
    image::{Axes, Colours, Image, Place, Scale, Side, bar, layers::layers},
    output::paint,
};

/// Width of a film \[units\]; its height follows from the section.
const WIDTH: f64 = 960.0;
/// Room for the title.
const TITLE: f64 = 34.0;
/// Margins of a part: left, right, top, bottom; of the section at the right also the colour bar.
const MARGINS: [f64; 4] = [74.0, 22.0, 12.0, 50.0];
const BAR: f64 = 112.0;
/// Size of a diagram beside another, and of a section beside diagrams.
const DIAGRAM: (f64, f64) = (0.5 * WIDTH, 270.0);
/// Height of a section in its width above which it stands beside the diagrams, not above them.
const STANDING: f64 = 0.62;
/// Largest height of a section beside the diagrams.
const TALLEST: f64 = 620.0;

/// Levels of colours on each side of 0.
pub(crate) const LEVELS: i32 = 100;
/// Colour of the body, of its outline and of what stays of a curve.
pub(crate) const BODY: [u8; 3] = [200, 200, 204];
pub(crate) const INK: [u8; 3] = [40, 40, 40];
pub(crate) const REST: [u8; 3] = [196, 196, 196];

/// A section of which the values move.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its rows, columns, layers and labels. Its values are those of a moment.
    pub image: Image,
    /// The values of the ends of the colours are ± this.
    pub range: f64,
    /// Length above the first row, where a body is seen.
    pub headroom: f64,
}

/// A diagram of which a curve moves.
#[derive(Clone, Debug, Default)]
pub struct Diagram {
    /// Labels of the axes.
    pub labels: [String; 2],
    /// Ends of the axes.
    pub ends: [(f64, f64); 2],
    /// A curve that stays: what moves is the part of it that has been passed.
    pub rest: Vec<(f64, f64)>,
}

/// What stays in a film.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    /// Title.
    pub title: String,
    /// The section, if there is one.
    pub section: Option<Section>,
    /// Diagrams, two at most.
    pub diagrams: Vec<Diagram>,
    /// Width \[pixels\].
    pub width: u32,
}

/// What moves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment<'a> {
    /// The time in words.
    pub time: &'a str,
    /// Values of the section, row-major.
    pub values: &'a [f64],
    /// Outline of the body at the section, column and row, from its middle to its edge; rows above the surface are negative.
    pub body: &'a [(f64, f64)],
    /// Where the contact ends, from the first column on.
    pub contact: f64,
    /// A curve for each diagram.
    pub curves: &'a [Vec<(f64, f64)>],
}

/// Pixels of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue and opacity of every pixel, row by row.
    pub rgba: Vec<u8>,
}

/// A window onto numbers, in a picture.
struct Window {
    /// Left, top, width, height \[units\].
    at: [f64; 4],
    ends: [(f64, f64); 2],
    /// True if the numbers of the vertical axis grow upwards.
    upward: bool,
    /// From units to pixels.
    transform: Transform,
    /// The pixels within, and half of a curve around them.
    mask: Mask,
}

impl Window {
    /// * `scale`: pixels in a unit
    /// * `size`: of the picture \[pixels\]
    fn new(
        at: [f64; 4],
        ends: [(f64, f64); 2],
        upward: bool,
        scale: f32,
        [width, height]: [u32; 2],
    ) -> Result<Self, String> {
        const EDGE: f32 = 2.0;
        let transform = Transform::from_scale(scale, scale);
        let [left, top, across, down] = at.map(|length| length as f32);
        let clip = Rect::from_xywh(left - EDGE, top - EDGE, across + 2.0 * EDGE, down + 2.0 * EDGE);
        let (Some(mut mask), Some(clip)) = (Mask::new(width, height), clip) else {
            return Err("the picture is too large".into());
        };
        mask.fill_path(&PathBuilder::from_rect(clip), FillRule::Winding, false, transform);
        Ok(Self { at, ends, upward, transform, mask })
    }

    /// Where a point is \[units\].
    fn point(&self, (x, y): (f64, f64)) -> (f32, f32) {
        let share = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        let (across, up) = (share(x, self.ends[0]), share(y, self.ends[1]));
        let [left, top, width, height] = self.at;
        let down = if self.upward { 1.0 - up } else { up };
        // far outside is as good as infinitely far
        let near = |share: f64| share.clamp(-9.0, 9.0);
        ((left + near(across) * width) as f32, (top + near(down) * height) as f32)
    }

    /// A curve.
    fn stroke(&self, pixels: &mut Pixmap, points: &[(f64, f64)], colour: [u8; 3], width: f32) {
        let mut builder = PathBuilder::new();
        let is_visible = |point: &(f64, f64)| point.0.abs() < LARGEST && point.1.abs() < LARGEST;
        for stretch in points.split(|point| !is_visible(point)) {
            for (i, &point) in stretch.iter().enumerate() {
                let (x, y) = self.point(point);
                if i == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
            }
        }
        if let Some(path) = builder.finish() {
            let stroke = Stroke { width, ..Stroke::default() };
            pixels.stroke_path(&path, &ink(colour), &stroke, self.transform, Some(&self.mask));
        }
    }

    /// A dot, which may be half outside.
    fn dot(&self, pixels: &mut Pixmap, point: (f64, f64), colour: [u8; 3]) {
        let (x, y) = self.point(point);
        if let Some(path) = PathBuilder::from_circle(x, y, 4.0) {
            pixels.fill_path(&path, &ink(colour), FillRule::Winding, self.transform, None);
        }
    }

    /// A body above the first row, and the contact under it.
    fn body(&self, moment: &Moment<'_>, pixels: &mut Pixmap) {
        let (left, right) = self.ends[0];
        let top = self.ends[1].0;
        let inside = moment.body.iter().filter(|(x, _)| *x <= right);
        let outline: Vec<(f64, f64)> = inside.map(|&(x, y)| (x.max(left), y.max(top))).collect();
        if let [first, .., last] = outline.as_slice() {
            let mut builder = PathBuilder::new();
            let start = self.point((first.0, top));
            builder.move_to(start.0, start.1);
            for point in outline.iter().copied().chain([(last.0, top)]) {
                let (x, y) = self.point(point);
                builder.line_to(x, y);
            }
            builder.close();
            if let Some(path) = builder.finish() {
                pixels.fill_path(&path, &ink(BODY), FillRule::Winding, self.transform, None);
            }
            self.stroke(pixels, &outline, INK, 1.2);
        }
        if moment.contact > 0.0 {
            self.stroke(pixels, &[(left, 0.0), (moment.contact.min(right), 0.0)], INK, 3.0);
        }
    }
}

/// The section of a film: its window, and the element of every pixel.
struct Cells {
    window: Window,
    columns: Vec<Option<usize>>,
    rows: Vec<Option<usize>>,
    /// Left and top of the first pixel.
    corner: (u32, u32),
    width: usize,
    range: f64,
    map: Vec<[u8; 3]>,
}

/// A film: draws its frames one by one.
pub struct Film {
    base: Pixmap,
    /// Over the section: its layers.
    over: Option<Pixmap>,
    scale: f32,
    cells: Option<Cells>,
    /// Windows, and true where the end of the curve has a dot.
    diagrams: Vec<(Window, bool)>,
}

/// The colours of values from −[`LEVELS`] to +[`LEVELS`].
pub(crate) fn levels() -> Vec<[u8; 3]> {
    let scale = Scale { low: -1.0, high: 1.0, colours: Colours::Diverging };
    let rgb = |level: i32| match scale.colour(f64::from(level) / f64::from(LEVELS)) {
        Color::Rgb(r, g, b) => [r, g, b],
        _ => [255; 3],
    };
    (-LEVELS..=LEVELS).map(rgb).collect()
}

/// The colour of curves.
pub(crate) fn curve_colour() -> [u8; 3] {
    let palette = Palette::okabe_ito();
    let hex = palette.colors().get(4).map_or("#0072B2", String::as_str);
    [1, 3, 5].map(|at| hex.get(at..at + 2).and_then(|byte| u8::from_str_radix(byte, 16).ok()).unwrap_or(0))
}

impl Film {
    /// Draws what stays.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be drawn.
    pub fn new(stage: &Stage) -> Result<Self, String> {
        let places = Places::of(stage)?;
        let scale = f64::from(stage.width) / WIDTH;
        // even numbers of pixels, which codecs of films want
        let size = [WIDTH, places.height].map(|length| 2 * (0.5 * length * scale).round().max(1.0) as u32);
        let mut base = Pixmap::new(size[0], size[1]).ok_or("the picture is too large")?;
        base.fill(resvg::tiny_skia::Color::WHITE);
        let scale = scale as f32;
        let to_pixels =
            |x: f64, y: f64| Transform::from_translate(x as f32, y as f32).post_scale(scale, scale);
        let mut title = empty(WIDTH, places.height);
        title.elements.push(text(16.0, 22.0, stage.title.clone(), TextAnchor::Start));
        paint(title, to_pixels(0.0, 0.0), &mut base)?;
        let (mut cells, mut over) = (None, None);
        if let Some((section, (x, y, place))) = stage.section.as_ref().zip(places.section) {
            let film = section_cells(section, (x, y), &place, scale, size)?;
            let axes = Axes {
                ends: film.window.ends,
                upward: false,
                title: "",
                labels: [&section.image.column_label, &section.image.row_label],
            };
            let mut scene = axes.scene(&place, None);
            let scale = Scale { low: -section.range, high: section.range, colours: Colours::Diverging };
            scene.elements.extend(bar(&scale, &place, &section.image.value_label));
            paint(scene, to_pixels(x, y), &mut base)?;
            let mut names = empty(WIDTH, places.height);
            names.elements = layers(&section.image, &below_headroom(section, &place));
            if !names.elements.is_empty() {
                let mut pixels = Pixmap::new(size[0], size[1]).ok_or("the picture is too large")?;
                paint(names, to_pixels(x, y), &mut pixels)?;
                over = Some(pixels);
            }
            cells = Some(film);
        }
        let mut diagrams = Vec::new();
        for (diagram, (x, y, place)) in stage.diagrams.iter().zip(places.diagrams) {
            let labels = [diagram.labels[0].as_str(), diagram.labels[1].as_str()];
            let axes = Axes { ends: diagram.ends, upward: true, title: "", labels };
            paint(axes.scene(&place, None), to_pixels(x, y), &mut base)?;
            let at = [x + place.left, y + place.top, place.width, place.height];
            let window = Window::new(at, diagram.ends, true, scale, size)?;
            window.stroke(&mut base, &diagram.rest, REST, 1.4);
            diagrams.push((window, !diagram.rest.is_empty()));
        }
        Ok(Self { base, over, scale, cells, diagrams })
    }

    /// Columns and rows of its frames \[pixels\].
    pub fn size(&self) -> (u32, u32) {
        (self.base.width(), self.base.height())
    }

    /// Draws a frame.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be drawn.
    pub fn frame(&self, moment: &Moment<'_>) -> Result<Raster, String> {
        let mut pixels = self.base.clone();
        if let Some(cells) = &self.cells {
            cells.paint(moment.values, &mut pixels);
            if let Some(over) = &self.over {
                let paint = PixmapPaint::default();
                pixels.draw_pixmap(0, 0, over.as_ref(), &paint, Transform::identity(), None);
            }
            cells.window.body(moment, &mut pixels);
        }
        for ((window, has_dot), curve) in self.diagrams.iter().zip(moment.curves) {
            window.stroke(&mut pixels, curve, curve_colour(), 1.8);
            if let Some(&last) = curve.last().filter(|_| *has_dot) {
                window.dot(&mut pixels, last, curve_colour());
            }
        }
        let mut scene = empty(WIDTH, f64::from(self.base.height()) / f64::from(self.scale));
        scene.elements.push(text(WIDTH - 16.0, 22.0, moment.time.into(), TextAnchor::End));
        paint(scene, Transform::from_scale(self.scale, self.scale), &mut pixels)?;
        let (width, height) = self.size();
        // all is opaque
        Ok(Raster { width, height, rgba: pixels.take() })
    }
}

impl Cells {
    /// The values as pixels.
    fn paint(&self, values: &[f64], pixels: &mut Pixmap) {
        let width = pixels.width() as usize;
        let data = pixels.data_mut();
        for (j, row) in self.rows.iter().enumerate() {
            let Some(row) = row.and_then(|row| values.get(row * self.width..(row + 1) * self.width)) else {
                continue;
            };
            let start = 4 * ((self.corner.1 as usize + j) * width + self.corner.0 as usize);
            for (pixel, column) in data[start..].chunks_exact_mut(4).zip(&self.columns) {
                let Some(value) = column.and_then(|column| row.get(column)) else { continue };
                let level = (value / self.range).clamp(-1.0, 1.0) * f64::from(LEVELS);
                let [r, g, b] = if level.is_nan() {
                    [160; 3]
                } else {
                    self.map[(level.round() as i32 + LEVELS) as usize]
                };
                pixel.copy_from_slice(&[r, g, b, 255]);
            }
        }
    }
}

/// The part of the place of a section that its rows take.
fn below_headroom(section: &Section, place: &Place) -> Place {
    let (low, high) = section.image.rows.ends();
    let height = place.height * (high - low) / (high - low + section.headroom);
    Place { top: place.top + place.height - height, height, ..*place }
}

/// The section at its place.
///
/// * `scale`: pixels in a unit
/// * `size`: of the picture \[pixels\]
fn section_cells(
    section: &Section,
    (x, y): (f64, f64),
    place: &Place,
    scale: f32,
    size: [u32; 2],
) -> Result<Cells, String> {
    let image = &section.image;
    let (across, down) = (image.columns.ends(), image.rows.ends());
    let top = down.0 - section.headroom;
    let at = [x + place.left, y + place.top, place.width, place.height];
    let window = Window::new(at, [across, (top, down.1)], false, scale, size)?;
    let scale = f64::from(scale);
    // pixels whose middle is within
    let pixels = |start: f64, length: f64| {
        let from = (start * scale).round().max(0.0) as u32;
        (from, ((start + length) * scale).round() as u32)
    };
    let (columns, rows) = (pixels(at[0], at[2]), pixels(at[1], at[3]));
    let element =
        |pixel: u32, (start, length): (f64, f64), (low, high): (f64, f64), side: &Side, first: f64| {
            let share = ((f64::from(pixel) + 0.5) / scale - start) / length;
            let position = low + share * (high - low);
            (position >= first).then(|| side.cell(position)).flatten()
        };
    Ok(Cells {
        columns: (columns.0..columns.1)
            .map(|i| element(i, (at[0], at[2]), across, &image.columns, across.0))
            .collect(),
        rows: (rows.0..rows.1)
            .map(|j| element(j, (at[1], at[3]), (top, down.1), &image.rows, down.0))
            .collect(),
        corner: (columns.0, rows.0),
        width: image.columns.length(),
        range: section.range,
        map: levels(),
        window,
    })
}

/// Where the parts of a film are: left, top, and the place of the axes within.
struct Places {
    height: f64,
    section: Option<(f64, f64, Place)>,
    diagrams: Vec<(f64, f64, Place)>,
}

impl Places {
    fn of(stage: &Stage) -> Result<Self, String> {
        let [left, right, top, bottom] = MARGINS;
        let place = |width: f64, height: f64, aside: f64| Place {
            left,
            top,
            width: width - left - right - aside,
            height: height - top - bottom,
            size: (width, height),
        };
        let diagram = |x: f64, y: f64, height: f64| (x, y, place(DIAGRAM.0, height, 0.0));
        let Some(section) = &stage.section else {
            let diagrams = [0.0, DIAGRAM.0].map(|x| diagram(x, TITLE, DIAGRAM.1 * 1.2)).into();
            return Ok(Self { height: TITLE + DIAGRAM.1 * 1.2, section: None, diagrams });
        };
        let image = &section.image;
        if !(image.rows.increases() && image.columns.increases()) {
            return Err(format!("the axes of `{}` do not increase", image.title));
        }
        let length = |side: &Side| side.ends().1 - side.ends().0;
        let equal = (length(&image.rows) + section.headroom) / length(&image.columns);
        let ratio = if image.is_equal { equal.clamp(0.05, 20.0) } else { 0.4 };
        if ratio <= STANDING {
            let width = WIDTH - left - right - BAR;
            let height = width * ratio + top + bottom;
            let diagrams = [0.0, DIAGRAM.0].map(|x| diagram(x, TITLE + height, DIAGRAM.1)).into();
            let section = Some((0.0, TITLE, place(WIDTH, height, BAR)));
            return Ok(Self { height: TITLE + height + DIAGRAM.1, section, diagrams });
        }
        let width = (WIDTH - DIAGRAM.0 - left - right - BAR).min(TALLEST / ratio);
        let height = (width * ratio).min(TALLEST) + top + bottom;
        let half = (0.5 * height).max(DIAGRAM.1 * 0.8);
        let mut place = place(left + right + BAR + width, height, BAR);
        place.size.0 = place.size.0.max(0.5 * WIDTH);
        let diagrams = [0.0, half].map(|y| diagram(WIDTH - DIAGRAM.0, TITLE + y, half)).into();
        Ok(Self { height: TITLE + height.max(2.0 * half), section: Some((0.0, TITLE, place)), diagrams })
    }
}

fn ink([r, g, b]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

/// A scene of some size \[units\].
fn empty(width: f64, height: f64) -> Scene {
    let mut scene = Scene::new(width, height);
    scene.background_color = None;
    scene
}

fn text(x: f64, y: f64, content: String, anchor: TextAnchor) -> Primitive {
    Primitive::Text { x, y, content, size: 16, anchor, rotate: None, bold: false, color: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Moving;

    fn stage() -> Stage {
        let side = |length| Side::Even { start: 0.05, step: 0.1, length };
        let image = Image { rows: side(10), columns: side(30), is_equal: true, ..Image::default() };
        let diagram =
            |rest: Vec<(f64, f64)>| Diagram { ends: [(0.0, 1.0), (0.0, 2.0)], rest, ..Diagram::default() };
        Stage {
            title: "a title".into(),
            section: Some(Section { image, range: 2.0, headroom: 0.4 }),
            diagrams: vec![diagram(Vec::new()), diagram(vec![(0.0, 0.0), (1.0, 2.0)])],
            width: 480,
        }
    }

    fn frame(film: &Film, value: f64) -> Raster {
        let curves = [vec![(0.0, 1.0), (1.0, 1.0)], vec![(0.0, 0.0), (0.5, value)]];
        let values = vec![value; 300];
        let body = [(0.0, 0.0), (0.5, -0.2)];
        let moment = Moment { time: "t = 1", values: &values, body: &body, contact: 0.2, curves: &curves };
        film.frame(&moment).expect("a frame")
    }

    /// A pixel of a frame.
    fn pixel(raster: &Raster, x: u32, y: u32) -> [u8; 3] {
        let at = 4 * (y * raster.width + x) as usize;
        [raster.rgba[at], raster.rgba[at + 1], raster.rgba[at + 2]]
    }

    #[test]
    fn colours_and_axes_stay_while_values_move() {
        let film = Film::new(&stage()).expect("a film");
        let (width, height) = film.size();
        assert!(width == 480 && width % 2 == 0 && height % 2 == 0);
        let [half, whole, beyond] = [1.0, 2.0, 9.0].map(|value| frame(&film, value));
        // the middle of the section
        let at = |raster: &Raster| pixel(raster, 230, 90);
        let levels = levels();
        assert_eq!(at(&half), levels[150]);
        assert_eq!((at(&whole), at(&beyond)), (levels[200], levels[200]));
        assert_eq!(at(&frame(&film, -1.0)), levels[50]);
        assert_eq!(at(&frame(&film, f64::NAN)), [160; 3]);
        // left of the axes nothing moves
        let left = |raster: &Raster| (0..height).map(|y| pixel(raster, 20, y)).collect::<Vec<_>>();
        assert_eq!(left(&half), left(&whole));
        assert!(at(&half) != [255; 3] && pixel(&half, 42, 40) != [255; 3], "a body above the section");
    }

    #[test]
    fn frames_are_written_as_what_changes() {
        let film = Film::new(&stage()).expect("a film");
        let frames = [0.5, 0.5, 1.5].map(|value| frame(&film, value));
        let write = || {
            let mut bytes = Vec::new();
            let mut moving = Moving::new(&mut bytes, film.size(), 5).expect("a picture");
            frames.iter().for_each(|frame| moving.add(frame).expect("a frame"));
            moving.finish().expect("an end");
            bytes
        };
        let gif = write();
        assert!(gif == write());
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::Indexed);
        let mut decoder = options.read_info(gif.as_slice()).expect("a GIF");
        let mut sizes = Vec::new();
        while let Some(frame) = decoder.read_next_frame().expect("a frame") {
            assert_eq!(frame.delay, 5);
            sizes.push((u32::from(frame.width), u32::from(frame.height)));
        }
        assert_eq!((sizes[0], sizes[1], sizes.len()), (film.size(), (1, 1), 3));
        assert!(sizes[2].0 < sizes[0].0 && sizes[2].0 > 100, "{sizes:?}");
    }

    #[test]
    fn axes_that_do_not_increase_are_refused() {
        let mut stage = stage();
        if let Some(section) = &mut stage.section {
            section.image.columns = Side::default();
        }
        assert!(Film::new(&stage).is_err());
        let film = Film::new(&Stage { section: None, ..stage }).expect("without a section");
        let curves = [vec![(0.0, f64::NAN), (0.5, 1e300), (1.0, 5.0)], Vec::new()];
        assert!(film.frame(&Moment { curves: &curves, ..Moment::default() }).is_ok());
    }
}
