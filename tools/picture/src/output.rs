//! Rendering of a scene to the bytes of its format.

use kuva::{
    TerminalBackend,
    backend::{pdf::PdfBackend, svg::SvgBackend},
    render::render::{Primitive, Scene},
};

use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree},
};

use crate::{Medium, typeset};

pub fn render(mut scene: Scene, medium: Medium) -> Result<Vec<u8>, String> {
    if !matches!(medium, Medium::Terminal { .. }) {
        // a terminal joins near points only
        scene.elements.iter_mut().for_each(simplify);
    }
    match medium {
        Medium::Svg => Ok(svg(scene).into_bytes()),
        Medium::Png => png(&svg(scene)),
        Medium::Pdf => {
            typeset::split(&mut scene);
            PdfBackend::new().render_scene(&scene)
        }
        Medium::Terminal { columns, rows, colour } => {
            typeset::unicode(&mut scene);
            let text = TerminalBackend::new(columns, rows).render_scene(&scene);
            Ok(if colour { text } else { without_colour(&text) }.into_bytes())
        }
    }
}

/// A scene as SVG with its texts as outlines.
fn svg(mut scene: Scene) -> String {
    typeset::outline(&mut scene);
    with_own_numbers(&SvgBackend::new().render_scene(&scene))
}

/// An SVG without texts as PNG, two pixels per unit.
fn png(svg: &str) -> Result<Vec<u8>, String> {
    const SCALE: f32 = 2.0;
    let tree = tree(svg)?;
    let size = tree.size().to_int_size().scale_by(SCALE).ok_or("the picture has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("the picture is too large")?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| error.to_string())
}

fn tree(svg: &str) -> Result<Tree, String> {
    Tree::from_str(svg, &Options::default()).map_err(|error| error.to_string())
}

/// Draws a scene over what pixels show already.
///
/// * `transform`: from units of the scene to pixels
pub fn paint(scene: Scene, transform: Transform, pixels: &mut Pixmap) -> Result<(), String> {
    resvg::render(&tree(&svg(scene))?, transform, &mut pixels.as_mut());
    Ok(())
}

/// Largest distance from a curve of the points that are left out of it \[units of the SVG\].
const VISIBLE: f64 = 0.04;

/// Leaves out points of a curve that lie on the line between their neighbours.
fn simplify(element: &mut Primitive) {
    let Primitive::PolyLine { points, .. } = element else { return };
    let Some(last) = points.len().checked_sub(1).filter(|last| *last > 1) else { return };
    let mut is_kept = vec![false; points.len()];
    (is_kept[0], is_kept[last]) = (true, true);
    let mut stretches = vec![(0, last)];
    while let Some((start, end)) = stretches.pop() {
        let off = |i: &usize| distance(points[*i], points[start], points[end]);
        let farthest = (start + 1..end).max_by(|i, j| off(i).total_cmp(&off(j)));
        if let Some(i) = farthest.filter(|i| off(i) > VISIBLE) {
            is_kept[i] = true;
            stretches.extend([(start, i), (i, end)]);
        }
    }
    let mut is_kept = is_kept.into_iter();
    points.retain(|_| is_kept.next().unwrap_or(true));
}

/// Distance of a point from the stretch between two others.
fn distance(point: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (along, across) = ((b.0 - a.0, b.1 - a.1), (point.0 - a.0, point.1 - a.1));
    let length = along.0 * along.0 + along.1 * along.1;
    let share =
        if length > 0.0 { ((along.0 * across.0 + along.1 * across.1) / length).clamp(0.0, 1.0) } else { 0.0 };
    (across.0 - share * along.0).hypot(across.1 - share * along.1)
}

/// Numbers the clip paths of an SVG from 0: the library numbers them through all pictures of a process.
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

/// Removes the escape sequences of a terminal.
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

    #[test]
    fn text_without_colours() {
        assert_eq!(without_colour("\u{1b}[38;2;1;2;3ma\u{1b}[0mb  \nc"), "ab\nc\n");
    }

    #[test]
    fn points_on_a_line_are_left_out() {
        let line = |points: Vec<(f64, f64)>| Primitive::PolyLine {
            points,
            stroke: "black".into(),
            stroke_width: 1.0,
            stroke_dasharray: None,
        };
        let kept = |points: Vec<(f64, f64)>| {
            let mut element = line(points);
            simplify(&mut element);
            let Primitive::PolyLine { points, .. } = element else { panic!("a curve") };
            points
        };
        let mut straight: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i), 0.5 * f64::from(i))).collect();
        assert_eq!(kept(straight.clone()), [straight[0], straight[999]]);
        straight[400].1 += 1.0;
        assert_eq!(kept(straight.clone()).len(), 5);
        // there and back is no single stretch
        assert_eq!(kept(vec![(0.0, 0.0), (5.0, 0.0), (1.0, 0.0)]).len(), 3);
        for points in [vec![], vec![(1.0, 1.0)], vec![(1.0, 1.0), (1.0, 1.0)]] {
            assert_eq!(kept(points.clone()), points);
        }
    }
}
