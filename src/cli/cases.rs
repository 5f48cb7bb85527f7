//! `percuss cases`: the built-in cases and their closed forms.

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
            let entry = |(name, form, title): &(_, Option<ClosedForm>, _)| {
                let exact = form.as_ref().map(|form| {
                    serde_json::json!({
                        "form": form.name,
                        "text": form.to_string(),
                        "end_time": Some(form.end_time).filter(|time| time.is_finite()),
                    })
                });
                serde_json::json!({ "name": name, "title": title, "exact": exact })
            };
            let list: Vec<_> = rows.iter().map(entry).collect();
            format!("{:#}\n", serde_json::json!({ "version": 1, "cases": list }))
        } else {
            let line = |(name, form, title): &(_, Option<ClosedForm>, _)| {
                let exact = form.as_ref().map(|form| format!("{:<27}   exact: {form}\n", ""));
                format!("{name:<27} {title}\n{}", exact.unwrap_or_default())
            };
            rows.iter().map(line).collect()
        };
        print(&text)
    }
}
