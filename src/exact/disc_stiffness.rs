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
//! to 1e-10, measured against twice as many nodes, down to `h·c_s = 0.02`. The integral of the kernel is expanded as `1 − tanh x = 2 Σ_{n≥1} (−1)^{n+1} e^{−2nx}`, hence
//!
//! ```text
//! g(y) = 2 Σ_{n≥1} (−1)^{n+1}·2nh/(4n²h² + y²)
//! ```
//!
//! an alternating series that repeated averaging of its partial sums (Euler's transformation) sums to rounding.
//!
//! The pressure follows from the same f, with `r' = r/c_s` and f' from the differentiated integral equation,
//!
//! ```text
//! p → A(r)·V0·t/h      A(r) = h·[ f(a)/√(a² − r'²) − ∫_{r'}^a f'(t)/√(t² − r'²) dt ]
//! ```

use std::f64::consts::PI;

use super::{
    ExactError, positive,
    quadrature::{gauss_legendre_on, solve},
};

/// Nodes of the quadrature: at least so many, and so many per a/h.
const NODES: usize = 80;
const NODES_PER_THICKNESS: f64 = 6.0;

/// A disc on a layer.
#[derive(Clone, Debug)]
pub struct DiscStiffness {
    thickness: f64,
    shear_wave_speed: f64,
    /// Nodes, weights and f of the quadrature over `0..a`.
    nodes: Vec<(f64, f64, f64)>,
}

impl DiscStiffness {
    /// * `thickness`: h of the layer \[R\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, `c_s ≥ 1`, or a layer so thin, `h·c_s < 0.02`, that the quadrature would take more than
    /// some hundred nodes.
    pub fn new(thickness: f64, shear_wave_speed: f64) -> Result<Self, ExactError> {
        let h = positive("thickness", thickness, f64::INFINITY, "h > 0")?;
        let c_s = positive("shear_wave_speed", shear_wave_speed, 1.0, "0 < c_s < 1")?;
        let a = 1.0 / c_s;
        if h < 0.02 * a {
            let bound = "thickness·c_s ≥ 0.02".to_owned();
            return Err(ExactError::OutsideRange { name: "thickness", value: h, bound });
        }
        let nodes = NODES.max((NODES_PER_THICKNESS * a / h).ceil() as usize);
        Ok(Self::with_nodes(h, c_s, nodes))
    }

    /// The disc by a quadrature with so many nodes.
    fn with_nodes(h: f64, c_s: f64, nodes: usize) -> Self {
        let a = 1.0 / c_s;
        let rule = gauss_legendre_on(nodes, 0.0, a);
        let entry = |t: f64, s: f64, w: f64| -w / PI * (kernel(t - s, h) + kernel(t + s, h));
        let row = |&(t, _): &(f64, f64)| rule.iter().map(|&(s, w)| entry(t, s, w)).collect();
        let mut matrix: Vec<Vec<f64>> = rule.iter().map(row).collect();
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] += 1.0;
        }
        let f = solve(matrix, vec![2.0 / PI; nodes]);
        let nodes = rule.into_iter().zip(f).map(|((t, w), f)| (t, w, f)).collect();
        Self { thickness: h, shear_wave_speed: c_s, nodes }
    }

    /// `A_d` of the drag `F → A_d·V0·t/h`.
    pub fn drag_slope(&self) -> f64 {
        let integral: f64 = self.nodes.iter().map(|(_, w, f)| w * f).sum();
        2.0 * self.thickness * self.shear_wave_speed * self.shear_wave_speed * integral
    }

    /// `A(r)` of the pressure `p → A(r)·V0·t/h`.
    ///
    /// # Errors
    ///
    /// `r` is not under the punch, `0 ≤ r < 1`.
    pub fn pressure_slope(&self, r: f64) -> Result<f64, ExactError> {
        if !(0.0..1.0).contains(&r) {
            let bound = "0 ≤ r < 1".to_owned();
            return Err(ExactError::OutsideRange { name: "r", value: r, bound });
        }
        let a = 1.0 / self.shear_wave_speed;
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
        Ok(self.thickness * (self.at(a) / reach - integral))
    }

    /// f(t), by the integral equation itself.
    fn at(&self, t: f64) -> f64 {
        let h = self.thickness;
        let sum: f64 =
            self.nodes.iter().map(|&(s, w, f)| w * f * (kernel(t - s, h) + kernel(t + s, h))).sum();
        (2.0 + sum) / PI
    }

    /// f'(t)
    fn slope(&self, t: f64) -> f64 {
        let h = self.thickness;
        let sum: f64 = self
            .nodes
            .iter()
            .map(|&(s, w, f)| w * f * (kernel_slope(t - s, h) + kernel_slope(t + s, h)))
            .sum();
        sum / PI
    }
}

/// `g(y) = 2 Σ_{n≥1} (−1)^{n+1}·2nh/(4n²h² + y²)`
fn kernel(y: f64, h: f64) -> f64 {
    alternating(y, h, |p| 2.0 * p / (p * p + y * y))
}

/// `g'(y) = −4y Σ_{n≥1} (−1)^{n+1}·2nh/(4n²h² + y²)²`
fn kernel_slope(y: f64, h: f64) -> f64 {
    alternating(y, h, |p| -4.0 * y * p / (p * p + y * y).powi(2))
}

/// `Σ_{n≥1} (−1)^{n+1} term(2nh)` for terms that fall smoothly beyond y.
fn alternating(y: f64, h: f64, term: impl Fn(f64) -> f64) -> f64 {
    // sum the first terms as they are, until 2nh is well beyond y, then average the partial sums of the rest
    const AVERAGED: usize = 40;
    let term = |n: usize| {
        let sign = if n % 2 == 1 { 1.0 } else { -1.0 };
        sign * term(2.0 * n as f64 * h)
    };
    let direct = (y.abs() / h).ceil() as usize + 10;
    let mut sum: f64 = (1..=direct).map(term).sum();
    let mut partial = [0.0; AVERAGED];
    for (m, value) in partial.iter_mut().enumerate() {
        sum += term(direct + 1 + m);
        *value = sum;
    }
    for remaining in (1..AVERAGED).rev() {
        for m in 0..remaining {
            partial[m] = 0.5 * (partial[m] + partial[m + 1]);
        }
    }
    partial[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernel_is_its_integral() {
        // g(0) = ln 2/h, and the integral by a fine trapezoidal sum elsewhere
        for h in [0.3, 1.0, 2.0] {
            assert!((kernel(0.0, h) - std::f64::consts::LN_2 / h).abs() < 1e-14 / h);
            for y in [0.4, 1.7, 4.0] {
                let step = 1e-3 / h;
                let sum: f64 = (1..30_000)
                    .map(|m| m as f64 * step)
                    .map(|xi| (1.0 - (xi * h).tanh()) * (xi * y).cos())
                    .sum();
                assert!((kernel(y, h) - step * (sum + 0.5)).abs() < 1e-6, "{h} {y}");
            }
        }
    }

    #[test]
    fn known_value_and_limits() {
        // the paper reads about 1.5
        let slope = |h, c_s| DiscStiffness::new(h, c_s).expect("parameters").drag_slope();
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
        assert!(DiscStiffness::new(0.001, 0.5).is_err());
    }

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for (h, c_s) in [(1.0, 0.5), (0.4, 0.3), (3.0, 0.7)] {
            let disc = DiscStiffness::new(h, c_s).expect("parameters");
            // r = sin φ takes the singularity of the edge away
            let sum: f64 = gauss_legendre_on(40, 0.0, 0.5 * PI)
                .into_iter()
                .map(|(phi, w)| {
                    let r = phi.sin();
                    w * 2.0 * r * phi.cos() * disc.pressure_slope(r).expect("under the punch")
                })
                .sum();
            assert!((sum / disc.drag_slope() - 1.0).abs() < 1e-6, "{sum} {}", disc.drag_slope());
        }
        assert!(DiscStiffness::new(1.0, 0.5).expect("parameters").pressure_slope(1.0).is_err());
    }

    #[test]
    fn thick_layer_has_the_pressure_of_a_half_space() {
        // p = (2/π)·w/√(a² − r'²)
        let (h, c_s, r) = (3000.0, 0.5, 0.6_f64);
        let disc = DiscStiffness::new(h, c_s).expect("parameters");
        let expected = 2.0 / PI * h * c_s / (1.0 - r * r).sqrt();
        assert!((disc.pressure_slope(r).expect("range") / expected - 1.0).abs() < 1e-3);
    }
    #[test]
    fn more_nodes_change_nothing_in_the_whole_range() {
        for (h, c_s) in [(0.021, 0.999), (0.1, 0.5), (20.0, 0.5)] {
            let disc = DiscStiffness::new(h, c_s).expect("in range");
            let finer = DiscStiffness::with_nodes(h, c_s, 2 * disc.nodes.len());
            let change = disc.drag_slope() / finer.drag_slope() - 1.0;
            assert!(change.abs() < 1e-10, "h·c_s = {}: {change:e}", h * c_s);
            for r in [0.0, 0.5, 0.9, 0.99] {
                let [coarse, fine] = [&disc, &finer].map(|disc| disc.pressure_slope(r).expect("range"));
                let change = coarse / fine - 1.0;
                assert!(change.abs() < 1e-10, "h·c_s = {}, r = {r}: {change:e}", h * c_s);
            }
        }
    }
}
