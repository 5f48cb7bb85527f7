//! Static compliance of a layer on a smooth rigid backing, relative to that of a half-space, as a rule of integration over wave
//! numbers.
//!
//! Where the surface is displaced by `w·cos ξx`, free of shear stress, it carries `p = κ·ξ·w/T(ξh)` with `κ = 2β²(1 − β²)`
//! and T → 1 for short waves. In the full theory (Sneddon, *Fourier transforms*, section 55)
//!
//! ```text
//! T(x) = (cosh 2x − 1)/(sinh 2x + 2x)      1 − T = (1 + 2x − e^{−2x})/(sinh 2x + 2x) → 4x·e^{−2x}
//! ```
//!
//! and in the simplified theory `T = tanh x`. The rule is Gauss–Legendre's on `0 < x < 24`, beyond which 1 − T is
//! 1e-19, with nodes enough for `cos(xy/h)` up to the largest y.

use super::quadrature::gauss_legendre_on;

/// Longest `x = ξh` of the rule.
const LONGEST: f64 = 24.0;

/// Nodes of the rule: so many, and so many per `y/h`.
const NODES: f64 = 90.0;
const NODES_PER_THICKNESS: f64 = 8.0;

/// 1 − T of a layer.
#[derive(Clone, Debug)]
pub(super) struct LayerKernel {
    thickness: f64,
    /// ξh, weight, and 1 − T there.
    nodes: Vec<(f64, f64, f64)>,
}

impl LayerKernel {
    /// The kernel of the full theory.
    ///
    /// * `reach`: largest |y|
    pub(super) fn elastic(thickness: f64, reach: f64) -> Self {
        Self::new(thickness, reach, |x| (1.0 + 2.0 * x - (-2.0 * x).exp()) / ((2.0 * x).sinh() + 2.0 * x))
    }

    /// The kernel of the simplified theory, T = tanh.
    ///
    /// * `reach`: largest |y|
    pub(super) fn simplified(thickness: f64, reach: f64) -> Self {
        Self::new(thickness, reach, |x| 2.0 / ((2.0 * x).exp() + 1.0))
    }

    /// The kernel of a given 1 − T, which falls like e^{−2x}.
    fn new(thickness: f64, reach: f64, rest: impl Fn(f64) -> f64) -> Self {
        let nodes = (NODES + NODES_PER_THICKNESS * reach / thickness).ceil() as usize;
        let rule = gauss_legendre_on(nodes, 0.0, LONGEST).into_iter();
        Self { thickness, nodes: rule.map(|(x, w)| (x, w, rest(x))).collect() }
    }

    /// Wave numbers ξ and shares c of
    ///
    /// ```text
    /// g(t − s) + g(t + s) = Σ c cos ξt cos ξs      g(y) = ∫_0^∞ (1 − T(ξh)) cos ξy dξ
    /// ```
    pub(super) fn waves(&self) -> impl Iterator<Item = (f64, f64)> {
        let h = self.thickness;
        // cos x(t − s) + cos x(t + s)
        self.nodes.iter().map(move |(x, w, rest)| (x / h, 2.0 * w * rest / h))
    }

    /// `∫_0^∞ T(ξh) cos ξy dξ/ξ + ln |y|`, smooth in y. With `ln(c/|y|) = ∫_0^∞ (cos ξy − e^{−cξ}) dξ/ξ`, c = 2h, it is
    ///
    /// ```text
    /// ln 2h + ∫_0^∞ [e^{−2x} − (1 − T(x)) cos(xy/h)] dx/x
    /// ```
    pub(super) fn logarithmic_rest(&self, y: f64) -> f64 {
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
