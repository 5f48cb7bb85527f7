//! `percuss materials`: the materials that cases can name.

use clap::Args;

use super::{CliError, Exit, print};
use crate::material::{Elastic, PRESETS, Preset};

const EXAMPLES: &str = "\
Examples:
  percuss materials
  percuss run ball --set target.material=glass

Real materials differ by some per cent from sample to sample, polymers by more, and strengths are those of one grade: \
stress at yield, tension and compression at break. A table gives the values of the one at hand:
  [target.material]
  youngs_modulus = \"211 GPa\"
  poisson_ratio = 0.29
  density = \"7.85 g/cm3\"
  yield_strength = \"355 MPa\"";

/// Lists the materials that cases can name, with wave speeds, strengths and sources.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Materials {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A material and its constants.
type Row = (&'static Preset, Elastic);

impl Materials {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let rows: Vec<Row> = PRESETS.iter().map(|preset| (preset, preset.elastic())).collect();
        print(&if self.json { json(&rows) } else { table(&rows) })
    }
}

fn json(rows: &[Row]) -> String {
    let entry = |(preset, elastic): &Row| {
        let ((c_p, c_s), ([e_r, e_z], [nu_rt, nu_zr])) = (elastic.wave_speeds(), elastic.engineering());
        serde_json::json!({
            "name": preset.name,
            "density": preset.density,
            "is_isotropic": elastic.stiffness().is_isotropic(),
            "longitudinal_speed": c_p,
            "lateral_speed": elastic.lateral_speed(),
            "shear_speed": c_s,
            "youngs_modulus": e_z,
            "lateral_youngs_modulus": e_r,
            "poisson_ratio": nu_zr,
            "lateral_poisson_ratio": nu_rt,
            "source": preset.source,
            "strengths": preset.strengths,
            "grade": preset.grade,
        })
    };
    let materials: Vec<_> = rows.iter().map(entry).collect();
    format!("{:#}\n", serde_json::json!({ "version": 1, "units": "SI", "materials": materials }))
}

fn table(rows: &[Row]) -> String {
    let mut text = "material          density kg/m³    c_p m/s    c_s m/s c_s/c_p    E GPa      ν yield MPa tension MPa compression MPa  source; grade of the strengths\n".to_owned();
    for (preset, elastic) in rows {
        let Preset { name, density, source, grade, .. } = preset;
        let ((c_p, c_s), ([e_r, e], [nu_rt, nu])) = (elastic.wave_speeds(), elastic.engineering());
        let (ratio, e) = (c_s / c_p, e / 1e9);
        let strength = |strength: Option<f64>| strength.map_or("-".into(), |pa| format!("{:.0}", pa / 1e6));
        let [y, tension, compression] = preset.strengths.all().map(strength);
        let grade = if grade.is_empty() { String::new() } else { format!("; {grade}") };
        text += &format!(
            "{name:<17} {density:>13.0} {c_p:>10.0} {c_s:>10.0} {ratio:>7.3} {e:>8.1} {nu:>6.3} {y:>9} {tension:>11} {compression:>15}  {source}{grade}\n"
        );
        if !elastic.stiffness().is_isotropic() {
            let (lateral, e) = (elastic.lateral_speed(), e_r / 1e9);
            text +=
                &format!("{:<31} {lateral:>10.0} {:>18} {e:>8.1} {nu_rt:>6.3} {:>37}  along r\n", "", "", "");
        }
    }
    text
}
