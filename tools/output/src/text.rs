//! Text from files as it is shown: a title or a name may be anything, also commands for a terminal or for the machine that runs a job.
//!
//! Two kinds of it reach a person. What is cited, a title, a name, a value, is escaped where it is put into a sentence
//! ([`printable`], [`short`]), so that it stays on its line. Whatever is printed goes through [`lines`], [`say`] or [`document`] besides, so
//! that nothing passes that was forgotten. What is data, a table or a case file, stays as it is.

use std::{
    borrow::Cow,
    io::{self, Write},
};

/// Most characters of a cited text in a sentence.
const SHORT: usize = 120;

/// Beginnings of commands of a job: the first counts at the beginning of a line, the second anywhere.
const JOB_COMMANDS: [&str; 2] = ["::", "##["];

/// A cited text on one line: what moves the cursor, changes colours, turns the direction of writing, shows nothing, or commands a job
/// is escaped.
///
/// ```
/// use percuss_output::text::printable;
///
/// assert_eq!(printable("/drag γ"), "/drag γ");
/// assert_eq!(printable("a\n::error::\u{1b}[2J\u{202e}"), "a\\n::error::\\u{1b}[2J\\u{202e}");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    disarmed(escaped(text, is_command, |c| c.escape_default().to_string()), "\\u{23}")
}

/// The same, and not longer than a name should be.
pub fn short(text: &str) -> Cow<'_, str> {
    clipped(text, SHORT)
}

/// The same, and not longer than so many characters.
pub fn clipped(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        Some((at, _)) => Cow::Owned(format!("{}…", printable(&text[..at]))),
        None => printable(text),
    }
}

/// Text of a program with what it cites: lines stay, commands do not.
pub fn lines(text: &str) -> Cow<'_, str> {
    disarmed(escaped(text, is_command_in_lines, |c| c.escape_default().to_string()), "\\u{23}")
}

/// A JSON document with the same characters escaped as JSON does it: they only stand in its texts.
pub fn document(text: &str) -> Cow<'_, str> {
    let escape = |c: char| c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect();
    disarmed(escaped(text, is_command_in_lines, escape), "\\u0023")
}

/// Shows lines on standard error, without what could command a terminal in them.
pub fn say(text: &str) {
    // a closed standard error must not end a program
    drop(writeln!(io::stderr(), "{}", lines(text)));
}

/// A basic string of TOML with the same characters escaped as TOML does it.
pub fn toml_string(text: &str) -> String {
    let mut string = String::with_capacity(text.len() + 2);
    for c in text.chars() {
        match c {
            '"' | '\\' => string.extend(['\\', c]),
            c if is_command(c) => string.push_str(&format!("\\U{:08X}", u32::from(c))),
            c => string.push(c),
        }
    }
    format!("\"{}\"", string.replace(JOB_COMMANDS[1], "#\\u0023["))
}

/// The same text in XML, HTML or SVG, between tags or in an attribute: also what XML cannot have is escaped.
///
/// ```
/// use percuss_output::text::xml;
///
/// assert_eq!(xml("a < \"b\"\u{7}"), "a &lt; &quot;b&quot;\\u{7}");
/// ```
pub fn xml(text: &str) -> String {
    let text = lines(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // what is no character of XML at all
    text.replace('"', "&quot;").replace(['\u{fffe}', '\u{ffff}'], "\u{fffd}")
}

fn escaped(text: &str, is_bad: fn(char) -> bool, escape: fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(is_bad) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_bad(c) { shown.push_str(&escape(c)) } else { shown.push(c) }
    }
    Cow::Owned(shown)
}

/// Escapes a character of every command of a job.
///
/// * `hash`: the escaped `#`
fn disarmed<'a>(text: Cow<'a, str>, hash: &str) -> Cow<'a, str> {
    let [line, anywhere] = JOB_COMMANDS;
    let mut text = text;
    if text.contains(anywhere) {
        text = Cow::Owned(text.replace(anywhere, &format!("#{hash}[")));
    }
    let is_one = |text: &str| text.trim_start().starts_with(line);
    if text.lines().any(is_one) {
        let each = |text: &str| if is_one(text) { text.replacen(':', "\\u{3a}", 1) } else { text.to_owned() };
        text = Cow::Owned(text.split('\n').map(each).collect::<Vec<_>>().join("\n"));
    }
    text
}

fn is_command_in_lines(c: char) -> bool {
    is_command(c) && !matches!(c, '\n' | '\t')
}

/// Control characters, marks and overrides of the direction of writing, separators of lines, and what has no shape.
fn is_command(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_for_the_terminal_are_escaped() {
        assert_eq!(printable("/drag γ"), "/drag γ");
        assert_eq!(printable("/a\u{1b}[2J\n\u{9b}1m\u{202e}"), "/a\\u{1b}[2J\\n\\u{9b}1m\\u{202e}");
        assert_eq!(printable("\u{200b}\u{61c}\u{feff}\u{e0041}"), "\\u{200b}\\u{61c}\\u{feff}\\u{e0041}");
        assert_eq!(lines("a\n\tb\u{7}\r"), "a\n\tb\\u{7}\\r");
        let json = document("{\"a\":\"\u{202e}\u{7f}##[\u{e0041}\"}\n").into_owned();
        assert_eq!(json, "{\"a\":\"\\u202e\\u007f#\\u0023[\\udb40\\udc41\"}\n");
        let value = serde_json::from_str::<serde_json::Value>(&json).expect("JSON");
        assert_eq!(value["a"], "\u{202e}\u{7f}##[\u{e0041}");
        assert_eq!(toml_string("\"a\\\n##["), "\"\\\"a\\\\\\U0000000A#\\u0023[\"");
        assert_eq!(short(&"γ".repeat(200)).chars().count(), SHORT + 1);
    }

    #[test]
    fn commands_of_jobs_are_none() {
        assert_eq!(printable("::error::x"), "\\u{3a}:error::x");
        assert_eq!(
            lines("a ::b::\n  ::error::x\n##[group]\n"),
            "a ::b::\n  \\u{3a}:error::x\n#\\u{23}[group]\n"
        );
        // what is cited behind them, too
        assert_eq!(printable("##[##[error]"), "#\\u{23}[#\\u{23}[error]");
        assert_eq!(lines("::1\n"), "\\u{3a}:1\n");
    }
}
