//! `percuss study`: a case on meshes refined by two, with orders and error bars.

use std::path::{Path, PathBuf};

use clap::Args;
use percuss_output::{OutputError, text::printable};

use super::{
    CaseArguments, CliError, Exit,
    output::{ThreadArguments, refuse_inputs},
    print,
    progress::{LINE_INTERVAL, Progress},
};
use crate::{
    advice::{Finding, codes},
    case::Case,
    measuring,
    study::{Plan, Study, default_measures, on_meshes, study},
    units::{Dimension, Units},
};

const EXAMPLES: &str = "\
Examples:
  percuss study fig5 --set mesh.cells=50  # 50, 100 and 200 cells
  percuss study fig2-prescribed --set mesh.cells=50 --refine 8 --times 1,3,5 \\
      --probes 0,0.2
  percuss study fig8-m5 --refine 4 -o fig8-m5.json
  percuss study ball --measures peak_force,contact_duration,restitution
  percuss study fig4 -o fig4.csv
  percuss-read plot fig4.csv --x cells --y relative_error --by quantity \\
      --log xy

The table of -o has a row for each quantity and mesh, with the subjects of its warnings. Its `relative_error` is that of the value against the closed \
form, without one against the extrapolated value, without an order against the finest; it is empty where it may be \
rounding.

The order is observed on the last three meshes, the extrapolated value is Richardson's. The error bar, about the \
finest value, is 1.25 times the remaining error at that order, at most the first; without an order (none between 0.5 \
and 2.5) it is three times the largest difference. The stress at r = 0 under the waves of an edge and the stress at \
an edge do not converge.";

/// Runs a case on meshes refined by two and reports observed orders, extrapolated values and error bars.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct StudyArguments {
    #[command(flatten)]
    case: CaseArguments,
    /// Largest refinement, a power of two: 4 computes the cells of the case, twice and four times as many
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = refinement)]
    refine: usize,
    /// Times of drag, velocity and stress; in a physical case with their unit, 20us [default: 0.23, 0.48, 0.73, 0.98 of the run, away from arrivals of fronts]
    #[arg(long, value_name = "T", value_delimiter = ',')]
    times: Vec<String>,
    /// Radii of the stress; in a physical case with their unit [default: the probes of the case]
    #[arg(long, value_name = "R", value_delimiter = ',')]
    probes: Vec<String>,
    /// What is measured of the whole run, as `percuss-read summary` names it [default: peak_force, impulse, contact_duration, contact_radius, restitution, restitution_mesh_corrected]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    measures: Vec<String>,
    #[command(flatten)]
    threads: ThreadArguments,
    /// Also write the results, as .csv or .json
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
}

/// Largest refinement: time grows with its cube.
const MAX_REFINE: usize = 64;

fn refinement(text: &str) -> Result<usize, String> {
    let factor = text.parse().ok().filter(|n: &usize| n.is_power_of_two() && (4..=MAX_REFINE).contains(n));
    factor.ok_or_else(|| format!("a power of two from 4 to {MAX_REFINE} is expected"))
}

impl StudyArguments {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let output =
            self.output.as_deref().map(|path| Ok::<_, CliError>((path, format(path)?))).transpose()?;
        OutputError::refuse_existing(self.output.as_deref(), self.force)?;
        let cases = self.cases()?;
        refuse_inputs(self.output.as_deref(), &cases[0])?;
        let plan = self.plan(&cases[0])?;
        let pool = self.threads.pool()?;
        let finest = cases.last().expect("there are cases");
        let mut progress = Progress::of_run(finest, finest.sizes.steps, self.quiet, LINE_INTERVAL);
        let cells: Vec<String> = cases.iter().map(|case| case.mesh.density().1.to_string()).collect();
        progress.say(&format!(
            "{}: {}, on {} cells",
            printable(&self.case.case),
            printable(&finest.title),
            cells.join(", ")
        ));
        let result = pool.install(|| study(&cases, &plan, |step| progress.advance(step)));
        progress.end();
        let study = result?;
        let is_found = |name: &&String| study.quantities.iter().any(|quantity| quantity.name == **name);
        for name in self.measures.iter().filter(|name| !is_found(name)) {
            progress.say(&format!("no mesh has a value of `{name}`"));
        }
        let exit = print(&(table(finest, &study) + &changes(&cases) + &warned(&study)))?;
        if let Some((path, format)) = output {
            percuss_output::write(path, format(finest, &study).as_bytes(), self.force)?;
        }
        Ok(exit)
    }

    fn cases(&self) -> Result<Vec<Case>, CliError> {
        let case = self.case.load_single()?;
        let levels: Vec<usize> =
            (0..=self.refine.ilog2()).map(|level| case.mesh.density().1 << level).collect();
        Ok(on_meshes(&case, &levels)?)
    }

    fn plan(&self, case: &Case) -> Result<Plan, CliError> {
        let end = case.run.end_time;
        let read = |option: &str, texts: &[String], dimension, most: f64, bounds: &str| {
            let read = |text: &String| {
                let number = case.read_number(dimension, text);
                let number = number.map_err(|error| CliError::Usage(format!("{option} {text}: {error}")))?;
                let fits = number >= 0.0 && number <= most && number.is_finite();
                fits.then_some(number).ok_or_else(|| CliError::Usage(format!("{option} {text}: {bounds}")))
            };
            texts.iter().map(read).collect::<Result<Vec<f64>, _>>()
        };
        let span = format!("the run is from 0 to {}", case.units().time.full_text(end));
        let times = read("--times", &self.times, Dimension::Time, end, &span)?;
        let radius = "a radius is not negative";
        let probes = read("--probes", &self.probes, Dimension::Length, f64::INFINITY, radius)?;
        let spread = || [0.23, 0.48, 0.73, 0.98].map(|share| (share * end * 1e6).round() / 1e6).to_vec();
        let known = if self.measures.is_empty() { Vec::new() } else { names(case) };
        if let Some(unknown) = self.measures.iter().find(|name| !known.contains(name)) {
            let text = format!("--measures {unknown}: it is one of {}", known.join(", "));
            return Err(CliError::Usage(text));
        }
        Ok(Plan {
            measures: if self.measures.is_empty() { default_measures(case) } else { self.measures.clone() },
            times: if times.is_empty() { spread() } else { times },
            probes: if probes.is_empty() { case.record.probes.clone() } else { probes },
        })
    }
}

/// Writes a study as the text of a file.
type Format = fn(&Case, &Study) -> String;

fn format(path: &Path) -> Result<Format, CliError> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv") => Ok(csv),
        Some("json") => Ok(json),
        _ => Err(CliError::Usage(format!("-o {}: name it .csv or .json", path.display()))),
    }
}

fn json(case: &Case, study: &Study) -> String {
    let value = serde_json::json!({
        "version": 1,
        "title": case.title,
        "levels": study.levels,
        "closed_form": study.closed_form,
        "quantities": study.quantities,
    });
    format!("{value:#}\n")
}

/// A row for each quantity and mesh.
fn csv(case: &Case, study: &Study) -> String {
    let Units { length, time, .. } = case.units();
    let head = format!(
        "quantity,unit,cells,dr [{}],dt [{}],value,relative_error,order,extrapolated,error_bar,exact,warnings",
        length.name, time.name
    );
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
    let mut rows = csv::Writer::from_writer(Vec::new());
    rows.write_record(head.split(',')).expect("a Vec grows");
    for quantity in &study.quantities {
        let limits = [quantity.order, quantity.extrapolated, quantity.error_bar, quantity.exact];
        for (level, value) in study.levels.iter().zip(&quantity.values) {
            let error = value.and_then(|value| quantity.relative_error(value));
            let numbers = [Some(level.dr), Some(level.dt), *value, error].into_iter().chain(limits);
            let start = [quantity.name.clone(), quantity.unit.to_string(), level.cells.to_string()];
            let row = start.into_iter().chain(numbers.map(number)).chain([codes(&level.warnings).join(";")]);
            rows.write_record(row.collect::<Vec<_>>()).expect("a Vec grows");
        }
    }
    String::from_utf8(rows.into_inner().expect("a Vec grows")).expect("rows are text")
}

/// The warnings of all meshes, each in the words of the finest mesh that has it.
fn warned(study: &Study) -> String {
    let all = || study.levels.iter().flat_map(|level| &level.warnings);
    let mut text = String::new();
    for code in codes(all()) {
        let is_it = |finding: &Finding| finding.code == code;
        let levels = study.levels.iter().filter(|level| level.warnings.iter().any(is_it));
        let cells: Vec<String> = levels.map(|level| level.cells.to_string()).collect();
        let finest = all().rfind(|finding| is_it(finding)).expect("it is the code of one");
        text += &format!("warning, {} cells: {}\n", cells.join(", "), printable(&finest.text));
    }
    text
}

/// What meshes change of layers.
fn changes(cases: &[Case]) -> String {
    /// Changes below it are rounding.
    const ROUNDING: f64 = 1e-9;
    let changes = cases.iter().flat_map(|case| &case.sizes.layers).map(|rows| rows.speed_change.abs());
    let largest = changes.fold(0.0, f64::max);
    if largest < ROUNDING {
        return String::new();
    }
    format!(
        "layers: wave speeds are changed by up to {:.3} %, on every mesh differently: orders are disturbed by it\n",
        100.0 * largest
    )
}

fn table(case: &Case, study: &Study) -> String {
    let exact = study.closed_form.is_some();
    let mut head: Vec<String> = vec!["quantity".into()];
    head.extend(study.levels.iter().map(|level| format!("{} cells", level.cells)));
    head.extend(["order", "extrapolated", "error bar"].map(str::to_owned));
    if exact {
        head.extend(["exact", "error", "order"].map(str::to_owned));
    }
    let is_plain = case.scales.is_none();
    let text = |value| if is_plain { format!("{value:.6}") } else { format!("{value:.5e}") };
    let number = |value: Option<f64>| value.map_or("-".to_owned(), text);
    let short = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2e}"));
    let order = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
    let mut rows = vec![head];
    for quantity in &study.quantities {
        let mut row = vec![format!("{} [{}]", quantity.name, quantity.unit)];
        row.extend(quantity.values.iter().map(|value| number(*value)));
        row.extend([order(quantity.order), number(quantity.extrapolated), short(quantity.error_bar)]);
        if exact {
            let error = quantity.errors.as_ref().and_then(|errors| errors.last().copied());
            row.extend([number(quantity.exact), short(error), order(quantity.exact_order)]);
        }
        rows.push(row);
    }
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let (first, rest) = (format!("{:<1$}", row[0], widths[0]), row.iter().zip(&widths).skip(1));
        text += &rest.fold(first, |line, (cell, width)| line + &format!("  {cell:>width$}"));
        text.push('\n');
    }
    if let Some(form) = study.closed_form {
        text.push_str(&format!("exact: closed form `{form}`, where it holds\n"));
    }
    text
}

/// Names of all that is measured of a case, in the order of the columns.
pub(super) fn names(case: &Case) -> Vec<String> {
    measuring::nothing(case.sizes.interfaces()).into_iter().map(|measure| measure.name.into_owned()).collect()
}
