//! The scheme of the full theory of elasticity, derived once: collocated cells with minimised mesh dispersion.
//!
//! Both displacements, `u = u_z` and `v = u_r` (plane: u_x), stand on the nodes of the matched mesh. Cells lie between nodes, cell i
//! between columns i−1 and i with its middle at `ρ_i = iΔr`; cell 0 is the half cell between the axis and node 0. Its weight
//! is `w_i = 2ρ_iΔr`, `w_0 = (Δr/2)²` (plane Δr, Δr/2). With `e = u_{j+1} − u_j`, `D = q_i v_i − q'_i v_{i−1}`
//! (`q_i = c·r_i/ρ_i`, `q'_i = c·r_{i−1}/ρ_i`, `c = Δz/Δr ≤ 1`; plane `q = q' = c`) the strains of a cell between rows j and j+1
//! are, times Δz,
//!
//! ```text
//! ε = ½(e_{i−1} + e_i)        d = ½(D_j + D_{j+1})       axial strain; v_,r + v/r
//! g = ½c[(u_j + u_{j+1})_i − (…)_{i−1}] + ½[(v_{j+1} − v_j)_i + (…)_{i−1}]
//! a = ½(e_i − e_{i−1})        b = ½(D_{j+1} − D_j)       patterns that these do not see
//! W = Σ w_i/Δz·[½ε² + λεd + ½d² + ½µg² + ½k(a² + b²)]    µ = c_s², λ = 1 − 2µ
//! ```
//!
//! and Δt = Δz: everything else is the derivative of W, with half the mass of every cell at either of its columns. The hoop strain
//! needs no place in W: `−2µ·v_,r·(v/r)·r = −µ(v²)_,r` integrates to nothing at every depth. Boundaries of surface, backing (u = 0, free
//! of shear stress) and axis are natural: a row of cells is missing, and nothing else.
//!
//! Cell operators commute, so P and S waves decouple as in the continuum. With `x = sin²(q_z/2)`, `y = sin²(q_r/2)`, Δr = Δz,
//!
//! ```text
//! sin²(ω/2) = f + k·xy (P),  β²f + k·xy (S)      f = x(1 − y) + y(1 − x)
//! ```
//!
//! P waves along z and r are not dispersed, and `1 − f − k·xy ≥ 0` makes Δt = Δz ≤ Δr stable. The one free number
//! `k = min(4β²(2 − β²)/3, 0.6)` makes S waves at 45° fourth order; the limit keeps clear of that of the free surface, about 0.7.
//! Stability at the axis asks for the mass `3/2·Δr²` of v at node 0; u has 5/4 there, by lumping.
//!
//! # A free back
//!
//! lies half a row of cells below the last row J, see [`super::scheme`]: row J has a whole mass, and the half row below it moves with it as a membrane in
//! plane stress, `ε = −λd`, `g = 0`, with d of row J:
//!
//! ```text
//! W = … + ½·Σ w_i/Δz·½(1 − λ²)d²
//! ```
//!
//! so that along z it is the mirror `u_{J+1} = u_J`, and no eigenvalue is at the limit (`λ_max Δt²/4` 0.9944 to 0.9974 on 10 rows of 24 columns, β = 0.1 … 0.8).
//!
//! # Layers
//!
//! All of that is in units of the layer: its c_p, and `Z·Δt` for masses and stiffnesses of its cells. A layer by itself is a plate with free
//! faces; at an interface u, and v if it is welded, have the mean of both faces' accelerations, weighted by the impedances. If it
//! slides each face keeps its v. In units of the struck layer stresses of a layer have the factor `Z·c_p = Z·Δz/Δt`.
//!
//! # Lateral damping
//!
//! `u^{k+1} −= 4σ·E_r²(u^k − u^{k−1})`, the same for v (odd about the axis), with E_r of [`super::scheme`] at λ = 1, `E_r ~ y(1 − y)`: 0 for
//! fronts along z, fifth order for the rest. (E_r alone, third order, is a viscosity: it takes a quarter of a Rayleigh pulse of 60 nodes
//! over 100 nodes, and moves the edge of contact by 0.08 cells. Its square has the same strength at q_r = π/2 and does neither.) An edge of contact that passes nodes faster than shear waves run excites short waves along r that meet on the axis,
//! with an amplitude that hardly falls with the mesh; this damps them. Stable for `σ ≤ 2(1 − k)`, and over targets of c_s > 0.82 for less:
//! [`super::elastic::largest_damping`].
//!
//! # Node by node
//!
//! A node has cells above and below it, `a` and `b`. Its equations contain nothing but differences `Δ = b − a` and sums `Σ = b + a` of
//! what the columns have in both rows of cells ([`Column`]); strains twice themselves to save halves:
//!
//! ```text
//! normal = 2ΔS,  lean = 2(kΔa − cµΣg),  slip = 2Δg,  radial = 2Σ(λε + d) − 2kΔb        of cell i ([`Cell`]), sums over its columns
//! u: A·(normal + lean)_i + B·(normal − lean)_{i+1}       A = w_i/4m_i, B = w_{i+1}/4m_i (A_0 = w_0/2m_0)
//! v: A'·slip_i + B'·slip_{i+1} + Y·(radial_{i+1} − radial_i)       Y = c·r_iΔr/2m'_i
//! ```

use super::{
    Field,
    number::Number,
    scheme::{self, RadialWeights},
};
use crate::{geometry::Geometry, grid::Grid, material::Stiffness};

/// Constants of the material on a mesh, in units of its C33.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// `µ = C44`, of isotropic materials c_s² \[γc_p²\].
    pub shear: f64,
    /// `λ = C13`, of isotropic materials `1 − 2µ` \[γc_p²\].
    pub lame: f64,
    /// `A = C11`, of isotropic materials 1 \[γc_p²\].
    pub lateral: f64,
    /// k, of isotropic materials of both patterns; else k_a.
    pub hourglass: f64,
    /// k_b
    pub twist: f64,
    /// `c = Δz/Δr`
    pub courant: f64,
    /// `A − λ²`, stiffness of a membrane \[γc_p²\].
    pub membrane: f64,
    /// Twice C66 \[γc_p²\].
    pub twice_plane: f64,
    /// `C12 − C13`, 0 of isotropic materials \[γc_p²\].
    excess: f64,
}

impl Medium {
    /// * `courant`: `c = Δz/Δr`
    /// * `stiffness`: of an isotropic material, or for [`super::body`]
    pub fn new(courant: f64, stiffness: &Stiffness) -> Self {
        let Stiffness { lateral, coupled: lame, shear, plane } = *stiffness;
        let hourglass = |shear: f64| (4.0 * shear * (2.0 - shear) / 3.0).min(0.6);
        let excess = if stiffness.is_isotropic() { 0.0 } else { lateral - 2.0 * plane - lame };
        Self {
            shear,
            lame,
            lateral,
            hourglass: hourglass(shear),
            twist: lateral * hourglass(shear / lateral),
            courant,
            membrane: lateral - lame * lame,
            twice_plane: 2.0 * plane,
            excess,
        }
    }
}

/// Weights of a column: of the cell at its inner side, and of its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColumnWeights {
    /// Area w of the cell.
    pub cell: f64,
    /// q', of the inner column in the cell's D.
    pub inner: f64,
    /// q, of this column.
    pub outer: f64,
    /// Shares of the inner and this column in the hoop strain v/r in the middle of the cell, times Δz.
    pub hoop: [f64; 2],
    /// A and B: shares of the cells at the inner and outer side in u.
    pub axial: [f64; 2],
    /// A' and B', with µ.
    pub slip: [f64; 2],
    /// Y
    pub radial: f64,
}

/// Weights by column, shape `(nr + 1,)`: the last is that of the cell at the outer side of the outermost nodes, with no node of its own.
pub fn column_weights(grid: &Grid, medium: &Medium) -> Vec<ColumnWeights> {
    let Medium { courant, shear, .. } = *medium;
    let (dr, nr) = (grid.dr, grid.nr());
    let cell = |i: usize| match (grid.geometry, i) {
        (Geometry::Plane, 0) => 0.5 * dr,
        (Geometry::Plane, _) => dr,
        (Geometry::Axisymmetric, 0) => 0.25 * dr * dr,
        (Geometry::Axisymmetric, i) => 2.0 * i as f64 * dr * dr,
    };
    let weights = |i: usize| {
        let (outer, inner) = match (grid.geometry, i) {
            // D = 4c·v_0, plane 2c·v_0: nothing moves on the axis
            (Geometry::Plane, 0) => (2.0 * courant, 0.0),
            (Geometry::Axisymmetric, 0) => (4.0 * courant, 0.0),
            (Geometry::Plane, _) => (courant, courant),
            (Geometry::Axisymmetric, i) => {
                let i = i as f64;
                (courant * (i + 0.5) / i, courant * (i - 0.5) / i)
            }
        };
        // the rest of D is v_,r; on the axis v/r is v_,r
        let hoop = match (grid.geometry, i) {
            (Geometry::Plane, _) => [0.0; 2],
            (Geometry::Axisymmetric, 0) => [0.0, 0.5 * outer],
            (Geometry::Axisymmetric, _) => [courant - inner, outer - courant],
        };
        let weights = ColumnWeights { cell: cell(i), inner, outer, hoop, ..ColumnWeights::default() };
        let (Some(mass), Some(lateral_mass)) = (grid.area.get(i), lateral_area(grid, i)) else {
            return weights;
        };
        // the half cell counts whole: its other half is its image
        let share = if i == 0 { 0.5 } else { 0.25 };
        let width = match grid.geometry {
            Geometry::Axisymmetric => grid.r(i) * dr,
            Geometry::Plane => 0.5 * dr,
        };
        ColumnWeights {
            axial: [share * cell(i) / mass, 0.25 * cell(i + 1) / mass],
            slip: [share * shear * cell(i) / lateral_mass, 0.25 * shear * cell(i + 1) / lateral_mass],
            radial: 0.5 * courant * width / lateral_mass,
            ..weights
        }
    };
    (0..=nr).map(weights).collect()
}

/// Mass of v at nodes of column `i` per depth: that of u but at the axis, where stability asks for `3/2·Δr²`.
pub fn lateral_area(grid: &Grid, i: usize) -> Option<f64> {
    match (grid.geometry, i) {
        (Geometry::Axisymmetric, 0) => Some(1.5 * grid.dr * grid.dr),
        _ => grid.area.get(i).copied(),
    }
}

/// Radial weights of `√(4σ)·E_r` by column, shape `(nr,)`, of u and of v. At the axis they go with the masses there, so that the
/// operator is symmetric.
///
/// * `damping`: σ
pub fn damping_weights(grid: &Grid, damping: f64) -> [Vec<RadialWeights>; 2] {
    let weights = scheme::double_weights(grid, (4.0 * damping).sqrt() / 16.0);
    let area = grid.cell(0).1 * if grid.geometry == Geometry::Plane { 1.0 } else { grid.cell(0).1 };
    [grid.area.first().copied(), lateral_area(grid, 0)].map(|mass| {
        let share = mass.map_or(1.0, |mass| area / mass);
        let mut weights = weights.clone();
        if let Some(axis) = weights.first_mut() {
            axis.outward *= share;
            axis.inward *= share;
        }
        weights
    })
}

/// Constants of the material as operators use them.
#[derive(Clone, Copy, Debug)]
pub struct Constants<N> {
    lame: N,
    hourglass: N,
    courant: N,
    /// `cµ`
    shear: N,
    membrane: N,
}

impl Medium {
    /// The constants, as wide as a number.
    #[inline(always)]
    pub fn constants<N: Number>(&self, like: N) -> Constants<N> {
        Constants {
            lame: like.splat(self.lame),
            hourglass: like.splat(self.hourglass),
            courant: like.splat(self.courant),
            shear: like.splat(self.courant * self.shear),
            membrane: like.splat(self.membrane),
        }
    }
}

/// Difference below − above and sum of something in both rows of cells at a row of nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair<N = f64> {
    /// Δ
    pub difference: N,
    /// Σ
    pub sum: N,
}

/// What one column has in the two rows of cells at a row of nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Column<N = f64> {
    /// Of `u_{j+1} − u_j`.
    pub stretch: Pair<N>,
    /// Of `u_j + u_{j+1}`.
    pub sink: Pair<N>,
    /// Of `v_{j+1} − v_j`.
    pub tilt: Pair<N>,
    /// Of `v_j + v_{j+1}`.
    pub spread: Pair<N>,
}

/// Where a row of nodes is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Row {
    /// z = 0: no cells above.
    Surface,
    /// Cells above and below.
    Interior,
    /// z = h: no cells below.
    Backing,
    /// Half a row of cells above a free back: a membrane below.
    Membrane,
}

/// [`Pair`]s of differences and of sums of a displacement above, here and below.
#[inline(always)]
fn pairs<N: Number>(row: Row, [above, here, below]: [N; 3]) -> [Pair<N>; 2] {
    match row {
        Row::Interior => {
            let (ends, twice, across) = (above + below, here + here, below - above);
            [Pair { difference: ends - twice, sum: across }, Pair { difference: across, sum: ends + twice }]
        }
        Row::Surface => {
            let (difference, sum) = (below - here, here + below);
            let (difference, sum) = (difference + difference, sum + sum);
            [Pair { difference, sum: difference }, Pair { difference: sum, sum }]
        }
        Row::Backing => {
            let (difference, sum) = (here - above, above + here);
            let (difference, sum) = (difference + difference, sum + sum);
            let zero = here.splat(0.0);
            [Pair { difference: zero - difference, sum: difference }, Pair { difference: zero - sum, sum }]
        }
        Row::Membrane => {
            let (difference, sum) = (here - above, above + here);
            let zero = here.splat(0.0);
            [Pair { difference: zero - difference, sum: difference }, Pair { difference: zero - sum, sum }]
        }
    }
}

impl<N: Number> Column<N> {
    /// * `u`, `v`: displacements above, here and below; what is beyond a boundary is not used
    #[inline(always)]
    pub fn new(row: Row, u: [N; 3], v: [N; 3], constants: &Constants<N>) -> Self {
        let ([stretch, sink], [tilt, mut spread]) = (pairs(row, u), pairs(row, v));
        if matches!(row, Row::Membrane) {
            // λε + d = (1 − λ²)d below
            spread.sum = spread.sum.add_product(constants.membrane, v[1] + v[1]);
        }
        Self { stretch, sink, tilt, spread }
    }

    /// What it contributes to either of its cells.
    #[inline(always)]
    pub fn parts(&self, constants: &Constants<N>) -> Parts<N> {
        let Self { stretch, sink, tilt, spread } = *self;
        let Constants { lame, hourglass, .. } = *constants;
        Parts {
            stretch: stretch.difference,
            bend: hourglass * stretch.difference,
            normal: lame * stretch.sum,
            sink,
            tilt,
            spread: lame * spread.difference,
            flow: spread.sum.sub_product(hourglass, tilt.difference),
        }
    }
}

/// What a column contributes to a cell, but for the cell's weights and signs.
#[derive(Clone, Copy)]
pub struct Parts<N> {
    /// `Δ(u_{j+1} − u_j)`
    stretch: N,
    /// k times that.
    bend: N,
    /// λ times the sum of `u_{j+1} − u_j`.
    normal: N,
    sink: Pair<N>,
    tilt: Pair<N>,
    /// λ times the difference of `v_j + v_{j+1}`.
    spread: N,
    /// Σd − kΔb: both are D's of a column.
    flow: N,
}

impl<N: Number> Parts<N> {
    /// What it contributes to the cell at its inner side, as the outer column of that.
    ///
    /// * `q`: of the cell
    #[inline(always)]
    pub fn as_outer(&self, q: N, constants: &Constants<N>) -> Cell<N> {
        let Constants { courant, shear, .. } = *constants;
        let normal = self.stretch.add_product(q, self.spread);
        let lean = self.bend.sub_product(shear, self.tilt.sum.add_product(courant, self.sink.sum));
        Cell {
            to_inner: normal - lean,
            to_outer: normal + lean,
            slip: self.tilt.difference.add_product(courant, self.sink.difference),
            radial: self.normal.add_product(q, self.flow),
        }
    }

    /// What it contributes to the cell at its outer side, as the inner column of that: signs of q', c and k are turned.
    ///
    /// * `q`: q' of the cell
    #[inline(always)]
    pub fn as_inner(&self, q: N, constants: &Constants<N>) -> Cell<N> {
        let Constants { courant, shear, .. } = *constants;
        let normal = self.stretch.sub_product(q, self.spread);
        // −lean
        let lean = self.bend.add_product(shear, self.tilt.sum.sub_product(courant, self.sink.sum));
        Cell {
            to_inner: normal + lean,
            to_outer: normal - lean,
            slip: self.tilt.difference.sub_product(courant, self.sink.difference),
            radial: self.normal.sub_product(q, self.flow),
        }
    }
}

/// What a cell, with the one above it, gives to the nodes between them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell<N = f64> {
    /// `normal − lean`, to u in its inner column.
    pub to_inner: N,
    /// `normal + lean`, to u in its outer column.
    pub to_outer: N,
    /// `2Δg`
    pub slip: N,
    /// `2Σ(λε + d) − 2kΔb`
    pub radial: N,
}

impl<N: Number> Cell<N> {
    /// Of what both of its columns contribute.
    #[inline(always)]
    pub fn of(outer: &Self, inner: &Self) -> Self {
        Self {
            to_inner: outer.to_inner + inner.to_inner,
            to_outer: outer.to_outer + inner.to_outer,
            slip: outer.slip + inner.slip,
            radial: outer.radial + inner.radial,
        }
    }
}

/// `Δt²` times the acceleration of u and v at a node.
///
/// * `inner`, `outer`: cells at either side of it
/// * `axial`, `slip`, `radial`: see [`ColumnWeights`]
#[inline(always)]
pub fn accelerations<N: Number>(
    [inner, outer]: [&Cell<N>; 2],
    axial: [N; 2],
    slip: [N; 2],
    radial: N,
) -> [N; 2] {
    let sheared = (slip[0] * inner.slip).add_product(slip[1], outer.slip);
    [
        (axial[0] * inner.to_outer).add_product(axial[1], outer.to_inner),
        sheared.add_product(radial, outer.radial - inner.radial),
    ]
}

/// Displacement at level k+1 without damping.
#[inline(always)]
pub fn advanced<N: Number>(before: N, now: N, acceleration: N) -> N {
    now.twice_less(before) + acceleration
}

/// Strains at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strain {
    /// `ε = u_,z`
    pub axial: f64,
    /// `d = v_,r + v/r`, plane `v_,x`
    pub lateral: f64,
    /// `v/r`, plane 0
    pub hoop: f64,
    /// `g = u_,r + v_,z`
    pub shear: f64,
}

/// Stresses \[γc_p²\], tension positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// σ_zz
    pub zz: f64,
    /// σ_rr, plane σ_xx
    pub rr: f64,
    /// σ_θθ, plane σ_yy
    pub tt: f64,
    /// σ_rz
    pub rz: f64,
}

impl Strain {
    /// Mean over the cells around a node, weighted by their areas.
    ///
    /// * `columns`: at columns i−1, i, i+1
    /// * `weights`: of columns i, i+1
    /// * `hoop`: v/r, plane 0
    pub fn mean(
        columns: [&Column; 3],
        weights: [&ColumnWeights; 2],
        medium: &Medium,
        dz: f64,
        hoop: f64,
    ) -> Self {
        let total = weights[0].cell + weights[1].cell;
        let mut mean = Self { hoop, ..Self::default() };
        for (cell, weights) in weights.into_iter().enumerate() {
            let [inner, outer] = [columns[cell], columns[cell + 1]];
            let share = 0.25 * weights.cell / (total * dz);
            mean.axial += share * (inner.stretch.sum + outer.stretch.sum);
            mean.lateral += share * (weights.outer * outer.spread.sum - weights.inner * inner.spread.sum);
            let shift = medium.courant * (outer.sink.sum - inner.sink.sum);
            mean.shear += share * (shift + (inner.tilt.sum + outer.tilt.sum));
        }
        mean
    }

    /// On the surface, where `σ_zz = −p` and `σ_rz = 0`: `ε = −p − λd`.
    ///
    /// * `v`: at columns i−1, i, i+1
    /// * `weights`: of columns i, i+1
    /// * `pressure`: p \[γc_p²\]
    pub fn on_surface(
        v: [f64; 3],
        weights: [&ColumnWeights; 2],
        medium: &Medium,
        dz: f64,
        hoop: f64,
        pressure: f64,
    ) -> Self {
        let total = weights[0].cell + weights[1].cell;
        let lateral = weights.into_iter().enumerate().map(|(cell, weights)| {
            weights.cell / (total * dz) * (weights.outer * v[cell + 1] - weights.inner * v[cell])
        });
        let lateral = lateral.sum();
        Self { axial: -pressure - medium.lame * lateral, lateral, hoop, shear: 0.0 }
    }

    /// Strains between two places with these, at a share of the way.
    pub fn between(&self, other: &Self, share: f64) -> Self {
        let at = |from: f64, to: f64| (1.0 - share) * from + share * to;
        Self {
            axial: at(self.axial, other.axial),
            lateral: at(self.lateral, other.lateral),
            hoop: at(self.hoop, other.hoop),
            shear: at(self.shear, other.shear),
        }
    }

    /// The stresses, by Hooke's law with C33 = 1; of lateral strains `σ_rr = A(ε_rr + ε_θθ) − 2C66ε_θθ`, `σ_θθ = C12ε_rr + Aε_θθ`.
    pub fn stress(&self, medium: &Medium) -> Stress {
        let Self { axial, lateral, hoop, shear } = *self;
        let Medium { shear: mu, lame, lateral: a, twice_plane, excess, .. } = *medium;
        Stress {
            zz: axial + lame * lateral,
            rr: lame * axial + a * lateral - twice_plane * hoop,
            tt: lame * (axial + lateral) + excess * lateral + twice_plane * hoop,
            rz: mu * shear,
        }
    }

    /// The largest principal strain by magnitude where the shear strain is 0, as on surface and backing.
    pub fn largest_on_face(&self) -> f64 {
        self.axial.abs().max((self.lateral - self.hoop).abs()).max(self.hoop.abs())
    }
}

/// Principal values of a symmetric tensor in the r–z plane, the larger one first.
fn principal(zz: f64, rr: f64, rz: f64) -> [f64; 2] {
    let (middle, half) = (0.5 * (zz + rr), 0.5 * (zz - rr));
    let radius = (half * half + rz * rz).sqrt();
    [middle + radius, middle - radius]
}

impl Stress {
    /// What a field of stress shows.
    ///
    /// # Panics
    ///
    /// If the field is none of stress.
    #[inline(always)]
    pub fn shown(&self, field: Field) -> f64 {
        match field {
            Field::Stress => -self.zz,
            Field::StressRr => -self.rr,
            Field::StressTt => -self.tt,
            Field::StressRz => -self.rz,
            Field::Pressure => self.pressure(),
            Field::VonMises => self.von_mises(),
            Field::MaxShear => self.max_shear(),
            Field::Displacement
            | Field::DisplacementR
            | Field::Velocity
            | Field::VelocityR
            | Field::DamageRatio => {
                unreachable!("{field:?} is no stress")
            }
        }
    }

    /// The stress in another unit.
    pub fn times(&self, unit: f64) -> Self {
        let Self { zz, rr, tt, rz } = *self;
        Self { zz: unit * zz, rr: unit * rr, tt: unit * tt, rz: unit * rz }
    }

    /// Mean pressure `−(σ_zz + σ_rr + σ_θθ)/3`.
    pub fn pressure(&self) -> f64 {
        -(self.zz + self.rr + self.tt) / 3.0
    }

    /// Stress of von Mises.
    pub fn von_mises(&self) -> f64 {
        let Self { zz, rr, tt, rz } = *self;
        let differences = (zz - rr).powi(2) + (rr - tt).powi(2) + (tt - zz).powi(2);
        (0.5 * differences + 3.0 * rz * rz).sqrt()
    }

    /// First principal stress, the largest tension.
    pub fn first_principal(&self) -> f64 {
        principal(self.zz, self.rr, self.rz)[0].max(self.tt)
    }

    /// Largest shear stress, half the difference of the largest and the smallest principal stress (Tresca).
    pub fn max_shear(&self) -> f64 {
        let [first, second] = principal(self.zz, self.rr, self.rz);
        0.5 * (first.max(self.tt) - second.min(self.tt))
    }
}

/// Strains of a cell, times Δz: ε, d, g, a, b.
pub type CellStrains = [f64; 5];

/// Strains of a cell between two rows and two columns.
///
/// * `u`, `v`: displacements in the inner and the outer column, each in the upper and the lower row
/// * `weights`: of the outer column
pub fn cell_strains(
    u: [[f64; 2]; 2],
    v: [[f64; 2]; 2],
    weights: &ColumnWeights,
    medium: &Medium,
) -> CellStrains {
    let [inner, outer] = u.map(|[upper, lower]| lower - upper);
    let [upper, lower] = [0, 1].map(|row| weights.outer * v[1][row] - weights.inner * v[0][row]);
    let [inner_sink, outer_sink] = u.map(|[upper, lower]| upper + lower);
    let tilts = v.map(|[upper, lower]| lower - upper);
    let shear = 0.5 * medium.courant * (outer_sink - inner_sink) + 0.5 * (tilts[0] + tilts[1]);
    [0.5 * (inner + outer), 0.5 * (upper + lower), shear, 0.5 * (outer - inner), 0.5 * (lower - upper)]
}

/// The largest principal strain by magnitude in the middle of a cell, times 2Δz.
///
/// * `u`, `v`: displacements in the inner and the outer column, each in the upper and the lower row
/// * `lateral`, `hoop`: q' and q of the cell and its [`ColumnWeights::hoop`]
#[inline(always)]
pub fn largest_strain(
    [u0, u1]: [[f64; 2]; 2],
    [v0, v1]: [[f64; 2]; 2],
    lateral: [f64; 2],
    hoop: [f64; 2],
    courant: f64,
) -> f64 {
    let [spread0, spread1] = [v0[0] + v0[1], v1[0] + v1[1]];
    let axial = (u0[1] - u0[0]) + (u1[1] - u1[0]);
    let hoop = hoop[0] * spread0 + hoop[1] * spread1;
    let radial = (lateral[1] * spread1 - lateral[0] * spread0) - hoop;
    let shear = courant * ((u1[0] + u1[1]) - (u0[0] + u0[1])) + ((v0[1] - v0[0]) + (v1[1] - v1[0]));
    // ½(ε + ε_rr) ± √((½(ε − ε_rr))² + (½g)²), and v/r
    let (middle, half) = (0.5 * (axial + radial), 0.5 * (axial - radial));
    let in_section = middle.abs() + (half * half + 0.25 * (shear * shear)).sqrt();
    let hoop = hoop.abs();
    if hoop > in_section { hoop } else { in_section }
}

/// Strain energy of a cell between two levels, the product form of W that the scheme conserves \[πR³γc_p²\].
///
/// * `weight`: `w/Δz`
pub fn strain_energy(earlier: CellStrains, later: CellStrains, weight: f64, medium: &Medium) -> f64 {
    let Medium { shear, lame, lateral, hourglass, twist, .. } = *medium;
    let factors = [1.0, lateral, shear, hourglass, twist];
    let squares: f64 =
        factors.into_iter().enumerate().map(|(n, factor)| factor * earlier[n] * later[n]).sum();
    0.5 * weight * (squares + lame * (earlier[0] * later[1] + earlier[1] * later[0]))
}

/// Strain energy of the membrane above a free back between two columns, as [`strain_energy`].
///
/// * `spreads`: D of the row at both levels
pub fn membrane_energy([earlier, later]: [f64; 2], weight: f64, medium: &Medium) -> f64 {
    0.25 * weight * medium.membrane * earlier * later
}
