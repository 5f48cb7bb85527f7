//! The target: its layers, or its only one.

use super::{Target, TargetLayer, bounds::TINY, keys::RELATIVE, system::Numbers, values::Values};
use crate::{
    grid::{Back, Bond},
    material::{Elastic, Material, PRESETS, Waves},
    model::ModelKind,
};

/// Constants of a layer in units of the struck one.
struct Constants {
    si: Option<Elastic>,
    density: f64,
    wave_speed: f64,
    shear: f64,
}

/// The target, or the problems with it.
pub(super) fn target(values: &mut Values<'_>) -> Option<Target> {
    let count = values.layers.unwrap_or(1);
    let (mut layers, mut struck) = (Vec::new(), None);
    for (i, path) in values.layer_paths().into_iter().enumerate() {
        let constants = constants(values, &path, struck.as_ref());
        check_bond(values, &format!("{path}.bond"), i);
        check_half_space(values, &format!("{path}.thickness"), i + 1 == count);
        let thickness = values.checked.get(&format!("{path}.thickness")).map(toml::Value::as_float);
        if let Some((constants, thickness)) = constants.zip(thickness) {
            let bond = values.get(&format!("{path}.bond")).unwrap_or(Bond::Welded);
            layers.push(constants.layer(i + 1, thickness, bond));
            struck.get_or_insert(constants);
        }
    }
    // after a problem layers are missing
    let first = layers.first().filter(|_| layers.len() == count)?;
    let material = Material { shear_wave_speed: first.waves.shear, si: first.si };
    let thickness = layers.iter().map(|layer| layer.thickness).sum();
    if count == 1 {
        values.rename_only_layer();
    }
    Some(Target { thickness, material, layers, back: values.get("target.back")? })
}

/// Constants of a layer, complete; none after a problem.
///
/// * `struck`: those of the struck layer, if this is another one
fn constants(values: &mut Values<'_>, path: &str, struck: Option<&Constants>) -> Option<Constants> {
    let [ratio, material, density, wave_speed] =
        ["shear_wave_speed", "material", "density", "wave_speed"].map(|key| format!("{path}.{key}"));
    let is_struck = ["target", "target.layer.1"].contains(&path);
    match values.system.numbers {
        Numbers::Unclear if is_struck && !values.is_given(&material) => {
            need_material(values, &ratio, &material);
            None
        }
        Numbers::Unclear => None,
        Numbers::Physical => {
            values.need(&material, "its material, as the first layer makes the case physical");
            let si = values.elastic(&material)?;
            let (c_p, c_s) = si.wave_speeds().ok()?;
            check_ratio(values, &material, c_s / c_p);
            let (unit, unit_density) = match struck.and_then(|struck| struck.si) {
                Some(struck) => (struck.wave_speeds().ok()?.0, struck.density),
                None if is_struck => (c_p, si.density),
                None => return None,
            };
            let (density, wave_speed) = (si.density / unit_density, c_p / unit);
            for (noun, ratio) in [("density", density), ("wave speed", wave_speed)] {
                if !RELATIVE.contain(ratio) {
                    let message = format!("`{material}` has {ratio:e} times the {noun} of the first layer");
                    values.problem(&material, message, format!("allowed: {RELATIVE}"));
                }
            }
            Some(Constants { si: Some(si), density, wave_speed, shear: c_s / unit })
        }
        Numbers::Dimensionless => {
            let is_refused = |name: &String| values.is_given(name) && !values.checked.contains_key(name);
            if [&ratio, &density, &wave_speed].into_iter().any(is_refused) {
                return None;
            }
            let number = |name, default| values.number(name).unwrap_or(default);
            let shear = number(&ratio, struck.map_or(0.5, |struck| struck.shear));
            let constants = Constants {
                si: None,
                density: number(&density, 1.0),
                wave_speed: number(&wave_speed, 1.0),
                shear,
            };
            for (name, number) in [(&density, constants.density), (&wave_speed, constants.wave_speed)] {
                if is_struck && number != 1.0 {
                    let help =
                        "allowed: 1, as the first layer is the unit of the others; or leave the key out";
                    values.refuse(name, " is not possible", help);
                }
            }
            let key = if values.is_given(&ratio) { &ratio } else { &wave_speed };
            check_ratio(values, key, shear / constants.wave_speed);
            values.set(&ratio, shear);
            Some(constants)
        }
    }
}

/// Notes that the struck layer has neither a ratio of wave speeds nor a material.
fn need_material(values: &Values<'_>, ratio: &str, material: &str) {
    let lengths =
        ["impact.velocity", "run.end_time", "indenter.radius", "indenter.nose_radius", "length_unit"];
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

impl Constants {
    /// The layer of these constants.
    fn layer(&self, number: usize, thickness: Option<f64>, bond: Bond) -> TargetLayer {
        let Self { si, density, wave_speed, shear } = *self;
        let preset = PRESETS.iter().find(|preset| si == Some(preset.elastic()));
        TargetLayer {
            name: preset.map_or_else(|| format!("layer {number}"), |preset| preset.name.into()),
            thickness,
            si,
            density,
            wave_speed,
            waves: Waves { impedance: density * wave_speed, shear },
            bond,
        }
    }
}

/// Notes a bond that is not possible.
///
/// * `above`: number of layers above
fn check_bond(values: &Values<'_>, name: &str, above: usize) {
    if above == 0 && values.is_given(name) {
        let message = format!("`{name}` is given, but nothing is above the first layer");
        values.problem(name, message, "leave the key out");
    } else if values.get(name) == Some(Bond::Sliding) && values.model == ModelKind::Rakhmatulin {
        let message = format!("`{name}` = \"sliding\" needs model = \"elastic\"");
        let help = "leave the key out: the simplified theory has no displacements along the layers";
        values.problem(name, message, help);
    }
}

/// Notes a half-space that is not the last layer, or has a free back.
fn check_half_space(values: &Values<'_>, name: &str, is_last: bool) {
    if !values.checked.get(name).is_some_and(toml::Value::is_str) {
        return;
    }
    if !is_last {
        values.refuse(name, ", but there are layers below it", "only the last layer can be a half-space");
    } else if values.get("target.back") == Some(Back::Free) {
        let message = "`target.back` = \"free\", but the last layer is a half-space, which has no back";
        values.problem("target.back", message, "leave target.back out, or give the layer a thickness");
    }
}
