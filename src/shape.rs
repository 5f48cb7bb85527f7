//! Indenter shapes: the profile `z = f(r)` of a rigid body, and averages of its penetration into a flat surface.
//!
//! A shape knows nothing of meshes, motion or contact rules. Averages are those of the *prescribed* motion,
//! in which every point of the surface moves with the indenter from the time of contact on.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::{geometry::Geometry, grid::Support};

mod profile;

pub use profile::Profile;

/// Form of the head, before it is bounded by a cylinder.
#[derive(Clone, Debug, PartialEq)]
pub enum Head {
    /// `f = 0`, with a corner radius e at the edge R: `f = e − √(e² − (r − R + e)²)` for r > R − e.
    Flat {
        /// e \[R\]; 0 for a sharp edge.
        edge_radius: f64,
    },
    /// `f = r²/(2ρ)`.
    Paraboloid {
        /// ρ \[R\]
        nose_radius: f64,
    },
    /// `f = ρ − √(ρ² − r²)`, r ≤ ρ.
    Sphere {
        /// ρ \[R\]
        nose_radius: f64,
    },
    /// `f = slope·r`.
    Cone {
        /// Rise over run.
        slope: f64,
    },
    /// Points joined by a monotone cubic.
    Profile(Profile),
}

/// How a head first touches a flat surface, which is all that estimates and closed forms ask of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tip {
    /// With a flat face.
    Face,
    /// With a round tip of this radius of curvature ρ \[R\].
    Round(f64),
    /// With a point of this slope.
    Point(f64),
    /// In another way.
    Other,
}

impl Head {
    /// How it first touches a flat surface.
    pub fn tip(&self) -> Tip {
        match *self {
            Self::Flat { .. } => Tip::Face,
            Self::Paraboloid { nose_radius } | Self::Sphere { nose_radius } => Tip::Round(nose_radius),
            Self::Cone { slope } => Tip::Point(slope),
            Self::Profile(_) => Tip::Other,
        }
    }

    /// True if all points have the same depth.
    pub fn is_flat(&self) -> bool {
        *self == Self::Flat { edge_radius: 0.0 }
    }
}

/// A head and the radius of the cylinder that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    head: Head,
    radius: f64,
}

/// Averages over a part of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Average {
    /// Average of `max(0, w − f)` \[R\].
    pub penetration: f64,
    /// Fraction of the area with `f ≤ w`, 0 to 1: derivative of the penetration by w.
    pub fraction: f64,
}

/// Abscissae and weights of the four-point Gauss–Legendre rule on (−1, 1); \[AS\] Table 25.4. Exact to degree 7,
/// hence for a cubic profile times r.
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

impl Shape {
    /// A head bounded by `radius` \[R\]; `None` leaves it unbounded (a profile ends at its last point).
    pub fn new(head: Head, radius: Option<f64>) -> Self {
        let natural = match &head {
            Head::Profile(profile) => profile.last_radius(),
            Head::Sphere { nose_radius } => *nose_radius,
            Head::Flat { .. } | Head::Paraboloid { .. } | Head::Cone { .. } => f64::INFINITY,
        };
        Self { head, radius: radius.unwrap_or(natural).min(natural) }
    }

    /// Radius of the cylinder \[R\], infinite if unbounded.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Profile f(r) \[R\], infinite outside the cylinder.
    pub fn profile(&self, r: f64) -> f64 {
        // a node on the edge within rounding belongs to the punch
        if r > self.radius * (1.0 + 1e-12) { f64::INFINITY } else { self.head_depth(r) }
    }

    /// Radius out to which an indenter displaced by `depth` penetrates a flat surface \[R\].
    pub fn reach(&self, depth: f64) -> f64 {
        let free = match &self.head {
            _ if depth < 0.0 => 0.0,
            Head::Flat { edge_radius } => self.radius - edge_radius + arc_reach(*edge_radius, depth),
            Head::Paraboloid { nose_radius } => (depth / curvature(*nose_radius)).sqrt(),
            Head::Sphere { nose_radius } => arc_reach(*nose_radius, depth),
            Head::Cone { slope } => depth / slope,
            Head::Profile(profile) => profile.reach(depth),
        };
        free.min(self.radius)
    }

    /// Averages over a part of the surface, weighted by the area `r dr` (axisymmetric) or `dx` (plane).
    ///
    /// \[KA\] Eq. 10 integrated in time: a point moves with V0 from the moment `w = f(r)` on, so its displacement
    /// is `max(0, w − f)`; with `half_width` > 0 its average over depths `w ± half_width`, see [`ramp`]. The part is split
    /// where `w − f` is 0 or `± half_width`, at knots of the head and at kinks of the weight; the quadrature is exact to degree
    /// 7 on each piece.
    ///
    /// * `half_width`: half-width of the hat in depth \[R\]
    pub fn average(&self, depth: f64, half_width: f64, support: &Support, geometry: Geometry) -> Average {
        let (inner, outer) = support.ends();
        if inner == outer {
            let (penetration, fraction) = ramp(depth - self.profile(inner), half_width);
            return Average { penetration, fraction };
        }
        let weight = |r: f64| support.weight(r) * if geometry == Geometry::Axisymmetric { r } else { 1.0 };
        let (mut volume, mut area, mut whole) = (0.0, 0.0, 0.0);
        for ends in self.breakpoints(depth, half_width, support).windows(2) {
            let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
            for (x, w) in GAUSS {
                let r = middle + half * x;
                let share = w * half * weight(r);
                whole += share;
                if r < self.radius {
                    let (penetration, fraction) = ramp(depth - self.head_depth(r), half_width);
                    volume += share * penetration;
                    area += share * fraction;
                }
            }
        }
        Average { penetration: volume / whole, fraction: area / whole }
    }

    /// Radii, in ascending order, between which the integrand of [`Shape::average`] is smooth \[R\].
    fn breakpoints(&self, depth: f64, half_width: f64, support: &Support) -> Vec<f64> {
        let (inner, outer) = support.ends();
        let mut pieces = vec![inner, outer];
        pieces.extend(support.kinks());
        pieces.extend(Some(self.radius).filter(|&edge| edge > inner && edge < outer));
        pieces.extend(self.knots(inner, outer));
        pieces.sort_by(f64::total_cmp);
        let mut points = vec![inner];
        for ends in pieces.windows(2).filter(|ends| ends[1] > ends[0]) {
            let (mut from, to) = (ends[0], ends[1]);
            let (f_from, f_to) = (self.head_depth(from), self.head_depth(to));
            let offsets =
                if f_from <= f_to { [-half_width, 0.0, half_width] } else { [half_width, 0.0, -half_width] };
            for level in offsets.map(|offset| depth + offset) {
                if (f_from <= level) != (f_to <= level) && from < self.radius {
                    from = self.crossing(level, from, to);
                    points.push(from);
                }
            }
            points.push(to);
        }
        points
    }

    /// Smallest and largest profile depth in `inner ≤ r ≤ outer` \[R\], infinite outside the cylinder.
    pub fn depths(&self, inner: f64, outer: f64) -> (f64, f64) {
        if inner > self.radius {
            return (f64::INFINITY, f64::INFINITY);
        }
        let ends = (self.head_depth(inner), self.head_depth(outer.min(self.radius)));
        let (mut least, mut most) = (ends.0.min(ends.1), ends.0.max(ends.1));
        for f in self.knots(inner, outer).map(|r| self.head_depth(r)) {
            (least, most) = (least.min(f), most.max(f));
        }
        // a node on the edge within rounding belongs to the punch
        if outer > self.radius * (1.0 + 1e-12) { (least, f64::INFINITY) } else { (least, most) }
    }

    /// Content of a body of finite radius a whose flat end is L behind its tip: volume `a²L − 2∫f r dr` \[πR³\], in the plane area of
    /// the half x ≥ 0, `aL − ∫f dx` \[R²\].
    ///
    /// Between corners and knots p, q of the head the substitution `r = p + (q − p)·sin θ` makes an arc that ends upright
    /// smooth; the error is below 1e-12 of the content.
    pub fn content(&self, length: f64, geometry: Geometry) -> f64 {
        const PANELS: usize = 16;
        let mut ends = vec![0.0, self.radius];
        ends.extend(self.knots(0.0, self.radius));
        ends.sort_by(f64::total_cmp);
        let half = FRAC_PI_2 / (2 * PANELS) as f64;
        let mut content = 0.0;
        for piece in ends.windows(2) {
            let width = piece[1] - piece[0];
            for panel in 0..PANELS {
                for (x, w) in GAUSS {
                    let (sin, cos) = libm::sincos(half * ((2 * panel + 1) as f64 + x));
                    let r = piece[0] + width * sin;
                    let weight = if geometry == Geometry::Axisymmetric { 2.0 * r } else { 1.0 };
                    content += w * half * width * cos * weight * (length - self.head_depth(r));
                }
            }
        }
        content
    }

    /// True if all points have the same depth.
    pub fn is_flat(&self) -> bool {
        self.head.is_flat()
    }

    /// Radii between `inner` and `outer` at which the head is not smooth, or turns \[R\].
    fn knots(&self, inner: f64, outer: f64) -> impl Iterator<Item = f64> {
        let (profile, corner) = match &self.head {
            Head::Profile(profile) => (Some(profile.knots()), None),
            Head::Flat { edge_radius } => (None, Some(self.radius - edge_radius)),
            Head::Sphere { .. } | Head::Paraboloid { .. } | Head::Cone { .. } => (None, None),
        };
        profile.into_iter().flatten().chain(corner).filter(move |&r| r > inner && r < outer)
    }

    /// Radius of the corner at the edge \[R\]; 0 if it is sharp.
    pub fn corner_radius(&self) -> f64 {
        match self.head {
            Head::Flat { edge_radius } => edge_radius,
            Head::Sphere { nose_radius } if nose_radius == self.radius => nose_radius,
            Head::Sphere { .. } | Head::Paraboloid { .. } | Head::Cone { .. } | Head::Profile(_) => 0.0,
        }
    }

    /// Radius of the flat face that touches in the first instant \[R\]; 0 under a tip.
    pub fn face_radius(&self) -> f64 {
        match &self.head {
            Head::Flat { edge_radius } => self.radius - edge_radius,
            Head::Profile(profile) => profile.face_radius().min(self.radius),
            Head::Sphere { .. } | Head::Paraboloid { .. } | Head::Cone { .. } => 0.0,
        }
    }

    /// True if the contact begins at a rounded tip, spreads and turns back; under a flat face it begins everywhere, and a cone has no
    /// length at which it would turn by itself.
    pub fn spreads(&self) -> bool {
        match &self.head {
            Head::Sphere { .. } | Head::Paraboloid { .. } => true,
            Head::Profile(profile) => profile.is_rounded(),
            Head::Flat { .. } | Head::Cone { .. } => false,
        }
    }

    /// Profile of the head alone, as if it were unbounded \[R\].
    fn head_depth(&self, r: f64) -> f64 {
        match &self.head {
            Head::Flat { edge_radius } => arc(*edge_radius, r - self.radius + edge_radius),
            Head::Paraboloid { nose_radius } => curvature(*nose_radius) * r * r,
            Head::Sphere { nose_radius } => arc(*nose_radius, r),
            Head::Cone { slope } => slope * r,
            Head::Profile(profile) => profile.at(r),
        }
    }

    /// Radius between `from` and `to` at which the head, monotone there, has the depth `depth`.
    fn crossing(&self, depth: f64, from: f64, to: f64) -> f64 {
        let exact = match &self.head {
            Head::Profile(profile) => profile.crossing(depth, from, to),
            Head::Flat { .. } | Head::Paraboloid { .. } | Head::Sphere { .. } | Head::Cone { .. } => {
                self.reach(depth)
            }
        };
        exact.clamp(from, to)
    }
}

/// Largest depth \[R\] of a ball that strikes a half-space, each moment as if at rest (Hertz): `½MV0² = (8/15π)·E*·√ρ·w^(5/2)`.
///
/// * `energy`: ½MV0² \[πγR³c_p²\]
/// * `nose_radius`: ρ \[R\]
/// * `modulus`: E* \[γc_p²\]
pub fn hertz_depth(energy: f64, nose_radius: f64, modulus: f64) -> f64 {
    libm::pow(energy * 15.0 * PI / (8.0 * modulus * nose_radius.sqrt()), 0.4)
}

/// Time of contact of such a ball \[R/c_p\]: Johnson, *Contact mechanics* (1985), Eq. 11.24.
///
/// * `depth`: the largest \[R\]
/// * `velocity`: V0 \[c_p\]
pub fn hertz_duration(depth: f64, velocity: f64) -> f64 {
    2.9433 * depth / velocity
}

/// Factor of r² of a paraboloid, 1/(2ρ) \[1/R\].
fn curvature(nose_radius: f64) -> f64 {
    0.5 / nose_radius
}

/// Depth of an arc of radius ρ beside its lowest point, `ρ − √(ρ² − x²)`, without the loss of digits of that difference; 0 for
/// x ≤ 0, ρ for x ≥ ρ.
fn arc(rho: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let x = x.min(rho);
    x * x / (rho + ((rho - x) * (rho + x)).sqrt())
}

/// Distance beside the lowest point at which an arc has a depth, `√(f(2ρ − f))`.
fn arc_reach(rho: f64, depth: f64) -> f64 {
    let depth = depth.min(rho);
    (depth * (2.0 * rho - depth)).sqrt()
}

/// Hat-weighted average of `max(0, d + s)` over `|s| < half_width`, and its derivative by d:
///
/// ```text
/// h = half_width, x = d/h:   h·(1 + x)³/6  for −1 < x < 0      h·(x + (1 − x)³/6)  for 0 < x < 1
/// ```
fn ramp(d: f64, half_width: f64) -> (f64, f64) {
    if d >= half_width {
        (d, 1.0)
    } else if d <= -half_width {
        (0.0, 0.0)
    } else if d < 0.0 {
        let x = 1.0 + d / half_width;
        (half_width * x * x * x / 6.0, 0.5 * x * x)
    } else {
        let x = 1.0 - d / half_width;
        (d + half_width * x * x * x / 6.0, 1.0 - 0.5 * x * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> Vec<Shape> {
        let profile = Profile::new(&[[0.0, 0.0], [0.3, 0.05], [0.7, 0.2], [1.5, 0.9]]).expect("valid points");
        vec![
            Shape::new(Head::Flat { edge_radius: 0.0 }, Some(1.0)),
            Shape::new(Head::Flat { edge_radius: 0.3 }, Some(1.0)),
            Shape::new(Head::Paraboloid { nose_radius: 1.0 }, None),
            Shape::new(Head::Sphere { nose_radius: 1.0 }, None),
            Shape::new(Head::Sphere { nose_radius: 1.5 }, Some(1.0)),
            Shape::new(Head::Cone { slope: 0.25 }, Some(1.0)),
            Shape::new(Head::Profile(profile), Some(1.0)),
        ]
    }

    #[test]
    fn averages_agree_with_a_fine_sum() {
        for shape in shapes() {
            for geometry in [Geometry::Axisymmetric, Geometry::Plane] {
                let cell = |inner, outer| Support::Cell { inner, outer };
                let hat = |middle, width| Support::Hat { middle, width };
                for support in [
                    cell(0.0, 0.1),
                    cell(0.25, 0.45),
                    cell(0.9, 1.1),
                    cell(1.2, 1.3),
                    hat(0.05, 0.1),
                    hat(0.35, 0.1),
                    hat(0.95, 0.3),
                ] {
                    let depth = 0.07;
                    let got = shape.average(depth, 0.0, &support, geometry);
                    let (inner, outer) = support.ends();
                    let (n, mut volume, mut area, mut whole) = (200_000, 0.0, 0.0, 0.0);
                    for m in 0..n {
                        let r = inner + (outer - inner) * (m as f64 + 0.5) / n as f64;
                        let weight = if geometry == Geometry::Axisymmetric { r } else { 1.0 };
                        let weight = weight * support.weight(r);
                        let penetration = depth - shape.profile(r);
                        whole += weight;
                        if penetration > 0.0 {
                            volume += weight * penetration;
                            area += weight;
                        }
                    }
                    assert!((got.penetration - volume / whole).abs() < 1e-6, "{shape:?} {support:?} {got:?}");
                    assert!((got.fraction - area / whole).abs() < 2e-5, "{shape:?} {support:?} {got:?}");
                }
            }
        }
    }

    #[test]
    fn half_width_averages_over_depths() {
        for shape in shapes() {
            for (support, depth) in [
                (Support::Hat { middle: 0.05, width: 0.1 }, 0.004),
                (Support::Hat { middle: 0.35, width: 0.1 }, 0.06),
                (Support::Cell { inner: 0.9, outer: 1.1 }, 0.4),
                (Support::Point(0.4), 0.09),
            ] {
                let half_width = 0.03;
                let got = shape.average(depth, half_width, &support, Geometry::Axisymmetric);
                let (n, mut penetration, mut fraction) = (2000, 0.0, 0.0);
                for m in 0..n {
                    let x = 2.0 * (f64::from(m) + 0.5) / f64::from(n) - 1.0;
                    let average =
                        shape.average(depth + x * half_width, 0.0, &support, Geometry::Axisymmetric);
                    let weight = (1.0 - x.abs()) * 2.0 / f64::from(n);
                    penetration += weight * average.penetration;
                    fraction += weight * average.fraction;
                }
                assert!(
                    (got.penetration - penetration).abs() < 1e-6,
                    "{shape:?} {support:?} {got:?} {penetration}"
                );
                assert!((got.fraction - fraction).abs() < 2e-3, "{shape:?} {support:?} {got:?} {fraction}");
            }
        }
    }

    #[test]
    fn hat_keeps_long_waves_and_removes_aliases() {
        // transfer function sinc²(q/2): 1 − q²/12 for a long wave, a double zero at q = 2π, which aliases to a long one
        let passed = |q: f64| {
            let n = 4000;
            let x = |m: i32| 2.0 * (f64::from(m) + 0.5) / f64::from(n) - 1.0;
            (0..n).map(|m| (1.0 - x(m).abs()) * (q * x(m)).cos() * 2.0 / f64::from(n)).sum::<f64>()
        };
        for q in [0.05, 0.1, 0.2_f64] {
            assert!((passed(q) - (1.0 - q * q / 12.0)).abs() < q.powi(4) / 300.0);
            let alias = passed(2.0 * PI + q);
            assert!(alias < (q / 6.0).powi(2), "{alias}");
        }
        // the ramp is the convolution of max(0, d) with a hat: its second derivative is the hat
        let (h, step) = (0.7, 1e-4);
        for d in [-0.6, -0.2, 0.1, 0.5] {
            let second = (ramp(d + step, h).0 - 2.0 * ramp(d, h).0 + ramp(d - step, h).0) / (step * step);
            assert!((second - (1.0 - f64::abs(d) / h) / h).abs() < 1e-5, "{d}: {second}");
        }
    }

    #[test]
    fn arcs_keep_their_digits() {
        let sphere = Shape::new(Head::Sphere { nose_radius: 2.0 }, None);
        assert_eq!((sphere.radius(), sphere.profile(2.0), sphere.profile(2.1)), (2.0, 2.0, f64::INFINITY));
        // ρ − √(ρ² − r²) = r²/(2ρ) + r⁴/(8ρ³) + …
        let r: f64 = 1e-4;
        assert!((sphere.profile(r) / (r * r / 4.0 + r.powi(4) / 64.0) - 1.0).abs() < 1e-15);
        let punch = Shape::new(Head::Flat { edge_radius: 0.2 }, Some(1.0));
        assert!(punch.profile(0.8) < 1e-30 && (punch.profile(1.0) - 0.2).abs() < 1e-15);
        assert!(!punch.is_flat() && Shape::new(Head::Flat { edge_radius: 0.0 }, Some(1.0)).is_flat());
        assert_eq!((punch.reach(0.0), punch.reach(0.2), punch.reach(1.0)), (0.8, 1.0, 1.0));
    }

    #[test]
    fn contents_are_those_of_known_bodies() {
        let straight = Profile::new(&[[0.0, 0.0], [1.0, 0.5]]).expect("points");
        let (flat, rounded) = (Head::Flat { edge_radius: 0.0 }, Head::Flat { edge_radius: 0.3 });
        let (cone, paraboloid) = (Head::Cone { slope: 0.5 }, Head::Paraboloid { nose_radius: 2.0 });
        let sphere = Head::Sphere { nose_radius: 1.0 };
        // of the spheres: a hemisphere on a cylinder of length 1, a cap of height ½ of a sphere of radius 1, π(3a² + h²)h/6
        for (head, radius, length, round, plane) in [
            (flat, Some(1.5), 2.0, Some(4.5), Some(3.0)),
            (cone, Some(1.5), 2.0, Some(4.5 - 2.25 * 0.75 * 2.0 / 3.0), Some(3.0 - 0.5 * 1.5 * 0.75)),
            (paraboloid, Some(1.0), 3.0, Some(3.0 - 0.125), Some(3.0 - 1.0 / 12.0)),
            (Head::Profile(straight), None, 2.0, Some(2.0 - 0.5 * 2.0 / 3.0), Some(2.0 - 0.25)),
            (sphere.clone(), None, 2.0, Some(1.0 + 2.0 / 3.0), Some(1.0 + 0.5 * FRAC_PI_2)),
            (sphere, Some(0.75_f64.sqrt()), 0.5, Some((3.0 * 0.75 + 0.25) * 0.5 / 6.0), None),
            (rounded, Some(1.0), 1.0, None, Some(1.0 - 0.09 * (1.0 - 0.5 * FRAC_PI_2))),
        ] {
            let shape = Shape::new(head, radius);
            for (geometry, expected) in [(Geometry::Axisymmetric, round), (Geometry::Plane, plane)] {
                let Some(expected) = expected else { continue };
                let content = shape.content(length, geometry);
                assert!((content / expected - 1.0).abs() < 1e-12, "{shape:?}: {content}, {expected}");
            }
        }
    }

    #[test]
    fn reach_inverts_the_profile() {
        for shape in shapes().into_iter().skip(1) {
            let r = shape.reach(0.1);
            assert!((shape.profile(r) - 0.1).abs() < 1e-12, "{shape:?}");
            assert_eq!(shape.reach(-1.0), 0.0);
        }
    }
}
