//! The pages: figure by figure, pictures, commands, and a table of statements of the paper and computed values.

use std::fmt::Write as _;

use percuss_output::text::xml;

use crate::figure::{Figure, Statement, Verdict};

/// A table with a heading row.
pub struct Table {
    /// Title.
    pub title: String,
    /// Text above it.
    pub text: String,
    /// Rows, the first with the headings.
    pub rows: Vec<Vec<String>>,
}

/// A page.
pub struct Page {
    /// Title.
    pub title: &'static str,
    /// Paragraphs above the figures.
    pub introduction: Vec<String>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Tables below the figures.
    pub tables: Vec<Table>,
    /// Sentence at the end, if there is one.
    pub ending: String,
}

const INTRODUCTION: &str = "\
Every figure of V. D. Kubenko and M. V. Ayzenberg-Stepanenko, *Impact indentation of a rigid body into an elastic layer. \
Axisymmetric problem*, computed by percuss, drawn from its recordings, and held against what the paper states and against \
closed forms. Dashed black curves are closed forms. Apart from the paper's statements no number on this page was typed in: \
`percuss-figures` computes, draws and writes all of it. A second page compares the simplified with the full theory: `theories.html`; a third one has layered targets: `layers.html`; a fourth one a ball on plates: `sweeps.html`; a fifth one balls on half-spaces, against Hertz: `hertz.html`; a sixth one bars and a ball that give: `bodies.html`.";

impl Page {
    /// The page of the paper's figures.
    pub fn of_the_paper(figures: Vec<Figure>, tables: Vec<Table>) -> Self {
        let introduction = vec![INTRODUCTION.to_owned(), summary(&figures)];
        Self {
            title: "The figures of the paper, computed",
            introduction,
            figures,
            tables,
            ending: String::new(),
        }
    }
}

/// Lines of a file, one after the other in a sentence.
pub fn code(text: &str) -> String {
    text.lines().map(|line| format!("`{line}`")).collect::<Vec<_>>().join(" · ")
}

/// A page in Markdown.
pub fn markdown(page: &Page) -> String {
    let mut text = format!("# {}\n\n{}\n", page.title, page.introduction.join("\n\n"));
    for figure in &page.figures {
        write!(text, "\n## {}\n\n{}\n\n", figure.heading(), figure.remark()).expect("a String grows");
        write!(text, "![{0}](fig{1}.png)\n\n", figure.title, figure.id).expect("a String grows");
        let rows = statement_rows(&figure.statements);
        if rows.len() > 1 {
            text.push_str(&markdown_table(&rows));
            text.push('\n');
        }
        for command in figure.commands() {
            writeln!(text, "    {command}").expect("a String grows");
        }
    }
    for table in &page.tables {
        write!(text, "\n## {}\n\n{}\n\n", table.title, table.text).expect("a String grows");
        text.push_str(&markdown_table(&table.rows));
    }
    if !page.ending.is_empty() {
        write!(text, "\n{}\n", page.ending).expect("a String grows");
    }
    text
}

/// A page in HTML.
pub fn html(page: &Page) -> String {
    const STYLE: &str = "\
body { font: 16px/1.5 sans-serif; color: #222; background: #fff; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
img { max-width: 100%; height: auto } table { border-collapse: collapse; margin: 1rem 0 }
td, th { border: 1px solid #bbb; padding: .3rem .6rem; text-align: left; vertical-align: top; font-size: 14px }
.differs { background: #fdebd8 } pre { background: #f4f4f4; padding: .6rem; overflow-x: auto; font-size: 13px }";
    let title = page.title;
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title}</title>\n<style>\n{STYLE}\n</style></head>\n<body>\n<h1>{title}</h1>\n",
    );
    let paragraph = |paragraph: &String| format!("<p>{}</p>\n", inline(paragraph));
    text.extend(page.introduction.iter().map(paragraph));
    for figure in &page.figures {
        let (id, title) = (&figure.id, xml(&figure.title));
        write!(
            text,
            "<h2>{}</h2>\n<p>{}</p>\n<p><a href=\"fig{id}.svg\"><img src=\"fig{id}.png\" alt=\"{title}\"></a></p>\n",
            xml(&figure.heading()),
            inline(&figure.remark()),
        )
        .expect("a String grows");
        let rows = statement_rows(&figure.statements);
        if rows.len() > 1 {
            text.push_str(&html_table(&rows));
        }
        let commands: Vec<String> = figure.commands().map(xml).collect();
        if !commands.is_empty() {
            writeln!(text, "<pre>{}</pre>", commands.join("\n")).expect("a String grows");
        }
    }
    for table in &page.tables {
        write!(text, "<h2>{}</h2>\n<p>{}</p>\n", xml(&table.title), inline(&table.text))
            .expect("a String grows");
        text.push_str(&html_table(&table.rows));
    }
    if !page.ending.is_empty() {
        text.push_str(&paragraph(&page.ending));
    }
    text.push_str("</body>\n</html>\n");
    text
}

fn summary(figures: &[Figure]) -> String {
    let count = |verdict| figures.iter().flat_map(|f| &f.statements).filter(|s| s.verdict == verdict).count();
    let differing: Vec<&str> = figures
        .iter()
        .filter(|figure| figure.statements.iter().any(|s| s.verdict == Verdict::Differs))
        .map(|figure| figure.id.as_str())
        .collect();
    format!(
        "Of {} statements of the paper {} agree with what was computed and {} differ (Figs. {}); each of these has a convergence \
         check or a closed form beside it.",
        count(Verdict::Agrees) + count(Verdict::Differs),
        count(Verdict::Agrees),
        count(Verdict::Differs),
        differing.join(", "),
    )
}

fn statement_rows(statements: &[Statement]) -> Vec<Vec<String>> {
    let mut rows = vec![["the paper", "computed", "", "check"].map(str::to_owned).to_vec()];
    for s in statements {
        rows.push(vec![s.paper.clone(), s.computed.clone(), s.verdict.name().to_owned(), s.check.clone()]);
    }
    rows
}

fn markdown_table(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let cells: Vec<String> = row.iter().map(|cell| cell.replace('|', "\\|")).collect();
        writeln!(text, "| {} |", cells.join(" | ")).expect("a String grows");
        if i == 0 {
            writeln!(text, "|{}", " --- |".repeat(row.len())).expect("a String grows");
        }
    }
    text
}

fn html_table(rows: &[Vec<String>]) -> String {
    let mut text = "<table>\n".to_owned();
    for (i, row) in rows.iter().enumerate() {
        let tag = if i == 0 { "th" } else { "td" };
        let class =
            if row.iter().any(|cell| cell == Verdict::Differs.name()) { " class=\"differs\"" } else { "" };
        let cells: String = row.iter().map(|cell| format!("<{tag}>{}</{tag}>", inline(cell))).collect();
        writeln!(text, "<tr{class}>{cells}</tr>").expect("a String grows");
    }
    text + "</table>\n"
}

/// Text with `code` and *emphasis*.
fn inline(text: &str) -> String {
    let mut html = String::new();
    for (i, part) in xml(text).split('`').enumerate() {
        if i % 2 == 1 {
            write!(html, "<code>{part}</code>").expect("a String grows");
            continue;
        }
        for (j, part) in part.split('*').enumerate() {
            if j % 2 == 1 { write!(html, "<em>{part}</em>") } else { write!(html, "{part}") }
                .expect("a String grows");
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use percuss_picture::{Curve, Panel};

    use super::*;
    use crate::figure::statement;

    #[test]
    fn cut_curves_are_named() {
        let curve = |name: &str, top| Curve {
            name: name.into(),
            points: vec![(0.0, top), (2.0, 90.0)],
            ..Curve::default()
        };
        let panel = Panel {
            curves: vec![curve("low", 1.0), curve("high", 7.25)],
            x_range: Some((0.0, 1.0)),
            y_range: Some((0.0, 5.0)),
            ..Panel::default()
        };
        let figure = Figure { text: "A remark.".into(), panels: vec![panel], ..Figure::default() };
        assert_eq!(figure.remark(), "A remark. The vertical axis ends at 5, which cuts high (highest 7.2).");
    }

    #[test]
    fn both_pages_say_the_same() {
        let figure = Figure {
            id: "0".into(),
            title: "a < b".into(),
            statements: vec![statement("1", "2 | 3", Verdict::Differs, "`x` and *y*")],
            ..Figure::default()
        };
        let page = Page {
            ending: "*The* end.".into(),
            figures: vec![figure],
            ..Page::of_the_paper(Vec::new(), Vec::new())
        };
        let pages = (markdown(&page), html(&page));
        assert!(pages.0.ends_with("\n*The* end.\n") && pages.1.contains("<p><em>The</em> end.</p>"));
        assert!(pages.0.contains("| 1 | 2 \\| 3 | differs | `x` and *y* |"), "{}", pages.0);
        assert!(pages.1.contains("<td>2 | 3</td>") && pages.1.contains("<em>y</em>"), "{}", pages.1);
        assert!(pages.1.contains("a &lt; b") && pages.1.contains("class=\"differs\""));
    }
}
