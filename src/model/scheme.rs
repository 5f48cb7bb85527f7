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
//! # The mixed-derivative correction
//!
//! Exact along z and along r is not exact in between. With `A = sin²(q_z/2)`, `B = λ²·sin²(q_r/2)` the relation above is
//! `sin²(ω/2) = s = A + B − AB`, and at λ = 1 `(ω/2)² = (q_z/2)² + (q_r/2)² − (q_z q_r)²/48 + …`: oblique waves lag, most at
//! 45°, and a front that is not parallel to the mesh drags a tail of the shortest waves, with an overshoot that does not fall
//! with the mesh. One operator, 0 for every wave along z or along r, cures both:
//!
//! ```text
//! C = E_z·E_r  ~  A(1 − A)·B(1 − B)
//! u^{k+1} = (as above) − C[(4/3)·u^k + σ·(u^k − u^{k−1})]             0 ≤ σ ≤ 4/3
//! (E_z d)_j = (2d_j − d_{j−2} − d_{j+2})/16
//! (E_r d)_i = λ²/16·[W_{i−1}(d_i − d_{i−2}) − W_{i+1}(d_{i+2} − d_i)]/r̂_i
//! axisymmetric: r̂_i = i + ½, W_i = i(i+1)/(i+½);   plane: r̂_i = W_i = 1
//! ```
//!
//! Images stand beyond the surface (`d_{−j} = d_j`), the backing (`d_{J+j} = −d_{J−j}`) and the axis (`d_{−1−i} = d_i`); beyond
//! the outer radius d is 0. The first part makes the scheme fourth order in every direction, `sin²(ω/2) = s + C/3` and
//! `(ω/2)² = (q_z/2)² + (q_r/2)² + O(q⁶)`, and conserves an energy. The second takes out oblique waves that the mesh cannot
//! carry, at third order; it is all the dissipation there is. Stable for λ ≤ 1: `4(s + C/3) + 2σC ≤ 4` because
//! `(2/3 + σ)·AB ≤ 2`.
//!
//! Both parts are one stencil on one combination of two levels, `α·d = α·(u^k − ρ·u^{k−1})` ([`Corner`]); the factors α and
//! λ²/256 belong to its radial weights ([`corner_weights`]).
//!
//! # Rounding
//!
//! A product that is added to something is fused with the sum (`f64::mul_add`, rounded once) where the operators below and those of
//! [`super::cells`] say so: a part of the scheme's definition, on which its results depend in the last digits. It is the same number on every
//! machine; one without such an instruction gets it from a library, and is slow.
//!
//! # Layers
//!
//! Layers have `Δz_k = c_k·Δt`, so that a plane wave passes one row per step in each. The energy is a sum over cells between rows; those of a
//! layer have masses and stiffnesses in proportion to its impedance `Z_k = γ_k·c_k`, and λ_k. A layer by itself is a plate: free faces are
//! images, even about both. At an interface both displacements are one, with half the mass of a row of cells of either side, so that its acceleration
//! is the mean of what it would be on either plate alone ([`joined`]):
//!
//! ```text
//! u^{k+1} = [Z₁·u₁^{k+1} + Z₂·u₂^{k+1}]/(Z₁ + Z₂)
//! ```
//!
//! whose axial part, `2(Z₁u_{j−1} + Z₂u_{j+1})/(Z₁ + Z₂) − u^{k−1}`, has the coefficients of reflection and transmission of d'Alembert's
//! solution. E_z has no difference across an interface by that; one with a mean of weights there is not stable.
//!
//! # A free back
//!
//! lies half a row of cells below the last row J, `h = (J + ½)Δz`, a mirror of everything: `u_{J+1+j} = u_{J−j}` in every operator, with a
//! whole mass in row J. Plane waves stay exact, and images make the spectrum that of an endless mesh, with `q_z = nπ/(J + ½) < π` in a single
//! layer: `s + C/3 = 1 − (1 − A)(1 − B)(1 − AB/3)` is below 1, as A is.
//!
//! With row J on the face, as at a rigid back, the plate has free faces at rows 0 and J, and A = 1 at `q_z = π`: −1 is a double root, the rows of even
//! and of odd j + k are two lattices that move apart as rigid bodies do, linearly and without end, however small the kick; contact that opens and closes
//! kicks. Radial terms and damping act on means of rows and do not see it.
//!
//! [`interior`], [`axis`] and [`corner`] are the operators; [`image_row`] and [`image_column`] are the images that boundary
//! conditions and symmetry put beyond surface, backing and axis, so that the same operators hold there. Operators read nodes
//! through a closure `u(dj, di)`: the value dj rows below and di columns outside the node. [`super::reference`] steps with them as they stand; the fast engine carries sums
//! from node to node, and is tested to give the same bits. What both do is written once, for any [`Number`].

use serde::{Deserialize, Serialize};

use super::number::Number;
use crate::{geometry::Geometry, grid::Grid};

/// Radial weights of a column times `λ²/4`: the quarter belongs to the mean U.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialWeights<N = f64> {
    /// Of the face at larger radius; 0 in the outermost column, nothing crosses its face.
    pub outward: N,
    /// Of the face at smaller radius; 0 on the axis, where that face has no area.
    pub inward: N,
}

/// Order of accuracy for oblique waves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Order {
    /// The scheme of the paper.
    Second,
    /// With the conservative part of the mixed-derivative correction.
    Fourth,
}

impl From<Order> for u8 {
    fn from(order: Order) -> Self {
        match order {
            Order::Second => 2,
            Order::Fourth => 4,
        }
    }
}

impl TryFrom<u8> for Order {
    type Error = &'static str;

    fn try_from(number: u8) -> Result<Self, Self::Error> {
        match number {
            2 => Ok(Self::Second),
            4 => Ok(Self::Fourth),
            _ => Err("there is no scheme of this order"),
        }
    }
}

impl Order {
    /// Factor of u^k in the conservative part of the mixed-derivative correction.
    fn corner(self) -> f64 {
        match self {
            Self::Second => 0.0,
            Self::Fourth => 4.0 / 3.0,
        }
    }
}

/// The mixed-derivative correction: `C[α·(u^k − ρ·u^{k−1})]`, with `α = 4/3 + σ` (order 2: σ) and `ρ = σ/α`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// α
    pub factor: f64,
    /// ρ: share of the level before in the combination.
    pub share: f64,
}

impl Corner {
    /// The term for an order and a damping; `None` where it is 0.
    ///
    /// * `damping`: σ, 0 to 4/3
    ///
    /// # Panics
    ///
    /// If the scheme is not stable with that damping.
    pub fn new(order: Order, damping: f64) -> Option<Self> {
        assert!((0.0..=LARGEST_DAMPING).contains(&damping), "unstable: damping {damping}");
        let factor = order.corner() + damping;
        (factor > 0.0).then(|| Self { factor, share: damping / factor })
    }

    /// Levels of a field that a step needs in memory: without the term level k+1 may overwrite k−1, which it reads at the same
    /// node only.
    pub fn levels(corner: Option<&Self>) -> usize {
        if corner.is_some() { 3 } else { 2 }
    }
}

/// Largest damping σ that is stable at λ = 1.
pub const LARGEST_DAMPING: f64 = 4.0 / 3.0;

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

/// Radial weights of E_r times `λ²/256`, by column, shape `(nr,)`. That times α are the weights of the mixed-derivative correction.
///
/// * `c_s`: shear wave speed \[c_p\]
/// * `factor`: α
pub fn corner_weights(grid: &Grid, c_s: f64, factor: f64) -> Vec<RadialWeights> {
    let courant = radial_courant(grid, c_s);
    double_weights(grid, factor * courant * courant / 256.0)
}

/// Weights of the radial operator whose faces are one node away from a node, by column, shape `(nr,)`:
///
/// ```text
/// outward_i = scale·W_{i+1}/r̂_i       inward_i = scale·W_{i−1}/r̂_i
/// ```
///
/// Weights of areas, W_i = i + ½, are not stable at λ = 1; these are.
pub fn double_weights(grid: &Grid, scale: f64) -> Vec<RadialWeights> {
    let weights = |i: usize| match grid.geometry {
        Geometry::Plane => RadialWeights { outward: scale, inward: scale },
        Geometry::Axisymmetric => {
            let face = |i: f64| if i > 0.0 { i * (i + 1.0) / (i + 0.5) } else { 0.0 };
            let i = i as f64;
            let scaled = |face: f64| scale * face / (i + 0.5);
            RadialWeights { outward: scaled(face(i + 1.0)), inward: scaled(face(i - 1.0)) }
        }
    };
    (0..grid.nr()).map(weights).collect()
}

/// `16·E_z d` of a node: `2d_j − (d_{j−2} + d_{j+2})`.
#[inline(always)]
pub fn corner_axial<N: Number>(above: N, here: N, below: N) -> N {
    here.twice_less(above + below)
}

/// `outward·(outer − here) − inward·(here − inner)` over columns i−2, i, i+2. With the weights of the mixed-derivative correction, what it adds to
/// u^{k+1} of a node, `−α·E_z E_r d`; with those of the lateral damping, `−σ·E_r d`.
///
/// * `axial`: values at columns i−2, i, i+2, for the mixed-derivative correction `16·E_z d`
#[inline(always)]
pub fn double_radial<N: Number>(axial: [N; 3], weights: RadialWeights<N>) -> N {
    let [inner, here, outer] = axial;
    (weights.outward * (outer - here)).sub_product(weights.inward, here - inner)
}

/// `sum + outward·(outer − here) − inward·(here − inner)`.
///
/// * `values`: inner, here and outer
#[inline(always)]
pub fn add_radial<N: Number>(sum: N, values: [N; 3], weights: RadialWeights<N>) -> N {
    let [inner, here, outer] = values;
    sum.add_product(weights.outward, outer - here).sub_product(weights.inward, here - inner)
}

/// `sum − outward·(outer − here) + inward·(here − inner)`, as [`add_radial`].
#[inline(always)]
pub fn take_radial<N: Number>(sum: N, values: [N; 3], weights: RadialWeights<N>) -> N {
    let [inner, here, outer] = values;
    sum.sub_product(weights.outward, outer - here).add_product(weights.inward, here - inner)
}

/// Combination of levels that the mixed-derivative correction acts on, `u^k − ρ·u^{k−1}`.
#[inline(always)]
pub fn combined<N: Number>(share: N, before: N, now: N) -> N {
    now.sub_product(share, before)
}

/// What the mixed-derivative correction adds to u^{k+1} of a node.
///
/// * `d`: combination of levels around the node, with images
#[inline]
pub fn corner(d: impl Fn(isize, isize) -> f64, weights: RadialWeights) -> f64 {
    double_radial(corner_sums(d), weights)
}

/// u^{k+1} of a node with the mixed-derivative correction.
///
/// * `next`: without it
/// * `d`: combination of levels around the node, with images
#[inline]
pub fn corrected(next: f64, d: impl Fn(isize, isize) -> f64, weights: RadialWeights) -> f64 {
    add_radial(next, corner_sums(d), weights)
}

/// `16·E_z d` at columns i−2, i, i+2.
fn corner_sums(d: impl Fn(isize, isize) -> f64) -> [f64; 3] {
    [-2, 0, 2].map(|di| corner_axial(d(-2, di), d(0, di), d(2, di)))
}

/// `4·U_j = (u_{j−1} + u_{j+1}) + 2u_j`.
#[inline(always)]
pub fn quadruple_mean<N: Number>(above: N, here: N, below: N) -> N {
    (above + below).add_twice(here)
}

/// u^{k+1} of a node from its neighbours at level k and itself at level k−1.
///
/// * `ends`: `u_{j−1} + u_{j+1}`
/// * `means`: `4·U` at columns i−1, i, i+1
#[inline(always)]
pub fn advanced<N: Number>(ends: N, before: N, means: [N; 3], weights: RadialWeights<N>) -> N {
    add_radial(ends - before, means, weights)
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

/// Lower face of a layer by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// A rigid back, which is the last row.
    Rigid,
    /// An interface, at which the layer by itself is free: the last row.
    Interface,
    /// A free back, half a row of cells below the last row.
    Free,
}

/// Row whose displacement stands in row `j` of a layer, and the factor it stands there with.
///
/// - `σ = ∂u/∂z = 0` at z = 0 makes u even in z: `u_{−j} = u_j` (\[KA\] Eq. 19).
/// - `u = 0` at z = h makes u odd about it: `u_{J+j} = −u_{J−j}`; with it the scheme leaves row J at 0.
/// - `σ = 0` makes u even about the lower face: `u_{J+j} = u_{J−j}` at an interface, `u_{J+1+j} = u_{J−j}` at a free back.
///
/// * `last`: J
/// * `face`: the lower one
#[inline]
pub fn image_row(j: isize, last: usize, face: Face) -> (usize, f64) {
    let (mut j, mut sign) = (j.unsigned_abs(), 1.0);
    while j > last {
        // −j about the surface is j again
        (j, sign) = match face {
            Face::Rigid => ((2 * last).abs_diff(j), -sign),
            Face::Interface => ((2 * last).abs_diff(j), sign),
            Face::Free => ((2 * last + 1).abs_diff(j), sign),
        };
    }
    (j, sign)
}

/// Shares of the layers above and below an interface in the acceleration of its nodes: half the mass of a row of cells of either belongs to
/// them, `m = ½(Z₁ + Z₂)`.
///
/// * `impedances`: Z₁, Z₂
pub fn shares([upper, lower]: [f64; 2]) -> [f64; 2] {
    let sum = upper + lower;
    [upper / sum, lower / sum]
}

/// u^{k+1} at an interface, from what it would be at the free faces of the upper and the lower layer.
///
/// * `shares`: see [`shares`]
#[inline]
pub fn joined(shares: [f64; 2], faces: [f64; 2]) -> f64 {
    shares[0] * faces[0] + shares[1] * faces[1]
}

/// Stress −σ_zz between layers per difference of u^{k+1} at the free faces of the upper and the lower one \[γc_p²/R\]: what joins them
/// moves either face, with half the mass of a row of cells.
///
/// ```text
/// p = Z₁Z₂/(Z₁ + Z₂)·(u₁^{k+1} − u₂^{k+1})/(2Δt)
/// ```
///
/// It is [`interface_stress`] of the simplified theory.
pub fn traction_weight([upper, lower]: [f64; 2], dt: f64) -> f64 {
    upper * lower / (upper + lower) / (2.0 * dt)
}

/// Stress at an interface from those in the middle of the rows of cells above and below it. They differ from it by half the mass of their
/// cells times the acceleration that both share: `σ = (Z₂σ₁ + Z₁σ₂)/(Z₁ + Z₂)`.
///
/// * `shares`: see [`shares`]
#[inline]
pub fn interface_stress(shares: [f64; 2], cells: [f64; 2]) -> f64 {
    shares[1] * cells[0] + shares[0] * cells[1]
}

/// Column whose displacement stands in column `i` of a matched mesh: u is even in r, `u_{−1−i} = u_i`.
#[inline]
pub fn image_column(i: isize) -> usize {
    if i < 0 { (-1 - i) as usize } else { i as usize }
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
/// * `axial_differences`: `u_{j+1} − u_j` at either level
pub fn axial_energy(area: f64, axial_differences: [f64; 2], dz: f64) -> f64 {
    0.5 * area * axial_differences[0] * axial_differences[1] / dz
}

/// Strain energy between two levels of the face from column i to i+1, rows j to j+1: `½·c_s²·(Δz/Δr)·b·Δ_r ū^k·Δ_r ū^{k−1}`
/// with `ū = (u_j + u_{j+1})/2` \[πR³γc_p²\].
///
/// The mean in ū, taken twice, is the U of the scheme.
///
/// * `stiffness`: `c_s²·(Δz/Δr)·b`, with the weight b of the face
/// * `shear_differences`: `ū_{i+1} − ū_i` at either level
pub fn shear_energy(stiffness: f64, shear_differences: [f64; 2]) -> f64 {
    0.5 * stiffness * shear_differences[0] * shear_differences[1]
}

/// Strain energy between two levels of a cell from the conservative part of the mixed-derivative correction, `½·m·u^{k−1}·(4/3)·C u^k/Δt²`
/// \[πR³γc_p²\].
///
/// * `mass`: `a·Δz`, on the surface half of it
/// * `added`: what that part adds to u at the next level, `−(4/3)·C u^k`
pub fn corner_energy(mass: f64, earlier: f64, added: f64, dt: f64) -> f64 {
    -0.5 * mass * earlier * added / (dt * dt)
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
    fn the_corner_term_makes_oblique_waves_fourth_order() {
        // sin²(ω/2) = s + C/3; without it the error of ω² falls as q⁴, with it as q⁶
        let lambda: f64 = 1.0;
        let error = |q: f64, order: Order| {
            let corner = Corner::new(order, 0.0);
            let q = [q, 0.8 * q];
            let level = |dj: isize, di: isize| (q[0] * dj as f64).cos() * (q[1] * di as f64).cos();
            let weight = 0.25 * lambda * lambda;
            let weights = RadialWeights { outward: weight, inward: weight };
            let added = corner.map_or(0.0, |Corner { factor, .. }| {
                let weight = factor * lambda * lambda / 256.0;
                super::corner(level, RadialWeights { outward: weight, inward: weight })
            });
            // u^{k+1} + u^{k−1} = 2cos(ω)·u^k
            let omega = (0.5 * (interior(level, 0.0, weights) + added)).acos();
            omega * omega - (q[0] * q[0] + q[1] * q[1])
        };
        for (order, falls) in [(Order::Second, 16.0), (Order::Fourth, 64.0)] {
            let ratio: f64 = error(0.4, order) / error(0.2, order);
            assert!((ratio / falls - 1.0).abs() < 0.1, "{order:?}: {ratio}");
        }
    }

    #[test]
    fn the_corner_term_leaves_waves_along_z_and_r_alone() {
        let weights = RadialWeights { outward: 0.013, inward: 0.013 };
        for q in [0.3, 1.0, 2.9] {
            assert_eq!(corner(|dj, _| (q * dj as f64 + 0.3).sin(), weights), 0.0);
            assert!(corner(|_, di| (q * di as f64 + 0.3).sin(), weights).abs() < 1e-16);
        }
    }

    #[test]
    fn boundaries_are_images() {
        // cos(q j) is even about the surface, sin(q (J − j)) odd about the backing, cos(q (J + ½ − j)) even about the free back
        let (q, backing) = (0.9, 3);
        let weights = RadialWeights { outward: 0.2, inward: 0.2 };
        let read = |shape: fn(f64) -> f64, from: isize, face: Face| {
            move |dj: isize, _: isize| {
                let (j, sign) = image_row(from + dj, backing, face);
                let to = if face == Face::Free { 3.5 } else { from as f64 };
                sign * shape(q * (j as f64 - to))
            }
        };
        let next = interior(read(f64::cos, 0, Face::Rigid), f64::cos(-q), weights);
        assert!((next - f64::cos(q)).abs() < 1e-15);
        assert_eq!(interior(read(f64::sin, 3, Face::Rigid), 0.0, weights), 0.0);
        assert_eq!(corner(read(f64::sin, 3, Face::Rigid), weights), 0.0);
        // a standing wave
        let before = f64::cos(0.5 * q) * f64::cos(q);
        let next = interior(read(f64::cos, 3, Face::Free), before, weights);
        assert!((next - before).abs() < 1e-15);
        // a layer of one row between both images
        let rows = |face| [-2, -1, 2, 3].map(|j| image_row(j, 1, face));
        assert_eq!(rows(Face::Rigid), [(0, -1.0), (1, 1.0), (0, -1.0), (1, -1.0)]);
        assert_eq!(rows(Face::Interface), [(0, 1.0), (1, 1.0), (0, 1.0), (1, 1.0)]);
        assert_eq!(rows(Face::Free), [(1, 1.0), (1, 1.0), (1, 1.0), (0, 1.0)]);
        assert_eq!([-2, -1, 0, 5].map(image_column), [1, 0, 0, 5]);
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
