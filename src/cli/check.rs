//! `percuss check`: validates a case and estimates its run.

use std::io::{self, IsTerminal};

use clap::Args;

use super::{CaseArguments, CliError, Exit, print, scales};
use crate::{
    admissible::{self, Trial},
    case::{Case, Sizes},
    cost::{Estimate, PATIENCE, RunEstimate, TIME_FACTOR, bytes_tolerance},
    rigidity::Rigidity,
    trust::TheoryError,
    units::{Dimension, Units},
    validity::STRAIN_LIMIT,
    warnings::{self, Warning},
};

const ESTIMATES: &str = "\
Recording and run time are scaled from trials on coarser meshes, a second in all. Sizes are within 15 % (model elastic: 40 %) and times
within a factor 1.5, as long as the machine is as busy during the run as during the check.";

/// Validates a case.
#[derive(Debug, Args)]
#[command(after_help = ESTIMATES)]
pub(super) struct Check {
    #[command(flatten)]
    case: CaseArguments,
    /// Print the complete case as TOML, every default and derived choice explicit; `percuss run` on it repeats the run
    #[arg(long)]
    resolved: bool,
    /// Also find the largest impact velocity that keeps the strain within the limit of linear theory, at the same geometry of
    /// the head: by one run of the case if its face is flat, by five to ten otherwise
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
        let estimate = Estimate::new(&case);
        let admissible = self.admissible.then(|| find_velocity(&case)).transpose()?;
        let mut warnings = warnings::of_case(&case);
        warnings.extend(estimate.run.iter().flat_map(|run| run.warnings(&case)));
        let text = if self.json {
            json(&case, &estimate, admissible, &warnings)
        } else {
            for Warning { text, .. } in &warnings {
                eprintln!("warning: {text}");
            }
            table(&self.case.case, &case, &estimate, admissible)
        };
        print(&text)?;
        Ok(Exit::Done)
    }
}

fn find_velocity(case: &Case) -> Result<Trial, CliError> {
    let is_terminal = io::stderr().is_terminal();
    let watch = |trial: &Trial| {
        if is_terminal {
            let velocity = case.units().speed.short_text(trial.velocity);
            eprintln!("trial: V0 = {velocity}, largest strain {:.5}", trial.strain);
        }
    };
    Ok(admissible::find(case, watch)?)
}

/// A velocity in m/s, where the case gives c_p.
fn metres_per_second(case: &Case, velocity: f64) -> Option<f64> {
    Some(velocity * case.scales?.of(Dimension::Speed))
}

fn json(case: &Case, estimate: &Estimate, admissible: Option<Trial>, warnings: &[Warning]) -> String {
    let theory = TheoryError::of(case);
    let run = estimate.run;
    let mut value = serde_json::json!({
        "version": 2,
        "valid": true,
        "runnable": true,
        "case": case.resolved_json(),
        "sizes": case.sizes,
        "estimate": {
            "memory_bytes": estimate.memory,
            "message_bytes": run.map(|run| run.messages),
            "file_bytes": run.map(|run| run.file),
            "bytes_tolerance": bytes_tolerance(case.model),
            "seconds": run.map(|run| run.seconds),
            "time_factor": TIME_FACTOR,
            "stops_at": run.and_then(|run| run.stops_at),
            "trial_cells": run.map(|run| run.trial_cells),
        },
        "theory_error": theory.map(|theory| serde_json::json!({
            "quantity": theory.quantity.name(),
            "error": theory.error,
            "time": theory.time,
        })),
        "rigidity": Rigidity::of(case).map(|rigidity| serde_json::json!({
            "modulus_ratio": rigidity.modulus_ratio,
            "force_ratio": rigidity.force_ratio,
        })),
        "warnings": warnings,
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
    let Units { length, time, .. } = case.units();
    let (nodes, courant) = (format!("{nr} x {} nodes", nz + 1), case.wave_speed() * dt / dr);
    let end = steps as f64 * dt;
    let mut rows = vec![("case", format!("{name}: {}", case.title))];
    match case.scales {
        None => {
            let target = if layer { format!("layer of thickness {depth}") } else { "half-space".into() };
            let c_s = case.target.material.shear_wave_speed;
            rows.extend([
                ("target", format!("{target}, c_s = {c_s}")),
                ("mesh", format!("{nodes} to r = {outer_radius:.4}, z = {depth:.4}")),
                ("spacing", format!("dr = {dr:.6e}, dz = {dz:.6e}, radial Courant number {courant:.6}")),
                ("time", format!("{steps} steps of {dt:.6e} to t = {end:.6}")),
            ]);
        }
        Some(scales) => {
            rows.extend(scales::rows(case, &scales));
            let [r, z, dr, dz] = [outer_radius, depth, dr, dz].map(|x| length.text(x));
            rows.extend([
                ("mesh", format!("{nodes} to r = {r}, z = {z}")),
                ("spacing", format!("dr = {dr}, dz = {dz}, radial Courant number {courant:.6}")),
                ("time", format!("{steps} steps of {} to t = {}", time.text(dt), time.text(end))),
            ]);
        }
    }
    rows.extend([("frames", frames(case)), ("memory", format!("about {}", bytes(estimate.memory)))]);
    match estimate.run {
        Some(run) => rows.extend(run_rows(case, &run)),
        None => {
            let limit = PATIENCE.as_secs();
            rows.push((
                "run time",
                format!("unknown: even a trial on a very coarse mesh does not end within {limit} s"),
            ));
        }
    }
    if let Some(Trial { velocity, strain, .. }) = admissible {
        let velocity = metres_per_second(case, velocity)
            .map_or_else(|| format!("{velocity:.4e}"), |si| format!("{si:.4e} m/s"));
        rows.push((
            "velocity",
            format!("V0 = {velocity} strains the target by {strain:.5}, the limit is {STRAIN_LIMIT}"),
        ));
    }
    rows.iter().map(|(key, value)| format!("{key:<10} {value}\n")).collect()
}

/// The estimates of a run, row by row.
fn run_rows(case: &Case, run: &RunEstimate) -> Vec<(&'static str, String)> {
    let RunEstimate { messages, file, seconds, stops_at, trial_cells, .. } = *run;
    let percent = 100.0 * bytes_tolerance(case.model);
    let size = format!("about {}, within {percent} %; {} before compression", bytes(file), bytes(messages));
    let time =
        format!("about {seconds:.2} s, within a factor {TIME_FACTOR}; from a trial on {trial_cells} cells");
    let mut rows = vec![("recording", size), ("run time", time)];
    rows.extend(stops_at.map(|time| {
        (
            "stop",
            format!(
                "about t = {}, as run.stop asks; recording and run time are up to there",
                case.units().time.text(time)
            ),
        )
    }));
    rows
}

/// Number and density of the frames.
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
