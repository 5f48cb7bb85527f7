//! Cases of the full theory find their closed forms.

use super::*;

/// A plane case of the full theory at V0 = 0.5, β = 0.4 on a mesh of 20 cells.
fn elastic(indenter: &str, contact: &str, thickness: &str) -> Case {
    let text = format!(
        "title = \"t\"\nmodel = \"elastic\"\ngeometry = \"plane\"\n[target]\nthickness = {thickness}\n\
         shear_wave_speed = 0.4\n[indenter]\n{indenter}\nmass = inf\n[impact]\nvelocity = 0.5\n\
         contact = \"{contact}\"\n[mesh]\ncells = 20\n[run]\nend_time = 3.0\n"
    );
    Case::sound(&text, &[])
}

const FLAT: &str = "shape = \"flat\"\nradius = 1.0";
const WEDGE: &str = "shape = \"cone\"\nslope = 0.25";

/// Time, pressures and drag of a form from the first step to the last.
fn steps(form: &mut ClosedForm) -> Vec<(f64, Vec<f64>, f64)> {
    let view = |form: &mut ClosedForm, step| {
        let view = form.evaluate(step);
        (view.time, view.interface.pressure.to_vec(), view.drag)
    };
    (0..=form.last_step()).map(|step| view(form, step)).collect()
}

#[test]
fn the_plane_punch_of_the_full_theory() {
    for (contact, thickness, end) in
        [("unilateral", "\"half-space\"", 2.0), ("bilateral", "1.5", 2.0), ("unilateral", "0.6", 1.2)]
    {
        let mut form = ClosedForm::for_case(&elastic(FLAT, contact, thickness)).expect("a closed form");
        assert_eq!((form.name, form.end_time, form.has_drag), ("elastic_plane_punch", end, true));
        assert_eq!(
            form.to_string(),
            format!("pressure and drag of a plane flat punch, full theory; t < {end:.4}")
        );
        let steps = steps(&mut form);
        let (first, last) = (&steps[0], steps.last().expect("steps"));
        assert!(first.1.len() == 20 && first.1.iter().all(|&p| p == 0.25) && first.2 == 0.25);
        assert!(last.0 < end * (1.0 - 1e-12) && last.0 + form.dt > end * (1.0 - 1e-12), "{}", last.0);
        for (t, pressure, drag) in &steps[1..] {
            assert!((drag - 0.5 * (1.0 + 0.068_870 * t)).abs() < 1e-6, "{drag}");
            assert!(pressure.iter().all(|p| p.is_finite() && *p > 0.0));
            let untouched = pressure[0] == 0.5;
            assert_eq!(untouched, 1.0 - form.interface.r0 >= *t, "t = {t}");
        }
    }
}

#[test]
fn the_wedge_of_the_full_theory() {
    let mut form = ClosedForm::for_case(&elastic(WEDGE, "unilateral", "\"half-space\"")).expect("a form");
    assert_eq!((form.name, form.end_time, form.has_drag), ("elastic_wedge", f64::INFINITY, true));
    let steps = steps(&mut form);
    assert_eq!(steps.len() as u64, form.steps + 1);
    let (t, pressure, drag) = &steps[steps.len() / 2];
    assert!((drag - 0.5 * 2.0 * t).abs() < 1e-14);
    // V0·[(1 − 2β²σ²)²/√(1 − σ²) + 4β³σ²√(1 − β²σ²)], β = 0.4, σ = ½
    let front = 0.5 * (0.92_f64.powi(2) / 0.75_f64.sqrt() + 0.064 * 0.96_f64.sqrt());
    for (i, p) in pressure.iter().enumerate() {
        let r = form.interface.r0 + i as f64 * form.interface.dr;
        let expected = if r > 2.0 * t { 0.0 } else { front };
        assert!((r < *t && *p > 0.0) || (p - expected).abs() < 1e-14, "r = {r}: {p}");
    }
    // reflections: a contact that is not prescribed might end
    let layer = |contact| ClosedForm::for_case(&elastic(WEDGE, contact, "0.5")).expect("a form");
    assert_eq!(layer("unilateral").end_time, 1.0);
    let prescribed = layer("prescribed");
    assert!(prescribed.end_time.is_infinite() && prescribed.pressure_at(0.1, 1.01).is_nan());
    assert!(prescribed.pressure_at(3.0, 1.51) > 0.5 && prescribed.drag_at(1.5) == 2.5);
    // a wedge that ends at r = 1, where the contact arrives at ½
    let bounded = format!("{WEDGE}\nradius = 1.0");
    let bounded = ClosedForm::for_case(&elastic(&bounded, "unilateral", "\"half-space\"")).expect("a form");
    assert!(bounded.end_time == 1.5 && !bounded.has_drag);
    assert!(bounded.pressure_at(0.6, 0.89) > 0.0 && bounded.pressure_at(0.6, 0.91).is_nan());
}

#[test]
fn other_cases_of_the_full_theory_are_refused() {
    let wider = "shape = \"flat\"\nradius = 2.0";
    let slow = "shape = \"cone\"\nslope = 0.6";
    let round = "shape = \"paraboloid\"\nnose_radius = 0.9";
    for (indenter, contact) in [(wider, "unilateral"), (slow, "prescribed"), (round, "prescribed")] {
        let refusal = ClosedForm::for_case(&elastic(indenter, contact, "1.0")).expect_err("no form");
        let text = refusal.to_string();
        assert!(text.contains("elastic") && text.contains("V0/slope > 1"), "{text}");
    }
}

/// A case of the simplified theory on two layers at V0 = 0.1, on a mesh of 40 cells.
fn layered(indenter: &str, contact: &str, c_s: f64) -> Case {
    let text = format!(
        "title = \"t\"\nmodel = \"rakhmatulin\"\ngeometry = \"axisymmetric\"\n\
         [[target.layer]]\nthickness = 0.5\nshear_wave_speed = 0.4\n\
         [[target.layer]]\nthickness = 0.3\ndensity = 0.5\nwave_speed = 0.6\nshear_wave_speed = {c_s}\n\
         [indenter]\n{indenter}\nmass = inf\n[impact]\nvelocity = 0.1\ncontact = \"{contact}\"\n\
         [mesh]\ncells = 40\n[run]\nend_time = 3.0\n"
    );
    Case::sound(&text, &[])
}

const PARABOLOID: &str = "shape = \"paraboloid\"\nnose_radius = 1.0";

#[test]
fn spreading_contacts_on_layers_of_one_shear_wave_speed() {
    let form = ClosedForm::for_case(&layered(PARABOLOID, "prescribed", 0.4)).expect("a form");
    assert_eq!((form.name, form.end_time, form.has_drag), ("spreading", f64::INFINITY, true));
    // as on a half-space until the wave of the interface is back, which its impedance of 0.3 makes weaker than the front
    let space = Spreading::new(Front::Paraboloid { curvature: 0.2 }, 0.1, 0.4, None).expect("parameters");
    for t in [0.4, 0.9] {
        assert_eq!(Ok(form.pressure_at(0.1, t)), space.pressure(0.1, 0.0, t));
    }
    assert!(form.pressure_at(0.1, 1.2) < space.pressure(0.1, 0.0, 1.2).expect("range") - 0.03);
    let refusal = ClosedForm::for_case(&layered(PARABOLOID, "prescribed", 0.3)).expect_err("no form");
    assert!(refusal.to_string().contains("the same in all layers"), "{refusal}");
    let refusal = ClosedForm::for_case(&layered(PARABOLOID, "unilateral", 0.4)).expect_err("no form");
    assert!(refusal.to_string().contains("prescribed"), "{refusal}");
}

#[test]
fn flat_faces_on_any_layers_until_the_wave_of_the_edge_arrives() {
    for (contact, c_s) in [("prescribed", 0.5), ("bilateral", 0.3)] {
        let case = layered(FLAT, contact, c_s);
        let form = ClosedForm::for_case(&case).expect("a form");
        // the wave of the edge runs through the faster layer
        let fastest = f64::max(c_s, 0.4);
        assert_eq!((form.name, form.end_time, form.has_drag), ("spreading", 1.0 / fastest, false));
        // r = −0.7/1.3
        let echo = 0.1 * (1.0 - 1.4 / 1.3);
        let [before, after] = [0.9, 1.1].map(|t| form.pressure_at(0.2, t));
        assert!((before - 0.1).abs() < 1e-15 && (after - echo).abs() < 1e-15, "{before} {after}");
        assert!(
            form.pressure_at(0.8, 0.19 / fastest).is_finite()
                && form.pressure_at(0.8, 0.21 / fastest).is_nan()
        );
    }
    let elastic = layered(FLAT, "bilateral", 0.3).vary().set("model", "elastic").build().expect("a case");
    let refusal = ClosedForm::for_case(&elastic).expect_err("no form");
    assert!(refusal.to_string().contains("elastic"), "{refusal}");
}
