//! `percuss materials`: the materials that cases can name.

use std::fmt::Write;

use clap::Args;

use super::{CliError, Exit, print};
use crate::material::{MaterialError, PRESETS, Preset};

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

/// A material in numbers.
struct Row {
    preset: &'static Preset,
    /// c_p, c_s \[m/s\]
    speeds: (f64, f64),
    /// ν, E \[Pa\]
    pair: (f64, f64),
}

impl Row {
    fn new(preset: &'static Preset) -> Result<Self, MaterialError> {
        let elastic = preset.elastic();
        Ok(Self { preset, speeds: elastic.wave_speeds()?, pair: elastic.youngs_pair()? })
    }
}

impl Materials {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let rows = PRESETS.iter().map(Row::new).collect::<Result<Vec<_>, _>>();
        let rows = rows.map_err(|error| CliError::system("materials", error))?;
        print(&if self.json { json(&rows) } else { table(&rows) })?;
        Ok(Exit::Done)
    }
}

fn json(rows: &[Row]) -> String {
    let entry = |row: &Row| {
        serde_json::json!({
            "name": row.preset.name,
            "density": row.preset.density,
            "longitudinal_speed": row.speeds.0,
            "shear_speed": row.speeds.1,
            "youngs_modulus": row.pair.1,
            "poisson_ratio": row.pair.0,
            "source": row.preset.source,
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
    for Row { preset, speeds: (c_p, c_s), pair: (nu, e) } in rows {
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
