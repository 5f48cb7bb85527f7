//! Closed forms that only tests and figures use: one file each, beside those of [`percuss::exact`] and like them independent of the solver.
//! Parameters are taken as they are.
//!
//! | Closed form | Result |
//! |---|---|
//! | [`collision`] | plane waves in two stacks of layers that collide, and part |
//! | [`mod@column`] | a layer without shear waves under a body of finite mass |
//! | [`disc_stiffness`], [`strip_stiffness`], [`elastic_strip_stiffness`] | slopes of drag and pressure of a flat punch on a layer at long times |
//! | [`lamb`] | displacement of the surface under a pulse on a line, full theory |
//! | [`pekeris`] | displacement of the surface under a force on a point, full theory, ν = 1/4 |
//! | [`surface_wave`] | speed of waves along coated surfaces, full theory: for `src/exact/tests` |

pub mod collision;
pub mod column;
mod complex;
pub mod disc_stiffness;
pub mod elastic_strip_stiffness;
pub mod lamb;
mod layer_kernel;
mod linear;
pub mod pekeris;
pub mod strip_stiffness;
pub mod surface_wave;
mod transfer;
