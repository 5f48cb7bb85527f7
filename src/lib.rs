//! percuss: an indenter, rigid or elastic, strikes elastic layers, a disc, a bar or a half-space; the stress waves are computed by an explicit
//! scheme of minimised mesh dispersion, and every run is recorded as a standard MCAP file.
//!
//! ```text
//! case.toml -> Case -> ( Simulation{ model <-surface-> contact <-indenter, rigid or a model } | exact::ClosedForm ) -> View -> channels -> Recorder -> run.mcap
//! ```
//!
//! # Example
//!
//! The peak of the drag against the mass of the indenter:
//!
//! ```
//! use percuss::{case::Case, session, simulation::Simulation, view::View};
//!
//! let case = Case::load("fig8-m5", &["mesh.cells=20".into()])?;
//! let mut peaks = Vec::new();
//! for mass in [2.5, 5.0, 10.0] {
//!     let case = case.vary().set("indenter.mass", mass).build()?;
//!     let mut peak = 0.0;
//!     let mut look = |view: &View<'_>| peak = f64::max(peak, view.drag);
//!     session::run(&mut Simulation::new(&case), &mut [&mut look])?;
//!     peaks.push(peak);
//! }
//! assert!(peaks.is_sorted_by(|light, heavy| light < heavy), "{peaks:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! | Module | Owns |
//! |---|---|
//! | [`case`] | cases, from files or built: reading, checking, derived sizes, the built-in cases |
//! | [`input`] | files that people write: read whole, within a bound |
//! | [`geometry`], [`units`], [`material`] | axisymmetric or plane; names of units and SI scales; elastic constants, of isotropic materials and of those whose axis of symmetry is z |
//! | [`shape`] | indenter profiles and the covered area fraction of a cell |
//! | [`grid`] | mesh and geometry as positions and weights; layers of rows, and the time step that fits them; cells that grow and rims (`grid::graded`) |
//! | [`indenter`] | the rigid body; of an indenter that gives its centre of mass |
//! | [`surface`] | what model and contact exchange on z = 0 |
//! | [`contact`] | contact rules, active set, drag, events; loads that are given in place of an indenter |
//! | [`model`] | the interior of the target: the trait, [`model::scheme`] and its plain stepper [`model::reference`], one file per model, bodies whose cells or layers differ, or that end (`model::body`), the light cone ([`model::cone`]), and the fast engine, private to it |
//! | [`simulation`] | the order of one step; an indenter that gives (`simulation::striker`), a second body |
//! | [`mod@state`] | the state of a run as a stream of bytes |
//! | [`checkpoint`] | the file around a state, from which a run continues, and the observer that writes it |
//! | [`validity`] | the largest strain and the impact velocity it allows |
//! | [`advice`] | findings about a case and its run; [`advice::Advised`] adds them to the events of a run. Estimates: error of the simplified theory ([`advice::theory`]), of a rigid indenter ([`advice::rigidity`]), what a ball comes to by Hertz and Zener ([`advice::impact`]), size and time of a run ([`advice::cost`]), the admissible impact velocity by trials ([`advice::admissible`]) |
//! | [`measuring`] | what is measured of a run on the way |
//! | [`mod@table`] | tables of measured numbers, for `advice` and `grid` |
//! | [`exact`] | closed forms, one file each, independent of the solver; [`exact::closed_form`] chooses the one for a case |
//! | [`study`] | a case on refined meshes: orders, extrapolated values, error bars |
//! | [`view`] | what one step shows to observers |
//! | [`channels`], [`message`] | recorded channels, one file each, those for viewers in [`channels::view`], and their messages |
//! | [`layout`] | layouts of viewers, made for a case |
//! | [`session`] | [`session::run`], the only loop over steps, computed or exact; observers; [`session::Recording`], the observer that writes a file |
//! | [`recording`] | the MCAP writer |
//! | [`sweep`] | a case with keys that vary: plan, journal, threads, shards, summary |
//! | [`fit`] | values of keys with which a case gives what was measured |
//! | [`live`] | serving a run to viewers, and its pace |
//! | [`cli`] | the command line |
//!
//! Modules exchange plain data types only. [`surface::Surface`]: the model predicts a free surface and its compliance, the
//! contact answers with a pressure. [`view::View`]: the output of a step. Messages: the content of the file, with units
//! and axes in channel metadata. The reader (`tools/reader`) uses none of this crate: the file is the only link.
//!
//! Which module may use which is a test, `tests/house.rs`: from names and limits at the bottom over the numerics, the contact and the
//! case to the session with its checkpoints, the findings and the program; nothing uses what is above it, and there are no circles.
//!
//! [`cli`], [`fit`], [`live`] and [`sweep`] belong to the program and its default feature `cli`.
//!
//! Beside this crate the workspace has the reader (`tools/reader`), pictures (`tools/picture`, used by the reader and by the
//! figures), labels, colours and the painter of sections on pixels (`tools/canvas`, used by the pictures, the reader and the images of [`channels`]), tables and what is measured of a run (`tools/table`, used by [`measuring`], by [`sweep`] and by the reader), the server for viewers (`tools/serve`, used by [`live`] and by the reader's replay), the figures of the paper (`tools/figures`, which runs both programs) and
//! benchmarks (`tools/bench`).
//!
//! # Invariants
//!
//! * [`session::run`] is the only loop over steps. Nothing under [`simulation`] does input or output.
//! * A [`case::Case`] that exists is valid, and nothing changes it.
//! * Recording is an observer. Drag, velocity, interface stress and events are the same bits whatever is recorded (frames, points, lines,
//!   probes, views), by either engine, on any number of threads and over a checkpoint: the mesh along r, strains and events follow from the
//!   case without its section `[record]`, and of the depth nothing is left out that the surface depends on ([`model::Dependence`]). Observers
//!   hold a [`view::View`] by reference, and its fields never change. Channels of frames share the view and emit on the thread that writes, in the same order.
//! * Viewers of a live run are served from what is written; they can neither slow the run nor change the file.
//! * Nothing from clock, host or thread count enters a channel. The same case gives the same bytes on any number of
//!   threads: every sum is taken in the order of rows and nodes.
//! * Kernels do not branch on geometry or mesh: [`grid::Grid`] turns both into weights.
//! * The numerics are in [`model::scheme`], [`model::cells`] and [`model::reference`]; the fast engine gives the same bits and is tested
//!   against them. Both leave nodes outside the light cone at rest; the engine may run its interior behind the surface, many steps in one pass
//!   and on other threads; frames, points and lines are sampled in the pass, and steps are yielded in order. Both rows of an
//!   interface between layers are advanced by one thread; tension there is noted as an event.
//! * On a graded mesh, in targets with layers that are not alike in all directions or with a rim, and in an indenter that gives the plain stepper computes all nodes in every step, row by row
//!   in vectors (`model::body`): such meshes are small, and have no light cone. What layers and rims are is numbers of rows and columns there, no code.
//! * An indenter that gives is a second instance of that body, in a frame that flies on with V0: contact is the balance of forces of two surfaces' nodes on the same radii.
//! * Vectors of any width give the same bits: products are fused with sums in fixed places of the scheme and nowhere else, sums over a row
//!   are taken in blocks of one size.
//! * `unsafe` occurs only in `model::blocked`, and in `model::number` for the name of a function of the C library on Windows; every block has a SAFETY comment.
//! * A run that is interrupted and continues, on any number of threads, gives the same messages and measures as one that is not.
//! * What a recording says was measured, `percuss.summary`, is what its messages say, bit for bit.
//! * A recording reproduces its run: `percuss run` on its attachment `case.resolved.toml` gives the same messages.
//!
//! | To add | Touch |
//! |---|---|
//! | key of a case | its row in [`case::keys`], and its use; a rule beside the use if it depends on other keys. `--resolved`, messages and the guide have it from the row |
//! | indenter shape | a variant of [`shape::Head`], whose matches are all in that file, its name and keys in [`case::keys`], its rule in `src/case/indenter.rs`, its errors in `tests/cases/indenter.txt`; the guide's list is written from the keys |
//! | contact rule, mesh | a variant in [`contact`], [`grid`]; matches on it fail to compile until extended, comparisons (`rule ==`) do not: look for them |
//! | field of frames | a variant of [`model::Field`] and its name beside it; the exhaustive matches fail to compile until extended: how models show it, its unit, its colours |
//! | channel | `src/channels/<x>.rs` with `schemas/<x>.proto`, from which `tests/schemas.rs` writes its messages, and one line in [`channels::Catalogue::new`] |
//! | channel for viewers | `src/channels/view/<x>.rs`, a variant of [`case::ViewChannel`] and its name in [`case::keys`]; a panel in [`layout`] |
//! | model | its operators beside [`model::scheme`] and [`model::cells`], `src/model/<x>.rs` ([`model::reference::Scheme`] is enough to run whole cases; for the fast engine a `Theory`, one file in `src/model/blocked`), a variant of [`model::ModelKind`] with its properties, both engines in [`simulation`], its closed forms in [`exact::closed_form`]; the exhaustive matches fail to compile until extended |
//! | closed form | `src/exact/<x>.rs`, one line in [`exact`]; if it covers cases, an arm of [`exact::closed_form::ClosedForm::for_case`] |
//! | built-in case | `src/case/builtin/<x>.toml`, its name in `src/case/builtin.rs`, and the case that it extends, if it has only its own lines |
//!
//! # Units, signs, symbols
//!
//! Dimensionless throughout: length in R (the radius of the punch), speed in c_p, time in R/c_p, density in γ, stress
//! in γc_p², force in πR²γc_p², mass in πγR³, energy in πR³γc_p²; in the plane, per length and of the half x ≥ 0, force in
//! Rγc_p², mass in γR², energy in R²γc_p²; plane cases in SI are of the whole body ([`units`]). Recorded stress is compressive positive, `p = −σ_zz`. Arrays over the section have the shape `(nz, nr)` and are indexed `[[j, i]]`: row 0 is the surface.
//!
//! # Sources
//!
//! * \[KA\] V. D. Kubenko, M. V. Ayzenberg-Stepanenko, *Impact indentation of a rigid body into an elastic layer.
//!   Axisymmetric problem*. Equation and figure numbers are this paper's; where it has misprints the text here says
//!   so and gives the corrected form.
//! * \[FC\] F. N. Fritsch, R. E. Carlson, *Monotone piecewise cubic interpolation*, SIAM J. Numer. Anal. 17 (1980).
//! * \[Ro\] P. J. Roache, *Verification and validation in computational science and engineering* (1998).
//! * \[AS\] M. Abramowitz, I. A. Stegun, *Handbook of mathematical functions*.

// files of `tests` that its own tests share name it
#[cfg(test)]
extern crate self as percuss;

pub mod advice;
pub mod case;
mod channels;
pub mod checkpoint;
#[cfg(feature = "cli")]
pub mod cli;
mod contact;
pub mod exact;
#[cfg(feature = "cli")]
pub mod fit;
pub mod geometry;
pub mod grid;
mod indenter;
mod input;
pub mod layout;
#[cfg(feature = "cli")]
mod live;
mod material;
mod measuring;
pub mod message;
pub mod model;
pub mod recording;
pub mod session;
mod shape;
pub mod simulation;
pub mod state;
pub mod study;
pub mod surface;
#[cfg(feature = "cli")]
pub mod sweep;
mod table;
pub mod units;
pub mod validity;
pub mod view;
