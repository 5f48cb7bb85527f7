//! Cases from keys and values: the text of a case file, if there is one, and settings that override it.

use std::path::{Path, PathBuf};

pub use toml::Value;

use super::{Case, CaseErrors, builtin, read};
use crate::input::read_text;

/// An unchecked case.
#[derive(Clone, Debug)]
pub struct CaseBuilder {
    /// Name of the case in messages.
    pub(super) name: String,
    pub(super) text: String,
    /// Folder of relative paths.
    pub(super) folder: PathBuf,
    /// Texts `key=value` that override the text, in this order.
    pub(super) settings: Vec<String>,
}

impl CaseBuilder {
    /// A built-in case, or a TOML file.
    pub(crate) fn load(name: &str) -> Result<Self, CaseErrors> {
        if let Some(text) = builtin::find(name) {
            return Ok(Self::from_text(name, &text, Path::new("")));
        }
        let path = Path::new(name);
        let text = read_text(path).map_err(|error| CaseErrors::unreadable(name, &error))?;
        Ok(Self::from_text(name, &text, path.parent().unwrap_or(Path::new(""))))
    }

    pub(crate) fn from_text(name: &str, text: &str, folder: &Path) -> Self {
        Self { name: name.into(), text: text.into(), folder: folder.into(), settings: Vec::new() }
    }

    /// Applies texts `key=value`.
    pub(crate) fn overrides(mut self, overrides: &[String]) -> Self {
        self.settings.extend_from_slice(overrides);
        self
    }

    /// Sets a key.
    ///
    /// * `key`: as in case files, dotted: `indenter.mass`
    #[must_use]
    pub fn set(mut self, key: &str, value: impl Into<Value>) -> Self {
        let start = format!("{key}=");
        self.settings.retain(|setting| !setting.starts_with(&start));
        self.settings.push(format!("{start}{}", value.into()));
        self
    }

    /// Checks the case and derives its sizes.
    ///
    /// # Errors
    ///
    /// Every problem of its text and its settings.
    pub fn build(self) -> Result<Case, CaseErrors> {
        read::case(self)
    }

    pub(crate) fn text(&self) -> String {
        if self.text.is_empty() { self.settings.join("\n") } else { self.text.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Rule;

    #[test]
    fn a_built_case_is_that_of_its_text() {
        let case = Case::builder("ball")
            .set("target.thickness", "half-space")
            .set("target.shear_wave_speed", 0.1 + 0.2)
            .set("indenter.shape", "paraboloid")
            .set("indenter.nose_radius", 0.5)
            .set("indenter.mass", f64::INFINITY)
            .set("run.end_time", 2.0)
            .set("record.probes", vec![0.0, 1.0 / 3.0]);
        let case = case.build().expect("a case");
        assert_eq!((case.title.as_str(), case.target.thickness), ("ball", None));
        assert_eq!(case.target.material.shear_wave_speed, 0.1 + 0.2);
        assert_eq!(case.record.probes, [0.0, 1.0 / 3.0]);
        let again = Case::sound(&case.text(), &["title=ball"]);
        assert_eq!(again.resolved_toml(), case.resolved_toml());
    }

    #[test]
    fn a_variation_changes_its_keys_and_nothing_else() {
        let case = Case::sound("fig5", &["mesh.cells=20", "indenter.mass=2"]);
        let varied = case.vary().set("indenter.mass", 3).set("impact.contact", "bilateral").build();
        let varied = varied.expect("a case");
        assert_eq!((varied.indenter.mass, varied.impact.contact), (3.0, Rule::Bilateral));
        assert_eq!((&varied.sizes, varied.text()), (&case.sizes, case.text()));
        // the mesh of a derived size follows
        let finer = varied.vary().set("mesh.cells", 40).build().expect("a case");
        assert_eq!((finer.sizes.nz, finer.indenter.mass), (2 * case.sizes.nz, 3.0));
    }
}
