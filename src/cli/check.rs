//! `percuss check`: validates a case and estimates its run.

use std::io::{self, IsTerminal};

use clap::Args;
use percuss_output::text::{printable, say};

use super::{CaseArguments, CliError, Exit, print, print_document, target};
use crate::{
    advice::{
        self, Finding,
        admissible::{self, Limit, Trial},
        cost::{self, Estimate},
        impact::Expected,
        rigidity::Rigidity,
        theory::Trust,
    },
    case::{Case, GradingFacts, Sizes, Stop},
    exact::hertz::Hertz,
    units::{Dimension, Unit, Units},
    validity::STRAIN_LIMIT,
};

const EXAMPLES: &str = "\
Examples:
  percuss check fig5
  percuss check my.toml --resolved > full.toml
  percuss check ball --admissible

Recording and run time are estimated from the sizes of the case. The size of a recording depends on how well its \
waves compress, within a factor of 3, and the time on the machine: it is an order of magnitude. A run that its stop \
condition ends earlier takes less of both.";

/// Version of the JSON.
const VERSION: u32 = 4;

/// Validates a case.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
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
    /// What `--admissible` keeps within its limit; strengths are compared by model elastic
    #[arg(long, value_enum, default_value_t, requires = "admissible")]
    limit: Limit,
    /// Print everything as JSON, also the problems of an invalid case
    #[arg(long, conflicts_with = "resolved")]
    json: bool,
}

impl Check {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = if self.admissible { self.case.load_single() } else { self.case.load() };
        if let (true, Err(CliError::Case(errors))) = (self.json, &case) {
            let mut value = errors.json();
            (value["version"], value["valid"]) = (VERSION.into(), false.into());
            print_document(&format!("{value:#}\n"))?;
        }
        let case = case?;
        if self.resolved {
            return print(&case.resolved_toml());
        }
        let estimate = Estimate::new(&case);
        let trial = self.admissible.then(|| find_velocity(&case, self.limit)).transpose()?;
        let admissible = trial.map(|trial| (self.limit, trial));
        let findings = advice::of_case(&case);
        if self.json {
            return print_document(&json(&case, &estimate, admissible, &findings));
        }
        for Finding { text, .. } in &findings {
            say(&format!("warning: {text}"));
        }
        print(&table(&self.case.case, &case, &estimate, admissible))
    }
}

fn find_velocity(case: &Case, limit: Limit) -> Result<Trial, CliError> {
    let is_terminal = io::stderr().is_terminal();
    let watch = |trial: &Trial| {
        if is_terminal {
            let velocity = case.units().speed.short_text(trial.velocity);
            say(&format!(
                "trial: V0 = {velocity}, largest strain {:.5}, {:.3} of the limit",
                trial.strain, trial.ratio
            ));
        }
    };
    Ok(admissible::find(case, limit, watch)?)
}

/// A velocity in m/s, where the case gives c_p.
fn metres_per_second(case: &Case, velocity: f64) -> Option<f64> {
    Some(velocity * case.scales?.of(Dimension::Speed))
}

fn json(
    case: &Case,
    estimate: &Estimate,
    admissible: Option<(Limit, Trial)>,
    findings: &[Finding],
) -> String {
    let mut value = serde_json::json!({
        "version": VERSION,
        "valid": true,
        "runnable": true,
        "case": case.resolved_json(),
        "sizes": case.sizes,
        "layers": target::json(case),
        "back": case.target.back,
        "estimate": {
            "memory_bytes": estimate.memory,
            "message_bytes": estimate.messages,
            "file_bytes": estimate.file,
            "whole_file_bytes": cost::whole_file(case),
            "seconds": estimate.seconds,
        },
        "theory_error": Trust::of(case),
        "hertz": Hertz::of(case).map(|hertz| serde_json::json!({
            "largest_radius": case.units().length.of(hertz.largest_radius()),
            "duration": case.units().time.of(hertz.duration()),
            "peak_force": case.units().force.of(hertz.largest_force()),
            "cells_across": cells_across(case, &hertz),
            "cells_for_ten_across": cells_for_ten(case, &hertz),
        })),
        "impact": Expected::of(case),
        "grading": case.grading_facts().map(|facts| {
            let length = case.units().length;
            let [surface, middle, back] = facts.wavelengths.map(|x| length.of(x));
            let [near_radius, near_depth] = facts.grading.near.map(|x| length.of(x));
            serde_json::json!({
                "contact_cells": facts.grading.contact_cells,
                "ratio": facts.grading.ratio,
                "near_radius": near_radius,
                "near_depth": near_depth,
                "ten_node_wavelength": { "surface": surface, "middle": middle, "back": back },
                "work_ratio": facts.work,
            })
        }),
        "rigidity": Rigidity::of(case),
        "warnings": findings,
    });
    if let Some((limit, Trial { velocity, strain, ratio, nodes })) = admissible {
        value["admissible"] = serde_json::json!({
            "velocity": velocity,
            "velocity_m_per_s": metres_per_second(case, velocity),
            "strain": strain,
            "strain_limit": STRAIN_LIMIT,
            "nodes_in_contact": nodes,
        });
        if limit != Limit::Strain {
            value["admissible"]["limit"] = format!("{limit:?}").to_lowercase().into();
            value["admissible"]["ratio"] = ratio.into();
        }
    }
    format!("{value:#}\n")
}

fn table(name: &str, case: &Case, estimate: &Estimate, admissible: Option<(Limit, Trial)>) -> String {
    let &Sizes { dr, dz, dt, steps, nr, nz, outer_radius, depth, .. } = &case.sizes;
    let Units { length, time, .. } = case.units();
    let courant = case.wave_speed() * dt / dr;
    let is_layered = case.sizes.layers.len() > 1;
    let which = if is_layered { " in the struck layer" } else { "" };
    let end = steps as f64 * dt;
    let mut rows = vec![("case", format!("{}: {}", printable(name), printable(&case.title)))];
    if case.scales.is_none() {
        let thickness = case.target.thickness.filter(|_| is_layered).unwrap_or(depth);
        let target = target::target(case, &thickness.to_string());
        rows.push(("target", format!("{target}, c_s = {}", case.target.material.shear_wave_speed)));
    }
    rows.extend(target::rows(case));
    let fine = |(unit, x): (Unit, f64)| case.scales.map_or_else(|| format!("{x:.6e}"), |_| unit.text(x));
    let [dr, dz, dt] = [(length, dr), (length, dz), (time, dt)].map(fine);
    let [r, z] = [outer_radius, depth].map(|x| length.text(x));
    rows.extend([
        ("mesh", format!("{nr} x {} nodes to r = {r}, z = {z}", nz + 1)),
        ("spacing", format!("dr = {dr}, dz = {dz}{which}, radial Courant number {courant:.6}")),
        ("time", format!("{steps} steps of {dt} to t = {}", time.text_to(6, end))),
    ]);
    let Estimate { memory, messages, file, seconds } = *estimate;
    let recording = format!("about {}; {} before compression", bytes(file), bytes(messages));
    rows.extend(case.grading_facts().map(|facts| ("grading", grading(case, &facts))));
    rows.extend(Hertz::of(case).and_then(|hertz| contact(case, &hertz)).map(|text| ("contact", text)));
    rows.extend(Expected::of(case).iter().flat_map(Expected::rows));
    rows.extend([("frames", frames(case))]);
    rows.extend(section(case).map(|section| ("section", section)));
    rows.extend([
        ("memory", format!("about {}", bytes(memory))),
        ("recording", recording),
        ("run time", format!("about {seconds:.2} s")),
    ]);
    if case.run.stop != Stop::Never {
        let text = "maybe earlier, as run.stop asks; recording and run time are up to the end";
        rows.push(("stop", text.into()));
    }
    if case.run.bounces > 1 {
        let text = "impacts, each a run with a recording; all above is of the first";
        rows.push(("bounces", format!("{} {text}", case.run.bounces)));
    }
    if let Some((limit, Trial { velocity, strain, ratio, .. })) = admissible {
        let velocity = metres_per_second(case, velocity)
            .map_or_else(|| format!("{velocity:.4e}"), |si| format!("{si:.4e} m/s"));
        let text = match limit {
            Limit::Strain => format!("strains the target by {strain:.5}, the limit is {STRAIN_LIMIT}"),
            _ => format!("keeps {}, at {ratio:.3} of it", limit.text()),
        };
        rows.push(("velocity", format!("V0 = {velocity} {text}")));
    }
    rows.iter().map(|(key, value)| format!("{key:<10} {value}\n")).collect()
}

/// Cells across the largest contact and those that ten across it need, where a graded mesh does not say so; of a rigid indenter of a known material
/// the contact that is computed, by Hertz in the units of the case, beside that of both moduli.
fn contact(case: &Case, hertz: &Hertz) -> Option<String> {
    let across = format!("{:.1} cells across the diameter", cells_across(case, hertz));
    let ten = match case.mesh.grading {
        Some(_) => String::new(),
        None => format!("; ten cells across need mesh.cells = {}", cells_for_ten(case, hertz)),
    };
    if Rigidity::of(case).is_none() {
        return case.mesh.grading.is_none().then(|| across + &ten);
    }
    let Units { length, time, force, .. } = case.units();
    let radius = length.text(hertz.largest_radius());
    let [duration, peak] = [time.text(hertz.duration()), force.text(hertz.largest_force())];
    let target = if case.sizes.layers.len() > 1 { "the struck layer" } else { "the target" };
    Some(format!(
        "by Hertz, on a half-space of {target}: largest radius {radius}, {across}; it lasts {duration}, peak force {peak}{ten}"
    ))
}

/// How a graded mesh is made, and what it resolves.
fn grading(case: &Case, facts: &GradingFacts) -> String {
    let length = case.units().length;
    let GradingFacts { grading, wavelengths, work } = facts;
    let [radius, depth] = grading.near.map(|x| length.text(x));
    let [top, middle, bottom] = wavelengths.map(|x| length.text(x));
    format!(
        "{} cells across the contact, alike to r = {radius}, z = {depth}, then each {} times the one before; along z ten nodes have waves of {top} at the surface, \
         {middle} in the middle, {bottom} at the back; {:.1e} of the work of equal cells",
        grading.contact_cells, grading.ratio, work
    )
}

/// Cells across the diameter of the largest contact.
fn cells_across(case: &Case, hertz: &Hertz) -> f64 {
    2.0 * hertz.largest_radius() / case.sizes.dr
}

/// `mesh.cells` of ten cells across the diameter of the largest contact.
fn cells_for_ten(case: &Case, hertz: &Hertz) -> f64 {
    (10.0 * case.mesh.cells as f64 / cells_across(case, hertz)).ceil()
}

/// How far out fields show the target, where that is not all of it, and what showing all takes.
fn section(case: &Case) -> Option<String> {
    let (radius, whole) = case.shown_radius().zip(cost::whole_file(case))?;
    let length = case.units().length;
    let [radius, outer] = [radius, case.sizes.outer_radius].map(|r| length.text(r));
    Some(format!(
        "to r = {radius} of {outer} (record.r_max); with r_max = inf the recording is about {}",
        bytes(whole)
    ))
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
