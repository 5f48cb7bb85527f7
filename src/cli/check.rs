//! `percuss check`: is a case valid, and what will it take?

use std::time::Instant;

use clap::Args;

use super::{CaseArguments, CliError, Exit, print};
use crate::{
    case::{Case, Sizes},
    channels::{Catalogue, Size},
    grid::{Geometry, Grid, MeshKind, Spacing},
    model::{Model, ModelKind, cone::Sight, rakhmatulin::Rakhmatulin, sweep::MAX_LAG},
    recording::Compression,
    surface::Surface,
};

/// Validates a case.
#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    case: CaseArguments,
    /// Print the complete case as TOML, every default and derived choice explicit; `percuss run` on it repeats the run
    #[arg(long)]
    resolved: bool,
    /// Print everything as JSON
    #[arg(long, conflicts_with = "resolved")]
    json: bool,
}

/// What a run will take.
struct Estimate {
    memory: u64,
    updates: f64,
    recording: u64,
    file: u64,
    seconds: f64,
}

/// Size of a recording \[bytes\] from that of its messages; how much they pack was measured on the built-in cases.
fn packed(size: Size, compression: Compression) -> u64 {
    let (numbers, views) = match compression {
        Compression::None => (1.0, 1.0),
        Compression::Lz4 => (0.93, 0.22),
        Compression::Zstd => (0.85, 0.10),
    };
    (numbers * size.numbers as f64 + views * size.views as f64) as u64
}

impl Check {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        if self.resolved {
            print(&case.resolved_toml())?;
            return Ok(Exit::Done);
        }
        let estimate = estimate(&case);
        let text = if self.json { json(&case, &estimate) } else { table(&self.case.case, &case, &estimate) };
        print(&text)?;
        Ok(Exit::Done)
    }
}

fn estimate(case: &Case) -> Estimate {
    let sizes = &case.sizes;
    let updates = node_updates(case);
    let recording = Catalogue::new(case).size(case);
    // time of a step that has next to nothing to compute: contact, channels, hand-over to the pool
    let per_step = 20e-6;
    Estimate {
        memory: 2 * 8 * (sizes.nr as u64 + 1) * (sizes.nz as u64 + 1),
        updates,
        recording: recording.total(),
        file: packed(recording, case.record.compression),
        seconds: updates / node_rate(sizes) + per_step * sizes.steps as f64,
    }
}

/// Node updates inside the light cone over the whole run.
fn node_updates(case: &Case) -> f64 {
    let Sizes { steps, nz, .. } = case.sizes;
    let samples = steps.min(1000);
    let mean: f64 = (0..samples)
        .map(|sample| {
            let step = (sample as f64 + 0.5) / samples as f64 * steps as f64;
            step.min(nz as f64) * case.lit_columns(step)
        })
        .sum::<f64>()
        / samples as f64;
    mean * steps as f64
}

/// Node updates per second that this machine does on a mesh like that of the case, tried out briefly.
fn node_rate(sizes: &Sizes) -> f64 {
    const TRIAL_NODES: usize = 1 << 20;
    let rows = sizes.nz.min(1 << 10);
    let columns = (TRIAL_NODES / rows).clamp(16, sizes.nr.max(16));
    let spacing = Spacing { dr: 1.0, dz: 1.0, layer_rows: Some(rows) };
    let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, columns, rows);
    let mut model = Rakhmatulin::new(grid, 0.5, Sight::Field);
    let mut surface = Surface::new(columns);
    surface.loaded = columns;
    // the first steps fill the mesh with waves, the next ones are timed
    let mut steps = |count: usize| {
        let start = Instant::now();
        for _ in 0..count {
            model.predict(&mut surface);
            for (u, free) in surface.displacement.iter_mut().zip(&surface.free) {
                *u = free + 1.0;
            }
            model.advance(&surface);
        }
        start.elapsed().as_secs_f64()
    };
    steps(rows);
    let timed = 4 * MAX_LAG;
    (rows * columns * timed) as f64 / steps(timed)
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
            "node_updates": estimate.updates,
            "message_bytes": estimate.recording,
            "file_bytes": estimate.file,
            "seconds": estimate.seconds,
        },
    });
    format!("{value:#}\n")
}

fn table(name: &str, case: &Case, estimate: &Estimate) -> String {
    let Sizes { dr, dz, dt, steps, nr, nz, outer_radius, depth, layer, .. } = case.sizes;
    let target = if layer { format!("layer of thickness {depth}") } else { "half-space".into() };
    let c_s = case.target.material.shear_wave_speed;
    let mut rows = vec![
        ("case", format!("{name}: {}", case.title)),
        ("target", format!("{target}, c_s = {c_s}")),
        ("mesh", format!("{nr} x {} nodes to r = {outer_radius:.4}, z = {depth:.4}", nz + 1)),
        ("spacing", format!("dr = {dr:.6e}, dz = {dz:.6e}, radial Courant number {:.6}", c_s * dt / dr)),
        ("time", format!("{steps} steps of {dt:.6e} to t = {:.6}", steps as f64 * dt)),
        ("memory", format!("about {}", bytes(estimate.memory))),
        (
            "recording",
            format!("about {}, {} before compression", bytes(estimate.file), bytes(estimate.recording)),
        ),
        ("run time", format!("about {:.1} s, {:.2e} node updates", estimate.seconds, estimate.updates)),
    ];
    if case.model == ModelKind::Elastic {
        rows.push((
            "note",
            "valid, but `percuss run` of this version has no solver for model = \"elastic\"".into(),
        ));
    }
    rows.iter().map(|(key, value)| format!("{key:<10} {value}\n")).collect()
}

fn bytes(count: u64) -> String {
    indicatif::BinaryBytes(count).to_string()
}
