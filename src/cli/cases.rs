//! `percuss cases`: the built-in cases and their closed forms.

use std::fmt::Write;

use clap::Args;

use super::{CliError, Exit, print};
use crate::{
    case::{Case, builtin},
    exact::closed_form::ClosedForm,
};

const EXAMPLES: &str = "\
Examples:
  percuss cases
  percuss cases --json
  percuss run fig5  # computes one of them";

/// Lists the built-in cases and their closed forms.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Cases {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Cases {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let mut rows = Vec::new();
        for name in builtin::names() {
            let case = Case::load(name, &[])?;
            rows.push((name, ClosedForm::for_case(&case).ok(), case.title.clone()));
        }
        let text = if self.json {
            let list: Vec<_> = rows
                .iter()
                .map(|(name, answer, title)| {
                    let exact = answer.as_ref().map(|answer| {
                        serde_json::json!({
                            "form": answer.name(),
                            "text": answer.to_string(),
                            "end_time": Some(answer.end_time()).filter(|time| time.is_finite()),
                        })
                    });
                    serde_json::json!({ "name": name, "title": title, "exact": exact })
                })
                .collect();
            format!("{:#}\n", serde_json::json!({ "version": 1, "cases": list }))
        } else {
            let mut text = String::new();
            for (name, answer, title) in &rows {
                writeln!(text, "{name:<23} {title}").expect("a String grows");
                if let Some(answer) = answer {
                    writeln!(text, "{:<23}   exact: {answer}", "").expect("a String grows");
                }
            }
            text
        };
        print(&text)?;
        Ok(Exit::Done)
    }
}
