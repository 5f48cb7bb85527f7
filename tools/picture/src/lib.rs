//! Pictures: curves and images as SVG, PNG, or text for a terminal. The same input gives the same bytes.
//!
//! Knows numbers, labels and colours, nothing of recordings or physics. The reader, the convergence studies and the figures
//! use it.

use kuva::{
    Palette,
    plot::{LegendPosition, LinePlot, LineStyle},
    render::{figure::Figure, layout::Layout, plots::Plot},
};

mod image;
mod output;

pub use image::{Image, Side, draw_image};

use output::render;

/// Format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// SVG with its font embedded.
    Svg,
    /// PNG, two pixels per unit of the SVG.
    Png,
    /// Text for a terminal.
    Terminal {
        /// Columns.
        columns: usize,
        /// Rows.
        rows: usize,
        /// With terminal colours.
        colour: bool,
    },
}

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// Name in the legend; not in it if empty.
    pub name: String,
    /// Points in the order in which they are joined; non-finite ones leave a gap.
    pub points: Vec<(f64, f64)>,
    /// Drawn with thin dashes, so that a curve below it stays visible.
    pub dashed: bool,
    /// Number of its colour; by default its index among the curves.
    pub colour: Option<usize>,
}

/// A diagram with curves.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Title; none if empty.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
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

/// Points of a curve beyond which it is downsampled to the extremes of short stretches.
const MAX_POINTS: usize = 4000;

/// Magnitude beyond which numbers are skipped like infinities: the library's ranges would overflow.
const LARGEST: f64 = 1e150;

/// Colours of the palette of Okabe and Ito in the order of their use: blue, vermilion, green, orange, purple, sky blue,
/// black. Yellow is not used, it is hard to see on white.
const COLOURS: [usize; 7] = [4, 5, 2, 0, 6, 1, 7];

/// An eighth colour.
const GREY: &str = "#8c8c8c";

/// Largest number of curves with a legend.
const MAX_NAMED: usize = 24;

/// Draws diagrams one below the other.
///
/// # Errors
///
/// The reason why the picture cannot be drawn.
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
    render(&scene, medium)
}

fn base(layout: Layout, medium: Medium) -> Layout {
    let layout = layout.with_width(SIZE.0).with_height(SIZE.1).with_title_size(15).with_label_size(14);
    match medium {
        Medium::Terminal { rows, .. } => layout.with_term_rows(u32::try_from(rows).unwrap_or(u32::MAX)),
        Medium::Svg | Medium::Png => layout,
    }
}

fn scene(panel: &Panel, medium: Medium) -> Result<(Vec<Plot>, Layout), String> {
    let plots: Vec<Plot> =
        panel.curves.iter().enumerate().flat_map(|(i, curve)| lines(panel, i, curve)).collect();
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

/// The visible stretches of curve `i` of a panel.
fn lines(panel: &Panel, i: usize, curve: &Curve) -> Vec<Plot> {
    let palette = Palette::okabe_ito();
    let colours = COLOURS.iter().filter_map(|&i| palette.colors().get(i)).map(String::as_str);
    let colours: Vec<&str> = colours.chain([GREY]).collect();
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
        is_drawable && (!panel.log_x || point.0 > 0.0) && (!panel.log_y || point.1 > 0.0)
    };
    let has_legend = panel.curves.len() > 1 && panel.curves.len() <= MAX_NAMED && !curve.name.is_empty();
    let stretches = curve.points.split(|point| !is_visible(point)).filter(|stretch| !stretch.is_empty());
    let line = |(number, stretch)| {
        let line = LinePlot::new()
            .with_data(downsampled(stretch))
            .with_color(colours[colour % colours.len()])
            .with_stroke_width(if curve.dashed { 1.0 } else { 1.8 })
            .with_line_style(style.clone());
        if number == 0 && has_legend { line.with_legend(curve.name.as_str()) } else { line }
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

    #[test]
    fn extreme_numbers_are_skipped() {
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
}
