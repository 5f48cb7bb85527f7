//! Indenter shapes: the profile `z = f(r)` of a rigid body, and what of a cell it has wetted.
//!
//! A shape knows nothing of meshes, motion or contact rules. Cell averages are those of the *prescribed* motion,
//! in which every point of the surface moves with the indenter from the moment it is reached.

use crate::grid::Geometry;

mod profile;

pub use profile::{Profile, ProfileError};

/// Form of the head, before it is bounded by a cylinder.
#[derive(Clone, Debug, PartialEq)]
pub enum Head {
    /// `f = 0`.
    Flat,
    /// `f = curvature·r²` with curvature V0/k \[1/R\].
    Paraboloid {
        /// Factor of r² \[1/R\].
        curvature: f64,
    },
    /// `f = slope·r` with slope V0/V*.
    Cone {
        /// Rise over run.
        slope: f64,
    },
    /// Points joined by a monotone cubic.
    Profile(Profile),
}

/// A head and the radius of the cylinder that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    head: Head,
    radius: f64,
}

/// What the indenter has done to one cell of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wetted {
    /// Mean of `max(0, w − f)` over the cell \[R\].
    pub penetration: f64,
    /// Share of the cell's area with `f ≤ w`, 0 to 1.
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
            _ => f64::INFINITY,
        };
        Self { head, radius: radius.unwrap_or(natural).min(natural) }
    }

    /// Radius of the cylinder \[R\], infinite if unbounded.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Profile f(r) \[R\], infinite outside the cylinder.
    pub fn profile(&self, r: f64) -> f64 {
        // a node that stands on the edge but for rounding belongs to the punch
        if r > self.radius * (1.0 + 1e-12) { f64::INFINITY } else { self.head_depth(r) }
    }

    /// Largest radius that an indenter displaced by `depth` can have reached on a flat surface \[R\].
    pub fn reach(&self, depth: f64) -> f64 {
        let free = match &self.head {
            _ if depth < 0.0 => 0.0,
            Head::Flat => f64::INFINITY,
            Head::Paraboloid { curvature } => (depth / curvature).sqrt(),
            Head::Cone { slope } => depth / slope,
            Head::Profile(profile) => profile.reach(depth),
        };
        free.min(self.radius)
    }

    /// Mean penetration and wetted share of the cell `inner < r < outer`, weighted by `r` (axisymmetric) or 1
    /// (plane).
    ///
    /// \[KA\] Eq. 10 integrated in time: a point moves with V0 from the moment `w = f(r)` on, so its displacement
    /// is `max(0, w − f)`. The integrals are exact for every head: the cell is split where `f = w` and at knots. A cell
    /// without width is a point.
    pub fn wetted(&self, depth: f64, inner: f64, outer: f64, geometry: Geometry) -> Wetted {
        if inner == outer {
            let wet = self.profile(inner) <= depth;
            let penetration = if wet { depth - self.profile(inner) } else { 0.0 };
            return Wetted { penetration, fraction: if wet { 1.0 } else { 0.0 } };
        }
        let weight = |r: f64| if geometry == Geometry::Axisymmetric { r } else { 1.0 };
        let (mut volume, mut area, mut whole) = (0.0, 0.0, 0.0);
        let mut add = |from: f64, to: f64, wet: bool| {
            let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
            for (x, w) in GAUSS {
                let r = middle + half * x;
                let share = w * half * weight(r);
                whole += share;
                if wet {
                    area += share;
                    volume += share * (depth - self.head_depth(r));
                }
            }
        };
        let edge = outer.min(self.radius).max(inner);
        let mut pieces = vec![inner];
        if let Head::Profile(profile) = &self.head {
            pieces.extend(profile.knots().filter(|&r| r > inner && r < edge));
        }
        pieces.push(edge);
        for ends in pieces.windows(2).filter(|ends| ends[1] > ends[0]) {
            let (from, to) = (ends[0], ends[1]);
            let (wet_from, wet_to) = (self.head_depth(from) <= depth, self.head_depth(to) <= depth);
            if wet_from == wet_to {
                add(from, to, wet_from);
            } else {
                let split = self.crossing(depth, from, to);
                add(from, split, wet_from);
                add(split, to, wet_to);
            }
        }
        if outer > edge {
            add(edge, outer, false);
        }
        Wetted { penetration: volume / whole, fraction: area / whole }
    }

    /// Smallest profile depth in `inner ≤ r ≤ outer` \[R\], infinite outside the cylinder.
    pub fn foremost(&self, inner: f64, outer: f64) -> f64 {
        if inner > self.radius {
            return f64::INFINITY;
        }
        let ends = self.head_depth(inner).min(self.head_depth(outer.min(self.radius)));
        match &self.head {
            Head::Profile(profile) => {
                profile.knots().filter(|&r| r > inner && r < outer).fold(ends, |f, r| f.min(profile.at(r)))
            }
            _ => ends,
        }
    }

    /// Profile of the head alone, as if it were unbounded \[R\].
    fn head_depth(&self, r: f64) -> f64 {
        match &self.head {
            Head::Flat => 0.0,
            Head::Paraboloid { curvature } => curvature * r * r,
            Head::Cone { slope } => slope * r,
            Head::Profile(profile) => profile.at(r),
        }
    }

    /// Radius between `from` and `to` at which the head, monotone there, has the depth `depth`.
    fn crossing(&self, depth: f64, from: f64, to: f64) -> f64 {
        let exact = match &self.head {
            Head::Flat => to,
            Head::Paraboloid { curvature } => (depth / curvature).sqrt(),
            Head::Cone { slope } => depth / slope,
            Head::Profile(profile) => profile.crossing(depth, from, to),
        };
        exact.clamp(from, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> Vec<Shape> {
        let profile = Profile::new(&[[0.0, 0.0], [0.3, 0.05], [0.7, 0.2], [1.5, 0.9]]).expect("valid points");
        vec![
            Shape::new(Head::Flat, Some(1.0)),
            Shape::new(Head::Paraboloid { curvature: 0.5 }, None),
            Shape::new(Head::Cone { slope: 0.25 }, Some(1.0)),
            Shape::new(Head::Profile(profile), Some(1.0)),
        ]
    }

    #[test]
    fn cell_averages_agree_with_a_fine_sum() {
        for shape in shapes() {
            for geometry in [Geometry::Axisymmetric, Geometry::Plane] {
                for (inner, outer) in [(0.0, 0.1), (0.25, 0.45), (0.9, 1.1), (1.2, 1.3)] {
                    let depth = 0.07;
                    let got = shape.wetted(depth, inner, outer, geometry);
                    let (n, mut volume, mut area, mut whole) = (200_000, 0.0, 0.0, 0.0);
                    for m in 0..n {
                        let r = inner + (outer - inner) * (m as f64 + 0.5) / n as f64;
                        let weight = if geometry == Geometry::Axisymmetric { r } else { 1.0 };
                        let penetration = depth - shape.profile(r);
                        whole += weight;
                        if penetration > 0.0 {
                            volume += weight * penetration;
                            area += weight;
                        }
                    }
                    assert!((got.penetration - volume / whole).abs() < 1e-6, "{shape:?} {inner} {got:?}");
                    assert!((got.fraction - area / whole).abs() < 1e-5, "{shape:?} {inner} {got:?}");
                }
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
