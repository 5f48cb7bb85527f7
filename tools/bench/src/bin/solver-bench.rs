//! The cost of recording, the growth of time with the mesh, and the cost of layers.
//!
//! ```text
//! cargo build --release --workspace
//! target/release/solver-bench recording          a run with and without its recording
//! target/release/solver-bench growth             time over N³, N = 250 to 2000
//! target/release/solver-bench layers             five layers against one of as many rows
//! ```
//!
//! Runs of a comparison alternate; ratios are medians of the ratios of neighbouring runs. They are timed from the first step
//! to the end of the whole field; recordings until the file is closed. Runs with and without recording have a process and a
//! file of their own each, like those of `percuss run`: reused memory and files have another cost.

use std::{
    error::Error,
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
    time::Instant,
};

use clap::{Parser, Subcommand, ValueEnum};
use percuss::{
    case::Case,
    recording::Destination,
    session::{Recording, Source, run as run_steps},
    simulation::Simulation,
};
use percuss_bench::{exit, median};

#[derive(Parser)]
#[command(about, long_about = None)]
struct Arguments {
    #[command(subcommand)]
    what: What,
    /// Threads that compute
    #[arg(long, default_value_t = 2, global = true)]
    threads: usize,
    /// Runs of each
    #[arg(long, default_value_t = 5, global = true)]
    repeat: usize,
}

#[derive(Subcommand)]
enum What {
    /// A run with and without its recording: finite mass, stress, drag, velocity and probes of every step, frames of stress
    Recording {
        /// Case
        #[arg(default_value = "fig5")]
        case: String,
        /// Settings of the case [default: the reference case with a mass of 5]
        #[arg(long)]
        set: Vec<String>,
    },
    /// One run, its time in seconds
    #[command(hide = true)]
    Once {
        case: String,
        #[arg(long)]
        set: Vec<String>,
        /// File to record it to
        #[arg(long)]
        record: Option<PathBuf>,
    },
    /// Time over N³ of the reference case
    Growth {
        /// Nodes per unit of length
        #[arg(long, value_delimiter = ',', default_value = "250,500,1000,2000")]
        cells: Vec<usize>,
        /// End time; with order 2 and 4, whose steps are twice as long, twice as much
        #[arg(long, default_value_t = 6.0)]
        end: f64,
        /// Mesh and scheme
        #[arg(long, value_enum, default_value = "paper")]
        scheme: Scheme,
    },
    /// A flat punch on five layers of different densities, and on one of as many rows
    Layers {
        /// Nodes per unit of length
        #[arg(long, default_value_t = 500)]
        cells: usize,
        /// Mesh and scheme
        #[arg(long, value_enum, default_value = "order4")]
        scheme: Scheme,
    },
}

/// A scheme with its mesh. All have as many nodes and steps: nodes 1/N apart out to r = 4, N rows, 6N steps.
/// Those of the full theory have two displacements per node.
#[derive(Clone, Copy, ValueEnum)]
enum Scheme {
    /// The paper's mesh, order 2
    Paper,
    /// The matched mesh, order 2 without damping, on a layer of twice the thickness
    Order2,
    /// The matched mesh, order 4 with damping, on the same
    Order4,
    /// The full theory with its default damping
    Elastic,
    /// The full theory without damping
    ElasticUndamped,
}

impl Scheme {
    /// Settings of the flat punch on a layer, nodes 1/N apart out to r = 4.
    fn settings(self, n: usize, end: f64) -> Vec<String> {
        let (mesh, rest): (&str, &[&str]) = match self {
            Self::Paper => ("paper", &[]),
            Self::Order2 => ("matched", &["mesh.order=2", "mesh.damping=0.0", "target.thickness=2.0"]),
            Self::Order4 => ("matched", &["mesh.order=4", "mesh.damping=1.0", "target.thickness=2.0"]),
            Self::Elastic => ("matched", &["model=elastic"]),
            Self::ElasticUndamped => ("matched", &["model=elastic", "mesh.damping=0.0"]),
        };
        // steps of Δr/c_s
        let is_twice = matches!(self, Self::Order2 | Self::Order4);
        let end = if is_twice { 2.0 * end } else { end };
        let mut settings = vec![format!("mesh.kind={mesh}"), format!("mesh.cells={n}")];
        settings.extend(["mesh.outer_radius=4".to_owned(), format!("run.end_time={end:?}")]);
        settings.extend(rest.iter().map(|&setting| setting.to_owned()));
        settings
    }
}

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> ExitCode {
    exit(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<()> {
    let (threads, repeat) = (arguments.threads, arguments.repeat);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| match &arguments.what {
        What::Recording { case, set } => recording(case, set, threads, repeat),
        What::Once { case, set, record } => {
            let case = Case::load(case, set)?;
            let seconds = match record {
                Some(file) => recorded(&case, file)?,
                None => computed(&case)?,
            };
            println!("{seconds}");
            Ok(())
        }
        What::Growth { cells, end, scheme } => growth(cells, *end, *scheme, repeat),
        What::Layers { cells, scheme } => layers(*cells, *scheme, repeat),
    })
}

fn recording(name: &str, set: &[String], threads: usize, repeat: usize) -> Result<()> {
    let mut settings = set.to_vec();
    if settings.is_empty() {
        settings = Scheme::Paper.settings(1000, 6.0);
        settings.push("indenter.mass=5.0".into());
    }
    let case = Case::load(name, &settings)?;
    let without_frames = [&settings[..], &["record.frames=0".into()]].concat();
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let (mut rows, mut size) = (Vec::new(), 0);
    for _ in 0..repeat {
        let off = once(name, &without_frames, threads, None)?;
        let channels = once(name, &without_frames, threads, Some(&file))?;
        std::fs::remove_file(&file)?;
        let all = once(name, &settings, threads, Some(&file))?;
        size = file.metadata()?.len();
        std::fs::remove_file(&file)?;
        rows.push([off, channels, all]);
    }
    println!("{name}: not recorded {:.3} s; times as long:", median(rows.iter().map(|row| row[0])));
    println!("  channels of every step   {:.3}", median(rows.iter().map(|row| row[1] / row[0])));
    println!(
        "  and {:3} frames           {:.3}",
        case.frames().count(),
        median(rows.iter().map(|row| row[2] / row[0]))
    );
    println!("  file {:.1} MB", size as f64 / 1e6);
    Ok(())
}

/// Time of a run in a process of its own \[s\].
///
/// * `file`: path of its recording
fn once(name: &str, settings: &[String], threads: usize, file: Option<&Path>) -> Result<f64> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["once", name, "--threads", &threads.to_string()]);
    for setting in settings {
        command.args(["--set", setting]);
    }
    command.args(file.into_iter().flat_map(|file| [OsStr::new("--record"), file.as_os_str()]));
    let output = command.stderr(Stdio::inherit()).output()?;
    if !output.status.success() {
        return Err(format!("a run of {name} has failed").into());
    }
    Ok(String::from_utf8(output.stdout)?.trim().parse()?)
}

fn growth(cells: &[usize], end: f64, scheme: Scheme, repeat: usize) -> Result<()> {
    let mut rows = vec![Vec::new(); cells.len()];
    for _ in 0..repeat {
        for (row, &n) in rows.iter_mut().zip(cells) {
            let mut settings = scheme.settings(n, end);
            settings.push("record.frames=0".into());
            row.push(computed(&Case::load("fig5", &settings)?)?);
        }
    }
    println!("     N         s   s/N³ [1e-9]");
    for (row, n) in rows.into_iter().zip(cells) {
        let seconds = median(row);
        println!("{n:6} {seconds:9.4} {:9.3}", seconds * 1e9 / (*n as f64).powi(3));
    }
    Ok(())
}

fn layers(cells: usize, scheme: Scheme, repeat: usize) -> Result<()> {
    let mut settings = scheme.settings(cells, 6.0);
    settings.extend(["record.frames=0", "indenter.shape=flat", "indenter.radius=1.0"].map(str::to_owned));
    let (thickness, settings) = match settings.iter().position(|set| set.starts_with("target.thickness=")) {
        Some(place) => (settings.remove(place)["target.thickness=".len()..].parse()?, settings),
        None => (1.0, settings),
    };
    let case = |densities: &[f64]| {
        let layer = |density: &f64| {
            let thickness: f64 = thickness / densities.len() as f64;
            format!(
                "[[target.layer]]\nthickness = {thickness:?}\nshear_wave_speed = 0.5\ndensity = {density:?}\n"
            )
        };
        let text: String = densities.iter().map(layer).collect();
        Case::parse("layers", &text, &settings, Path::new(""))
    };
    let (one, five) = (case(&[1.0])?, case(&[1.0, 0.2, 2.0, 0.5, 1.5])?);
    let mut rows = Vec::new();
    for _ in 0..repeat {
        rows.push([computed(&one)?, computed(&five)?]);
    }
    let [one, five] = [one, five].map(|case| (case.sizes.nz + 1) as f64);
    println!(
        "one layer of {one} rows {:.3} s; five layers of {five} rows: per row {:.3} times as long",
        median(rows.iter().map(|row| row[0])),
        median(rows.iter().map(|row| row[1] / row[0])) * one / five
    );
    Ok(())
}

/// Time of a run without observers \[s\].
fn computed(case: &Case) -> Result<f64> {
    let start = Instant::now();
    run_steps(&mut Simulation::new(case), &mut [])?;
    Ok(start.elapsed().as_secs_f64())
}

/// Time of a run with its recording \[s\].
fn recorded(case: &Case, file: &Path) -> Result<f64> {
    let start = Instant::now();
    let mut recording = Recording::create(
        &Destination { overwrite: true, ..Destination::new(file) },
        case,
        Source::Simulation,
    )?;
    run_steps(&mut Simulation::new(case), &mut [&mut recording])?;
    Ok(start.elapsed().as_secs_f64())
}
