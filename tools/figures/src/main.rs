//! Every figure of the paper, computed, drawn and compared with what the paper states.
//!
//! One command runs the built-in cases with the command line of percuss, keeps their recordings, reads them with the
//! reader, draws every figure as SVG and PNG and writes one page, in Markdown and HTML.
//!
//! | Module | Owns |
//! |---|---|
//! | `lab` | running cases and reading their recordings |
//! | `paper` | the figures, one file per kind of indenter, with the paper's statements |
//! | `noise` | the share of mesh noise in a curve |
//! | `figure`, `page` | the parts of a figure; the page |

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use percuss_picture::Medium;

use crate::{figure::Figure, lab::Lab};

mod figure;
mod lab;
mod noise;
mod page;
mod paper;

/// Computes every figure of the paper and writes a page that compares it with what the paper states.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "\
Examples:
  percuss-figures                     into the folder `figures`: index.html, index.md, pictures, recordings
  percuss-figures -o /tmp/page --force"
)]
struct Arguments {
    /// Folder to write; must not exist
    #[arg(short, long, value_name = "FOLDER", default_value = "figures")]
    output: PathBuf,
    /// Write into an existing folder
    #[arg(long)]
    force: bool,
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
    let recordings = folder.join("recordings");
    fs::create_dir_all(&recordings)?;
    let progress = Progress::new();
    let lab = Lab::new(recordings, &progress);
    let figures = paper::figures(&lab)?;
    for figure in &figures {
        progress.next(&format!("drawing Fig. {}", figure.id));
        draw(figure, folder)?;
    }
    let tables = [paper::closed_forms(&progress)?, noise::table(&lab)?];
    fs::write(folder.join("index.md"), page::markdown(&figures, &tables))?;
    fs::write(folder.join("index.html"), page::html(&figures, &tables))?;
    progress.bar.finish_and_clear();
    println!("{}", folder.join("index.html").display());
    Ok(())
}

fn draw(figure: &Figure, folder: &Path) -> Result<(), Failure> {
    for (medium, extension) in [(Medium::Svg, "svg"), (Medium::Png, "png")] {
        let picture = percuss_picture::draw(&figure.panels, medium);
        let picture = picture.map_err(|text| Failure(format!("Fig. {}: {text}", figure.id)))?;
        fs::write(folder.join(format!("fig{}.{extension}", figure.id)), picture)?;
    }
    Ok(())
}
