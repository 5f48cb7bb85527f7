//! Images of matrices.

use std::sync::Arc;

use kuva::{
    TickFormat,
    plot::{ColorMap, Heatmap},
    render::{layout::Layout, plots::Plot},
};

use crate::{LARGEST, Medium, base, output::render};

/// A matrix, drawn as an image.
#[derive(Clone, Debug)]
pub struct Image {
    /// Title.
    pub title: String,
    /// Label of the vertical axis.
    pub row_label: String,
    /// Label of the horizontal axis.
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

    /// True if the positions are finite and increase.
    fn increases(&self) -> bool {
        // false for NaN
        let far = self.at(self.length).abs();
        self.start.abs() < LARGEST && far < LARGEST && self.step > 0.0 && far - self.start > 0.0
    }

    /// Ends of the cells in blocks of `per_block`.
    fn ends(&self, per_block: usize) -> (f64, f64) {
        let cells = self.length.div_ceil(per_block) * per_block;
        (self.start - 0.5 * self.step, self.start + (cells as f64 - 0.5) * self.step)
    }
}

/// Cells of an image along each side beyond which blocks of cells are averaged.
const MAX_CELLS: (usize, usize) = (220, 320);

/// Draws a matrix as an image with a colour bar, the first row at the top.
///
/// * `range`: values of the ends of the colour scale, by default those of the matrix
///
/// # Errors
///
/// The reason why the picture cannot be drawn.
pub fn draw_image(image: &Image, range: Option<(f64, f64)>, medium: Medium) -> Result<Vec<u8>, String> {
    if image.rows.length == 0 || image.columns.length == 0 {
        return Err(format!("`{}` has no values to draw", image.title));
    }
    let (low, high) = range.unwrap_or_else(|| image.range());
    if !(low.abs() < LARGEST && high.abs() < LARGEST) {
        return Err(format!("`{}` holds no numbers that can be drawn", image.title));
    }
    if !image.rows.increases() || !image.columns.increases() {
        return Err(format!("the axes of `{}` do not increase", image.title));
    }
    if let Medium::Terminal { columns, rows, colour: false } = medium {
        return Ok(shades(image, low, high, columns, rows).into_bytes());
    }
    let per_block = (image.rows.length.div_ceil(MAX_CELLS.0), image.columns.length.div_ceil(MAX_CELLS.1));
    // the library draws the first row at the bottom: the rows are reversed and their positions negative
    let (x, y) = (image.columns.ends(per_block.1), image.rows.ends(per_block.0));
    let (bottom, top) = (-y.1, -y.0);
    let mut data = block_means(image, per_block, low, high);
    data.reverse();
    let heatmap = Heatmap::new()
        .with_color_map(colour_map(&data, low, high))
        .with_data(data)
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
        // 0 − v, not −v, which can be a negative zero
        .with_y_tick_format(TickFormat::Custom(Arc::new(|v| TickFormat::Auto.format(0.0 - v))));
    render(&kuva::render::render::render_multiple(plots, layout), medium)
}

/// Means over blocks of cells, clamped to the range; NaN as the lowest value.
fn block_means(image: &Image, (down, along): (usize, usize), low: f64, high: f64) -> Vec<Vec<f64>> {
    let (rows, columns) = (image.rows.length, image.columns.length);
    let block = |j: usize, i: usize| {
        let cells = (j * down..((j + 1) * down).min(rows))
            .flat_map(|row| (i * along..((i + 1) * along).min(columns)).map(move |column| (row, column)));
        let values: Vec<f64> = cells.map(|(row, column)| image.values[row * columns + column]).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        if mean.is_nan() { low } else { mean.clamp(low, high) }
    };
    let row = |j: usize| (0..columns.div_ceil(along)).map(|i| block(j, i)).collect();
    (0..rows.div_ceil(down)).map(row).collect()
}

/// Colours over the range: the library passes shares of the range of the data.
fn colour_map(data: &[Vec<f64>], low: f64, high: f64) -> ColorMap {
    let all = || data.iter().flatten().copied();
    let (least, most) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let span = if high > low { high - low } else { 1.0 };
    ColorMap::Custom(Arc::new(move |share: f64| {
        ColorMap::Viridis.map(((least + share * (most - least) - low) / span).clamp(0.0, 1.0))
    }))
}

/// A matrix as text in shades, for terminals without colours: from blank at the lower end to full at the upper.
fn shades(image: &Image, low: f64, high: f64, columns: usize, rows: usize) -> String {
    const SHADES: [char; 5] = [' ', '░', '▒', '▓', '█'];
    /// Width of the positions at the left.
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
