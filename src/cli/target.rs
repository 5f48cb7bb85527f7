//! The target, the indenter and the scales of a case in words, for `percuss check` and `percuss run`.

use serde_json::json;

use crate::{
    advice::rigidity::Rigidity,
    case::{Case, LayerSizes, TargetLayer},
    contact::load::Load,
    geometry::Geometry,
    grid::{Back, Rim},
    units::{Dimension, Scales, Units, engineering, name},
};

/// Rows of names and texts: of a physical case the target, the indenter and the scales, of any other its layers.
pub(super) fn rows(case: &Case) -> Vec<(&'static str, String)> {
    case.scales.map_or_else(|| layer_rows(case), |scales| physical_rows(case, &scales))
}

/// The target in words, without its constants.
///
/// * `thickness`: as a text
pub(super) fn target(case: &Case, thickness: &str) -> String {
    let text = match (case.sizes.has_back, case.sizes.layers.len()) {
        (true, 1) => format!("layer of thickness {thickness}"),
        (true, layers) => format!("{layers} layers of thickness {thickness}"),
        (false, 1) => "half-space".into(),
        (false, 2) => "layer on a half-space".into(),
        (false, layers) => format!("{} layers on a half-space", layers - 1),
    };
    match case.target.back {
        Back::Rigid => text,
        Back::Free => format!("{text} with a free back"),
    }
}

/// Time in which a wave crosses a layer \[R/c_p\]; `None` for a half-space.
fn transit(layer: &TargetLayer, rows: &LayerSizes) -> Option<f64> {
    Some(layer.thickness? / (layer.wave_speed * (1.0 + rows.speed_change)))
}

/// Time in which a wave crosses all layers above a half-space \[R/c_p\].
fn crossing(case: &Case) -> f64 {
    let computed = case.target.computed();
    computed.iter().zip(&case.sizes.layers).filter_map(|(layer, rows)| transit(layer, rows)).sum()
}

/// Reflection coefficient of stress at the lower face of a layer, `(Z₂ − Z₁)/(Z₂ + Z₁)`; `None` for a half-space.
fn reflection(case: &Case, computed: &[TargetLayer], number: usize) -> Option<f64> {
    computed[number].thickness?;
    let z = |layer: &TargetLayer| layer.waves.impedance;
    Some(match (computed.get(number + 1), case.target.back) {
        (Some(below), _) => {
            let (upper, lower) = (z(&computed[number]), z(below));
            (lower - upper) / (lower + upper)
        }
        (None, Back::Rigid) => 1.0,
        (None, Back::Free) => -1.0,
    })
}

/// A row for every layer of a target of several.
fn layer_rows(case: &Case) -> Vec<(&'static str, String)> {
    let (computed, units) = (case.target.computed(), case.units());
    if computed.len() == 1 {
        return Vec::new();
    }
    let impedance = |z: f64| match case.scales {
        Some(scales) => engineering(z * scales.density * scales.speed, "Pa·s/m"),
        None => format!("{z:.4}"),
    };
    let row = |(number, (layer, rows)): (usize, (&TargetLayer, &LayerSizes))| {
        let size = match layer.thickness.zip(transit(layer, rows)) {
            Some((thickness, time)) => {
                format!("{} crossed in {}", units.length.text_to(6, thickness), units.time.text_to(6, time))
            }
            None => "half-space".into(),
        };
        let face = reflection(case, &computed, number)
            .map_or_else(String::new, |r| format!(", reflection at its lower face {r:.4}"));
        let (name, z) = (&layer.name, impedance(layer.waves.impedance));
        // no negative zero
        let percent = (1e5 * rows.speed_change).round() / 1e3 + 0.0;
        let rows = rows.rows();
        let text =
            format!("{name}: {rows} rows, {size}, wave speed changed by {percent:.3} %, impedance {z}{face}");
        (if number == 0 { "layers" } else { "" }, text)
    };
    computed.iter().zip(&case.sizes.layers).enumerate().map(row).collect()
}

/// The layers as JSON, in SI units in a physical case.
pub(super) fn json(case: &Case) -> serde_json::Value {
    let computed = case.target.computed();
    let si = |dimension, x: f64| case.scales.map_or(x, |scales| x * scales.of(dimension));
    let unit = case.scales.map_or(1.0, |scales| scales.density * scales.speed);
    let entry = |(number, (layer, rows)): (usize, (&TargetLayer, &LayerSizes))| {
        let time = transit(layer, rows);
        json!({
            "name": layer.name,
            "rows": rows.steps,
            "thickness": layer.thickness.map(|h| si(Dimension::Length, h)),
            "transit_time": time.map(|time| si(Dimension::Time, time)),
            "speed_change": rows.speed_change,
            "impedance": unit * layer.waves.impedance,
            "density": si(Dimension::Density, layer.density),
            "wave_speed": si(Dimension::Speed, layer.wave_speed),
            "lateral_wave_speed": si(Dimension::Speed, layer.wave_speed * layer.stiffness.lateral.sqrt()),
            "shear_wave_speed": si(Dimension::Speed, layer.waves.shear),
            "bond": layer.bond,
            "reflection": reflection(case, &computed, number),
        })
    };
    computed.iter().zip(&case.sizes.layers).enumerate().map(entry).collect()
}

fn physical_rows(case: &Case, scales: &Scales) -> Vec<(&'static str, String)> {
    let Units { length, time, speed, .. } = case.units();
    let [c_p, c_s] = [1.0, case.target.material.shear_wave_speed].map(|c| speed.text(c));
    let lateral = match case.target.layers[0].stiffness {
        stiffness if stiffness.is_isotropic() => String::new(),
        stiffness => format!(" along z, {} along r", speed.text(stiffness.lateral.sqrt())),
    };
    let rim = case.target.radius.map_or_else(String::new, |radius| {
        let rim = match case.target.rim {
            Rim::Free => "free",
            Rim::Guided => "guided",
        };
        format!(", of radius {} with a {rim} rim", length.text(radius))
    });
    let target = match case.target.thickness {
        Some(h) => {
            let target = target(case, &length.text(h));
            format!("{target}, which a wave crosses in {}", time.text(crossing(case)))
        }
        None => target(case, ""),
    };
    let is_plane = case.geometry == Geometry::Plane;
    let scale = |dimension| {
        // the dimensionless numbers are those of the half x ≥ 0
        let is_doubled = is_plane && [Dimension::Force, Dimension::Energy].contains(&dimension);
        let factor = if is_doubled { "2" } else { "" };
        let [symbol, unit] = [false, true].map(|is_si| name(dimension, case.geometry, is_si));
        format!("{factor}{symbol} = {}", engineering(scales.of(dimension), unit))
    };
    let mass = match case.indenter.mass {
        mass if mass.is_finite() => {
            let unit = name(Dimension::Mass, case.geometry, true);
            engineering(mass * scales.of(Dimension::Mass), unit)
        }
        _ => "infinite mass".into(),
    };
    let density = engineering(scales.density, name(Dimension::Density, case.geometry, true));
    let scales = [Dimension::Length, Dimension::Time, Dimension::Stress, Dimension::Force, Dimension::Energy];
    let mut rows =
        vec![("target", format!("{target}{rim}; c_p = {c_p}{lateral}, c_s = {c_s}, density {density}"))];
    rows.extend(layer_rows(case));
    rows.extend([
        match &case.load {
            Some(load) => ("load", load_text(case, load)),
            None => ("indenter", format!("{mass}, V0 = {}", speed.text(case.impact.velocity))),
        },
        ("scales", scales.map(scale).join(", ")),
    ]);
    rows.extend(Rigidity::of(case).map(|rigidity| ("rigid", rigidity.text())));
    if is_plane {
        let text = "force, mass and energy are per metre and of the whole body and contact, both halves";
        rows.push(("plane", text.into()));
    }
    let playback = engineering(1.0 / case.record.playback_rate, "s");
    rows.push(("playback", format!("1 s of log time shows {playback}")));
    rows
}

fn load_text(case: &Case, load: &Load) -> String {
    let Units { length, time, force, .. } = case.units();
    let place = load.radius.map_or_else(|| "a point".into(), |radius| format!("r ≤ {}", length.text(radius)));
    let [largest, duration] = [force.text(load.force.largest()), time.text(load.force.duration())];
    format!("up to {largest} during {duration}, on {place}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflections_are_those_of_stress() {
        let of = |name: &str, settings: &[&str]| json(&Case::sound(name, settings));
        let layers = of("layers", &["target.back=free"]);
        // Z = 1 and 0.5·0.8
        assert_eq!(layers[0]["reflection"], (0.4 - 1.0) / (0.4 + 1.0));
        assert_eq!((&layers[1]["reflection"], &layers[1]["rows"]), (&json!(-1.0), &json!(76)));
        assert!((layers[1]["transit_time"].as_f64().expect("a time") - 0.75).abs() < 1e-14);
        let coating = of("coating", &[]);
        // alumina, ρ√(E(1 − ν)/(ρ(1 + ν)(1 − 2ν)))
        let impedance = (3900.0 * 370e9 * 0.78 / (1.22 * 0.56f64)).sqrt();
        assert!((coating[0]["impedance"].as_f64().expect("SI") / impedance - 1.0).abs() < 1e-14);
        assert_eq!((&coating[1]["thickness"], &coating[1]["reflection"]), (&json!(null), &json!(null)));
        assert_eq!(of("fig5", &[])[0]["reflection"], 1.0);
    }

    #[test]
    fn a_plane_case_says_whose_its_force_is_and_two_materials_how_rigid() {
        let text = |geometry: &str| {
            let case = Case::sound("ball", &[geometry]);
            rows(&case).into_iter().map(|(key, text)| format!("{key}: {text}\n")).collect::<String>()
        };
        let (plane, round) = (text("geometry=plane"), text("geometry=axisymmetric"));
        for phrase in ["2Rγc_p² = 169.5 MN/m", "2R²γc_p² = 1.695 MJ/m", "per metre and of the whole body"]
        {
            assert!(plane.contains(phrase) && !round.contains(phrase), "{plane}");
        }
        // π·(10 mm)²·7850 kg/m³
        assert!(plane.contains("indenter: 2.466 kg/m"), "{plane}");
        assert!(round.contains("rigid: ") && round.contains("0.8 % too high"), "{round}");
    }
}
