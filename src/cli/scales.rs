//! What a physical case is in its own units: for `percuss check` and `percuss run`.

use super::layers;
use crate::{
    advice::rigidity::Rigidity,
    case::Case,
    contact::load::Load,
    geometry::Geometry,
    grid::Rim,
    units::{Dimension, Scales, Units, engineering, name},
};

/// Rows of names and texts: the target, the indenter and the scales.
pub(super) fn rows(case: &Case, scales: &Scales) -> Vec<(&'static str, String)> {
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
            let target = layers::target(case, &length.text(h));
            format!("{target}, which a wave crosses in {}", time.text(layers::crossing(case)))
        }
        None => layers::target(case, ""),
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
    rows.extend(layers::rows(case));
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

/// Force, duration and place of a load.
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
    fn a_plane_case_says_whose_its_force_is_and_two_materials_how_rigid() {
        let text = |geometry: &str| {
            let case = Case::sound("ball", &[geometry]);
            let rows = rows(&case, &case.scales.expect("a physical case"));
            rows.into_iter().map(|(key, text)| format!("{key}: {text}\n")).collect::<String>()
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
