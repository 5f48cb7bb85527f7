//! Pictures: curves and images as SVG, PNG, or text for a terminal. The same input gives the same bytes.
//!
//! Knows numbers, labels and colours, nothing of recordings or physics: the reader, the solver's convergence studies and
//! the figures draw with it.

use std::sync::Arc;

use kuva::{
    Palette, TerminalBackend, TickFormat,
    backend::{png::PngBackend, svg::SvgBackend},
    plot::{ColorMap, Heatmap, LegendPosition, LinePlot, LineStyle},
    render::{figure::Figure, layout::Layout, plots::Plot, render::Scene},
};

/// What a picture is drawn as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// SVG with its font embedded.
    Svg,
    /// PNG, two pixels per unit of the SVG.
    Png,
    /// Text of so many columns and rows, coloured or not.
    Terminal {
        /// Columns.
        columns: usize,
        /// Rows.
        rows: usize,
        /// With the colours of a terminal.
        colour: bool,
    },
}

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// Name in the legend; it is not there if empty.
    pub name: String,
    /// Points in the order they are joined; those that are not finite leave a gap.
    pub points: Vec<(f64, f64)>,
    /// Drawn with thin dashes, so that a curve below it is seen.
    pub dashed: bool,
    /// Number of its colour; its own number among the curves if none.
    pub colour: Option<usize>,
}

/// A matrix to be drawn as an image.
#[derive(Clone, Debug)]
pub struct Image {
    /// Title.
    pub title: String,
    /// What stands along the vertical axis.
    pub row_label: String,
    /// What stands along the horizontal axis.
    pub column_label: String,
    /// Positions of rows, the first at the top.
    pub rows: Side,
    /// Positions of columns.
    pub columns: Side,
    /// Row-major.
    pub values: Vec<f64>,
}

impl Image {
    /// Smallest and largest value.
    pub fn range(&self) -> (f64, f64) {
        let finite = self.values.iter().copied().filter(|value| value.is_finite());
        finite
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }
}

/// One side of a matrix: positions `start + i·step`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// First position.
    pub start: f64,
    /// Distance of positions.
    pub step: f64,
    /// Number of positions.
    pub length: usize,
}

impl Side {
    /// Position of an element.
    pub fn at(&self, index: usize) -> f64 {
        self.start + index as f64 * self.step
    }
}

/// A diagram with curves.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Title; none if empty.
    pub title: String,
    /// What stands along the horizontal axis.
    pub x_label: String,
    /// What stands along the vertical axis.
    pub y_label: String,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Logarithmic horizontal axis.
    pub log_x: bool,
    /// Logarithmic vertical axis.
    pub log_y: bool,
    /// Ends of the horizontal axis.
    pub x_range: Option<(f64, f64)>,
    /// Ends of the vertical axis.
    pub y_range: Option<(f64, f64)>,
}

/// Width and height of a diagram [units of the SVG].
const SIZE: (f64, f64) = (760.0, 470.0);

/// Points of a curve beyond which only the extremes of short stretches are drawn.
const MAX_POINTS: usize = 4000;

/// Magnitude beyond which numbers are left out like infinities: the library's ranges would overflow.
const LARGEST: f64 = 1e150;

/// Cells of an image along each side beyond which cells are drawn together.
const MAX_CELLS: (usize, usize) = (220, 320);

/// Colours of the palette of Okabe and Ito in the order of their use: blue, vermilion, green, orange, purple, sky blue,
/// black. Yellow is left out, it is hard to see on white.
const COLOURS: [usize; 7] = [4, 5, 2, 0, 6, 1, 7];

/// An eighth colour.
const GREY: &str = "#8c8c8c";

/// Curves beyond which a legend does not help.
const MAX_NAMED: usize = 24;

/// Draws diagrams one below the other.
///
/// # Errors
///
/// The picture cannot be drawn; the answer says why.
pub fn draw(panels: &[Panel], medium: Medium) -> Result<Vec<u8>, String> {
    let drawn = panels.iter().map(|panel| scene(panel, medium)).collect::<Result<Vec<_>, _>>()?;
    let scene = match <[_; 1]>::try_from(drawn) {
        Ok([(plots, layout)]) => kuva::render::render::render_multiple(plots, layout),
        Err(drawn) => {
            let (plots, layouts): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
            Figure::new(plots.len(), 1)
                .with_plots(plots)
                .with_layouts(layouts)
                .with_cell_size(SIZE.0 + 150.0, SIZE.1 * 0.8)
                .render()
        }
    };
    finish(&scene, medium)
}

/// Draws a matrix as an image with a colour bar, the first row at the top.
///
/// * `range`: values of the ends of the colour scale; those of the matrix if none
///
/// # Errors
///
/// The picture cannot be drawn; the answer says why.
pub fn draw_image(image: &Image, range: Option<(f64, f64)>, medium: Medium) -> Result<Vec<u8>, String> {
    let (rows, columns) = (image.rows.length, image.columns.length);
    if rows == 0 || columns == 0 {
        return Err(format!("`{}` has no values to draw", image.title));
    }
    let (low, high) = range.unwrap_or_else(|| image.range());
    if !(low.abs() < LARGEST && high.abs() < LARGEST) {
        return Err(format!("`{}` holds no numbers that can be drawn", image.title));
    }
    let is_odd = |side: &Side| {
        // not-a-number compares false
        let far = side.at(side.length).abs();
        !(side.start.abs() < LARGEST && far < LARGEST && side.step > 0.0 && far - side.start > 0.0)
    };
    if is_odd(&image.rows) || is_odd(&image.columns) {
        return Err(format!("the axes of `{}` do not increase", image.title));
    }
    if let Medium::Terminal { columns, rows, colour: false } = medium {
        return Ok(shades(image, low, high, columns, rows).into_bytes());
    }
    // means of blocks of cells
    let (down, along) = (rows.div_ceil(MAX_CELLS.0), columns.div_ceil(MAX_CELLS.1));
    let block = |j: usize, i: usize| {
        let cells = (j * down..((j + 1) * down).min(rows))
            .flat_map(|row| (i * along..((i + 1) * along).min(columns)).map(move |column| (row, column)));
        let values: Vec<f64> = cells.map(|(row, column)| image.values[row * columns + column]).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        // what is no number is drawn like the lowest
        if mean.is_nan() { low } else { mean.clamp(low, high) }
    };
    let (blocks_down, blocks_along) = (rows.div_ceil(down), columns.div_ceil(along));
    // the library draws the first row at the bottom; depth is drawn downwards, the first row at the top
    let data: Vec<Vec<f64>> =
        (0..blocks_down).rev().map(|j| (0..blocks_along).map(|i| block(j, i)).collect()).collect();
    let all = || data.iter().flatten().copied();
    let (least, most) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    // the library scales colours over the values there are; they are to be scaled over the range
    let span = if high > low { high - low } else { 1.0 };
    let colours = ColorMap::Custom(Arc::new(move |share: f64| {
        ColorMap::Viridis.map(((least + share * (most - least) - low) / span).clamp(0.0, 1.0))
    }));
    let end = |side: &Side, blocks: usize, per: usize| {
        (side.start - 0.5 * side.step, side.start + ((blocks * per) as f64 - 0.5) * side.step)
    };
    let (x, y) = (end(&image.columns, blocks_along, along), end(&image.rows, blocks_down, down));
    let (bottom, top) = (-y.1, -y.0);
    let heatmap = Heatmap::new()
        .with_data(data)
        .with_color_map(colours)
        .with_cell_size(1.0)
        .with_x_range(x.0, x.1)
        .with_y_range(bottom, top);
    let plots: Vec<Plot> = vec![heatmap.into()];
    let layout = base(Layout::auto_from_plots(&plots), medium)
        .with_title(image.title.as_str())
        .with_title_wrap(90)
        .with_x_label(image.column_label.as_str())
        .with_y_label(image.row_label.as_str())
        .with_x_axis_min(x.0)
        .with_x_axis_max(x.1)
        .with_y_axis_min(bottom)
        .with_y_axis_max(top)
        // 0 − v, not −v: that would be a negative zero
        .with_y_tick_format(TickFormat::Custom(Arc::new(|v| TickFormat::Auto.format(0.0 - v))));
    finish(&kuva::render::render::render_multiple(plots, layout), medium)
}

/// A matrix in shades of text, where there are no colours: from blank at the lower end to full at the upper.
fn shades(image: &Image, low: f64, high: f64, columns: usize, rows: usize) -> String {
    const SHADES: [char; 5] = [' ', '░', '▒', '▓', '█'];
    /// Room for the positions at the left.
    const MARGIN: usize = 12;
    let (nz, nr) = (image.rows.length, image.columns.length);
    let lines = rows.saturating_sub(4).clamp(1, nz);
    let width = columns.saturating_sub(MARGIN + 2).clamp(1, nr);
    let span = if high > low { high - low } else { 1.0 };
    let mut text = format!("{}, {} {low} to {} {high}\n", image.title, SHADES[0], SHADES[4]);
    for line in 0..lines {
        let j = line * nz / lines;
        let cell = |i: usize| {
            let share = (image.values[j * nr + i * nr / width] - low) / span;
            SHADES[((share.clamp(0.0, 1.0) * 4.0).round() as usize).min(4)]
        };
        let position = format!("{:.4}", image.rows.at(j));
        text.push_str(&format!("{position:>MARGIN$} │{}│\n", (0..width).map(cell).collect::<String>()));
    }
    let (first, last) = (image.columns.at(0), image.columns.at((width - 1) * nr / width));
    let ends = format!("{} {first:.4} to {last:.4}", image.column_label);
    text.push_str(&format!("{:>MARGIN$}  {ends}\n", ""));
    text
}

fn base(layout: Layout, medium: Medium) -> Layout {
    let layout = layout.with_width(SIZE.0).with_height(SIZE.1).with_title_size(15).with_label_size(14);
    match medium {
        Medium::Terminal { rows, .. } => layout.with_term_rows(u32::try_from(rows).unwrap_or(u32::MAX)),
        Medium::Svg | Medium::Png => layout,
    }
}

fn scene(panel: &Panel, medium: Medium) -> Result<(Vec<Plot>, Layout), String> {
    let palette = Palette::okabe_ito();
    let colours = COLOURS.iter().filter_map(|&i| palette.colors().get(i)).map(String::as_str);
    let colours: Vec<&str> = colours.chain([GREY]).collect();
    let named = panel.curves.len() > 1 && panel.curves.len() <= MAX_NAMED;
    let mut plots: Vec<Plot> = Vec::new();
    for (i, curve) in panel.curves.iter().enumerate() {
        let colour = curve.colour.unwrap_or(i);
        let style = match (colour / colours.len()) % 3 {
            _ if curve.dashed => LineStyle::Dashed,
            0 => LineStyle::Solid,
            1 => LineStyle::Dashed,
            _ => LineStyle::Dotted,
        };
        let visible = |point: &(f64, f64)| {
            // not-a-number compares false
            let drawable = point.0.abs() < LARGEST && point.1.abs() < LARGEST;
            drawable && (!panel.log_x || point.0 > 0.0) && (!panel.log_y || point.1 > 0.0)
        };
        let mut is_first = true;
        for stretch in curve.points.split(|point| !visible(point)).filter(|stretch| !stretch.is_empty()) {
            let mut line = LinePlot::new()
                .with_data(thin(stretch))
                .with_color(colours[colour % colours.len()])
                // thinner, so that a curve below it is seen
                .with_stroke_width(if curve.dashed { 1.0 } else { 1.8 })
                .with_line_style(style.clone());
            if named && !curve.name.is_empty() && std::mem::take(&mut is_first) {
                line = line.with_legend(curve.name.as_str());
            }
            plots.push(line.into());
        }
    }
    if plots.is_empty() {
        let kind = if panel.log_x || panel.log_y { "positive numbers" } else { "finite numbers" };
        return Err(format!("there are no {kind} in `{}`", panel.y_label));
    }
    let mut layout = base(Layout::auto_from_plots(&plots), medium)
        .with_x_label(panel.x_label.as_str())
        .with_y_label(panel.y_label.as_str())
        .with_legend_position(LegendPosition::OutsideRightTop)
        // a terminal would show the box as a block
        .with_legend_box(!matches!(medium, Medium::Terminal { .. }));
    if !panel.title.is_empty() {
        layout = layout.with_title(panel.title.as_str()).with_title_wrap(90);
    }
    if panel.log_x {
        layout = layout.with_log_x();
    }
    if panel.log_y {
        layout = layout.with_log_y();
    }
    if let Some((low, high)) = panel.x_range {
        layout = layout.with_x_axis_min(low).with_x_axis_max(high);
    }
    if let Some((low, high)) = panel.y_range {
        layout = layout.with_y_axis_min(low).with_y_axis_max(high);
    }
    Ok((plots, layout))
}

/// At most about [`MAX_POINTS`] points: the first, the extremes in between and the last of short stretches.
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MAX_POINTS {
        return points.to_vec();
    }
    let mut kept = Vec::new();
    for stretch in points.chunks(points.len().div_ceil(MAX_POINTS / 4)) {
        let by_value = |a: &usize, b: &usize| stretch[*a].1.total_cmp(&stretch[*b].1);
        let (low, high) = ((0..stretch.len()).min_by(by_value), (0..stretch.len()).max_by(by_value));
        let mut chosen = vec![0, low.unwrap_or(0), high.unwrap_or(0), stretch.len() - 1];
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|i| stretch[i]));
    }
    kept
}

fn finish(scene: &Scene, medium: Medium) -> Result<Vec<u8>, String> {
    match medium {
        Medium::Svg => {
            let svg = SvgBackend::new().with_embedded_font(true).render_scene(scene);
            Ok(with_own_numbers(&without_unused_fonts(&svg)).into_bytes())
        }
        Medium::Png => PngBackend::new().with_scale(2.0).render_scene(scene),
        Medium::Terminal { columns, rows, colour } => {
            let text = TerminalBackend::new(columns, rows).render_scene(scene);
            Ok(if colour { text } else { without_colour(&text) }.into_bytes())
        }
    }
}

/// An SVG with only those of its embedded fonts that it uses: each is half a megabyte and more.
fn without_unused_fonts(svg: &str) -> String {
    let Some((head, body)) = svg.split_once("</style>") else { return svg.to_owned() };
    let mut faces = head.split("@font-face");
    let mut kept = faces.next().unwrap_or_default().to_owned();
    for face in faces {
        let is_bold = face.contains("font-weight:bold");
        let is_italic = face.contains("font-style:italic");
        let is_mono = face.contains("Mono");
        let bold_used = body.contains("font-weight=\"bold\"");
        let italic_used = body.contains("font-style=\"italic\"");
        let mono_used = body.contains("Mono");
        if (!is_bold || bold_used) && (!is_italic || italic_used) && (!is_mono || mono_used) {
            kept.push_str("@font-face");
            kept.push_str(face);
        }
    }
    format!("{kept}</style>{body}")
}

/// An SVG whose clip paths are numbered from 0: the library numbers them through all pictures of a process.
fn with_own_numbers(svg: &str) -> String {
    const NAME: &str = "kuva-clip-";
    let mut parts = svg.split(NAME);
    let mut text = parts.next().unwrap_or_default().to_owned();
    let mut known: Vec<&str> = Vec::new();
    for part in parts {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = part.split_at(digits);
        let own = known.iter().position(|k| *k == number).unwrap_or_else(|| {
            known.push(number);
            known.len() - 1
        });
        text.push_str(&format!("{NAME}{own}{rest}"));
    }
    text
}

/// A text without the escape sequences of a terminal.
fn without_colour(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        if character == '\u{1b}' {
            // a sequence ends with a letter
            characters.by_ref().find(char::is_ascii_alphabetic);
        } else {
            plain.push(character);
        }
    }
    plain.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        let curve = |name: &str, f: fn(f64) -> f64| Curve {
            name: name.into(),
            points: (0..9000).map(|i| f64::from(i) * 1e-3).map(|x| (x, f(x))).collect(),
            dashed: false,
            colour: None,
        };
        let curves =
            vec![curve("sine", f64::sin), curve("gap", |x| if x < 4.0 { f64::NAN } else { x.cos() })];
        Panel { x_label: "t".into(), y_label: "y [N]".into(), curves, ..Panel::default() }
    }

    #[test]
    fn the_same_panels_are_the_same_bytes() {
        for medium in [Medium::Svg, Medium::Png, Medium::Terminal { columns: 80, rows: 24, colour: false }] {
            let picture = draw(&[panel()], medium).expect("a picture");
            assert!(picture == draw(&[panel()], medium).expect("a picture"), "{medium:?}");
        }
        let svg =
            String::from_utf8(draw(&[panel(), panel()], Medium::Svg).expect("a picture")).expect("text");
        assert_eq!(svg.matches("@font-face").count(), 1);
        assert!(svg.contains("y [N]") && svg.contains("sine") && svg.contains("font-face"));
    }

    #[test]
    fn thinning_keeps_ends_and_extremes() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[54_321].1 = 7.0;
        points[12_345].1 = -3.0;
        let kept = thin(&points);
        assert!(kept.len() <= MAX_POINTS + 4);
        assert!(kept.contains(&points[54_321]) && kept.contains(&points[12_345]));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn odd_numbers_are_drawn_around() {
        let media = [Medium::Svg, Medium::Png, Medium::Terminal { columns: 60, rows: 20, colour: true }];
        let curves: [&[(f64, f64)]; 6] = [
            &[],
            &[(1.0, 2.0)],
            &[(0.0, 3.0), (1.0, 3.0)],
            &[(0.0, f64::NAN), (1.0, f64::INFINITY)],
            &[(0.0, -1.0), (1.0, 0.0)],
            &[(0.0, 1e300), (1.0, -1e300), (2.0, 5e-324)],
        ];
        for (points, log_y) in curves.into_iter().flat_map(|points| [(points, false), (points, true)]) {
            let curves =
                vec![Curve { name: "a".into(), points: points.to_vec(), dashed: false, colour: None }];
            let panel = Panel { curves, log_y, ..Panel::default() };
            for medium in media {
                let drawn = draw(std::slice::from_ref(&panel), medium);
                let visible = |(_, y): &(f64, f64)| y.abs() < LARGEST && (!log_y || *y > 0.0);
                assert_eq!(drawn.is_ok(), points.iter().any(visible), "{points:?} {drawn:?}");
            }
        }
        let side = |step, length| Side { start: 0.0, step, length };
        let image = |step, columns, values: &[f64]| Image {
            title: "a".into(),
            row_label: "z".into(),
            column_label: "r".into(),
            rows: side(step, 2),
            columns: side(0.1, columns),
            values: values.to_vec(),
        };
        for step in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            assert!(draw_image(&image(step, 1, &[0.0, 1.0]), None, Medium::Svg).is_err(), "{step}");
        }
        for values in [[f64::NAN; 6], [1.0; 6], [0.0, 1.0, f64::NAN, f64::INFINITY, -1e300, 1e300]] {
            for medium in media {
                for range in [None, Some((0.0, 1.0))] {
                    let drawn = draw_image(&image(0.1, 3, &values), range, medium);
                    let wild = values.iter().all(|v| v.is_nan()) || values.contains(&1e300);
                    assert_eq!(drawn.is_ok(), !wild || range.is_some(), "{values:?}");
                }
            }
        }
    }

    #[test]
    fn text_without_colours() {
        assert_eq!(without_colour("\u{1b}[38;2;1;2;3ma\u{1b}[0mb  \nc"), "ab\nc\n");
    }
}
