//! `report`: a recording or a sweep as one page that needs nothing else, for people without a viewer.
//!
//! The page is a template with the data in it as JSON; a script in the page draws it. Nothing is
//! fetched from anywhere: the page's own policy forbids it.

pub(super) mod animation;
pub(super) mod body;
mod curves;
mod facts;
mod sweep;

use std::{
    cell::RefCell,
    collections::HashSet,
    path::{Path, PathBuf},
};

use animation::Field;
use body::Outline;
use clap::Args;
use curves::{Charts, Events, Profiles};
use serde_json::{Value, json};

use crate::{
    command::{
        summary::{Reading, watch},
        verify::{Content, conclude},
        view::Scale,
    },
    convention::{DISPLACEMENT, DRAG, HOST, RADIUS, RESOLVED_CASE, RUN, STATUS, VALIDITY, VELOCITY},
    failure::Failure,
    messages::Recording,
    pass::Pass,
    recording::{Damage, Limits, without_part},
    select::Window,
    text::xml,
    verb::{Exit, Verb, Write, by_extension, loss, say},
};

pub use sweep::{name, sweep};

const REPORT_EXAMPLES: &str = "\
The page needs nothing else and fetches nothing: it can be mailed, opened by any browser, and printed. The section \
is cropped to where the field is above 1 % of its range; a button shows all of it. Arrow keys step through the \
frames, space plays.

Examples:
  percuss-read report fig5.mcap  # into fig5.html
  percuss-read report fig5.mcap -o for-the-paper.html --force
  # a sweep, into masses.html: table, plots, links to its recordings
  percuss-read report masses";

/// A recording of a run, or a sweep, as one web page, for people without a viewer
#[derive(Debug, Args)]
#[command(after_help = REPORT_EXAMPLES)]
#[command(mut_arg("output", |page| page.help("Page to write [default: the name of the recording or sweep with .html]")))]
pub struct Report {
    /// Recording of a run, or the directory of a sweep
    pub(crate) file: PathBuf,
    #[command(flatten)]
    write: Write,
}

impl Verb for Report {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let is_sweep = self.file.is_dir();
        let default = || match is_sweep {
            true => PathBuf::from(name(&self.file) + ".html"),
            false => without_part(&self.file).with_extension("html").file_name().unwrap_or_default().into(),
        };
        let output = self.write.output.clone().unwrap_or_else(default);
        let write = Write { output: Some(output.clone()), ..self.write };
        write.refuse_inputs([&self.file])?;
        by_extension(&output, &[("html", ()), ("htm", ())], Some(()))?;
        let (page, damages) = match is_sweep {
            true => (sweep(&self.file, &output, limits)?, Vec::new()),
            false => report(&self.file, limits)?,
        };
        write.whole(page.as_bytes())?;
        say(&format!("{}: {:.1} MB", output.display(), page.len() as f64 * 1e-6));
        Ok(loss(&self.file, &damages))
    }
}

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

const VERSION: u32 = 1;

pub fn report(path: &Path, limits: Limits) -> Result<(String, Vec<Damage>), Failure> {
    let recording = Recording::open(path, limits)?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let Some(run) = recording.entries(RUN) else {
        return Err(Failure::not_percuss(path, "percuss-read plot` draws"));
    };
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
    pass.records(|found, decoded| content.take(found, decoded));
    watch(&recording, &observed, &mut pass);
    charts.watch(&recording, &mut pass);
    outline.watch(&recording, &mut pass);
    profiles.watch(&recording, &mut pass);
    events.watch(&recording, &mut pass);
    if let Some(field) = &mut field {
        field.watch(&mut pass);
    }
    let seen = pass.run()?;
    content.observed = observed.into_inner();
    let reading = Reading::recorded(&recording).filter(|_| seen.damages.is_empty());
    let reading = reading.unwrap_or_else(|| Reading::from(&recording, &content.observed));
    let verdict = conclude(content, &seen.damages);
    let time = Scale::of_page(&[charts.clock()], charts.times().chain(profiles.times()));
    let mut damages = [recording.damages.as_slice(), &seen.damages].concat();
    let field = match field {
        Some(field) => {
            let curve = |topic, field| charts.of_topic(topic).map_or(&[][..], |points| points.curve(field));
            let (depths, radii) = (curve(VELOCITY, DISPLACEMENT), curve(DRAG, RADIUS));
            let body = |times: &[f64]| outline.body(depths, radii, times);
            let (field, again) = field.json(&time, body)?;
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
        "facts": facts::facts(&recording, &reading, &charts),
        "events": events.json(&time),
        "charts": charts.json(reading.units.length.as_deref(), &time),
        "profiles": profiles.json(&recording, &time),
        "field": field,
        "case": case.map(|text| String::from_utf8_lossy(&text).into_owned()),
    });
    if let Some(unit) = time.name() {
        data["time_unit"] = unit.into();
    }
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
