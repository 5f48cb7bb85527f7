//! Slopes of drag and pressure of an axisymmetric flat punch on a layer at long times.
//!
//! When the waves have spread, the displacement under a punch moving with V0 is that of a static disc pressed in by
//! `V0·t`, and the drag grows as `F = A_d·V0·t/h`. `A_d` is the stiffness of a rigid disc on a layer free of stress
//! around it, relative to that of the column under it. With `a = R/c_s` (the layer becomes isotropic in r/c_s), the
//! dual integral equations lead to a Fredholm equation of the second kind on `0 ≤ t ≤ a`,
//!
//! ```text
//! f(t) − (1/π) ∫_0^a [g(t−s) + g(t+s)] f(s) ds = 2/π        g(y) = ∫_0^∞ (1 − tanh ξh) cos ξy dξ
//! A_d = (2h/a²) ∫_0^a f(t) dt
//! ```
//!
//! The kernel is smooth, so Gauss–Legendre quadrature (Nyström's method) converges exponentially, with a rate that the poles
//! of the kernel at `y = ±2ih` set: like `e^{−8nh/a}` with n nodes, hence a number of nodes in proportion to a/h. Slopes are good
//! to 1e-10, measured against twice as many nodes, down to `h·c_s = 0.02`. The kernel itself is taken by quadrature.
//!
//! The pressure follows from the same f, with `r' = r/c_s` and f' from the differentiated integral equation,
//!
//! ```text
//! p → A(r)·V0·t/h      A(r) = h·[ f(a)/√(a² − r'²) − ∫_{r'}^a f'(t)/√(t² − r'²) dt ]
//! ```
//!
//! In the full theory a layer is isotropic as it is, a = R, the factor of both results is `κ = 2β²(1 − β²)` instead of 1, and the
//! kernel has that of an elastic layer, `(cosh 2ξh − 1)/(sinh 2ξh + 2ξh)`, for tanh ξh (Lebedev and Ufliand 1958; the base
//! is smooth). On a half-space, `F = (4/π)κ·w` (Boussinesq). On several layers the kernel is that of `layer_kernel`, a = R and κ that
//! of the first layer, in the simplified theory `Z_1·c_s,1`.

use std::f64::consts::PI;

use percuss::{
    exact::{quadrature::gauss_legendre, stack::Stack, surface_impedance::SurfaceImpedance},
    model::ModelKind,
};

use super::{layer_kernel::LayerKernel, linear::solve};

/// Nodes of the quadrature: at least so many, and so many per a/h.
const NODES: usize = 80;
const NODES_PER_THICKNESS: f64 = 6.0;

/// Static stiffness `dF/dw = (8/π)·β²(1 − β²)` of a rigid smooth disc on an elastic half-space, full theory \[πR·γc_p²\]; the
/// simplified theory has `(4/π)·β`.
///
/// * `beta`: c_s/c_p
pub fn elastic_half_space(beta: f64) -> f64 {
    4.0 / PI * kappa(beta)
}

/// κ of a material.
///
/// * `beta`: c_s/c_p
pub fn kappa(beta: f64) -> f64 {
    SurfaceImpedance::new(beta).expect("a material").stiffness()
}

/// A disc on a layer.
#[derive(Clone, Debug)]
pub struct DiscStiffness {
    thickness: f64,
    /// a, the radius in coordinates in which the layer is isotropic.
    radius: f64,
    /// Pressure per wave number and displacement of a half-space in these coordinates: 1 or κ.
    stiffness: f64,
    /// Nodes, weights and f of the quadrature over `0..a`.
    nodes: Vec<(f64, f64, f64)>,
    /// Wave numbers and amplitudes of `∫_0^a [g(t−s) + g(t+s)] f(s) ds`, a sum of `cos ξt`.
    waves: Vec<(f64, f64)>,
}

impl DiscStiffness {
    /// * `thickness`: h of the layer \[R\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    pub fn new(thickness: f64, shear_wave_speed: f64) -> Self {
        let (h, a) = (thickness, 1.0 / shear_wave_speed);
        let nodes = NODES.max((NODES_PER_THICKNESS * a / h).ceil() as usize);
        Self::with_nodes(h, a, 1.0, &LayerKernel::simplified(h, 2.0 * a), nodes)
    }

    /// The same in the full theory.
    ///
    /// * `thickness`: h of the layer \[R\]
    /// * `beta`: c_s/c_p
    pub fn elastic(thickness: f64, beta: f64) -> Self {
        let nodes = NODES.max((NODES_PER_THICKNESS / thickness).ceil() as usize);
        Self::with_nodes(thickness, 1.0, kappa(beta), &LayerKernel::elastic(thickness, 2.0), nodes)
    }

    /// The disc on layers on a smooth rigid back: h is the thickness of all.
    pub fn on_stack(stack: &Stack, theory: ModelKind) -> Self {
        let (kernel, stiffness) = LayerKernel::of_stack(stack, theory, 2.0);
        let nodes = NODES.max((NODES_PER_THICKNESS / kernel.thickness()).ceil() as usize);
        Self::with_nodes(stack.thickness(), 1.0, stiffness, &kernel, nodes)
    }

    /// The disc of radius `a` by a quadrature with so many nodes.
    fn with_nodes(h: f64, a: f64, stiffness: f64, kernel: &LayerKernel, nodes: usize) -> Self {
        let rule = gauss_legendre(nodes, 0.0, a);
        let waves: Vec<(f64, f64)> = kernel.waves().collect();
        let cosines = |t: f64| waves.iter().map(|(xi, _)| (xi * t).cos()).collect::<Vec<_>>();
        let cosines: Vec<Vec<f64>> = rule.iter().map(|&(t, _)| cosines(t)).collect();
        let even = |i: usize, j: usize| {
            let both = cosines[i].iter().zip(&cosines[j]);
            waves.iter().zip(both).map(|((_, share), (t, s))| share * t * s).sum::<f64>()
        };
        let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) - rule[j].1 / PI * even(i, j);
        let matrix = (0..nodes).map(|i| (0..nodes).map(|j| entry(i, j)).collect()).collect();
        let f = solve(matrix, vec![2.0 / PI; nodes]);
        let nodes: Vec<_> = rule.into_iter().zip(f).map(|((t, w), f)| (t, w, f)).collect();
        let sum = |k: usize| nodes.iter().zip(&cosines).map(|((_, w, f), cos)| w * f * cos[k]).sum::<f64>();
        let waves = waves.iter().enumerate().map(|(k, (xi, share))| (*xi, share * sum(k))).collect();
        Self { thickness: h, radius: a, stiffness, nodes, waves }
    }

    /// `A_d` of the drag `F → A_d·V0·t/h`.
    pub fn drag_slope(&self) -> f64 {
        let integral: f64 = self.nodes.iter().map(|(_, w, f)| w * f).sum();
        2.0 * self.thickness * self.stiffness / (self.radius * self.radius) * integral
    }

    /// `A(r)` of the pressure `p → A(r)·V0·t/h` under the punch, `0 ≤ r < 1`.
    pub fn pressure_slope(&self, r: f64) -> f64 {
        let a = self.radius;
        let r = r * a;
        let reach = ((a - r) * (a + r)).sqrt();
        // t = √(r'² + v²) takes the singularity of the kernel away, dt/√(t² − r'²) = dv/t, and f' vanishes like t
        let integral: f64 = self
            .nodes
            .iter()
            .map(|(node, w, _)| {
                let v = reach * node / a;
                let t = (r * r + v * v).sqrt();
                reach / a * w * self.slope(t) / t
            })
            .sum();
        self.thickness * self.stiffness * (self.at(a) / reach - integral)
    }

    /// f(t), by the integral equation itself.
    fn at(&self, t: f64) -> f64 {
        (2.0 + self.waves.iter().map(|(xi, amplitude)| amplitude * (xi * t).cos()).sum::<f64>()) / PI
    }

    /// f'(t)
    fn slope(&self, t: f64) -> f64 {
        -self.waves.iter().map(|(xi, amplitude)| amplitude * xi * (xi * t).sin()).sum::<f64>() / PI
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use percuss::{exact::stack::StackLayer, grid::Back};

    fn layer(impedance: f64, wave_speed: f64, shear_wave_speed: f64, thickness: f64) -> StackLayer {
        StackLayer { impedance, wave_speed, shear_wave_speed, thickness }
    }

    #[test]
    fn known_value_and_limits() {
        // the paper reads about 1.5
        let slope = |h, c_s| DiscStiffness::new(h, c_s).drag_slope();
        let value = slope(1.0, 0.5);
        assert!((value - 1.483_765_2).abs() < 1e-7, "{value}");
        // thick layer: a disc on a half-space, F = (4/π)(h/a)·V0·t/h
        let (h, c_s) = (2000.0, 0.4);
        let thick = slope(h, c_s);
        assert!((thick / (4.0 / PI * h * c_s) - 1.0).abs() < 1e-3);
        // without shear stiffness only the column under the disc resists
        let column = slope(1.0, 0.021);
        assert!((column - 1.0).abs() < 0.03, "{column}");
        // only h·c_s matters
        let same = slope(0.5, 0.8) - slope(1.0, 0.4);
        assert!(same.abs() < 1e-12);
    }

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for (h, c_s) in [(1.0, 0.5), (0.4, 0.3), (3.0, 0.7)] {
            let disc = DiscStiffness::new(h, c_s);
            // r = sin φ takes the singularity of the edge away
            let sum: f64 = gauss_legendre(40, 0.0, 0.5 * PI)
                .into_iter()
                .map(|(phi, w)| {
                    let r = phi.sin();
                    w * 2.0 * r * phi.cos() * disc.pressure_slope(r)
                })
                .sum();
            assert!((sum / disc.drag_slope() - 1.0).abs() < 1e-6, "{sum} {}", disc.drag_slope());
        }
    }

    #[test]
    fn thick_layer_has_the_pressure_of_a_half_space() {
        // p = (2/π)·w/√(a² − r'²)
        let (h, c_s, r) = (3000.0, 0.5, 0.6_f64);
        let disc = DiscStiffness::new(h, c_s);
        let expected = 2.0 / PI * h * c_s / (1.0 - r * r).sqrt();
        assert!((disc.pressure_slope(r) / expected - 1.0).abs() < 1e-3);
    }
    #[test]
    fn more_nodes_change_nothing_in_the_whole_range() {
        for (h, c_s) in [(0.021, 0.999), (0.1, 0.5), (20.0, 0.5)] {
            let disc = DiscStiffness::new(h, c_s);
            let kernel = LayerKernel::simplified(h, 2.0 / c_s);
            let finer = DiscStiffness::with_nodes(h, 1.0 / c_s, 1.0, &kernel, 2 * disc.nodes.len());
            let change = disc.drag_slope() / finer.drag_slope() - 1.0;
            assert!(change.abs() < 1e-10, "h·c_s = {}: {change:e}", h * c_s);
            for r in [0.0, 0.5, 0.9, 0.99] {
                let [coarse, fine] = [&disc, &finer].map(|disc| disc.pressure_slope(r));
                let change = coarse / fine - 1.0;
                assert!(change.abs() < 1e-10, "h·c_s = {}, r = {r}: {change:e}", h * c_s);
            }
        }
    }

    #[test]
    fn known_limits_on_layers() {
        let slope = |layers: &[StackLayer], theory| {
            let stack = Stack::new(layers, Back::Rigid).expect("a stack");
            DiscStiffness::on_stack(&stack, theory).drag_slope()
        };
        // layers of one material are one layer
        let equal = [0.2, 0.5, 0.3].map(|thickness| layer(1.0, 1.0, 0.5, thickness));
        let simplified = slope(&equal, ModelKind::Rakhmatulin) / DiscStiffness::new(1.0, 0.5).drag_slope();
        assert!((simplified - 1.0).abs() < 1e-12, "{simplified}");
        let full = slope(&equal, ModelKind::Elastic) / DiscStiffness::elastic(1.0, 0.5).drag_slope();
        assert!((full - 1.0).abs() < 1e-12, "{full}");
        let column = |impedance: f64, speed: f64, thickness: f64| {
            layer(impedance, speed, speed * 0.5f64.sqrt(), thickness)
        };
        for theory in [ModelKind::Rakhmatulin, ModelKind::Elastic] {
            // a thick first layer hides the second: the drag is that on the first alone, but for R/h
            let [thick, alone] = [0.1, 1.0].map(|impedance| {
                slope(&[layer(1.0, 1.0, 0.4, 500.0), layer(impedance, 1.0, 0.4, 1.0)], theory) / 501.0
            });
            assert!((thick / alone - 1.0).abs() < 0.02, "{theory:?}: {thick} {alone}");
            // a wide disc without Poisson's effect presses on springs in series, Σ h/Zc; its rim gives what is left, in proportion to h
            let series = |h: f64| {
                let columns = [column(1.0, 1.0, h), column(0.5, 0.5, 0.5 * h), column(4.0, 1.7, 0.5 * h)];
                slope(&columns, theory) / 2.0 * (1.0 + 0.5 / 0.25 + 0.5 / 6.8) - 1.0
            };
            let [thin, thinner] = [0.12, 0.06].map(series);
            assert!((thin / thinner - 2.0).abs() < 0.1 && thinner < 0.15, "{theory:?}: {thin} {thinner}");
        }
    }

    #[test]
    fn more_nodes_change_nothing_on_layers() {
        let layers = [layer(1.0, 1.0, 0.5, 0.3), layer(0.05, 0.4, 0.2, 0.1), layer(3.0, 1.5, 0.8, 0.6)];
        let stack = Stack::new(&layers, Back::Rigid).expect("a stack");
        for theory in [ModelKind::Rakhmatulin, ModelKind::Elastic] {
            let disc = DiscStiffness::on_stack(&stack, theory);
            // a rule for a larger reach has more nodes
            let (kernel, stiffness) = LayerKernel::of_stack(&stack, theory, 40.0);
            let finer = DiscStiffness::with_nodes(1.0, 1.0, stiffness, &kernel, disc.nodes.len() * 3 / 2);
            let change = disc.drag_slope() / finer.drag_slope() - 1.0;
            assert!(change.abs() < 1e-10, "{theory:?}: {change:e}");
        }
    }

    #[test]
    fn elastic_slopes_worked_out_independently() {
        for (beta, expected) in [(0.3, 0.458_537), (0.4, 0.752_471), (0.5, 1.049_764), (0.6, 1.289_950)] {
            let slope = DiscStiffness::elastic(1.0, beta).drag_slope();
            assert!((slope - expected).abs() < 6e-7, "β = {beta}: {slope}");
        }
    }

    #[test]
    fn elastic_limits() {
        for beta in [0.2, 0.5, 0.8] {
            let slope = |h| DiscStiffness::elastic(h, beta).drag_slope();
            // thick layer: a half-space, up to R/h
            let space = elastic_half_space(beta);
            let [far, farther] = [1e3, 2e3].map(|h| slope(h) / (h * space) - 1.0);
            assert!(far > 0.0 && far < 2e-3 && (far / farther - 2.0).abs() < 0.01, "{far} {farther}");
            // thin layer: it slides, 4β²(1 − β²) = E/(1 − ν²), and its rim gives what is left, in proportion to h
            let plate = 4.0 * beta * beta * (1.0 - beta * beta);
            let [thin, thinner] = [0.12, 0.06].map(|h| slope(h) / plate - 1.0);
            assert!((thin / thinner - 2.0).abs() < 0.1 && thinner < 0.1, "{thin} {thinner}");
        }
        assert!((elastic_half_space(0.5) - 1.5 / PI).abs() < 1e-15);
    }

    #[test]
    fn elastic_drag_is_the_integral_of_pressure() {
        let disc = DiscStiffness::elastic(0.6, 0.4);
        let sum: f64 = gauss_legendre(24, 0.0, 0.5 * PI)
            .into_iter()
            .map(|(phi, w)| {
                let r = phi.sin();
                w * 2.0 * r * phi.cos() * disc.pressure_slope(r)
            })
            .sum();
        assert!((sum / disc.drag_slope() - 1.0).abs() < 1e-9, "{sum} {}", disc.drag_slope());
    }
}
