//! The target: its layers, or its only one.

use super::{Target, TargetLayer, bounds::TINY, keys::RELATIVE, system::Numbers, values::Values};
use crate::{
    grid::{Back, Bond, Rim},
    material::{Elastic, Material, PRESETS, Preset, Stiffness, Strengths, Waves},
    units::Scales,
};

/// The target, or the problems with it.
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
    if radius.is_none() && values.is_given("target.rim") {
        values.problem(
            "target.rim",
            "`target.rim` is given, but the target has no end",
            "give target.radius",
        );
    }
    let rim = values.get("target.rim").unwrap_or(Rim::Free);
    Some(Target { thickness, material, layers, back, radius, rim })
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
        layers.extend(constants.zip(thickness).map(|(layer, thickness)| TargetLayer {
            thickness,
            bond,
            bond_strength,
            ..layer
        }));
    }
    (layers.len() == count).then_some(layers)
}

impl TargetLayer {
    /// A layer of a material, as thick as a half-space and welded.
    ///
    /// * `scales`: of the struck layer
    pub(super) fn of(preset: &Preset, scales: &Scales) -> Self {
        let si = preset.elastic();
        let (c_p, c_s) = si.wave_speeds();
        let [wave_speed, shear] = [c_p, c_s].map(|speed| speed / scales.speed);
        let constants = (si.density / scales.density, wave_speed, shear, si.stiffness());
        Self::new(preset.name.into(), Some(si), constants, preset.strengths)
    }

    /// * `density`, `wave_speed`, `shear`: in units of the struck layer
    fn new(
        name: String,
        si: Option<Elastic>,
        (density, wave_speed, shear, stiffness): (f64, f64, f64, Stiffness),
        strengths: Strengths,
    ) -> Self {
        let waves = Waves { impedance: density * wave_speed, shear };
        let (thickness, bond, bond_strength) = (None, Bond::Welded, None);
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
    let (si, density, wave_speed, shear, stiffness) = match values.system.numbers {
        Numbers::Unclear => {
            if struck.is_none() && i == 0 && !values.is_given(&material) {
                need_material(values, &ratio, &material);
            }
            return None;
        }
        Numbers::Physical => {
            values.need(&material, "its material, as the first layer makes the case physical");
            let si = values.elastic(&material)?;
            let ((c_p, c_s), stiffness) = (si.wave_speeds(), si.stiffness());
            check_ratio(values, &material, stiffness.slowness());
            if !values.model.has_shear() && !stiffness.is_isotropic() {
                let message = format!("`{material}` is not alike in all directions");
                let help = "set model = \"elastic\": the simplified theory has one displacement";
                values.problem(&material, message, help);
            }
            let unit = match struck {
                None => si,
                Some(struck) => struck.si?,
            };
            let (unit_speed, _) = unit.wave_speeds();
            let (density, wave_speed) = (si.density / unit.density, c_p / unit_speed);
            for (noun, ratio) in [("density", density), ("wave speed", wave_speed)] {
                if !RELATIVE.contain(ratio) {
                    let message = format!("`{material}` has {ratio:e} times the {noun} of the first layer");
                    values.problem(&material, message, format!("allowed: {RELATIVE}"));
                }
            }
            (Some(si), density, wave_speed, c_s / unit_speed, stiffness)
        }
        Numbers::Dimensionless => {
            let number = |name: &str, default: Option<f64>| match values.is_given(name) {
                true => values.number(name),
                false => default,
            };
            let shear = number(&ratio, struck.map(|struck| struck.waves.shear));
            let [relative_density, relative_speed] =
                [&density, &wave_speed].map(|name| number(name, Some(1.0)));
            for (name, number) in [(&density, relative_density), (&wave_speed, relative_speed)] {
                if struck.is_none() && number.is_some_and(|number| number != 1.0) {
                    let help =
                        "allowed: 1, as the first layer is the unit of the others; or leave the key out";
                    values.refuse(name, " is not possible", help);
                }
            }
            let (shear, relative_speed) = (shear?, relative_speed?);
            let key = if values.is_given(&ratio) { &ratio } else { &wave_speed };
            check_ratio(values, key, shear / relative_speed);
            values.set(&ratio, shear);
            (None, relative_density?, relative_speed, shear, Stiffness::isotropic(shear / relative_speed))
        }
    };
    let preset = PRESETS.iter().find(|preset| si == Some(preset.elastic()));
    let name = preset.map_or_else(|| format!("layer {}", i + 1), |preset| preset.name.into());
    let constants = (density, wave_speed, shear, stiffness);
    Some(TargetLayer::new(name, si, constants, values.strengths(&material)))
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
    let [name, strength] = &["bond", "bond_strength"].map(|key| format!("{path}.{key}"));
    for name in [name, strength].into_iter().filter(|name| above == 0 && values.is_given(name)) {
        let message = format!("`{name}` is given, but nothing is above the first layer");
        values.problem(name, message, "leave the key out");
    }
    if above > 0 && values.get(name) == Some(Bond::Sliding) && !values.model.has_shear() {
        let message = format!("`{name}` = \"sliding\" needs model = \"elastic\"");
        let help = "leave the key out: the simplified theory has no displacements along the layers";
        values.problem(name, message, help);
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
