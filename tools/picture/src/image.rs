//! Images of matrices.

pub(crate) mod layers;
mod side;

use std::sync::Arc;

use kuva::{
    TickFormat,
    plot::{ColorMap, LinePlot},
    render::{
        color::Color,
        layout::Layout,
        plots::Plot,
        render::{Primitive, Scene, TextAnchor},
        render_utils::generate_ticks,
    },
};

use percuss_canvas::{Raster, SIDE, Section, colour, diverging, level, palette};

use crate::{
    LARGEST, Medium, SIZE,
    curves::base,
    output::render,
    terminal::{self, Frame, shown},
    typeset::text,
};

pub use layers::Layer;
pub use side::Side;

/// A matrix, drawn as an image.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// Title.
    pub title: String,
    /// Label of the colours.
    pub value_label: String,
    /// Label of the vertical axis.
    pub row_label: String,
    /// Label of the horizontal axis.
    pub column_label: String,
    /// Positions of rows.
    pub rows: Side,
    /// Positions of columns.
    pub columns: Side,
    /// Row-major.
    pub values: Vec<f64>,
    /// The first row is at the bottom instead of the top.
    pub upward: bool,
    /// A distance is as long along rows as along columns, where the picture would not become a stripe.
    pub is_equal: bool,
    /// Colours of its values.
    pub colours: Colours,
    /// Layers of its rows, from the first on.
    pub layers: Vec<Layer>,
}

/// Colours of values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colours {
    /// From dark to light.
    #[default]
    Sequential,
    /// Blue below 0, white at 0, red above: as strong at equal distances from 0.
    Diverging,
}

impl Image {
    /// Smallest and largest value.
    pub fn range(&self) -> (f64, f64) {
        let finite = self.values.iter().copied().filter(|value| value.is_finite());
        finite
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }

    /// Ends of the colours where none are asked for: those of the values, as far from 0 on both sides if the colours diverge.
    fn default_range(&self) -> (f64, f64) {
        let (low, high) = self.range();
        match self.colours {
            Colours::Diverging if low < 0.0 && high > 0.0 => (low.min(-high), high.max(-low)),
            Colours::Diverging if low <= high => (low.min(0.0), high.max(0.0)),
            _ => (low, high),
        }
    }

    /// Where its pixels are on a raster of their own.
    ///
    /// * `columns`, `rows`: of the raster
    /// * `headroom`: length above the first row
    pub(crate) fn section(&self, [columns, rows]: [usize; 2], headroom: f64) -> Section {
        let (across, (low, high)) = (self.columns.ends(), self.rows.ends());
        let down = (low - headroom, high);
        let place = |position: f64, (from, to): (f64, f64), count: usize| {
            ((position - from) / (to - from) * count as f64).round().clamp(-1e6, 1e6) as i64
        };
        let row = |depth: f64| {
            let row = place(depth, down, rows);
            if self.upward { rows as i64 - row } else { row }
        };
        let tops = self.layers.iter().skip(1).map(|layer| layer.top);
        let mut section = Section {
            columns: self.columns.pixels(across, columns),
            rows: self.rows.pixels(down, rows),
            interfaces: tops.filter(|top| *top > low && *top < high).map(row).collect(),
            axis: place(0.0, across, columns),
            surface: row(0.0),
            ..Section::default()
        };
        if self.upward {
            section.rows.reverse();
        }
        section
    }
}

/// Edges of the pixels of a matrix: on paper, and the dots of a terminal [units of the SVG].
const PIXEL: f64 = 1.0;
const DOT: f64 = 5.0;

/// Ratios of height to width of sections that are drawn with equal distances.
const EQUAL: std::ops::RangeInclusive<f64> = 0.04..=25.0;

/// Where an image, its axes and its colours are [units of the SVG].
pub(crate) struct Place {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    /// Size of the picture.
    pub size: (f64, f64),
}

/// Draws a matrix as an image with a colour bar.
///
/// * `range`: values of the ends of the colour scale, by default those of the matrix
///
/// # Errors
///
/// The reason why the picture cannot be drawn.
pub fn draw_image(image: &Image, range: Option<(f64, f64)>, medium: Medium) -> Result<Vec<u8>, String> {
    if image.rows.length() == 0 || image.columns.length() == 0 {
        return Err(format!("`{}` has no values to draw", image.title));
    }
    let (low, high) = range.unwrap_or_else(|| image.default_range());
    if !(low.abs() < LARGEST && high.abs() < LARGEST) {
        return Err(format!("`{}` holds no numbers that can be drawn", image.title));
    }
    if !image.rows.increases() || !image.columns.increases() {
        return Err(format!("the axes of `{}` do not increase", image.title));
    }
    let scale = Scale { low, high, colours: image.colours };
    match medium {
        Medium::Terminal { columns, rows, colour: false } => {
            Ok(shades(image, low, high, columns, rows).into_bytes())
        }
        Medium::Terminal { columns, rows, colour: true } => in_terminal(image, &scale, columns, rows),
        Medium::Svg | Medium::Pdf | Medium::Png => {
            let place = Place::on_paper(image);
            let mut scene = axes(image, &place, None);
            scene.elements.extend(cells(image, &scale, &place, PIXEL));
            scene.elements.extend(layers::names(image, &place));
            scene.elements.extend(bar(&scale, &place, &image.value_label));
            render(scene, medium)
        }
    }
}

fn in_terminal(image: &Image, scale: &Scale, columns: usize, rows: usize) -> Result<Vec<u8>, String> {
    let frame = Frame {
        title: &image.title,
        left: &image.row_label,
        right: &image.value_label,
        legend: Vec::new(),
        columns,
        rows,
        colour: true,
    };
    terminal::draw(frame, |rows| {
        let place = Place::in_terminal(image, columns, rows);
        let mut scene = axes(image, &place, Some(rows));
        scene.elements.extend(cells(image, scale, &place, DOT));
        scene.elements.extend(bar(scale, &place, ""));
        scene
    })
}

impl Place {
    /// Margins of a picture: left, right with the colour bar, top, bottom.
    const MARGINS: [f64; 4] = [78.0, 130.0, 44.0, 58.0];
    /// Greatest height of the matrix.
    const TALLEST: f64 = 620.0;

    fn on_paper(image: &Image) -> Self {
        let [left, right, top, bottom] = Self::MARGINS;
        let (mut width, mut height) = (SIZE.0 - left - right, SIZE.1 - top - bottom);
        if let Some(ratio) = ratio(image) {
            height = width * ratio;
            if height > Self::TALLEST {
                (width, height) = (Self::TALLEST / ratio, Self::TALLEST);
            }
        }
        // a narrow picture keeps room for its title
        let whole = (left + width + right).max(SIZE.0 * 0.75);
        Self { left, top, width, height, size: (whole, top + height + bottom) }
    }

    /// In a terminal a character is twice as high as wide.
    fn in_terminal(image: &Image, columns: usize, rows: usize) -> Self {
        /// Columns and rows of the margins.
        const ASIDE: (f64, f64) = (9.0, 11.0);
        const BELOW: f64 = 3.0;
        /// Units of the SVG in a column.
        const COLUMN: f64 = 10.0;
        let (mut across, mut down) =
            ((columns as f64 - ASIDE.0 - ASIDE.1).max(4.0), (rows as f64 - BELOW - 1.0).max(2.0));
        if let Some(ratio) = ratio(image) {
            (across, down) = (across.min(2.0 * down / ratio), down.min((0.5 * across * ratio).max(2.0)));
        }
        Self {
            left: ASIDE.0 * COLUMN,
            top: COLUMN,
            width: across * COLUMN,
            height: 2.0 * down * COLUMN,
            size: (columns as f64 * COLUMN, 2.0 * rows as f64 * COLUMN),
        }
    }
}

/// Height of a matrix in its width where distances are equal along both.
fn ratio(image: &Image) -> Option<f64> {
    let length = |side: &Side| side.ends().1 - side.ends().0;
    Some(length(&image.rows) / length(&image.columns)).filter(|ratio| image.is_equal && EQUAL.contains(ratio))
}

/// The axes around a matrix.
///
/// * `rows`: of a terminal, where title and label are in the frame
fn axes(image: &Image, place: &Place, rows: Option<usize>) -> Scene {
    let (title, row_label) = if rows.is_none() { (&*image.title, &*image.row_label) } else { ("", "") };
    let (ends, labels) = ([image.columns.ends(), image.rows.ends()], [&image.column_label, row_label]);
    Axes { ends, upward: image.upward, title, labels }.scene(place, rows)
}

pub(crate) struct Axes<'a> {
    /// Ends of the horizontal and of the vertical axis.
    pub ends: [(f64, f64); 2],
    /// False if the numbers of the vertical axis grow downwards.
    pub upward: bool,
    pub title: &'a str,
    pub labels: [&'a str; 2],
}

impl Axes<'_> {
    /// * `rows`: of a terminal
    pub(crate) fn scene(&self, place: &Place, rows: Option<usize>) -> Scene {
        let [x, y] = self.ends;
        // the library draws upward: positions of rows that go down are negative
        let (bottom, top) = if self.upward { y } else { (-y.1, -y.0) };
        let corners = LinePlot::new().with_data([(x.0, bottom), (x.1, top)]);
        let plots: Vec<Plot> = vec![corners.into()];
        let mut layout = base(Layout::auto_from_plots(&plots))
            .with_width(place.size.0)
            .with_height(place.size.1)
            .with_force_margins(place.left, place.size.0 - place.left - place.width)
            .with_force_margins_y(place.top, place.size.1 - place.top - place.height)
            .with_show_grid(false)
            .with_x_label(self.labels[0])
            .with_x_axis_min(x.0)
            .with_x_axis_max(x.1)
            .with_y_axis_min(bottom)
            .with_y_axis_max(top);
        if !self.upward {
            // 0 − v, not −v, which can be a negative zero
            layout =
                layout.with_y_tick_format(TickFormat::Custom(Arc::new(|v| TickFormat::Auto.format(0.0 - v))));
        }
        if !self.title.is_empty() {
            layout = layout.with_title(self.title).with_title_wrap(90);
        }
        if !self.labels[1].is_empty() {
            layout = layout.with_y_label(self.labels[1]);
        }
        if let Some(rows) = rows {
            layout = layout.with_term_rows(u32::try_from(rows).unwrap_or(u32::MAX));
        }
        let mut scene = kuva::render::render::render_multiple(plots, layout);
        scene.elements.retain(|element| !matches!(element, Primitive::PolyLine { .. }));
        scene
    }
}

/// The pixels of a matrix, neighbours of one colour as one.
///
/// * `edge`: of a pixel, about
fn cells(image: &Image, scale: &Scale, place: &Place, edge: f64) -> [Primitive; 1] {
    let whole = [place.width, place.height];
    let size = whole.map(|length| (length / edge).ceil() as usize);
    let mut raster = Raster::new(size[0], size[1]);
    let mut section = image.section(size, 0.0);
    if edge > PIXEL {
        // a dot is too thick for a line
        section.interfaces.clear();
    }
    let width = image.columns.length();
    section.paint(&mut raster, |row, column| scale.level(image.values[row * width + column]));
    let palette = scale.palette();
    let (mut x, mut y, mut w, mut h, mut fills) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    // a little over the neighbours, so that no gaps show
    let stretch = |pixels: [usize; 2], side: usize| {
        let [from, to] = pixels.map(|pixel| pixel as f64 * whole[side] / size[side] as f64);
        (from, (to + 0.5).min(whole[side]) - from)
    };
    let rows: Vec<&[u8]> = raster.pixels.chunks_exact(raster.width).collect();
    let mut row = 0;
    for equal in rows.chunk_by(|a, b| a == b) {
        let (top, height) = stretch([row, row + equal.len()], 1);
        let mut column = 0;
        for run in equal[0].chunk_by(|a, b| a == b) {
            let (left, width) = stretch([column, column + run.len()], 0);
            let [r, g, b] = palette[usize::from(run[0])];
            x.push(place.left + left);
            y.push(place.top + top);
            w.push(width);
            h.push(height);
            fills.push(Color::Rgb(r, g, b));
            column += run.len();
        }
        row += equal.len();
    }
    [Primitive::RectBatch { x, y, w, h, fills }]
}

/// Values and their colours.
pub(crate) struct Scale {
    pub low: f64,
    pub high: f64,
    pub colours: Colours,
}

impl Scale {
    /// Level of a value; that of no value if it is no number.
    pub(crate) fn level(&self, value: f64) -> u8 {
        let value = value.clamp(self.low, self.high);
        let share = match self.colours {
            Colours::Sequential => 2.0 * (value - self.low) / self.span() - 1.0,
            Colours::Diverging => match self.low.abs().max(self.high.abs()) {
                0.0 => 0.0 * value,
                largest => value / largest,
            },
        };
        level((share * SIDE) as f32)
    }

    pub(crate) fn palette(&self) -> [[u8; 3]; 256] {
        palette(|share| match self.colours {
            Colours::Sequential => {
                ColorMap::Viridis.map_rgb(0.5 * (share + 1.0)).map_or([255; 3], |(r, g, b)| [r, g, b])
            }
            Colours::Diverging => diverging(share),
        })
    }

    /// Distance of the ends; 1 if there is none.
    fn span(&self) -> f64 {
        if self.high > self.low { self.high - self.low } else { 1.0 }
    }

    /// Ticks at round numbers within the ends; the ends themselves where there are not two of these.
    fn ticks(&self, count: usize) -> Vec<f64> {
        let (low, high) = (self.low, self.high);
        if high <= low {
            return vec![low];
        }
        let rounding = 1e-9 * (high - low);
        let is_inside = |tick: &f64| (low - rounding..=high + rounding).contains(tick);
        let round: Vec<f64> = generate_ticks(low, high, count).into_iter().filter(is_inside).collect();
        if round.len() > 1 { round } else { vec![low, high] }
    }
}

/// A number of four digits.
fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// The colour bar at the right of a matrix, from the lower end of the scale to the upper.
pub(crate) fn bar(scale: &Scale, place: &Place, label: &str) -> Vec<Primitive> {
    /// Steps of the bar, its distance and width.
    const STEPS: usize = 64;
    const GAP: f64 = 18.0;
    const WIDTH: f64 = 18.0;
    let (x, step) = (place.left + place.width + GAP, place.height / STEPS as f64);
    let rect = |y: f64, height: f64, fill: Color, stroke: Option<Color>| Primitive::Rect {
        x,
        y,
        width: WIDTH,
        height,
        fill,
        stroke_width: stroke.as_ref().map(|_| 1.0),
        stroke,
        opacity: None,
    };
    let (mut elements, palette) = (Vec::new(), scale.palette());
    for i in 0..STEPS {
        let share = 1.0 - (i as f64 + 0.5) / STEPS as f64;
        let level = scale.level(scale.low + share * (scale.high - scale.low));
        let [r, g, b] = palette[usize::from(colour(level))];
        elements.push(rect(
            place.top + i as f64 * step,
            (step + 0.5).min(place.height - i as f64 * step),
            Color::Rgb(r, g, b),
            None,
        ));
    }
    elements.push(rect(place.top, place.height, Color::None, Some(Color::Rgb(0, 0, 0))));
    let count = ((place.height / 40.0) as usize).clamp(1, 6);
    for tick in scale.ticks(count) {
        let y = place.top + place.height * (1.0 - (tick - scale.low) / scale.span());
        let (x1, x2) = (x + WIDTH, x + WIDTH + 4.0);
        let (y1, y2, stroke, stroke_width) = (y, y, Color::Rgb(0, 0, 0), 1.0);
        elements.push(Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray: None });
        elements.push(text((x2 + 4.0, y + 4.0), TickFormat::Auto.format(tick), 11, TextAnchor::Start, None));
    }
    if !label.is_empty() {
        let middle = place.top + 0.5 * place.height;
        elements.push(text((x + WIDTH + 72.0, middle), label.into(), 14, TextAnchor::Middle, Some(-90.0)));
    }
    elements
}

/// A matrix as text in shades, for terminals without colours: from blank at the lower end to full at the upper.
fn shades(image: &Image, low: f64, high: f64, columns: usize, rows: usize) -> String {
    const SHADES: [char; 5] = [' ', '░', '▒', '▓', '█'];
    /// Width of the positions at the left.
    const MARGIN: usize = 12;
    let (nz, nr) = (image.rows.length(), image.columns.length());
    let (mut lines, mut width) =
        (rows.saturating_sub(5).clamp(1, nz), columns.saturating_sub(MARGIN + 2).clamp(1, nr));
    if let Some(ratio) = ratio(image) {
        // a character is twice as high as wide
        width = width.min((2.0 * lines as f64 / ratio).ceil() as usize).max(1);
        lines = lines.min((0.5 * width as f64 * ratio).ceil() as usize).max(1);
    }
    let span = if high > low { high - low } else { 1.0 };
    let mut text = format!("{}\n", shown(&image.title));
    let ends = (TickFormat::Auto.format(rounded(low)), TickFormat::Auto.format(rounded(high)));
    let label = shown(&image.value_label);
    text.push_str(&format!("{label}: `{}` {} to `{}` {}\n", SHADES[0], ends.0, SHADES[4], ends.1));
    text.push_str(&format!("{:>MARGIN$}\n", shown(&image.row_label)));
    let (bottom, top) = image.rows.ends();
    for line in 0..lines {
        let line = if image.upward { lines - 1 - line } else { line };
        let j = match &image.rows {
            Side::Even { .. } => line * nz / lines,
            side => side.cell(bottom + (line as f64 + 0.5) / lines as f64 * (top - bottom)).unwrap_or(nz - 1),
        };
        let cell = |i: usize| {
            let share = (image.values[j * nr + i * nr / width] - low) / span;
            SHADES[((share.clamp(0.0, 1.0) * 4.0).round() as usize).min(4)]
        };
        let position = format!("{:.4}", image.rows.at(j));
        text.push_str(&format!("{position:>MARGIN$} │{}│\n", (0..width).map(cell).collect::<String>()));
    }
    let (first, last) = (image.columns.at(0), image.columns.at((width - 1) * nr / width));
    let ends = format!("{} {first:.4} to {last:.4}", shown(&image.column_label));
    text.push_str(&format!("{:>MARGIN$}  {ends}\n", ""));
    text
}

#[cfg(test)]
mod tests;
