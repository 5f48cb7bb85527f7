//! Comparisons as checks that pass or fail one by one, for the reports of continuous integration: JUnit, Markdown, annotations.

use std::fmt::Write as _;

use super::{
    Job,
    shown::Shown,
    text::{Style, channel_text, largest},
};
use crate::{
    compare::Verdict,
    text::{printable, xml},
};

/// A recording and its reference.
#[derive(Debug)]
pub(super) struct Suite {
    a: String,
    b: String,
    /// What was compared.
    checks: Vec<Check>,
}

/// A channel, or something else that can be equal or not.
#[derive(Debug)]
struct Check {
    /// Topic, or what it is.
    name: String,
    verdict: Verdict,
    /// The largest difference, in one line; empty if there is none.
    largest: String,
    /// Messages compared, and those of reference and new recording.
    messages: [u64; 3],
    /// All that is to be said.
    text: String,
}

impl Suite {
    /// The checks of a comparison.
    pub(super) fn of(Shown { a, b, comparison }: &Shown) -> Self {
        let losses = comparison.losses().into_iter().map(|(_, line, _)| line).collect();
        let structure = comparison.structure.iter().map(ToString::to_string).collect();
        let gaps = comparison.gaps.iter().map(|gap| printable(gap).into_owned()).collect();
        let checks = [
            Check::of_lines("whole recordings", Verdict::NotCompared, losses),
            Check::of_lines("structure", Verdict::Different, structure),
            Check::of_lines("comparable", Verdict::NotCompared, gaps),
        ];
        let channels = comparison.channels.iter().map(|channel| Check {
            name: channel.topic.clone(),
            verdict: channel.verdict(),
            largest: largest(channel),
            messages: [channel.compared, channel.messages[0], channel.messages[1]],
            text: channel_text(channel, Style::default()),
        });
        let checks = checks.into_iter().flatten().chain(channels).collect();
        let suite = Self { a: a.clone(), b: b.clone(), checks };
        debug_assert!(comparison.is_lossy() || suite.worst() == comparison.verdict(), "{suite:?}");
        suite
    }

    /// The check that both folders have a recording.
    pub(super) fn missing(job: &Job, what: &str) -> Self {
        let [a, b] = [&job.a, &job.b].map(|path| {
            path.as_ref().map_or_else(String::new, |path| printable(&path.to_string_lossy()).into())
        });
        let check = Check::of_lines("both recordings", Verdict::Different, vec![what.to_owned()]);
        Self { a, b, checks: check.into_iter().collect() }
    }

    /// The worst of its checks.
    fn worst(&self) -> Verdict {
        self.checks.iter().map(|check| check.verdict).max().unwrap_or(Verdict::Equal)
    }

    /// Name of the recording that is looked at.
    fn name(&self) -> &str {
        if self.b.is_empty() { &self.a } else { &self.b }
    }

    fn failed(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.verdict.has_failed())
    }
}

impl Check {
    /// A check of what is not about messages; none if nothing is to be said.
    fn of_lines(name: &str, verdict: Verdict, lines: Vec<String>) -> Option<Self> {
        let largest = lines.first()?.clone();
        Some(Self { name: name.into(), verdict, largest, messages: [0; 3], text: lines.join("\n") })
    }

    /// How much was compared; empty if it is not about messages.
    fn amount(&self) -> String {
        match self.messages {
            [0, 0, 0] => String::new(),
            [compared, a, b] => format!("{compared} of {a} and {b}"),
        }
    }
}

/// A report in the form of JUnit: a suite for every recording, a case for every channel. What could not be compared is an error.
pub(super) fn junit(suites: &[Suite]) -> String {
    let count = |suite: &Suite, verdict| suite.checks.iter().filter(|check| check.verdict == verdict).count();
    let counts = |suites: &[Suite]| {
        let sum = |of: &dyn Fn(&Suite) -> usize| suites.iter().map(of).sum::<usize>();
        format!(
            "tests=\"{}\" failures=\"{}\" errors=\"{}\"",
            sum(&|suite| suite.checks.len()),
            sum(&|suite| count(suite, Verdict::Different)),
            sum(&|suite| count(suite, Verdict::NotCompared)),
        )
    };
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"percuss-read diff\" {}>\n",
        counts(suites)
    );
    for suite in suites {
        let name = xml(&format!("{} -> {}", suite.a, suite.b));
        let counts = counts(std::slice::from_ref(suite));
        writeln!(text, "  <testsuite name=\"{name}\" {counts}>").expect("a String grows");
        for check in &suite.checks {
            let [class, name] = [suite.name(), &check.name].map(xml);
            let start = format!("    <testcase classname=\"{class}\" name=\"{name}\"");
            let element = if check.verdict == Verdict::Different { "failure" } else { "error" };
            let end = match check.verdict.has_failed() {
                false if check.amount().is_empty() => "/>".to_owned(),
                false => format!(
                    ">\n      <system-out>messages compared: {}</system-out>\n    </testcase>",
                    check.amount()
                ),
                true => format!(
                    ">\n      <{element} type=\"{}\" message=\"{}\">{}</{element}>\n    </testcase>",
                    check.verdict.name(),
                    xml(&check.largest),
                    xml(&check.text)
                ),
            };
            writeln!(text, "{start}{end}").expect("a String grows");
        }
        text.push_str("  </testsuite>\n");
    }
    text + "</testsuites>\n"
}

/// A report for a pull request: what failed as a table, the rest in numbers.
pub(super) fn markdown(suites: &[Suite]) -> String {
    let worst = suites.iter().map(Suite::worst).max().unwrap_or(Verdict::NotCompared);
    let mut text = format!("### percuss: {}\n\n", worst.name());
    let failed = suites.iter().flat_map(|suite| suite.failed().map(move |check| (suite, check)));
    let failed: Vec<(&Suite, &Check)> = failed.collect();
    if !failed.is_empty() {
        text += "| recording | channel | verdict | messages compared | largest |\n|---|---|---|---|---|\n";
        for (suite, check) in &failed {
            let [name, channel, largest] = [suite.name(), &check.name, &check.largest].map(cell);
            let (verdict, amount) = (check.verdict.name(), check.amount());
            writeln!(text, "| {name} | {channel} | {verdict} | {amount} | {largest} |")
                .expect("a String grows");
        }
        text.push('\n');
    }
    let checks = || suites.iter().flat_map(|suite| &suite.checks);
    let [compared, a, b] = [0, 1, 2].map(|i| checks().map(|check| check.messages[i]).sum::<u64>());
    text + &format!(
        "{} of {} checks of {} recordings failed. Messages compared: {compared} of {a} in the references and {b} in the \
         new recordings.\n",
        failed.len(),
        checks().count(),
        suites.len()
    )
}

/// Annotations of GitHub Actions, one for every check that failed.
pub(super) fn github(suites: &[Suite]) -> String {
    let mut text = String::new();
    for suite in suites {
        for check in suite.failed() {
            let title = format!("{} {}: {}", suite.name(), check.name, check.verdict.name());
            let title = command(&title).replace(':', "%3A").replace(',', "%2C");
            writeln!(text, "::error title={title}::{}", command(check.text.trim_end()))
                .expect("a String grows");
        }
    }
    text
}

/// A text in a cell of a table.
fn cell(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('\n', " ");
    ["\\", "|", "`", "*", "_", "[", "]"]
        .iter()
        .fold(text, |text, mark| text.replace(mark, &format!("\\{mark}")))
}

/// A text in a workflow command.
fn command(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}
