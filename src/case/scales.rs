//! The scales of a case: from the material of the struck layer and the unit of length.

use toml::{
    Spanned, Value,
    de::{DeTable, DeValue},
};

use super::{
    document::{table, table_mut, text},
    keys::{Kind, LENGTH_UNIT, LOAD, MATERIAL, MAX_LAYERS},
    numbers::{Numbers, parse},
    rows::LARGEST_CHANGE,
    values::{Values, join},
};
use crate::{
    material::{
        BondStrength, ENGINEERING, Elastic, ISOTROPIC, MaterialError, Preset, STIFFNESS, STRENGTHS, Strengths,
    },
    units::{Dimension, Scales},
};

impl<'d> Values<'d> {
    /// Dimensionless or physical: as the struck layer has a ratio of wave speeds or a material, whose scales are read first.
    pub fn choose_system(&mut self, root: &mut DeTable<'d>) -> Option<()> {
        let target = table_mut(root, "target")?;
        let (struck, path) = if target.contains_key("layer") {
            let DeValue::Array(layers) = target.get_mut("layer")?.get_mut() else { return None };
            if layers.len() > MAX_LAYERS {
                return None;
            }
            for (number, layer) in (1..).zip(layers.iter()) {
                self.mark(&format!("target.layer.{number}"), layer.span());
            }
            match layers.first_mut()?.get_mut() {
                DeValue::Table(struck) => (struck, "target.layer.1"),
                _ => return None,
            }
        } else {
            (target, "target")
        };
        self.system.numbers = match ["shear_wave_speed", "material"].map(|key| struck.contains_key(key)) {
            [true, false] => Numbers::Dimensionless,
            [false, true] => Numbers::Physical,
            _ => return None,
        };
        let material = struck.remove("material")?;
        let name = join(path, "material");
        self.mark(&name, material.span());
        self.read_material(&name, &material);
        let length = self.read_length_unit(root);
        let elastic = self.elastic(&name);
        let sound = elastic.filter(|elastic| elastic.stiffness().slowness() < self.largest_ratio());
        self.system.scales = length.zip(sound).map(|(length, elastic)| Scales {
            geometry: self.system.geometry,
            length,
            speed: elastic.wave_speeds().0,
            density: elastic.density,
        });
        Some(())
    }

    /// Bound of c_s/c_p: in the full theory the bulk modulus is positive, c_s²/c_p² < 3/4. Where wave speeds of layers are changed,
    /// after the change.
    pub fn largest_ratio(&self) -> f64 {
        let change = if self.is_given("target.layer.2") { LARGEST_CHANGE } else { 0.0 };
        if self.model.has_shear() { 0.75f64.sqrt() / (1.0 + change) } else { 1.0 }
    }

    /// The unit of length of a physical case \[m\]: that of its indenter or load, else a key of its own.
    fn read_length_unit(&mut self, root: &mut DeTable<'d>) -> Option<f64> {
        let given = root.remove("length_unit");
        let section = if self.is_loaded { LOAD } else { "indenter" };
        let presses = table(root, section);
        let own = ["radius", "diameter", "nose_radius"]
            .into_iter()
            .find_map(|key| Some((key, presses?, presses?.get(key)?.span())));
        if let Some(value) = &given {
            self.mark("length_unit", value.span());
        }
        match (own, given) {
            (Some((own, ..)), Some(_)) => {
                let message = format!(" is given, but {section}.{own} is the unit of length");
                self.refuse("length_unit", &message, "leave length_unit out")?;
                None
            }
            // what is wrong with it is reported where it is read
            (Some((own, presses, place)), None) => {
                let written = text(presses, own)?;
                let si = parse(written, Dimension::Length, self.system.geometry).ok();
                let length = si.filter(|si| *si > 0.0)? / if own == "diameter" { 2.0 } else { 1.0 };
                if LENGTH_UNIT.contain(length) {
                    return Some(length);
                }
                let message = format!("`{section}.{own}` = \"{written}\" cannot be the unit of length");
                self.document.problem(place, message, format!("allowed: {}", LENGTH_UNIT.in_unit(1.0, "m")));
                None
            }
            (None, Some(value)) => {
                let kind = Kind::Si(Dimension::Length, LENGTH_UNIT);
                let length = self.read_value(&kind, "length_unit", &value)?;
                // in units of itself
                self.set("length_unit", 1.0);
                length.as_float()
            }
            (None, None) => {
                // another shape lacks its radius, which is the unit
                let is_sharp = matches!(self.shape.as_deref(), Some("cone" | "profile"));
                let reason = match self.is_loaded {
                    true => "the load is on a point",
                    false if is_sharp => "the indenter has no radius or nose_radius",
                    false => return None,
                };
                self.need("length_unit", &format!("the unit of length, such as \"10 mm\", as {reason}"));
                None
            }
        }
    }

    /// Reads a material, by name or by its constants.
    pub fn read_material(&mut self, path: &str, value: &Spanned<DeValue<'d>>) {
        self.checked.insert(path.into(), Value::Table(toml::Table::new()));
        if let DeValue::Table(table) = value.get_ref() {
            self.read_section(&MATERIAL, path, table.clone());
            return self.check_constants(path);
        }
        let kind = match value.get_ref() {
            DeValue::String(_) => Kind::Preset,
            _ => Kind::Text("the name of a material, or a table of constants"),
        };
        let Some(name) = self.read_value(&kind, path, value) else { return };
        let Some(preset) = name.as_str().and_then(Preset::find) else { return };
        let strengths = STRENGTHS.into_iter().zip(preset.strengths.all());
        let strengths = strengths.filter_map(|(key, strength)| Some((key, strength?)));
        let constants = preset.constants().into_iter().chain([("density", preset.density)]).chain(strengths);
        self.checked.extend(constants.map(|(key, constant)| (join(path, key), Value::Float(constant))));
    }

    /// Notes a table of constants that make no material.
    fn check_constants(&self, path: &str) {
        let mut names = MATERIAL.keys.iter().map(|key| join(path, key.name));
        if names.any(|name| self.is_given(&name) && !self.checked.contains_key(&name)) {
            return;
        }
        // without a density, which is a problem of its own, all but it is checked
        let density = self.number(&join(path, "density")).unwrap_or(1.0);
        if let Err(error) = Elastic::new(|key| self.number(&join(path, key)), density) {
            let two = ISOTROPIC.join(", ");
            let [stiffness, engineering] = [STIFFNESS, ENGINEERING].map(|names| names.join(", "));
            let (what, help) = match error {
                MaterialError::Incomplete(_) => {
                    (" has", format!("give two of {two}; or all of {stiffness}; or all of {engineering}"))
                }
                MaterialError::OutOfRange(_) => (":", "change one of its constants".into()),
            };
            self.problem(path, format!("`{path}`{what} {error}"), help);
        }
    }

    /// The material that has been read.
    pub fn elastic(&self, path: &str) -> Option<Elastic> {
        let constant = |key: &str| self.number(&join(path, key));
        Elastic::new(constant, constant("density")?).ok()
    }

    /// Strengths of the material that has been read.
    pub fn strengths(&self, path: &str) -> Strengths {
        Strengths::new(|key| self.number(&join(path, key)))
    }

    /// The strength of a bond that has been read.
    pub fn bond_strength(&self, path: &str) -> Option<BondStrength> {
        let [normal, shear] = ["normal", "shear"].map(|key| self.number(&join(path, key)));
        Some(BondStrength { normal: normal?, shear: shear? })
    }
}
