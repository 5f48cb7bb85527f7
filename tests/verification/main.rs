//! Computed cases against published numbers and closed forms: one file per figure or closed form.
//!
//! \[KA\] is the paper the scheme and the figures come from, see the crate documentation. Every tolerance says why it
//! is what it is; measured errors are given beside it.

use percuss::{
    case::{Case, builtin},
    simulation::Simulation,
    view::View,
};

mod admissible_velocity;
mod energy_and_momentum;
mod fig2_paraboloid;
mod fig4_half_space;
mod fig5_layer;
mod fig6_cones;
mod fig8_finite_mass;
mod one_dimensional;
mod plane_flat_punch;
mod separation;

/// A built-in case with overrides.
fn case(name: &str, overrides: &[&str]) -> Case {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let text = builtin::find(name).expect("a built-in case");
    Case::parse(name, text, &overrides, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

/// What `look` sees of every step of a case.
fn run<T>(case: &Case, mut look: impl FnMut(&View<'_>) -> T) -> Vec<T> {
    let mut simulation = Simulation::new(case).expect("a solver");
    let mut seen = Vec::new();
    while let Some(view) = simulation.step().expect("finite numbers") {
        seen.push(look(&view));
    }
    seen
}

/// Value at `t` of a series of `(t, value)`, linear between its points.
fn at(series: &[(f64, f64)], t: f64) -> f64 {
    let i = series.partition_point(|point| point.0 < t);
    let ((t0, v0), (t1, v1)) = (series[i - 1], series[i]);
    v0 + (v1 - v0) * (t - t0) / (t1 - t0)
}

/// Observed order of convergence of errors on meshes refined by two.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}
