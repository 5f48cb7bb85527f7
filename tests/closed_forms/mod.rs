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

/// Extremes of the displacement opposite a pulse on a plate, 50 mm beside its axis, by generalised rays: the case `experiment-gabbro-plate` \[µs, nm\].
///
/// K. Okubo, F. Yamashita, E. Fukuyama (2025), doi 10.5281/zenodo.15288446
pub const GABBRO_RAYS: [(f64, f64); 7] =
    [(20.7, 0.696), (23.1, 0.188), (33.5, 0.887), (49.1, 0.033), (51.8, 0.344), (54.0, 0.159), (62.9, 0.418)];

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
