//! The data of a case, checked when a [`Case`](super::Case) is built.

use serde::{Deserialize, Serialize};

use super::{
    FrameSteps, Frames, Value,
    quantity::{self, si_unit},
    resolved,
};
use crate::{
    contact::Rule,
    geometry::Geometry,
    grid::{Grid, MeshKind, Spacing},
    material::{Material, Preset},
    model::{
        Field, Gauges, Line, ModelKind,
        scheme::{Corner, Order},
    },
    recording::Compression,
    shape::{Head, Shape},
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
    /// True if the case names its unit of length, because its indenter has none.
    pub has_length_unit: bool,
    /// The target.
    pub target: Target,
    /// The indenter.
    pub indenter: Body,
    /// The impact.
    pub impact: Impact,
    /// The mesh.
    pub mesh: Mesh,
    /// When the run ends.
    pub run: Run,
    /// Channels and frames of the recording.
    pub record: Record,
    /// Sizes derived from the rest.
    pub sizes: Sizes,
}

impl Parameters {
    /// The case as TOML with every default and derived choice explicit; it repeats the run.
    pub fn resolved_toml(&self) -> String {
        resolved::toml(self)
    }

    /// The case as JSON with every default and derived choice explicit.
    pub fn resolved_json(&self) -> serde_json::Value {
        resolved::json(self)
    }

    /// The shape of the indenter.
    pub fn shape(&self) -> Shape {
        self.indenter.shape()
    }

    /// True if contact gets to the edge of the head within the run, on a flat surface.
    pub fn reaches_edge(&self) -> bool {
        let reach = self.shape().reach(self.impact.velocity * self.run.end_time);
        self.indenter.radius.is_some_and(|radius| reach >= radius)
    }

    /// The mesh.
    pub fn grid(&self) -> Grid {
        let Sizes { dr, dz, nr, nz, layer, .. } = self.sizes;
        let spacing = Spacing { dr, dz, layer_rows: layer.then_some(nz) };
        let grid = Grid::new(self.geometry, self.mesh.kind, spacing, nr, nz);
        match self.model {
            ModelKind::Rakhmatulin => grid,
            ModelKind::Elastic => grid.with_cells_between_nodes(),
        }
    }

    /// Speed of the fastest waves along the surface \[c_p\].
    pub fn wave_speed(&self) -> f64 {
        self.model.lateral_speed(self.target.material.shear_wave_speed)
    }

    /// The mixed-derivative correction of the scheme with one displacement, if there is one.
    pub fn corner(&self) -> Option<Corner> {
        Corner::new(self.mesh.order?, self.mesh.damping)
    }

    /// Memory of the displacements at all levels that are kept \[bytes\].
    pub(crate) fn field_memory(&self) -> u64 {
        let numbers = self.model.numbers_per_node(self.corner().as_ref()) as u64;
        numbers * 8 * (self.sizes.nr as u64 + 1) * (self.sizes.nz as u64 + 1)
    }

    /// The steps that are frames.
    pub fn frames(&self) -> FrameSteps {
        self.record.frames.of(self.sizes.steps, self.sizes.dt)
    }

    /// Points and lines in the target that are recorded.
    pub fn gauges(&self) -> Gauges {
        let Record { points, lines, .. } = &self.record;
        Gauges { points: points.clone(), lines: lines.clone() }
    }

    /// Units of what is recorded.
    pub fn units(&self) -> Units {
        Units::new(self.geometry, self.scales)
    }

    /// The dimensionless number of a text: a plain one, in a physical case a quantity.
    ///
    /// # Errors
    ///
    /// What can be written instead.
    pub fn read_number(&self, dimension: Dimension, text: &str) -> Result<f64, String> {
        match self.scales {
            None => text.trim().parse().map_err(|_| "a number is needed".to_owned()),
            Some(scales) => quantity::parse(text, dimension, self.geometry)
                .map(|si| scales.reduce(dimension, si))
                .map_err(|_| format!("write {}", quantity::allowed(dimension, self.geometry))),
        }
    }

    /// A dimensionless number as case files of this case have it: plain, or as a quantity.
    pub fn written(&self, dimension: Dimension, x: f64) -> Value {
        match self.scales {
            Some(scales) if x.is_finite() => {
                let unit = si_unit(dimension, self.geometry);
                Value::String(format!("{:?} {unit}", scales.expand(dimension, x)))
            }
            _ => Value::Float(x),
        }
    }
}

/// The elastic layer or half-space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Thickness h of a layer \[R\]; `None` for a half-space.
    pub thickness: Option<f64>,
    /// The material.
    pub material: Material,
}

/// The rigid indenter.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Form of the head.
    pub head: Head,
    /// Radius of the punch \[R\]; `None` if unbounded.
    pub radius: Option<f64>,
    /// Mass M \[πγR³; plane, of the half x ≥ 0, γR²\], may be infinite.
    pub mass: f64,
    /// Material, if it is named: how far the body is from rigid, see [`crate::rigidity`].
    pub material: Option<&'static Preset>,
}

/// The impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Impact {
    /// Velocity V0 \[c_p\].
    pub velocity: f64,
    /// Contact rule.
    pub contact: Rule,
}

/// The mesh as given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Placement of nodes.
    pub kind: MeshKind,
    /// Nodes across the radius or unit length.
    pub cells: usize,
    /// Order of accuracy for oblique waves of model `rakhmatulin`.
    pub order: Option<Order>,
    /// Damping σ of what the mesh does not resolve: oblique waves, 0 to 4/3; in model `elastic` waves along r, 0 to
    /// [`crate::model::elastic::largest_damping`].
    pub damping: f64,
}

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Time at the last step, but for rounding to whole steps \[R/c_p\].
    pub end_time: f64,
    /// Event that ends the run earlier.
    pub stop: Stop,
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
    /// Fields recorded in frames.
    pub fields: Vec<Field>,
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

impl ViewChannel {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Field, Self::Image, Self::Scene, Self::Fronts, Self::Tf, Self::Profile];
}

/// Sizes that follow from a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sizes {
    /// Radial distance of nodes \[R\].
    pub dr: f64,
    /// Axial distance of nodes \[R\].
    pub dz: f64,
    /// Time step \[R/c_p\].
    pub dt: f64,
    /// Number K of the last step.
    pub steps: u64,
    /// Nodes along r.
    pub nr: usize,
    /// Axial steps down to the backing, or in a half-space to a depth whose waves do not return.
    pub nz: usize,
    /// Outer radius of the mesh \[R\].
    pub outer_radius: f64,
    /// Depth of the mesh \[R\]: the thickness of a layer.
    pub depth: f64,
    /// Largest radius of contact, partial contact included, on a flat surface \[R\].
    pub contact_reach: f64,
    /// True for a layer, false for a half-space.
    pub layer: bool,
}

impl Body {
    /// The shape.
    pub fn shape(&self) -> Shape {
        Shape::new(self.head.clone(), self.radius)
    }
}
