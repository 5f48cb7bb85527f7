//! One ray of the integral: the end of the ray on the boundary of the source region, and the integral along it.

use super::{Front, Spreading};

/// A ray from a point of the source region.
pub(super) struct Ray<'a> {
    of: &'a Spreading,
    r: f64,
    d: f64,
    t: f64,
    /// Radius of the point the ray starts from, on the same meridian as x.
    centre: f64,
    cos: f64,
    sin: f64,
}

/// Quantities at a point of a ray.
pub(super) struct Point {
    pub(super) delay: f64,
    pub(super) slowness: f64,
    /// ∂G/∂σ, negative at the end of the ray.
    pub(super) slope: f64,
    /// G
    pub(super) excess: f64,
}

impl<'a> Ray<'a> {
    /// * `phi`, `rest`: angle from the outward radius, and π minus it
    pub(super) fn new(of: &'a Spreading, r: f64, d: f64, t: f64, centre: f64, phi: f64, rest: f64) -> Self {
        let (cos, sin) =
            if phi < rest { (libm::cos(phi), libm::sin(phi)) } else { (-libm::cos(rest), libm::sin(rest)) };
        Self { of, r, d, t, centre, cos, sin }
    }

    pub(super) fn at(&self, sigma: f64) -> Point {
        let (front, c) = (self.of.front, self.of.c);
        let s = ((self.centre * self.sin).powi(2) + (sigma + self.centre * self.cos).powi(2)).sqrt();
        let outward = if s > 0.0 { (sigma + self.centre * self.cos) / s } else { 1.0 };
        let x = self.r - self.centre;
        let along = sigma - x * self.cos;
        let delay = (self.d * self.d + ((x * self.sin).powi(2) + along * along) / (c * c)).sqrt();
        let delay_slope = if delay > 0.0 { along / (c * c * delay) } else { 1.0 / c };
        let slowness = front.slowness(s);
        Point {
            delay,
            slowness,
            slope: -slowness * outward - delay_slope,
            excess: self.t - front.arrival(s) - delay,
        }
    }

    /// σ* where G falls to 0: Newton's method from beyond it, monotone because G is concave.
    pub(super) fn end(&self) -> f64 {
        let reach = self.of.c * (self.t * self.t - self.d * self.d).max(0.0).sqrt();
        let mut sigma = (self.r - self.centre).abs() + reach;
        for _ in 0..100 {
            let point = self.at(sigma);
            let next = sigma - point.excess / point.slope;
            if next.is_nan() || next >= sigma || next <= 0.0 {
                break;
            }
            sigma = next;
        }
        sigma
    }

    /// `∫_0^{σ*} ∇²τ·σ/E dσ`
    pub(super) fn along(&self, end: f64) -> f64 {
        let c = self.of.c;
        let x = self.r - self.centre;
        // E = √((σ − b)² + a²)/c
        let (b, a) = (x * self.cos, ((x * self.sin).powi(2) + (c * self.d).powi(2)).sqrt());
        match self.of.front {
            Front::Flat => 0.0,
            // ∇²τ = 4/k
            Front::Paraboloid { curvature } => {
                let root = |sigma: f64| ((sigma - b).powi(2) + a * a).sqrt();
                let linear = root(end) - root(0.0);
                let log = if b == 0.0 { 0.0 } else { b * (libm::asinh((end - b) / a) + libm::asinh(b / a)) };
                4.0 / curvature * c * (linear + log)
            }
            // ∇²τ = 1/(V*s)
            Front::Cone { spread_rate } if self.centre == 0.0 => {
                c / spread_rate * (libm::asinh((end - b) / a) + libm::asinh(b / a))
            }
            Front::Cone { spread_rate } if self.d == 0.0 => {
                // around x: E = σ/c
                let (b, a) = (self.centre * self.cos, self.centre * self.sin);
                c / spread_rate * (libm::asinh((end + b) / a) - libm::asinh(b / a))
            }
            Front::Cone { spread_rate } => {
                let value = |sigma: f64| {
                    let s =
                        ((self.centre * self.sin).powi(2) + (sigma + self.centre * self.cos).powi(2)).sqrt();
                    sigma / (s * ((sigma - b).powi(2) + a * a).sqrt())
                };
                let sum: f64 = self.of.rule.iter().map(|(x, w)| w * value(end * x)).sum();
                c / spread_rate * end * sum
            }
        }
    }
}
