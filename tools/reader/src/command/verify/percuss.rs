//! What every recording of percuss holds.

use percuss_table::measures::Measure;

use super::content::Content;
use crate::{
    command::summary::measures,
    convention::{
        CASE, DRAG, Ending, MEASURES, RECORDS, RECOVERED, RESOLVED_CASE, RUN, STATUS, VALIDITY, VELOCITY,
        required_topics,
    },
    text::short,
};

/// Checks a recording of percuss; other files are left as they are.
///
/// * `is_whole`: true if all of the file was read
pub(super) fn check(content: &mut Content<'_>, is_whole: bool) {
    let Some(run) = content.entries(RUN) else { return };
    let mut problems = Vec::new();
    for name in RECORDS.iter().filter(|name| content.entries(name).is_none()) {
        problems.push(format!("the metadata record `{name}` is missing"));
    }
    for name in [CASE, RESOLVED_CASE] {
        if !content.attachment_names.iter().any(|known| known == name) {
            problems.push(format!("the attachment `{name}` is missing"));
        }
    }
    for topic in required_topics(run).iter().filter(|topic| count(content, topic).is_none()) {
        problems.push(format!("the channel `{topic}` is missing"));
    }
    let status = content.entries(STATUS);
    let word = status.and_then(|status| status.get("status"));
    let ending = word.and_then(|word| Ending::of(word));
    if let (Some(word), None) = (word, ending) {
        problems.push(format!("the status `{}` is not known", short(word)));
    }
    let last: Option<u64> = status.and_then(|status| status.get("last_step")?.parse().ok());
    if let Some(steps) = last.map(|last| last + 1) {
        for topic in [DRAG, VELOCITY] {
            if let Some(found) = count(content, topic).filter(|found| *found != steps) {
                problems.push(format!("`{topic}` has {found} messages for {steps} steps"));
            }
        }
        let planned: Option<u64> = run.get("steps").and_then(|steps| steps.parse().ok());
        if let Some(planned) = planned.filter(|planned| planned + 1 != steps)
            && ending == Some(Ending::Completed)
        {
            problems.push(format!("the run says completed after {steps} steps of {}", planned + 1));
        }
    }
    if is_whole {
        problems.extend(wrong_measures(content));
    }
    content.report.partial = ending == Some(Ending::Early);
    for problem in problems {
        content.report.problem(0, problem);
    }
}

/// What the run has recorded of its measures and its messages do not say. Nothing where messages are lost.
fn wrong_measures(content: &Content<'_>) -> Vec<String> {
    let is_lossy = content.report.undecoded > 0 || content.entries(RECOVERED).is_some();
    let Some(recorded) = content.entries(MEASURES).filter(|_| !is_lossy) else { return Vec::new() };
    let problem = |Measure { name, value, .. }: Measure| {
        let (found, computed) = (recorded.get(&*name), value.map(|value| value.to_string()));
        let or_nothing =
            |text: Option<&String>| text.map_or("nothing".into(), |text| short(text).into_owned());
        (found != computed.as_ref()).then(|| {
            let (found, computed) = (or_nothing(found), or_nothing(computed.as_ref()));
            format!("`{MEASURES}` says {name} {found}, the messages say {computed}")
        })
    };
    measures(&content.observed, content.entries(VALIDITY)).into_iter().filter_map(problem).collect()
}

/// Messages on a topic; `None` if there is no channel of that topic.
fn count(content: &Content<'_>, topic: &str) -> Option<u64> {
    let channels = content.directory.channels().iter().filter(|(_, channel)| channel.topic == topic);
    let counts = channels.map(|(id, _)| content.series.get(id).map_or(0, |series| series.count));
    counts.reduce(|a, b| a + b)
}
