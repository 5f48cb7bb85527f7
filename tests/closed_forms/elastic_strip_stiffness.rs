//! Slopes of drag and pressure of a plane flat punch on a layer at long times, in the full theory of elasticity.
//!
//! The plane counterpart of `disc_stiffness`: a rigid strip `|x| < 1` pressed by `V0·t` into a layer on a smooth rigid
//! backing. With κ and T of `layer_kernel` the displacement under the strip is
//!
//! ```text
//! w(x) = (1/πκ)·∫_{−1}^1 p(y)·[S(x − y) − ln |x − y|] dy = V0·t      S(y) = ∫_0^∞ T(ξh) cos ξy dξ/ξ + ln |y|
//! ```
//!
//! With `x = cos θ`, `p = q(θ)/sin θ`, and `−ln |cos θ − cos φ| = ln 2 + Σ_{m≥1} (2/m) cos mθ cos mφ` this is an equation for the
//! smooth, even and periodic q, which collocation at `θ_j = (j − ½)π/n` solves with exponential convergence. There is no
//! closed form by conformal mapping, as in the simplified theory (`strip_stiffness`), which the tests solve in this
//! way, too.
//!
//! ```text
//! A_d = (h/2)·∫_0^π q dθ      A(x) = h·q/√(1 − x²)          at w = 1
//! ```
//!
//! Under a thin layer `A_d → 2κ = E/(1 − ν²)`, not λ + 2µ: at long times the layer has slid out sideways on its smooth
//! faces.

use std::f64::consts::{LN_2, PI};

use percuss::{exact::stack::Stack, model::ModelKind};

use super::{disc_stiffness::kappa, layer_kernel::LayerKernel, linear::solve};

/// Nodes of the collocation: so many, and so many per 1/h.
const NODES: f64 = 40.0;
const NODES_PER_THICKNESS: f64 = 8.0;

/// A strip on an elastic layer.
#[derive(Clone, Debug)]
pub struct ElasticStripStiffness {
    thickness: f64,
    /// Coefficients of `q = Σ q_m cos mθ`.
    series: Vec<f64>,
}

impl ElasticStripStiffness {
    /// * `thickness`: h of the layer \[R\]
    /// * `beta`: c_s/c_p
    pub fn new(thickness: f64, beta: f64) -> Self {
        let nodes = (NODES + NODES_PER_THICKNESS / thickness).ceil() as usize;
        Self::with_nodes(thickness, kappa(beta), &LayerKernel::elastic(thickness, 2.0), nodes)
    }

    /// The strip on layers on a smooth rigid back, in either theory: h is the thickness of all.
    pub fn on_stack(stack: &Stack, theory: ModelKind) -> Self {
        let (kernel, stiffness) = LayerKernel::of_stack(stack, theory, 2.0);
        let nodes = (NODES + NODES_PER_THICKNESS / kernel.thickness()).ceil() as usize;
        Self::with_nodes(stack.thickness(), stiffness, &kernel, nodes)
    }

    fn with_nodes(thickness: f64, stiffness: f64, kernel: &LayerKernel, n: usize) -> Self {
        let step = PI / n as f64;
        let theta: Vec<f64> = (0..n).map(|j| (j as f64 + 0.5) * step).collect();
        let entry = |a: f64, b: f64| {
            let modes: f64 = (1..n).map(|m| m as f64).map(|m| 2.0 / m * (m * a).cos() * (m * b).cos()).sum();
            (LN_2 + modes + kernel.logarithmic_rest(a.cos() - b.cos())) / n as f64
        };
        let matrix = theta.iter().map(|&a| theta.iter().map(|&b| entry(a, b)).collect()).collect();
        // (1/πκ)·(π/n) Σ … q = 1
        let q = solve(matrix, vec![stiffness; n]);
        let mode = |m: usize| {
            let sum: f64 = theta.iter().zip(&q).map(|(theta, q)| q * (m as f64 * theta).cos()).sum();
            sum / n as f64 * if m == 0 { 1.0 } else { 2.0 }
        };
        Self { thickness, series: (0..n).map(mode).collect() }
    }

    /// `A_d` of the drag `F → A_d·V0·t/h`, of half the strip.
    pub fn drag_slope(&self) -> f64 {
        0.5 * PI * self.thickness * self.series[0]
    }

    /// `A(x)` of the pressure `p → A(x)·V0·t/h` under the punch, `|x| < 1`.
    pub fn pressure_slope(&self, x: f64) -> f64 {
        let theta = x.acos();
        let q: f64 = self.series.iter().enumerate().map(|(m, q)| q * (m as f64 * theta).cos()).sum();
        self.thickness * q / ((1.0 - x) * (1.0 + x)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_forms::strip_stiffness::StripStiffness;
    use percuss::{exact::stack::StackLayer, grid::Back};

    #[test]
    fn the_simplified_theory_has_its_closed_form() {
        // κ = 1 and tanh for T: isotropic, so only h·c_s of the closed form matters
        for (h, nodes) in [(0.12, 120), (0.5, 60), (3.0, 40)] {
            let kernel = LayerKernel::simplified(h, 2.0);
            let strip = ElasticStripStiffness::with_nodes(h, 1.0, &kernel, nodes);
            let closed = StripStiffness::new(h / 0.5, 0.5);
            let slopes = [strip.drag_slope(), closed.drag_slope()];
            assert!((slopes[0] / slopes[1] - 1.0).abs() < 1e-11, "h = {h}: {slopes:?}");
            for x in [0.0, 0.6, -0.97] {
                let slopes = [strip.pressure_slope(x), closed.pressure_slope(x)];
                assert!((slopes[0] / slopes[1] - 1.0).abs() < 1e-10, "h = {h}, x = {x}: {slopes:?}");
            }
        }
    }

    #[test]
    fn thin_layers_are_plates_that_slide() {
        for beta in [0.2, 0.5, 0.8] {
            // A_d → 4β²(1 − β²), the rest from the edges and in proportion to h; far from them p is uniform
            let plate = 4.0 * beta * beta * (1.0 - beta * beta);
            let strip = |h| ElasticStripStiffness::new(h, beta);
            let [thin, thinner] = [0.1, 0.05].map(|h| strip(h).drag_slope() / plate - 1.0);
            assert!((thin / thinner - 2.0).abs() < 1e-6 && thinner > 0.0, "{thin} {thinner}");
            let middle = strip(0.05).pressure_slope(0.0);
            assert!((middle / plate - 1.0).abs() < 1e-9, "{middle} {plate}");
        }
        // without Poisson's effect, ν = 0, nothing slides: (λ + 2µ)/h = 1/h, the column
        let column = ElasticStripStiffness::new(0.05, 0.5_f64.sqrt());
        assert!((column.pressure_slope(0.3) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn thick_layers_are_half_spaces() {
        // p = P/(π√(1 − x²)), and −ln |x − y| has the mean ln 2: 1 = (P/πκ)·(ln 2 + S(0)), P = 2F
        let (h, beta) = (500.0, 0.4);
        let strip = ElasticStripStiffness::new(h, beta);
        let stiffness = 2.0 * beta * beta * (1.0 - beta * beta);
        let rest = LayerKernel::elastic(h, 2.0).logarithmic_rest(0.0);
        let force = 0.5 * PI * stiffness / (LN_2 + rest);
        assert!((strip.drag_slope() / (h * force) - 1.0).abs() < 1e-5, "{}", strip.drag_slope());
        for x in [0.0_f64, 0.7, 0.99] {
            let p = strip.pressure_slope(x) / h;
            assert!((p * 0.5 * PI * (1.0 - x * x).sqrt() / force - 1.0).abs() < 1e-4, "{x}: {p}");
        }
    }

    #[test]
    fn layers_of_one_material_are_one_layer() {
        let layers = |c_s: f64| {
            [0.2, 0.5, 0.3].map(|thickness| StackLayer {
                impedance: 1.0,
                wave_speed: 1.0,
                shear_wave_speed: c_s,
                thickness,
            })
        };
        let stack = Stack::new(&layers(0.4), Back::Rigid).expect("a stack");
        let full = ElasticStripStiffness::on_stack(&stack, ModelKind::Elastic).drag_slope();
        let one = ElasticStripStiffness::new(1.0, 0.4).drag_slope();
        assert!((full / one - 1.0).abs() < 1e-12, "{full} {one}");
        let simplified = ElasticStripStiffness::on_stack(&stack, ModelKind::Rakhmatulin).drag_slope();
        let one = StripStiffness::new(1.0, 0.4).drag_slope();
        assert!((simplified / one - 1.0).abs() < 1e-12, "{simplified} {one}");
    }

    #[test]
    fn more_nodes_change_nothing() {
        for h in [0.05, 0.3, 1.0, 20.0] {
            let strip = ElasticStripStiffness::new(h, 0.5);
            let kernel = LayerKernel::elastic(h, 2.0);
            let n = strip.series.len() * 3 / 2;
            let finer = ElasticStripStiffness::with_nodes(h, 0.375, &kernel, n);
            let change = strip.drag_slope() / finer.drag_slope() - 1.0;
            assert!(change.abs() < 1e-11, "h = {h}: {change:e}");
        }
    }
}
