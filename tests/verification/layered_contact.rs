//! Cases of layered targets that have a closed form, [`percuss::exact::stack`].

use percuss::{case::Case, exact::closed_form::ClosedForm};

use super::{on_mesh, orders, relative_rms, run};

#[test]
fn a_paraboloid_on_two_layers() {
    let errors = [50, 100, 200].map(|cells| {
        let case = on_mesh("layers", cells, &["run.end_time=4"]);
        let exact = ClosedForm::for_case(&case).expect("a closed form");
        let axis = run(&case, |view| (view.time, view.interface.stress_at(0.0)));
        relative_rms(axis.into_iter().map(|(t, p)| (p, exact.pressure_at(0.0, t))))
    });
    // measured 3.5e-3, 2.2e-3, 1.5e-3: over all times, with fronts, as on one layer
    assert!(errors[2] < 1.8e-3 && orders(&errors).iter().all(|order| *order > 0.5), "{errors:?}");
}

#[test]
fn a_flat_face_is_exact_until_the_wave_of_the_edge_arrives() {
    // layers of 9, 6 and 12 steps, over a free back 11 and a half
    for (back, contact, last) in [("rigid", "prescribed", 0.6), ("free", "bilateral", 0.575)] {
        let text = format!(
            "title = \"t\"\nmodel = \"rakhmatulin\"\ngeometry = \"axisymmetric\"\n[target]\nback = \"{back}\"\n\
             [[target.layer]]\nthickness = 0.3\nshear_wave_speed = 0.4\n\
             [[target.layer]]\nthickness = 0.12\ndensity = 0.05\nwave_speed = 0.6\nshear_wave_speed = 0.3\n\
             [[target.layer]]\nthickness = {last}\ndensity = 3.0\nwave_speed = 1.5\nshear_wave_speed = 0.5\n\
             [indenter]\nshape = \"flat\"\nradius = 1.0\nmass = inf\n[impact]\nvelocity = 0.1\ncontact = \"{contact}\"\n\
             [mesh]\ncells = 60\norder = 2\ndamping = 0.0\n[run]\nend_time = 3.0\n"
        );
        let case =
            Case::parse("t.toml", &text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
        let exact = ClosedForm::for_case(&case).expect("a closed form");
        assert!((exact.end_time - 2.0).abs() < 1e-12);
        let seen = run(&case, |view| (view.time, view.interface.stress_at(0.0)));
        let early = seen.iter().filter(|row| row.0 < exact.end_time);
        let errors = early.map(|(t, p)| (p - exact.pressure_at(0.0, *t)).abs());
        let error = errors.fold(0.0, f64::max) / 0.1;
        assert!(error < 1e-12, "{back}, {contact}: {error:e}");
    }
}
