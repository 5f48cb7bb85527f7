//! Mesh noise in curves, before and after the mixed-derivative correction of the scheme.

use crate::{
    Failure,
    lab::{Lab, Made, Points, probe},
    page::Table,
};

/// Time between fronts of reflections in which noise is measured.
const QUIET: std::ops::Range<f64> = 3.2..3.9;

/// Amplitude of waves of the mesh's frequency: rms of fourth differences over 16, which leave those as they are and of a wave ω keep
/// sin⁴(ωΔt/2).
fn noise(points: &Points) -> f64 {
    let quiet: Points = points.iter().copied().filter(|p| QUIET.contains(&p.0)).collect();
    let fourth = |w: &[(f64, f64)]| (w[0].1 - 4.0 * w[1].1 + 6.0 * w[2].1 - 4.0 * w[3].1 + w[4].1) / 16.0;
    let squares: Vec<f64> = quiet.windows(5).map(|w| fourth(w).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Largest excess over the closed form from the front of the first reflection up to the second one, relative to the jump of that
/// front.
///
/// * `arrivals`: of both fronts
fn overshoot(points: &Points, exact: &Points, arrivals: [f64; 2]) -> f64 {
    // the second front is some steps wide
    let [at, until] = [arrivals[0], arrivals[1] - 0.1].map(|time| exact.partition_point(|p| p.0 <= time));
    let jump = exact[at].1 - exact[at - 1].1;
    points[at..until].iter().zip(&exact[at..]).map(|(p, e)| (p.1 - e.1) / jump).fold(0.0, f64::max)
}

/// A scheme: its name and its keys in a case.
type SchemeKeys = (&'static str, [&'static str; 2]);

const SCHEMES: [SchemeKeys; 2] = [
    ("order 2", ["mesh.order=2", "mesh.damping=0.0"]),
    ("order 4, damped", ["mesh.order=4", "mesh.damping=1.0"]),
];

/// The table of the page.
pub fn table(lab: &Lab<'_>) -> Result<Table, Failure> {
    let heading = ["case", "quantity", "paper's mesh", SCHEMES[0].0, SCHEMES[1].0, "falls to"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let mut row =
        |case: &str, what: String, paper: String, [before, after]: [f64; 2], unit: fn(f64) -> String| {
            let falls = format!("1/{:.0}", before / after);
            rows.push(vec![format!("`{case}`"), what, paper, unit(before), unit(after), falls]);
        };
    let exponent = |value: f64| format!("{value:.1e}");
    for case in ["fig2", "fig3", "fig5", "fig7a", "fig7b"] {
        let mut axes = Vec::new();
        for (i, (_, keys)) in SCHEMES.iter().enumerate() {
            let run = run(lab, &format!("noise-{case}-{i}"), case, &["mesh.cells=200", keys[0], keys[1]])?;
            axes.push(noise(&probe(&run, 0.0)?));
        }
        let paper = run(lab, &format!("noise-{case}-paper"), case, &["mesh.kind=paper", "mesh.cells=100"])?;
        let what = format!("noise of p(0, t), {} < t < {}", QUIET.start, QUIET.end);
        row(case, what, exponent(noise(&probe(&paper, 0.0)?)), [axes[0], axes[1]], exponent);
    }
    let mut cones = Vec::new();
    for (i, (_, keys)) in SCHEMES.iter().enumerate() {
        let sets = ["mesh.cells=200", keys[0], keys[1], "record.probes=[0.0,0.25,0.5,1.0,2.0]"];
        let run = run(lab, &format!("overshoot-fig7a-{i}"), "fig7a", &sets)?;
        cones.push((run, lab.exact(&format!("overshoot-fig7a-{i}-exact"), "fig7a", &sets)?));
    }
    for r in [0.25, 0.5, 1.0, 2.0] {
        // plane fronts that move along the surface with V* = 2, reflected by the backing
        let arrival = |m: f64| r / 2.0 + 2.0 * m * (1.0_f64 - (0.5_f64 / 2.0).powi(2)).sqrt();
        let over = |(run, exact): &(Made, Made)| {
            Ok::<f64, Failure>(overshoot(&probe(run, r)?, &probe(exact, r)?, [1.0, 2.0].map(arrival)))
        };
        let over = [over(&cones[0])?, over(&cones[1])?];
        let percent = |value: f64| format!("{:.1} %", 100.0 * value);
        row("fig7a", format!("overshoot of the reflection at r = {r}"), "-".into(), over, percent);
    }
    let text = "Without the mixed-derivative correction oblique waves have too low a phase velocity, the lower the shorter they are; fronts that are not parallel to the mesh have a \
                tail of waves of grid frequency, which meet on the axis, and no mesh makes their amplitude smaller. Order 4 lets waves run alike in \
                every direction, and damping takes out those that the mesh does not resolve. What is left: the overshoot of a front over its own \
                width of some steps, and on the paper's mesh, where waves along r are dispersed and a contact grows node by node, all of it. \
                Noise is the rms of fourth differences over 16, at Δz = 0.01.";
    Ok(Table { title: "Mesh noise".into(), text: text.into(), rows })
}

fn run(lab: &Lab<'_>, name: &str, case: &str, sets: &[&str]) -> Result<Made, Failure> {
    lab.run(name, case, &[sets, &["record.fields=[]", "record.frames=0"]].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_the_amplitude_of_mesh_waves() {
        let wave = |step: f64| {
            (0..500).map(|k| (0.01 * f64::from(k), (step * f64::from(k)).cos())).collect::<Points>()
        };
        assert!((noise(&wave(std::f64::consts::PI)) - 1.0).abs() < 1e-9);
        // sin⁴(0.05)/√2
        assert!((noise(&wave(0.1)) / (0.05f64.sin().powi(4) / 2f64.sqrt()) - 1.0).abs() < 0.1);
    }

    #[test]
    fn overshoot_is_relative_to_the_jump() {
        let exact: Points = (0..10).map(|k| (f64::from(k), if k > 4 { 3.0 } else { 1.0 })).collect();
        let mut points = exact.clone();
        (points[3].1, points[6].1, points[9].1) = (9.0, 3.5, 7.0);
        assert_eq!(overshoot(&points, &exact, [4.0, 8.5]), 0.25);
    }
}
