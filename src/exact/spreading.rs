//! Pressure under a surface set in motion by a spreading contact: cones, paraboloids, flat faces; on a layer, a half-space or
//! layers of one shear wave speed, in the simplified theory, anywhere under the contact.
//!
//! Every point of the surface moves with V0 from the moment `t = τ(r)` at which the contact reaches it,
//!
//! ```text
//! g(r, t) = V0·(t − τ(r))₊     cone τ = r/V*,  paraboloid τ = r²/k,  flat τ = 0
//! ```
//!
//! **Derivation.** The image of the equation of motion (Laplace in t, Hankel in r, `P = √(s² + c²ξ²)`, c = c_s) has the
//! solution `p = P·cosh P(h − z)/sinh Ph · g`, that is a sum over the distances d a wave may have travelled,
//!
//! ```text
//! p = Σ_d P e^{−dP} g      d = 2mh + z  and  2(m+1)h − z,  m = 0, 1, …   (half-space: d = z alone)
//! ```
//!
//! In layers of different densities and speeds c_k along z, but of one c, u varies like `e^{±zP/c_k}`, and stress is `Z_k·P` times its
//! amplitude. P cancels from the conditions at interfaces, so that reflections are those of plane waves: d are the times at which
//! these arrive, and the terms have their pressures a_d as factors, see [`Stack::arrivals`].
//!
//! Write `P e^{−dP} = (s² + c²ξ²)·(e^{−dP}/P)`. The first factor is the operator `∂_t² − c²∇²`, applied to g; the second
//! is the image of `J0(cξ√(t² − d²))·H(t − d)`, the mean over a circle of radius `c√(t² − d²)`. So each term is a
//! retarded potential of a surface source, with the delay E a wave needs from y to the point:
//!
//! ```text
//! p_d(x, t) = 1/(2πc²) ∫ S(y, t − E)/E d²y          E = √(d² + |y − x|²/c²)
//! S = g_tt − c²∇²g = V0·(1 − c²τ'²)·δ(t − τ) + c²V0·∇²τ·H(t − τ)
//! ```
//!
//! In polar coordinates (σ, φ) around any point of the region `G = t − τ − E > 0`, which is convex because τ and E are,
//! every ray leaves the region once, at σ*, and
//!
//! ```text
//! p_d = (V0/πc²) ∫_0^π { (1 − c²τ'²)·σ*/(E·|∂G/∂σ|) + c² ∫_0^{σ*} ∇²τ·σ/E dσ } dφ
//! ```
//!
//! The inner integral is elementary or smooth; the outer one is periodic and smooth except for a logarithm on the ray from x
//! through the tip of a cone. Both are refined until they no longer change. On the axis of a paraboloid the result is
//! the closed form of [`super::paraboloid`], which tests check to ten digits; the drag of a contact that outruns all
//! waves is `V0·Σ (2 −δ_{m0})·r*²(t − 2mh)`, because the mean of p over the whole plane obeys the equation without c.
//!
//! **Range.** Contact spreads into surface at rest, so the form holds for *prescribed* motion of an unbounded shape, and
//! for unilateral contact as long as the contact outruns the waves, `c·τ' ≤ 1`. On the surface it is given under
//! the contact; it is infinite under the tip of a cone and at the edge of a contact slower than the waves.

use std::f64::consts::PI;

use super::{
    ExactError, outside, positive,
    quadrature::{bisect, gauss_legendre, over_half_circle, singular_at_ends},
    stack::Stack,
};

/// How a contact spreads over the surface: its radius as a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Front {
    /// Everywhere at once.
    Flat,
    /// `r* = V*·t`.
    Cone {
        /// V* \[c_p\]
        spread_rate: f64,
    },
    /// `r*² = k·t`.
    Paraboloid {
        /// k \[R·c_p\]
        curvature: f64,
    },
}

impl Front {
    /// Time τ(r) at which the contact reaches `r` \[R/c_p\].
    pub fn arrival(&self, r: f64) -> f64 {
        match *self {
            Self::Flat => 0.0,
            Self::Cone { spread_rate } => r / spread_rate,
            Self::Paraboloid { curvature } => r * r / curvature,
        }
    }

    /// Slowness τ'(r) of the contact \[1/c_p\].
    pub fn slowness(&self, r: f64) -> f64 {
        match *self {
            Self::Flat => 0.0,
            Self::Cone { spread_rate } => 1.0 / spread_rate,
            Self::Paraboloid { curvature } => 2.0 * r / curvature,
        }
    }

    /// Contact radius r*(t) \[R\].
    pub fn radius(&self, t: f64) -> f64 {
        match *self {
            _ if t < 0.0 => 0.0,
            Self::Flat => f64::INFINITY,
            Self::Cone { spread_rate } => spread_rate * t,
            Self::Paraboloid { curvature } => (curvature * t).sqrt(),
        }
    }

    /// Radius out to which the contact spreads at least as fast as waves of speed `c` \[R\].
    pub fn sonic_radius(&self, c: f64) -> f64 {
        match *self {
            Self::Flat => f64::INFINITY,
            Self::Cone { spread_rate } if spread_rate >= c => f64::INFINITY,
            Self::Cone { .. } => 0.0,
            Self::Paraboloid { curvature } => 0.5 * curvature / c,
        }
    }
}

/// Pressure under a spreading contact.
#[derive(Clone, Debug)]
pub struct Spreading {
    front: Front,
    velocity: f64,
    c: f64,
    stack: Stack,
    rule: Vec<(f64, f64)>,
}

/// Nodes of the inner integral of a cone.
const INNER_NODES: usize = 40;

/// Relative difference of speeds that is rounding.
const SAME: f64 = 1e-9;

impl Spreading {
    /// * `velocity`: V0 \[c_p\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    /// * `thickness`: h of a layer \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `c_s ≥ 1`.
    pub fn new(
        front: Front,
        velocity: f64,
        shear_wave_speed: f64,
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        Self::on_stack(front, velocity, Stack::single(shear_wave_speed, thickness)?)
    }

    /// The same on layers.
    ///
    /// * `velocity`: V0 \[c_p\]
    /// * `stack`: layers; under a front that is not flat they have one shear wave speed
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or layers of different shear wave speeds.
    pub fn on_stack(front: Front, velocity: f64, stack: Stack) -> Result<Self, ExactError> {
        match front {
            Front::Flat => 0.0,
            Front::Cone { spread_rate } => positive("spread_rate", spread_rate, f64::INFINITY, "V* > 0")?,
            Front::Paraboloid { curvature } => positive("curvature", curvature, f64::INFINITY, "k > 0")?,
        };
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        let c = stack.layers()[0].shear_wave_speed;
        let differs = |speed: f64| (speed - c).abs() > SAME * c && front != Front::Flat;
        if let Some(value) = stack.layers().iter().map(|layer| layer.shear_wave_speed).find(|c| differs(*c)) {
            return Err(ExactError::Parameter {
                name: "shear_wave_speed",
                value,
                bound: "the same in all layers",
            });
        }
        Ok(Self { front, velocity, c, stack, rule: gauss_legendre(INNER_NODES, 0.0, 1.0) })
    }

    /// Pressure −σ_zz at radius `r`, depth `z`, time `t` \[γc_p²\]; half the jump of a front that arrives at `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative; `z` is not in the target; on the surface: `r` is beyond the contact or, for contact slower than
    /// the waves, at its edge, or the tip of a cone.
    pub fn pressure(&self, r: f64, z: f64, t: f64) -> Result<f64, ExactError> {
        if !(r >= 0.0 && r.is_finite()) {
            return outside("r", r, "r ≥ 0");
        }
        let paths = self.stack.arrivals(z, t)?;
        if z == 0.0 {
            let fast = r <= self.front.sonic_radius(self.c);
            let reached = t - self.front.arrival(r);
            if reached < 0.0 && fast {
                // the contact outruns every wave: nothing has moved yet
                return Ok(0.0);
            }
            if reached < 0.0 || (reached == 0.0 && !fast) {
                return outside("r", r, format!("r < r* = {}", self.front.radius(t)));
            }
            if r == 0.0 && matches!(self.front, Front::Cone { .. }) {
                return outside("r", r, "r > 0: pressure grows without bound towards the tip of a cone");
            }
        }
        Ok(self.velocity * paths.iter().map(|&(d, pressure)| pressure * self.term(r, d, t)).sum::<f64>())
    }

    /// Drag `F = 2∫_0^{r*} p r dr` at time `t` \[πR²γc_p²\], normalised by the area of the disc of radius 1.
    ///
    /// While the contact outruns all waves it is `V0·Σ r*²(t − d)`; after that the pressure is integrated.
    ///
    /// # Errors
    ///
    /// `t` is negative, or the face is flat and unbounded.
    pub fn drag(&self, t: f64) -> Result<f64, ExactError> {
        if self.front == Front::Flat || t.is_nan() || t < 0.0 {
            return outside("t", t, "t ≥ 0, and not for an unbounded flat face");
        }
        let edge = self.front.radius(t);
        let fast = edge <= self.front.sonic_radius(self.c);
        let term = |d: f64| if fast { self.front.radius(t - d).powi(2) } else { self.term_drag(edge, d, t) };
        let paths = self.stack.arrivals(0.0, t)?;
        Ok(self.velocity * paths.iter().map(|&(d, pressure)| pressure * term(d)).sum::<f64>())
    }

    /// Time at which a wave that travels the depth `d` first arrives at `r` \[R/c_p\], and where on the surface it starts.
    fn first_arrival(&self, r: f64, d: f64) -> (f64, f64) {
        let time = |y: f64| self.front.arrival(y) + delay(d, r - y, self.c);
        // time'(y) rises from y = 0 to r, where it is τ'(r) ≥ 0
        let slope = |y: f64| self.front.slowness(y) - rate(d, r - y, self.c);
        if slope(0.0) >= 0.0 {
            return (time(0.0), 0.0);
        }
        let (_, origin) = bisect(r, 200, |y| slope(y) < 0.0);
        (time(origin), origin)
    }

    /// `p_d/V0` at `(r, t)`.
    fn term(&self, r: f64, d: f64, t: f64) -> f64 {
        const ROUNDING: f64 = 1e-12;
        if self.front == Front::Flat {
            return if (t - d).abs() <= ROUNDING * t { 0.5 } else { 1.0 };
        }
        let (arrival, origin) = if d == 0.0 { (self.front.arrival(r), r) } else { self.first_arrival(r, d) };
        if (t - arrival).abs() <= ROUNDING * t {
            // a front just arriving: half of the value behind it
            const BEHIND: f64 = 1e-7;
            let step = BEHIND * arrival.max(self.length() / self.c);
            return 0.5 * self.term_behind(r, d, arrival + step, origin);
        }
        if t < arrival { 0.0 } else { self.term_behind(r, d, t, origin) }
    }

    /// A length of the shape \[R\]: k/c_s, or 1 for a cone, which has none.
    fn length(&self) -> f64 {
        match self.front {
            Front::Paraboloid { curvature } => curvature / self.c,
            Front::Flat | Front::Cone { .. } => 1.0,
        }
    }

    /// The same at a time after the first arrival.
    ///
    /// * `origin`: a radius in the region that has sent waves
    fn term_behind(&self, r: f64, d: f64, t: f64, origin: f64) -> f64 {
        let cone = matches!(self.front, Front::Cone { .. });
        let tip_seen = t > delay(d, r, self.c);
        if d == 0.0 && cone {
            // around x, where 1/E is singular; the ray through the tip is not smooth
            return singular_at_ends(PI, |phi, rest| self.ray(Ray::new(self, r, d, t, r, phi, rest))) / PI;
        }
        let speed = 1.0 / (self.c * self.front.slowness(r));
        if d == 0.0 && speed < 1.0 {
            // Rays that meet the edge of a slow contact leave at once, those that run away from it far off; between them, at
            // cos φ = −1/cτ', lies a peak as narrow as x is near to the edge.
            let between = libm::acos(-speed);
            let ray = |phi: f64| self.ray(Ray::new(self, r, d, t, r, phi, PI - phi));
            let met = singular_at_ends(between, |_, rest| ray(between - rest));
            let missed = singular_at_ends(PI - between, |more, _| ray(between + more));
            return (met + missed) / PI;
        }
        // the tip of a cone, where ∇²τ is singular; else where G is largest, from where no side of the region is near
        let centre = if cone && tip_seen { 0.0 } else { origin };
        let slope = |phi| {
            let ray = Ray::new(self, r, d, t, centre, phi, PI - phi);
            ray.at(ray.end()).slope
        };
        let stretch = (slope(0.0) / slope(PI)).clamp(1.0, 1e12);
        over_half_circle(stretch, |phi, rest| self.ray(Ray::new(self, r, d, t, centre, phi, rest))) / PI
    }

    /// Both integrands on one ray: the term at its end, and the integral along it.
    fn ray(&self, ray: Ray<'_>) -> f64 {
        let end = ray.end();
        let point = ray.at(end);
        let c2 = self.c * self.c;
        // σ/E → c at d = 0 around x itself, where E = σ/c
        let ratio = if point.delay > 0.0 { end / point.delay } else { self.c };
        let leaving = (1.0 - c2 * point.slowness * point.slowness) * ratio / -point.slope;
        leaving / c2 + ray.along(end)
    }

    /// `2∫_0^{r*} p_d r dr / V0`.
    fn term_drag(&self, edge: f64, d: f64, t: f64) -> f64 {
        const NODES: usize = 32;
        let integrand = |r: f64| 2.0 * r * self.term(r, d, t);
        if d == 0.0 {
            // logarithmic at the edge, where r = r*·(1 − v⁴) makes it vanish like v³ ln v
            let at = |v: f64| integrand(edge * (1.0 - v.powi(4))) * edge * 4.0 * v.powi(3);
            return gauss_legendre(NODES, 0.0, 1.0).into_iter().map(|(v, w)| w * at(v)).sum();
        }
        // the front of this reflection may end under the contact
        let has_arrived = |r: f64| self.first_arrival(r, d).0 <= t;
        let high = if has_arrived(edge) { edge } else { bisect(edge, 60, has_arrived).1 };
        gauss_legendre(NODES, 0.0, high).into_iter().map(|(r, w)| w * integrand(r)).sum()
    }
}

/// A ray from a point of the source region: its end on the boundary, and the integral along it.
struct Ray<'a> {
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
struct Point {
    delay: f64,
    slowness: f64,
    /// ∂G/∂σ, negative at the end of the ray.
    slope: f64,
    /// G
    excess: f64,
}

impl<'a> Ray<'a> {
    /// * `phi`, `rest`: angle from the outward radius, and π minus it
    fn new(of: &'a Spreading, r: f64, d: f64, t: f64, centre: f64, phi: f64, rest: f64) -> Self {
        let (cos, sin) =
            if phi < rest { (libm::cos(phi), libm::sin(phi)) } else { (-libm::cos(rest), libm::sin(rest)) };
        Self { of, r, d, t, centre, cos, sin }
    }

    fn at(&self, sigma: f64) -> Point {
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
    fn end(&self) -> f64 {
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
    fn along(&self, end: f64) -> f64 {
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

/// Delay E of a wave through the depth `d` and the distance `x` along the surface.
fn delay(d: f64, x: f64, c: f64) -> f64 {
    (d * d + x * x / (c * c)).sqrt()
}

/// `dE/dx`
fn rate(d: f64, x: f64, c: f64) -> f64 {
    if d == 0.0 { x.signum() / c } else { x / (c * c * delay(d, x, c)) }
}

#[cfg(test)]
mod tests;
