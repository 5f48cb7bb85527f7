//! Models of the target's interior.
//!
//! A model owns the displacement fields and advances them. It is coupled to the contact only through [`Surface`] and outputs
//! its fields only as a [`Frame`]; it knows nothing of indenters, contact rules or recordings.
//!
//! | Model | Unknowns | File |
//! |---|---|---|
//! | `rakhmatulin` | `u_z` (\[KA\] Eq. 18) | [`rakhmatulin`] |
//! | `elastic` | `u_z`, `u_r` (\[KA\] Eqs. 2, 3) | [`elastic`] |
//!
//! The numerics are [`scheme`] (one displacement), [`cells`] (two) and [`mod@reference`]: operators, for one number or the lanes of a vector
//! (`number`), and the plain stepper over them. `body` has the scheme of cells on a mesh
//! of any widths and heights, by rows, under the plain stepper; on equal cells `blocked` is the fast engine, which nothing outside this module sees; tests compare it with the plain stepper bit by bit:
//!
//! ```text
//! lane       neighbouring numbers in vectors of a machine
//! dispatch   work compiled for each set of instructions, and the choice among them
//! energy     energy of rows
//! corner     rows of nodes with the mixed-derivative correction
//! kernel     rows of nodes
//! damping    lateral damping of a row
//! cells      rows of nodes of the full theory
//! levels     a field in memory, and the part of it that kernels get
//! domain     levels and a theory, and what the engine asks of one
//! axial      the simplified theory, with weights by layer and column
//! full       the full theory, likewise
//! parts      numbers that several threads write
//! sampler    frames and energies of a level, as tiles pass it
//! gauge      points and lines of a level, as tiles pass it
//! strains    largest strain of a level, as tiles pass it
//! strengths  largest ratios of stresses to strengths, likewise
//! interface  stress and first tension at interfaces of layers
//! joining    rows of interfaces
//! tiles      time-skewed tiling behind the near-surface band
//! workers    threads that work on the tiles
//! state      the engine as a stream of bytes
//! ```
//!
//! # Mesh noise
//!
//! The scheme propagates waves along z, and on the matched mesh along r too, without dispersion, up to the frequency of the mesh.
//! Three sources of noise at that frequency remain, and refinement does not reduce them; percuss treats each:
//!
//! * Oblique waves have too low a phase velocity, so fronts that are not parallel to the mesh have a dispersive tail and overshoot. One more operator, which is zero
//!   for waves along z and r, makes the scheme fourth order in all directions (`mesh.order = 4`, the default).
//! * Near the grid cutoff the phase error of oblique waves does not vanish under refinement. The same operator on the velocity damps them
//!   (`mesh.damping = 1.0`, the default), at third order, and leaves fronts as steep as they are; it is the only dissipation, and
//!   `/energy` has what it takes (`damped`).
//! * A contact edge that moves over nodes one by one excites waves at the frequency of the crossing. Nodes in partial contact take
//!   the hat-weighted average of the indenter's penetration, in r and over one and a half steps.
//!
//! The figures page has a table of noise and overshoot with and without these. Where waves of a contact or a tip are shorter than the
//! mesh, some remain: the reflection of a cone overshoots by 1.1 %, p(0, t) of Figs. 3 and 7b carries 2e-4 of them. `mesh.order = 2` with `mesh.damping = 0.0` is the scheme of
//! the paper; on its mesh (`mesh.kind = "paper"`) nodes are points, and all three sources are there.

use std::io;

use serde::{Deserialize, Serialize};

use crate::{
    grid::Grid,
    state::{StateError, StateReader, StateWriter},
    surface::Surface,
    units::{Unit, Units},
};

mod blocked;
pub(crate) mod body;
pub(crate) use blocked::Instructions;
pub mod cell_scheme;
pub mod cells;
pub mod cone;
pub mod elastic;
mod gauge;
#[cfg(test)]
mod layers;
#[cfg(test)]
mod noise;
mod number;
pub mod rakhmatulin;
pub mod reference;
pub mod scheme;
pub mod strain;
pub mod strength;

pub use cone::Dependence;
pub(crate) use gauge::{GaugePlan, UNDER_WAY as GAUGES_UNDER_WAY};
pub use gauge::{GaugeValues, Gauges, Line, PointState};

/// Theory of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// Simplified theory with one displacement; \[KA\] Eq. 18.
    #[default]
    Rakhmatulin,
    /// Linear theory of elasticity; \[KA\] Eqs. 2, 3, 6.
    Elastic,
}

impl ModelKind {
    /// Their names in case files.
    pub const NAMES: [&str; 2] = ["rakhmatulin", "elastic"];

    /// Its name in case files.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// True if it has shear and displacements along r, as layers that slide, rims and other materials than isotropic ones need.
    pub fn has_shear(self) -> bool {
        self == Self::Elastic
    }

    /// Numbers in memory for every node: displacements at all levels that are kept.
    ///
    /// * `corner`: the mixed-derivative correction of the simplified theory, if there is one
    pub fn numbers_per_node(self, corner: Option<&scheme::Corner>) -> usize {
        match self {
            Self::Rakhmatulin => scheme::Corner::levels(corner),
            Self::Elastic => 2 * 3,
        }
    }

    /// Speeds along r and z of its waves, the fastest first.
    ///
    /// * `c_p`, `c_s`: speeds of longitudinal and shear waves
    pub fn waves(self, c_p: f64, c_s: f64) -> Vec<[f64; 2]> {
        match self {
            Self::Rakhmatulin => vec![[c_s, c_p]],
            Self::Elastic => vec![[c_p; 2], [c_s; 2]],
        }
    }

    /// Speed of the fastest waves along r.
    pub fn lateral_speed(self, c_p: f64, c_s: f64) -> f64 {
        self.waves(c_p, c_s)[0][0]
    }
}

/// A field that a model can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// Displacement u_z into the target \[R\].
    Displacement,
    /// Velocity ∂u_z/∂t \[c_p\].
    Velocity,
    /// Axial stress −σ_zz, compression positive like the interface stress \[γc_p²\].
    Stress,
    /// Displacement u_r outwards \[R\].
    DisplacementR,
    /// Velocity ∂u_r/∂t \[c_p\].
    VelocityR,
    /// Radial stress −σ_rr, of the same sign \[γc_p²\].
    StressRr,
    /// Hoop stress −σ_θθ (plane: −σ_yy, out of the plane), of the same sign \[γc_p²\].
    StressTt,
    /// Shear stress −σ_rz, of the same tensor \[γc_p²\].
    StressRz,
    /// Mean pressure −(σ_zz + σ_rr + σ_θθ)/3 \[γc_p²\].
    Pressure,
    /// Stress of von Mises \[γc_p²\].
    VonMises,
    /// Largest shear stress (Tresca) \[γc_p²\].
    MaxShear,
    /// Largest ratio of a stress to a strength of the layer, see [`strength::Strength::largest_ratio`].
    DamageRatio,
}

impl Field {
    /// All of them; model `rakhmatulin` has the fields of [`Field::AXIAL`].
    pub const ALL: [Self; 12] = [
        Self::Displacement,
        Self::Velocity,
        Self::Stress,
        Self::DisplacementR,
        Self::VelocityR,
        Self::StressRr,
        Self::StressTt,
        Self::StressRz,
        Self::Pressure,
        Self::VonMises,
        Self::MaxShear,
        Self::DamageRatio,
    ];

    /// The fields of a theory with one displacement.
    pub const AXIAL: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Stress];

    /// Their names in case files and topics.
    pub const NAMES: [&str; 12] = [
        "displacement",
        "velocity",
        "stress",
        "displacement_r",
        "velocity_r",
        "stress_rr",
        "stress_tt",
        "stress_rz",
        "pressure",
        "von_mises",
        "max_shear",
        "damage_ratio",
    ];

    /// Its name in case files and topics.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Its unit among those of a run.
    pub fn unit(self, units: &Units) -> Unit {
        match self {
            Self::Displacement | Self::DisplacementR => units.length,
            Self::Velocity | Self::VelocityR => units.speed,
            Self::Stress
            | Self::StressRr
            | Self::StressTt
            | Self::StressRz
            | Self::Pressure
            | Self::VonMises
            | Self::MaxShear => units.stress,
            Self::DamageRatio => Unit::RATIO,
        }
    }

    /// True if the model shows it.
    pub fn belongs_to(self, model: ModelKind) -> bool {
        model.has_shear() || Self::AXIAL.contains(&self)
    }
}

/// How much of the field must be computed, which follows from what is observed during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// The whole field, at any time.
    Field,
    /// The rows that what is recorded above a depth can still depend on.
    Rows(Dependence),
    /// Every node in every step, moved or not: what a computation without the light cone does, for comparisons.
    Everything,
}

/// Energy of the target at a half step \[πR³γc_p²; plane R²γc_p²\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TargetEnergy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Strain energy.
    pub strain: f64,
}

impl std::iter::Sum for TargetEnergy {
    fn sum<I: Iterator<Item = Self>>(energies: I) -> Self {
        energies.fold(Self::default(), |sum, energy| Self {
            kinetic: sum.kinetic + energy.kinetic,
            strain: sum.strain + energy.strain,
        })
    }
}

/// An interface in tension. Layers are not separated by it: from there on a stack that cannot bear it is another one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tension {
    /// Number of the interface, which is that of the layer above it.
    pub interface: usize,
    /// Level.
    pub level: usize,
    /// Innermost column.
    pub column: usize,
    /// Stress −σ_zz there, which is negative \[γc_p²\].
    pub stress: f64,
}

/// Largest tractions between two layers so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InterfacePeaks {
    /// Tension, σ_zz.
    pub tension: TractionPeak,
    /// Shear, |σ_rz|; 0 where layers slide, and in the simplified theory, which has none.
    pub shear: TractionPeak,
}

/// A largest traction: where there are several, that of the earliest level, then the innermost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TractionPeak {
    /// Stress by magnitude; 0 if there has been none \[γc_p²\].
    pub stress: f64,
    /// Level.
    pub level: usize,
    /// Column.
    pub column: usize,
}

impl TractionPeak {
    /// The larger of two peaks.
    pub fn larger(self, other: Self) -> Self {
        let place = |peak: &Self| (peak.level, peak.column);
        let is_first = place(&other) < place(&self);
        if other.stress > self.stress || (other.stress == self.stress && is_first) { other } else { self }
    }
}

/// Largest strain behind the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrainPeak {
    /// |∂u_z/∂z|, in the full theory the largest principal strain by magnitude.
    pub strain: f64,
    /// Radius \[R\].
    pub r: f64,
    /// Depth \[R\].
    pub z: f64,
    /// Step.
    pub step: u64,
}

impl StrainPeak {
    /// On the backing, column `i`.
    fn on_backing(grid: &Grid, strain: f64, level: usize, i: usize) -> Self {
        Self { strain, r: grid.r(i), z: grid.z(grid.nz), step: level as u64 }
    }

    /// The larger of the strain of a cell and that on the backing, which only a layer has.
    fn largest(grid: &Grid, cell: strain::CellPeak, backing: Self) -> Self {
        if grid.has_back && backing.strain >= cell.strain {
            return backing;
        }
        let (r, z) = cell.place(grid);
        Self { strain: cell.strain, r, z, step: cell.level as u64 }
    }
}

/// The larger of two strains with their columns; the first where they are equal.
fn larger_strain(a: (f64, usize), b: (f64, usize)) -> (f64, usize) {
    if b.0 > a.0 { b } else { a }
}

/// Size of a sampled field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Number of columns (radial nodes).
    pub nr: usize,
    /// Number of rows.
    pub nz: usize,
}

impl Extent {
    /// Size of a field that shows every `every`-th node of a mesh along r and z, the first one included, see [`Grid::shown_rows`].
    ///
    /// * `columns`: of the mesh that are shown, see [`FrameFields::columns`]
    pub fn of(grid: &Grid, every: usize, columns: usize) -> Self {
        Self { nr: grid.nr().min(columns).div_ceil(every), nz: grid.shown_rows(every).len() }
    }
}

/// What frames show of the target.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameFields {
    /// The fields.
    pub fields: Vec<Field>,
    /// Nodes from one that is shown to the next, along r and z; the first is always shown.
    pub every: usize,
    /// Columns of the mesh that are shown, from the axis outwards; all, if the mesh has no more.
    pub columns: usize,
}

/// What a model shows of the target.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sampling {
    /// What frames show.
    pub frames: FrameFields,
    /// Points and lines. Of rows that [`Coverage`] leaves out before the end they show what was there when they were left.
    pub gauges: Gauges,
    /// Rows of which the largest strain is taken; of all where there is none.
    pub strained: Option<Dependence>,
    /// Tension of an interface from which on it is told, if tractions of interfaces are looked at \[γc_p²\].
    pub tension: Option<f64>,
}

impl From<FrameFields> for Sampling {
    fn from(frames: FrameFields) -> Self {
        Self { frames, ..Self::default() }
    }
}

/// A field as a frame shows it. All samples of a run have one shape; what is at rest is 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The field.
    pub field: Field,
    /// Rows and columns.
    pub extent: Extent,
    /// Values, row-major `[[j, i]]`.
    pub values: Vec<f32>,
}

impl Sample {
    /// A field at rest.
    ///
    /// * `shown`: what frames show
    pub fn at_rest(field: Field, grid: &Grid, shown: &FrameFields) -> Self {
        let extent = Extent::of(grid, shown.every, shown.columns);
        Self { field, extent, values: vec![0.0; extent.nr * extent.nz] }
    }
}

/// What a model shows of a level k that is a frame. Nothing changes it any more: any number of observers share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Energy between levels k−1 and k, and between levels k and k+1.
    pub energy: [TargetEnergy; 2],
    /// The same of every layer.
    pub layers: Vec<[TargetEnergy; 2]>,
    /// Fields.
    pub samples: Vec<Sample>,
    /// Displacement of the surface, shape `(columns,)`; nodes beyond them are at rest \[R\].
    pub surface: Vec<f64>,
}

impl Frame {
    /// The sample of `field`, if the frame has one.
    pub fn sample(&self, field: Field) -> Option<&Sample> {
        self.samples.iter().find(|sample| sample.field == field)
    }
}

/// What a model is asked to show of a level, beside its points, which it shows of every one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// A frame.
    pub frame: bool,
    /// Lines.
    pub lines: bool,
}

/// A step as a model hands it out.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletedStep<T> {
    /// What the model was given with it.
    pub step: T,
    /// Its frame, if it is one.
    pub frame: Option<Frame>,
    /// Values of its gauges, if there are any.
    pub gauges: Option<GaugeValues>,
    /// Interfaces that are in tension for the first time, from the surface down.
    pub tensions: Vec<Tension>,
    /// Strengths that are passed for the first time.
    pub failures: Vec<strength::Failure>,
}

/// An elastic target, advanced explicitly in time.
///
/// Levels: before [`Model::advance`] of step k the model stands between levels k−1 and k, after it between k
/// and k+1. A model may run its interior behind the surface, so a frame and the values of gauges may be complete only some steps
/// later. The model therefore takes what else belongs to a step, a `T`, and hands it out in order, with both.
pub trait Model<T>: Send {
    /// Fills in the surface that would be free of stress during step k, and its compliance.
    fn predict(&mut self, surface: &mut Surface);

    /// Advances from level k to k+1 under the surface motion that the contact has settled.
    ///
    /// * `step`: what belongs to level k, for [`Model::next`]
    /// * `request`: what shall be shown of level k
    fn advance(&mut self, surface: &Surface, step: T, request: Request);

    /// The next step in order, with its frame if it is one, and the values of gauges if there are any; `None` while they are not
    /// complete, or when no step is left.
    ///
    /// * `finish`: complete it now; no step is to follow soon
    fn next(&mut self, finish: bool) -> Option<CompletedStep<T>>;

    /// Largest strain on the surface at level k by magnitude, between [`Model::predict`] and [`Model::advance`], and its column.
    ///
    /// * `pressure`: p^k of the nodes that have been loaded \[γc_p²\]
    fn surface_strain(&self, pressure: &[f64]) -> (f64, usize);

    /// Strain on the surface at column `i`, like [`Model::surface_strain`].
    ///
    /// * `pressure`: p^k there \[γc_p²\]
    fn strain_at(&self, pressure: f64, i: usize) -> f64;

    /// Largest strain of cells and on the backing of a layer over all levels before the newest one, see [`mod@strain`].
    fn strain_peak(&mut self) -> StrainPeak;

    /// Largest tractions of the interfaces over all levels before the newest one, from the surface down; none where they are not
    /// looked at, see [`Sampling::tension`].
    fn interface_peaks(&mut self) -> Vec<InterfacePeaks>;

    /// Largest ratios of stresses to strengths over all levels before the newest one; none where these are not known, see
    /// [`mod@strength`].
    fn strength_peaks(&mut self) -> strength::RatioPeaks;

    /// First place `(r, z)` where the displacement is not finite, if any \[R\].
    fn find_non_finite(&mut self) -> Option<(f64, f64)>;

    /// Writes the target between two steps, all of which have been returned; the run can continue afterwards.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    ///
    /// # Panics
    ///
    /// If a step has not been returned, see [`Model::next`].
    fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()>;

    /// Restores the state written by [`Model::save`], in place of a target at rest.
    ///
    /// * `step`: the next one, before which it was written
    ///
    /// # Errors
    ///
    /// The stream cannot be read, or is that of another target.
    fn load(&mut self, step: u64, from: &mut StateReader<'_>) -> Result<(), StateError>;
}
