//! `percuss sweep`: a case with keys that vary.

use std::{
    ops::Bound,
    path::{Path, PathBuf},
};

use clap::Args;
use indicatif::{BinaryBytes, HumanDuration};
use percuss_output::{
    number::{finite, whole},
    text::{printable, say},
};

use super::{
    CliError, Exit, default_output,
    output::{ProgressArguments, ThreadArguments, signalled, watch_signals},
    print,
    progress::Progress,
};
use crate::{
    case::builtin,
    sweep::{
        MAX_CASES,
        folder::{Folder, Shard, missing},
        journal::{Done, Entry, Journal, State},
        plan::{Plan, Planned},
        request::{Keep, Request},
        schedule::{self, Limits},
        script::{Scheduler, script},
        spec::{Combine, Samples, Vary},
        uncertainty::Spread,
    },
    units::engineering,
};

const EXAMPLES: &str = "\
Examples:
  percuss sweep fig8-m5 --vary indenter.mass=0.1:100:31:log -o masses
  percuss sweep ball.toml --vary indenter.mass=\"1 g,2 g,5 g\" \\
      --vary target.material=steel,glass,pmma -o balls
  percuss sweep fig5 --vary target.shear_wave_speed=0.1:0.7 \\
      --vary indenter.mass=1:100:log --lhs 1000 --seed 1 \\
      --set record.frames=0 --keep none -o samples
  # a column for each key, a row for each case
  percuss sweep fig5 --vary cases.csv -o table
  percuss sweep masses         # go on with a sweep that was stopped
  percuss sweep fig5 --vary mesh.cells=50,100 -o d --script slurm > job.sh \\
      && sbatch job.sh
  percuss sweep d --shard 2/7  # one part of it, with a journal of its own
  percuss sweep d --merge      # one journal and summary of all parts
  percuss-read plot masses/summary.parquet --x indenter.mass --y peak_force \\
      --log x -o force.svg

SPEC is a list, 1,2,5,10, or a range with a count of values, FROM:TO:COUNT, FROM:TO:COUNT:log. Quantities of \
physical cases have their unit, \"1 g:1 kg:7:log\". Several --vary make every combination, the last one varying \
fastest. A sweep file says the same:

  case = \"fig5\"
  set = [\"record.frames=0\"]
  keep = \"none\"                                  # all | none | worst:MEASURE
  # product | zip | { lhs = { samples = 100, seed = 1 } }
  combine = \"product\"
  [[vary]]
  key = \"indenter.mass\"
  values = \"0.1:100:31:log\"                      # or a list
  [[vary]]
  file = \"cases.csv\"

Every case is checked before the first one is run. A case that is done is not computed again, also where the sweep \
is another one by then. DIR/summary.csv and .parquet have a row for every case: what varies, what `percuss-read \
summary` measures, and subjects of its warnings.";

/// Computes a case with keys that vary: thousands of cases, on all cores, restartable.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SweepArguments {
    /// A case as of `percuss run`, a sweep file, or the folder of a sweep, to go on with it
    #[arg(value_name = "CASE|FILE|DIR")]
    what: String,
    /// Change a key in all cases
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Vary a key, or the columns of a CSV file. Repeatable
    #[arg(long, value_name = "KEY=SPEC|FILE.csv")]
    vary: Vec<String>,
    /// Pair the values of several --vary one by one
    #[arg(long, conflicts_with = "lhs")]
    zip: bool,
    /// Draw N cases from ranges, KEY=FROM:TO or KEY=FROM:TO:log, as a Latin hypercube
    #[arg(long, value_name = "N", value_parser = whole(1..=MAX_CASES as u64))]
    lhs: Option<u64>,
    /// Seed of --lhs
    #[arg(long, value_name = "S", default_value_t = 0, requires = "lhs", value_parser = whole(0..=u64::MAX))]
    seed: u64,
    /// Folder of the sweep [default: the name of the case with -sweep]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Recordings to keep, in DIR/runs: all, none, or worst:MEASURE, that of the case with the largest value of a measure
    /// [default: all]
    #[arg(long, value_name = "WHICH", value_parser = |text: &str| Keep::try_from(text.to_owned()))]
    keep: Option<Keep>,
    #[command(flatten)]
    threads: ThreadArguments,
    /// Memory that all cases under way may take together, as estimated, in GiB
    #[arg(long, value_name = "GIB", default_value_t = 8.0, value_parser = finite((Bound::Excluded(0.0), Bound::Unbounded)))]
    max_memory: f64,
    /// Compute cases that have failed once more
    #[arg(long)]
    rerun_failed: bool,
    /// Check and count all cases, and estimate the time; run and write nothing
    #[arg(long, conflicts_with_all = ["shard", "merge", "script"])]
    dry_run: bool,
    /// Compute one of N parts, with a journal and a summary of its own: parts need nothing but the folder in common
    #[arg(long, value_name = "I/N", conflicts_with_all = ["merge", "script"])]
    shard: Option<Shard>,
    /// Join the journals of all parts, and write the summary
    #[arg(long, conflicts_with = "script")]
    merge: bool,
    /// Make DIR, and print a job script that computes it in parts
    #[arg(long, value_name = "SCHEDULER", value_enum)]
    script: Option<Scheduler>,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    progress: ProgressArguments,
}

const GIB: f64 = 1_073_741_824.0;

/// A sweep that is checked and locked.
struct Work {
    folder: Folder,
    plan: Plan,
    done: Done,
    limits: Limits,
    journal: Journal,
}

impl SweepArguments {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let (file, output) = self.places()?;
        let folder = Folder::new(&output, self.shard);
        let is_given = file.is_some() && output == Path::new(&self.what);
        // what another process may change is read once that cannot
        let lock = || folder.lock();
        let journal = (is_given && !self.dry_run).then(lock).transpose()?;
        let (request, base) = self.request(file.as_deref())?;
        let pool = self.threads.pool()?;
        let plan = pool.install(|| Plan::new(request, &base))?;
        let limits = Limits { threads: self.threads.count(), memory: self.memory(&plan)? };
        if self.dry_run {
            return print(&estimates(&plan, limits));
        }
        let journal = journal.map_or_else(lock, Ok)?;
        if let Some(scheduler) = self.script {
            folder.write_request(&plan)?;
            let memory = plan.cases.iter().map(|case| case.memory).max().unwrap_or_default();
            let text = script(scheduler, &output, plan.cases.len(), memory)
                .map_err(|error| CliError::system("the path of the program", error))?;
            return print(&text);
        }
        let done = folder.done()?;
        for (path, lines) in &done.unread {
            self.say(&format!("{}: {lines} damaged lines, whose cases are computed again", path.display()));
        }
        let work = Work { folder, plan, done, limits, journal };
        if self.merge { self.merge(work) } else { self.compute(work) }
    }

    /// The file that is given, of a case or a sweep, if it is one, and the folder of the sweep.
    fn places(&self) -> Result<(Option<PathBuf>, PathBuf), CliError> {
        let path = Path::new(&self.what);
        let is_builtin = builtin::find(&self.what).is_some();
        if path.is_dir() && !is_builtin {
            if self.output.is_some() {
                let text = format!("`{}` is the folder of the sweep: leave out -o", self.what);
                return Err(CliError::Usage(text));
            }
            return Ok((Some(Folder::sweep_file(path)?), path.to_owned()));
        }
        if self.vary.is_empty() && !is_builtin && !path.exists() {
            return Err(CliError::Usage(format!(
                "`{}` does not exist: name a case, a sweep file or the folder of a sweep",
                self.what
            )));
        }
        let output = self.output.clone().unwrap_or_else(|| default_output(&self.what, "-sweep"));
        Ok((Some(path.to_owned()).filter(|path| path.is_file()), output))
    }

    /// What is asked for, and the folder of relative paths in it.
    fn request(&self, file: Option<&Path>) -> Result<(Request, PathBuf), CliError> {
        let read = file.map(Request::read).transpose()?.flatten();
        let (mut request, folder) = match read {
            Some(request) => {
                if !self.vary.is_empty() || !self.overrides.is_empty() || self.zip || self.lhs.is_some() {
                    let text =
                        format!("`{}` says what varies: leave out --vary, --set, --zip and --lhs", self.what);
                    return Err(CliError::Usage(text));
                }
                let folder = file.and_then(Path::parent).unwrap_or(Path::new(""));
                (request, folder.to_owned())
            }
            None => (self.of_arguments(), PathBuf::new()),
        };
        if let Some(keep) = &self.keep {
            request.keep = keep.clone();
        }
        Ok((request, folder))
    }

    fn of_arguments(&self) -> Request {
        let combine = match self.lhs {
            Some(samples) => Combine::Lhs(Samples { samples, seed: self.seed }),
            None if self.zip => Combine::Zip,
            None => Combine::Product,
        };
        Request {
            case: self.what.clone(),
            set: self.overrides.clone(),
            combine,
            vary: self.vary.iter().map(|vary| Vary::parse(vary)).collect(),
            ..Request::default()
        }
    }

    /// Memory that cases may take \[bytes\].
    fn memory(&self, plan: &Plan) -> Result<u64, CliError> {
        let memory = (self.max_memory * GIB) as u64;
        let large = (1..).zip(&plan.cases).find(|(_, case)| case.memory > memory);
        match large {
            None => Ok(memory),
            Some((number, case)) => Err(CliError::Usage(format!(
                "case {number} takes about {}, more than --max-memory {}",
                BinaryBytes(case.memory),
                self.max_memory
            ))),
        }
    }

    fn say(&self, text: &str) {
        if !self.quiet {
            say(&printable(text));
        }
    }

    fn compute(&self, mut work: Work) -> Result<Exit, CliError> {
        let Work { folder, plan, done, limits, journal } = &mut work;
        let signal = watch_signals()?;
        folder.write_request(plan)?;
        let jobs = folder.jobs(plan, done, self.rerun_failed, journal)?;
        let all = plan.cases.len();
        let part =
            self.shard.map_or_else(String::new, |shard| format!(", shard {}/{}", shard.number, shard.of));
        self.say(&format!("{}: {all} cases{part}, {} to compute", self.what, jobs.len()));
        let mut progress = Progress::of_sweep(plan, jobs.iter().map(|job| job.number), self);
        let computed = schedule::run(plan, jobs, *limits, &signal, |entry| {
            progress.advance(plan, &entry);
            journal.append(&entry)?;
            done.entries.insert(entry.digest, entry);
            Ok(())
        });
        progress.end();
        // what is done stays so
        let synchronised = journal.synchronise();
        computed?;
        synchronised?;
        if let Some(signal) = signalled(&signal) {
            self.say("interrupted; the same command goes on with the rest");
            return Ok(Exit::Interrupted(signal));
        }
        if self.shard.is_none() {
            self.finish(work)
        } else {
            self.summarise(folder, plan, done)?;
            Ok(Exit::Done)
        }
    }

    fn merge(&self, mut work: Work) -> Result<Exit, CliError> {
        let Work { folder, plan, done, journal, .. } = &mut work;
        let missing = missing(plan, done);
        if missing > 0 {
            let text = format!(
                "{missing} of {} cases are not done; `percuss sweep {}` computes them, with --shard a part of them",
                plan.cases.len(),
                self.what
            );
            return Err(CliError::Failed(text));
        }
        folder.write_request(plan)?;
        journal.merge(done)?;
        self.finish(work)
    }

    /// Writes the summary, and says what cases are warned of.
    fn summarise(&self, folder: &Folder, plan: &Plan, done: &Done) -> Result<(), CliError> {
        folder.write_summary(plan, done)?;
        let warnings = folder.warnings(plan, done);
        let counts: Vec<String> =
            warnings.iter().map(|(about, cases)| format!("{about} in {cases}")).collect();
        if !counts.is_empty() {
            let text = "cases; the summary says in which, `percuss run` of one what it means";
            self.say(&format!("warnings: {} {text}", counts.join(", ")));
        }
        Ok(())
    }

    /// Records the worst case, if that is asked for, and writes the summary.
    fn finish(&self, mut work: Work) -> Result<Exit, CliError> {
        let Work { folder, plan, done, limits, journal } = &mut work;
        if let Keep::Worst(key) = &plan.request.keep
            && done.entries.values().all(|entry| entry.measures.get(key).is_none())
        {
            self.say(&format!("no case has a value of `{key}`: no recording is kept"));
        }
        let jobs = folder.last_jobs(plan, done)?;
        if !jobs.is_empty() {
            let signal = watch_signals()?;
            schedule::run(plan, jobs, *limits, &signal, |entry| {
                self.say(&format!("{} is kept", entry.file.as_deref().unwrap_or_default()));
                journal.append(&entry)
            })?;
            journal.synchronise()?;
            if let Some(signal) = signalled(&signal) {
                return Ok(Exit::Interrupted(signal));
            }
        }
        self.summarise(folder, plan, done)?;
        let spreads = folder.write_uncertainty(plan, done)?;
        if !spreads.is_empty() && !self.quiet {
            print(&uncertainty(&spreads))?;
        }
        let failed: Vec<String> = (1..)
            .zip(&plan.cases)
            .filter(|(_, case)| {
                done.entries.get(&case.digest).is_some_and(|entry| entry.state == State::Failed)
            })
            .map(|(number, _): (usize, _)| number.to_string())
            .collect();
        if failed.is_empty() {
            self.say(&format!("{} cases are done", plan.cases.len()));
            return Ok(Exit::Done);
        }
        let more =
            if failed.len() > SHOWN { format!(" and {} more", failed.len() - SHOWN) } else { String::new() };
        let numbers = failed[..failed.len().min(SHOWN)].join(", ");
        Err(CliError::Failed(format!(
            "{} of {} cases failed: {numbers}{more}; manifest.jsonl says why, --rerun-failed tries again",
            failed.len(),
            plan.cases.len()
        )))
    }
}

/// Mean and band of every measure, and what explains it.
fn uncertainty(spreads: &[Spread]) -> String {
    let line = |Spread { heading, values, explained }: &Spread| {
        let unit = heading.unit.as_deref().filter(|unit| *unit != "1").unwrap_or_default();
        let text =
            |value: f64| if unit.is_empty() { format!("{value:.4}") } else { engineering(value, unit) };
        let [mean, low, high] = values.map(text);
        let by = explained.as_ref().map_or_else(String::new, |(by, rho)| format!("  {by} ({rho:+.2})"));
        format!("{:<28} {mean:>12} {low:>12} {high:>12}{by}\n", heading.name)
    };
    let head = ["measure", "mean", "5 %", "95 %", "explained by (rank correlation)"];
    let [measure, mean, low, high, by] = head;
    format!("{measure:<28} {mean:>12} {low:>12} {high:>12}  {by}\n")
        + &spreads.iter().map(line).collect::<String>()
}

/// Failed cases that are named.
const SHOWN: usize = 20;

/// What a sweep would take.
fn estimates(plan: &Plan, limits: Limits) -> String {
    let sum = |part: fn(&Planned) -> f64| plan.cases.iter().map(part).sum::<f64>();
    let seconds = sum(|case| case.seconds) / limits.threads as f64;
    let memory = plan.cases.iter().map(|case| case.memory).max().unwrap_or_default();
    let files = match plan.request.keep {
        Keep::All => format!("about {}", BinaryBytes(sum(|case| case.file as f64) as u64)),
        _ => "none kept, or one".to_owned(),
    };
    let keys: Vec<&str> = plan.keys().collect();
    format!(
        "cases      {}\nvaries     {}\nrun time   about {} on {} threads\nmemory     at most about {} a case\nrecordings {files}\n",
        plan.cases.len(),
        printable(&keys.join(", ")),
        engineering(seconds, "s"),
        limits.threads,
        BinaryBytes(memory)
    )
}

/// How far a sweep is.
struct Cases {
    /// Cases, those done, those failed.
    counts: [usize; 3],
    /// Estimated work, all and done \[s\].
    work: [f64; 2],
}

impl Progress<Cases> {
    /// * `numbers`: of the cases to compute
    fn of_sweep(plan: &Plan, numbers: impl Iterator<Item = usize>, arguments: &SweepArguments) -> Self {
        let (mut cases, mut work) = (0, 0.0);
        numbers.for_each(|number| (cases, work) = (cases + 1, work + plan.cases[number - 1].seconds));
        let of = Cases { counts: [cases, 0, 0], work: [work, 0.0] };
        let template = "{wide_bar} {pos} of {len} cases{msg}";
        Self::new(of, cases as u64, template, arguments.quiet, arguments.progress.every)
    }

    fn advance(&mut self, plan: &Plan, entry: &Entry) {
        self.of.counts[1] += 1;
        self.of.work[1] += plan.cases[entry.case - 1].seconds;
        if entry.state == State::Failed {
            self.of.counts[2] += 1;
            let why = entry.message.as_deref().unwrap_or_default();
            self.say(&printable(&format!("case {} failed: {why}", entry.case)));
        }
        if self.is_due() {
            let Cases { counts: [cases, done, failed], work: [all, computed] } = self.of;
            let rest = self.start.elapsed().mul_f64((all - computed).max(0.0) / computed.max(1e-9));
            let failed = if failed > 0 { format!(", {failed} failed") } else { String::new() };
            let eta = format!("{failed}, ETA {}", HumanDuration(rest));
            let line = format!("{done} of {cases} cases{eta}");
            self.show(done as u64, eta, &line);
        }
    }
}
