//! How nodes are met by an indenter whose contact spreads: means that a mesh can carry.

use crate::{
    grid::{Geometry, Grid, Support},
    shape::{Shape, Wetted},
};

/// How the indenter meets one node of a surface at rest.
///
/// A contact that spreads has a moving edge, which a mesh cannot carry: if nodes are struck one by one, or even if they take
/// the mean over their cells, waves of grid frequency appear. The pattern `g(r, t)` of an edge that moves with v has the
/// frequency `ω = qv` at the wavenumber q. Sampled with Δr, wavenumbers `2π/Δr + q'` look like `q'`, and with Δt, frequencies
/// `2π/Δt + ω'` like `ω'`: the mesh takes them for steep waves. They run down, are reflected and meet on the axis with an
/// amplitude that does not depend on the mesh. A mean over a cell has the transfer function `sinc(qΔr/2)`, zero at 2π/Δr but
/// steep there; a mean with the weight of a hat has its square, which is flat there. So a node takes the mean of
/// `max(0, w − f)` over a hat in r (an edge slower than waves crosses less than one node per step) and over a hat in
/// depth of half-width `V0·Δt` (a faster one crosses many). Waves that the mesh carries, `qΔr ≪ 1` and `ωΔt ≪ 1`, keep their
/// amplitude but for `(qΔr)²/12 + (ωΔt)²/12`, and their speed: the scheme is not touched, nor anything once the node
/// is wholly wetted.
///
/// Where the surface has sunk ahead of a slow contact and closes on the indenter later, the same is done with the gap
/// between them, linear between nodes: see [`closing`].
///
/// A flat face meets all nodes at once, and on the paper's mesh nodes are points: there the mean is `w − f` itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// What the displacement is the mean over.
    support: Support,
    /// What the drag of a prescribed motion acts on.
    cell: Support,
    /// Half-width of the hat in depth \[R\].
    pub(super) blur: f64,
    /// Smallest and largest profile depth of the support, infinite beyond the punch \[R\].
    pub(super) foremost: f64,
    pub(super) hindmost: f64,
    /// Profile depth that the node stands for once it is wetted: the mean over the support, or that at the node if the
    /// punch ends in it \[R\].
    pub(super) mean: f64,
}

/// Share of `blur` that may be rounding.
const SLIVER: f64 = 1e-9;

impl Meeting {
    /// * `blur`: V0·Δt \[R\]
    pub(super) fn new(shape: &Shape, grid: &Grid, i: usize, geometry: Geometry, blur: f64) -> Self {
        let support = grid.support(i);
        let (inner, outer) = grid.cell(i);
        let point = matches!(support, Support::Point(_));
        let cell = if point { support } else { Support::Cell { inner, outer } };
        let (inner, outer) = support.ends();
        let (foremost, hindmost) = shape.depths(inner, outer);
        // a depth at which all of the support is wetted shows the mean
        let mean = if hindmost.is_finite() {
            hindmost - shape.wetted(hindmost, 0.0, &support, geometry).penetration
        } else {
            shape.profile(grid.r(i))
        };
        Self {
            support,
            cell,
            blur: if point || shape.is_flat() { 0.0 } else { blur },
            foremost,
            hindmost,
            mean,
        }
    }

    /// True if the indenter has wetted all of the support, before and after this time.
    pub(super) fn is_whole(&self, depth: f64) -> bool {
        depth - self.blur >= self.hindmost
    }

    /// Mean displacement that an indenter at `depth` gives to a surface at rest, and its derivative by depth.
    pub(super) fn at(&self, depth: f64, shape: &Shape, geometry: Geometry) -> Wetted {
        if depth + self.blur < self.foremost + SLIVER * self.blur {
            return Wetted { penetration: 0.0, fraction: 0.0 };
        }
        if self.is_whole(depth) {
            return Wetted { penetration: depth - self.mean, fraction: 1.0 };
        }
        shape.wetted(depth, self.blur, &self.support, geometry)
    }

    /// Share of the cell that an indenter at `depth` has wetted.
    pub(super) fn share(&self, depth: f64, shape: &Shape, geometry: Geometry) -> f64 {
        if depth < self.foremost {
            0.0
        } else if self.is_whole(depth) {
            1.0
        } else {
            shape.wetted(depth, 0.0, &self.cell, geometry).fraction
        }
    }
}

/// Mean over one half of a hat, from its middle to its end, of a penetration that is linear there, where it is positive;
/// and the weight of that part. The whole hat has the weight 1.
///
/// * `here`, `there`: penetration at the middle and at the end \[R\]
pub(super) fn closing(here: f64, there: f64) -> Wetted {
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
    Wetted { penetration, fraction }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_is_the_mean_of_what_is_positive() {
        for (here, there) in [(1.0, 2.0), (1.0, -0.5), (-0.3, 0.9), (-1.0, -2.0), (0.4, 0.0), (0.0, 0.7)] {
            let (n, mut penetration, mut fraction) = (20_000, 0.0, 0.0);
            for m in 0..n {
                let x = (f64::from(m) + 0.5) / f64::from(n);
                let value: f64 = here + (there - here) * x;
                let weight = (1.0 - x) / f64::from(n);
                penetration += weight * value.max(0.0);
                fraction += if value > 0.0 { weight } else { 0.0 };
            }
            let got = closing(here, there);
            assert!((got.penetration - penetration).abs() < 1e-6, "{here} {there}: {got:?} {penetration}");
            assert!((got.fraction - fraction).abs() < 1e-3, "{here} {there}: {got:?} {fraction}");
        }
    }
}
