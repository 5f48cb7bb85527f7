//! Computed cases against published numbers and closed forms: one file per figure or closed form.
//!
//! \[KA\] is the paper the scheme and the figures come from, see the crate documentation. Errors that the documentation states are
//! asserted as it states them, see [`accuracy`]. Every other tolerance says why it is what it is; measured errors are
//! given beside it. Where there is no closed form, the reference is the scheme itself on finer meshes, extrapolated.
//!
//! All errors are asserted by `cargo test`. With `PERCUSS_FULL=1` references are computed by the plain stepper, and random fields run for a
//! hundred thousand steps on all meshes.

use percuss::{case::Case, session, simulation::Simulation, view::View};

use crate::{case, is_full};

mod accuracy;
mod admissible_velocity;
mod bodies;
mod elastic_energy;
mod elastic_lamb;
mod elastic_paraboloid;
mod elastic_plane_punch;
mod elastic_static;
mod elastic_wedge;
mod energy_and_momentum;
mod engines;
mod fig2_paraboloid;
mod fig4_half_space;
mod fig5_layer;
mod fig6_cones;
mod fig8_finite_mass;
mod free_back;
mod graded;
mod hertz;
mod layered_contact;
mod layered_statics;
mod layers;
mod load;
mod observer;
mod one_dimensional;
mod plane_flat_punch;
mod points;
mod separation;
mod stability;

/// A built-in case without frames, on a mesh of `cells`.
fn on_mesh(name: &str, cells: usize, overrides: &[impl AsRef<str>]) -> Case {
    let mesh = ["record.frames=0".to_owned(), format!("mesh.cells={cells}")];
    let overrides = overrides.iter().map(|text| text.as_ref().to_owned());
    case(name, &mesh.into_iter().chain(overrides).collect::<Vec<_>>())
}

/// A run on a finer mesh, as a reference: with `PERCUSS_FULL=1` by the plain stepper, else by the fast engine, which is the same but
/// for rounding (see [`engines`]).
fn reference(case: &Case) -> Simulation {
    if is_full() { Simulation::reference(case) } else { Simulation::new(case) }
}

/// Results of `look` at every step of a case.
fn run<T>(case: &Case, look: impl FnMut(&View<'_>) -> T) -> Vec<T> {
    observe(Simulation::new(case), look)
}

/// Results of `look` at every step of a simulation.
fn observe<T>(mut simulation: Simulation, mut look: impl FnMut(&View<'_>) -> T) -> Vec<T> {
    let mut seen = Vec::new();
    session::run(&mut simulation, &mut [&mut |view: &View<'_>| seen.push(look(view))])
        .expect("finite numbers");
    seen
}

/// Value at `t` of a series of `(t, value)`, linear between its points.
fn at(series: &[(f64, f64)], t: f64) -> f64 {
    let i = series.partition_point(|point| point.0 < t);
    let ((t0, v0), (t1, v1)) = (series[i - 1], series[i]);
    v0 + (v1 - v0) * (t - t0) / (t1 - t0)
}

/// Time at which a series of `(t, value)`, linear between its points, first falls to zero.
fn first_zero(series: &[(f64, f64)]) -> f64 {
    let i = series.iter().position(|point| point.1 <= 0.0).expect("it falls to zero");
    let ((t0, v0), (t1, v1)) = (series[i - 1], series[i]);
    t0 + (t1 - t0) * v0 / (v0 - v1)
}

/// Slope of the straight line nearest to a series of `(t, value)`.
fn slope(series: &[(f64, f64)]) -> f64 {
    let n = series.len() as f64;
    let t_mean = series.iter().map(|point| point.0).sum::<f64>() / n;
    let mean = series.iter().map(|point| point.1).sum::<f64>() / n;
    let above: f64 = series.iter().map(|(t, value)| (t - t_mean) * (value - mean)).sum();
    let below: f64 = series.iter().map(|(t, _)| (t - t_mean) * (t - t_mean)).sum();
    above / below
}

/// Root of the mean square of errors, relative to that of the expected values.
///
/// * `pairs`: value and expected value
fn relative_rms(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (mut error, mut norm) = (0.0, 0.0);
    for (value, expected) in pairs {
        error += (value - expected) * (value - expected);
        norm += expected * expected;
    }
    assert!(norm > 0.0, "there is something to compare");
    f64::sqrt(error / norm)
}

/// Observed order of convergence of errors on meshes refined by two.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Limit of values on two meshes, the second refined by two, with a known order (Richardson).
fn extrapolate(coarse: f64, fine: f64, order: i32) -> f64 {
    fine + (fine - coarse) / (2f64.powi(order) - 1.0)
}
