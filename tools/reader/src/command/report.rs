//! `report`: a recording or a sweep as one page that needs nothing else, for people without a viewer.
//!
//! The page is a template with the data in it as JSON; a script in the page draws it. Nothing is
//! fetched from anywhere: the page's own policy forbids it.

use std::{
    cell::RefCell,
    collections::HashSet,
    path::{Path, PathBuf},
};

use serde_json::{Value, json};

pub(super) mod animation;
pub(super) mod body;
mod curves;
mod facts;
mod sweep;
mod units;

use crate::{
    command::{
        summary::{Reading, watch},
        verify::{Content, conclude},
    },
    convention::{DISPLACEMENT, DRAG, HOST, RADIUS, RESOLVED_CASE, RUN, STATUS, VALIDITY, VELOCITY},
    messages::Recording,
    pass::Pass,
    recording::{Damage, Limits, OpenError},
    select::Window,
    tabular::TableError,
    text::xml,
};
use animation::Field;
use body::Outline;
use curves::{Charts, Events, Profiles};

pub use sweep::{name, sweep};

const PAGE: &str = include_str!("report/page.html");
const STYLE: &str = include_str!("report/style.css");
const SHARED: &str = include_str!("report/shared.js");
const SCRIPT: &str = concat!(
    include_str!("report/chart.js"),
    include_str!("report/section.js"),
    include_str!("report/script.js")
);

/// Longest case that is shown \[bytes\].
const MAX_CASE: usize = 1 << 20;

/// Version of the data in the page.
const VERSION: u32 = 1;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Not a recording of a run.
    #[error(
        "`{0}` is not a percuss recording: it has no metadata record percuss.run; `percuss-read plot` draws its fields"
    )]
    NotPercuss(String),
    /// Not the directory of a sweep.
    #[error("`{}` is not the directory of a sweep: it has no summary.csv", .0.display())]
    NotSweep(PathBuf),
    /// The summary of a sweep cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// Writes the report of a recording.
///
/// # Errors
///
/// The file cannot be read or is no recording of percuss.
pub fn report(path: &Path, limits: Limits) -> Result<(String, Vec<Damage>), ReportError> {
    let recording = Recording::open(path, limits)?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let Some(run) = recording.entries(RUN) else { return Err(ReportError::NotPercuss(name)) };
    let case = recording.attachment(RESOLVED_CASE)?.filter(|case| case.len() <= MAX_CASE);
    let mut host = recording.entries(HOST).cloned().unwrap_or_default();
    host.remove("padding");
    let mut content = Content::new(limits, recording.index());
    let mut charts = Charts::of(&recording);
    let (mut outline, mut profiles, mut events) =
        (Outline::default(), Profiles::default(), Events::default());
    let observed = RefCell::default();
    let mut field = Field::of(&recording);
    let mut pass = Pass::over(&recording, Window::default());
    pass.records(|found, fit| content.take(found, fit));
    watch(&recording, &observed, &mut pass);
    charts.watch(&recording, &mut pass);
    outline.watch(&recording, &mut pass);
    profiles.watch(&recording, &mut pass);
    events.watch(&recording, &mut pass);
    if let Some(field) = &mut field {
        field.watch(&mut pass);
    }
    let seen = pass.run()?;
    let verdict = conclude(content, &seen.damages);
    let reading = Reading::from(&recording, &observed.into_inner());
    let curves = charts.json(&recording, reading.units.length.as_deref());
    let mut damages = [recording.damages.as_slice(), &seen.damages].concat();
    let field = match field {
        Some(field) => {
            let curve = |topic, field| charts.of_topic(topic).map_or(&[][..], |points| points.curve(field));
            let (depths, radii) = (curve(VELOCITY, DISPLACEMENT), curve(DRAG, RADIUS));
            let body = |times: &[f64]| outline.body(depths, radii, times);
            let (field, again) = field.json(body)?;
            damages.extend(again);
            field
        }
        None => Value::Null,
    };
    let mut known = HashSet::new();
    damages.retain(|damage| known.insert((damage.offset, damage.reason.clone())));
    let mut data = json!({
        "version": VERSION,
        "file": name,
        "title": run.get("title"),
        "library": recording.library,
        "run": run,
        "host": host,
        "status": recording.entries(STATUS),
        "validity": recording.entries(VALIDITY),
        "sound": verdict.is_sound(),
        "partial": verdict.partial,
        "verdict": verdict.to_text(&name),
        "facts": facts::facts(&recording, &reading, &curves),
        "events": events.json(),
        "charts": curves,
        "profiles": profiles.json(&recording),
        "field": field,
        "case": case.map(|text| String::from_utf8_lossy(&text).into_owned()),
    });
    units::prefix(&mut data);
    let parts = [("{style}", STYLE), ("{shared}", SHARED), ("{script}", SCRIPT)];
    Ok((fill(PAGE, &data, &parts), damages))
}

/// Fills a template: title, style, data and scripts, in this order.
fn fill(template: &str, data: &Value, [style, scripts @ ..]: &[(&str, &str); 3]) -> String {
    let title = data["title"].as_str().unwrap_or("percuss");
    let title = xml(title);
    // in a script element nothing but `<` could end it
    let data = data.to_string().replace('<', "\\u003c");
    let mut page = String::with_capacity(template.len() + data.len());
    let mut rest = template;
    let head = [("{title}", title.as_str()), *style, ("{data}", &data)];
    for (mark, text) in head.iter().chain(scripts) {
        let (before, after) = rest.split_once(mark).expect("the template has its marks in this order");
        page.push_str(before);
        page.push_str(text);
        rest = after;
    }
    page.push_str(rest);
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_says_cannot_leave_its_place_in_the_page() {
        let data = json!({ "title": "a</title><script>", "x": "</script><b>{script}" });
        let page = fill(PAGE, &data, &[("{style}", STYLE), ("{shared}", SHARED), ("{script}", SCRIPT)]);
        assert!(page.contains("a&lt;/title&gt;&lt;script&gt;"));
        assert_eq!(page.matches("</script>").count(), 2);
        assert_eq!(page.matches("<b>").count(), 0);
    }
}
