//! Graded meshes: a ball on them against the same ball on equal cells of the smallest size, and against the graded mesh of twice as many cells.
//!
//! ```text
//!   \ ball /
//!  ┬┬┬┬┬┬┬──┬───┬────   cells are alike under the contact
//!  ├┼┼┼┼┼┼──┼───┼────   and grow outwards and down
//!  ├┼┼┼┼┼┼──┼───┼────
//! ```

use percuss::{case::Case, session, simulation::Simulation, view::View};

use super::run;

/// A rigid ball whose contact lasts some hundred times as long as P waves take across it.
const BALL: &str = "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nshear_wave_speed = 0.5\n[indenter]\n\
    shape = \"sphere\"\nnose_radius = 1.0\nmass = 4.0\n[impact]\nvelocity = 0.01\n[mesh]\ncontact_cells = 20\nnear_radius = 0.35\nnear_depth = 0.5\n\
    [run]\nend_time = 24\n[record]\nframes = 0\nfields = []\nprobes = []\n";

fn sound(text: &str, settings: &[&str]) -> Case {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Case::parse("graded", text, &settings, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

fn drag(case: &Case) -> Vec<(f64, f64)> {
    run(case, |view| (view.time, view.drag))
}

/// Root mean square of the difference of two curves, linear between their points, relative to the peak of the second.
fn difference(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> f64 {
    let at = |time: f64| {
        let next = reference.partition_point(|(t, _)| *t < time).clamp(1, reference.len() - 1);
        let ((from, a), (to, b)) = (reference[next - 1], reference[next]);
        a + (b - a) * (time - from) / (to - from)
    };
    let peak = reference.iter().map(|(_, drag)| *drag).fold(0.0, f64::max);
    let squares: f64 = curve.iter().map(|(time, drag)| ((drag - at(*time)) / peak).powi(2)).sum();
    (squares / curve.len() as f64).sqrt()
}

/// 4.1e-4 on the half-space, with the ratio 1.1 7.4e-4, and 7.0e-4 on the plate. All but 2.4e-4 of either are waves of three to six steps a period, which nodes
/// excite as they come into contact: rows that have grown send them back, equal ones let them run, on the plate to its free back and back again. They are no more
/// right there: on the plate equal cells are 1.71e-3 away from the mesh of twice as many, graded ones 1.72e-3.
#[test]
fn the_drag_of_a_ball_is_that_of_equal_cells() {
    let plate = ["target.thickness=1.003557", "target.back=free"];
    for (more, least, most) in [(&[][..], 20.0, 5e-4), (&plate[..], 5.0, 8e-4)] {
        let settings = |ratio| [&[ratio][..], more].concat();
        let [alike, graded] =
            ["mesh.grading=1.0", "mesh.grading=1.05"].map(|ratio| sound(BALL, &settings(ratio)));
        assert_eq!((graded.sizes.dr, graded.sizes.dt), (alike.sizes.dr, alike.sizes.dt));
        let nodes = |case: &Case| (case.sizes.nr * case.sizes.nz) as f64;
        assert!(nodes(&alike) > least * nodes(&graded), "{} {}", nodes(&alike), nodes(&graded));
        let finer = percuss::study::on_meshes(&graded, &[20, 40]).expect("meshes").remove(1);
        let [alike, graded, finer] = [alike, graded, finer].map(|case| drag(&case));
        let error = difference(&graded, &alike);
        let errors = [difference(&alike, &finer), difference(&graded, &finer)];
        println!("{more:?}: rms of the difference {error:e} of the peak, from a finer mesh {errors:?}");
        assert!(error < most && errors[1] < 1.1 * errors[0], "{more:?}: {error:e} {errors:?}");
    }
}

/// 5819 N and 25.6 µs were computed by an independent program on equal cells.
#[test]
fn a_steel_ball_on_aluminium_is_that_of_an_independent_program() {
    let ball = "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nmaterial = \"aluminium\"\n[indenter]\n\
        shape = \"sphere\"\nnose_radius = \"5 mm\"\nmaterial = \"steel\"\n[impact]\nvelocity = \"10 m/s\"\n\
        [run]\nend_time = \"30 us\"\nstop = \"separation\"\n[record]\nframes = 0\n";
    let case = sound(ball, &[]);
    assert_eq!(case.mesh.density(), ("mesh.contact_cells", 20));
    let units = case.units();
    let seen = run(&case, |view| (units.time.of(view.time), units.force.of(view.drag)));
    let peak = seen.iter().map(|(_, force)| *force).fold(0.0, f64::max);
    let pushes = |(_, force): &&(f64, f64)| *force > 0.0;
    let (first, last) = (seen.iter().find(pushes), seen.iter().rfind(pushes));
    let duration = last.expect("a contact").0 - first.expect("a contact").0;
    println!("{peak} N, {duration:e} s");
    assert!((peak / 5819.0 - 1.0).abs() < 0.002, "{peak}");
    assert!((duration / 25.6e-6 - 1.0).abs() < 0.002, "{duration:e}");
}

#[test]
fn a_finer_graded_mesh_converges() {
    let cases = percuss::study::on_meshes(&sound(BALL, &[]), &[10, 20, 40]).expect("meshes");
    let ratios = cases.iter().map(|case| case.mesh.grading.expect("a graded mesh").ratio);
    let root = 1.05_f64.sqrt();
    for (ratio, expected) in ratios.zip([1.05 * 1.05, 1.05, root]) {
        assert!((ratio - expected).abs() < 1e-12, "{ratio} {expected}");
    }
    let [coarse, middle, fine] = [0, 1, 2].map(|mesh| drag(&cases[mesh]));
    let errors = [difference(&coarse, &fine), difference(&middle, &fine)];
    println!("{errors:?}");
    assert!(errors[1] < 0.4 * errors[0], "{errors:?}");
}

#[test]
fn vectors_of_any_width_give_the_same_bits() {
    let case = sound(
        BALL,
        &[
            "run.end_time=2.0",
            "target.thickness=0.7",
            "record.frames=3",
            "record.fields=[\"stress\", \"velocity_r\"]",
        ],
    );
    let see = |mut simulation: Simulation| {
        let mut bits = Vec::new();
        let mut look = |view: &View<'_>| {
            bits.push(view.drag.to_bits());
            let samples = view.frame.iter().flat_map(|frame| &frame.fields.samples);
            bits.extend(samples.flat_map(|sample| &sample.values).map(|value| u64::from(value.to_bits())));
        };
        session::run(&mut simulation, &mut [&mut look]).expect("a run");
        bits
    };
    assert!(see(Simulation::new(&case)) == see(Simulation::reference(&case)));
}

/// The pulse of a force, 54 radii away, where cells are ten times as wide as under it: damping takes 0.8 % of its peak, and 7 % if it takes as much per step
/// everywhere.
#[test]
fn damping_leaves_pulses_that_have_gone_far() {
    let load = "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nshear_wave_speed = 0.5\n[load]\nradius = 1.0\n\
        force = { pulse = \"cosine\", peak = 0.001, duration = 20.0 }\n[mesh]\ncontact_cells = 20\nlargest_cell = 1.0\n\
        [run]\nend_time = 90\n[record]\npoints = [[50.0, 20.0]]\nframes = 0\nfields = []\nprobes = []\n";
    let peak = |damping: &str| {
        let seen = run(&sound(load, &[damping]), |view| {
            view.gauges.as_ref().expect("a point").points[0].displacement
        });
        seen.into_iter().fold(0.0, f64::max)
    };
    let [damped, free] = ["mesh.damping=0.5", "mesh.damping=0.0"].map(peak);
    let lost = 1.0 - damped / free;
    println!("{lost} of {free}");
    assert!(lost > 0.0 && lost < 0.01, "{lost}");
}
