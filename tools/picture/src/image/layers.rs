//! Layers across an image: their names.

use kuva::render::{
    color::Color,
    render::{Primitive, TextAnchor},
};

use super::{Image, Place};
use crate::typeset::text;

/// A part of the rows of an image with a name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// Name.
    pub name: String,
    /// Where it begins.
    pub top: f64,
    /// Where it ends.
    pub bottom: f64,
}

impl Layer {
    /// The same with its depths times a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self { top: self.top * factor, bottom: self.bottom * factor, ..self }
    }
}

/// Names of the layers that an image shows, if it has more than one: at the right end, none over another where layers are thin.
pub(crate) fn names(image: &Image, place: &Place) -> Vec<Primitive> {
    /// Size of names, width of a letter and height of a line.
    const SIZE: u32 = 11;
    const LETTER: f64 = 6.4;
    const LINE: f64 = 15.0;
    let (low, high) = image.rows.ends();
    let height = |position: f64| {
        let share = (position - low) / (high - low);
        place.top + place.height * if image.upward { 1.0 - share } else { share }
    };
    let right = place.left + place.width;
    let (mut names, mut last) = (Vec::new(), place.top - LINE);
    for layer in image.layers.iter().filter(|_| image.layers.len() > 1) {
        let (top, bottom) = (layer.top.max(low), layer.bottom.min(high));
        if top >= bottom {
            continue;
        }
        let middle = (0.5 * (height(top) + height(bottom))).max(last + LINE);
        let width = layer.name.chars().count() as f64 * LETTER + 6.0;
        if layer.name.is_empty() || middle + 0.5 * LINE > place.top + place.height || width > place.width {
            continue;
        }
        last = middle;
        names.push(Primitive::Rect {
            x: right - width - 3.0,
            y: middle - 0.5 * LINE,
            width,
            height: LINE,
            fill: Color::Rgb(255, 255, 255),
            stroke: None,
            stroke_width: None,
            opacity: Some(0.7),
        });
        names.push(text((right - 6.0, middle + 4.0), layer.name.clone(), SIZE, TextAnchor::End, None));
    }
    names
}
