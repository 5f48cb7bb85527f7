//! `percuss layout`: a viewer's layout for recordings of a case.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{CaseArguments, CliError, Exit, output::refuse_inputs, print, print_document};
use crate::{channels::Catalogue, layout::LayoutBuilder};

const EXAMPLES: &str = "\
Examples:
  # for Lichtblick and Foxglove: import it there
  percuss layout fig5 -o fig5-layout.json
  # for PlotJuggler: load it there
  percuss layout my.toml --viewer plotjuggler -o my.xml

Every recording carries its layout for Lichtblick and Foxglove as the attachment layout.json:
  percuss-read export fig5.mcap --attachment layout.json -o layout.json";

/// Prints or writes the layout of a viewer for recordings of a case.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Layout {
    #[command(flatten)]
    case: CaseArguments,
    /// Viewer
    #[arg(long, value_enum, default_value_t = Viewer::Lichtblick)]
    viewer: Viewer,
    /// File to write; stdout if none
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Viewer {
    /// Lichtblick; Foxglove imports it too
    #[value(alias = "foxglove")]
    Lichtblick,
    /// PlotJuggler
    Plotjuggler,
}

impl Layout {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        refuse_inputs(self.output.as_deref(), &case)?;
        let topics = Catalogue::new(&case).topics();
        let builder = LayoutBuilder::new(&case, &topics);
        let (text, show): (_, fn(&str) -> _) = match self.viewer {
            Viewer::Lichtblick => (builder.lichtblick(), print_document),
            Viewer::Plotjuggler => (builder.plotjuggler(), print),
        };
        let Some(path) = &self.output else { return show(&text) };
        percuss_output::write(path, text.as_bytes(), self.force)?;
        Ok(Exit::Done)
    }
}
