//! Diagrams with curves.

use kuva::{
    Palette,
    plot::{LegendPosition, LinePlot, LineStyle},
    render::{figure::Figure, layout::Layout, plots::Plot, render::Scene},
};

use crate::{
    Curve, LARGEST, Medium, Panel, SIZE,
    output::render,
    terminal::{self, Frame},
};

/// Points of a curve beyond which it is downsampled to the extremes of short stretches.
const MAX_POINTS: usize = 4000;

/// Colours of the palette of Okabe and Ito in the order of their use: blue, vermilion, green, orange, purple, sky blue,
/// black. Yellow is not used, it is hard to see on white.
const COLOURS: [usize; 7] = [4, 5, 2, 0, 6, 1, 7];

const GREY: &str = "#8c8c8c";

/// Largest number of curves that a legend names.
const MAX_NAMED: usize = 24;

/// Draws diagrams one below the other.
///
/// # Errors
///
/// The reason why the picture cannot be drawn.
pub fn draw(panels: &[Panel], medium: Medium) -> Result<Vec<u8>, String> {
    let drawings = panels.iter().map(|panel| Drawing::of(panel, medium)).collect::<Result<Vec<_>, _>>()?;
    if let Medium::Terminal { columns, rows, colour } = medium {
        let mut text = Vec::new();
        for (panel, drawing) in panels.iter().zip(drawings) {
            let frame = Frame {
                title: &panel.title,
                left: &panel.y_label,
                right: &panel.right_label,
                legend: legend(panel),
                columns,
                rows: rows / panels.len(),
                colour,
            };
            text.extend(terminal::draw(frame, |rows| drawing.scene(rows))?);
        }
        return Ok(text);
    }
    match <[_; 1]>::try_from(drawings) {
        Ok([drawing]) => render(drawing.scene(0), medium),
        Err(drawings) => render(stacked(drawings), medium),
    }
}

/// What the library draws of a diagram.
struct Drawing {
    left: Vec<Plot>,
    right: Vec<Plot>,
    layout: Layout,
}

/// Diagrams one below the other.
fn stacked(drawings: Vec<Drawing>) -> Scene {
    let mut figure = Figure::new(drawings.len(), 1);
    let (mut plots, mut layouts) = (Vec::new(), Vec::new());
    for (i, Drawing { left, right, layout }) in drawings.into_iter().enumerate() {
        layouts.push(layout);
        if right.is_empty() {
            plots.push(left);
        } else {
            plots.push(Vec::new());
            figure = figure.with_twin_y_plots(i, left, right);
        }
    }
    figure.with_plots(plots).with_layouts(layouts).with_cell_size(SIZE.0 + 150.0, SIZE.1 * 0.8).render()
}

/// A diagram of the usual size, for a terminal with some rows.
pub fn base(layout: Layout) -> Layout {
    layout.with_width(SIZE.0).with_height(SIZE.1).with_title_size(15).with_label_size(14)
}

impl Drawing {
    fn of(panel: &Panel, medium: Medium) -> Result<Self, String> {
        let is_text = matches!(medium, Medium::Terminal { .. });
        let lines = |curves: &[Curve], first: usize, log_y: bool| -> Vec<Plot> {
            let numbered = curves.iter().enumerate().map(|(i, curve)| (first + i, curve));
            numbered.flat_map(|(i, curve)| lines(panel, i, curve, log_y, is_text)).collect()
        };
        let left = lines(&panel.curves, 0, panel.log_y);
        let right = lines(&panel.right, panel.curves.len(), false);
        if left.is_empty() || (right.is_empty() && !panel.right.is_empty()) {
            let kind = if panel.log_x || panel.log_y { "positive numbers" } else { "finite numbers" };
            let label = if left.is_empty() { &panel.y_label } else { &panel.right_label };
            return Err(format!("there are no {kind} in `{label}`"));
        }
        let mut layout = base(Layout::auto_from_plots(&left))
            .with_x_label(panel.x_label.as_str())
            .with_legend_position(LegendPosition::OutsideRightTop);
        if !is_text {
            layout = layout.with_y_label(panel.y_label.as_str());
            if !panel.title.is_empty() {
                layout = layout.with_title(panel.title.as_str()).with_title_wrap(90);
            }
        }
        if !right.is_empty() {
            layout = layout.with_y2_auto(&right);
            if !is_text {
                layout = layout.with_y2_label(panel.right_label.as_str());
            }
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
        Ok(Self { left, right, layout })
    }

    /// * `rows`: of a terminal; 0 for other media
    fn scene(self, rows: usize) -> Scene {
        let Self { left, right, mut layout } = self;
        if rows > 0 {
            layout = layout.with_term_rows(u32::try_from(rows).unwrap_or(u32::MAX));
        }
        match right.is_empty() {
            true => kuva::render::render::render_multiple(left, layout),
            false => kuva::render::render::render_twin_y(left, right, layout),
        }
    }
}

/// The colours in the order of their use.
fn colours() -> Vec<String> {
    let palette = Palette::okabe_ito();
    let chosen = COLOURS.iter().filter_map(|&i| palette.colors().get(i));
    chosen.cloned().chain([GREY.to_owned()]).collect()
}

/// Names and colours of the curves that a legend lists.
fn legend(panel: &Panel) -> Vec<(String, String)> {
    if !has_legend(panel) {
        return Vec::new();
    }
    let colours = colours();
    let curves =
        panel.curves.iter().chain(&panel.right).enumerate().filter(|(_, curve)| !curve.name.is_empty());
    curves
        .map(|(i, curve)| (name(panel, i, curve), colours[curve.colour.unwrap_or(i) % colours.len()].clone()))
        .collect()
}

/// True if there are several curves, and not too many names.
fn has_legend(panel: &Panel) -> bool {
    let curves = || panel.curves.iter().chain(&panel.right);
    curves().count() > 1 && curves().filter(|curve| !curve.name.is_empty()).count() <= MAX_NAMED
}

/// Name of curve `i` in the legend.
fn name(panel: &Panel, i: usize, curve: &Curve) -> String {
    if i < panel.curves.len() { curve.name.clone() } else { format!("{} (right)", curve.name) }
}

/// The visible stretches of curve `i` of a panel, on an axis that is logarithmic or not.
fn lines(panel: &Panel, i: usize, curve: &Curve, log_y: bool, is_text: bool) -> Vec<Plot> {
    let colours = colours();
    let colour = curve.colour.unwrap_or(i);
    let style = match (colour / colours.len()) % 3 {
        _ if curve.dashed => LineStyle::Dashed,
        0 => LineStyle::Solid,
        1 => LineStyle::Dashed,
        _ => LineStyle::Dotted,
    };
    let is_visible = |point: &(f64, f64)| {
        // false for NaN
        let is_drawable = point.0.abs() < LARGEST && point.1.abs() < LARGEST;
        is_drawable && (!panel.log_x || point.0 > 0.0) && (!log_y || point.1 > 0.0)
    };
    let has_legend = !is_text && has_legend(panel) && !curve.name.is_empty();
    let stretches = curve.points.split(|point| !is_visible(point)).filter(|stretch| !stretch.is_empty());
    let line = |(number, stretch)| {
        let line = LinePlot::new()
            .with_data(downsampled(stretch))
            .with_color(colours[colour % colours.len()].as_str())
            .with_stroke_width(if curve.dashed { 1.0 } else { 1.8 })
            .with_line_style(style.clone());
        if number == 0 && has_legend { line.with_legend(name(panel, i, curve)) } else { line }
    };
    stretches.enumerate().map(|stretch| line(stretch).into()).collect()
}

/// About [`MAX_POINTS`] points at most: the first, the extremes and the last of short stretches.
fn downsampled(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn downsampling_keeps_ends_and_extremes() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[54_321].1 = 7.0;
        points[12_345].1 = -3.0;
        let kept = downsampled(&points);
        assert!(kept.len() <= MAX_POINTS + 4);
        assert!(kept.contains(&points[54_321]) && kept.contains(&points[12_345]));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
