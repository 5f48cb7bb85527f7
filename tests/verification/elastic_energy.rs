//! Energy of the full theory's scheme: conserved but for rounding without damping, and taken out for good with it.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{case, energy_and_momentum::energies};

/// Case, and settings beside those of all.
const CASES: [(&str, &[&str]); 6] = [
    // glued punch
    ("fig8-m2.5", &["impact.contact=bilateral"]),
    // rebound, separation, contact again
    ("fig5", &["indenter.mass=0.5", "run.end_time=6.0"]),
    ("fig9-m1", &["mesh.kind=matched"]),
    // curved heads, contact spreading and closing
    ("fig2", &["indenter.mass=0.3"]),
    ("fig6c", &["indenter.mass=0.2"]),
    // motion prescribed
    ("fig2-prescribed", &[]),
];

#[test]
fn energy_is_conserved_or_taken_out() {
    let mut all = Vec::new();
    for (name, settings) in CASES {
        for geometry in ["axisymmetric", "plane"] {
            for c_s in [0.3, 0.6] {
                all.extend(["0.0", "0.5"].map(|damping| (name, settings, geometry, c_s, damping)));
            }
        }
    }
    let rows: Vec<BTreeSet<String>> = all
        .into_par_iter()
        .map(|(name, settings, geometry, c_s, damping)| {
            let common = [
                "model=elastic".to_owned(),
                format!("geometry={geometry}"),
                format!("target.shear_wave_speed={c_s}"),
                format!("mesh.damping={damping}"),
                "mesh.cells=14".to_owned(),
                "run.stop=never".to_owned(),
                "record.frames=100000".to_owned(),
                "record.fields=[]".to_owned(),
            ];
            let overrides: Vec<&str> =
                common.iter().map(String::as_str).chain(settings.iter().copied()).collect();
            let (energies, events) = energies(&case(name, &overrides));
            let scale = energies.iter().map(|energy| energy.work.abs() + energy.indenter).fold(0.0, f64::max);
            let residual = energies
                .iter()
                .filter_map(|energy| energy.residual)
                .fold(0.0, |most: f64, x| most.max(x.abs()))
                / scale;
            let name = format!("{name}, {geometry}, c_s = {c_s}, σ = {damping}");
            // measured 8e-15 at most; with damping there is none, as what is damped is what is missing
            assert_eq!(energies[0].residual.is_none(), damping != "0.0", "{name}");
            assert!(residual < 5e-14, "{name}: {residual:e}");
            for pair in energies.windows(2) {
                // rounding of the energies
                assert!(pair[1].damped >= pair[0].damped - 1e-14 * scale, "{name}: {pair:?}");
                assert!(pair[1].dissipated >= pair[0].dissipated - 1e-14 * scale, "{name}: {pair:?}");
            }
            let last = energies.last().expect("frames");
            assert_eq!(last.damped > 1e-4 * scale, damping != "0.0", "{name}: {last:?}");
            events
        })
        .collect();
    let events: BTreeSet<String> = rows.into_iter().flatten().collect();
    for kind in ["Rebound", "Separation", "Recontact"] {
        assert!(events.contains(kind), "{kind} is among {events:?}");
    }
}
