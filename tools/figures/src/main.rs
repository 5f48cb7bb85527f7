//! Every figure of the paper, computed, drawn and compared with what the paper states.
//!
//! One command runs the built-in cases with the command line of percuss, keeps their recordings, reads them with the
//! reader, draws every figure as SVG and PNG and writes one page, in Markdown and HTML; a second one that compares the
//! simplified with the full theory, one of layered targets, one of a sweep, one of balls against Hertz, and one of
//! indenters that give.
//!
//! | Module | Owns |
//! |---|---|
//! | `lab` | running cases and reading their recordings |
//! | `paper` | the figures, one file per kind of indenter, with the paper's statements |
//! | `noise` | the share of mesh noise in a curve |
//! | `theories` | the simplified against the full theory |
//! | `layers` | layered targets |
//! | `sweeps` | a sweep over mass and material |
//! | `hertz` | balls on half-spaces, against Hertz with radiation |
//! | `bodies` | indenters that give: bars against rays, a ball against Hertz |
//! | `figure`, `page` | the parts of a figure; the pages |

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use percuss_picture::{Medium, draw_image};

use crate::{figure::Figure, lab::Lab, page::Page};

mod bodies;
#[cfg_attr(not(test), expect(dead_code, reason = "figures show some of them"))]
#[path = "../../../tests/closed_forms/mod.rs"]
mod closed_forms;
mod experiments;
mod figure;
mod hertz;
mod lab;
mod layers;
mod noise;
mod page;
mod paper;
mod sweeps;
mod theories;

/// Computes every figure of the paper and writes a page that compares it with what the paper states.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "\
Examples:
  percuss-figures                     into the folder `figures`: index.html, index.md, pictures, recordings
  percuss-figures --only theories     the simplified against the full theory alone: theories.html, theories.md
  percuss-figures --only layers       layered targets alone: layers.html, layers.md
  percuss-figures --only sweeps       a ball on plates of five materials: sweeps.html, sweeps.md
  percuss-figures --only hertz        balls on half-spaces, against Hertz with radiation: hertz.html, hertz.md
  percuss-figures --only bodies       indenters that give, bars and a ball: bodies.html, bodies.md
  percuss-figures --only experiments  beside what others measured and computed: experiments.html, experiments.md
  percuss-figures --only paper --quick -o draft
  percuss-figures -o /tmp/page --force"
)]
struct Arguments {
    /// Folder to write; must not exist
    #[arg(short, long, value_name = "FOLDER", default_value = "figures")]
    output: PathBuf,
    /// Write into an existing folder
    #[arg(long)]
    force: bool,
    /// Write this page alone
    #[arg(long, value_enum)]
    only: Option<Which>,
    /// Take meshes a quarter as fine, for Hertz, bodies and experiments half: a look at the pages of the paper, of the sweep, of Hertz and of bodies in a minute each, with larger errors
    #[arg(long)]
    quick: bool,
}

/// A page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    /// The figures of the paper
    Paper,
    /// The simplified against the full theory
    Theories,
    /// Layered targets
    Layers,
    /// A ball on plates of five materials, over three decades of mass
    Sweeps,
    /// Balls on half-spaces, against Hertz with the energy that waves carry away
    Hertz,
    /// Indenters that give: bars against rays and one-dimensional theory, a ball against Hertz
    Bodies,
    /// Experiments: balls, plates and bars beside what others measured and computed
    Experiments,
}

/// Why there is no page.
#[derive(Debug)]
struct Failure(String);

impl<E: std::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

/// Shows the current run.
struct Progress {
    bar: ProgressBar,
    start: Instant,
}

impl Progress {
    fn new() -> Self {
        let style = ProgressStyle::with_template("{spinner} {pos} runs, {elapsed}: {msg}");
        Self { bar: ProgressBar::new_spinner().with_style(style.expect("a constant")), start: Instant::now() }
    }

    fn next(&self, what: &str) {
        self.bar.inc(1);
        if self.bar.is_hidden() {
            eprintln!("{:5.1} s  {what}", self.start.elapsed().as_secs_f64());
        } else {
            self.bar.set_message(what.to_owned());
            self.bar.tick();
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(text)) => {
            eprintln!("error: {text}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let folder = &arguments.output;
    if folder.exists() && !arguments.force {
        let text = format!("`{}` exists; choose another folder with -o, or add --force", folder.display());
        return Err(Failure(text));
    }
    let progress = Progress::new();
    let mut index = None;
    let is_asked = |page: Which| arguments.only.is_none_or(|only| only == page);
    if is_asked(Which::Paper) {
        let recordings = folder.join("recordings");
        fs::create_dir_all(&recordings)?;
        let lab = Lab::new(recordings, if arguments.quick { 4 } else { 1 }, &progress);
        let figures = paper::figures(&lab)?;
        let tables = vec![paper::closed_forms(&progress)?, noise::table(&lab)?];
        index = Some(write("index", &Page::of_the_paper(figures, tables), folder, &progress)?);
    }
    if is_asked(Which::Theories) {
        let path = write("theories", &theories::page(&progress)?, folder, &progress)?;
        index.get_or_insert(path);
    }
    if is_asked(Which::Layers) {
        let path = write("layers", &layers::page(&progress)?, folder, &progress)?;
        index.get_or_insert(path);
    }
    if is_asked(Which::Sweeps) {
        let page = sweeps::page(&progress, if arguments.quick { 4 } else { 1 })?;
        let path = write("sweeps", &page, folder, &progress)?;
        index.get_or_insert(path);
    }
    if is_asked(Which::Hertz) {
        let page = hertz::page(&progress, if arguments.quick { 2 } else { 1 })?;
        let path = write("hertz", &page, folder, &progress)?;
        index.get_or_insert(path);
    }
    if is_asked(Which::Bodies) {
        let page = bodies::page(&progress, if arguments.quick { 2 } else { 1 })?;
        let path = write("bodies", &page, folder, &progress)?;
        index.get_or_insert(path);
    }
    if is_asked(Which::Experiments) {
        let recordings = folder.join("recordings");
        fs::create_dir_all(&recordings)?;
        let page = experiments::page(&recordings, &progress, if arguments.quick { 2 } else { 1 })?;
        let path = write("experiments", &page, folder, &progress)?;
        index.get_or_insert(path);
    }
    progress.bar.finish_and_clear();
    if let Some(path) = index {
        println!("{}", path.display());
    }
    Ok(())
}

/// Writes a page and its pictures; gives the path of its HTML.
fn write(name: &str, page: &Page, folder: &Path, progress: &Progress) -> Result<PathBuf, Failure> {
    fs::create_dir_all(folder)?;
    for figure in &page.figures {
        progress.next(&format!("drawing {}", figure.heading()));
        draw(figure, folder)?;
    }
    fs::write(folder.join(format!("{name}.md")), page::markdown(page))?;
    let path = folder.join(format!("{name}.html"));
    fs::write(&path, page::html(page))?;
    Ok(path)
}

fn draw(figure: &Figure, folder: &Path) -> Result<(), Failure> {
    for (medium, extension) in [(Medium::Svg, "svg"), (Medium::Png, "png")] {
        let picture = match &figure.image {
            Some((image, range)) => draw_image(image, Some(*range), medium),
            None => percuss_picture::draw(&figure.panels, medium),
        };
        let picture = picture.map_err(|text| Failure(format!("{}: {text}", figure.heading())))?;
        fs::write(folder.join(format!("fig{}.{extension}", figure.id)), picture)?;
    }
    Ok(())
}
