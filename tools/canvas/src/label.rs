//! Labels with subscripts and superscripts: `γc_p²`, `sigma_zz`, `10^-3`.

/// Height of a part of a label against the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// On the line.
    Base,
    /// Subscript.
    Sub,
    /// Superscript.
    Super,
}

/// Longest subscript: longer ones are the words of a name, as in `u_boot`.
const LONGEST: usize = 3;

/// Characters within which the `_` of a symbol stands: the longest name of a Greek letter and one more.
const LONGEST_NAME: usize = 8;

/// Greek letters that names spell out.
const GREEK: [(&str, char); 14] = [
    ("alpha", 'α'),
    ("beta", 'β'),
    ("gamma", 'γ'),
    ("delta", 'δ'),
    ("epsilon", 'ε'),
    ("eta", 'η'),
    ("theta", 'θ'),
    ("lambda", 'λ'),
    ("mu", 'µ'),
    ("nu", 'ν'),
    ("rho", 'ρ'),
    ("sigma", 'σ'),
    ("tau", 'τ'),
    ("phi", 'φ'),
];

/// Letters and the subscripts that Unicode has for them.
const SUBSCRIPTS: (&str, &str) = ("0123456789aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ");

/// The same of superscripts.
const SUPERSCRIPTS: (&str, &str) = ("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻");

/// The parts of a label.
///
/// A subscript is up to three letters or digits after `_`, behind a single letter or the name of a Greek one; a superscript
/// is a whole number after `^`. Other names with `_`, as `contact_radius`, stay as they are.
pub fn parts(label: &str) -> Vec<(Level, String)> {
    let text: Vec<char> = label.chars().collect();
    let mut parts: Vec<(Level, String)> = Vec::new();
    let mut push = |level: Level, piece: &[char]| match parts.last_mut().filter(|last| last.0 == level) {
        Some(last) => last.1.extend(piece),
        None => parts.push((level, piece.iter().collect())),
    };
    let mut i = 0;
    while i < text.len() {
        let is_start = i == 0 || !(text[i - 1].is_ascii_alphanumeric() || text[i - 1] == '_');
        if let Some((base, subscript)) = symbol(&text[i..]).filter(|_| is_start) {
            push(Level::Base, &[base.1]);
            push(Level::Sub, subscript);
            i += base.0 + 1 + subscript.len();
        } else if let Some(power) = power(&text[i..]) {
            push(Level::Super, &power);
            i += 1 + power.len();
        } else {
            push(Level::Base, &text[i..=i]);
            i += 1;
        }
    }
    parts
}

/// A letter with a subscript: how many characters spell the letter, the letter, the subscript.
fn symbol(text: &[char]) -> Option<((usize, char), &[char])> {
    let length = text.iter().take(LONGEST_NAME).position(|&c| c == '_')?;
    let word: String = text[..length].iter().collect();
    let letter = match text[..length] {
        [letter] if letter.is_alphabetic() => letter,
        _ => GREEK.iter().find(|(name, _)| *name == word)?.1,
    };
    let rest = &text[length + 1..];
    let end = rest.iter().position(|c| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
    let is_short = (1..=LONGEST).contains(&end) && rest.get(end) != Some(&'_');
    is_short.then_some(((length, letter), &rest[..end]))
}

/// A whole number after `^`, with a proper minus.
fn power(text: &[char]) -> Option<Vec<char>> {
    let (&'^', rest) = text.split_first()? else { return None };
    let sign = usize::from(matches!(rest.first(), Some('-' | '−')));
    let digits = rest[sign..].iter().take_while(|c| c.is_ascii_digit()).count();
    (digits > 0)
        .then(|| ['−'].into_iter().take(sign).chain(rest[sign..sign + digits].iter().copied()).collect())
}

/// A label in plain Unicode, with the subscripts and superscripts that it has.
pub fn plain(label: &str) -> String {
    let map = |text: &str, (from, to): (&str, &str)| -> Option<String> {
        text.chars().map(|c| to.chars().nth(from.chars().position(|known| known == c)?)).collect()
    };
    let part = |(level, text): (Level, String)| match level {
        Level::Base => text,
        Level::Sub => map(&text, SUBSCRIPTS).unwrap_or_else(|| format!("_{text}")),
        Level::Super => map(&text, SUPERSCRIPTS).unwrap_or_else(|| format!("^{text}")),
    };
    parts(label).into_iter().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_have_subscripts_and_names_do_not() {
        for (label, expected) in [
            ("drag [πR²γc_p²]", "drag [πR²γcₚ²]"),
            ("time [R/c_p]", "time [R/cₚ]"),
            ("sigma_zz", "σ_zz"),
            ("p = −σ_zz [γc_p²]", "p = −σ_zz [γcₚ²]"),
            ("β = c_s/c_p", "β = cₛ/cₚ"),
            ("10^-3 m^2", "10⁻³ m²"),
            ("contact_radius", "contact_radius"),
            ("fig5_a_b, a_longer, x^y, _, a_", "fig5_a_b, a_longer, x^y, _, a_"),
        ] {
            assert_eq!(plain(label), expected);
        }
        let base = |text: &str| (Level::Base, text.to_owned());
        let sub = |text: &str| (Level::Sub, text.to_owned());
        assert_eq!(parts("sigma_zz/c_p²"), [base("σ"), sub("zz"), base("/c"), sub("p"), base("²")]);
    }
}
