//! `percuss check`: is a case valid, and what will it take?

use clap::Args;

use super::{CaseArguments, CliError, Exit, print};
use crate::{
    case::{Case, Sizes},
    cost::{Estimate, calibration::Rates},
    model::ModelKind,
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
        let text = if self.json { json(&case, &estimate) } else { table(&self.case.case, &case, &estimate) };
        print(&text)?;
        Ok(Exit::Done)
    }
}

fn json(case: &Case, estimate: &Estimate) -> String {
    let value = serde_json::json!({
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
    format!("{value:#}\n")
}

fn table(name: &str, case: &Case, estimate: &Estimate) -> String {
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
