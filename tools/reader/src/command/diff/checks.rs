//! Comparisons as checks that pass or fail one by one, for the reports of continuous integration: JUnit, Markdown, annotations.

use std::fmt::Write as _;

use super::{Job, Style, Verdict, shown::shown, text, verdict};
use crate::{
    compare::{Comparison, Gap},
    text::{printable, xml},
};

/// A recording and its reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Suite {
    /// Reference.
    pub a: String,
    /// New recording.
    pub b: String,
    /// What was compared.
    pub checks: Vec<Check>,
}

/// A channel, or something else that can be equal or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// Topic, or what it is.
    pub name: String,
    /// How it compares.
    pub verdict: Verdict,
    /// The largest difference, in one line; empty if there is none.
    pub largest: String,
    /// Messages compared, and those of reference and new recording.
    pub messages: [u64; 3],
    /// All that is to be said.
    pub text: String,
}

impl Suite {
    /// The checks of a comparison.
    pub fn of((a, b): (&str, &str), comparison: &Comparison) -> Self {
        let comparison = &shown(comparison);
        let gap = |gap: &Gap| printable(&gap.to_string()).into_owned();
        let mut checks = Vec::new();
        let mut add = |name: &str, verdict: Verdict, lines: Vec<String>| {
            if let Some(first) = lines.first() {
                let (largest, text) = (first.clone(), lines.join("\n"));
                checks.push(Check { name: name.into(), verdict, largest, messages: [0; 3], text });
            }
        };
        let damages = comparison.damages.iter().map(|(path, damage)| {
            format!("{}: {} (at byte {})", path.display(), damage.reason, damage.offset)
        });
        let partial = comparison.partial.iter();
        let partial = partial.map(|path| format!("{} did not come to its planned end", path.display()));
        add("whole recordings", Verdict::NotCompared, damages.chain(partial).collect());
        add("structure", Verdict::Different, comparison.structure.iter().map(ToString::to_string).collect());
        add("comparable", Verdict::NotCompared, comparison.gaps.iter().map(gap).collect());
        checks.extend(comparison.channels.iter().map(|channel| Check {
            name: channel.topic.clone(),
            verdict: text::channel_verdict(channel),
            largest: text::largest(channel),
            messages: [channel.compared, channel.messages[0], channel.messages[1]],
            text: text::channel_text(channel, Style::default()),
        }));
        let suite = Self { a: printable(a).into(), b: printable(b).into(), checks };
        debug_assert!(comparison.is_lossy() || suite.worst() == verdict(comparison), "{suite:?}");
        suite
    }

    /// The check that both folders have a recording.
    pub fn missing(job: &Job, what: &str) -> Self {
        let name = |path: &Option<std::path::PathBuf>| {
            path.as_ref().map_or_else(String::new, |path| printable(&path.to_string_lossy()).into())
        };
        let text = what.to_owned();
        let check = Check {
            name: "both recordings".into(),
            verdict: Verdict::Different,
            largest: text.clone(),
            messages: [0; 3],
            text,
        };
        Self { a: name(&job.a), b: name(&job.b), checks: vec![check] }
    }

    /// The worst of its checks.
    pub fn worst(&self) -> Verdict {
        self.checks.iter().map(|check| check.verdict).max().unwrap_or(Verdict::Equal)
    }

    /// Name of the recording that is looked at.
    fn name(&self) -> &str {
        if self.b.is_empty() { &self.a } else { &self.b }
    }
}

impl Check {
    fn has_failed(&self) -> bool {
        self.verdict >= Verdict::NotCompared
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
pub fn junit(suites: &[Suite]) -> String {
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
            let end = match check.has_failed() {
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
pub fn markdown(suites: &[Suite]) -> String {
    let worst = suites.iter().map(Suite::worst).max().unwrap_or(Verdict::NotCompared);
    let mut text = format!("### percuss: {}\n\n", worst.name());
    let failed: Vec<(&Suite, &Check)> = suites
        .iter()
        .flat_map(|suite| {
            suite.checks.iter().filter(|check| check.has_failed()).map(move |check| (suite, check))
        })
        .collect();
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
    let checks = suites.iter().map(|suite| suite.checks.len()).sum::<usize>();
    let files = suites.len();
    let messages = suites
        .iter()
        .flat_map(|suite| &suite.checks)
        .fold([0; 3], |sums, check| std::array::from_fn(|i| sums[i] + check.messages[i]));
    let [compared, a, b] = messages;
    text + &format!(
        "{} of {checks} checks of {files} recordings failed. Messages compared: {compared} of {a} in the references and {b} in the \
         new recordings.\n",
        failed.len()
    )
}

/// Annotations of GitHub Actions, one for every check that failed.
pub fn github(suites: &[Suite]) -> String {
    let mut text = String::new();
    for suite in suites {
        for check in suite.checks.iter().filter(|check| check.has_failed()) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn suites() -> Vec<Suite> {
        let check = |name: &str, verdict, largest: &str| Check {
            name: name.into(),
            verdict,
            largest: largest.into(),
            messages: [2, 3, 4],
            text: format!("{largest}\nand <more> & 5 %"),
        };
        let first = Suite {
            a: "old/a.mcap".into(),
            b: "new/a.mcap".into(),
            checks: vec![
                check("/drag", Verdict::Different, "largest 1e-3 in force_|x"),
                check("/velocity", Verdict::Within, ""),
                check("comparable", Verdict::NotCompared, "no \"common\" time\u{1b}"),
            ],
        };
        let job = Job { a: Some("old/b.mcap".into()), b: None };
        vec![first, Suite::missing(&job, "missing from the new folder")]
    }

    #[test]
    fn reports_say_what_failed_in_their_own_form() {
        let suites = suites();
        let text = junit(&suites);
        assert!(
            text.contains("<testsuites name=\"percuss-read diff\" tests=\"4\" failures=\"2\" errors=\"1\">"),
            "{text}"
        );
        let velocity = "<testcase classname=\"new/a.mcap\" name=\"/velocity\">\n      <system-out>messages compared: 2 of 3 and 4<";
        assert!(text.contains(velocity), "{text}");
        assert!(
            text.contains("message=\"no &quot;common&quot; time\\u{1b}\">") && !text.contains('\u{1b}'),
            "{text}"
        );
        assert!(text.contains("and &lt;more&gt; &amp; 5 %</failure>"), "{text}");
        let text = markdown(&suites);
        assert!(text.starts_with("### percuss: DIFFERENT\n"), "{text}");
        assert!(
            text.contains(
                "| new/a.mcap | /drag | DIFFERENT | 2 of 3 and 4 | largest 1e-3 in force\\_\\|x |\n"
            ),
            "{text}"
        );
        let end = "3 of 4 checks of 2 recordings failed. Messages compared: 6 of 9 in the references and 12 in the new recordings.\n";
        assert!(text.ends_with(end), "{text}");
        let text = github(&suites);
        assert_eq!(text.lines().count(), 3);
        assert!(
            text.starts_with(
                "::error title=new/a.mcap /drag%3A DIFFERENT::largest 1e-3 in force_|x%0Aand <more> & 5 %25\n"
            ),
            "{text}"
        );
    }
}
