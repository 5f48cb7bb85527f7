//! Static compliance of layers on a smooth rigid backing, relative to that of a half-space of the first one, as a rule of integration over
//! wave numbers.
//!
//! Where the surface is displaced by `w·cos ξx`, free of shear stress, it carries `p = κ·ξ·w/T(ξh)` with `κ = 2β²(1 − β²)`
//! and T → 1 for short waves. In the full theory (Sneddon, *Fourier transforms*, section 55)
//!
//! ```text
//! T(x) = (cosh 2x − 1)/(sinh 2x + 2x)      1 − T = (1 + 2x − e^{−2x})/(sinh 2x + 2x) → 4x·e^{−2x}
//! ```
//!
//! and in the simplified theory `T = tanh x`. Of several layers it is found with the reflection R at their tops, in the
//! simplified theory, where layer k has `w ~ e^{±β_kξz}` and `p = Y_kξw`, `Y_k = Z_k·c_s,k`,
//!
//! ```text
//! R_k = e^{−2β_kξh_k}·(r_k + R_{k+1})/(1 + r_k·R_{k+1})      r_k = (Y_{k+1} − Y_k)/(Y_{k+1} + Y_k)     R = 1 at the backing
//! T = (1 − R_1)/(1 + R_1)
//! ```
//!
//! and in the full theory by `transfer`. All 1 − T fall like e^{−2x}, x = ξh of the first layer (simplified theory: β_1ξh_1).
//!
//! The rule is Gauss–Legendre's on `0 < x < 24`, beyond which 1 − T is 1e-19, in intervals that double from one to the next: the
//! shortest is as short as the softest layer and the thickness of all ask for. Nodes are enough for `cos(xy/h)` up to the largest y.

use percuss::{
    exact::{
        quadrature::gauss_legendre,
        stack::{Stack, StackLayer},
    },
    model::ModelKind,
};

use super::transfer::Fields;

/// Longest `x = ξh` of the rule.
const LONGEST: f64 = 24.0;

/// Intervals of the rule for one layer; several have one more for every factor of two in scales and stiffnesses.
const INTERVALS: i32 = 5;

/// Nodes in an interval: so many, and so many per radian of `cos(xy/h)`.
const NODES: f64 = 24.0;
const NODES_PER_RADIAN: f64 = 1.0 / 3.0;

/// 1 − T.
#[derive(Clone, Debug)]
pub struct LayerKernel {
    thickness: f64,
    /// ξh, weight, and 1 − T there.
    nodes: Vec<(f64, f64, f64)>,
}

impl LayerKernel {
    /// The kernel of the full theory.
    ///
    /// * `reach`: largest |y|
    pub fn elastic(thickness: f64, reach: f64) -> Self {
        Self::new(thickness, reach, INTERVALS, |x| {
            (1.0 + 2.0 * x - (-2.0 * x).exp()) / ((2.0 * x).sinh() + 2.0 * x)
        })
    }

    /// The kernel of the simplified theory, T = tanh.
    ///
    /// * `reach`: largest |y|
    pub fn simplified(thickness: f64, reach: f64) -> Self {
        Self::new(thickness, reach, INTERVALS, |x| 2.0 / ((2.0 * x).exp() + 1.0))
    }

    /// The kernel of layers on a rigid back, and κ of the first.
    ///
    /// * `reach`: largest |y|
    pub fn of_stack(stack: &Stack, theory: ModelKind, reach: f64) -> (Self, f64) {
        let stiffness = |layer: &StackLayer| {
            let StackLayer { impedance, wave_speed, shear_wave_speed, .. } = *layer;
            match theory {
                ModelKind::Rakhmatulin => impedance * shear_wave_speed,
                ModelKind::Elastic => {
                    let shear = (shear_wave_speed / wave_speed).powi(2);
                    2.0 * impedance * wave_speed * shear * (1.0 - shear)
                }
            }
        };
        // in coordinates in which waves fall off along z as they are long along r
        let depth = |layer: &StackLayer| match theory {
            ModelKind::Rakhmatulin => layer.thickness * layer.shear_wave_speed / layer.wave_speed,
            ModelKind::Elastic => layer.thickness,
        };
        let layers = stack.layers();
        let (first, scale) = (stiffness(&layers[0]), depth(&layers[0]));
        let total: f64 = layers.iter().map(depth).sum();
        let (least, most) =
            layers.iter().map(stiffness).fold((first, first), |(a, b), x| (a.min(x), b.max(x)));
        let finer = (total / scale * most / least).log2().ceil() as i32;
        let rest = |x: f64| match theory {
            ModelKind::Rakhmatulin => {
                let mut reflection = 1.0;
                for (number, layer) in layers.iter().enumerate().rev() {
                    let below = layers.get(number + 1).map_or(stiffness(layer), stiffness);
                    let r = (below - stiffness(layer)) / (below + stiffness(layer));
                    reflection =
                        (-2.0 * x / scale * depth(layer)).exp() * (r + reflection) / (1.0 + r * reflection);
                }
                2.0 * reflection / (1.0 + reflection)
            }
            ModelKind::Elastic => 1.0 - first * Fields::on_rigid_back(stack, x / scale).compliance(),
        };
        (Self::new(scale, reach, INTERVALS + finer, rest), first)
    }

    /// Length over which the kernel falls off \[R\].
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// The kernel of a given 1 − T, which falls like e^{−2x}.
    fn new(thickness: f64, reach: f64, intervals: i32, rest: impl Fn(f64) -> f64) -> Self {
        let interval = |number: i32| {
            let high = LONGEST * 0.5f64.powi(number);
            let low = if number + 1 == intervals { 0.0 } else { 0.5 * high };
            let nodes = NODES + NODES_PER_RADIAN * (high - low) * reach / thickness;
            gauss_legendre(nodes.ceil() as usize, low, high)
        };
        let rule = (0..intervals).flat_map(interval);
        Self { thickness, nodes: rule.map(|(x, w)| (x, w, rest(x))).collect() }
    }

    /// Wave numbers ξ and shares c of
    ///
    /// ```text
    /// g(t − s) + g(t + s) = Σ c cos ξt cos ξs      g(y) = ∫_0^∞ (1 − T(ξh)) cos ξy dξ
    /// ```
    pub fn waves(&self) -> impl Iterator<Item = (f64, f64)> {
        let h = self.thickness;
        // cos x(t − s) + cos x(t + s)
        self.nodes.iter().map(move |(x, w, rest)| (x / h, 2.0 * w * rest / h))
    }

    /// `∫_0^∞ T(ξh) cos ξy dξ/ξ + ln |y|`, smooth in y. With `ln(c/|y|) = ∫_0^∞ (cos ξy − e^{−cξ}) dξ/ξ`, c = 2h, it is
    ///
    /// ```text
    /// ln 2h + ∫_0^∞ [e^{−2x} − (1 − T(x)) cos(xy/h)] dx/x
    /// ```
    pub fn logarithmic_rest(&self, y: f64) -> f64 {
        let y = y / self.thickness;
        let term = |&(x, w, rest): &(f64, f64, f64)| w * ((-2.0 * x).exp() - rest * (x * y).cos()) / x;
        (2.0 * self.thickness).ln() + self.nodes.iter().map(term).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_of_the_simplified_theory_are_known() {
        // 1 − tanh x: g(0) = ln 2/h, and ∫ tanh(ξh) cos ξy dξ/ξ = −ln tanh(πy/4h)
        for (h, y) in [(1.0, 0.3), (0.1, 1.7), (4.0, 2.0)] {
            let kernel = LayerKernel::simplified(h, 2.0);
            let even = |t: f64, s: f64| {
                kernel.waves().map(|(xi, share)| share * (xi * t).cos() * (xi * s).cos()).sum::<f64>()
            };
            assert!((0.5 * even(0.0, 0.0) * h - std::f64::consts::LN_2).abs() < 1e-13, "h = {h}");
            // g(y) = 2 Σ (−1)^{n+1}·2nh/(4n²h² + y²), halfway between two sums
            let term = |n: u32| {
                let p = 2.0 * f64::from(n) * h;
                2.0 * if n % 2 == 1 { p } else { -p } / (p * p + y * y)
            };
            let series: f64 = (1..100_000).map(term).sum::<f64>() + 0.5 * term(100_000);
            assert!((0.5 * even(0.0, y) - series).abs() < 1e-9 / h, "h = {h}, y = {y}");
            let expected = f64::ln(y / (std::f64::consts::FRAC_PI_4 * y / h).tanh());
            assert!((kernel.logarithmic_rest(y) - expected).abs() < 1e-12, "h = {h}, y = {y}");
        }
    }

    #[test]
    fn compliance_of_long_waves_is_that_of_a_plate() {
        // T → x/2: the layer slides on its backing, and p = 2κ·w/h = E/(1 − ν²)·w/h
        let kernel = LayerKernel::elastic(1.0, 2.0);
        let &(x, _, rest) = kernel.nodes.last().expect("nodes");
        assert!(((1.0 - rest) / x - 0.5).abs() < 1e-3, "{x} {rest}");
        // short waves: 1 − T → 4x·e^{−2x}
        let &(x, _, rest) = kernel.nodes.iter().rfind(|node| node.0 > 8.0).expect("nodes");
        assert!((rest / ((4.0 * x + 2.0) * (-2.0 * x).exp()) - 1.0).abs() < 1e-5, "{x} {rest}");
    }
}
