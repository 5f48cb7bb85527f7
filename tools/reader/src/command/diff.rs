//! `diff`: two recordings, or two folders of them, compared number by number.

mod checks;
mod jobs;
mod json;
mod picture;
mod shown;
mod text;
mod write;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum, builder::PossibleValue};
use percuss_output::{OutputError, text::printable};
use serde_json::json;

use crate::{
    command::plot::medium,
    compare::{Comparison, Mode, NanRule, Options, Rule, Rules, Tolerance, Verdict},
    failure::Failure,
    measured::Sources,
    recording::Limits,
    verb::{
        Exit, Verb, by_extension, has_colour, if_read, print, print_document, print_painted, refuse_inputs,
        say, write,
    },
};

use checks::{Suite, github, junit, markdown};
pub use jobs::diff;
use jobs::{Job, bless, is_whole, jobs};
use json::{JSON_VERSION, to_json};
use picture::picture;
use shown::Shown;
use text::{Style, summary, to_text};

/// Value of `--align`: a mode, or none and relative times.
#[derive(Clone, Copy, Debug)]
struct Align(Option<Mode>);

impl ValueEnum for Align {
    fn value_variants<'a>() -> &'a [Self] {
        use Mode::{Cubic, Linear, Nearest, Step, Time};
        &[
            Self(Some(Step)),
            Self(Some(Time)),
            Self(Some(Nearest)),
            Self(Some(Linear)),
            Self(Some(Cubic)),
            Self(None),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = "Times count from the start of each recording; then by step, exact time or linear";
        let relative = || Some(PossibleValue::new("relative").help(help));
        self.0.map_or_else(relative, |mode| mode.to_possible_value())
    }
}

const DIFF_EXAMPLES: &str = concat!(
    "\
Examples:
  percuss-read diff old.mcap new.mcap             # every bit
  percuss-read diff old.mcap new.mcap --peak-rel 1e-9
  percuss-read diff run.mcap exact.mcap --tol '/drag.*:rel=1e-6' \\
      --tol '/interface/*:peak_rel=0.004'
  percuss-read diff coarse.mcap fine.mcap --topic /interface/stress \\
      --align cubic --common --l2-rel 0.01
  percuss-read diff golden/ results/ --tolerances tol.toml --summary
  percuss-read diff golden.mcap new.mcap --bless  # accept the new one
  # with what was measured
  percuss-read diff measured.csv ball.mcap --rename load=force \\
      --align linear --common --time-offset fit --l2-rel 0.05
  # in continuous integration
  percuss-read diff golden/ results/ --junit report.xml --github
  percuss-read diff golden/ results/ --markdown >> \"$GITHUB_STEP_SUMMARY\"

",
    include_str!("../compare/tolerance.md"),
    "\
The file of --tolerances holds the same as [[tolerance]] \
tables: field = \"/drag.*\", abs = 1e-9, tube = { time = 0.01, value = 1e-3 }.

",
    include_str!("../compare/rules.md"),
    "
Exit status: 0 equal within tolerance, 1 different, 2 could not compare, 3 an input is damaged or partial: the sound \
part was compared."
);

/// Two recordings, or folders of them, number by number
#[derive(Debug, Args)]
#[command(after_help = DIFF_EXAMPLES)]
pub struct Diff {
    /// Reference, and one or more recordings (or folders) to compare with it; either may be a table
    #[arg(required = true, num_args = 2.., value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    sources: Sources,
    /// How messages are aligned [default: by step or exact time where they agree, else linear if there is a
    /// tolerance; relative if the recordings have no time in common]
    #[arg(long, value_enum)]
    align: Option<Align>,
    /// Tolerance, [PATTERN:]KEY=VALUE,...; may be repeated
    #[arg(long = "tol", value_name = "RULE")]
    tolerances: Vec<Rule>,
    /// File of tolerances (TOML); rules of the command line come first
    #[arg(long = "tolerances", value_name = "FILE")]
    tolerance_file: Option<PathBuf>,
    #[command(flatten)]
    for_all: Tolerance,
    /// Topics or topic.fields that are not compared; `*` stands for anything
    #[arg(long, value_name = "PATTERN", value_delimiter = ',')]
    ignore: Vec<String>,
    /// NaN is equal to any other NaN, whatever their bits
    #[arg(long)]
    nan_equal: bool,
    /// NaN stands for no value: such elements of either recording are not compared
    #[arg(long, conflicts_with = "nan_equal")]
    skip_nan: bool,
    /// Also say which fields are equal, and which rule applied to each
    #[arg(long)]
    explain: bool,
    /// One line per channel
    #[arg(long, conflicts_with_all = ["json", "explain"])]
    summary: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print a table for a pull request, in Markdown
    #[arg(long, conflicts_with_all = ["json", "explain", "summary"])]
    markdown: bool,
    /// Also print annotations of GitHub Actions
    #[arg(long, conflicts_with = "json")]
    github: bool,
    /// Write a report in the form of JUnit, a case for every channel
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Draw the fields that differ most, both curves and their difference (SVG, PNG or PDF)
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Write the difference, new minus reference, as a recording
    #[arg(long, value_name = "FILE")]
    write_diff: Option<PathBuf>,
    /// Put the new recording in the place of the reference; of folders, also recordings that the reference has not
    #[arg(long)]
    bless: bool,
    /// Overwrite existing output files
    #[arg(long)]
    force: bool,
}

/// What all comparisons together found.
#[derive(Default)]
struct Outcome {
    worst: Verdict,
    lossy: bool,
    documents: Vec<serde_json::Value>,
    suites: Vec<Suite>,
    /// For every rule, whether it fits anything in any of the recordings.
    fitting: Vec<bool>,
}

impl Verb for Diff {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        // status 1 says that recordings differ: whatever fails here is another
        self.compare_all(limits).map_err(Failure::into_usage)
    }
}

impl Diff {
    fn compare_all(&self, limits: Limits) -> Result<Exit, Failure> {
        let options = self.options()?;
        let jobs = jobs(&self.files).map_err(|error| Failure::Usage(error.to_string()))?;
        self.check_outputs(&jobs)?;
        if jobs.is_empty() {
            say("error: nothing was compared: there is no recording (*.mcap) in these folders");
        } else if jobs.iter().all(|job| job.a.is_none() || job.b.is_none()) {
            say("error: nothing was compared: no recording is in both folders by the same name");
        }
        let worst = if jobs.is_empty() { Verdict::NotCompared } else { Verdict::Equal };
        let fitting = vec![false; options.rules.rules.len()];
        let mut result = Outcome { worst, fitting, ..Outcome::default() };
        let mut left = jobs.len();
        for job in &jobs {
            left -= 1;
            match (&job.a, &job.b) {
                (Some(a), Some(b)) => self.compare(a, b, &options, limits, &mut result)?,
                _ => {
                    self.report_missing(job, &mut result)?;
                    if !self.accept_missing(job, limits)? {
                        result.worst = Verdict::Different;
                    }
                }
            }
            if self.options.fail_fast && result.worst == Verdict::Different {
                break;
            }
        }
        report_idle(&options.rules, &result.fitting, &jobs);
        self.conclude(result, jobs.len() - left, left)
    }

    /// Refuses outputs that are inputs, that exist, or that do not go with what is asked for.
    fn check_outputs(&self, jobs: &[Job]) -> Result<(), Failure> {
        let outputs = [&self.plot, &self.write_diff];
        for output in outputs.into_iter().chain([&self.junit]).flatten() {
            refuse_inputs(output, jobs.iter().flat_map(|job| job.a.iter().chain(&job.b)))?;
            OutputError::refuse_existing(Some(output), self.force)?;
        }
        if jobs.len() > 1 && outputs.iter().any(|output| output.is_some()) {
            return Err(Failure::Usage("--plot and --write-diff need just two recordings".into()));
        }
        if self.bless && self.files.len() > 2 {
            return Err(Failure::Usage("--bless needs one reference and one new recording".into()));
        }
        self.plot.as_deref().map(medium).transpose()?;
        if let Some(path) = &self.write_diff {
            by_extension(path, &[("mcap", ())], Some(()))?;
        }
        Ok(())
    }

    /// Compares two recordings and shows what came out.
    fn compare(
        &self,
        a: &Path,
        b: &Path,
        options: &Options,
        limits: Limits,
        result: &mut Outcome,
    ) -> Result<(), Failure> {
        let written = self.write_diff.as_deref().map(|path| (path, self.force));
        let sources = self.sources(a, b)?;
        let comparison = diff(a, b, options, limits, &sources, written)?;
        self.report_unwritten(&comparison);
        result.fitting.iter_mut().zip(&comparison.fitting).for_each(|(any, fits)| *any |= fits);
        let shown = Shown::of(a, b, &comparison);
        let style = Style { colour: has_colour(), explain: self.explain };
        result.suites.push(Suite::of(&shown));
        if self.json {
            result.documents.push(to_json(a, b, &comparison));
        } else if self.summary {
            if_read(print_painted(&summary(&shown, style)))?;
        } else if !self.markdown {
            if_read(print_painted(&to_text(&shown, style)))?;
        }
        self.report_gaps(a, b, &comparison);
        self.draw(a, b, &comparison, limits)?;
        if self.bless {
            return accept(a, b, &comparison);
        }
        result.worst = result.worst.max(comparison.verdict());
        result.lossy |= comparison.is_lossy();
        Ok(())
    }

    /// Says how all comparisons ended.
    ///
    /// * `left`: comparisons that were not made, after the first difference (--fail-fast)
    fn conclude(&self, result: Outcome, jobs: usize, left: usize) -> Result<Exit, Failure> {
        let Outcome { worst, lossy, documents, suites, .. } = result;
        if let Some(path) = &self.junit {
            write(Some(path), self.force, junit(&suites).as_bytes())?;
        }
        if self.json {
            let document = json!({
                "version": JSON_VERSION,
                "verdict": worst.max(Verdict::Within),
                "comparisons": documents,
                "not_made": left,
            });
            if_read(print_document(&format!("{document:#}\n")))?;
        } else if self.markdown {
            if_read(print(&markdown(&suites)))?;
        } else if jobs + left != 1 {
            let left = match left {
                0 => String::new(),
                left => format!("; {left} more were not made (--fail-fast)"),
            };
            if_read(print(&format!("{jobs} comparisons: {}{left}\n", worst.name())))?;
        }
        if self.github {
            if_read(print_painted(&github(&suites)))?;
        }
        Ok(match (lossy, worst) {
            (_, Verdict::NotCompared) => Exit::NoAnswer,
            (true, _) => Exit::Loss,
            (false, Verdict::Different) => Exit::No,
            (false, _) => Exit::Done,
        })
    }

    /// How two files are opened.
    fn sources(&self, a: &Path, b: &Path) -> Result<Sources, Failure> {
        let files = [a.to_owned(), b.to_owned()];
        self.sources.among(files.iter()).map_err(Failure::Usage)
    }

    fn options(&self) -> Result<Options, Failure> {
        let usage = |error: String| Failure::Usage(error);
        let mut rules = Rules::default();
        for pattern in &self.ignore {
            let tolerance = Tolerance { field: pattern.clone(), ignore: true, ..Tolerance::default() };
            rules.rules.push(Rule::new(tolerance, format!("--ignore {pattern}")).map_err(usage)?);
        }
        rules.rules.extend(self.tolerances.iter().cloned());
        if let Some(path) = &self.tolerance_file {
            let text = std::fs::read_to_string(path)
                .map_err(|error| usage(format!("cannot read `{}`: {error}", path.display())))?;
            rules.add_file(&path.to_string_lossy(), &text).map_err(usage)?;
        }
        if self.for_all != Tolerance::default() {
            let tolerance = Tolerance { field: "*".into(), ..self.for_all.clone() };
            rules.rules.push(Rule::new(tolerance, "flags".into()).map_err(usage)?);
        }
        Ok(Options {
            mode: self.align.and_then(|Align(mode)| mode),
            relative: matches!(self.align, Some(Align(None))),
            rules,
            nan: match (self.nan_equal, self.skip_nan) {
                (_, true) => NanRule::Skipped,
                (true, _) => NanRule::EqualsItself,
                _ => NanRule::SameBits,
            },
            ..self.options.clone()
        })
    }

    /// A recording that only one of two folders has.
    fn report_missing(&self, job: &Job, result: &mut Outcome) -> Result<(), Failure> {
        let (path, what) = match (&job.a, &job.b) {
            (Some(a), _) => (a, "missing from the new folder"),
            (None, Some(b)) => (b, "only in the new folder"),
            (None, None) => return Ok(()),
        };
        result.suites.push(Suite::missing(job, what));
        if self.markdown {
            return Ok(());
        }
        if self.json {
            result.documents.push(json!({ "a": job.a, "b": job.b, "verdict": "different", "text": what }));
            return Ok(());
        }
        if_read(print(&format!("{}: {what}\n", printable(&path.to_string_lossy()))))
    }

    /// Channels that are not in the recording of differences, because their messages do not go together one by one.
    fn report_unwritten(&self, comparison: &Comparison) {
        let Some(path) = &self.write_diff else { return };
        for channel in comparison.channels.iter().filter(|channel| channel.is_between()) {
            say(&format!("`{}` was interpolated in time and is not in `{}`", channel.topic, path.display()));
        }
    }

    /// What could not be compared, and how times were aligned if that was chosen by itself.
    fn report_gaps(&self, a: &Path, b: &Path, comparison: &Comparison) {
        let (a, b) = (a.display(), b.display());
        for gap in &comparison.gaps {
            say(&format!("error: `{a}` and `{b}`: {gap}"));
        }
        let is_relative = comparison.channels.iter().any(|channel| channel.starts.is_some());
        if is_relative && self.align.is_none() {
            say(&format!(
                "`{a}` and `{b}` have no time in common: times count from the start of each (--align relative)"
            ));
        }
    }

    fn draw(&self, a: &Path, b: &Path, comparison: &Comparison, limits: Limits) -> Result<(), Failure> {
        let Some(output) = &self.plot else { return Ok(()) };
        let unwritten = |why: &str| say(&format!("`{}` is not written: {why}", output.display()));
        if comparison.converted.is_some() {
            unwritten("the recordings are in different units");
        } else if let Some(picture) =
            picture(a, b, comparison, limits, &self.sources(a, b)?, medium(output)?)?
        {
            write(Some(output), self.force, &picture)?;
        } else {
            unwritten("no numbers differ");
        }
        Ok(())
    }

    /// Takes over a recording that only the new folder has; false if the folders still differ in it.
    fn accept_missing(&self, job: &Job, limits: Limits) -> Result<bool, Failure> {
        let (true, [first, other]) = (self.bless, self.files.as_slice()) else { return Ok(false) };
        let Some((new, name)) = job.b.as_ref().and_then(|new| Some((new, new.strip_prefix(other).ok()?)))
        else {
            if let Some(path) = &job.a {
                say(&format!("`{}` stays: it is missing from `{}`", path.display(), other.display()));
            }
            return Ok(false);
        };
        if !is_whole(new, limits)? {
            let text = format!(
                "`{}` is damaged or partial and is not accepted as a reference (--bless)",
                new.display()
            );
            return Err(Failure::Usage(text));
        }
        let reference = first.join(name);
        bless(&reference, new)?;
        say(&format!("`{}` is new, it is `{}`", reference.display(), new.display()));
        Ok(true)
    }
}

/// Takes over a new recording.
fn accept(a: &Path, b: &Path, comparison: &Comparison) -> Result<(), Failure> {
    if comparison.is_lossy() {
        let text = "a damaged or partial recording is not accepted as a reference (--bless)";
        return Err(Failure::Usage(text.into()));
    }
    bless(a, b)?;
    say(&format!("`{}` is now `{}`", a.display(), b.display()));
    Ok(())
}

/// Reports rules that fit nothing in any of the recordings: perhaps a name is misspelled.
fn report_idle(rules: &Rules, fitting: &[bool], jobs: &[Job]) {
    if !jobs.iter().any(|job| job.a.is_some() && job.b.is_some()) {
        return;
    }
    for (rule, _) in rules.rules.iter().zip(fitting).filter(|(_, fits)| !**fits) {
        let (pattern, origin) = (rule.fields.text(), &rule.origin);
        say(&format!("warning: the tolerance for `{pattern}` ({origin}) fits no topic or field"));
    }
}
