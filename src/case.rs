//! Cases: checked descriptions of what is computed and recorded, read from TOML or built.
//!
//! A [`Case`] that exists is valid and complete: every default is filled in and every derived size is known. Its
//! [`Parameters`] can be read and not changed; another case is a variation ([`Case::vary`]), which passes the same
//! checks. Reading reports all errors of a file at once ([`CaseErrors`]), each at its place in the text.
//!
//! * `builder`: cases from keys and values, files and `--set` included; `builtin`: the cases of the paper, and others
//! * `document`, `errors`: TOML text with spans; problems and their places
//! * [`keys`]: the table of all keys: kind, range, default, which cases have it, meaning; `numbers`: their bounds and units
//! * `values`, `scales`: the loop that reads them, dimensionless or physical
//! * `read`, `target`, `indenter`, `load`, `profile`, `gauges`: rules between keys, as functions on the values, and the case made of them
//! * `parameters`: the data of a case; `sizes`, `rows`, `frames`, `density`: what is derived
//! * `resolved`: the values back to TOML, with nothing left implicit
//!
#![doc = include_str!("case/keys.md")]

use std::{
    ops::Deref,
    path::{Path, PathBuf},
};

mod builder;
pub mod builtin;
mod density;
mod document;
mod errors;
mod frames;
mod gauges;
mod grading;
mod indenter;
pub mod keys;
mod load;
mod numbers;
mod parameters;
mod profile;
mod read;
mod resolved;
mod rows;
mod scales;
mod sizes;
mod target;
mod values;

pub use crate::shape::Head;
pub use builder::{CaseBuilder, Value};
pub use errors::{CaseErrors, Problem};
pub use frames::{FrameSteps, Frames};
pub use gauges::{Face, Quantity, Sensor};
pub use grading::GradingFacts;
pub use numbers::{quantity_si, split as split_number};
pub use parameters::{
    Body, BodySizes, Grading, Impact, LayerSizes, Mesh, Parameters, Record, Run, Sizes, Stop, Striker,
    Target, TargetLayer, ViewChannel,
};
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
    pub(crate) fn unchecked(mut self, change: impl FnOnce(&mut Parameters)) -> Self {
        change(&mut self.parameters);
        self
    }

    /// A case that has no errors.
    ///
    /// * `case`: name of a built-in one, or text
    /// * `settings`: texts `key=value`
    pub(crate) fn sound(case: &str, settings: &[&str]) -> Self {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let case = match case.contains('\n') {
            true => Self::parse("case", case, &settings, Path::new("")),
            false => Self::load(case, &settings),
        };
        case.unwrap_or_else(|errors| panic!("{errors:?}"))
    }
}
