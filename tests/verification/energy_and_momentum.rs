//! Balances of the discrete scheme: energy, momentum, and the sign of the dissipation in unilateral contact.

use std::collections::BTreeSet;

use percuss::{case::Case, view::Energy};

use super::{
    accuracy::{assert_rounding, stated},
    case, run,
};

#[test]
fn bilateral_contact_conserves_energy() {
    // the scheme's own energy is conserved exactly
    let [rounding] = stated("energy of a glued punch of finite mass, 40 cells");
    for name in ["fig8-m2.5", "fig8-m10"] {
        for geometry in ["axisymmetric", "plane"] {
            for mesh in ["matched", "paper"] {
                let overrides = [
                    "run.stop=never".to_owned(),
                    format!("geometry={geometry}"),
                    format!("mesh.kind={mesh}"),
                    "mesh.cells=40".to_owned(),
                    "impact.contact=bilateral".to_owned(),
                    "mesh.damping=0".to_owned(),
                    "record.frames=50".to_owned(),
                ];
                let case = case(name, &overrides);
                let initial = 0.5 * case.indenter.mass;
                let (energies, _) = energies(&case);
                assert_eq!(energies.len(), 50);
                let residuals = energies.iter().map(|energy| residual(energy) / initial);
                let worst = residuals.fold(0.0, f64::max);
                assert_rounding(&format!("{name} {geometry} {mesh}"), worst, rounding);
            }
        }
    }
}

#[test]
fn unilateral_contact_dissipates_energy() {
    for name in ["fig2", "fig3", "fig6c", "fig7b", "fig8-m2.5", "fig9-m1"] {
        let case = case(name, &["mesh.cells=50", "mesh.damping=0", "run.stop=never", "record.frames=100"]);
        let mut last = 0.0;
        for energy in energies(&case).0 {
            assert!(energy.dissipated >= last, "{name}: {energy:?}");
            let scale = energy.work + energy.indenter + energy.kinetic + energy.strain;
            assert!(residual(&energy) <= 1e-12 * scale, "{name}: {energy:?}");
            last = energy.dissipated;
        }
        assert!(last > 0.0, "{name}: striking nodes lose energy");
    }
}

#[test]
fn prescribed_motion_does_the_work() {
    for name in ["fig6a", "fig7a"] {
        let case = case(name, &["mesh.cells=50", "mesh.damping=0", "record.frames=30"]);
        for energy in energies(&case).0 {
            assert_eq!(energy.dissipated, 0.0);
            assert!(residual(&energy) <= 1e-12 * energy.work.max(1e-3), "{name}: {energy:?}");
        }
    }
}

#[test]
fn momentum_of_the_punch_is_the_impulse_of_the_drag() {
    // M(V0 − V^k) = Δt·(F^0 + … + F^{k−1} + ½F^k): the scheme's own quadrature, equal but for rounding
    let case = case("fig8-m5", &["mesh.cells=60", "record.frames=0"]);
    let (mut impulse, dt, mass) = (0.0, case.sizes.dt, case.indenter.mass);
    for (drag, velocity) in run(&case, |view| (view.drag, view.velocity)) {
        let momentum = mass * (1.0 - velocity);
        assert!((momentum - impulse - 0.5 * dt * drag).abs() < 1e-12, "{momentum} {impulse}");
        impulse += dt * drag;
    }
}

#[test]
fn a_profile_of_points_equals_its_shape() {
    // a cone given by two points is the cone, but for rounding of f
    let points = "indenter.points=[[0.0, 0.0], [1.0, 0.5]]";
    let cone = case("fig6c", &["mesh.cells=40", "record.frames=0"]);
    let text = "[target]\nthickness = \"half-space\"\nshear_wave_speed = 0.5\n[indenter]\nshape = \"profile\"\n\
                radius = 1.0\n[mesh]\ncells = 40\n[run]\nend_time = 4.0\n[record]\nframes = 0\n";
    let profile = Case::parse("profile", text, &[points.to_owned()], "".as_ref()).expect("a case");
    let drag = |case| run(case, |view| view.drag);
    for (step, (a, b)) in drag(&cone).into_iter().zip(drag(&profile)).enumerate() {
        assert!((a - b).abs() < 1e-11, "step {step}: {a} {b}");
    }
}

/// What is left over of an energy without damping, by magnitude.
pub fn residual(energy: &Energy) -> f64 {
    energy.residual.expect("no damping").abs()
}

/// Energies of the frames of a case, and the kinds of its events.
pub fn energies(case: &Case) -> (Vec<Energy>, BTreeSet<String>) {
    let rows = run(case, |view| {
        let kinds: Vec<String> = view.events.iter().map(|event| format!("{:?}", event.kind)).collect();
        (view.frame.as_ref().map(|frame| frame.energy), kinds)
    });
    let (energies, kinds): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    (energies.into_iter().flatten().collect(), kinds.into_iter().flatten().collect())
}

#[test]
fn neither_partial_contact_nor_damping_adds_energy() {
    // heads of small mass that come to rest and leave, on meshes so coarse that most nodes are at the edge of the contact
    let heads = [
        ("fig5", 0.2),
        ("fig2", 0.02),
        ("fig3", 0.3),
        ("fig3", 2.0),
        ("fig6a", 0.3),
        ("fig6c", 0.1),
        ("fig7b", 2.0),
    ];
    let schemes = [("2", "0.0"), ("4", "0.0"), ("4", "1.0")];
    let mut events = BTreeSet::new();
    for ((name, mass), (order, damping)) in
        heads.into_iter().flat_map(|head| schemes.map(|scheme| (head, scheme)))
    {
        for geometry in ["axisymmetric", "plane"] {
            let overrides = [
                format!("indenter.mass={mass}"),
                format!("geometry={geometry}"),
                format!("mesh.order={order}"),
                format!("mesh.damping={damping}"),
                "impact.contact=unilateral".into(),
                "mesh.cells=20".into(),
                "record.frames=200".into(),
            ];
            let case = case(name, &overrides);
            let initial = 0.5 * mass * case.impact.velocity.powi(2);
            let name = format!("{name}, mass {mass}, {geometry}, order {order}, damping {damping}");
            let (energies, kinds) = energies(&case);
            events.extend(kinds);
            for pair in energies.windows(2) {
                assert!(pair[1].dissipated >= pair[0].dissipated - 1e-9 * initial, "{name}: {pair:?}");
                assert!(pair[1].damped >= pair[0].damped - 1e-14 * initial, "{name}: {pair:?}");
                // with damping there is no residual: what is damped is what is missing
                assert_eq!(pair[1].residual.is_none(), damping != "0.0", "{name}: {pair:?}");
                assert!(pair[1].residual.is_none_or(|x| x.abs() < 1e-12 * initial), "{name}: {pair:?}");
                assert!(pair[1].kinetic + pair[1].strain.max(0.0) < initial, "{name}: {pair:?}");
            }
            let last = energies.last().expect("frames");
            assert_eq!(last.damped > 1e-6 * initial, damping != "0.0", "{name}: {last:?}");
        }
    }
    for kind in ["Rebound", "Separation", "Recontact"] {
        assert!(events.contains(kind), "{kind} is among {events:?}");
    }
}
