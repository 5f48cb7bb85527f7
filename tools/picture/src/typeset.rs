//! Texts of a scene: set with subscripts and superscripts, as outlines, or as plain Unicode.

use kuva::render::{
    color::Color,
    render::{PathData, Primitive, Scene, TextAnchor},
};
use percuss_canvas::{Pen, Placed, plain, set};
use ttf_parser::OutlineBuilder;

/// Units of an outline in the size of its text: a few thousandths are too small to see.
const UNITS: f64 = 500.0;

/// A black text.
///
/// * `rotate`: its angle \[degrees, clockwise\]
pub fn text(
    (x, y): (f64, f64),
    content: String,
    size: u32,
    anchor: TextAnchor,
    rotate: Option<f64>,
) -> Primitive {
    Primitive::Text { x, y, content, size, anchor, rotate, bold: false, color: None }
}

/// Distance from the anchor of a text to its start \[widths\].
fn start(anchor: TextAnchor) -> f64 {
    match anchor {
        TextAnchor::Start => 0.0,
        TextAnchor::Middle => -0.5,
        TextAnchor::End => -1.0,
    }
}

/// Applies a change to every element of a scene.
fn map(scene: &mut Scene, change: impl FnMut(Primitive) -> Vec<Primitive>) {
    scene.elements = std::mem::take(&mut scene.elements).into_iter().flat_map(change).collect();
}

/// Turns texts into outlines, which look the same everywhere and need no font; the text stays as the title of its group.
pub fn outline(scene: &mut Scene) {
    map(scene, |element| {
        let Primitive::Text { x, y, ref content, size, anchor, rotate, ref color, .. } = element else {
            return vec![element];
        };
        let Some((placed, width)) = set(content) else { return vec![element] };
        let mut pen = Outline { d: String::new(), x: 0.0, y: 0.0, scale: 1.0, at: (0, 0), first: (0, 0) };
        placed.iter().for_each(|part| percuss_canvas::outline(part, start(anchor) * width, &mut pen));
        let turn = rotate.map_or(String::new(), |angle| format!(" rotate({})", short(angle)));
        let scale = format!(" scale({})", f64::from(size) / UNITS);
        let fill = color.clone().unwrap_or(Color::Rgb(0, 0, 0));
        vec![
            Primitive::GroupStart {
                transform: Some(format!("translate({},{}){turn}{scale}", short(x), short(y))),
                title: Some(content.clone()),
                extra_attrs: Some("class=\"text\"".into()),
            },
            Primitive::Path(Box::new(PathData {
                d: pen.d,
                fill: Some(fill),
                stroke: Color::None,
                stroke_width: 0.0,
                opacity: None,
                stroke_dasharray: None,
            })),
            Primitive::GroupEnd,
        ]
    });
}

/// A number to two digits.
fn short(value: f64) -> f64 {
    (value * 100.0).round() / 100.0 + 0.0
}

/// Sets subscripts and superscripts as texts of their own.
pub fn split(scene: &mut Scene) {
    map(scene, |element| {
        let Primitive::Text { x, y, ref content, size, anchor, rotate, ref color, .. } = element else {
            return vec![element];
        };
        let text = |x: f64, y: f64, content: String, size: f64, anchor: TextAnchor| Primitive::Text {
            x,
            y,
            content,
            size: size.round() as u32,
            anchor,
            rotate,
            bold: false,
            color: color.clone(),
        };
        let size = f64::from(size);
        match set(content).filter(|(placed, _)| placed.len() > 1) {
            None => vec![text(x, y, content.clone(), size, anchor)],
            Some((placed, width)) => {
                let (sin, cos) = rotate.unwrap_or(0.0).to_radians().sin_cos();
                let part = |part: Placed| {
                    let (along, down) = ((part.x + start(anchor) * width) * size, part.y * size);
                    let (x, y) = (x + along * cos - down * sin, y + along * sin + down * cos);
                    text(x, y, part.text, part.scale * size, TextAnchor::Start)
                };
                placed.into_iter().map(part).collect()
            }
        }
    });
}

pub fn unicode(scene: &mut Scene) {
    for element in &mut scene.elements {
        if let Primitive::Text { content, .. } = element {
            *content = plain(content);
        }
    }
}

/// Writes outlines as a path in whole units, every point relative to the one before.
struct Outline {
    d: String,
    /// Origin of the glyph, to the right and down, and its scale \[units\].
    x: f64,
    y: f64,
    scale: f64,
    /// The last point, and the first of its contour.
    at: (i32, i32),
    first: (i32, i32),
}

impl Outline {
    fn command(&mut self, letter: char, points: &[(f32, f32)]) {
        self.d.push(letter);
        let from = self.at;
        for (i, (x, y)) in points.iter().enumerate() {
            let x = (self.x + self.scale * f64::from(*x)).round() as i32;
            let y = (self.y - self.scale * f64::from(*y)).round() as i32;
            let space = if i == 0 || x < from.0 { "" } else { " " };
            let comma = if y < from.1 { "" } else { " " };
            self.d.push_str(&format!("{space}{}{comma}{}", x - from.0, y - from.1));
            self.at = (x, y);
        }
    }
}

impl Pen for Outline {
    fn place(&mut self, (x, y): (f64, f64), scale: f64) {
        (self.x, self.y, self.scale) = (UNITS * x, UNITS * y, UNITS * scale);
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('m', &[(x, y)]);
        self.first = self.at;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('l', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('c', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.d.push('z');
        self.at = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscripts_are_smaller_and_lower() {
        let (placed, width) = set("c_p²").expect("letters");
        let [c, p, square] = placed.as_slice() else { panic!("three parts") };
        assert!(p.scale < c.scale && p.y > 0.0 && p.x > c.x && square.x > p.x && width > square.x);
        let mut scene = Scene::new(100.0, 50.0);
        let text = |x: f64, rotate: Option<f64>| Primitive::Text {
            x,
            y: 20.0,
            content: "c_p".into(),
            size: 10,
            anchor: TextAnchor::End,
            rotate,
            bold: true,
            color: None,
        };
        scene.elements = vec![text(50.0, None), text(50.0, Some(-90.0))];
        split(&mut scene);
        let place = |element: &Primitive| match element {
            Primitive::Text { x, y, size, bold: false, .. } => (*x, *y, *size),
            other => panic!("{other:?}"),
        };
        let [c, p, turned_c, turned_p] = [0, 1, 2, 3].map(|i| place(&scene.elements[i]));
        assert!(c.0 < p.0 && p.0 < 50.0 && c.1 < p.1 && p.2 == 7, "{c:?} {p:?}");
        // turned to the left: along is up, down is to the right
        assert!(turned_p.1 < turned_c.1 && turned_p.0 > turned_c.0, "{turned_c:?} {turned_p:?}");
    }
}
