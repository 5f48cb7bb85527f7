//! Bodies of layers: the target, and an indenter that gives, `indenter.body`, in short or with layers of its own.

use super::{
    Body, Striker, Target, TargetLayer,
    keys::{BODY, RELATIVE},
    numbers::{Numbers, TINY},
    values::Values,
};
use crate::{
    contact::Rule,
    geometry::Geometry,
    grid::{Back, Bond, Rim},
    material::{Elastic, Material, PRESETS, Stiffness, Strengths, Waves},
};

pub(super) fn target(values: &mut Values<'_>) -> Option<Target> {
    let has_free_back = values.get("target.back") == Some(Back::Free);
    let layers = layers(values, "target", None, has_free_back)?;
    let (first, count) = (layers.first()?, layers.len());
    let material = Material { shear_wave_speed: first.waves.shear, si: first.si };
    let thickness = layers.iter().map(|layer| layer.thickness).sum();
    if count == 1 {
        values.rename_only_layer();
    }
    let (back, radius) = (values.get("target.back")?, values.number("target.radius"));
    if radius.is_none() {
        values.unwanted("target.rim", " is given, but the target has no end", "give target.radius");
    }
    let rim = values.get("target.rim").unwrap_or(Rim::Free);
    Some(Target { thickness, material, layers, back, radius, rim })
}

/// The body of an indenter that gives; none of a rigid one, or after a problem.
///
/// * `indenter`: head, radius, mass and material
/// * `target`: what it strikes
pub(super) fn striker(values: &mut Values<'_>, indenter: &Body, target: &Target) -> Option<Striker> {
    let has_layers = values.is_table(BODY.path);
    if !has_layers && values.get::<String>("indenter.body").as_deref() != Some("elastic") {
        return None;
    }
    if values.get("impact.contact") == Some(Rule::Prescribed) {
        let what = " gives the motion of the surface, which an indenter that gives does not";
        values.refuse("impact.contact", what, "use another contact rule, or leave indenter.body out");
    }
    let Some(radius) = values.number("indenter.body.radius").or(indenter.radius) else {
        let key = if has_layers { "indenter.body.radius" } else { "indenter.radius" };
        values.need(key, "the radius of the body, as the head has none");
        return None;
    };
    let struck = target.layers.first()?;
    let (layers, weight) = match has_layers {
        true => {
            let meaning = "its layers, from the nose up, as [[indenter.body.layer]]; or body = \"elastic\"";
            values.need("indenter.body.layer", meaning);
            values.count("indenter.body.layer")?;
            let weight = values.number("indenter.body.back.mass");
            let layers = layers(values, BODY.path, Some(struck), false)?;
            if weight.is_some() && layers.last()?.thickness.is_none() {
                let what = " is given, but the last layer is a half-space, which has no back";
                values.unwanted("indenter.body.back", what, "leave it out, or give the layer a thickness");
            }
            (layers, weight)
        }
        false => (vec![whole(values, indenter, radius)?], None),
    };
    let thickness = layers.iter().map(|layer| layer.thickness).sum();
    let material = Material { shear_wave_speed: struck.waves.shear, si: struck.si };
    let back = if weight.is_some() { Back::Rigid } else { Back::Free };
    // one guide holds both
    let rim = if target.radius.is_some() { target.rim } else { Rim::Free };
    let body = Target { thickness, material, layers, back, radius: Some(radius), rim };
    Some(Striker { body, weight })
}

/// A body of the indenter's material, as long as its mass asks: `M = γπa²L`, in the plane `M = γaL` of the half x ≥ 0.
fn whole(values: &Values<'_>, indenter: &Body, radius: f64) -> Option<TargetLayer> {
    let Some((preset, scales)) = indenter.material.zip(values.system.scales) else {
        let help = "give indenter.material, or the layers of the body: [[indenter.body.layer]]";
        values.refuse("indenter.body", ", but its material is not known", help);
        return None;
    };
    if indenter.mass.is_infinite() {
        let help = "give indenter.mass, or the layers of the body, the last of which may be a half-space";
        values.refuse("indenter.body", ", but its mass is not known", help)?;
    }
    let unit = (scales.density, scales.speed);
    let layer = TargetLayer::of(preset.name.into(), preset.elastic(), unit, preset.strengths);
    let area = values.system.geometry.area(radius);
    Some(TargetLayer { thickness: Some(indenter.mass / (layer.density * area)), ..layer })
}

impl Striker {
    /// Mass of its layers and of what is bonded to its back; infinite of a half-space \[πγR³; plane γR²\].
    pub fn mass(&self, geometry: Geometry) -> f64 {
        let area = geometry.area(self.body.radius.unwrap_or_default());
        let layers = self.body.layers.iter();
        let layers = layers.map(|layer| layer.thickness.map_or(f64::INFINITY, |h| layer.density * area * h));
        layers.sum::<f64>() + self.weight.unwrap_or_default()
    }
}

/// All layers of a body; none after a problem with one.
///
/// * `body`: section that has them
/// * `struck`: the struck layer of the target, whose constants are units, if these are others
/// * `has_free_back`: true if the last one cannot be a half-space
pub(super) fn layers(
    values: &mut Values<'_>,
    body: &str,
    struck: Option<&TargetLayer>,
    has_free_back: bool,
) -> Option<Vec<TargetLayer>> {
    let paths = values.layer_paths(body);
    let count = paths.len();
    let (mut layers, mut struck) = (Vec::new(), struck.cloned());
    for (i, path) in paths.into_iter().enumerate() {
        let constants = constants(values, (i, &path), struck.as_ref());
        check_bond(values, &path, i);
        check_half_space(values, &format!("{path}.thickness"), i + 1 == count, has_free_back);
        struck = struck.or_else(|| constants.clone());
        let thickness = values.checked.get(&format!("{path}.thickness")).map(toml::Value::as_float);
        let bond = values.get(&format!("{path}.bond")).unwrap_or(Bond::Welded);
        let bond_strength = values.bond_strength(&format!("{path}.bond_strength"));
        let layer = |(layer, thickness)| TargetLayer { thickness, bond, bond_strength, ..layer };
        layers.extend(constants.zip(thickness).map(layer));
    }
    (layers.len() == count).then_some(layers)
}

impl TargetLayer {
    /// A layer of a material, as thick as a half-space and welded.
    ///
    /// * `unit`: density \[kg/m³\] and wave speed \[m/s\] of the struck layer
    fn of(name: String, si: Elastic, unit: (f64, f64), strengths: Strengths) -> Self {
        let (c_p, c_s) = si.wave_speeds();
        let constants = (si.density / unit.0, c_p / unit.1, c_s / unit.1, si.stiffness());
        Self { si: Some(si), strengths, ..Self::dimensionless(name, constants) }
    }

    /// * `density`, `wave_speed`, `shear`: in units of the struck layer
    fn dimensionless(
        name: String,
        (density, wave_speed, shear, stiffness): (f64, f64, f64, Stiffness),
    ) -> Self {
        let waves = Waves { impedance: density * wave_speed, shear };
        let (thickness, si, bond, bond_strength) = (None, None, Bond::Welded, None);
        let strengths = Strengths::default();
        Self { name, thickness, si, density, wave_speed, waves, stiffness, bond, strengths, bond_strength }
    }
}

/// A layer of the constants of a section, as thick as a half-space and welded; none after a problem.
///
/// * `i`: number of layers above
/// * `struck`: the struck layer, if this is another one
fn constants(
    values: &mut Values<'_>,
    (i, path): (usize, &str),
    struck: Option<&TargetLayer>,
) -> Option<TargetLayer> {
    let [ratio, material, density, wave_speed] =
        ["shear_wave_speed", "material", "density", "wave_speed"].map(|key| format!("{path}.{key}"));
    let name = format!("layer {}", i + 1);
    match values.system.numbers {
        Numbers::Unclear => {
            if struck.is_none() && i == 0 && !values.is_given(&material) {
                need_material(values, &ratio, &material);
            }
            None
        }
        Numbers::Physical => {
            values.need(&material, "its material, as the first layer makes the case physical");
            let si = values.elastic(&material)?;
            check_ratio(values, &material, si.stiffness().slowness());
            if !values.model.has_shear() && !si.stiffness().is_isotropic() {
                let what = " is not alike in all directions";
                let help = "set model = \"elastic\": the simplified theory has one displacement";
                values.problem(&material, format!("`{material}`{what}"), help);
            }
            let unit = struck.map_or(Some(si), |struck| struck.si)?;
            let preset = PRESETS.iter().find(|preset| si == preset.elastic());
            let name = preset.map_or(name, |preset| preset.name.into());
            let strengths = values.strengths(&material);
            let layer = TargetLayer::of(name, si, (unit.density, unit.wave_speeds().0), strengths);
            for (noun, ratio) in [("density", layer.density), ("wave speed", layer.wave_speed)] {
                if !RELATIVE.contain(ratio) {
                    let message = format!("`{material}` has {ratio:e} times the {noun} of the first layer");
                    values.problem(&material, message, format!("allowed: {RELATIVE}"));
                }
            }
            Some(layer)
        }
        Numbers::Dimensionless => {
            let number = |name: &str, default: Option<f64>| match values.is_given(name) {
                true => values.number(name),
                false => default,
            };
            let shear = number(&ratio, struck.map(|struck| struck.waves.shear));
            let relative = [&density, &wave_speed].map(|name| (name, number(name, Some(1.0))));
            for (name, number) in relative {
                if struck.is_none() && number.is_some_and(|number| number != 1.0) {
                    let help =
                        "allowed: 1, as the first layer is the unit of the others; or leave the key out";
                    values.refuse(name, " is not possible", help);
                }
            }
            let [(_, density), (_, speed)] = relative;
            let (shear, speed) = (shear?, speed?);
            let key = if values.is_given(&ratio) { &ratio } else { &wave_speed };
            check_ratio(values, key, shear / speed);
            values.set(&ratio, shear);
            let stiffness = Stiffness::isotropic(shear / speed);
            Some(TargetLayer::dimensionless(name, (density?, speed, shear, stiffness)))
        }
    }
}

/// Notes that the struck layer has neither a ratio of wave speeds nor a material.
fn need_material(values: &Values<'_>, ratio: &str, material: &str) {
    let lengths = [
        "impact.velocity",
        "impact.drop",
        "run.end_time",
        "indenter.radius",
        "indenter.diameter",
        "indenter.nose_radius",
        "length_unit",
    ];
    if lengths.iter().any(|name| values.is_given(name) && values.written(name).starts_with(['"', '\''])) {
        let meaning = "the material of the target by name (`percuss materials` lists them) or with its constants as quantities";
        values.need(material, meaning);
    } else {
        let meaning = "the number c_s/c_p, for a dimensionless case; or material, the material of the target by name or \
                       with its constants, for a physical one";
        values.need(ratio, meaning);
    }
}

/// Notes a ratio of wave speeds that the theory does not allow.
///
/// * `name`: key of what has it
fn check_ratio(values: &Values<'_>, name: &str, ratio: f64) {
    let largest = values.largest_ratio();
    if ratio >= largest || ratio < TINY {
        let message = format!("`{name}` has c_s/c_p = {ratio:?}, which the theory does not allow");
        values.problem(name, message, format!("allowed: c_s/c_p ≥ {TINY} and < {largest:?}"));
    }
}

/// Notes a bond that is not possible.
///
/// * `path`: of the layer
/// * `above`: number of layers above
fn check_bond(values: &Values<'_>, path: &str, above: usize) {
    let names = ["bond", "bond_strength"].map(|key| format!("{path}.{key}"));
    if above == 0 {
        let what = " is given, but nothing is above the first layer";
        names.iter().for_each(|name| values.unwanted(name, what, "leave the key out"));
    } else if values.get(&names[0]) == Some(Bond::Sliding) && !values.model.has_shear() {
        let help = "leave the key out: the simplified theory has no displacements along the layers";
        values.refuse(&names[0], " needs model = \"elastic\"", help);
    }
}

/// Notes a half-space that is not the last layer, or has a free back.
fn check_half_space(values: &Values<'_>, name: &str, is_last: bool, has_free_back: bool) {
    if !values.checked.get(name).is_some_and(toml::Value::is_str) {
        return;
    }
    if !is_last {
        values.refuse(name, ", but there are layers below it", "only the last layer can be a half-space");
    } else if has_free_back {
        let message = "`target.back` = \"free\", but the last layer is a half-space, which has no back";
        values.problem("target.back", message, "leave target.back out, or give the layer a thickness");
    }
}
