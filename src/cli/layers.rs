//! The layers of a target, for `percuss check` and `percuss run`.

use serde_json::json;

use crate::{
    case::{Case, LayerSizes, TargetLayer},
    grid::Back,
    units::{Dimension, engineering},
};

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
pub(super) fn crossing(case: &Case) -> f64 {
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
pub(super) fn rows(case: &Case) -> Vec<(&'static str, String)> {
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
}
