//! The share of mesh noise in a curve: the energy of p(0, t) above half the mesh frequency, relative to all of it.

use std::f64::consts::PI;

use crate::{
    Failure,
    lab::{Lab, Points, probe},
    page::Table,
};

/// Share of the energy of a series above half its highest frequency, `ω > π/2Δt`.
///
/// The mean of the series is subtracted and its ends are faded out (Hann), so that they do not count as steps.
pub fn share(points: &Points) -> f64 {
    let n = points.len();
    let mean = points.iter().map(|p| p.1).sum::<f64>() / n as f64;
    let faded: Vec<f64> = points
        .iter()
        .enumerate()
        .map(|(k, p)| (p.1 - mean) * (PI * (k as f64 + 0.5) / n as f64).sin().powi(2))
        .collect();
    let energy = |m: usize| {
        let (c, s) = faded.iter().enumerate().fold((0.0, 0.0), |sum: (f64, f64), (k, v)| {
            // reduced before the multiplication, which keeps the angle exact
            let angle = 2.0 * PI * ((m * k) % n) as f64 / n as f64;
            (sum.0 + v * angle.cos(), sum.1 + v * angle.sin())
        });
        c * c + s * s
    };
    let all: Vec<f64> = (0..=n / 2).map(energy).collect();
    all[n / 4 + 1..].iter().sum::<f64>() / all.iter().sum::<f64>()
}

/// The table of the page.
pub fn table(lab: &Lab<'_>) -> Result<Table, Failure> {
    let mut rows = vec![
        ["case", "mesh", "share of the energy above half the mesh frequency"].map(str::to_owned).to_vec(),
    ];
    for case in ["fig2", "fig2-prescribed", "fig3", "fig5", "fig7b"] {
        for (mesh, cells) in [("paper", 100), ("matched", 200)] {
            let sets = [
                &format!("mesh.kind={mesh}"),
                &format!("mesh.cells={cells}"),
                "record.fields=[]",
                "record.frames=0",
            ];
            let run = lab.run(&format!("noise-{case}-{mesh}"), case, &sets.map(|set| set as &str))?;
            rows.push(vec![format!("`{case}`"), mesh.into(), format!("{:.1e}", share(&probe(&run, 0.0)?))]);
        }
        if case == "fig2-prescribed" {
            let exact = lab.exact("noise-fig2-prescribed-exact", case, &["mesh.cells=200"])?;
            rows.push(vec![
                format!("`{case}`"),
                "closed form".into(),
                format!("{:.1e}", share(&probe(&exact, 0.0)?)),
            ]);
        }
    }
    let text = "Energy of p(0, t) above half the mesh frequency, ω > π/2Δt, at Δz = 0.01. Steps of reflections have such energy too: the \
                closed form shows how much. On the paper's mesh waves along r are dispersed, and a contact that grows node by node feeds \
                waves of grid frequency.";
    Ok(Table { title: "Mesh noise".into(), text: text.into(), rows })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_known_waves() {
        let wave =
            |step: f64| (0..400).map(|k| (f64::from(k), (step * f64::from(k)).sin())).collect::<Points>();
        // the mean of a wave over the series is not quite 0, and is subtracted
        assert!(share(&wave(0.1)) < 1e-10 && share(&wave(2.8)) > 1.0 - 1e-5);
        let mixed = wave(0.1).iter().zip(wave(2.8)).map(|(a, b)| (a.0, a.1 + 0.1 * b.1)).collect();
        assert!((share(&mixed) - 0.01 / 1.01).abs() < 1e-3);
    }
}
