//! Pictures in a terminal: labels above the picture and the legend below it, so that nothing is clipped or runs downwards.

use kuva::render::render::Scene;

use percuss_canvas::plain;
use percuss_output::text::printable;

use crate::{Medium, output::render};

/// What stands around a picture in a terminal.
pub struct Frame<'a> {
    pub title: &'a str,
    /// Label of the vertical axis.
    pub left: &'a str,
    /// Label of the vertical axis at the right.
    pub right: &'a str,
    pub legend: Vec<(String, String)>,
    pub columns: usize,
    /// Rows of everything.
    pub rows: usize,
    pub colour: bool,
}

/// Rows that a picture has at least.
const LEAST_ROWS: usize = 8;

/// Draws a scene with its frame.
///
/// * `scene`: the scene for a number of rows
pub fn draw(frame: Frame<'_>, scene: impl FnOnce(usize) -> Scene) -> Result<Vec<u8>, String> {
    let Frame { columns, colour, .. } = frame;
    let (above, below) = (frame.above(), frame.below());
    let rows = frame.rows.saturating_sub(above.len() + below.len()).max(LEAST_ROWS);
    let picture = render(scene(rows), Medium::Terminal { columns, rows, colour })?;
    let lines = |lines: &[String]| lines.iter().map(|line| format!("{line}\n")).collect::<String>();
    let mut text = lines(&above).into_bytes();
    text.extend(picture);
    if !text.ends_with(b"\n") {
        text.push(b'\n');
    }
    text.extend(lines(&below).into_bytes());
    Ok(text)
}

impl Frame<'_> {
    /// Title, and the labels of the vertical axes: on two lines if they do not go on one.
    fn above(&self) -> Vec<String> {
        let (left, right) = (shown(self.left), shown(self.right));
        let (lengths, title) = ((left.chars().count(), right.chars().count()), shown(self.title));
        let mut lines = Vec::new();
        if !title.is_empty() {
            let margin = self.columns.saturating_sub(title.chars().count()) / 2;
            lines.push(format!("{:margin$}{title}", ""));
        }
        let flush = |lengths: usize| self.columns.saturating_sub(lengths);
        if right.is_empty() {
            lines.push(left);
        } else if lengths.0 + lengths.1 < self.columns {
            lines.push(format!("{left}{:1$}{right}", "", flush(lengths.0 + lengths.1)));
        } else {
            lines.extend([left, format!("{:1$}{right}", "", flush(lengths.1))]);
        }
        lines
    }

    /// The legend, as many names on a line as go there.
    fn below(&self) -> Vec<String> {
        let mut lines: Vec<(usize, String)> = Vec::new();
        for (name, colour) in &self.legend {
            let name = shown(name);
            let length = name.chars().count() + 5;
            let mark = match rgb(colour).filter(|_| self.colour) {
                Some([r, g, b]) => format!("\u{1b}[38;2;{r};{g};{b}m──\u{1b}[0m"),
                None => "──".into(),
            };
            let entry = format!("{mark} {name}");
            match lines.last_mut().filter(|(taken, _)| taken + length <= self.columns) {
                Some((taken, line)) => {
                    *taken += length;
                    line.push_str("  ");
                    line.push_str(&entry);
                }
                None => lines.push((length, entry)),
            }
        }
        lines.into_iter().map(|(_, line)| line).collect()
    }
}

/// A label as a terminal shows it, without what could command it.
pub fn shown(label: &str) -> String {
    printable(&plain(label)).into_owned()
}

/// Parts of a colour `#rrggbb`.
fn rgb(colour: &str) -> Option<[u8; 3]> {
    let digits = colour.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let part = |i: usize| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok();
    Some([part(0)?, part(1)?, part(2)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_and_legend_keep_to_the_columns() {
        let name = |name: &str| (name.to_owned(), "#0072b2".to_owned());
        let frame = |columns: usize, colour: bool| Frame {
            title: "fig5",
            left: "force [πR²γc_p²]",
            right: "velocity [c_p]",
            legend: vec![name("force"), name("velocity (right)")],
            columns,
            rows: 20,
            colour,
        };
        assert_eq!(
            frame(40, false).above(),
            ["                  fig5", "force [πR²γcₚ²]            velocity [cₚ]"]
        );
        assert_eq!(frame(28, false).above().len(), 3);
        assert_eq!(frame(40, false).below(), ["── force  ── velocity (right)"]);
        assert_eq!(frame(28, false).below(), ["── force", "── velocity (right)"]);
        assert!(frame(40, true).below()[0].starts_with("\u{1b}[38;2;0;114;178m──"));
    }
}
