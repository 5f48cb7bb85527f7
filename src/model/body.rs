//! The scheme of [`super::cells`] on a mesh of any widths and heights, put together by rows of cells.
//!
//! The energy is that of [`super::cells`], with the time step of all rows and columns being one: a row of cells of height Δz_j in a layer with
//! speed c_p and impedance Z has the Courant number `C_j = c_pΔt/Δz_j ≤ 1`, and with `c_i = Δz_j/h_i`
//!
//! ```text
//! W = Σ Z C_j w_i·[½ε² + λεd + ½Ad² + ½µg² + ½k_a a² + ½k_b b²]        m_ji = ½Σ (Z/C_j)·½(w_i + w_{i+1})
//! ```
//!
//! (both times Δt), with the constants of a layer whose axis of symmetry is z, in units of C33: `A = C11`, `λ = C13`, `µ = C44`, `k_a = k(µ)`, `k_b = A·k(µ/A)`; C66 has no
//! place in it, see [`super::cells`]. Half the mass of every row of cells at either of its rows of nodes. With equal cells and C = 1 that is the scheme of [`super::cells`] but for rounding.
//!
//! A target that ends at a rim has its last nodes there, no cell beyond them, and half a cell's mass; on faces and interfaces, where a quarter of a cell
//! meets the rim, that counts twice (of second order: without it `λ_max Δt²/4` is up to 1.16 there), and columns are wide enough for `0.97h ≥ c_rΔt`, with the speed c_r
//! of longitudinal waves along r.
//!
//! There, without end nothing moves, the hoop term of the energy does not integrate to nothing: `−2C66∫v_,r(v/r)2r dr = −2C66v²` of the rim is part of W, with
//! the mean of v in both rows of cells. (Without it the rim is free of `λε + Ad` in place of σ_rr, and a rod of ν = 0.29 is 9 % too stiff.)
//!
//! Every weight is a number of the row times a number of the column. Rows are gone through once: the cells of a row give forces to the nodes
//! above, which are complete with what the cells over them have left, and leave those of the nodes below ([`March`]). Faces, interfaces and the back
//! are rows where cells are missing.
//!
//! # Lateral damping
//!
//! `E_r = A⁻¹GᵀWG` with `G_id = (d_{i+1} − d_{i−1})/4` and `W_i = min(a_{i−1}, a_{i+1})` of the areas of nodes, so that `E_r ≤ ¼` on every mesh: in the form of
//! [`scheme::double_radial`], `outward_i = W_{i+1}/16a_i`, `inward_i = W_{i−1}/16a_i`, with images about the axis. Waves stay in a wider cell for more
//! steps, each of which damps them: `W_i = √(h_0/h_i)·min(…)` there, so that E_r² takes as much per cell as where cells are h_0. (Without it a ball's pulse
//! lost a third over 160 mm of cells of 0.5 mm, h_0 of 3 µm.)

use std::ops::Range;

use super::{
    Coverage, Field, Sampling, TargetEnergy,
    blocked::{
        Instructions,
        dispatch::Work,
        lane::{BLOCK, Lane},
    },
    cells::{self, CellStrains, Medium, Strain, Stress},
    cone::LightCone,
    number::Number,
    reference::{Level, Levels, Reference, Scheme, motion},
    scheme::{self, RadialWeights},
    strength::Strength,
};
use crate::{
    geometry::Geometry,
    grid::{Back, Bond, Grid, Rim},
    material::Stiffness,
};

/// What a layer is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Impedance Z of longitudinal waves along z \[γc_p of the struck layer\].
    pub impedance: f64,
    /// Their speed \[c_p of the struck layer\].
    pub speed: f64,
    /// In units of `Z·speed`.
    pub stiffness: Stiffness,
}

/// A target on a mesh of any widths and heights.
#[derive(Clone, Debug)]
pub struct Body {
    grid: Grid,
    /// Layers from the surface down: constants, and the unit of stresses, Z·c_p \[γc_p²\].
    layers: Vec<(Medium, f64)>,
    /// Rows of cells by the row of nodes above them; the last row of a layer has none.
    rows: Vec<Option<Constants<f64>>>,
    /// Half the mass of every row of cells, per area and time step; 0 where there are none \[γc_p\].
    halves: Vec<f64>,
    /// Mass of u and of v by row of nodes, likewise.
    masses: [Vec<f64>; 2],
    columns: Columns,
    /// What is below the last row of nodes over a free back, and its hoops at a free rim.
    membrane: f64,
    hoop_below: f64,
    /// Mass of a rigid body that is bonded to the back, which moves with it \[πγR³; plane γR²\].
    weight: Option<f64>,
    /// What its layers bear.
    strengths: Vec<Strength>,
    instructions: Instructions,
}

/// Constants of a row of cells.
#[derive(Clone, Copy, Debug)]
struct Constants<N> {
    /// Δz
    height: N,
    /// `ZC/4`
    axial: N,
    /// `λΔz·ZC/4`
    coupled: N,
    /// `AΔz²·ZC/4`
    lateral: N,
    /// `µ·ZC/4`
    shear: N,
    /// `k_a·ZC/4`
    bend: N,
    /// `k_bΔz²·ZC/4`
    twist: N,
    /// `C66Δz²·ZC`, of v at a free rim.
    rim: N,
}

impl Constants<f64> {
    /// * `stiffness`: `ZC` of the row \[γc_p\]
    fn new(medium: &Medium, height: f64, stiffness: f64) -> Self {
        let quarter = 0.25 * stiffness;
        Self {
            height,
            axial: quarter,
            coupled: medium.lame * height * quarter,
            lateral: medium.lateral * height * height * quarter,
            shear: medium.shear * quarter,
            bend: medium.hourglass * quarter,
            twist: medium.twist * height * height * quarter,
            rim: 2.0 * medium.twice_plane * height * height * quarter,
        }
    }

    /// The constants, as wide as a number.
    #[inline(always)]
    fn wide<N: Number>(&self, like: N) -> Constants<N> {
        Constants {
            height: like.splat(self.height),
            axial: like.splat(self.axial),
            coupled: like.splat(self.coupled),
            lateral: like.splat(self.lateral),
            shear: like.splat(self.shear),
            bend: like.splat(self.bend),
            twist: like.splat(self.twist),
            rim: like.splat(self.rim),
        }
    }
}

/// Weights by column: of the cell at the inner side, and of the nodes; zeros fill a block beyond the last one.
#[derive(Clone, Debug)]
struct Columns {
    /// Numbers of each array that count, one more than there are nodes.
    cells: usize,
    /// `r_{i−1}/ρ_ih_i` and `r_i/ρ_ih_i`, of v in `d`; plane `1/h_i`.
    spread: [Vec<f64>; 2],
    /// `1/h_i`
    slope: Vec<f64>,
    /// w_i; that about the axis twice, as its image counts too.
    area: Vec<f64>,
    /// w_i times the first ones.
    flow: [Vec<f64>; 2],
    /// `1/a_i` of u and of v.
    node: [Vec<f64>; 2],
    /// The same on faces and interfaces: at a free rim half of it.
    face: [Vec<f64>; 2],
    /// Weights of `√(4σ)·E_r`, of u and of v, if there is damping.
    damping: Option<[RadialWeights<Vec<f64>>; 2]>,
    /// Shares of the inner and this column in the hoop strain in the middle of the cell.
    hoop: [Vec<f64>; 2],
    /// Share of the cell at the outer side of a node in means over both.
    share: Vec<f64>,
}

impl Columns {
    fn new(grid: &Grid, damping: f64) -> Self {
        let cells = grid.nr() + 1;
        let padded = (cells - 1).next_multiple_of(BLOCK) + 2 * BLOCK;
        let array = |of: &dyn Fn(usize) -> f64, count: usize| -> Vec<f64> {
            let mut numbers: Vec<f64> = (0..count).map(of).collect();
            numbers.resize(padded, 0.0);
            numbers
        };
        let is_plane = grid.geometry == Geometry::Plane;
        // nothing moves on the axis: D of the first cell is that of a slope from there
        let spread = |i: usize| match (i, is_plane) {
            // beyond a rim there is no cell
            (i, _) if grid.rim.is_some() && i == grid.nr() => [0.0; 2],
            (0, true) => [0.0, 2.0 / grid.width(0)],
            (0, false) => [0.0, 4.0 / grid.width(0)],
            (_, true) => [1.0 / grid.width(i); 2],
            (_, false) => {
                let (inner, width) = (grid.r(i - 1), grid.width(i));
                let middle = (inner + 0.5 * width) * width;
                [inner / middle, (inner + width) / middle]
            }
        };
        let hoop = |i: usize| match (i, is_plane) {
            (_, true) => [0.0; 2],
            (0, false) => [0.0, 0.5 * spread(0)[1]],
            (_, false) => [1.0 / grid.width(i) - spread(i)[0], spread(i)[1] - 1.0 / grid.width(i)],
        };
        let area = |i: usize| grid.cell_area(i);
        let last = grid.nr() - 1;
        // v at the axis has half a cell more, by stability, and no force moves it at a rim that is guided
        let node = |field: usize, i: usize| match grid.rim {
            Some(Rim::Guided) if field == 1 && i == last => f64::INFINITY,
            _ if field == 1 && i == 0 && !is_plane => grid.area[0] + area(0),
            _ => grid.area[i],
        };
        // a quarter of a cell at the corner counts as a half, by stability
        let face = |field: usize, i: usize| {
            let share = if grid.rim == Some(Rim::Free) && i == last { 2.0 } else { 1.0 };
            1.0 / (share * node(field, i))
        };
        let damping = (damping > 0.0).then(|| {
            [0, 1].map(|field| {
                let scale = (4.0 * damping).sqrt() / 16.0;
                let least = |i: usize| {
                    // at the axis the image of node 0 is its inner neighbour; nothing moves beyond the last
                    let outer = if i + 1 < grid.nr() { node(field, i + 1) } else { return 0.0 };
                    let share = (grid.width(0) / grid.width(i)).sqrt().min(1.0);
                    share * node(field, i.saturating_sub(1)).min(outer)
                };
                RadialWeights {
                    outward: array(&|i| scale * least(i + 1) / node(field, i), cells - 1),
                    inward: array(&|i| scale * least(i.saturating_sub(1)) / node(field, i), cells - 1),
                }
            })
        });
        Self {
            cells,
            spread: [0, 1].map(|side| array(&|i| spread(i)[side], cells)),
            slope: array(&|i| if area(i) > 0.0 { 1.0 / grid.width(i) } else { 0.0 }, cells),
            area: array(&|i| if i == 0 { 2.0 * area(0) } else { area(i) }, cells),
            flow: [0, 1].map(|side| array(&|i| area(i) * spread(i)[side], cells)),
            node: [0, 1].map(|field| array(&|i| 1.0 / node(field, i), cells - 1)),
            face: [0, 1].map(|field| array(&|i| face(field, i), cells - 1)),
            damping,
            hoop: [0, 1].map(|side| array(&|i| hoop(i)[side], cells)),
            share: array(&|i| area(i + 1) / (area(i) + area(i + 1)), cells - 1),
        }
    }
}

/// Weights of a cell, or of neighbouring ones.
#[derive(Clone, Copy)]
struct Weights<N> {
    spread: [N; 2],
    slope: N,
    area: N,
    flow: [N; 2],
}

/// What the cells of a row give to the nodes above and below them.
#[derive(Clone, Copy)]
struct Forces<N> {
    /// On u above and below, in the inner and the outer column.
    above: [N; 2],
    below: [N; 2],
    /// By shear, on v above and against v below in either column.
    shear: N,
    /// By lateral stress, against v above and below, in the inner column with the other sign, and in the outer.
    lateral_above: [N; 2],
    lateral_below: [N; 2],
}

impl<N: Number> Forces<N> {
    /// * `u`, `v`: displacements above and below, each in the inner and the outer column
    #[inline(always)]
    fn new(u: [[N; 2]; 2], v: [[N; 2]; 2], weights: &Weights<N>, constants: &Constants<N>) -> Self {
        let [[u_above_inner, u_above], [u_below_inner, u_below]] = u;
        let [[v_above_inner, v_above], [v_below_inner, v_below]] = v;
        let Weights { spread: [inward, outward], slope, area, flow: [inner_flow, outer_flow] } = *weights;
        // twice ε, a, d/Δz, b/Δz and g
        let (inner, outer) = (u_below_inner - u_above_inner, u_below - u_above);
        let (stretch, bend) = (outer + inner, outer - inner);
        let spread_above = (outward * v_above).sub_product(inward, v_above_inner);
        let spread_below = (outward * v_below).sub_product(inward, v_below_inner);
        let (spread, twist) = (spread_below + spread_above, spread_below - spread_above);
        let courant = constants.height * slope;
        let tilt = (v_below_inner - v_above_inner) + (v_below - v_above);
        let shift = (u_above + u_below) - (u_above_inner + u_below_inner);
        let shear = constants.shear * tilt.add_product(courant, shift);
        let normal = area * (constants.axial * stretch).add_product(constants.coupled, spread);
        let bend = constants.bend * bend;
        let lean = courant * shear;
        let (lean_above, lean_below) = (area * (bend - lean), area * (bend + lean));
        let lateral = (constants.coupled * stretch).add_product(constants.lateral, spread);
        let twist = constants.twist * twist;
        let (lateral_above, lateral_below) = (lateral - twist, lateral + twist);
        Self {
            above: [normal - lean_above, normal + lean_above],
            below: [normal - lean_below, normal + lean_below],
            shear: area * shear,
            lateral_above: [inner_flow * lateral_above, outer_flow * lateral_above],
            lateral_below: [inner_flow * lateral_below, outer_flow * lateral_below],
        }
    }

    /// Forces on u and v of the nodes above, from the cells at either side.
    #[inline(always)]
    fn above(inner: &Self, outer: &Self) -> [N; 2] {
        [
            inner.above[1] + outer.above[0],
            (inner.shear + outer.shear) - (inner.lateral_above[1] - outer.lateral_above[0]),
        ]
    }

    /// Against u and v of the nodes below.
    #[inline(always)]
    fn below(inner: &Self, outer: &Self) -> [N; 2] {
        [
            inner.below[1] + outer.below[0],
            (inner.shear + outer.shear) + (inner.lateral_below[1] - outer.lateral_below[0]),
        ]
    }
}

impl<L: Lane> Forces<L> {
    /// Those of the cells at the outer sides of the nodes where these are at the inner side.
    #[inline(always)]
    fn outer(&self, after: &Self) -> Self {
        let next = |of: L, after: L| L::seam(of, after).0;
        Self {
            above: [next(self.above[0], after.above[0]), after.above[1]],
            below: [next(self.below[0], after.below[0]), after.below[1]],
            shear: next(self.shear, after.shear),
            lateral_above: [next(self.lateral_above[0], after.lateral_above[0]), after.lateral_above[1]],
            lateral_below: [next(self.lateral_below[0], after.lateral_below[0]), after.lateral_below[1]],
        }
    }
}

/// Neighbouring cells of a row, as many of each number.
struct Reading<'a> {
    /// Displacements of the nodes above and below.
    u: [Sides<'a>; 2],
    v: [Sides<'a>; 2],
    spread: [&'a [f64]; 2],
    slope: &'a [f64],
    area: &'a [f64],
    flow: [&'a [f64]; 2],
}

/// Displacements at the inner and at the outer sides of cells.
type Sides<'a> = [&'a [f64]; 2];

impl<'a> Reading<'a> {
    /// * `u`, `v`: displacements above and below
    #[inline(always)]
    fn new([u, v]: [[Sides<'a>; 2]; 2], columns: &'a Columns, cells: Range<usize>) -> Self {
        let Columns { spread, slope, area, flow, .. } = columns;
        Self {
            u,
            v,
            spread: [&spread[0][cells.clone()], &spread[1][cells.clone()]],
            slope: &slope[cells.clone()],
            area: &area[cells.clone()],
            flow: [&flow[0][cells.clone()], &flow[1][cells]],
        }
    }

    /// Forces of the cells from number `i` of these on.
    #[inline(always)]
    fn forces<L: Lane>(&self, zero: L, constants: &Constants<L>, i: usize) -> Forces<L> {
        let Self { u, v, spread, slope, area, flow } = self;
        let weights = Weights {
            spread: [zero.read(spread[0], i), zero.read(spread[1], i)],
            slope: zero.read(slope, i),
            area: zero.read(area, i),
            flow: [zero.read(flow[0], i), zero.read(flow[1], i)],
        };
        let u =
            [[zero.read(u[0][0], i), zero.read(u[0][1], i)], [zero.read(u[1][0], i), zero.read(u[1][1], i)]];
        let v =
            [[zero.read(v[0][0], i), zero.read(v[0][1], i)], [zero.read(v[1][0], i), zero.read(v[1][1], i)]];
        Forces::new(u, v, &weights, constants)
    }
}

/// Displacements at both sides of cells of a row, from number 1 on.
#[inline(always)]
fn beside<'a>(row: &'a [f64], cells: &Range<usize>) -> Sides<'a> {
    [&row[cells.start - 1..cells.end - 1], &row[cells.clone()]]
}

/// Displacements at the inner sides of the first cells of a row, the first one being an image about the axis.
///
/// * `sign`: of the image
#[inline(always)]
fn about_axis(row: &[f64], sign: f64) -> [f64; BLOCK] {
    let mut inner = [0.0; BLOCK];
    inner[0] = sign * row[0];
    inner[1..].copy_from_slice(&row[..BLOCK - 1]);
    inner
}

/// What nodes have moved by since the level before, from number `i` on.
#[inline(always)]
fn moved<L: Lane>(zero: L, now: &[f64], before: &[f64], i: usize) -> L {
    zero.read(now, i) - zero.read(before, i)
}

/// Weights of nodes from number `i` on.
#[inline(always)]
fn radial<L: Lane>(zero: L, outward: &[f64], inward: &[f64], i: usize) -> RadialWeights<L> {
    RadialWeights { outward: zero.read(outward, i), inward: zero.read(inward, i) }
}

/// The images of the first nodes about the axis, as the block before them; its last two numbers count.
#[inline(always)]
fn images<L: Lane>(zero: L, first: L, sign: f64) -> L {
    let mut numbers = [0.0; 2 * BLOCK];
    first.write(&mut numbers, BLOCK);
    for image in 0..2 {
        numbers[L::WIDTH - 1 - image] = sign * numbers[BLOCK + image];
    }
    zero.read(&numbers, 0)
}

/// A march down some rows of nodes, from the surface on.
struct March<'a> {
    body: &'a Body,
    before: &'a Level<2>,
    now: &'a Level<2>,
    next: &'a mut Level<2>,
    /// Number of rows.
    rows: usize,
    /// Number of columns, a whole number of blocks.
    columns: usize,
}

/// Row `j` of a displacement.
#[inline(always)]
fn row(level: &ndarray::Array2<f64>, j: usize) -> &[f64] {
    let stride = level.ncols();
    &level.as_slice().expect("rows are contiguous")[j * stride..(j + 1) * stride]
}

/// The same, to be written.
#[inline(always)]
fn row_mut(level: &mut ndarray::Array2<f64>, j: usize) -> &mut [f64] {
    let stride = level.ncols();
    &mut level.as_slice_mut().expect("rows are contiguous")[j * stride..(j + 1) * stride]
}

/// Displacements above and below the cells below row `j`, of u and of v.
#[inline(always)]
fn cell_rows(level: &Level<2>, j: usize) -> [[&[f64]; 2]; 2] {
    [0, 1].map(|field| [row(&level[field], j), row(&level[field], j + 1)])
}

/// Slack for a Courant number of 1 but for rounding.
const ROUNDING: f64 = 1e-9;

impl Work for March<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(mut self, zero: L) {
        let body = self.body;
        let width = body.columns.node[0].len();
        // what the cells above have left against u and v
        let mut left = [vec![0.0; width], vec![0.0; width]];
        for j in 0..self.rows {
            match &body.rows[j] {
                Some(constants) => self.cells(zero, j, constants, &mut left),
                None if j == body.grid.nz => self.back(j, &mut left),
                // the row below, at the same depth, gets what is left
                None if body.bond_below(j) == Bond::Welded => continue,
                None => {
                    self.settle(1, j, &left[1]);
                    left[1].fill(0.0);
                    self.damp(zero, 1, j);
                    continue;
                }
            }
            self.damp(zero, 0, j);
            self.damp(zero, 1, j);
            if j > 0 && body.rows[j - 1].is_none() {
                let shared = if body.bond_below(j - 1) == Bond::Welded { 2 } else { 1 };
                for field in 0..shared {
                    let stride = self.next[field].ncols();
                    let all = self.next[field].as_slice_mut().expect("rows are contiguous");
                    all.copy_within(j * stride..(j + 1) * stride, (j - 1) * stride);
                }
            }
        }
    }
}

impl March<'_> {
    /// Advances row `j`, which has cells below it.
    ///
    /// * `left`: what the cells above have left; then those below for the next row
    #[inline(always)]
    fn cells<L: Lane>(&mut self, zero: L, j: usize, constants: &Constants<f64>, left: &mut [Vec<f64>; 2]) {
        let (columns, width) = (&self.body.columns, self.columns);
        let node = self.body.nodes(j);
        let wide = constants.wide(zero);
        let (u, u_below) = (row(&self.now[0], j), row(&self.now[0], j + 1));
        let (v, v_below) = (row(&self.now[1], j), row(&self.now[1], j + 1));
        let inner_u = [about_axis(u, 1.0), about_axis(u_below, 1.0)];
        let inner_v = [about_axis(v, -1.0), about_axis(v_below, -1.0)];
        let sides = [
            [[&inner_u[0][..], u], [&inner_u[1][..], u_below]],
            [[&inner_v[0][..], v], [&inner_v[1][..], v_below]],
        ];
        let mut inner = Reading::new(sides, columns, 0..BLOCK).forces(zero, &wide, 0);
        // the cells at the outer sides of the nodes
        let outer = L::WIDTH..L::WIDTH + width;
        let sides =
            [[beside(u, &outer), beside(u_below, &outer)], [beside(v, &outer), beside(v_below, &outer)]];
        let reading = Reading::new(sides, columns, outer);
        let (u, v) = (&u[..width], &v[..width]);
        let (u_before, v_before) = (&row(&self.before[0], j)[..width], &row(&self.before[1], j)[..width]);
        let [u_next, v_next] = self.next;
        let (u_next, v_next) = (&mut row_mut(u_next, j)[..width], &mut row_mut(v_next, j)[..width]);
        let [u_left, v_left] = left;
        let (u_left, v_left) = (&mut u_left[..width], &mut v_left[..width]);
        let (u_node, v_node) = (&node[0][..width], &node[1][..width]);
        let [u_mass, v_mass] = &self.body.masses;
        let (u_scale, v_scale) = (zero.splat(1.0 / u_mass[j]), zero.splat(1.0 / v_mass[j]));
        let mut i = 0;
        while i + L::WIDTH <= width {
            let after = reading.forces(zero, &wide, i);
            let outer = inner.outer(&after);
            let [u_above, v_above] = Forces::above(&inner, &outer);
            let [u_below, v_below] = Forces::below(&inner, &outer);
            let (u_force, v_force) = (u_above - zero.read(u_left, i), v_above - zero.read(v_left, i));
            u_below.write(u_left, i);
            v_below.write(v_left, i);
            let u_free = zero.read(u, i).twice_less(zero.read(u_before, i));
            let v_free = zero.read(v, i).twice_less(zero.read(v_before, i));
            u_free.add_product(u_force * u_scale, zero.read(u_node, i)).write(u_next, i);
            v_free.add_product(v_force * v_scale, zero.read(v_node, i)).write(v_next, i);
            inner = after;
            i += L::WIDTH;
        }
        if self.body.has_hoops() {
            let last = columns.cells - 2;
            let hoop = constants.rim * (v[last] + row(&self.now[1], j + 1)[last]);
            v_left[last] -= hoop;
            v_next[last] += hoop / v_mass[j] * node[1][last];
        }
    }

    /// Advances displacement number `field` of row `j`, which has no cells below it.
    ///
    /// * `left`: what the cells above have left
    #[inline(always)]
    fn settle(&mut self, field: usize, j: usize, left: &[f64]) {
        let (now, before) = (row(&self.now[field], j), row(&self.before[field], j));
        let scale = 1.0 / self.body.masses[field][j];
        let node = &self.body.nodes(j)[field][..now.len()];
        let left = &left[..now.len()];
        let next = &mut row_mut(&mut self.next[field], j)[..now.len()];
        let before = &before[..now.len()];
        for i in 0..now.len() {
            next[i] = now[i].twice_less(before[i]).add_product(-left[i] * scale, node[i]);
        }
    }

    /// Advances the last row.
    #[inline(always)]
    fn back(&mut self, j: usize, left: &mut [Vec<f64>; 2]) {
        let body = self.body;
        if body.grid.back == Back::Free {
            let Columns { spread, flow, cells, .. } = &body.columns;
            let v = row(&self.now[1], j);
            let membrane = |i: usize| {
                let inner = if i == 0 { 0.0 } else { v[i - 1] };
                body.membrane * (spread[1][i] * v[i]).sub_product(spread[0][i], inner)
            };
            let mut inner = membrane(0);
            for i in 0..cells - 1 {
                let outer = membrane(i + 1);
                left[1][i] += flow[1][i] * inner - flow[0][i + 1] * outer;
                inner = outer;
            }
            if body.has_hoops() {
                left[1][cells - 2] -= body.hoop_below * v[cells - 2];
            }
        }
        if let Some(weight) = body.weight {
            let (u, before) = (self.now[0][[j, 0]], self.before[0][[j, 0]]);
            let force: f64 = left[0].iter().sum();
            // forces and masses of nodes are per time step
            let mass = body.mass_of_row(j) + weight;
            let next = u.twice_less(before) - force * body.grid.dt() / mass;
            row_mut(&mut self.next[0], j).fill(next);
            row_mut(&mut self.next[1], j).fill(0.0);
            return;
        }
        match body.grid.back {
            Back::Rigid => row_mut(&mut self.next[0], j).fill(0.0),
            Back::Free => self.settle(0, j, &left[0]),
        }
        self.settle(1, j, &left[1]);
    }

    /// Damps displacement number `field` of row `j`: `u^{k+1} −= 4σ·E_r²(u^k − u^{k−1})`.
    #[inline(always)]
    fn damp<L: Lane>(&mut self, zero: L, field: usize, j: usize) {
        let Some(weights) = &self.body.columns.damping else { return };
        let (RadialWeights { outward, inward }, width) = (&weights[field], self.columns);
        let (now, before) = (row(&self.now[field], j), row(&self.before[field], j));
        let next = &mut row_mut(&mut self.next[field], j)[..width];
        let sign = if field == 0 { 1.0 } else { -1.0 };
        // E_r once, a block ahead of the second time, and what has moved another one
        let mut weights = radial(zero, outward, inward, 0);
        let mut ahead = moved(zero, now, before, L::WIDTH);
        let first = moved(zero, now, before, 0);
        let (_, inside) = L::wide_seam(images(zero, first, sign), first);
        let (outside, mut moved_inside) = L::wide_seam(first, ahead);
        let mut once = scheme::double_radial([inside, first, outside], weights);
        let (_, mut once_inside) = L::wide_seam(images(zero, once, sign), once);
        let (outward, inward) = (&outward[L::WIDTH..][..width], &inward[L::WIDTH..][..width]);
        let (now, before) = (&now[2 * L::WIDTH..][..width], &before[2 * L::WIDTH..][..width]);
        let mut i = 0;
        while i + L::WIDTH <= width {
            let far = moved(zero, now, before, i);
            let (moved_outside, far_inside) = L::wide_seam(ahead, far);
            let weights_ahead = radial(zero, outward, inward, i);
            let once_ahead = scheme::double_radial([moved_inside, ahead, moved_outside], weights_ahead);
            let (once_outside, ahead_inside) = L::wide_seam(once, once_ahead);
            // twice −√(4σ)·E_r of it is 4σ·E_r²
            let values = [once_inside, once, once_outside];
            scheme::take_radial(zero.read(next, i), values, weights).write(next, i);
            (ahead, moved_inside) = (far, far_inside);
            (once, once_inside, weights) = (once_ahead, ahead_inside, weights_ahead);
            i += L::WIDTH;
        }
    }
}

impl Body {
    /// A target of layers on a mesh with cells between nodes.
    ///
    /// * `layers`: as many as the mesh has
    /// * `damping`: σ of the lateral damping, see [`super::elastic::largest_damping`] of every layer
    ///
    /// # Panics
    ///
    /// If the scheme is not stable: a Courant number of a row or column of cells above 1.
    pub fn new(grid: Grid, layers: &[Material], damping: f64, instructions: Instructions) -> Self {
        assert_eq!(layers.len(), grid.layers.len(), "layers of the mesh");
        let dt = grid.dt();
        let mut rows = vec![None; grid.nz + 1];
        let mut halves = vec![0.0; grid.nz + 1];
        let narrowest = (0..grid.nr()).map(|i| grid.width(i)).fold(f64::INFINITY, f64::min);
        let mut media = Vec::new();
        for (material, layer) in layers.iter().zip(&grid.layers) {
            let Material { impedance, speed, ref stiffness } = *material;
            let medium = Medium::new(speed * dt / narrowest, stiffness);
            let density = impedance / speed;
            for j in layer.first..layer.last() {
                let height = grid.height(j);
                let courant = speed * dt / height;
                let largest = courant.max(medium.courant * medium.lateral.sqrt());
                assert!(largest <= 1.0 + ROUNDING, "unstable: Courant number {largest}");
                rows[j] = Some(Constants::new(&medium, height, impedance * courant));
                halves[j] = 0.5 * density * height / dt;
            }
            media.push((medium, impedance * speed));
        }
        let mut mass = halves.clone();
        (0..grid.nz).for_each(|j| mass[j + 1] += halves[j]);
        let (mut membrane, mut hoop_below) = (0.0, 0.0);
        if grid.back == Back::Free {
            let (material, (medium, _)) = (layers[layers.len() - 1], media[media.len() - 1]);
            let height = grid.height(grid.nz);
            mass[grid.nz] += halves[grid.nz - 1];
            // ½(1 − λ²) of a row of cells
            let stiffness = material.impedance * material.speed * dt * height;
            membrane = 0.5 * medium.membrane * stiffness;
            hoop_below = medium.twice_plane * stiffness;
        }
        let mut masses = [mass.clone(), mass];
        for (below, lower) in grid.layers.iter().enumerate().skip(1) {
            let last = grid.layers[below - 1].last();
            for (field, masses) in masses.iter_mut().enumerate() {
                if field == 0 || lower.bond == Bond::Welded {
                    let sum = masses[last] + masses[lower.first];
                    (masses[last], masses[lower.first]) = (sum, sum);
                }
            }
        }
        let columns = Columns::new(&grid, damping);
        Self {
            layers: media,
            rows,
            halves,
            masses,
            columns,
            membrane,
            hoop_below,
            weight: None,
            strengths: vec![Strength::default(); layers.len()],
            instructions,
            grid,
        }
    }

    /// The same with a rigid body of this mass bonded to its back \[πγR³; plane γR²\].
    pub fn with_weight(self, weight: Option<f64>) -> Self {
        Self { weight, ..self }
    }

    /// The same with what is known of the strengths of its layers.
    pub fn with_strengths(self, strengths: Vec<Strength>) -> Self {
        assert_eq!(strengths.len(), self.layers.len(), "layers of the mesh");
        Self { strengths, ..self }
    }

    /// Its mass, as its nodes have it \[πγR³; plane γR²\].
    pub fn mass(&self) -> f64 {
        let rows = (0..=self.grid.nz).map(|j| self.mass_of_row(j));
        rows.sum::<f64>() + self.weight.unwrap_or_default()
    }

    /// Mass of the nodes of row `j` \[πγR³; plane γR²\].
    fn mass_of_row(&self, j: usize) -> f64 {
        self.nodes(j)[0][..self.grid.nr()].iter().map(|node| self.row_mass(j) / node).sum()
    }

    /// Mass per area of row `j` \[γR\].
    fn row_mass(&self, j: usize) -> f64 {
        let above = if j > self.grid.layer(j).first { self.halves[j - 1] } else { 0.0 };
        let over_back = if self.grid.is_above_free_back(j) { above } else { 0.0 };
        (above + self.halves[j] + over_back) * self.grid.dt()
    }

    /// A target at rest.
    ///
    /// * `shown`: what is shown
    pub fn at_rest<T>(self, shown: impl Into<Sampling>) -> Reference<T, Self, 2> {
        let (grid, nr) = (self.grid.clone(), self.grid.nr());
        let cone = LightCone::new(Coverage::Everything, 1.0, 1, grid.depth() + 1, nr);
        Reference::new(grid, self, cone, shown)
    }

    /// True if v of the last nodes stretches hoops: at a free rim.
    fn has_hoops(&self) -> bool {
        self.grid.rim == Some(Rim::Free) && self.grid.geometry == Geometry::Axisymmetric
    }

    /// Strain energy of the hoops at a rim between two levels of v there, `−2C66·v²`.
    fn hoop_energy(&self, layer: usize, [earlier, later]: [f64; 2], height: f64) -> f64 {
        let (medium, unit) = self.layers[layer];
        if self.has_hoops() { -medium.twice_plane * unit * height * earlier * later } else { 0.0 }
    }

    /// `1/a_i` of u and of v in row `j`.
    fn nodes(&self, j: usize) -> &[Vec<f64>; 2] {
        let Columns { node, face, .. } = &self.columns;
        let is_face = j == 0 || self.rows[j].is_none() && !self.grid.is_above_free_back(j);
        if is_face || self.rows[j - 1].is_none() { face } else { node }
    }

    /// How the layer below row `j`, the last of its layer, is joined to it.
    fn bond_below(&self, j: usize) -> Bond {
        self.grid.layers[self.grid.layer_of(j) + 1].bond
    }
}

impl Scheme<2> for Body {
    fn stride(&self) -> usize {
        self.columns.node[0].len()
    }

    fn advance(&self, before: &Level<2>, now: &Level<2>, next: &mut Level<2>, [rows, columns]: [usize; 2]) {
        let columns = columns.next_multiple_of(BLOCK);
        self.instructions.run(March { body: self, before, now, next, rows, columns });
    }

    fn compliance(&self, i: usize) -> f64 {
        // half a row of cells moves with the surface
        self.grid.dt() / self.halves[0] * (self.columns.face[0][i] / self.columns.node[0][i])
    }

    fn traction(&self, _before: &Level<2>, now: &Level<2>, interface: usize, i: usize) -> [f64; 2] {
        let upper = self.grid.layers[interface].last();
        let against = self.node_forces(now, [upper, upper - 1], i);
        let with = self.node_forces(now, [upper + 1, upper + 1], i);
        // half a row of cells of either side
        let [above, below] = [self.halves[upper - 1], self.halves[upper + 1]];
        let [normal, shear] = [0, 1].map(|field| {
            let force = -below * against[field] - above * with[field];
            force / (above + below) * self.columns.node[field][i] / self.grid.dt()
        });
        match self.bond_below(upper) {
            Bond::Welded => [normal, shear],
            Bond::Sliding => [normal, 0.0],
        }
    }

    fn energies(&self, earlier: &Level<2>, later: &Level<2>) -> Vec<TargetEnergy> {
        let dt = self.grid.dt();
        let mut energies = vec![TargetEnergy::default(); self.layers.len()];
        for (number, layer) in self.grid.layers.iter().enumerate() {
            let (medium, unit) = self.layers[number];
            let energy = &mut energies[number];
            for j in layer.first..=layer.last() {
                let mass = self.row_mass(j);
                for (field, (earlier, later)) in earlier.iter().zip(later).enumerate() {
                    for i in 0..self.grid.nr() {
                        let moved = later[[j, i]] - earlier[[j, i]];
                        let node = self.nodes(j)[field][i];
                        // nothing moves in a guide
                        if node > 0.0 {
                            energy.kinetic += scheme::kinetic_energy(mass / node, moved, dt);
                        }
                    }
                }
            }
            if let Some(weight) = self.weight.filter(|_| layer.last() == self.grid.nz) {
                let at = [self.grid.nz, 0];
                energy.kinetic += scheme::kinetic_energy(weight, later[0][at] - earlier[0][at], dt);
            }
            for j in layer.first..layer.last() {
                for i in 0..=self.grid.nr() {
                    let [a, b] = [earlier, later].map(|level| self.cell_strains(level, j, i));
                    let weight = unit * self.grid.cell_area(i) * self.grid.height(j);
                    energy.strain += cells::strain_energy(a, b, weight, &medium);
                }
                let rim = self.grid.nr() - 1;
                let means = [earlier, later].map(|level| 0.5 * (level[1][[j, rim]] + level[1][[j + 1, rim]]));
                energy.strain += self.hoop_energy(number, means, self.grid.height(j));
            }
            if self.grid.is_above_free_back(layer.last()) {
                for i in 0..=self.grid.nr() {
                    let sides = |level: &Level<2>| self.sides(row(&level[1], layer.last()), 1, i);
                    let spreads = [earlier, later].map(|level| self.spread(sides(level), i));
                    let weight = unit * self.grid.cell_area(i) * self.grid.height(layer.last());
                    energy.strain += cells::membrane_energy(spreads, weight, &medium);
                }
                let rim = [layer.last(), self.grid.nr() - 1];
                let height = 0.5 * self.grid.height(layer.last());
                energy.strain += self.hoop_energy(number, [earlier[1][rim], later[1][rim]], height);
            }
        }
        energies
    }

    fn show(&self, levels: Levels<'_, 2>, pressure: &[f64], j: usize, i: usize) -> impl FnMut(Field) -> f64 {
        let number = self.grid.layer_of(j);
        let (medium, unit) = &self.layers[number];
        let mut stress = None;
        move |field| {
            motion(field, levels, self.grid.dt(), j, i).unwrap_or_else(|| {
                let stress =
                    stress.get_or_insert_with(|| self.strain(levels[1], pressure[i], j, i).stress(medium));
                self.strengths[number].shown(field, stress, *unit)
            })
        }
    }

    fn surface_strain(&self, now: &Level<2>, pressure: f64, i: usize) -> f64 {
        self.strain(now, pressure, 0, i).largest_on_face()
    }

    fn look(
        &self,
        now: &Level<2>,
        j: usize,
        columns: Range<usize>,
        mut take: impl FnMut(usize, f64, Option<Stress>),
    ) {
        // no cell lies between the two rows of an interface
        if self.rows[j].is_none() {
            return;
        }
        let layer = self.grid.layer_of(j);
        let (medium, unit) = &self.layers[layer];
        let is_compared = self.strengths[layer].is_known();
        let Columns { spread, slope, hoop, .. } = &self.columns;
        let (height, rows) = (self.grid.height(j), cell_rows(now, j));
        for i in columns {
            let [u, v] = self.corners(rows, i);
            let [lateral, hoops] =
                [[height * spread[0][i], height * spread[1][i]], [height * hoop[0][i], height * hoop[1][i]]];
            let strain = cells::largest_strain(u, v, lateral, hoops, height * slope[i]) / (2.0 * height);
            let stress = is_compared.then(|| {
                let [axial, lateral, shear, ..] = self.strains_of([u, v], height, i);
                let hoop = 0.5 * (hoop[0][i] * (v[0][0] + v[0][1]) + hoop[1][i] * (v[1][0] + v[1][1]));
                Strain { axial, lateral, hoop, shear }.stress(medium).times(*unit)
            });
            take(i, strain, stress);
        }
    }

    fn backing_strain(&self, level: &Level<2>, i: usize) -> f64 {
        self.strain_on_back(level, i).largest_on_face()
    }

    fn strengths(&self) -> &[Strength] {
        &self.strengths
    }

    fn face_stress(&self, now: &Level<2>, pressure: f64, row: usize, i: usize) -> Option<Stress> {
        let strain = if row == 0 { self.strain(now, pressure, 0, i) } else { self.strain_on_back(now, i) };
        let (medium, unit) = &self.layers[self.grid.layer_of(row)];
        Some(strain.stress(medium).times(*unit))
    }
}

impl Body {
    /// Displacement number `field` of a row at the inner and the outer side of the cells of column `i`; one may be an image about the axis, or at rest
    /// beyond the mesh.
    #[inline(always)]
    fn sides(&self, row: &[f64], field: usize, i: usize) -> [f64; 2] {
        let inner = match i {
            0 if field == 1 => -row[0],
            0 => row[0],
            _ => row[i - 1],
        };
        [inner, if i < self.grid.nr() { row[i] } else { 0.0 }]
    }

    /// Displacements around the cell of column `i`: u and v at the inner and the outer side, each above and below.
    ///
    /// * `rows`: see [`cell_rows`]
    #[inline(always)]
    fn corners(&self, rows: [[&[f64]; 2]; 2], i: usize) -> [[[f64; 2]; 2]; 2] {
        // a closure: maps of arrays are not inlined
        let around = |[upper, lower]: [&[f64]; 2], field: usize| {
            let (upper, lower) = (self.sides(upper, field, i), self.sides(lower, field, i));
            [[upper[0], lower[0]], [upper[1], lower[1]]]
        };
        [around(rows[0], 0), around(rows[1], 1)]
    }

    /// Strains on the backing at column `i`.
    fn strain_on_back(&self, level: &Level<2>, i: usize) -> Strain {
        match self.grid.back {
            Back::Rigid => self.strain(level, 0.0, self.grid.nz, i),
            Back::Free => self.strain_on_face(level, [0.0; 2], self.grid.nz, i),
        }
    }

    /// What row `j` of cells gives to node i of row `row` above or below it: [`Forces::above`] or [`Forces::below`].
    fn node_forces(&self, now: &Level<2>, [row, j]: [usize; 2], i: usize) -> [f64; 2] {
        let side = if j < row { Forces::below } else { Forces::above };
        let constants = self.rows[j].as_ref().expect("a row of cells");
        let Columns { spread, slope, area, flow, .. } = &self.columns;
        let rows = cell_rows(now, j);
        let [inner, outer] = [i, i + 1].map(|i| {
            let [u, v] = [0, 1].map(|field| rows[field].map(|row| self.sides(row, field, i)));
            let weights = Weights {
                spread: [spread[0][i], spread[1][i]],
                slope: slope[i],
                area: area[i],
                flow: [flow[0][i], flow[1][i]],
            };
            Forces::new(u, v, &weights, constants)
        });
        let [normal, shear] = side(&inner, &outer);
        if !self.has_hoops() || i + 1 < self.grid.nr() {
            return [normal, shear];
        }
        let hoop = constants.rim * (now[1][[j, i]] + now[1][[j + 1, i]]);
        // of a row above the node its reaction is asked for
        [normal, if j < row { shear - hoop } else { shear + hoop }]
    }

    /// Strains of the cell below row `j` at the inner side of column `i`.
    fn cell_strains(&self, level: &Level<2>, j: usize, i: usize) -> CellStrains {
        self.strains_of(self.corners(cell_rows(level, j), i), self.grid.height(j), i)
    }

    /// Strains of a cell of column `i`.
    ///
    /// * `height`: Δz
    #[inline(always)]
    fn strains_of(&self, [u, v]: [[[f64; 2]; 2]; 2], height: f64, i: usize) -> CellStrains {
        let by = |[upper, lower]: [f64; 2]| lower - upper;
        let sum = |[upper, lower]: [f64; 2]| lower + upper;
        let (first, last) = (by(u[0]) / height, by(u[1]) / height);
        let (upper, lower) = (self.spread([v[0][0], v[1][0]], i), self.spread([v[0][1], v[1][1]], i));
        let slope = self.columns.slope[i] * (sum(u[1]) - sum(u[0]));
        let tilt = (by(v[0]) + by(v[1])) / height;
        [
            0.5 * (first + last),
            0.5 * (upper + lower),
            0.5 * (slope + tilt),
            0.5 * (last - first),
            0.5 * (lower - upper),
        ]
    }

    /// v_,r + v/r in the cell at the inner side of column `i`.
    ///
    /// * `v`: at its inner and its outer side
    #[inline(always)]
    fn spread(&self, v: [f64; 2], i: usize) -> f64 {
        let [inner, outer] = &self.columns.spread;
        outer[i] * v[1] - inner[i] * v[0]
    }

    /// Mean over the cells at either side of node i, weighted by their areas.
    fn mean(&self, i: usize, of: impl Fn(usize) -> Strain) -> Strain {
        of(i).between(&of(i + 1), self.columns.share[i])
    }

    /// Mean strains of the cells below row `j` at either side of node i.
    ///
    /// * `hoop`: v/r at the node
    fn row_strain(&self, level: &Level<2>, j: usize, i: usize, hoop: f64) -> Strain {
        self.mean(i, |i| {
            let [axial, lateral, shear, ..] = self.cell_strains(level, j, i);
            Strain { axial, lateral, hoop, shear }
        })
    }

    /// Strains at node (j, i).
    ///
    /// * `pressure`: on the surface at this node
    fn strain(&self, level: &Level<2>, pressure: f64, j: usize, i: usize) -> Strain {
        if j == 0 {
            return self.strain_on_face(level, [pressure, 0.0], j, i);
        }
        if let Some(interface) = self.grid.interface_of(j) {
            return self.strain_on_face(level, self.interface_stress(level, interface, i), j, i);
        }
        let hoop = self.hoop(level, j, i);
        let above = self.row_strain(level, j - 1, i, hoop);
        match (j == self.grid.nz, self.grid.back) {
            (false, _) => {
                let below = self.row_strain(level, j, i, hoop);
                let [upper, lower] = [j - 1, j].map(|j| self.grid.height(j));
                above.between(&below, upper / (upper + lower))
            }
            // the backing is smooth
            (true, Back::Rigid) => Strain { shear: 0.0, ..above },
            // in the middle between the cells above and the back
            (true, Back::Free) => above.between(&self.strain_on_face(level, [0.0; 2], j, i), 0.5),
        }
    }

    /// −σ_zz and σ_rz at an interface in column `i` \[γc_p²\], see [`scheme::interface_stress`].
    fn interface_stress(&self, level: &Level<2>, interface: usize, i: usize) -> [f64; 2] {
        let last = self.grid.layers[interface].last();
        let [upper, lower] = [(interface, last - 1), (interface + 1, last + 1)].map(|(layer, row)| {
            let (medium, unit) = &self.layers[layer];
            // neither component has the hoop strain
            let Stress { zz, rz, .. } = self.row_strain(level, row, i, 0.0).stress(medium);
            [-unit * zz, unit * rz]
        });
        let shares = scheme::shares([self.halves[last - 1], self.halves[last + 1]]);
        let [normal, shear] = [0, 1].map(|part| scheme::interface_stress(shares, [upper[part], lower[part]]));
        match self.bond_below(last) {
            Bond::Welded => [normal, shear],
            Bond::Sliding => [normal, 0.0],
        }
    }

    /// Strains at node i of row `j`, on a face whose stresses are known.
    ///
    /// * `stresses`: −σ_zz and σ_rz \[γc_p²\]
    fn strain_on_face(&self, level: &Level<2>, [pressure, shear]: [f64; 2], j: usize, i: usize) -> Strain {
        let (medium, unit) = &self.layers[self.grid.layer_of(j)];
        let hoop = self.hoop(level, j, i);
        let lateral = self
            .mean(i, |i| Strain {
                lateral: self.spread(self.sides(row(&level[1], j), 1, i), i),
                ..Strain::default()
            })
            .lateral;
        Strain {
            axial: -pressure / unit - medium.lame * lateral,
            lateral,
            hoop,
            shear: shear / (unit * medium.shear),
        }
    }

    /// v/r at node (j, i), plane 0.
    fn hoop(&self, level: &Level<2>, j: usize, i: usize) -> f64 {
        match self.grid.geometry {
            Geometry::Axisymmetric => level[1][[j, i]] / self.grid.r(i),
            Geometry::Plane => 0.0,
        }
    }
}
