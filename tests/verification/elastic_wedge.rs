//! Plane wedge on a half-space of the full theory, its whole surface moving as the wedge prescribes, with edges that outrun P waves.
//!
//! ```text
//! behind the edge: p = V0[(1 − 2β²s²)²/√(1 − s²) + 4β³s²√(1 − β²s²)],  s = 1/V*,  until waves of the apex arrive at r = t
//! ```

use super::{case, run};

#[test]
fn pressure_behind_the_edge() {
    // c_s/c_p, V*, largest errors of the mean and of the pressure less its mean. Measured on 50, 100, 200 cells: mean -1.8e-4, 1.4e-4,
    // -5.6e-5 and ripple 6.8e-3, 5.2e-3, 2.7e-3; for V* = 1.5 -4.4e-3, -2.2e-4, -3e-6 and 4.5e-2, 6.9e-3, 7.0e-3.
    for (c_s, speed, mean_allowed, ripple_allowed) in [(0.3f64, 2.0f64, 2e-4, 4e-3), (0.5, 1.5, 5e-5, 1e-2)] {
        let cells = 200;
        let overrides = [
            "model=elastic".to_owned(),
            "geometry=plane".to_owned(),
            format!("target.shear_wave_speed={c_s}"),
            format!("indenter.slope={:?}", 1.0 / speed),
            "run.end_time=0.8".to_owned(),
            "record.frames=0".to_owned(),
            format!("mesh.cells={cells}"),
        ];
        let case = case("fig6a", &overrides);
        let grid = case.grid();
        let s = 1.0 / speed;
        let b = c_s * c_s;
        let exact = (1.0 - 2.0 * b * s * s).powi(2) / (1.0 - s * s).sqrt()
            + 4.0 * c_s.powi(3) * s * s * (1.0 - b * s * s).sqrt();
        assert!(speed != 2.0 || (exact - 1.07981).abs() < 1e-5);
        let last = run(&case, |view| (view.time, view.interface.pressure.to_vec())).pop().expect("steps");
        let (time, pressure) = last;
        // a tenth of the way clear of the wave of the apex and of the edge
        let clear = 0.1 * (speed - 1.0) * time;
        let between = |r: f64| r > time + clear && r < speed * time - clear;
        let ratios: Vec<f64> = pressure
            .iter()
            .enumerate()
            .filter(|(i, _)| between(grid.r(*i)))
            .map(|(_, p)| p / exact - 1.0)
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let ripple = ratios.iter().map(|ratio| (ratio - mean).abs()).fold(0.0, f64::max);
        let name = format!("c_s = {c_s}, V* = {speed}, {} nodes", ratios.len());
        assert!(mean.abs() <= mean_allowed && ripple <= ripple_allowed, "{name}: {mean:e} ± {ripple:e}");
    }
}
