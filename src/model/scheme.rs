//! The MDM scheme, derived once: scalar operators, each with its derivation.
//!
//! \[KA\] Eq. 21 (misprints corrected) steps `u_tt = u_zz + c_s²(u_rr + u_r/r)` on nodes `u_{j,i}` (row j, column i) with
//! Δt = Δz, Courant number 1 along z:
//!
//! ```text
//! u^{k+1} = 2u^k − u^{k−1} + (u_{j+1} − 2u_j + u_{j−1}) + λ²·Λ_r U       λ = c_s·Δt/Δr
//! U_j = (u_{j+1} + 2u_j + u_{j−1})/4                                     mean along z, in every radial term
//! Λ_r U at i = outward_i·(U_{i+1} − U_i) − inward_i·(U_i − U_{i−1})      conservative form
//! ```
//!
//! The terms in 2u^k cancel, which leaves
//!
//! ```text
//! u^{k+1} = (u_{j+1} + u_{j−1}) − u^{k−1} + λ²·Λ_r U
//! ```
//!
//! A plane wave with wave numbers q per node obeys
//!
//! ```text
//! sin²(ω/2) = sin²(q_z/2) + λ²·cos²(q_z/2)·sin²(q_r/2)
//! ```
//!
//! so nothing is dispersed along z, and for λ = 1 nothing along r either; it is stable for λ ≤ 1.
//!
//! [`interior`] and [`axis`] are the operators; [`surface`] and [`backing`] are the images that boundary conditions put beyond
//! rows 0 and J, so that the same operators hold there. Operators read nodes through a closure `u(dj, di)`: the value dj
//! rows below and di columns outside the node. [`super::reference`] steps with them as they stand; the fast engine repeats
//! their operations in the same order, and is tested to give the same bits.

use crate::grid::Grid;

/// Radial weights of a column times `λ²/4`: the quarter belongs to the mean U.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialWeights {
    /// Of the face at larger radius; 0 in the outermost column, nothing crosses its face.
    pub outward: f64,
    /// Of the face at smaller radius; 0 on the axis, where that face has no area.
    pub inward: f64,
}

/// Radial Courant number `λ = c_s·Δt/Δr`.
pub fn radial_courant(grid: &Grid, c_s: f64) -> f64 {
    c_s * grid.dt() / grid.dr
}

/// Radial weights by column, shape `(nr,)`, see [`Grid::radial_weights`].
///
/// * `c_s`: shear wave speed \[c_p\]
pub fn radial_weights(grid: &Grid, c_s: f64) -> Vec<RadialWeights> {
    let courant = radial_courant(grid, c_s);
    let scaled = |weight: f64| 0.25 * courant * courant * weight;
    let (outward, inward) = grid.radial_weights();
    let pairs = outward.into_iter().zip(inward);
    pairs.map(|(out, inw)| RadialWeights { outward: scaled(out), inward: scaled(inw) }).collect()
}

/// `4·U_j = (u_{j−1} + u_{j+1}) + 2u_j`.
#[inline]
pub fn quadruple_mean(above: f64, here: f64, below: f64) -> f64 {
    (above + below) + 2.0 * here
}

/// u^{k+1} of a node from its neighbours at level k and itself at level k−1.
///
/// * `ends`: `u_{j−1} + u_{j+1}`
/// * `means`: `4·U` at columns i−1, i, i+1
#[inline]
pub fn advanced(ends: f64, before: f64, means: [f64; 3], weights: RadialWeights) -> f64 {
    let [inner, here, outer] = means;
    let radial = weights.outward * (outer - here) - weights.inward * (here - inner);
    (ends - before) + radial
}

/// u^{k+1} of a node with neighbours on all sides: the scheme itself.
///
/// * `u`: level k around the node
/// * `before`: u^{k−1} of the node
#[inline]
pub fn interior(u: impl Fn(isize, isize) -> f64, before: f64, weights: RadialWeights) -> f64 {
    let mean = |di| quadruple_mean(u(-1, di), u(0, di), u(1, di));
    advanced(u(-1, 0) + u(1, 0), before, [mean(-1), mean(0), mean(1)], weights)
}

/// u^{k+1} of a node of column 0.
///
/// The inner face of its cell lies on the axis and has no area: the flux through it is 0, whatever stands inside.
///
/// ```text
/// λ²·Λ_r U at 0 = λ²·outward_0·(U_1 − U_0)        matched, axisymmetric: 2, plane: 1;  paper: 4 and 2
/// ```
#[inline]
pub fn axis(u: impl Fn(isize, isize) -> f64, before: f64, weights: RadialWeights) -> f64 {
    let mean = |di| quadruple_mean(u(-1, di), u(0, di), u(1, di));
    let here = mean(0);
    advanced(u(-1, 0) + u(1, 0), before, [here, here, mean(1)], RadialWeights { inward: 0.0, ..weights })
}

/// What operators read around a node of row 0 that is free of stress.
///
/// `σ = ∂u/∂z = 0` at z = 0 makes u even in z: `u_{−j} = u_j` (\[KA\] Eq. 19).
#[inline]
pub fn surface(u: impl Fn(isize, isize) -> f64) -> impl Fn(isize, isize) -> f64 {
    move |dj, di| u(dj.abs(), di)
}

/// What operators read around a node of row J, the backing.
///
/// `u = 0` at z = h makes u odd about it: `u_{J+j} = −u_{J−j}`; with it the scheme leaves row J at 0.
#[inline]
pub fn backing(u: impl Fn(isize, isize) -> f64) -> impl Fn(isize, isize) -> f64 {
    move |dj, di| if dj > 0 { -u(-dj, di) } else { u(dj, di) }
}

/// Displacement of a surface node per unit of pressure on it, `2Δt²/Δz` \[R/(γc_p²)\].
///
/// The half cell under the surface has the mass a·Δz/2: `a·p·Δt² = (a·Δz/2)·(u^{k+1} − u_free)`.
pub fn compliance(dt: f64, dz: f64) -> f64 {
    2.0 * dt * dt / dz
}

/// Stress −σ_zz = −∂u/∂z at level k, by central differences \[γc_p²\]. On the surface the pressure stands instead.
#[inline]
pub fn stress(above: f64, below: f64, dz: f64) -> f64 {
    (above - below) / (2.0 * dz)
}

/// Velocity at level k, `(u^{k+1} − u^{k−1})/(2Δt)` \[c_p\].
#[inline]
pub fn velocity(before: f64, next: f64, dt: f64) -> f64 {
    (next - before) / (2.0 * dt)
}

/// Kinetic energy of a cell between two levels, `½·m·((u^k − u^{k−1})/Δt)²` \[πR³γc_p²\].
///
/// * `mass`: `a·Δz`, on the surface half of it
/// * `moved`: `u^k − u^{k−1}`
pub fn kinetic_energy(mass: f64, moved: f64, dt: f64) -> f64 {
    0.5 * mass * moved * moved / (dt * dt)
}

/// Strain energy between two levels of the edge from row j to j+1 of a column, `½·(a/Δz)·Δ_z u^k·Δ_z u^{k−1}`
/// \[πR³γc_p²\].
///
/// The scheme conserves kinetic energy plus the strain energy in this form, the product of strains at both levels.
///
/// * `stretches`: `u_{j+1} − u_j` at either level
pub fn axial_energy(area: f64, stretches: [f64; 2], dz: f64) -> f64 {
    0.5 * area * stretches[0] * stretches[1] / dz
}

/// Strain energy between two levels of the face from column i to i+1, rows j to j+1: `½·c_s²·(Δz/Δr)·b·Δ_r ū^k·Δ_r ū^{k−1}`
/// with `ū = (u_j + u_{j+1})/2` \[πR³γc_p²\].
///
/// The mean in ū, taken twice, is the U of the scheme.
///
/// * `stiffness`: `c_s²·(Δz/Δr)·b`, with the weight b of the face
/// * `slides`: `ū_{i+1} − ū_i` at either level
pub fn shear_energy(stiffness: f64, slides: [f64; 2]) -> f64 {
    0.5 * stiffness * slides[0] * slides[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dispersion(q_z: f64, q_r: f64, lambda: f64) -> f64 {
        let (s, c, r) = ((q_z / 2.0).sin(), (q_z / 2.0).cos(), (q_r / 2.0).sin());
        2.0 * (s * s + lambda * lambda * c * c * r * r).sqrt().asin()
    }

    /// A plane wave at level k around the node where its phase is `phase`.
    fn wave(q: [f64; 2], omega: f64, phase: f64, k: f64) -> impl Fn(isize, isize) -> f64 {
        move |dj, di| (q[0] * dj as f64 + q[1] * di as f64 - omega * k + phase).cos()
    }

    #[test]
    fn a_plane_wave_obeys_the_dispersion_relation() {
        for lambda in [0.3, 0.5, 0.97, 1.0] {
            for q in [[0.0, 0.0], [0.4, 0.0], [0.0, 2.2], [1.7, 0.6], [3.0, 3.1]] {
                let omega = dispersion(q[0], q[1], lambda);
                let weight = 0.25 * lambda * lambda;
                let weights = RadialWeights { outward: weight, inward: weight };
                let level = |k| wave(q, omega, 0.7, k);
                let next = interior(level(0.0), level(-1.0)(0, 0), weights);
                assert!((next - level(1.0)(0, 0)).abs() < 1e-13, "λ = {lambda}, q = {q:?}");
                if lambda == 1.0 {
                    let product = (q[0] / 2.0).cos() * (q[1] / 2.0).cos();
                    assert!(((omega / 2.0).cos().powi(2) - product * product).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn boundaries_are_images() {
        // cos(q j) is even about the surface, sin(q (J − j)) odd about the backing
        let (q, omega) = (0.9, 0.9);
        let weights = RadialWeights { outward: 0.2, inward: 0.2 };
        let standing = |shape: fn(f64) -> f64| move |dj: isize, _: isize| shape(q * dj as f64);
        let known = |dj: isize, di: isize| {
            assert!(dj >= 0, "nothing stands above the surface");
            standing(f64::cos)(dj, di)
        };
        let next = interior(surface(known), f64::cos(-omega), weights);
        assert!((next - f64::cos(omega)).abs() < 1e-15);
        let known = |dj: isize, di: isize| {
            assert!(dj <= 0, "nothing stands below the backing");
            standing(f64::sin)(dj, di)
        };
        assert_eq!(interior(backing(known), 0.0, weights), 0.0);
        assert_eq!(stress(backing(known)(-1, 0), backing(known)(1, 0), 0.5), f64::sin(-q) / 0.5);
    }

    #[test]
    fn nothing_flows_through_the_axis() {
        let weights = RadialWeights { outward: 0.1, inward: 0.0 };
        let u = |dj: isize, di: isize| {
            assert!(di >= 0, "nothing stands inside the axis");
            1.0 + 0.3 * dj as f64 + 0.25 * (di * di) as f64
        };
        // 4U_1 − 4U_0 = 1
        assert!((axis(u, 1.0, weights) - 1.1).abs() < 1e-15);
    }
}
