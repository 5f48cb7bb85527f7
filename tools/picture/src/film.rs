//! Pictures that move: axes, scales and colours stay; a section, curves and a body beside it move.

use kuva::render::render::Scene;
use percuss_canvas::{Align, Raster as Canvas, Section as Painter, Text};
use resvg::tiny_skia::{FillRule, Mask, Paint, PathBuilder, Pixmap, PixmapPaint, Rect, Stroke, Transform};

use crate::{
    LARGEST,
    image::{Axes, Colours, Image, Place, Scale, Side, bar, layers::names},
    output::paint,
};

/// Width of a film \[units\]; its height follows from the section.
const WIDTH: f64 = 960.0;
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

/// Colour of curves, the first of the palette of diagrams.
pub(crate) const CURVE: [u8; 3] = [0x00, 0x72, 0xb2];

/// Colour of what stays of a curve.
const REST: [u8; 3] = [196, 196, 196];

/// A section of which the values move.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its rows, columns, layers and labels. Its values are those of a moment.
    pub image: Image,
    /// The values of the ends of the colours are ± this.
    pub range: f64,
    /// Length above the first row, where a body is seen.
    pub headroom: f64,
    /// Outline of the body from its middle to its edge: column, height over the tip.
    pub outline: Vec<[f64; 2]>,
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
    /// Row of the tip of the body; none without a body.
    pub depth: Option<f64>,
    /// Column where the contact ends.
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
        Ok(Self { at, ends, transform, mask })
    }

    /// Where a point is \[units\].
    fn point(&self, (x, y): (f64, f64)) -> (f32, f32) {
        let share = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        let (across, up) = (share(x, self.ends[0]), share(y, self.ends[1]));
        let [left, top, width, height] = self.at;
        // far outside is as good as infinitely far
        let near = |share: f64| share.clamp(-9.0, 9.0);
        ((left + near(across) * width) as f32, (top + near(1.0 - up) * height) as f32)
    }

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
}

/// The section of a film, on a raster of its own.
struct Cells {
    painter: Painter,
    /// Left and top of the raster on the picture.
    corner: (usize, usize),
    /// Values of a row.
    width: usize,
    scale: Scale,
    /// The face of the body \[pixels\].
    face: Vec<i64>,
    /// Pixels of a length along rows and down.
    pixels: [f64; 2],
}

/// A film: draws its frames one by one.
pub struct Film {
    base: Pixmap,
    /// Over the section: its layers.
    over: Option<Pixmap>,
    scale: f32,
    palette: [[u8; 3]; 256],
    cells: Option<Cells>,
    /// Windows, and true where the end of the curve has a dot.
    diagrams: Vec<(Window, bool)>,
}

/// The colours of sections in films.
pub(crate) fn colours() -> [[u8; 3]; 256] {
    percuss_canvas::palette(percuss_canvas::diverging)
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
        let palette = colours();
        write(&stage.title, Align::Start, scale, &palette, &mut base);
        let (mut cells, mut over) = (None, None);
        if let Some((section, (x, y, place))) = stage.section.as_ref().zip(places.section) {
            let (low, high) = section.image.rows.ends();
            let axes = Axes {
                ends: [section.image.columns.ends(), (low - section.headroom, high)],
                upward: false,
                title: "",
                labels: [&section.image.column_label, &section.image.row_label],
            };
            let mut scene = axes.scene(&place, None);
            let film = Cells::of(section, (x, y), &place, f64::from(scale));
            scene.elements.extend(bar(&film.scale, &place, &section.image.value_label));
            paint(scene, to_pixels(x, y), &mut base)?;
            let mut scene = Scene::new(WIDTH, places.height);
            scene.background_color = None;
            scene.elements = names(&section.image, &below_headroom(section, &place));
            if !scene.elements.is_empty() {
                let mut pixels = Pixmap::new(size[0], size[1]).ok_or("the picture is too large")?;
                paint(scene, to_pixels(x, y), &mut pixels)?;
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
            let window = Window::new(at, diagram.ends, scale, size)?;
            window.stroke(&mut base, &diagram.rest, REST, 1.4);
            diagrams.push((window, !diagram.rest.is_empty()));
        }
        Ok(Self { base, over, scale, palette, cells, diagrams })
    }

    /// Columns and rows of its frames \[pixels\].
    pub fn size(&self) -> (u32, u32) {
        (self.base.width(), self.base.height())
    }

    /// Draws a frame.
    pub fn frame(&self, moment: &Moment<'_>) -> Raster {
        let mut pixels = self.base.clone();
        if let Some(cells) = &self.cells {
            blit(&cells.paint(moment), cells.corner, &self.palette, &mut pixels);
            if let Some(over) = &self.over {
                let paint = PixmapPaint::default();
                pixels.draw_pixmap(0, 0, over.as_ref(), &paint, Transform::identity(), None);
            }
        }
        for ((window, has_dot), curve) in self.diagrams.iter().zip(moment.curves) {
            window.stroke(&mut pixels, curve, CURVE, 1.8);
            if let Some(&last) = curve.last().filter(|_| *has_dot) {
                window.dot(&mut pixels, last, CURVE);
            }
        }
        write(moment.time, Align::End, self.scale, &self.palette, &mut pixels);
        let (width, height) = self.size();
        // all is opaque
        Raster { width, height, rgba: pixels.take() }
    }
}

impl Cells {
    /// The section at its place.
    ///
    /// * `scale`: pixels in a unit
    fn of(section: &Section, (x, y): (f64, f64), place: &Place, scale: f64) -> Self {
        let image = &section.image;
        let (across, down) = (image.columns.ends(), image.rows.ends());
        // pixels whose middle is within
        let pixels = |start: f64, length: f64| {
            let from = (start * scale).round().max(0.0) as usize;
            (from, (((start + length) * scale).round() as usize).saturating_sub(from))
        };
        let (columns, rows) = (pixels(x + place.left, place.width), pixels(y + place.top, place.height));
        let painter = image.section([columns.1, rows.1], section.headroom);
        let pixels =
            [columns.1 as f64 / (across.1 - across.0), rows.1 as f64 / (down.1 - down.0 + section.headroom)];
        Self {
            face: painter.face(&section.outline, pixels),
            painter,
            corner: (columns.0, rows.0),
            width: image.columns.length(),
            scale: Scale { low: -section.range, high: section.range, colours: Colours::Diverging },
            pixels,
        }
    }

    fn paint(&self, moment: &Moment<'_>) -> Canvas {
        let mut canvas = Canvas::new(self.painter.columns.len(), self.painter.rows.len());
        let value = |row: usize, column: usize| moment.values.get(row * self.width + column);
        self.painter.paint(&mut canvas, |row, column| {
            self.scale.level(value(row, column).copied().unwrap_or(f64::NAN))
        });
        if let Some(depth) = moment.depth {
            self.painter.indenter(&mut canvas, &self.face, depth * self.pixels[1]);
        }
        self.painter.contact(&mut canvas, moment.contact * self.pixels[0]);
        canvas
    }
}

/// Lays what is drawn on a raster over a picture.
fn blit(raster: &Canvas, (left, top): (usize, usize), palette: &[[u8; 3]; 256], pixels: &mut Pixmap) {
    let width = pixels.width() as usize;
    let rows = pixels.data_mut().chunks_exact_mut(4 * width).skip(top);
    for (row, numbers) in rows.zip(raster.pixels.chunks_exact(raster.width)) {
        for (pixel, number) in row[4 * left..].chunks_exact_mut(4).zip(numbers) {
            if *number != percuss_canvas::WHITE {
                pixel[..3].copy_from_slice(&palette[usize::from(*number)]);
            }
        }
    }
}

/// Writes a text at one of the ends of the top of a picture.
///
/// * `scale`: pixels in a unit
fn write(label: &str, align: Align, scale: f32, palette: &[[u8; 3]; 256], pixels: &mut Pixmap) {
    let scale = f64::from(scale);
    let x = if align == Align::Start { 16.0 } else { WIDTH - 16.0 };
    let mut canvas = Canvas::new(pixels.width() as usize, (TITLE * scale) as usize);
    let text = Text { label, at: [x * scale, 22.0 * scale], size: 16.0 * scale, align, is_upright: false };
    canvas.text(&text);
    blit(&canvas, (0, 0), palette, pixels);
}

/// The part of the place of a section that its rows take.
fn below_headroom(section: &Section, place: &Place) -> Place {
    let (low, high) = section.image.rows.ends();
    let height = place.height * (high - low) / (high - low + section.headroom);
    Place { top: place.top + place.height - height, height, ..*place }
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
            section: Some(Section {
                image,
                range: 2.0,
                headroom: 0.4,
                outline: vec![[0.0, 0.0], [0.5, 0.2]],
            }),
            diagrams: vec![diagram(Vec::new()), diagram(vec![(0.0, 0.0), (1.0, 2.0)])],
            width: 480,
        }
    }

    fn frame(film: &Film, value: f64) -> Raster {
        let curves = [vec![(0.0, 1.0), (1.0, 1.0)], vec![(0.0, 0.0), (0.5, value)]];
        let values = vec![value; 300];
        let moment =
            Moment { time: "t = 1", values: &values, depth: Some(0.0), contact: 0.2, curves: &curves };
        film.frame(&moment)
    }

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
        let colour = |level: u8| colours()[usize::from(percuss_canvas::colour(level))];
        assert_eq!(at(&half), colour(191));
        assert_eq!((at(&whole), at(&beyond)), (colour(254), colour(254)));
        assert_eq!(at(&frame(&film, -1.0)), colour(65));
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
        assert_eq!(film.frame(&Moment { curves: &curves, ..Moment::default() }).width, 480);
    }
}
