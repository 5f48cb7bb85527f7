//! Cases: checked descriptions of what is computed and recorded, read from TOML or built.
//!
//! A [`Case`] that exists is valid and complete: every default is filled in and every derived size is known. Its
//! [`Parameters`] can be read and not changed; another case is a variation ([`Case::vary`]), which passes the same
//! checks. Reading reports all errors of a file at once ([`CaseErrors`]), each at its place in the text.
//!
//! * `builder`: cases from keys and values, files and `--set` included
//! * `parameters`: the data of a case
//! * `errors`, `bounds`, `document`: problems and their places; bounds of numbers; TOML text with spans, one section at a time
//! * `read`, `read_layers`, `read_target`, `read_indenter`, `read_mass`, `read_profile`: from a document to parameters, section by section
//! * `system`, `quantity`: dimensionless and physical cases; numbers with a unit
//! * `frames`, `density`: which steps are frames, and which nodes they show
//! * `gauges`: points and lines in the target
//! * `sizes`, `rows`: derived sizes; the time step and the rows of layers
//! * `resolved`: from parameters back to TOML, with nothing left implicit
//! * `builtin`: the cases of the paper, and others
//!
//! # The case file
//!
//! A case file is TOML. Keys that are left out have the defaults shown, as `percuss check CASE --resolved` prints them; all problems
//! of a file are reported together, each at its line; any key can be changed on the command line, `--set mesh.cells=400`.
//!
//! ```toml
//! title = "Flat punch on a layer, Fig. 5"
//! model = "rakhmatulin"             # rakhmatulin (simplified: one displacement, along the impact) | elastic (full theory)
//! geometry = "axisymmetric"         # axisymmetric | plane
//! # length_unit = "10 mm"           # physical cases whose indenter has no radius and no nose_radius
//!
//! [target]                          # one layer; several: see below
//! thickness = 1.0                   # number > 0, or "half-space"
//! shear_wave_speed = 0.5            # c_s / c_p: the case is dimensionless; or instead of it a material: the case is physical
//! # material = "steel"              # see percuss materials; or two constants and the density:
//! # material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3, density = "7.85 g/cm3" }
//! # material = { bulk_modulus = "175 GPa", shear_modulus = "80.8 GPa", density = "7850 kg/m3" }
//! # back = "rigid"                  # rigid (and smooth) | free
//!
//! [indenter]
//! shape = "flat"                    # flat | paraboloid | sphere | cone | profile
//! radius = 1.0                      # left out: unbounded (not for flat); a sphere is whole
//! edge_radius = 0.0                 # flat: radius of the corner, f = e − √(e² − (r − R + e)²)
//! # nose_radius = 1.0               # paraboloid: ρ of f = r²/(2ρ); sphere: ρ of f = ρ − √(ρ² − r²)
//! # slope = 0.5                     # cone: df/dr; or half_angle = 63.4, in degrees from the axis
//! # file = "nose.csv"               # profile: columns r, f, the tip 0, 0 first, units in the heading of a physical case: r [mm],f [mm]
//! # points = [[0, 0], [1, 0.2]]     # profile, instead of the file
//! mass = inf                        # or a number > 0, in units of πγR³; plane: γR², of the half x ≥ 0, per length
//! # density = 6.6                   # instead of the mass, in units of γ: of a whole sphere, or of a body with a length
//! # material = "steel"              # physical cases: instead of the density, unless the mass is given, and says how rigid the indenter is
//! # length = 3.0                    # from the tip to the flat end of a body that has a radius: gives it a mass
//!
//! [impact]
//! velocity = 1.0                    # V0 / c_p; physical cases must give it
//! contact = "unilateral"            # unilateral | bilateral (glued, sharp flat face only) | prescribed (motion of the surface)
//!
//! [mesh]
//! kind = "matched"                  # matched | paper (r_i = i·Δr, Δr = Δz, as in the paper)
//! cells = 100                       # nodes across the radius (or unit length); paper: 1/Δz
//! order = 4                         # 4 | 2: order of accuracy for oblique waves; the paper's mesh has 2; not for elastic
//! damping = 1.0                     # 0 to 4/3: of oblique waves that the mesh does not resolve; the paper's mesh has none
//! # outer_radius = 4.4              # default: beyond the reach of reflections; a contact that gets there is an error
//!
//! [run]
//! end_time = 6.0
//! stop = "never"                    # never | extension (the interface needs tension, the contact turns back) | separation (V ≤ 0, no contact for Δr/c_s)
//! # checkpoint_every = 600          # seconds of wall time from one checkpoint to the next, 0 for none; `percuss run --resume`
//!
//! [record]
//! interface_every = 1               # steps between messages of interface stress and lines; the last step has one too
//! probes = [0.0, 0.5, 0.9, 0.95, 0.99]
//! # layer_tension = 0.01            # layers: tension of an interface that is an event, default 0.01·Z·V0 of the struck one
//! # points = [[0, 0.5]]             # [r, z]: displacement, velocity and stress there in every step, on /points
//! # lines = [{ r = 0 }, { z = 0.5 }]    # stress along them, on /line/0, /line/1
//! fields = ["stress"]               # any of displacement, velocity, stress; elastic: see below
//! # r_max = 3.0                     # fields and lines along r are recorded out to this radius, inf: to that of the mesh; default: see below
//! # field_every = 1                 # fields are recorded at every so many nodes along r and z; default: see below
//! views = ["field", "image", "scene", "fronts", "tf", "profile"]     # channels for viewers; [] for none
//! frames = 200                      # fields, energy and views, spread evenly over the run; 0: none
//! # frame_times = [0.05, 1.0, 2.0]  # instead of frames: at the steps nearest to these times and at the last one
//! compression = "zstd"              # none | lz4 | zstd
//! playback_rate = 1.0               # seconds of log time per unit of time; physical cases: per second, a power of ten that plays 2 to 20 s
//! ```
//!
//! # Units
//!
//! A case is either dimensionless or physical, and what has a dimension is written accordingly throughout; anything mixed is an
//! error. In a *dimensionless* case numbers are plain: length in R, speed in c_p, time in R/c_p, stress in γc_p². A *physical* case has
//! `target.material`, in every layer if there are several, and everything with a dimension is a text with a unit: `"10 mm"`, `"5 m/s"`, `"32.7 g"`
//! (plane: `"2 kg/m"`, of the whole body), `"210 GPa"`, `"7.85 g/cm3"`, `"250 us"`. Ratios, slopes, angles in degrees and counts
//! are plain in both. Its unit of length R, which `mesh.cells` counts, is `indenter.radius`, else `indenter.nose_radius`, else
//! `length_unit`. Its recording is in SI.
//!
//! # Layers
//!
//! A target of several layers has a list of them, from the struck surface down, in place of `thickness`, `shear_wave_speed` and
//! `material`; a list of one is the same as those.
//!
//! ```toml
//! [target]
//! back = "free"                     # of the last layer: rigid | free
//!
//! [[target.layer]]
//! material = "alumina"              # the units are those of the first layer
//! thickness = "10 mm"
//!
//! [[target.layer]]
//! material = "epoxy"
//! thickness = "0.2 mm"
//! bond = "sliding"                  # to the layer above: welded (default) | sliding (no shear stress; model = "elastic")
//!
//! [[target.layer]]
//! material = "aluminium"
//! thickness = "15 mm"               # or "half-space", in the last layer
//! ```
//!
//! A layer of a dimensionless case has `density` (1), `wave_speed` (1) and `shear_wave_speed` (that of the first layer) in place of a
//! material, in units of γ and c_p of the first layer. `--set target.layer.2.thickness="0.3 mm"` changes the second one. Welded layers
//! of the same constants are computed as one.
//!
//! One time step serves all layers: each is crossed in a whole number of steps, two at least, so that plane waves are exact. What is
//! missing to a whole number changes the longitudinal wave speed of the layer, at the same impedance: `check` and `run` show by how
//! much, warn from 0.5 % on, and refuse more than 2 %; another number of `cells` needs less. Layers and free backs have the matched
//! mesh, and no estimate of the error of the simplified theory.
//!
//! # Two models
//!
//! `model = "rakhmatulin"` is the simplified theory of the paper: points move along the impact only.
//! `model = "elastic"` is linear elasticity in full, with displacements along r too, plane strain in the plane. It has the same
//! indenters, contact rules, targets, channels and reader, and is distinguished by these keys:
//!
//! * `mesh.kind` is `matched`, and `mesh.order` is refused: its scheme has one order. Nodes are 1/`cells` apart both ways.
//! * `mesh.damping`, 0 to 0.8, by default 0.5, is lateral damping: of waves along r that the mesh does not resolve, which moving edges
//!   of contact excite. It is 0 for fronts along z and falls with the fifth power of the wave number; above c_s/c_p = 0.82 less of it is
//!   stable, and more is refused. 0.8 halves what noise is left over soft targets (c_s/c_p ≤ 0.3); surface waves of few nodes are best computed
//!   without.
//! * `record.fields` are any of `displacement`, `displacement_r`, `velocity`, `velocity_r`, `stress` (−σ_zz), `stress_rr`,
//!   `stress_tt`, `stress_rz`, `pressure` (mean of the three normal stresses), `von_mises`, `max_shear`; stresses are compressive positive.
//!
//! # Width and density of recorded fields
//!
//! By default fields of a layer, and lines along r, reach to `r_max`, the largest contact radius and beside it as much again or three thicknesses of the target,
//! whichever is more: what the back and the surface return to the contact is inside, what goes along the layer and does not come back
//! is not, and would be most of a long recording. The mesh is as wide as before, and no number changes. `check` and `run` say where
//! fields end; `r_max = inf` records all of the mesh. A half-space has no thickness: its section is that of the mesh.
//!
//! By default `field_every` is the smallest number that keeps the moved part of a field within 16 MiB (4 million numbers) in all
//! frames together (all slices have one shape; nodes at rest are recorded as zeros, which compress to nearly nothing), but keeps
//! 50 of the `cells`: 200 frames of every node of a fine mesh take longer to write than to compute. `check` and `run` report
//! skipped nodes. With fewer frames more nodes are recorded (`frame_times = [2.5]`), with `field_every = 1` all.

use std::{
    ops::Deref,
    path::{Path, PathBuf},
};

mod bounds;
mod builder;
pub mod builtin;
mod density;
mod document;
mod errors;
mod frames;
mod gauges;
mod parameters;
mod quantity;
mod read;
mod read_indenter;
mod read_layers;
mod read_mass;
mod read_profile;
mod read_target;
mod resolved;
mod rows;
mod sizes;
mod system;

pub use crate::shape::Head;
pub use builder::{CaseBuilder, Value};
pub use errors::{CaseErrors, Problem};
pub use frames::{FrameSteps, Frames};
pub use parameters::{
    Body, Impact, LayerSizes, Mesh, Parameters, Record, Run, Sizes, Stop, Target, TargetLayer, ViewChannel,
};
pub use quantity::{quantity_si, split as split_number};
pub(crate) use rows::NOTED_CHANGE;

/// A checked, complete case.
///
/// ```
/// use percuss::case::Case;
///
/// let case = Case::builder("punch")
///     .set("target.thickness", 1.0)
///     .set("target.shear_wave_speed", 0.5)
///     .set("indenter.shape", "flat")
///     .set("indenter.radius", 1.0)
///     .set("mesh.cells", 50)
///     .set("run.end_time", 2.0)
///     .build()?;
/// assert_eq!(case.sizes.nz, 25);
/// assert!(case.vary().set("indenter.mass", -1.0).build().is_err());
/// # Ok::<(), percuss::case::CaseErrors>(())
/// ```
#[derive(Clone, Debug)]
pub struct Case {
    parameters: Parameters,
    given: CaseBuilder,
    /// The file of the profile, if it was read from one.
    profile: Option<PathBuf>,
}

impl Deref for Case {
    type Target = Parameters;

    fn deref(&self) -> &Parameters {
        &self.parameters
    }
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
        CaseBuilder::load(name)?.overrides(overrides).build()
    }

    /// Reads a case from TOML text.
    ///
    /// * `name`: name of the case in messages
    /// * `overrides`: texts `key=value` with dotted keys, applied in order
    /// * `folder`: folder of relative paths in the case
    ///
    /// # Errors
    ///
    /// Every problem of the text and the overrides.
    pub fn parse(name: &str, text: &str, overrides: &[String], folder: &Path) -> Result<Self, CaseErrors> {
        CaseBuilder::from_text(name, text, folder).overrides(overrides).build()
    }

    /// Begins a case without a file: its keys are those of case files.
    ///
    /// * `name`: name of the case in messages, and its title if none is set
    pub fn builder(name: &str) -> CaseBuilder {
        CaseBuilder::from_text(name, "", Path::new(""))
    }

    /// Begins a variation: the case as it was given, with keys to change.
    pub fn vary(&self) -> CaseBuilder {
        self.given.clone()
    }

    /// Begins a variation without frames, fields, points and lines.
    pub(crate) fn vary_surface(&self) -> CaseBuilder {
        let nothing = Vec::<Value>::new;
        let keys = ["record.fields", "record.points", "record.lines"];
        let case = match self.record.frames {
            Frames::Spread(_) => self.vary().set("record.frames", 0),
            Frames::At(_) => self.vary().set("record.frame_times", nothing()),
        };
        keys.into_iter().fold(case, |case, key| case.set(key, nothing()))
    }

    /// Files that the case was read from: its own, if it has one, and that of its profile.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        [Some(Path::new(&self.given.name)), self.profile.as_deref()].into_iter().flatten()
    }

    /// The case file as it was given, without overrides; the settings of a case that has none.
    pub fn text(&self) -> String {
        self.given.text()
    }
}

#[cfg(test)]
impl Case {
    /// An unchecked case.
    pub(crate) fn unchecked(mut self, change: impl FnOnce(&mut Parameters)) -> Self {
        change(&mut self.parameters);
        self
    }
}
