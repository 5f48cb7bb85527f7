//! Colours of pictures.

use crate::message::foxglove::Color;

/// A colour of a scene.
pub const fn opaque(r: f64, g: f64, b: f64) -> Color {
    Color { r, g, b, a: 1.0 }
}

/// Deformed surface and backing.
pub const SURFACE: Color = opaque(0.0, 0.45, 0.70);
/// Outline of the indenter.
pub const OUTLINE: Color = opaque(0.35, 0.35, 0.35);
/// Body of the indenter.
pub const BODY: Color = opaque(0.62, 0.62, 0.62);
/// Drag.
pub const DRAG: Color = opaque(0.84, 0.37, 0.0);
/// Contact radius.
pub const CONTACT: Color = opaque(0.0, 0.62, 0.45);
/// Wave fronts.
pub const FRONT: Color = opaque(0.90, 0.62, 0.0);
