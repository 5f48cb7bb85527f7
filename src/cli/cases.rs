//! `percuss cases`: the built-in cases.

use clap::Args;

use super::{CliError, Exit, print};
use crate::case::{Case, builtin};

/// Lists the built-in cases.
#[derive(Debug, Args)]
pub(super) struct Cases {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Cases {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let mut rows = Vec::new();
        for name in builtin::names() {
            rows.push((name, Case::load(name, &[])?.title));
        }
        let text = if self.json {
            let list: Vec<_> = rows
                .iter()
                .map(|(name, title)| serde_json::json!({ "name": name, "title": title }))
                .collect();
            format!("{:#}\n", serde_json::json!({ "version": 1, "cases": list }))
        } else {
            rows.iter().map(|(name, title)| format!("{name:<11} {title}\n")).collect()
        };
        print(&text)?;
        Ok(Exit::Done)
    }
}
