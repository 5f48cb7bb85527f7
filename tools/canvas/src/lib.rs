//! What the pictures of all programs share: labels with subscripts and superscripts, the outlines of their letters, the colours of
//! values, a raster to draw them on, and the painter of sections.
//!
//! Small, as the solver draws with it while it runs: no scene, no file formats. The same input gives the same pixels.

mod label;
mod letters;
mod palette;
mod raster;
mod section;

pub use label::plain;
pub use letters::{Pen, Placed, outline, set};
pub use palette::{DIVERGING, diverging};
pub use raster::{Align, BLACK, Raster, Text, WHITE};
pub use section::{BODY, EMPTY, FREE, SIDE, Section, ZERO, colour, level, palette, share};
