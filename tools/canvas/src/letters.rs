//! Labels set in letters of the font, with subscripts and superscripts.

use std::sync::OnceLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use crate::label::{Level, parts};

/// Size of subscripts and superscripts, and how far they are below and above the line \[sizes of the text\].
const SMALL: f64 = 0.72;
const DOWN: f64 = 0.18;
const UP: f64 = 0.38;

/// The font of pictures, the one that the library measures and draws with.
fn font() -> Option<&'static Face<'static>> {
    static FONT: OnceLock<Option<Face<'static>>> = OnceLock::new();
    FONT.get_or_init(|| Face::parse(dejavu::sans::regular(), 0).ok()).as_ref()
}

/// A part of a label in its place.
pub struct Placed {
    /// Its letters.
    pub text: String,
    /// Distance from the start of the label, to the right \[sizes of the text\].
    pub x: f64,
    /// Distance below the line \[sizes of the text\].
    pub y: f64,
    /// Size \[sizes of the text\].
    pub scale: f64,
}

/// The parts of a label one behind the other, and their width; `None` if the font has not all of its letters.
pub fn set(label: &str) -> Option<(Vec<Placed>, f64)> {
    let font = font()?;
    let em = f64::from(font.units_per_em());
    let mut x = 0.0;
    let mut placed = Vec::new();
    for (level, text) in parts(label) {
        let (scale, y) = match level {
            Level::Base => (1.0, 0.0),
            Level::Sub => (SMALL, DOWN),
            Level::Super => (SMALL, -UP),
        };
        let mut width = 0.0;
        for letter in text.chars() {
            width += f64::from(font.glyph_hor_advance(font.glyph_index(letter)?)?) / em * scale;
        }
        placed.push(Placed { text, x, y, scale });
        x += width;
    }
    Some((placed, x))
}

/// Draws outlines of glyphs, each from its place.
pub trait Pen: OutlineBuilder {
    /// The place of the next glyph.
    ///
    /// * `origin`: of the glyph, to the right and down \[sizes of the text\]
    /// * `scale`: size of a unit of the font \[sizes of the text\]
    fn place(&mut self, origin: (f64, f64), scale: f64);
}

/// Draws the outlines of a part of a label.
///
/// * `origin`: start of the label \[sizes of the text\]
pub fn outline(part: &Placed, origin: f64, pen: &mut impl Pen) {
    let Some(font) = font() else { return };
    let scale = part.scale / f64::from(font.units_per_em());
    let mut x = origin + part.x;
    for letter in part.text.chars() {
        let glyph = font.glyph_index(letter).unwrap_or(GlyphId(0));
        pen.place((x, part.y), scale);
        font.outline_glyph(glyph, pen);
        x += scale * f64::from(font.glyph_hor_advance(glyph).unwrap_or(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_what_labels_need() {
        for label in ["γc_p² πR³ µs σ_zz − Δr β kN/m (right)", "₀₁ₚ⁻³"] {
            assert!(set(label).is_some(), "{label}");
        }
        assert!(set("漢").is_none());
    }
}
