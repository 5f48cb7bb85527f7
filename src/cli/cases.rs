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
                .map(|(name, form, title)| {
                    let exact = form.as_ref().map(|form| {
                        serde_json::json!({
                            "form": form.name,
                            "text": form.to_string(),
                            "end_time": Some(form.end_time).filter(|time| time.is_finite()),
                        })
                    });
                    serde_json::json!({ "name": name, "title": title, "exact": exact })
                })
                .collect();
            format!("{:#}\n", serde_json::json!({ "version": 1, "cases": list }))
        } else {
            let mut text = String::new();
            for (name, form, title) in &rows {
                writeln!(text, "{name:<27} {title}").expect("a String grows");
                if let Some(form) = form {
                    writeln!(text, "{:<27}   exact: {form}", "").expect("a String grows");
                }
            }
            text
        };
        print(&text)?;
        Ok(Exit::Done)
    }
}
