//! Texts of a file as they are shown: a name in a recording may be anything, also commands for the terminal.

use std::borrow::Cow;

/// Most characters of a name in a sentence.
const SHORT: usize = 120;

/// A text of a file on one line: what moves the cursor, changes colours or turns the direction of writing is escaped.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, is_command, |c| c.escape_default().to_string())
}

/// A name of a file in a sentence: one line, and not longer than a name should be.
pub(crate) fn short(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(SHORT) {
        Some((at, _)) => Cow::Owned(format!("{}…", printable(&text[..at]))),
        None => printable(text),
    }
}

/// Text of this program with what it cites from a file: lines stay, commands for the terminal do not.
pub(crate) fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, is_command_in_lines, |c| c.escape_default().to_string())
}

/// A JSON document with the same characters escaped as JSON does it: they only stand in its texts.
pub(crate) fn document(text: &str) -> Cow<'_, str> {
    escaped(text, is_command_in_lines, |c| format!("\\u{:04x}", u32::from(c)))
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

fn is_command_in_lines(c: char) -> bool {
    is_command(c) && !matches!(c, '\n' | '\t')
}

fn is_command(c: char) -> bool {
    // control characters, marks and overrides of the direction of writing, separators of lines
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_for_the_terminal_are_escaped() {
        assert_eq!(printable("/drag γ"), "/drag γ");
        assert_eq!(printable("/a\u{1b}[2J\n\u{9b}1m\u{202e}"), "/a\\u{1b}[2J\\n\\u{9b}1m\\u{202e}");
        assert_eq!(lines("a\n\tb\u{7}\r"), "a\n\tb\\u{7}\\r");
        let json = document("{\"a\":\"\u{202e}\u{7f}\"}\n").into_owned();
        assert_eq!(json, "{\"a\":\"\\u202e\\u007f\"}\n");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&json).expect("JSON")["a"], "\u{202e}\u{7f}");
        assert_eq!(short(&"γ".repeat(200)).chars().count(), SHORT + 1);
    }
}
