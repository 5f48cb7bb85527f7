//! Cases: what to compute and what to record, read from TOML and checked.
//!
//! A [`Case`] that exists is valid and complete: every default is filled in and every derived size is known. Reading
//! reports all errors of a file at once ([`CaseErrors`]), each at its place in the text.
//!
//! * `document`: TOML text with spans, `--set` overrides, one section at a time
//! * `read`, `read_indenter`: from a document to a case, section by section
//! * `frames`: which steps are frames
//! * `sizes`: what follows from it
//! * `resolved`: from a case back to TOML, with nothing left implicit
//! * `builtin`: the cases of the paper

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{
    contact::Rule,
    grid::{Geometry, Grid, MeshKind, Spacing},
    material::Material,
    model::{Extent, Field, ModelKind},
    recording::Compression,
    shape::{Head, Profile, Shape},
    units::Scales,
};

pub mod builtin;
mod document;
mod frames;
mod read;
mod read_indenter;
mod resolved;
mod sizes;

pub use document::{CaseErrors, Problem};
pub use frames::{FrameSteps, Frames};

/// A checked, complete case.
#[derive(Clone, Debug)]
pub struct Case {
    /// What the run is about.
    pub title: String,
    /// Theory of the target.
    pub model: ModelKind,
    /// Symmetry.
    pub geometry: Geometry,
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
    /// What is recorded.
    pub record: Record,
    /// What follows from the rest.
    pub sizes: Sizes,
    /// The case file as it was given.
    pub text: String,
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
    /// Form of the head, in the parameters of the case file.
    pub head: HeadKind,
    /// Radius of the punch \[R\]; `None` if unbounded.
    pub radius: Option<f64>,
    /// Mass M \[πγR³, plane γR²\], may be infinite.
    pub mass: f64,
    /// SI value of the length unit \[m\].
    pub scale_radius: Option<f64>,
}

/// Form of the head as a case file describes it: for shapes that are named by how fast contact spreads.
#[derive(Clone, Debug, PartialEq)]
pub enum HeadKind {
    /// `f = 0`.
    Flat,
    /// `r*² = k·t` at constant V0.
    Paraboloid {
        /// k
        curvature: f64,
    },
    /// `r* = V*·t` at V0 = 1.
    Cone {
        /// V* = tan φ
        spread_rate: f64,
    },
    /// Points `[r, f]`.
    Profile {
        /// The points \[R\].
        points: Vec<[f64; 2]>,
        /// The curve through them.
        curve: Profile,
    },
}

/// The impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Velocity V0 \[c_p\].
    pub velocity: f64,
    /// Contact rule.
    pub contact: Rule,
}

/// The mesh as asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Placement of nodes.
    pub kind: MeshKind,
    /// Nodes across the radius or unit length.
    pub cells: usize,
}

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Time at the last step, but for rounding to whole steps \[R/c_p\].
    pub end_time: f64,
    /// Event that ends the run earlier.
    pub stop: Stop,
}

/// Event that ends a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// None: the run goes on to its end time.
    Never,
    /// The interface first needs tension.
    Extension,
    /// The indenter leaves the target.
    Separation,
}

/// What is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Steps between messages of interface stress.
    pub interface_every: u64,
    /// Radii of the probes \[R\].
    pub probes: Vec<f64>,
    /// Fields recorded in frames.
    pub fields: Vec<Field>,
    /// Nodes from one that fields show to the next, along r and z.
    pub field_every: usize,
    /// Channels for viewers, at frames.
    pub views: Vec<ViewChannel>,
    /// Steps at which fields and energy are shown.
    pub frames: Frames,
    /// Compression of chunks.
    pub compression: Compression,
    /// Seconds of log time per unit of dimensionless time.
    pub playback_rate: f64,
}

/// Numbers of a field that have moved, in all frames together, about, where the case does not say how dense: 16 MiB. Recording them
/// takes little time beside any run that takes time; all nodes of a fine mesh take longer than computing them.
pub const SHOWN_NODES: f64 = (1 << 22) as f64;
/// Cells of the mesh that fields show at least, where the case does not say how dense.
pub const SHOWN_CELLS: usize = 50;

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
    /// `/view/tf`: where the indenter stands.
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
    /// Axial steps down to the backing, or to where nothing can be seen of in a half-space.
    pub nz: usize,
    /// Outer radius of the mesh \[R\].
    pub outer_radius: f64,
    /// Depth of the mesh \[R\]: the thickness of a layer.
    pub depth: f64,
    /// Largest radius that contact can reach on a flat surface, nodes that are being met included \[R\].
    pub contact_reach: f64,
    /// True for a layer, false for a half-space.
    pub layer: bool,
}

impl Case {
    /// Reads a case: the name of a built-in one, or the path of a TOML file.
    ///
    /// * `overrides`: texts `key=value` with dotted keys, applied in order
    ///
    /// # Errors
    ///
    /// Every problem of the file and the overrides.
    pub fn load(name: &str, overrides: &[String]) -> Result<Self, CaseErrors> {
        if let Some(text) = builtin::find(name) {
            return Self::parse(name, text, overrides, Path::new(""));
        }
        let path = PathBuf::from(name);
        let bytes = std::fs::read(&path).map_err(|error| CaseErrors::unreadable(name, &error))?;
        let text = String::from_utf8(bytes).map_err(|error| CaseErrors::not_utf8(name, &error))?;
        Self::parse(name, &text, overrides, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a case from TOML text.
    ///
    /// * `name`: what messages call the text
    /// * `overrides`: texts `key=value` with dotted keys, applied in order
    /// * `folder`: where relative paths in the case start
    ///
    /// # Errors
    ///
    /// Every problem of the text and the overrides.
    ///
    /// # Examples
    ///
    /// ```
    /// let text = percuss::case::builtin::find("fig5").unwrap();
    /// let case = percuss::case::Case::parse("fig5", text, &["mesh.cells=50".into()], "".as_ref())?;
    /// assert_eq!(case.sizes.nz, 25);
    /// # Ok::<(), percuss::case::CaseErrors>(())
    /// ```
    pub fn parse(name: &str, text: &str, overrides: &[String], folder: &Path) -> Result<Self, CaseErrors> {
        read::case(name, text, overrides, folder)
    }

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
        self.indenter.shape(self.impact.velocity)
    }

    /// The mesh.
    pub fn grid(&self) -> Grid {
        let Sizes { dr, dz, nr, nz, layer, .. } = self.sizes;
        Grid::new(self.geometry, self.mesh.kind, Spacing { dr, dz, layer_rows: layer.then_some(nz) }, nr, nz)
    }

    /// The steps that are frames.
    pub fn frames(&self) -> FrameSteps {
        self.record.frames.of(self.sizes.steps, self.sizes.dt)
    }

    /// Numbers of a field that may have moved, of every `every`-th node along r and z, in all frames together. What slices hold
    /// beside them is zeros.
    pub fn shown_nodes(&self, every: usize) -> f64 {
        const SAMPLES: usize = 200;
        let shown = |nodes: f64| (nodes / every as f64).ceil();
        let rows = |step: f64| (step + 1.0).min(self.sizes.nz as f64 + 1.0);
        let frames = self.frames().about();
        let samples = frames.iter().step_by(frames.len().div_ceil(SAMPLES).max(1));
        let each = frames.len() as f64 / samples.len().max(1) as f64;
        each * samples.map(|step| shown(self.lit_columns(*step)) * shown(rows(*step))).sum::<f64>()
    }

    /// Nodes from one that fields show to the next, where a case leaves that open: as few as keep what a field shows in all
    /// frames together to about [`SHOWN_NODES`], but [`SHOWN_CELLS`] remain.
    pub fn usual_field_every(&self) -> usize {
        if self.record.fields.is_empty() {
            return 1;
        }
        let every = (self.shown_nodes(1) / SHOWN_NODES).sqrt().ceil() as usize;
        every.min(self.mesh.cells / SHOWN_CELLS).max(1)
    }

    /// Memory of the fields of a frame, at most \[bytes\].
    pub fn frame_size(&self) -> usize {
        let Extent { nr, nz } = Extent::of(&self.grid(), self.record.field_every);
        let values = nr * nz * self.record.fields.len();
        (size_of::<f32>() * values).max(1)
    }

    /// Number of columns that may have moved at a step, about: where contact has been, and λ more for every step since.
    ///
    /// ```text
    /// max over earlier steps s of  r_contact(s)/Δr + λ·(step − s),   λ = c_sΔt/Δr
    /// ```
    pub fn lit_columns(&self, step: f64) -> f64 {
        const SAMPLES: u32 = 16;
        let courant = self.target.material.shear_wave_speed * self.sizes.dt / self.sizes.dr;
        let shape = self.shape();
        let columns = |part: u32| {
            let earlier = step * f64::from(part) / f64::from(SAMPLES);
            self.columns_under(&shape, earlier) + courant * (step - earlier)
        };
        (0..=SAMPLES).map(columns).fold(1.0, f64::max).min(self.sizes.nr as f64)
    }

    /// True if more than the surface is looked at: frames, or the backing of a layer.
    pub fn looks_inside(&self) -> bool {
        self.sizes.layer || !self.record.frames.is_none()
    }

    fn columns_under(&self, shape: &Shape, step: f64) -> f64 {
        shape.reach(self.impact.velocity * step * self.sizes.dt) / self.sizes.dr
    }

    /// SI values of the units, where the case gives them.
    pub fn scales(&self) -> Scales {
        let si = self.target.material.si;
        Scales {
            geometry: self.geometry,
            length: self.indenter.scale_radius,
            speed: si.and_then(|m| m.wave_speeds().ok()).map(|(c_p, _)| c_p),
            density: si.map(|m| m.density),
        }
    }
}

impl Body {
    /// The shape at impact velocity V0: `f = V0 r²/k`, `f = V0 r/V*`.
    pub fn shape(&self, velocity: f64) -> Shape {
        let head = match &self.head {
            HeadKind::Flat => Head::Flat,
            HeadKind::Paraboloid { curvature } => Head::Paraboloid { curvature: velocity / curvature },
            HeadKind::Cone { spread_rate } => Head::Cone { slope: velocity / spread_rate },
            HeadKind::Profile { curve, .. } => Head::Profile(curve.clone()),
        };
        Shape::new(head, self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fine(settings: &[&str]) -> Case {
        let shared = ["mesh.kind=\"paper\"", "mesh.cells=1000", "mesh.outer_radius=4"];
        let all: Vec<String> = shared.iter().chain(settings).map(|&setting| setting.to_owned()).collect();
        Case::load("fig5", &all).expect("a built-in case")
    }

    #[test]
    fn fields_are_as_dense_as_they_may_be_unless_the_case_says_how_dense() {
        let case = fine(&[]);
        let every = case.record.field_every;
        assert!(every > 1 && case.shown_nodes(every - 1) > SHOWN_NODES);
        // thinned rows and columns are rounded up
        assert!(case.shown_nodes(every) < 1.05 * SHOWN_NODES);
        assert_eq!(fine(&["record.field_every=1"]).record.field_every, 1);
        assert_eq!(fine(&["record.frame_times=[1.0, 2.5]"]).record.field_every, 1);
        assert_eq!(fine(&["record.frames=0"]).record.field_every, 1);
        assert_eq!(fine(&["record.fields=[]"]).record.field_every, 1);
        // a small case; one on a coarse mesh that is wide and deep
        for name in ["fig5", "fig9-m5"] {
            assert_eq!(Case::load(name, &[]).expect("a built-in case").record.field_every, 1);
        }
        let again = Case::parse("again", &case.resolved_toml(), &[], Path::new("")).expect("a case");
        assert_eq!(again.record, case.record);
    }

    #[test]
    fn many_frames_are_estimated_from_some() {
        let few = fine(&["record.frames=200"]).shown_nodes(4) / 200.0;
        let many = fine(&["record.frames=5001"]).shown_nodes(4) / 5001.0;
        assert!((many / few - 1.0).abs() < 0.01, "{few} {many}");
    }
}
