//! Cases: checked descriptions of what is computed and recorded, read from TOML or built.
//!
//! A [`Case`] that exists is valid and complete: every default is filled in and every derived size is known. Its
//! [`Parameters`] can be read and not changed; another case is a variation ([`Case::vary`]), which passes the same
//! checks. Reading reports all errors of a file at once ([`CaseErrors`]), each at its place in the text.
//!
//! * `builder`: cases from keys and values, files and `--set` included
//! * `parameters`: the data of a case
//! * `errors`, `bounds`, `document`: problems and their places; bounds of numbers; TOML text with spans, one section at a time
//! * `read`, `read_target`, `read_indenter`, `read_profile`: from a document to parameters, section by section
//! * `system`, `quantity`: dimensionless and physical cases; numbers with a unit
//! * `frames`, `density`: which steps are frames, and which nodes they show
//! * `sizes`: derived sizes
//! * `resolved`: from parameters back to TOML, with nothing left implicit
//! * `builtin`: the cases of the paper

use std::{ops::Deref, path::Path};

mod bounds;
mod builder;
pub mod builtin;
mod density;
mod document;
mod errors;
mod frames;
mod parameters;
mod quantity;
mod read;
mod read_indenter;
mod read_profile;
mod read_target;
mod resolved;
mod sizes;
mod system;

use crate::units::Dimension;

pub use builder::{CaseBuilder, Value};
pub use errors::{CaseErrors, Problem};
pub use frames::{FrameSteps, Frames};
pub use parameters::{
    Body, HeadKind, Impact, Mesh, Parameters, Record, Run, Sizes, Stop, Target, ViewChannel,
};

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

    /// Begins a variation with so many frames: none, or one at the last step.
    pub(crate) fn vary_frames(&self, frames: u8) -> CaseBuilder {
        match self.record.frames {
            Frames::Spread(_) => self.vary().set("record.frames", frames),
            Frames::At(_) => self.vary().set(
                "record.frame_times",
                vec![self.written(Dimension::Time, self.run.end_time); usize::from(frames)],
            ),
        }
    }

    /// Begins a variation without frames and fields.
    pub(crate) fn vary_surface(&self) -> CaseBuilder {
        self.vary_frames(0).set("record.fields", Vec::<Value>::new())
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
