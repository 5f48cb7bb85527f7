//! Sums of numbers and names, such as `6 + 2*floor(j/7)`, and texts with sums in them.

/// What is left of a sum, and what its names stand for.
struct Sum<'a> {
    rest: &'a str,
    names: &'a dyn Fn(&str) -> Option<f64>,
}

impl Sum<'_> {
    /// Takes one of these signs, if it is the next.
    fn sign(&mut self, signs: &[&'static str]) -> Option<&'static str> {
        self.rest = self.rest.trim_start();
        let sign = signs.iter().find(|sign| self.rest.starts_with(**sign))?;
        self.rest = &self.rest[sign.len()..];
        Some(sign)
    }

    fn value(&mut self) -> f64 {
        self.level(&[&["=="], &["+", "-"], &["*", "/"]])
    }

    /// A value of these signs, those that bind least first.
    fn level(&mut self, signs: &[&[&'static str]]) -> f64 {
        let Some((first, others)) = signs.split_first() else { return self.factor() };
        let mut value = self.level(others);
        while let Some(sign) = self.sign(first) {
            let other = self.level(others);
            value = match sign {
                "==" => f64::from(value == other),
                "+" => value + other,
                "-" => value - other,
                "*" => value * other,
                _ => value / other,
            };
        }
        value
    }

    fn factor(&mut self) -> f64 {
        if self.sign(&["-"]).is_some() {
            return -self.factor();
        }
        if self.sign(&["("]).is_some() {
            let value = self.value();
            self.sign(&[")"]).expect("a bracket");
            return value;
        }
        self.rest = self.rest.trim_start();
        let is_exponent =
            |i: usize| self.rest[..i].ends_with('e') && self.rest.starts_with(|c: char| c.is_ascii_digit());
        let end = self.rest.char_indices().find(|&(i, c)| {
            !(c.is_ascii_alphanumeric() || matches!(c, '.' | '_') || c == '-' && is_exponent(i))
        });
        let (word, rest) = self.rest.split_at(end.map_or(self.rest.len(), |(i, _)| i));
        self.rest = rest;
        if word.starts_with(|c: char| c.is_ascii_digit()) {
            return word.parse().expect("a number");
        }
        if self.sign(&["("]).is_none() {
            let known = match word {
                "nan" => Some(f64::NAN),
                "inf" => Some(f64::INFINITY),
                name => (self.names)(name),
            };
            return known.unwrap_or_else(|| panic!("no number is named `{word}`"));
        }
        let mut arguments = vec![self.value()];
        while self.sign(&[","]).is_some() {
            arguments.push(self.value());
        }
        self.sign(&[")"]).expect("a bracket");
        match (word, &arguments[..]) {
            ("wave", [x]) => crate::forge::wave(*x),
            ("floor", [x]) => x.floor(),
            ("next", [x]) => x.next_up(),
            ("next_float", [x]) => (*x as f32).next_up().into(),
            ("mod", [x, y]) => x.rem_euclid(*y),
            // no number, of other bits than the usual one
            ("odd_nan", [x]) => f64::from_bits(f64::NAN.to_bits() | *x as u64),
            ("less", [x, y]) => f64::from(x < y),
            ("if", [0.0, _, no]) => *no,
            ("if", [_, yes, _]) => *yes,
            // the one of this number among those behind it
            ("pick", [i, values @ ..]) => values[*i as usize],
            _ => panic!("no function `{word}` of {} numbers", arguments.len()),
        }
    }
}

/// The value of a sum.
pub fn value(text: &str, names: &dyn Fn(&str) -> Option<f64>) -> f64 {
    let mut sum = Sum { rest: text, names };
    let value = sum.value();
    assert!(sum.rest.trim().is_empty(), "`{}` is left of `{text}`", sum.rest);
    value
}

/// A text with the values of the sums that stand in it as `<SUM>`, or as `<N of SUM>` for a list of N; `<N times TEXT>` repeats a text.
///
/// * `i`: named so; `j` counts the elements of lists
pub fn filled(text: &str, i: u64) -> String {
    let number = |sum: &str, j: usize| {
        let value = value(sum, &|name| match name {
            "i" => Some(i as f64),
            "j" => Some(j as f64),
            _ => None,
        });
        if value.fract() == 0.0 { format!("{value:.0}") } else { format!("{value:?}") }
    };
    let mut parts = text.split('<');
    let mut result = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (sum, rest) = part.split_once('>').expect("a sum ends");
        if let Some((count, text)) = sum.split_once(" times ") {
            result += &text.repeat(count.parse().expect("a number"));
            result += rest;
            continue;
        }
        result += &match sum.split_once(" of ") {
            // seconds since 1970 of a message every 0.1 s
            _ if sum == "stamp" => format!("2023-11-14T22:13:2{}.{}Z", i / 10, i % 10),
            Some((count, sum)) => {
                let count = number(count, 0).parse().expect("a number");
                format!("[{}]", (0..count).map(|j| number(sum, j)).collect::<Vec<_>>().join(","))
            }
            None => number(sum, 0),
        };
        result += rest;
    }
    result
}
