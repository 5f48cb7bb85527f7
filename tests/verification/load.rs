//! Loads in place of an indenter. Goal: a point force on a half-space gives the surface pulse of Pekeris, and a slow one Boussinesq's displacement.

use percuss::{
    case::Case,
    session::{self, Observer},
    simulation::Simulation,
    view::View,
};

use crate::closed_forms::{
    GABBRO_RAYS,
    pekeris::{self, SPEED_RATIO},
};

/// Displacements of the first point of a case, with the times.
fn trace(case: &Case) -> Vec<(f64, f64)> {
    let mut seen = Vec::new();
    let mut look = |view: &View<'_>| {
        let point = view.gauges.as_ref().expect("a point").points[0];
        seen.push((view.time, point.displacement));
    };
    session::run(&mut Simulation::new(case), &mut [&mut look as &mut dyn Observer]).expect("a run");
    seen
}

/// A force on a point of a half-space with ν = 1/4 and a point at a distance of 1, which is so many cells.
fn half_space(force: &str, cells: usize, end_time: f64) -> Case {
    let text = format!(
        "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nshear_wave_speed = {SPEED_RATIO}\n[load]\nforce = {force}\n\
         [mesh]\ncells = {cells}\ndamping = 0.0\n[run]\nend_time = {end_time}\n[record]\nframes = 0\npoints = [[1.0, 0.0]]\n"
    );
    Case::parse("load", &text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

#[test]
fn the_surface_pulse_is_that_of_pekeris() {
    // ten cells to the wave of the highest frequency, 2/T, of shear waves, and twenty
    for (cells, duration, bound) in [(20, 1.75, 0.01), (40, 0.875, 0.01), (40, 1.75, 0.003)] {
        let force = format!("{{ pulse = \"cosine\", peak = 0.001, duration = {duration} }}");
        let computed = trace(&half_space(&force, cells, 4.0));
        let pair = |&(t, u): &(f64, f64)| (u, pekeris::cosine(0.001, duration, 1.0, t));
        let pairs: Vec<(f64, f64)> = computed.iter().map(pair).collect();
        let peak = pairs.iter().map(|(_, exact)| exact.abs()).fold(0.0, f64::max);
        let mean = pairs.iter().map(|(u, exact)| (u - exact).powi(2)).sum::<f64>() / pairs.len() as f64;
        let rms = mean.sqrt() / peak;
        println!("r = {cells} cells, T = {duration}: rms {rms:.5} of the peak");
        assert!(rms < bound, "{cells} {duration}: {rms}");
    }
}

#[test]
fn a_plate_moves_as_by_generalised_rays() {
    let case = Case::load("experiment-gabbro-plate", &["mesh.cells=2".into(), "record.frames=0".into()]);
    let case = case.unwrap_or_else(|errors| panic!("{errors:?}"));
    let units = case.units();
    let seen: Vec<(f64, f64)> =
        trace(&case).into_iter().map(|(t, u)| (1e6 * units.time.of(t), 1e9 * units.length.of(u))).collect();
    for (time, height) in GABBRO_RAYS {
        let turns = seen.windows(3).filter(|three| {
            (three[1].1 - three[0].1) * (three[2].1 - three[1].1) <= 0.0 && (three[1].0 - time).abs() < 0.3
        });
        let near =
            turns.map(|three| three[1]).min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs()));
        let (at, found) = near.expect("an extreme");
        println!("{time} {height}: {at:.2} {found:.4}");
        // the lowest one is that of the others, less than a fiftieth of the highest
        assert!((found - height).abs() < 0.003 + 0.01 * height, "{time}: {found} {height}");
    }
}

#[test]
fn a_slow_force_displaces_as_in_statics() {
    let computed = trace(&half_space("{ pulse = \"step\", peak = 0.001, rise = 2.0 }", 20, 12.0));
    let (_, last) = computed[computed.len() - 1];
    // (1 − ν)P/(2πµr) with P = πF and µ = c_s²
    let exact = 0.75 * 0.001 / (2.0 * SPEED_RATIO * SPEED_RATIO);
    println!("of the static displacement: {:.5}", last / exact);
    assert!((last / exact - 1.0).abs() < 0.005, "{last} {exact}");
}
