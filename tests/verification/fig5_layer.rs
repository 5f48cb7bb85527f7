//! \[KA\] Fig. 5: axisymmetric flat punch on a layer, infinite mass. At long times F grows as A_d·V0·t/h.
//!
//! Reference: [`percuss::exact::disc_stiffness`]. The paper reads A_d ~ 1.5 at h = 1, c_s = 0.5.

use percuss::exact::disc_stiffness::DiscStiffness;

use super::{case, run};

/// Slope of the drag over 20 < t < 40 times h/V0, by least squares: the steps of the reflections average out.
fn slope(h: f64, c_s: f64, cells: usize) -> f64 {
    let overrides = [
        "run.end_time=40".to_owned(),
        "record.frames=0".to_owned(),
        format!("mesh.cells={cells}"),
        format!("target.thickness={h:?}"),
        format!("target.shear_wave_speed={c_s}"),
    ];
    let case = case("fig5", &overrides.each_ref().map(String::as_str));
    let drag = run(&case, |view| (view.time, view.drag));
    let drag: Vec<_> = drag.into_iter().filter(|(t, _)| (20.0..=40.0).contains(t)).collect();
    let n = drag.len() as f64;
    let t_mean = drag.iter().map(|point| point.0).sum::<f64>() / n;
    let f_mean = drag.iter().map(|point| point.1).sum::<f64>() / n;
    let above: f64 = drag.iter().map(|(t, f)| (t - t_mean) * (f - f_mean)).sum();
    let below: f64 = drag.iter().map(|(t, _)| (t - t_mean) * (t - t_mean)).sum();
    above / below * h
}

#[test]
fn drag_grows_with_the_stiffness_of_the_static_disc() {
    // what is left of the steps of the reflections after averaging
    let exact = DiscStiffness::new(1.0, 0.5).expect("parameters").drag_slope();
    assert!((exact - 1.48377).abs() < 1e-5);
    let got = slope(1.0, 0.5, 100);
    assert!((got - exact).abs() <= 0.002, "slope {got}, closed form {exact}");
}

#[test]
fn thicker_layer_and_slower_shear_waves() {
    // h = 2: the averaging window holds five periods of reflection instead of ten, and the approach to the static
    // state takes longer; h·c_s = 0.6 instead of 0.5
    let exact = DiscStiffness::new(2.0, 0.3).expect("parameters").drag_slope();
    let got = slope(2.0, 0.3, 100);
    assert!((got - exact).abs() <= 0.004, "slope {got}, closed form {exact}");
}
