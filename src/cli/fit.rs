//! `percuss fit`: values of keys with which a case gives what was measured.

use std::{fmt::Display, fs, path::PathBuf};

use clap::Args;
use percuss_output::{
    number::whole,
    text::{printable, say},
};
use percuss_table::measures::Measure;

use super::{CaseArguments, CliError, Exit, default_output, output::ThreadArguments, print};
use crate::{
    case::{Case, quantity_si, split_number},
    fit::{Fit, Found, Goal, Series, Trial, fit},
    sweep::spec::{Range, Vary},
    units::Dimension,
};

const EXAMPLES: &str = "\
Examples:
  # how thick is the plate, if contact lasts 95 µs?
  percuss fit ball --vary \"target.thickness=5 mm:15 mm\" \\
      --to \"contact_duration=95 us +- 1 us\"
  # E of the target, from a measured force
  percuss fit ball.toml --to measured.csv --topic /drag \\
      --vary \"target.material.youngs_modulus=2 GPa:8 GPa\"

A measured curve is a CSV file with two columns, time and number, each with its unit in the heading: t [us],F [N]. Each run is a line of runs.csv \
in the folder of -o, the result is fit.json.";

/// Finds values of keys with which a case gives what was measured, by least squares.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FitArguments {
    #[command(flatten)]
    case: CaseArguments,
    /// A key and the range of its values, KEY=FROM:TO or KEY=FROM:TO:log
    #[arg(long, value_name = "KEY=FROM:TO", required = true)]
    vary: Vec<String>,
    /// What is measured: MEASURE=VALUE, as `percuss-read summary` names it, with its error if it is known, `95 us +- 1 us`; or a CSV file
    #[arg(long, value_name = "GOAL", required = true)]
    to: Vec<String>,
    /// What the CSV file of --to is
    #[arg(long, value_name = "TOPIC", default_value = "/drag", value_parser = ["/drag", "/velocity"])]
    topic: String,
    /// Largest number of runs of the search; errors take two more for each key
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = whole(2..=10_000_u64))]
    runs: u64,
    /// New folder for runs.csv and fit.json [default: name of the case, -fit]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    #[command(flatten)]
    threads: ThreadArguments,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// Print errors and the result only
    #[arg(short, long)]
    quiet: bool,
}

impl FitArguments {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let base = self.case.load_single()?.vary().set("record.frames", 0).build()?;
        let ranges = self.vary.iter().map(|text| Vary::parse(text).range()).collect::<Result<Vec<_>, _>>()?;
        let goals = self.to.iter().map(|text| self.goal(&base, text)).collect::<Result<Vec<_>, _>>()?;
        let folder = self.output.clone().unwrap_or_else(|| default_output(&self.case.case, "-fit"));
        if folder.exists() {
            let text = format!("`{}` is there; choose another folder with -o", folder.display());
            return Err(CliError::Usage(text));
        }
        let wrong = |error: &dyn Display| CliError::system(format!("`{}`", folder.display()), error);
        fs::create_dir_all(&folder).map_err(|error| wrong(&error))?;
        let mut rows = csv::Writer::from_path(folder.join("runs.csv")).map_err(|error| wrong(&error))?;
        let mut written = Ok(());
        let mut watch = |number: usize, trial: &Trial, measures: &[Measure]| {
            if !self.quiet {
                say(&printable(&line(number, &ranges, trial)));
            }
            if written.is_ok() {
                written = row(&mut rows, number, &ranges, trial, measures);
            }
        };
        let pool = self.threads.pool()?;
        let found = pool.install(|| fit(&base, &ranges, &goals, self.runs as usize, &mut watch));
        written.map_err(|error| wrong(&error))?;
        let fit = found?;
        let json = format!("{:#}\n", serde_json::json!({ "version": 1, "title": base.title, "fit": fit }));
        fs::write(folder.join("fit.json"), &json).map_err(|error| wrong(&error))?;
        print(&if self.json { json } else { text(&fit) })
    }

    fn goal(&self, base: &Case, text: &str) -> Result<Goal, CliError> {
        let usage = |what: String| CliError::Usage(format!("--to {text}: {what}"));
        let Some((name, value)) = text.split_once('=') else {
            let units = base.units();
            let (series, dimension, unit) = match self.topic.as_str() {
                "/velocity" => (Series::Velocity, Dimension::Speed, units.speed),
                _ => (Series::Force, Dimension::Force, units.force),
            };
            let points = base.read_table(text.as_ref(), [Dimension::Time, dimension]).map_err(usage)?;
            let points: Vec<_> = points.iter().map(|[t, y]| [units.time.of(*t), unit.of(*y)]).collect();
            if points.len() < 2 || points.windows(2).any(|pair| pair[1][0] <= pair[0][0]) {
                return Err(usage("times increase from row to row, and there are two rows or more".into()));
            }
            return Ok(Goal::Curve { series, points });
        };
        let name = name.trim();
        let known = super::study::names(base);
        if !known.iter().any(|known| known == name) {
            return Err(usage(format!("`{name}` is no measure; they are {}", known.join(", "))));
        }
        let (value, error) = match value.split_once("+-").or_else(|| value.split_once('±')) {
            Some((value, error)) => (value, Some(error)),
            None => (value, None),
        };
        let number = |text: &str| {
            let text = text.trim();
            let plain = split_number(text).filter(|(_, unit)| unit.is_empty());
            let number = match plain {
                Some((number, _)) => number.parse().ok(),
                None => quantity_si(text, base.geometry).map(|(si, _)| si),
            };
            number.ok_or_else(|| usage(format!("`{text}` is no number with a unit")))
        };
        let error = error.map(number).transpose()?;
        if error.is_some_and(|error| error <= 0.0) {
            return Err(usage("an error is larger than 0".into()));
        }
        let value = number(value)?;
        if value == 0.0 && error.is_none() {
            return Err(usage("a value of 0 needs its error, as `0 +- 0.1`".into()));
        }
        Ok(Goal::Measure { name: name.into(), value, error })
    }
}

fn line(number: usize, ranges: &[(String, Range)], trial: &Trial) -> String {
    let values = ranges.iter().zip(&trial.values).map(|((key, _), value)| format!("{key} = {value}"));
    format!("run {number}: {}, misfit {:.4e}", values.collect::<Vec<_>>().join(", "), trial.misfit)
}

/// Writes a run as a row, behind the heading of the first one.
fn row(
    rows: &mut csv::Writer<fs::File>,
    number: usize,
    ranges: &[(String, Range)],
    trial: &Trial,
    measures: &[Measure],
) -> csv::Result<()> {
    let names = measures.iter().map(|measure| measure.name.as_ref());
    if number == 1 {
        let keys = ranges.iter().map(|(key, _)| key.as_str());
        rows.write_record(["run"].into_iter().chain(keys).chain(["misfit"]).chain(names))?;
    }
    let known =
        measures.iter().map(|measure| measure.value.map_or_else(String::new, |value| format!("{value:?}")));
    let start = [number.to_string()].into_iter().chain(trial.values.iter().cloned());
    rows.write_record(start.chain([format!("{:?}", trial.misfit)]).chain(known))?;
    Ok(rows.flush()?)
}

fn text(fit: &Fit) -> String {
    let mut text = String::new();
    for Found { key, value, error, unit, at_end } in &fit.found {
        let error = match error {
            Some(error) => format!(" ± {error:.4}"),
            None => ", error not known: as many keys as numbers, and these have no errors".into(),
        };
        let end = if *at_end { "; at the end of its range, which may be too narrow" } else { "" };
        text += &format!("{key} = {value:.4} {unit}{error}{end}\n");
    }
    text += &format!("misfit {:.3e}, {} runs\n", fit.misfit, fit.runs);
    text.extend(fit.findings.iter().map(|finding| format!("warning: {}\n", finding.text)));
    text
}
