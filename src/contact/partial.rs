//! Partial contact: hat-weighted averages under an indenter whose contact spreads.

use crate::{
    geometry::Geometry,
    grid::{Grid, Support},
    shape::{Average, Shape},
};

/// Partial contact of one node of a surface at rest.
///
/// A contact that spreads has a moving edge, which a mesh does not resolve: nodes that come into contact one by one, and even
/// averages over cells, excite waves of grid frequency. The pattern `g(r, t)` of an edge that moves with v has the frequency
/// `ω = qv` at the wavenumber q. Sampling with Δr aliases wavenumbers `2π/Δr + q'` to `q'`, and sampling with Δt frequencies
/// `2π/Δt + ω'` to `ω'`: steep waves, which are reflected and meet on the axis with an amplitude that does not depend on the mesh.
/// The average over a cell has the transfer function `sinc(qΔr/2)`, whose zero at 2π/Δr is simple; the hat-weighted average
/// has its square, whose zero is double. So the displacement of a node is the average of `max(0, w − f)` with a hat in r (for
/// an edge slower than waves, which crosses less than one node per step) and a hat in depth of half-width `(3/2)V0·Δt` (for a
/// faster one, which crosses many). Resolved waves, `qΔr ≪ 1` and `ωΔt ≪ 1`, keep their amplitude up to
/// `(qΔr)²/12 + (3/2)²(ωΔt)²/12`, and their speed: the scheme does not change, nor does a node in full contact.
///
/// Where the surface has sunk ahead of a slow contact and the gap closes later, the same average is taken of the gap,
/// linear between nodes: see [`half_hat`].
///
/// A flat face, or a flat ring of a profile, comes into contact with all nodes at once, and on the paper's mesh nodes are points: there the average is
/// `w − f` itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartialContact {
    /// Support of the average displacement.
    support: Support,
    /// Cell on which the drag of a prescribed motion acts.
    cell: Support,
    /// Half-width of the hat in depth \[R\].
    half_width: f64,
    /// Smallest and largest profile depth of the support, infinite beyond the punch \[R\].
    f_min: f64,
    f_max: f64,
    /// Profile depth of the node in full contact: the average over the support, or that at the node if the punch ends
    /// in it \[R\].
    pub(super) mean: f64,
    /// True if the contact edge passes the node faster than waves run along the surface.
    pub(super) outruns: bool,
}

/// Half-width of the hat in depth relative to V0·Δt. With 1 the zeros of both hats leave waves at the frequency of node
/// crossings, which ring on the axis; with 3/2 they are ten times smaller.
pub(crate) const HALF_WIDTH: f64 = 1.5;

/// Share of the half-width that may be rounding.
const SLIVER: f64 = 1e-9;

impl PartialContact {
    /// * `half_width`: half-width of the hat in depth under a head that is not flat \[R\]
    /// * `slowness`: depth that the indenter moves while waves run along the surface by 1, V0/c_s
    pub(super) fn new(shape: &Shape, grid: &Grid, i: usize, half_width: f64, slowness: f64) -> Self {
        let (geometry, support) = (grid.geometry, grid.support(i));
        let (inner, outer) = grid.cell(i);
        let is_point = matches!(support, Support::Point(_));
        let cell = if is_point { support } else { Support::Cell { inner, outer } };
        let (inner, outer) = support.ends();
        let (f_min, f_max) = shape.depths(inner, outer);
        let outruns = f_max - f_min < slowness * (outer - inner);
        // at a depth of full contact the average shows the mean profile
        let mean = if f_max.is_finite() {
            f_max - shape.average(f_max, 0.0, &support, geometry).penetration
        } else {
            shape.profile(grid.r(i))
        };
        // of a ring that is flat all support comes into contact at once, as that of a flat face
        let is_flat = f_max - f_min <= SLIVER * half_width;
        let half_width = if is_point || shape.is_flat() || is_flat { 0.0 } else { half_width };
        Self { support, cell, half_width, f_min, f_max, mean, outruns }
    }

    /// True if the node is in full contact or in none, never in partial contact.
    pub(super) fn is_pointwise(&self) -> bool {
        self.half_width == 0.0 || self.f_max.is_infinite()
    }

    /// True if an indenter at `depth` is in full contact with the support, within the half-width.
    pub(super) fn is_full(&self, depth: f64) -> bool {
        depth - self.half_width >= self.f_max
    }

    /// Average displacement that an indenter at `depth` imposes on a surface at rest, and its derivative by depth.
    pub(super) fn average(&self, depth: f64, shape: &Shape, geometry: Geometry) -> Average {
        if depth + self.half_width < self.f_min + SLIVER * self.half_width {
            return Average { penetration: 0.0, fraction: 0.0 };
        }
        if self.is_full(depth) {
            return Average { penetration: depth - self.mean, fraction: 1.0 };
        }
        shape.average(depth, self.half_width, &self.support, geometry)
    }

    /// Share of the momentum that the pressure on the node gives to the indenter, whose motion is prescribed.
    ///
    /// * `fraction`: [`PartialContact::fraction`]
    pub(super) fn drag_share(&self, fraction: f64) -> f64 {
        // ahead of an edge that outruns waves nothing moves: what the average spreads over nodes there is pressure of the contact;
        // ahead of a slower one the surface is held, by pressure that is not the indenter's
        if self.outruns { 1.0 } else { fraction }
    }

    /// Fraction of the cell in contact with an indenter at `depth`.
    pub(super) fn fraction(&self, depth: f64, shape: &Shape, geometry: Geometry) -> f64 {
        if depth < self.f_min {
            0.0
        } else if self.is_full(depth) {
            1.0
        } else {
            shape.average(depth, 0.0, &self.cell, geometry).fraction
        }
    }
}

/// Average of `max(0, penetration)`, linear from `here` to `there`, over one half of a hat, from its middle to its end; and
/// the fraction of the hat where it is positive. The whole hat has the weight 1.
///
/// * `here`, `there`: penetration at the middle and at the end \[R\]
pub(super) fn half_hat(here: f64, there: f64) -> Average {
    // ∫_0^1 (1 − x)·max(0, here + (there − here)·x) dx
    let (penetration, fraction) = match (here > 0.0, there > 0.0) {
        (true, true) => (here / 3.0 + there / 6.0, 0.5),
        (false, false) => (0.0, 0.0),
        (true, false) => {
            let x = here / (here - there);
            (here * x * (0.5 - x / 6.0), x - 0.5 * x * x)
        }
        (false, true) => {
            let x = there / (there - here);
            (there * x * x / 6.0, 0.5 * x * x)
        }
    };
    Average { penetration, fraction }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_hat_is_the_weighted_average_of_the_positive_part() {
        for (here, there) in [(1.0, 2.0), (1.0, -0.5), (-0.3, 0.9), (-1.0, -2.0), (0.4, 0.0), (0.0, 0.7)] {
            let (n, mut penetration, mut fraction) = (20_000, 0.0, 0.0);
            for m in 0..n {
                let x = (f64::from(m) + 0.5) / f64::from(n);
                let value: f64 = here + (there - here) * x;
                let weight = (1.0 - x) / f64::from(n);
                penetration += weight * value.max(0.0);
                fraction += if value > 0.0 { weight } else { 0.0 };
            }
            let got = half_hat(here, there);
            assert!((got.penetration - penetration).abs() < 1e-6, "{here} {there}: {got:?} {penetration}");
            assert!((got.fraction - fraction).abs() < 1e-3, "{here} {there}: {got:?} {fraction}");
        }
    }
}
