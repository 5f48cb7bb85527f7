//! Pictures: curves and images as SVG, PDF, PNG, or text for a terminal, and moving ones as GIF. The same input gives the same bytes.
//!
//! Knows numbers, labels and colours, nothing of recordings or physics. The reader and the figures use it. Labels, letters, colours and the
//! pixels of sections are those of `percuss_canvas`. Labels carry subscripts as `γc_p²` and `sigma_zz` have them. An SVG needs no font: its texts are outlines, and
//! what they say are their titles. A PDF has the letters it uses embedded.

mod curves;
mod film;
mod image;
mod moving;
mod output;
mod terminal;
mod typeset;

pub use curves::draw;
pub use film::{Diagram, Film, Moment, Raster, Section, Stage};
pub use image::{Colours, Image, Layer, Side, draw_image};
pub use moving::Moving;

/// Format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// SVG, its texts as outlines.
    Svg,
    /// PDF with one page, its font embedded.
    Pdf,
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

impl Medium {
    /// The formats that are files, by the extensions of their names.
    pub const FILES: [(&str, Self); 3] = [("svg", Self::Svg), ("png", Self::Png), ("pdf", Self::Pdf)];
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
    /// Label of the vertical axis at the right.
    pub right_label: String,
    /// Curves on the axis at the right; without any there is none.
    pub right: Vec<Curve>,
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

/// Magnitude beyond which numbers are skipped like infinities: the library's ranges would overflow.
const LARGEST: f64 = 1e150;

#[cfg(test)]
mod tests {
    use super::*;

    const TERMINAL: Medium = Medium::Terminal { columns: 60, rows: 20, colour: true };

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
        let terminal = Medium::Terminal { columns: 80, rows: 24, colour: false };
        for medium in [Medium::Svg, Medium::Pdf, Medium::Png, terminal] {
            let picture = draw(&[panel()], medium).expect("a picture");
            assert!(picture == draw(&[panel()], medium).expect("a picture"), "{medium:?}");
        }
        let svg =
            String::from_utf8(draw(&[panel(), panel()], Medium::Svg).expect("a picture")).expect("text");
        for text in ["y [N]", "sine", "gap"] {
            assert_eq!(svg.matches(&format!("<title>{text}</title>")).count(), 2, "{text}");
        }
        assert!(!svg.contains("<text") && svg.len() < 100_000, "{}", svg.len());
    }

    #[test]
    fn extreme_numbers_are_skipped() {
        let media = [Medium::Svg, Medium::Pdf, Medium::Png, TERMINAL];
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
        let side = |step, length| Side::Even { start: 0.0, step, length };
        let image = |step, columns, values: &[f64]| Image {
            title: "a".into(),
            row_label: "z".into(),
            column_label: "r".into(),
            rows: side(step, 2),
            columns: side(0.1, columns),
            values: values.to_vec(),
            ..Image::default()
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
