//! What the pictures of all programs share: labels with subscripts and superscripts, the outlines of their letters, the colours of
//! values, and a raster to draw them on.
//!
//! Small, as the solver draws with it while it runs: no scene, no file formats. The same input gives the same pixels.

mod label;
mod letters;
mod palette;
mod raster;

pub use label::plain;
pub use letters::{Pen, Placed, outline, set};
pub use palette::{DIVERGING, diverging};
pub use raster::{Align, BLACK, Raster, Text, WHITE, greys};
