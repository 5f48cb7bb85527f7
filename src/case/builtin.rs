//! The built-in cases: every figure of \[KA\], and some of them in the full theory, a physical case, layered targets and what others measured and computed, as case
//! files like any other.
//!
//! A case that extends another one has only its own lines: comments at its head and keys, in place of those of the other case.

macro_rules! cases {
    ($($name:literal $(extends $base:literal)?),* $(,)?) => {
        /// Name, text and base of every built-in case, in the order of the paper, those of the full theory, in SI units, of layers, of bodies and of experiments last.
        const CASES: &[(&str, &str, Option<&str>)] = &[$((
            $name,
            include_str!(concat!("builtin/", $name, ".toml")),
            { let base: &[&str] = &[$($base)?]; base.first().copied() },
        )),*];
    };
}

cases!(
    "fig2",
    "fig2a" extends "fig2",
    "fig2-prescribed" extends "fig2",
    "fig3",
    "fig4",
    "fig5",
    "fig5-plane" extends "fig5",
    "fig6a",
    "fig6b" extends "fig6a",
    "fig6c",
    "fig6d" extends "fig6c",
    "fig7a" extends "fig6a",
    "fig7b" extends "fig6c",
    "fig8-m2.5" extends "fig8-m5",
    "fig8-m5",
    "fig8-m10" extends "fig8-m5",
    "fig9-m1" extends "fig9-m5",
    "fig9-m2.5" extends "fig9-m5",
    "fig9-m5",
    "fig9-m10" extends "fig9-m5",
    "fig9-m100" extends "fig9-m5",
    "fig9-minf" extends "fig9-m5",
    "elastic-fig2" extends "fig2",
    "elastic-fig2-prescribed" extends "fig2-prescribed",
    "elastic-fig3" extends "fig3",
    "elastic-fig4" extends "fig4",
    "elastic-fig5" extends "fig5",
    "elastic-fig5-plane" extends "fig5-plane",
    "elastic-fig6a" extends "fig6a",
    "elastic-fig7b" extends "fig7b",
    "elastic-fig8-m2.5" extends "elastic-fig8-m5",
    "elastic-fig8-m5" extends "fig8-m5",
    "elastic-fig8-m10" extends "elastic-fig8-m5",
    "ball",
    "laminate-armour",
    "laminate-glass",
    "coating",
    "coating-soft",
    "layers",
    "laminate-carbon",
    "disc",
    "bar",
    "experiment-aluminium",
    "experiment-aluminium-plate",
    "experiment-gabbro",
    "experiment-gabbro-plate",
    "experiment-glass",
    "experiment-steel",
    "experiment-steel-plate",
    "experiment-zener",
    "experiment-zener-pmma" extends "experiment-zener",
    "experiment-zener-pmma-4mm" extends "experiment-zener-pmma",
    "experiment-bars",
    "experiment-half-space",
    "experiment-layered",
);

/// Names of the built-in cases.
pub fn names() -> impl Iterator<Item = &'static str> {
    CASES.iter().map(|(name, ..)| *name)
}

/// Text of a built-in case.
pub fn find(name: &str) -> Option<String> {
    let (_, text, base) = CASES.iter().find(|(known, ..)| *known == name)?;
    match base {
        None => Some((*text).to_owned()),
        Some(base) => Some(extended(&find(base)?, text)),
    }
}

/// A case with the lines of another one in place of its own.
fn extended(base: &str, own: &str) -> String {
    let skipped = |line: &&str| own.starts_with('#') && line.starts_with('#');
    let mut lines: Vec<&str> = base.lines().skip_while(skipped).collect();
    let (mut section, mut comments) = (0, 0);
    for line in own.lines().filter(|line| !line.is_empty()) {
        let end = lines[section..].iter().position(|line| line.starts_with('['));
        let end = end.map_or(lines.len(), |end| section + end);
        let key = |line: &str| line.split(" = ").next().map(str::to_owned);
        if line.starts_with('#') {
            lines.insert(comments, line);
            comments += 1;
        } else if line.starts_with('[') {
            section = 1 + lines.iter().position(|known| *known == line).expect("a section of the base");
        } else if let Some(known) = lines[section..end].iter_mut().find(|known| key(known) == key(line)) {
            *known = line;
        } else {
            let blank = lines[section..end].iter().rev().take_while(|line| line.is_empty()).count();
            lines.insert(end - blank, line);
        }
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_case_replace_those_of_its_base() {
        let base = "# one\n# two\na = 1\n\n[s]\nb = 2 # more\nc = 3\n\n[t]\nb = 4\n";
        let own = "# own\na = 5\n\n[s]\nb = 6\nd = 7\n";
        let text = "# own\na = 5\n\n[s]\nb = 6\nc = 3\nd = 7\n\n[t]\nb = 4\n";
        assert_eq!(extended(base, own), text);
        assert_eq!(extended(base, "[t]\nb = 8\n"), base.replace("b = 4", "b = 8"));
    }
}
