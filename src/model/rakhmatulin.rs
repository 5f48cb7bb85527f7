//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! The scheme is derived in [`super::scheme`]. This module puts its operators together, node by node, for the plain stepper,
//! and its weights, column by column, for the fast engine.

use std::ops::Range;

use super::{
    Coverage, Field, Model, Sampling, TargetEnergy,
    blocked::{self, Axial, Engine, Instructions},
    cells::Stress,
    cone::LightCone,
    reference::{Level, Levels, Reference, Scheme, node_by_node},
    scheme::{self, Corner, Face, RadialWeights},
};
use crate::{
    grid::{Back, Grid, Layer},
    material::Waves,
};

/// The simplified theory on a mesh, with the interface required by the plain stepper.
#[derive(Clone, Debug)]
pub struct Rakhmatulin {
    grid: Grid,
    /// Layers from the surface down.
    layers: Vec<Plate>,
    /// The mixed-derivative correction, if there is one.
    corner: Option<Corner>,
}

/// A layer by itself.
#[derive(Clone, Debug)]
struct Plate {
    waves: Waves,
    weights: Vec<RadialWeights>,
    /// Weights of the mixed-derivative correction, if there is one.
    corner: Vec<RadialWeights>,
    /// Radial Courant number.
    courant: f64,
    /// `Z·c_s²·Δt/Δr`
    stiffness: f64,
}

impl Plate {
    /// What the fast engine needs of it.
    fn as_parts(&self) -> blocked::Plate<'_> {
        blocked::Plate { impedance: self.waves.impedance, weights: &self.weights, corner: &self.corner }
    }
}

/// Slack for a Courant number of 1 but for rounding.
const ROUNDING: f64 = 1e-9;

impl Rakhmatulin {
    /// The theory on a mesh.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    /// * `corner`: the mixed-derivative correction, on a matched mesh
    ///
    /// # Panics
    ///
    /// If the scheme is not stable: `c_s·Δt > Δr`.
    pub fn new(grid: Grid, c_s: f64, corner: Option<Corner>) -> Self {
        Self::layered(grid, &[Waves::struck(c_s)], corner)
    }

    /// The theory on a mesh of layers.
    ///
    /// * `layers`: as many as the mesh has
    /// * `corner`: the mixed-derivative correction, on a matched mesh
    ///
    /// # Panics
    ///
    /// If the scheme is not stable: `c_s·Δt > Δr` in a layer.
    pub fn layered(grid: Grid, layers: &[Waves], corner: Option<Corner>) -> Self {
        assert_eq!(layers.len(), grid.layers.len(), "layers of the mesh");
        let plate = |waves: &Waves| {
            let courant = scheme::radial_courant(&grid, waves.shear);
            assert!(courant <= 1.0 + ROUNDING, "unstable: radial Courant number {courant}");
            let corner = corner.map(|corner| scheme::corner_weights(&grid, waves.shear, corner.factor));
            Plate {
                waves: *waves,
                weights: scheme::radial_weights(&grid, waves.shear),
                corner: corner.unwrap_or_default(),
                courant,
                stiffness: waves.impedance * waves.shear * waves.shear * grid.dt() / grid.dr,
            }
        };
        Self { layers: layers.iter().map(plate).collect(), corner, grid }
    }

    /// A target at rest under the fast engine.
    ///
    /// * `coverage`: what must be computed
    /// * `shown`: what is shown
    pub fn blocked<T: Send + 'static>(
        self,
        coverage: Coverage,
        shown: impl Into<Sampling>,
    ) -> Box<dyn Model<T>> {
        Box::new(self.engine(coverage, shown.into(), Instructions::detect()))
    }

    pub(super) fn engine<T>(
        self,
        coverage: Coverage,
        shown: Sampling,
        instructions: Instructions,
    ) -> Engine<T, Axial> {
        let (plates, cone): (Vec<_>, _) =
            (self.layers.iter().map(Plate::as_parts).collect(), self.cone(coverage));
        Engine::new(self.grid, &plates, self.corner, cone, shown, instructions)
    }

    /// The light cone of a load on the surface.
    fn cone(&self, coverage: Coverage) -> LightCone {
        let courant = self.layers.iter().fold(0.0f64, |largest, plate| plate.courant.max(largest)).min(1.0);
        let reach = if self.corner.is_some() { 2 } else { 1 };
        let backing = usize::from(self.grid.back == Back::Rigid);
        LightCone::new(coverage, courant, reach, self.grid.depth() + 1 - backing, self.grid.nr())
    }

    /// A target at rest under the plain stepper.
    ///
    /// * `coverage`: what must be computed
    /// * `shown`: what is shown
    pub fn reference<T>(self, coverage: Coverage, shown: impl Into<Sampling>) -> Reference<T, Self, 1> {
        let (grid, cone) = (self.grid.clone(), self.cone(coverage));
        Reference::new(grid, self, cone, shown)
    }

    /// Displacement at node (j, i) of level `u`, with what stands beyond the boundaries of a layer.
    fn at(&self, layer: usize, [u]: &Level<1>, j: isize, i: isize) -> f64 {
        let (Layer { first, steps, .. }, i) = (self.grid.layers[layer], scheme::image_column(i));
        let face = match (layer + 1 == self.layers.len(), self.grid.back) {
            (false, _) => Face::Interface,
            (true, Back::Rigid) => Face::Rigid,
            (true, Back::Free) => Face::Free,
        };
        let (j, sign) = scheme::image_row(j - first as isize, steps, face);
        // nothing moves beyond the outermost column
        if i < self.grid.nr() { sign * u[[first + j, i]] } else { 0.0 }
    }

    /// Level `u` around node (j, i), as its layer sees it.
    fn around<'a>(&'a self, u: &'a Level<1>, j: usize, i: usize) -> impl Fn(isize, isize) -> f64 + 'a {
        let layer = self.grid.layer_of(j);
        move |dj, di| self.at(layer, u, j as isize + dj, i as isize + di)
    }

    /// u^{k+1} of node (j, i) if its layer were by itself.
    fn by_itself(&self, before: &Level<1>, now: &Level<1>, j: usize, i: usize) -> f64 {
        let (weights, u) = (self.layers[self.grid.layer_of(j)].weights[i], self.around(now, j, i));
        let next = match i {
            0 => scheme::axis(u, before[0][[j, i]], weights),
            _ => scheme::interior(u, before[0][[j, i]], weights),
        };
        match &self.corner {
            Some(corner) => {
                let weights = self.layers[self.grid.layer_of(j)].corner[i];
                let [before, now] = [before, now].map(|level| self.around(level, j, i));
                let d = |dj, di| scheme::combined(corner.share, before(dj, di), now(dj, di));
                scheme::corrected(next, d, weights)
            }
            None => next,
        }
    }

    /// What the mixed-derivative correction adds to node (j, i), `factor·(−C)(u − share·before)`.
    ///
    /// * `factor`: relative to α
    fn corner(&self, before: &Level<1>, u: &Level<1>, [factor, share]: [f64; 2], j: usize, i: usize) -> f64 {
        let Some(weights) = self.layers[self.grid.layer_of(j)].corner.get(i) else { return 0.0 };
        let (u, before) = (self.around(u, j, i), self.around(before, j, i));
        factor * scheme::corner(|dj, di| scheme::combined(share, before(dj, di), u(dj, di)), *weights)
    }

    /// Energy that the mixed-derivative correction has taken out between the half steps before and after level `now`:
    /// `½·m·(u^{k+1} − u^{k−1})·σC(u^k − u^{k−1})/Δt²` \[πR³γc_p²\].
    #[cfg(test)]
    pub(super) fn damped(&self, [before, now, next]: [&Level<1>; 3]) -> f64 {
        let Some(corner) = self.corner else { return 0.0 };
        let node = |(j, i): (usize, usize)| {
            let added = self.corner(before, now, [corner.share, 1.0], j, i);
            let moved = next[0][[j, i]] - before[0][[j, i]];
            scheme::corner_energy(self.mass(j, i), moved, added, self.grid.dt())
        };
        (0..=self.grid.nz).flat_map(|j| (0..self.grid.nr()).map(move |i| (j, i))).map(node).sum()
    }

    /// Mass of a node of a layer by itself: its first and last row have half a row of cells.
    fn mass(&self, j: usize, i: usize) -> f64 {
        let impedance = self.layers[self.grid.layer_of(j)].waves.impedance;
        self.grid.cell_rows(j) * (impedance * self.grid.dt()) * self.grid.area[i]
    }

    /// Impedances of the layers above and below an interface.
    fn impedances(&self, interface: usize) -> [f64; 2] {
        [interface, interface + 1].map(|layer| self.layers[layer].waves.impedance)
    }

    /// u^{k+1} of a node of an interface if either layer were by itself.
    fn faces(&self, before: &Level<1>, now: &Level<1>, interface: usize, i: usize) -> [f64; 2] {
        let last = self.grid.layers[interface].last();
        [last, last + 1].map(|j| self.by_itself(before, now, j, i))
    }
}

impl Rakhmatulin {
    /// Displacement of node (j, i) at level k+1, if the surface were free of stress.
    ///
    /// * `before`, `now`: levels k−1 and k
    fn next(&self, before: &Level<1>, now: &Level<1>, j: usize, i: usize) -> [f64; 1] {
        let Some(interface) = self.grid.interface_of(j) else {
            return [self.by_itself(before, now, j, i)];
        };
        let faces = self.faces(before, now, interface, i);
        [scheme::joined(scheme::shares(self.impedances(interface)), faces)]
    }
}

impl Scheme<1> for Rakhmatulin {
    fn stride(&self) -> usize {
        self.grid.nr()
    }

    fn advance(&self, before: &Level<1>, now: &Level<1>, next: &mut Level<1>, part: [usize; 2]) {
        node_by_node(next, part, |j, i| self.next(before, now, j, i));
    }

    fn compliance(&self, _i: usize) -> f64 {
        scheme::compliance(self.grid.dt(), self.grid.dt())
    }

    fn traction(&self, before: &Level<1>, now: &Level<1>, interface: usize, i: usize) -> [f64; 2] {
        let [upper, lower] = self.faces(before, now, interface, i);
        [scheme::traction_weight(self.impedances(interface), self.grid.dt()) * (upper - lower), 0.0]
    }

    fn energies(&self, earlier: &Level<1>, later: &Level<1>) -> Vec<TargetEnergy> {
        let Grid { ref area, ref face, .. } = self.grid;
        let dt = self.grid.dt();
        let levels = [&earlier[0], &later[0]];
        // share of the conservative part, 4/3, in α
        let conservative = self.corner.map_or(0.0, |corner| 1.0 - corner.share);
        let mut energies = vec![TargetEnergy::default(); self.layers.len()];
        for j in 0..=self.grid.nz {
            let number = self.grid.layer_of(j);
            let Plate { waves, stiffness, .. } = &self.layers[number];
            let energy = &mut energies[number];
            for i in 0..self.grid.nr() {
                let [earlier_u, later_u] = levels.map(|u| u[[j, i]]);
                let mass = self.mass(j, i);
                energy.kinetic += scheme::kinetic_energy(mass, later_u - earlier_u, dt);
                let added = self.corner(earlier, later, [conservative, 0.0], j, i);
                energy.strain += scheme::corner_energy(mass, earlier_u, added, dt);
                // what lies below the last row: half a row of cells, above a free back; else nothing
                let layer = &self.grid.layers[number];
                let (below, share) = if j == layer.last() { (j, layer.overhang) } else { (j + 1, 1.0) };
                let axial_differences = levels.map(|u| u[[below, i]] - u[[j, i]]);
                energy.strain += waves.impedance * scheme::axial_energy(area[i], axial_differences, dt);
                if i + 1 < self.grid.nr() {
                    let shear_differences = levels.map(|u| {
                        let mean = |i: usize| 0.5 * (u[[j, i]] + u[[below, i]]);
                        mean(i + 1) - mean(i)
                    });
                    energy.strain += scheme::shear_energy(share * stiffness * face[i], shear_differences);
                }
            }
        }
        energies
    }

    fn show(&self, levels: Levels<'_, 1>, pressure: &[f64], j: usize, i: usize) -> impl FnMut(Field) -> f64 {
        let [before, now, next] = levels;
        move |field| match field {
            Field::Displacement => now[0][[j, i]],
            Field::Velocity => scheme::velocity(before[0][[j, i]], next[0][[j, i]], self.grid.dt()),
            Field::Stress if j == 0 => pressure[i],
            Field::Stress => match self.grid.interface_of(j) {
                Some(interface) => {
                    let last = self.grid.layers[interface].last();
                    let cells = [(interface, last - 1), (interface + 1, last + 1)].map(|(layer, j)| {
                        let impedance = self.layers[layer].waves.impedance;
                        impedance * (now[0][[j, i]] - now[0][[j + 1, i]]) / self.grid.dt()
                    });
                    scheme::interface_stress(scheme::shares(self.impedances(interface)), cells)
                }
                None => {
                    let u = self.around(now, j, i);
                    let impedance = self.layers[self.grid.layer_of(j)].waves.impedance;
                    impedance * scheme::stress(u(-1, 0), u(1, 0), self.grid.dt())
                }
            },
            other => unreachable!("a case of this model does not show {other:?}"),
        }
    }

    fn surface_strain(&self, _now: &Level<1>, pressure: f64, _i: usize) -> f64 {
        pressure.abs()
    }

    fn look(
        &self,
        [u]: &Level<1>,
        j: usize,
        columns: Range<usize>,
        mut take: impl FnMut(usize, f64, Option<Stress>),
    ) {
        let layer = self.grid.layer(j);
        // no cell lies between the two rows of an interface
        if j != layer.last() {
            columns.for_each(|i| take(i, (u[[j + 1, i]] - u[[j, i]]).abs() / layer.dz, None));
        }
    }

    fn backing_strain(&self, level: &Level<1>, i: usize) -> f64 {
        if self.grid.back == Back::Free {
            return 0.0;
        }
        let u = self.around(level, self.grid.nz, i);
        -scheme::stress(u(-1, 0), u(1, 0), self.grid.layer(self.grid.nz).dz)
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;

    use super::*;
    use crate::{
        geometry::Geometry,
        grid::{MeshKind, Spacing},
        model::{noise::Noise, scheme::Order},
    };

    /// Kinetic and strain energy, what damping has taken, and the work of the surface, after some steps of a surface pushed at
    /// random.
    fn balance(geometry: Geometry, corner: Option<Corner>) -> [f64; 3] {
        let spacing = Spacing { dr: 0.1, dz: 0.19, layer_rows: Some(7) };
        let grid = Grid::new(geometry, MeshKind::Matched, spacing, 9, 7);
        let theory = Rakhmatulin::new(grid.clone(), 0.5, corner);
        let rest = || [Array2::zeros((8, 9))];
        let [mut before, mut now, mut next]: [Level<1>; 3] = [rest(), rest(), rest()];
        let (mut damped, mut work, mut noise) = (0.0, 0.0, Noise(1));
        for _ in 0..60 {
            for ((j, i), u) in next[0].indexed_iter_mut() {
                *u = theory.next(&before, &now, j, i)[0];
                if j == 0 {
                    let push = noise.unit() - 0.5;
                    *u += push;
                    work += 0.5 * grid.area[i] * push / theory.compliance(i) * (*u - before[0][[0, i]]);
                }
            }
            let taken = theory.damped([&before, &now, &next]);
            assert!(corner.is_some() || taken == 0.0);
            damped += taken;
            (before, now, next) = (now, next, before);
        }
        let energy = theory.energy(&before, &now);
        [energy.kinetic + energy.strain, damped, work]
    }

    #[test]
    fn damping_takes_what_the_surface_has_given_and_the_target_does_not_have() {
        for geometry in [Geometry::Axisymmetric, Geometry::Plane] {
            for (order, damping) in
                [(Order::Second, 0.0), (Order::Second, 1.0), (Order::Fourth, 0.0), (Order::Fourth, 4.0 / 3.0)]
            {
                let [energy, damped, work] = balance(geometry, Corner::new(order, damping));
                let rest = work - energy - damped;
                assert!(rest.abs() < 1e-12 * work, "{geometry:?}, {order:?}, {damping}: {rest:e} of {work}");
                // random pushes make waves that the mesh does not resolve
                assert!(if damping > 0.0 { damped > 1e-3 * work } else { damped.abs() < 1e-13 * work });
            }
        }
    }
}
