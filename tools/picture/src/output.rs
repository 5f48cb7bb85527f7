//! Rendering of a scene to the bytes of its format.

use kuva::{
    TerminalBackend,
    backend::{png::PngBackend, svg::SvgBackend},
    render::render::Scene,
};

use crate::Medium;

/// Renders a scene.
pub fn render(scene: &Scene, medium: Medium) -> Result<Vec<u8>, String> {
    match medium {
        Medium::Svg => {
            let svg = SvgBackend::new().with_embedded_font(true).render_scene(scene);
            Ok(with_own_numbers(&without_unused_fonts(&svg)).into_bytes())
        }
        Medium::Png => PngBackend::new().with_scale(2.0).render_scene(scene),
        Medium::Terminal { columns, rows, colour } => {
            let text = TerminalBackend::new(columns, rows).render_scene(scene);
            Ok(if colour { text } else { without_colour(&text) }.into_bytes())
        }
    }
}

/// Removes unused embedded fonts of an SVG: each has half a megabyte and more.
fn without_unused_fonts(svg: &str) -> String {
    let Some((head, body)) = svg.split_once("</style>") else { return svg.to_owned() };
    let mut faces = head.split("@font-face");
    let mut kept = faces.next().unwrap_or_default().to_owned();
    for face in faces {
        let is_used = |style: &str, mark: &str| !face.contains(style) || body.contains(mark);
        if is_used("font-weight:bold", "font-weight=\"bold\"")
            && is_used("font-style:italic", "font-style=\"italic\"")
            && is_used("Mono", "Mono")
        {
            kept.push_str("@font-face");
            kept.push_str(face);
        }
    }
    format!("{kept}</style>{body}")
}

/// Numbers the clip paths of an SVG from 0: the library numbers them through all pictures of a process.
fn with_own_numbers(svg: &str) -> String {
    const NAME: &str = "kuva-clip-";
    let mut parts = svg.split(NAME);
    let mut text = parts.next().unwrap_or_default().to_owned();
    let mut known: Vec<&str> = Vec::new();
    for part in parts {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = part.split_at(digits);
        let own = known.iter().position(|k| *k == number).unwrap_or_else(|| {
            known.push(number);
            known.len() - 1
        });
        text.push_str(&format!("{NAME}{own}{rest}"));
    }
    text
}

/// Removes the escape sequences of a terminal.
fn without_colour(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        if character == '\u{1b}' {
            // a sequence ends with a letter
            characters.by_ref().find(char::is_ascii_alphabetic);
        } else {
            plain.push(character);
        }
    }
    plain.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_without_colours() {
        assert_eq!(without_colour("\u{1b}[38;2;1;2;3ma\u{1b}[0mb  \nc"), "ab\nc\n");
    }
}
