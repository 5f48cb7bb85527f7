//! What a piece of work takes on this machine: measured in some seconds, then kept in the user's cache.

use std::{
    fs,
    io::{self, IsTerminal, Write},
    path::{Path, PathBuf},
    time::Instant,
};

use serde::{Deserialize, Serialize};

use super::{Work, held_up};
use crate::{case::Case, model::instructions, recording::Compression, session, simulation::Simulation};

/// Times of pieces of work \[s\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// An update of a node.
    pub update: f64,
    /// A column of the surface in a step: contact and what else is done step by step.
    pub column: f64,
    /// A node of a frame: its energy.
    pub frame_node: f64,
    /// A number that a field shows.
    pub shown: f64,
    /// Packing and writing a byte of numbers that are not at rest: without compression, with LZ4, with Zstandard.
    pub byte: [f64; 3],
    /// Making, packing and writing a message for viewers, beside what depends on its size.
    pub view: f64,
    /// Making, packing and writing a byte of messages for viewers.
    pub view_byte: f64,
    /// Starting and ending a run.
    pub start: f64,
    /// Cores that computing and writing share.
    pub cores: f64,
}

/// Machine and program that rates belong to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Machine {
    host: String,
    cores: usize,
    instructions: String,
    program: String,
}

#[derive(Serialize, Deserialize)]
struct Cached {
    machine: Machine,
    rates: Rates,
}

impl Machine {
    fn this() -> Self {
        let build = if cfg!(debug_assertions) { "debug" } else { "release" };
        Self {
            host: gethostname::gethostname().to_string_lossy().into_owned(),
            cores: rayon::current_num_threads(),
            instructions: instructions(),
            program: format!("{} {build}", env!("CARGO_PKG_VERSION")),
        }
    }
}

fn compression_index(compression: Compression) -> usize {
    match compression {
        Compression::None => 0,
        Compression::Lz4 => 1,
        Compression::Zstd => 2,
    }
}

impl Rates {
    /// The rates of this machine: from the cache, or measured and left there. None if they cannot be measured.
    ///
    /// * `anew`: measure in any case
    pub fn of_this_machine(anew: bool) -> Option<Self> {
        let (machine, path) = (Machine::this(), cache_path());
        if !anew && let Some(rates) = path.as_deref().and_then(|path| read(path, &machine)) {
            return Some(rates);
        }
        if io::stderr().is_terminal() {
            eprintln!("measuring how fast this machine is; this is done once …");
        }
        let rates = Self::measure()?;
        if let Some(path) = path {
            // without a cache the next check measures again
            let _ = write(&path, &Cached { machine, rates: rates.clone() });
        }
        Some(rates)
    }

    /// Time of the threads that compute \[s\].
    pub(super) fn computing(&self, work: &Work) -> f64 {
        self.update * work.updates
            + self.column * work.columns
            + self.frame_node * work.frame_nodes
            + self.shown * work.shown
    }

    /// Time of the thread that writes \[s\].
    pub(super) fn writing(&self, work: &Work, compression: Compression) -> f64 {
        self.byte[compression_index(compression)] * work.dense_bytes()
            + self.view * work.views
            + self.view_byte * work.messages.views as f64
    }

    /// Measures the rates with small runs; None if there is no place for temporary files.
    pub fn measure() -> Option<Self> {
        let folder = tempfile::tempdir().ok()?;
        let file = folder.path().join("run.mcap");
        let cores = rayon::current_num_threads() as f64;
        // what is not known yet takes no time
        let mut rates = Self {
            update: 0.0,
            column: 0.0,
            frame_node: 0.0,
            shown: 0.0,
            byte: [0.0; 3],
            view: 0.0,
            view_byte: 0.0,
            start: 0.0,
            cores,
        };
        // steps: two meshes, two unknowns; one of them does not fit into the caches, and both keep all cores busy
        let runs = [(200, 15.0), (800, 3.0)].map(|(cells, end)| {
            let case = punch(cells, end, &["record.frames=0"]);
            (Work::of(&case), computed(&case))
        });
        let [(small, small_time), (large, large_time)] = runs;
        let determinant = small.updates * large.columns - large.updates * small.columns;
        rates.update = (small_time * large.columns - large_time * small.columns) / determinant;
        rates.column = (large.updates * -small_time + large_time * small.updates) / determinant;
        if rates.column < 0.0 {
            // memory costs more than columns do
            (rates.update, rates.column) = (large_time / large.updates, 0.0);
        }

        // frames: none, many that show nothing, some that show everything
        let every_node = "record.field_every=1";
        let [none, energy, all] = [
            punch(150, 12.0, &["record.frames=0"]),
            punch(150, 12.0, &["record.frames=900", "record.fields=[]"]),
            punch(150, 12.0, &["record.frames=200", every_node]),
        ]
        .map(|case| (Work::of(&case), computed(&case)));
        rates.frame_node = (energy.1 - none.1).max(0.0) / energy.0.frame_nodes;
        rates.shown = (all.1 - none.1 - rates.frame_node * all.0.frame_nodes).max(0.0) / all.0.shown;

        let recorded = |case: &Case| {
            usual_time(|| {
                // letting go of an old file takes time of its own
                drop(fs::remove_file(&file));
                seconds(|| drop(session::record(case, &file)))
            })
        };
        rates.start = recorded(&punch(20, 0.05, &["record.frames=1"])) + PROCESS;
        let fields = ["record.frames=100", every_node, "record.views=[]"];
        let computing = computed(&punch(150, 6.0, &fields));
        for (compression, name) in [(0, "none"), (1, "lz4"), (2, "zstd")] {
            let packed = format!("record.compression=\"{name}\"");
            let case = punch(150, 6.0, &[&fields[..], &[&packed]].concat());
            let writing = rates.writing_time(&case, recorded(&case), computing);
            rates.byte[compression] = writing / Work::of(&case).dense_bytes();
        }

        // views: small pictures, and large ones; per message
        let views = [(60, 12.0, 700, 1), (300, 3.0, 400, 3)].map(|(cells, end, frames, every)| {
            let settings = [format!("record.frames={frames}"), format!("record.field_every={every}")];
            let settings = settings.each_ref().map(String::as_str);
            let [with, without] = [&[][..], &["record.views=[]"]]
                .map(|views| punch(cells, end, &[&settings[..], views].concat()));
            let work = Work::of(&with);
            let computing = computed(&with);
            let [with, without] =
                [with, without].map(|case| rates.writing_time(&case, recorded(&case), computing));
            [with - without, work.messages.views as f64].map(|amount| amount / work.views)
        });
        let [[small_time, small_bytes], [large_time, large_bytes]] = views;
        rates.view_byte = ((large_time - small_time) / (large_bytes - small_bytes)).max(0.0);
        rates.view = (small_time - rates.view_byte * small_bytes).max(0.0);
        Some(rates)
    }

    /// How long the thread that writes has worked in a run that took `seconds`, and `computing` without it: the inverse of
    /// [`Work::seconds`].
    fn writing_time(&self, case: &Case, seconds: f64, computing: f64) -> f64 {
        let seconds = seconds - (self.start - PROCESS);
        // it was the slower one, or all shared the cores
        let held_up = held_up(case, computing, self.cores);
        ((seconds - computing) / held_up).clamp(0.0, seconds.max(0.0))
    }
}

/// Start and end of a process, and giving it its memory, which runs of a calibration have from those before them \[s\].
const PROCESS: f64 = 6e-3;

/// The flat punch of the paper on the paper's mesh.
fn punch(cells: usize, end: f64, settings: &[&str]) -> Case {
    let mut all = vec![
        "mesh.kind=\"paper\"".to_owned(),
        "mesh.outer_radius=4".to_owned(),
        format!("mesh.cells={cells}"),
        format!("run.end_time={end:?}"),
    ];
    all.extend(settings.iter().map(|&setting| setting.to_owned()));
    Case::load("fig5", &all).expect("a built-in case")
}

/// Time of a run that nobody looks at \[s\].
fn computed(case: &Case) -> f64 {
    let compute = || {
        let mut simulation = Simulation::new(case).expect("a case with a solver");
        while simulation.step().expect("a sound case").is_some() {}
        // the interior is behind the surface until somebody asks for it, as the end of a recording does
        simulation.validity();
    };
    usual_time(|| seconds(compute))
}

/// Time of something \[s\].
fn seconds(run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_secs_f64()
}

/// The middle one of five times \[s\].
fn usual_time(time: impl Fn() -> f64) -> f64 {
    let mut times = [0.0; 5].map(|_: f64| time());
    times.sort_by(f64::total_cmp);
    times[2]
}

/// Where rates are kept, if the user has a place for such things.
fn cache_path() -> Option<PathBuf> {
    Some(dirs::cache_dir()?.join("percuss").join("calibration.json"))
}

fn read(path: &Path, machine: &Machine) -> Option<Rates> {
    let cached: Cached = serde_json::from_slice(&fs::read(path).ok()?).ok()?;
    (cached.machine == *machine).then_some(cached.rates)
}

/// Replaces the cache as a whole, so that nobody reads half of it.
fn write(path: &Path, cached: &Cached) -> io::Result<()> {
    let folder = path.parent().expect("a file in a folder");
    fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(&serde_json::to_vec_pretty(cached)?)?;
    file.persist(path)?;
    Ok(())
}
