//! `percuss materials`: the materials that cases can name.

use std::fmt::Write;

use clap::Args;

use super::{CliError, Exit, print};
use crate::material::{PRESETS, Preset};

const EXAMPLES: &str = "\
Examples:
  percuss materials
  percuss run ball --set target.material=glass

Real materials differ by some per cent from sample to sample, polymers by more. A table gives the values of the one \
at hand:
  [target.material]
  youngs_modulus = \"211 GPa\"
  poisson_ratio = 0.29
  density = \"7.85 g/cm3\"";

/// Lists the materials that cases can name, with wave speeds and sources.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Materials {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A material with c_p, c_s \[m/s\], and with ν, E \[Pa\].
type Row = (&'static Preset, (f64, f64), (f64, f64));

impl Materials {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let row = |preset: &'static Preset| {
            let elastic = preset.elastic();
            let speeds = elastic.wave_speeds().expect("a material");
            (preset, speeds, elastic.youngs_pair().expect("a material"))
        };
        let rows: Vec<Row> = PRESETS.iter().map(row).collect();
        print(&if self.json { json(&rows) } else { table(&rows) })?;
        Ok(Exit::Done)
    }
}

fn json(rows: &[Row]) -> String {
    let entry = |(preset, (c_p, c_s), (nu, e)): &Row| {
        serde_json::json!({
            "name": preset.name,
            "density": preset.density,
            "longitudinal_speed": c_p,
            "shear_speed": c_s,
            "youngs_modulus": e,
            "poisson_ratio": nu,
            "source": preset.source,
        })
    };
    let materials: Vec<_> = rows.iter().map(entry).collect();
    format!("{:#}\n", serde_json::json!({ "version": 1, "units": "SI", "materials": materials }))
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<17} {:>13} {:>10} {:>10} {:>7} {:>8} {:>6}  source\n",
        "material", "density kg/m³", "c_p m/s", "c_s m/s", "c_s/c_p", "E GPa", "ν"
    );
    for (preset, (c_p, c_s), (nu, e)) in rows {
        let Preset { name, density, source, .. } = preset;
        let (ratio, e) = (c_s / c_p, e / 1e9);
        writeln!(
            text,
            "{name:<17} {density:>13.0} {c_p:>10.0} {c_s:>10.0} {ratio:>7.3} {e:>8.1} {nu:>6.3}  {source}"
        )
        .expect("a String grows");
    }
    text
}
