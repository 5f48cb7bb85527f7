//! Gauges: points whose motion and stress are recorded in every step, and lines along which stress is recorded in some.
//!
//! A place between nodes is a weighted sum over the nodes around it: linear in r and in z, and inside the first column the even
//! parabola through the first two. Between the last row and a free back displacements are those of that row, and the stress falls to 0. This module knows which nodes that takes and how they add up; the models record the nodes,
//! each in its own way.

use std::ops::Range;

use serde::Deserialize;

use crate::grid::{Grid, Layer};

/// Memory of the gauges of steps that are under way \[bytes\]; two steps may be in any case.
pub(crate) const UNDER_WAY: usize = 64 << 20;

/// A place this near to a node, in distances of nodes, is that node.
const SNAP: f64 = 1e-6;

/// A line in the section of the target.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Line {
    /// Along z, at this radius \[R\].
    R(f64),
    /// Along r, at this depth \[R\].
    Z(f64),
}

/// What is recorded beside frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gauges {
    /// Points `[r, z]`, seen in every step \[R\].
    pub points: Vec<[f64; 2]>,
    /// Lines, seen in the steps that are asked to show them.
    pub lines: Vec<Line>,
    /// Columns of the mesh that lines along r show, from the axis on; no more than it has.
    pub columns: usize,
}

impl Gauges {
    /// True if nothing is recorded.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty() && self.lines.is_empty()
    }
}

/// What the gauges show of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaugeValues {
    /// Displacement, velocity and stress at every point, in the order of [`Gauges::points`].
    pub points: Vec<PointState>,
    /// Stress along every line, in the order of [`Gauges::lines`], at the nodes of the mesh along it \[γc_p²\]; none in steps that
    /// do not show lines.
    pub lines: Vec<Vec<f64>>,
}

/// What a point shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointState {
    /// Displacement u_z into the target \[R\].
    pub displacement: f64,
    /// Velocity ∂u_z/∂t \[c_p\].
    pub velocity: f64,
    /// Stress −σ_zz, compression positive \[γc_p²\].
    pub stress: f64,
}

/// Number of a node, and its weight.
type Term = (usize, f64);

/// The gauges of a mesh: nodes to record, and sums over them.
pub(crate) struct GaugePlan {
    /// Nodes of which all is recorded.
    pub point_nodes: Nodes,
    /// Nodes of which stress is recorded, in steps that show lines.
    pub line_nodes: Nodes,
    points: Vec<PointSum>,
    lines: Vec<Vec<[Term; 2]>>,
}

/// What a point shows as a sum over nodes.
struct PointSum {
    terms: Vec<Term>,
    /// Factor of stress, see [`Around::stress`].
    stress: f64,
}

impl GaugePlan {
    pub fn new(gauges: &Gauges, grid: &Grid) -> Self {
        let points: Vec<_> = gauges.points.iter().map(|point| Around::point(grid, *point)).collect();
        let lines: Vec<_> =
            gauges.lines.iter().map(|line| Around::line(grid, *line, gauges.columns)).collect();
        let point_nodes = Nodes::new(points.iter().flat_map(|around| around.nodes()).collect());
        let line_nodes = Nodes::new(lines.iter().flatten().flat_map(|around| around.nodes()).collect());
        let sum =
            |around: &Around| PointSum { terms: around.sum(&point_nodes).collect(), stress: around.stress };
        let pair = |around: &Around| {
            let mut sum = around.sum(&line_nodes).map(|(node, weight)| (node, around.stress * weight));
            let first = sum.next()?;
            Some([first, sum.next().unwrap_or((first.0, 0.0))])
        };
        Self {
            points: points.iter().map(sum).collect(),
            lines: lines.iter().map(|line| line.iter().filter_map(pair).collect()).collect(),
            point_nodes,
            line_nodes,
        }
    }

    /// True if nothing is recorded.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty() && self.lines.is_empty()
    }

    /// Memory of a step \[bytes\].
    pub fn size(&self) -> usize {
        let nodes =
            self.point_nodes.len() * size_of::<PointState>() + self.line_nodes.len() * size_of::<f64>();
        nodes.max(size_of::<PointState>())
    }

    /// What the gauges show.
    ///
    /// * `points`: of the nodes of points
    /// * `lines`: stress of the nodes of lines, in a step that shows them
    pub fn values(&self, points: &[PointState], lines: Option<&[f64]>) -> GaugeValues {
        let state = |sum: &PointSum| {
            let state = sum.terms.iter().fold(PointState::default(), |state, (node, weight)| PointState {
                displacement: state.displacement + weight * points[*node].displacement,
                velocity: state.velocity + weight * points[*node].velocity,
                stress: state.stress + weight * points[*node].stress,
            });
            PointState { stress: sum.stress * state.stress, ..state }
        };
        let line = |sums: &Vec<[Term; 2]>, stress: &[f64]| {
            sums.iter().map(|[(a, share), (b, rest)]| share * stress[*a] + rest * stress[*b]).collect()
        };
        GaugeValues {
            points: self.points.iter().map(state).collect(),
            lines: lines
                .map_or(Vec::new(), |stress| self.lines.iter().map(|sums| line(sums, stress)).collect()),
        }
    }
}

/// Rows and columns around a place, with their weights; those beyond the mesh are at rest and left out.
struct Around {
    rows: Vec<Term>,
    columns: Vec<Term>,
    /// Factor of stress: from 1 in the last row to 0 on a free back, 1 elsewhere.
    stress: f64,
}

impl Around {
    fn point(grid: &Grid, [r, z]: [f64; 2]) -> Self {
        let (rows, stress) = rows(grid, z);
        Self { rows, columns: columns(grid, r), stress }
    }

    /// The nodes along a line, from the first on, along r the first `columns`; none of a line beyond the mesh.
    fn line(grid: &Grid, line: Line, columns_shown: usize) -> Vec<Self> {
        match line {
            Line::R(r) => {
                let columns = columns(grid, r);
                let row = |j| Self { rows: vec![(j, 1.0)], columns: columns.clone(), stress: 1.0 };
                (0..=grid.nz).map(row).collect()
            }
            Line::Z(z) => {
                let (rows, stress) = rows(grid, z);
                let column = |i| Self { rows: rows.clone(), columns: vec![(i, 1.0)], stress };
                (0..grid.nr().min(columns_shown)).map(column).collect()
            }
        }
    }

    fn terms(&self) -> impl Iterator<Item = (Node, f64)> {
        self.rows
            .iter()
            .flat_map(|&(j, share)| self.columns.iter().map(move |&(i, part)| ((j, i), share * part)))
    }

    fn nodes(&self) -> impl Iterator<Item = Node> {
        self.terms().map(|(node, _)| node)
    }

    /// The same by the numbers that the nodes have in a set.
    fn sum(&self, nodes: &Nodes) -> impl Iterator<Item = Term> {
        self.terms().map(|((j, i), weight)| (nodes.number(j, i), weight))
    }
}

/// Rows around a depth, and the factor of stress there.
fn rows(grid: &Grid, z: f64) -> (Vec<Term>, f64) {
    // at an interface the upper of its two rows
    let inside = |layer: &&Layer| grid.steps_in(layer, z) <= layer.steps as f64 + SNAP;
    let layer = grid.layers.iter().find(inside).unwrap_or(&grid.layers[grid.layers.len() - 1]);
    let (x, last) = (grid.steps_in(layer, z), layer.steps as f64);
    let left = last + layer.overhang - x;
    if x > last + SNAP && layer.overhang > 0.0 {
        let row = if left > -SNAP { vec![(layer.last(), 1.0)] } else { Vec::new() };
        return (row, if left < SNAP { 0.0 } else { left / layer.overhang });
    }
    let rows = linear(x, layer.steps + 1);
    (rows.into_iter().map(|(row, weight)| (layer.first + row, weight)).collect(), 1.0)
}

/// Columns around a radius.
fn columns(grid: &Grid, r: f64) -> Vec<Term> {
    let x = grid.place(r);
    if x >= -SNAP {
        return linear(x, grid.nr());
    }
    // u = a + b r² through (r_0, u_0), (r_1, u_1)
    let (r0, r1) = (grid.r(0), grid.r(1));
    let share = (r * r - r0 * r0) / (r1 * r1 - r0 * r0);
    on_mesh([(0, 1.0 - share), (1, share)], grid.nr())
}

/// The two of `count` nodes around place `x`, in distances of nodes, or the one that is there.
fn linear(x: f64, count: usize) -> Vec<Term> {
    let nearest = x.round();
    let (node, share) = if (x - nearest).abs() < SNAP { (nearest, 0.0) } else { (x.floor(), x - x.floor()) };
    // far beyond any mesh the conversion saturates
    let node = node as usize;
    on_mesh([(node, 1.0 - share), (node.saturating_add(1), share)], count)
}

/// Those terms that count.
fn on_mesh(terms: [Term; 2], count: usize) -> Vec<Term> {
    terms.into_iter().filter(|(node, weight)| *node < count && *weight != 0.0).collect()
}

/// Row and column of a node.
type Node = (usize, usize);

/// A set of nodes, numbered row by row.
pub(crate) struct Nodes {
    /// Rows that have any.
    rows: Vec<usize>,
    /// Number of the first node of each, and the number of all.
    starts: Vec<usize>,
    /// Column of every node.
    columns: Vec<usize>,
}

impl Nodes {
    fn new(mut nodes: Vec<Node>) -> Self {
        nodes.sort_unstable();
        nodes.dedup();
        let (mut rows, mut starts) = (Vec::new(), Vec::new());
        for (number, (j, _)) in nodes.iter().enumerate() {
            if rows.last() != Some(j) {
                rows.push(*j);
                starts.push(number);
            }
        }
        starts.push(nodes.len());
        Self { rows, starts, columns: nodes.into_iter().map(|(_, i)| i).collect() }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Columns of some nodes of a row, by their numbers.
    pub fn columns(&self, numbers: &Range<usize>) -> &[usize] {
        &self.columns[numbers.clone()]
    }

    /// The nodes in `rows` and `columns`: each row that has any, with their numbers.
    pub fn within(
        &self,
        rows: Range<usize>,
        columns: Range<usize>,
    ) -> impl Iterator<Item = (usize, Range<usize>)> {
        let first = self.rows.partition_point(|j| *j < rows.start);
        let found = (first..self.rows.len()).take_while(move |place| self.rows[*place] < rows.end);
        found.filter_map(move |place| {
            let start = self.starts[place];
            let row = &self.columns[start..self.starts[place + 1]];
            let [from, to] =
                [columns.start, columns.end].map(|end| start + row.partition_point(|i| *i < end));
            (from < to).then_some((self.rows[place], from..to))
        })
    }

    /// Number of a node of the set.
    fn number(&self, j: usize, i: usize) -> usize {
        let place = self.rows.partition_point(|row| *row < j);
        let start = self.starts[place];
        start + self.columns[start..self.starts[place + 1]].partition_point(|column| *column < i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Geometry,
        grid::{Back, Bond, MeshKind, Spacing},
    };

    fn grid() -> Grid {
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(5) };
        Grid::new(Geometry::Axisymmetric, MeshKind::Matched, spacing, 7, 5)
    }

    /// What points and lines show of a field.
    fn shown(gauges: &Gauges, field: impl Fn(f64, f64) -> f64) -> GaugeValues {
        let grid = grid();
        let plan = GaugePlan::new(gauges, &grid);
        let (mut points, mut lines) =
            (vec![PointState::default(); plan.point_nodes.len()], vec![f64::NAN; plan.line_nodes.len()]);
        for (j, numbers) in plan.point_nodes.within(0..6, 0..7) {
            for (state, i) in points[numbers.clone()].iter_mut().zip(plan.point_nodes.columns(&numbers)) {
                let value = field(grid.r(*i), 0.2 * j as f64);
                *state = PointState { displacement: value, velocity: 2.0 * value, stress: -value };
            }
        }
        for (j, numbers) in plan.line_nodes.within(0..6, 0..7) {
            for (stress, i) in lines[numbers.clone()].iter_mut().zip(plan.line_nodes.columns(&numbers)) {
                *stress = field(grid.r(*i), 0.2 * j as f64);
            }
        }
        plan.values(&points, Some(&lines))
    }

    #[test]
    fn fields_that_the_interpolation_has_are_exact() {
        let points = vec![[0.31, 0.47], [0.05, 0.6], [0.2, 0.0], [0.64999, 1.0]];
        let gauges =
            Gauges { points: points.clone(), lines: vec![Line::R(0.31), Line::Z(0.47)], columns: usize::MAX };
        let linear = |r: f64, z: f64| 1.0 + 2.0 * r - 3.0 * z + 5.0 * r * z;
        let values = shown(&gauges, linear);
        for ([r, z], state) in points.into_iter().zip(&values.points) {
            let expected = linear(r, z);
            let found = [state.displacement, 0.5 * state.velocity, -state.stress];
            assert!(
                found.iter().all(|value| (value - expected).abs() < 1e-12),
                "({r}, {z}): {found:?} {expected}"
            );
        }
        assert_eq!(values.lines.iter().map(Vec::len).collect::<Vec<_>>(), [6, 7]);
        for (j, value) in values.lines[0].iter().enumerate() {
            assert!((value - linear(0.31, 0.2 * j as f64)).abs() < 1e-12);
        }
        for (i, value) in values.lines[1].iter().enumerate() {
            assert!((value - linear(grid().r(i), 0.47)).abs() < 1e-12);
        }
    }

    #[test]
    fn inside_the_first_column_lies_an_even_parabola() {
        let even = |r: f64, z: f64| 1.0 - 7.0 * r * r + z;
        let points = vec![[0.0, 0.2], [0.03, 0.3]];
        let values = shown(&Gauges { points: points.clone(), lines: vec![Line::R(0.0)], columns: 0 }, even);
        for ([r, z], state) in points.into_iter().zip(&values.points) {
            assert!((state.displacement - even(r, z)).abs() < 1e-14, "({r}, {z}): {state:?}");
        }
        assert!(
            values.lines[0].iter().enumerate().all(|(j, p)| (p - even(0.0, 0.2 * j as f64)).abs() < 1e-14)
        );
    }

    #[test]
    fn what_lies_beyond_the_mesh_is_at_rest() {
        let points = vec![[0.7, 0.2], [5.0, 0.2], [0.05, 1.1], [0.05, 1e300]];
        let lines = vec![Line::R(9.0), Line::Z(9.0)];
        let values = shown(&Gauges { points, lines, columns: usize::MAX }, |_, _| 1.0);
        let found: Vec<f64> = values.points.iter().map(|state| state.displacement).collect();
        assert!((found[0] - 0.5).abs() < 1e-12 && (found[2] - 0.5).abs() < 1e-12, "{found:?}");
        assert_eq!((found[1], found[3]), (0.0, 0.0));
        assert_eq!(values.lines, [[0.0; 0]; 2]);
    }

    #[test]
    fn a_free_back_moves_as_the_last_row_and_bears_no_stress() {
        let grid = grid().with_layers(0.2, &[(5, 0.2, Bond::Welded)], Back::Free);
        let state = PointState { displacement: 3.0, velocity: 2.0, stress: -4.0 };
        let depths = [(1.0, -4.0), (1.05, -2.0), (1.1, 0.0), (1.1 + 1e-12, 0.0), (1.11, 0.0)];
        let points = depths.map(|(z, _)| [grid.r(2), z]).to_vec();
        let plan = GaugePlan::new(
            &Gauges { points, lines: vec![Line::Z(1.075), Line::Z(1.1)], columns: usize::MAX },
            &grid,
        );
        let (points, lines) =
            (vec![state; plan.point_nodes.len()], vec![state.stress; plan.line_nodes.len()]);
        let values = plan.values(&points, Some(&lines));
        for ((z, stress), found) in depths.into_iter().zip(&values.points) {
            assert!((found.stress - stress).abs() < 1e-12, "{z}: {found:?}");
            let expected = if z < 1.105 { [3.0, 2.0] } else { [0.0; 2] };
            assert_eq!([found.displacement, found.velocity], expected, "{z}");
        }
        assert!(values.lines[0].iter().all(|stress| (stress + 1.0).abs() < 1e-12), "{:?}", values.lines);
        assert_eq!((values.points[2].stress, &values.lines[1]), (0.0, &vec![0.0; 7]));
    }

    #[test]
    fn rounding_of_a_place_moves_no_arrival() {
        // 0.2·3 and 0.6 differ in the last bit
        for z in [0.6, 0.2 * 3.0, 0.6 + 1e-15] {
            let values =
                shown(&Gauges { points: vec![[0.05, z]], ..Gauges::default() }, |_, z| f64::from(z < 0.5));
            assert_eq!(values.points[0].displacement, 0.0, "{z}");
        }
    }
}
