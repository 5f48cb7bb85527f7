//! The data of a case, checked when a [`Case`](super::Case) is built.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{
    FrameSteps, Frames, Sensor, numbers,
    rows::{self, LARGEST_CHANGE},
    values::Checked,
};
use crate::{
    contact::{Rule, load::Load},
    geometry::Geometry,
    grid::{Back, Bond, Grid, MeshKind, Rim, Spacing},
    material::{BondStrength, Elastic, Material, Preset, Stiffness, Strengths, Waves},
    model::{
        Field, Gauges, Line, ModelKind,
        scheme::{Corner, Order},
        strength::Strength,
    },
    recording::Compression,
    shape::{Head, Shape, Tip, hertz_depth},
    units::{Dimension, Scales, Units},
};

/// The data of a case.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// Title of the run.
    pub title: String,
    /// Theory of the target.
    pub model: ModelKind,
    /// Symmetry.
    pub geometry: Geometry,
    /// SI values of the units of a physical case.
    pub scales: Option<Scales>,
    /// The target.
    pub target: Target,
    /// The indenter.
    pub indenter: Body,
    /// The impact.
    pub impact: Impact,
    /// What presses in place of an indenter, which then is a stand-in without motion.
    pub load: Option<Load>,
    /// The mesh.
    pub mesh: Mesh,
    /// When the run ends.
    pub run: Run,
    /// Channels and frames of the recording.
    pub record: Record,
    /// Sizes derived from the rest.
    pub sizes: Sizes,
    /// All values, defaults and derived ones included.
    pub(super) resolved: Checked,
}

impl Parameters {
    /// The shape of the indenter.
    pub fn shape(&self) -> Shape {
        self.indenter.shape()
    }

    /// True if contact gets to the edge of the head within the run, on a flat surface.
    pub fn reaches_edge(&self) -> bool {
        let reach = self.shape().reach(self.impact.velocity * self.run.end_time);
        self.indenter.radius.is_some_and(|radius| reach >= radius)
    }

    /// A radius, or that of a rim inside it \[R\].
    pub(crate) fn within_rims(&self, radius: f64) -> f64 {
        self.target.radius.into_iter().chain(self.indenter.rim()).fold(radius, f64::min)
    }

    /// Estimated largest contact radius \[R\]: what the depth V0·t reaches, of a ball of finite mass no more than by Hertz, `a² = ρw`.
    pub(crate) fn likely_radius(&self) -> f64 {
        if let Some(load) = &self.load {
            return load.radius.unwrap_or(1.0 / self.mesh.cells as f64);
        }
        let (velocity, mass) = (self.impact.velocity, self.indenter.mass);
        let reach = self.within_rims(self.shape().reach(velocity * self.run.end_time));
        let Tip::Round(nose_radius) = self.indenter.head.tip() else { return reach };
        if self.geometry == Geometry::Plane {
            return reach;
        }
        let depth = hertz_depth(0.5 * mass * velocity * velocity, nose_radius, self.modulus());
        reach.min((nose_radius * depth).sqrt())
    }

    /// What every computed layer of a body is made of, as it is computed.
    ///
    /// * `layers`: their rows
    pub(crate) fn materials(
        &self,
        body: &Target,
        layers: &[LayerSizes],
    ) -> Vec<crate::model::body::Material> {
        let material = |(layer, rows): (TargetLayer, &LayerSizes)| {
            // on equal rows waves take whole steps, at the same impedance and c_s
            let speed = if self.mesh.grading.is_some() { layer.wave_speed } else { rows.dz / self.sizes.dt };
            let stiffness = match layer.stiffness.is_isotropic() && rows.speed_change != 0.0 {
                true => Stiffness::isotropic(layer.waves.shear / speed),
                false => layer.stiffness,
            };
            crate::model::body::Material { impedance: layer.waves.impedance, speed, stiffness }
        };
        body.computed().into_iter().zip(layers).map(material).collect()
    }

    /// What every computed layer of a body bears, as far as it is known.
    pub(crate) fn strengths(&self, body: &Target) -> Vec<Strength> {
        let computed = body.computed();
        let Some(scales) = self.scales else { return vec![Strength::default(); computed.len()] };
        let of = |strength: f64| scales.reduce(Dimension::Stress, strength);
        let layer = |TargetLayer { strengths, bond_strength, .. }: TargetLayer| Strength {
            yielding: strengths.yield_strength.map(of),
            tensile: strengths.tensile_strength.map(of),
            bond: bond_strength.map(|BondStrength { normal, shear }| [normal, shear].map(of)),
        };
        computed.into_iter().map(layer).collect()
    }

    /// Modulus of the contact, `1/M = 1/M_target + 1/M_indenter` of the indentation moduli of both; M_target under a rigid indenter \[γc_p²\].
    pub(crate) fn modulus(&self) -> f64 {
        let of = |body: &Target| {
            let layer = &body.layers[0];
            layer.waves.impedance * layer.wave_speed * layer.stiffness.indentation_modulus()
        };
        let target = of(&self.target);
        self.indenter
            .striker
            .as_ref()
            .map_or(target, |striker| 1.0 / (1.0 / target + 1.0 / of(&striker.body)))
    }

    /// The mesh of an indenter that gives: its nodes stand on the radii of the target's, and z is upwards.
    pub fn striker_grid(&self) -> Option<Grid> {
        let Striker { body, .. } = self.indenter.striker.as_ref()?;
        let Sizes { widths, striker, dt, .. } = &self.sizes;
        let BodySizes { nr, layers } = striker.as_ref()?;
        Some(body.graded_grid(self.geometry, &widths[..=*nr], layers, *dt))
    }

    /// The mesh of the target.
    pub fn grid(&self) -> Grid {
        let &Sizes { dr, dz, dt, nr, nz, has_back, ref layers, ref widths, .. } = &self.sizes;
        let spacing = Spacing { dr, dz, layer_rows: has_back.then_some(nz) };
        let computed = self.target.computed();
        if let Some(widths) = widths.get(..=nr) {
            return self.target.graded_grid(self.geometry, widths, layers, dt);
        }
        let rows: Vec<_> =
            layers.iter().zip(&computed).map(|(rows, layer)| (rows.steps, rows.dz, layer.bond)).collect();
        let grid = Grid::new(self.geometry, self.mesh.kind, spacing, nr, nz);
        let grid = grid.with_layers(dt, &rows, self.target.back);
        if self.model.has_shear() { grid.with_cells_between_nodes() } else { grid }
    }

    /// What the schemes need to know of every computed layer.
    pub fn waves(&self) -> Vec<Waves> {
        self.target.computed().iter().map(|layer| layer.waves).collect()
    }

    /// Speed of the fastest waves along r in any layer \[c_p\].
    pub fn wave_speed(&self) -> f64 {
        let computed = self.target.computed();
        match self.mesh.grading {
            // no speed is changed
            Some(_) => rows::fastest(self.model, &computed),
            None => rows::lateral_speed(self.model, &computed, &self.sizes.layers, self.sizes.dt),
        }
    }

    /// True for a target that the tiled engine computes: of equal cells, regular ([`Target::is_regular`]), under a rigid indenter.
    pub fn is_tiled(&self) -> bool {
        self.mesh.grading.is_none() && self.target.is_regular() && self.indenter.striker.is_none()
    }

    /// Speed of the fastest waves along the surface of the struck layer \[c_p\].
    pub fn surface_speed(&self) -> f64 {
        self.model.lateral_speed(1.0, self.target.material.shear_wave_speed)
    }

    /// The mixed-derivative correction of the scheme with one displacement, if there is one.
    pub fn corner(&self) -> Option<Corner> {
        Corner::new(self.mesh.order?, self.mesh.damping)
    }

    /// Memory of the displacements at all levels that are kept \[bytes\].
    pub(crate) fn field_memory(&self) -> u64 {
        let numbers = self.model.numbers_per_node(self.corner().as_ref()) as u64;
        let striker = self.sizes.striker.as_ref().map_or(0, BodySizes::nodes);
        numbers * 8 * ((self.sizes.nr as u64 + 1) * (self.sizes.nz as u64 + 1) + striker)
    }

    /// The steps that are frames.
    pub fn frames(&self) -> FrameSteps {
        self.record.frames.of(self.sizes.steps, self.sizes.dt)
    }

    /// Points and lines in the target that are recorded: after the points of the case those of its sensors.
    pub fn gauges(&self) -> Gauges {
        let Record { points, lines, .. } = &self.record;
        let points = points.iter().copied().chain(self.sensor_points()).collect();
        Gauges { points, lines: lines.clone(), columns: self.shown_columns() }
    }

    /// Units of what is recorded.
    pub fn units(&self) -> Units {
        Units::new(self.geometry, self.scales)
    }

    /// Times or places and numbers of a CSV file of two columns, dimensionless; in a physical case each with its unit in the heading.
    ///
    /// * `of`: dimensions of the columns
    ///
    /// # Errors
    ///
    /// What is wrong with the file.
    pub fn read_table(&self, path: &Path, of: [Dimension; 2]) -> Result<Vec<[f64; 2]>, String> {
        super::profile::read_pairs(path, &self.system(), of)
    }

    /// The dimensionless number of a text: a plain one, in a physical case a quantity.
    ///
    /// # Errors
    ///
    /// What can be written instead.
    pub fn read_number(&self, dimension: Dimension, text: &str) -> Result<f64, String> {
        match self.scales {
            None => text.trim().parse().map_err(|_| "a number is needed".to_owned()),
            Some(scales) => numbers::parse(text, dimension, self.geometry)
                .map(|si| scales.reduce(dimension, si))
                .map_err(|_| format!("write {}", numbers::allowed(dimension, self.geometry))),
        }
    }
}

/// A body of elastic layers, the last of which may be a half-space: the target.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Thickness h of all layers together \[R\]; `None` if the last one is a half-space.
    pub thickness: Option<f64>,
    /// The material of the struck layer, whose density and wave speed are units.
    pub material: Material,
    /// Layers as given, from the surface down, at least one.
    pub layers: Vec<TargetLayer>,
    /// Far side of the last layer.
    pub back: Back,
    /// Where it ends along r, if it does \[R\].
    pub radius: Option<f64>,
    /// What holds it there.
    pub rim: Rim,
}

/// A layer of the target.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetLayer {
    /// Name of its material, or `layer` and its number.
    pub name: String,
    /// Thickness \[R\]; `None` for a half-space.
    pub thickness: Option<f64>,
    /// The material in SI units, in a physical case.
    pub si: Option<Elastic>,
    /// Density \[γ\].
    pub density: f64,
    /// Longitudinal wave speed \[c_p\].
    pub wave_speed: f64,
    /// Its impedance, and its shear wave speed in units of c_p of the struck layer.
    pub waves: Waves,
    /// Its stiffness.
    pub stiffness: Stiffness,
    /// How it is joined to the layer above.
    pub bond: Bond,
    /// What it bears; nothing computed depends on it.
    pub strengths: Strengths,
    /// What its bond to the layer above bears, if it is known.
    pub bond_strength: Option<BondStrength>,
}

impl TargetLayer {
    /// Speed of the fastest waves along r, or in any direction if that is more \[c_p\].
    ///
    /// * `speed`: of longitudinal waves along z, as they are computed
    pub(super) fn lateral_speed(&self, model: ModelKind, speed: f64) -> f64 {
        model.lateral_speed(speed * self.stiffness.lateral.max(1.0).sqrt(), self.waves.shear)
    }

    /// True if no wave sees where the layer above ends and this one begins, and both bear as much as the bond.
    pub(super) fn continues(&self, above: &Self) -> bool {
        self.bond == Bond::Welded
            && self.bond_strength.is_none()
            && self.strengths == above.strengths
            && (self.density, self.wave_speed, self.waves, self.stiffness)
                == (above.density, above.wave_speed, above.waves, above.stiffness)
    }
}

impl Target {
    /// The mesh of sizes that are listed.
    ///
    /// * `widths`: of its columns, one more than there are nodes
    /// * `layers`: rows of every computed layer
    fn graded_grid(&self, geometry: Geometry, widths: &[f64], layers: &[LayerSizes], dt: f64) -> Grid {
        let layers = layers.iter().zip(self.computed());
        let layers: Vec<_> = layers.map(|(rows, layer)| (rows.heights(), layer.bond)).collect();
        let (rim, has_back) = (self.radius.map(|_| self.rim), self.thickness.is_some());
        Grid::graded(geometry, widths.to_vec(), dt, &layers, self.back, has_back, rim)
    }

    /// The layers that are computed: of welded ones of the same constants, one.
    pub fn computed(&self) -> Vec<TargetLayer> {
        let join = |mut joined: TargetLayer, layer: &TargetLayer| {
            joined.thickness = joined.thickness.zip(layer.thickness).map(|(above, below)| above + below);
            if !joined.name.split(" + ").any(|name| name == layer.name) {
                joined.name = format!("{} + {}", joined.name, layer.name);
            }
            joined
        };
        let alike = self.layers.chunk_by(|above, below| below.continues(above));
        alike.map(|layers| layers[1..].iter().fold(layers[0].clone(), join)).collect()
    }

    /// Number of the first given layer of a computed one.
    pub(super) fn first_of(&self, computed: usize) -> usize {
        let alike = self.layers.chunk_by(|above, below| below.continues(above));
        alike.take(computed).map(<[_]>::len).sum()
    }

    /// True for a single layer on a rigid back or half-space, alike in all directions and without end, which closed forms and estimates are about.
    pub fn is_simple(&self) -> bool {
        self.back == Back::Rigid && self.computed().len() == 1 && self.is_regular()
    }

    /// True if it has no end along r, and layers that are alike in all directions.
    pub fn is_regular(&self) -> bool {
        self.radius.is_none() && self.layers.iter().all(|layer| layer.stiffness.is_isotropic())
    }

    /// Slack for the width of columns: at a free rim they are wider than waves run in a step, by stability, see [`crate::model::body`].
    pub(super) fn slack(&self) -> f64 {
        if self.radius.is_some() && self.rim == Rim::Free { 1.0 / 0.97 } else { 1.0 }
    }

    /// The largest c_s/c_p of a layer, in a target of several after any change of wave speeds.
    pub(super) fn largest_ratio(&self) -> f64 {
        let ratios = self.layers.iter().map(|layer| layer.stiffness.slowness());
        let largest = ratios.fold(0.0, f64::max);
        if self.computed().len() > 1 { largest * (1.0 + LARGEST_CHANGE) } else { largest }
    }

    /// Speed of the fastest shear waves \[c_p\].
    pub fn fastest_shear(&self) -> f64 {
        self.layers.iter().map(|layer| layer.waves.shear).fold(0.0, f64::max)
    }
}

/// The indenter.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Form of the head.
    pub head: Head,
    /// Radius of the punch \[R\]; `None` if unbounded.
    pub radius: Option<f64>,
    /// Mass M \[πγR³; plane, of the half x ≥ 0, γR²\], may be infinite.
    pub mass: f64,
    /// Material, if it is named: how far the body is from rigid, see [`crate::advice::rigidity`].
    pub material: Option<&'static Preset>,
    /// What it is made of, if it gives.
    pub striker: Option<Striker>,
}

/// An indenter that gives: layers from the nose up, in units of the struck layer, of finite radius and with a free back, unless the last is a
/// half-space or something is bonded to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Striker {
    /// Its layers, and its radius.
    pub body: Target,
    /// Mass of a rigid body that is bonded to its back \[πγR³; plane, of the half x ≥ 0, γR²\].
    pub weight: Option<f64>,
}

/// The impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Velocity V0 \[c_p\].
    pub velocity: f64,
    /// Contact rule.
    pub contact: Rule,
}

/// The mesh as given.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Mesh {
    /// Placement of nodes.
    pub kind: MeshKind,
    /// Nodes across the radius or unit length; on a graded mesh as many as its cells near the contact would be.
    #[serde(default)]
    pub cells: usize,
    /// How cells grow, on a graded mesh.
    #[serde(skip)]
    pub grading: Option<Grading>,
    /// Order of accuracy for oblique waves of model `rakhmatulin`.
    pub order: Option<Order>,
    /// Damping σ of what the mesh does not resolve: oblique waves, 0 to 4/3; in model `elastic` waves along r, 0 to
    /// [`crate::model::elastic::largest_damping`].
    pub damping: f64,
}

impl Mesh {
    /// The key that says how fine it is, and its number.
    pub fn density(&self) -> (&'static str, usize) {
        match self.grading {
            Some(Grading { contact_cells, .. }) => ("mesh.contact_cells", contact_cells),
            None => ("mesh.cells", self.cells),
        }
    }
}

/// A graded mesh as given or derived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grading {
    /// Cells across the diameter of the largest contact.
    pub contact_cells: usize,
    /// Ratio of neighbouring cells beyond the near zone.
    pub ratio: f64,
    /// Radius and depth of the near zone \[R\].
    pub near: [f64; 2],
    /// Largest size of cells, if it is given \[R\].
    pub largest: Option<f64>,
}

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Time at the last step, but for rounding to whole steps \[R/c_p\].
    pub end_time: f64,
    /// Event that ends the run earlier.
    pub stop: Stop,
    /// Number of impacts; a simulation is of the first, and `percuss run` computes them all.
    pub bounces: u32,
    /// Wall time from one checkpoint to the next, if given; 0 for none. It changes no result \[s\].
    pub checkpoint_every: Option<f64>,
}

/// Event that ends a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// None: the run lasts to its end time.
    Never,
    /// The interface first needs tension.
    Extension,
    /// The indenter leaves the target.
    Separation,
}

/// Channels and frames of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Steps between messages of interface stress; the last step has one too.
    pub interface_every: u64,
    /// Radii of the probes \[R\].
    pub probes: Vec<f64>,
    /// Points `[r, z]` in the target, recorded in every step \[R\].
    pub points: Vec<[f64; 2]>,
    /// Lines in the target, recorded with the interface stress.
    pub lines: Vec<Line>,
    /// Sensors on the faces, recorded in every step.
    pub sensors: Vec<Sensor>,
    /// Tension of an interface of layers from which on it is an event \[γc_p²\].
    pub layer_tension: f64,
    /// Fields recorded in frames.
    pub fields: Vec<Field>,
    /// Fields show the target out to this radius, may be infinite: to the outer radius of the mesh \[R\].
    pub r_max: f64,
    /// Distance of the nodes that fields show, along r and z \[nodes\].
    pub field_every: usize,
    /// Channels for viewers, at frames.
    pub views: Vec<ViewChannel>,
    /// Steps at which fields and energy are shown.
    pub frames: Frames,
    /// Compression of chunks.
    pub compression: Compression,
    /// Seconds of log time per unit of time: R/c_p, in a physical case a second.
    pub playback_rate: f64,
}

/// A channel for viewers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ViewChannel {
    /// `/view/field`: the recorded fields as a grid.
    Field,
    /// `/view/image`: the first recorded field as a picture.
    Image,
    /// `/view/scene`: indenter, surface, drag.
    Scene,
    /// `/view/fronts`: wave fronts by geometry.
    Fronts,
    /// `/view/tf`: position of the indenter.
    Tf,
    /// `/view/profile`: the surface for x–y plots.
    Profile,
}

/// Rows of a computed layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerSizes {
    /// Axial steps from its first row of nodes to its last one, in a half-space down to a depth whose waves do not return.
    pub steps: usize,
    /// What lies below its last row, in rows of cells: half a one above a free back, else nothing.
    pub overhang: f64,
    /// Axial distance of nodes \[R\].
    pub dz: f64,
    /// Relative change of its longitudinal wave speed that makes its transit time that many steps, at the same impedance.
    pub speed_change: f64,
    /// Heights of its rows of cells \[R\]; none if all are `dz`.
    pub heights: Vec<f64>,
}

impl LayerSizes {
    /// Axial steps through it: whole ones, and above a free back half a one more.
    pub fn rows(&self) -> f64 {
        self.steps as f64 + self.overhang
    }

    /// Heights of its rows of cells \[R\].
    pub(super) fn heights(&self) -> Vec<f64> {
        if self.heights.is_empty() { vec![self.dz; self.steps] } else { self.heights.clone() }
    }

    /// Thickness of its rows \[R\].
    pub(super) fn thickness(&self) -> f64 {
        match self.heights.last() {
            Some(last) => self.heights.iter().sum::<f64>() + self.overhang * last,
            None => self.rows() * self.dz,
        }
    }
}

/// Sizes that follow from a case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Sizes {
    /// Radial distance of nodes \[R\].
    pub dr: f64,
    /// Axial distance of nodes in the struck layer \[R\].
    pub dz: f64,
    /// Time step \[R/c_p\].
    pub dt: f64,
    /// Number K of the last step.
    pub steps: u64,
    /// Nodes along r.
    pub nr: usize,
    /// Number of the last row: axial steps down to a rigid backing, to half a step above a free one, or in a half-space to a depth whose waves do
    /// not return, and one more row at each interface.
    pub nz: usize,
    /// Outer radius of the mesh \[R\].
    pub outer_radius: f64,
    /// Depth of the mesh \[R\]: the thickness of the layers.
    pub depth: f64,
    /// Largest radius of contact, partial contact included, on a flat surface \[R\].
    pub contact_reach: f64,
    /// Rows, by depth, of a half-space that strains and tension of interfaces are taken of, and those that are covered for what is recorded,
    /// at the last level; waves need more of them before ([`crate::model::Dependence`]).
    #[serde(skip)]
    pub strained: usize,
    /// See `strained`.
    #[serde(skip)]
    pub covered: usize,
    /// True for layers, false if the last one is a half-space.
    #[serde(rename = "layer")]
    pub has_back: bool,
    /// Rows of the computed layers, from the surface down.
    #[serde(skip)]
    pub layers: Vec<LayerSizes>,
    /// Widths of the cells of a mesh that is graded or ends, from the axis outwards, one more than there are nodes in the wider of target and
    /// indenter \[R\].
    #[serde(skip)]
    pub widths: Vec<f64>,
    /// Sizes of the mesh of an indenter that gives.
    #[serde(skip)]
    pub striker: Option<BodySizes>,
}

impl Sizes {
    /// Numbers of interfaces in the target, and in an indenter that gives.
    pub fn interfaces(&self) -> [usize; 2] {
        let striker = self.striker.as_ref().map_or(0, |striker| striker.layers.len());
        [self.layers.len(), striker].map(|layers| layers.saturating_sub(1))
    }
}

/// Sizes of the mesh of an indenter that gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodySizes {
    /// Nodes along r.
    pub nr: usize,
    /// Rows of the computed layers, from the nose up.
    pub layers: Vec<LayerSizes>,
}

impl BodySizes {
    /// Number of its nodes.
    pub fn nodes(&self) -> u64 {
        (self.nr * self.layers.iter().map(|layer| layer.steps + 1).sum::<usize>()) as u64
    }
}

impl Body {
    /// Radius of the rim of one that gives \[R\].
    pub(super) fn rim(&self) -> Option<f64> {
        self.striker.as_ref()?.body.radius
    }

    /// The shape.
    pub fn shape(&self) -> Shape {
        Shape::new(self.head.clone(), self.radius)
    }
}
