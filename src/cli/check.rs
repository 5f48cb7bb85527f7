//! `percuss check`: is a case valid, and what will it take?

use std::io::{self, IsTerminal};

use clap::Args;

use super::{CaseArguments, CliError, Exit, print};
use crate::{
    admissible::{self, Trial},
    case::{Case, Sizes},
    cost::{Estimate, calibration::Rates},
    model::ModelKind,
    validity::STRAIN_LIMIT,
};

/// Validates a case.
#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    case: CaseArguments,
    /// Print the complete case as TOML, every default and derived choice explicit; `percuss run` on it repeats the run
    #[arg(long)]
    resolved: bool,
    /// Measure again how fast this machine is, as the first check on it has done
    #[arg(long, conflicts_with = "resolved")]
    calibrate: bool,
    /// Also find the largest impact velocity that keeps the strain within the limit of linear theory, with the geometry of the
    /// head kept: by runs of the case, some five to ten of them unless its face is flat
    #[arg(long, conflicts_with = "resolved")]
    admissible: bool,
    /// Print everything as JSON
    #[arg(long, conflicts_with = "resolved")]
    json: bool,
}

impl Check {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        if self.resolved {
            print(&case.resolved_toml())?;
            return Ok(Exit::Done);
        }
        let rates = Rates::of_this_machine(self.calibrate);
        let estimate = Estimate::new(&case, rates.as_ref(), |cells, every| {
            self.case.load_with([format!("mesh.cells={cells}"), format!("record.field_every={every}")])
        });
        let admissible = self.admissible.then(|| self.find_velocity()).transpose()?;
        let text = if self.json {
            json(&case, &estimate, admissible)
        } else {
            table(&self.case.case, &case, &estimate, admissible)
        };
        print(&text)?;
        Ok(Exit::Done)
    }

    fn find_velocity(&self) -> Result<Trial, CliError> {
        let is_watched = io::stderr().is_terminal();
        let tell = |trial: &Trial| {
            if is_watched {
                eprintln!("trial: V0 = {:.4e}, largest strain {:.5}", trial.velocity, trial.strain);
            }
        };
        Ok(admissible::find(&self.case.case, &self.case.overrides, tell)?)
    }
}

/// A velocity in m/s, where the case gives c_p.
fn metres_per_second(case: &Case, velocity: f64) -> Option<f64> {
    Some(velocity * case.scales().speed?)
}

fn json(case: &Case, estimate: &Estimate, admissible: Option<Trial>) -> String {
    let mut value = serde_json::json!({
        "version": 1,
        "valid": true,
        "runnable": case.model == ModelKind::Rakhmatulin,
        "case": case.resolved_json(),
        "sizes": case.sizes,
        "estimate": {
            "memory_bytes": estimate.memory,
            "node_updates": estimate.work.updates,
            "message_bytes": estimate.work.messages.total(),
            "file_bytes": estimate.file,
            "seconds": estimate.seconds,
            "stops_at": estimate.stops_at,
        },
    });
    if let Some(Trial { velocity, strain, nodes }) = admissible {
        value["admissible"] = serde_json::json!({
            "velocity": velocity,
            "velocity_m_per_s": metres_per_second(case, velocity),
            "strain": strain,
            "strain_limit": STRAIN_LIMIT,
            "nodes_in_contact": nodes,
        });
    }
    format!("{value:#}\n")
}

fn table(name: &str, case: &Case, estimate: &Estimate, admissible: Option<Trial>) -> String {
    let Sizes { dr, dz, dt, steps, nr, nz, outer_radius, depth, layer, .. } = case.sizes;
    let target = if layer { format!("layer of thickness {depth}") } else { "half-space".into() };
    let c_s = case.target.material.shear_wave_speed;
    let seconds = match estimate.seconds {
        Some(seconds) => format!("about {seconds:.1} s"),
        None => "unknown, there is no place for temporary files".into(),
    };
    let mut rows = vec![
        ("case", format!("{name}: {}", case.title)),
        ("target", format!("{target}, c_s = {c_s}")),
        ("mesh", format!("{nr} x {} nodes to r = {outer_radius:.4}, z = {depth:.4}", nz + 1)),
        ("spacing", format!("dr = {dr:.6e}, dz = {dz:.6e}, radial Courant number {:.6}", c_s * dt / dr)),
        ("time", format!("{steps} steps of {dt:.6e} to t = {:.6}", steps as f64 * dt)),
        ("frames", frames(case)),
        ("memory", format!("about {}", bytes(estimate.memory))),
        (
            "recording",
            format!(
                "about {}, {} before compression",
                bytes(estimate.file),
                bytes(estimate.work.messages.total())
            ),
        ),
        ("run time", format!("{seconds}, {:.2e} node updates", estimate.work.updates)),
    ];
    if let Some(time) = estimate.stops_at {
        rows.push((
            "stop",
            format!("about t = {time:.2}, as run.stop asks; recording and run time are up to there"),
        ));
    }
    if let Some(Trial { velocity, strain, .. }) = admissible {
        let si = metres_per_second(case, velocity).map(|si| format!(" ({si:.4} m/s)")).unwrap_or_default();
        rows.push((
            "velocity",
            format!("V0 = {velocity:.4e}{si} strains the target by {strain:.5}, the limit is {STRAIN_LIMIT}"),
        ));
    }
    if case.model == ModelKind::Elastic {
        rows.push((
            "note",
            "valid, but `percuss run` of this version has no solver for model = \"elastic\"".into(),
        ));
    }
    rows.iter().map(|(key, value)| format!("{key:<10} {value}\n")).collect()
}

/// What frames show of the field.
fn frames(case: &Case) -> String {
    let count = case.frames().count();
    let names: Vec<&str> = case.record.fields.iter().map(|field| field.name()).collect();
    if names.is_empty() {
        return format!("{count}, no fields");
    }
    let nodes = match case.record.field_every {
        1 => "every node".into(),
        every => format!("one node in {every} along r and along z (record.field_every)"),
    };
    format!("{count} of {}, at {nodes}", names.join(", "))
}

fn bytes(count: u64) -> String {
    indicatif::BinaryBytes(count).to_string()
}
