//! What a physical case is in its own units: for `percuss check` and `percuss run`.

use crate::{
    case::Case,
    units::{Dimension, Scales, Units, engineering, name},
};

/// Rows of names and texts: the target, the indenter and the scales.
pub(super) fn rows(case: &Case, scales: &Scales) -> Vec<(&'static str, String)> {
    let Units { length, time, speed, .. } = case.units();
    let [c_p, c_s] = [1.0, case.target.material.shear_wave_speed].map(|c| speed.text(c));
    let target = match case.target.thickness {
        Some(h) => {
            format!("layer of thickness {}, which a wave crosses in {}", length.text(h), time.text(h))
        }
        None => "half-space".into(),
    };
    let scale = |symbol, dimension| {
        let unit = name(dimension, case.geometry, true);
        format!("{symbol} = {}", engineering(scales.of(dimension), unit))
    };
    let named = |dimension| scale(name(dimension, case.geometry, false), dimension);
    let mass = match case.indenter.mass {
        mass if mass.is_finite() => {
            let unit = name(Dimension::Mass, case.geometry, true);
            engineering(mass * scales.of(Dimension::Mass), unit)
        }
        _ => "infinite mass".into(),
    };
    let density = engineering(scales.density, name(Dimension::Density, case.geometry, true));
    vec![
        ("target", format!("{target}; c_p = {c_p}, c_s = {c_s}, density {density}")),
        ("indenter", format!("{mass}, V0 = {}", speed.text(case.impact.velocity))),
        (
            "scales",
            [Dimension::Length, Dimension::Time, Dimension::Stress, Dimension::Force, Dimension::Energy]
                .map(named)
                .join(", "),
        ),
        ("playback", format!("1 s of log time shows {}", engineering(1.0 / case.record.playback_rate, "s"))),
    ]
}
