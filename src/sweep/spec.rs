//! What is varied: lists, ranges, tables and samples of the values of keys, as texts of case files.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize, de::Error};
use toml::Value;

use super::{MAX_CASES, SweepError};
use crate::{
    case::{quantity_si, split_number},
    geometry::Geometry,
    input::read_text,
};

/// Values of keys that vary together, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis {
    pub keys: Vec<String>,
    /// Their values, each as it stands in a case file, shape `(rows, keys)`.
    pub rows: Vec<Vec<String>>,
}

/// How several variations go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// Every value of each with all of the others; the last varies fastest.
    #[default]
    Product,
    /// The first values of all, then the second.
    Zip,
    /// A Latin hypercube: in every range each of as many equal parts is hit once.
    Lhs(Samples),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, { samples = 100, seed = 1 }")]
pub struct Samples {
    #[serde(deserialize_with = "count")]
    pub samples: u64,
    #[serde(deserialize_with = "count")]
    pub seed: u64,
}

/// A whole number, or an error in words of TOML.
fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    let value = Value::deserialize(deserializer)?;
    let count = value.as_integer().and_then(|count| u64::try_from(count).ok());
    count.ok_or_else(|| D::Error::custom(format!("{value} is no whole number from 0 on")))
}

/// A variation as it is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
#[serde(expecting = "a [[vary]] has `key` and `values`, or `file`, or `keys` and `rows`")]
pub enum Vary {
    Key {
        key: String,
        /// A list, or a range `from:to:count[:log]` as a text.
        values: Value,
    },
    /// A CSV file: a column for each key, a row for each case.
    File { file: PathBuf },
    /// A table: what a file says once it has been read.
    Table {
        keys: Vec<String>,
        /// The values, row by row, each as it stands in a case file.
        rows: Vec<Vec<String>>,
    },
}

impl Vary {
    /// Reads an argument of `--vary`, `KEY=SPEC` or the name of a CSV file.
    pub fn parse(text: &str) -> Self {
        match text.split_once('=') {
            Some((key, values)) => {
                Self::Key { key: key.trim().into(), values: Value::String(values.trim().into()) }
            }
            None => Self::File { file: text.into() },
        }
    }

    /// The same with files read, so that it stands by itself.
    ///
    /// * `folder`: of relative paths
    pub fn resolved(self, folder: &Path) -> Result<Self, SweepError> {
        match self {
            Self::File { file } => {
                let path = folder.join(file);
                let Axis { keys, rows } = read_table(&path)?;
                Ok(Self::Table { keys, rows })
            }
            other => Ok(other),
        }
    }

    /// Why it is none.
    ///
    /// * `what`: what is wrong, and what is possible
    fn refuse(&self, what: &str) -> SweepError {
        let spec = match self {
            Self::Key { key, values: Value::String(values) } => format!("{key}={values}"),
            Self::Key { key, values } => format!("{key}={values}"),
            Self::File { file } => file.display().to_string(),
            Self::Table { keys, .. } => keys.join(","),
        };
        SweepError::Usage(format!("--vary {spec}: {what}"))
    }

    fn axis(&self) -> Result<Axis, SweepError> {
        let column = |key: &String, values: Vec<String>| Axis {
            keys: vec![key.clone()],
            rows: values.into_iter().map(|value| vec![value]).collect(),
        };
        let axis = match self {
            Self::Key { key, .. } if key.is_empty() => {
                return Err(self.refuse("the key is missing: KEY=VALUES"));
            }
            Self::Key { key, values: Value::String(text) } => match Range::parse(text) {
                Some(range) => {
                    column(key, range.and_then(|range| range.values()).map_err(|what| self.refuse(&what))?)
                }
                None => column(key, split(text)),
            },
            Self::Key { key, values: Value::Array(values) } => {
                column(key, values.iter().map(Value::to_string).collect())
            }
            Self::Key { key, values } => column(key, vec![values.to_string()]),
            Self::Table { keys, rows } => Axis { keys: keys.clone(), rows: rows.clone() },
            Self::File { .. } => return Err(self.refuse("the file has not been read")),
        };
        if axis.rows.is_empty() || axis.rows.iter().flatten().any(String::is_empty) {
            return Err(self.refuse(
                "a value is missing; a list is 1,2,5, a range FROM:TO:COUNT or FROM:TO:COUNT:log, a table the name of a CSV file",
            ));
        }
        match axis.rows.iter().find(|row| row.len() != axis.keys.len()) {
            Some(row) => {
                Err(self.refuse(&format!("a row has {} values for {} keys", row.len(), axis.keys.len())))
            }
            None => Ok(axis),
        }
    }

    /// The key and the range of one that varies continuously.
    pub fn range(&self) -> Result<(String, Range), SweepError> {
        let wanted = || self.refuse("a range is needed: KEY=FROM:TO or KEY=FROM:TO:log");
        let Self::Key { key, values: Value::String(text) } = self else { return Err(wanted()) };
        let range = Range::parse(text).ok_or_else(wanted)?.map_err(|what| self.refuse(&what))?;
        if range.count.is_some() {
            return Err(self.refuse("this range has no count of its own: FROM:TO or FROM:TO:log"));
        }
        Ok((key.clone(), range))
    }
}

/// The axes of a sweep: a case is a row of each.
pub fn axes(vary: &[Vary], combine: Combine) -> Result<Vec<Axis>, SweepError> {
    if vary.is_empty() {
        return Err(SweepError::Usage("nothing is varied: add --vary KEY=VALUES".into()));
    }
    let axes = match combine {
        Combine::Lhs(Samples { samples, seed }) => {
            let ranges = vary.iter().map(Vary::range).collect::<Result<Vec<_>, _>>()?;
            vec![latin_hypercube(ranges, samples, seed)?]
        }
        Combine::Product => vary.iter().map(Vary::axis).collect::<Result<Vec<_>, _>>()?,
        Combine::Zip => vec![zip(vary.iter().map(Vary::axis).collect::<Result<Vec<_>, _>>()?)?],
    };
    let keys: Vec<&String> = axes.iter().flat_map(|axis| &axis.keys).collect();
    if let Some((_, key)) = keys.iter().enumerate().find(|(i, key)| keys[..*i].contains(key)) {
        return Err(SweepError::Usage(format!("`{key}` is varied twice: keep one of them")));
    }
    let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.rows.len()));
    match count.filter(|count| *count <= MAX_CASES) {
        Some(_) => Ok(axes),
        None => {
            let counts: Vec<String> = axes.iter().map(|axis| axis.rows.len().to_string()).collect();
            let text = format!(
                "{} cases are more than the {MAX_CASES} of a sweep; vary less at a time",
                counts.join(" x ")
            );
            Err(SweepError::Usage(text))
        }
    }
}

fn zip(axes: Vec<Axis>) -> Result<Axis, SweepError> {
    let rows = axes[0].rows.len();
    if let Some(other) = axes.iter().find(|axis| axis.rows.len() != rows) {
        let text = format!(
            "--zip pairs values one by one, but `{}` has {rows} and `{}` has {}",
            axes[0].keys.join(","),
            other.keys.join(","),
            other.rows.len()
        );
        return Err(SweepError::Usage(text));
    }
    let row = |i: usize| axes.iter().flat_map(|axis| axis.rows[i].clone()).collect();
    Ok(Axis {
        keys: axes.iter().flat_map(|axis| axis.keys.clone()).collect(),
        rows: (0..rows).map(row).collect(),
    })
}

/// A range of numbers, with a unit or without.
#[derive(Clone, Debug)]
pub struct Range {
    /// Its ends \[unit\].
    ends: [f64; 2],
    /// As they are written, with their units.
    written: [String; 2],
    /// Empty for plain numbers.
    pub unit: String,
    count: Option<usize>,
    is_log: bool,
}

impl Range {
    /// Reads `FROM:TO[:COUNT][:log]`; `None` if the text is none at all, or why it is a wrong one.
    pub fn parse(text: &str) -> Option<Result<Self, String>> {
        let mut parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let is_log = parts.last() == Some(&"log");
        parts.truncate(parts.len() - usize::from(is_log));
        let (from, to, count) = match parts[..] {
            [from, to] => (from, to, None),
            [from, to, count] => (from, to, Some(count)),
            _ => return None,
        };
        let split = |end| number(end).map_or_else(|| split_number(end), |_| Some((end, "")));
        let ((a, from_unit), (b, unit)) = (split(from)?, split(to)?);
        let (from_unit, unit) = (from_unit.trim(), unit.trim());
        let range = || {
            let read = |text: &str| {
                let number = number(text).filter(|x| x.is_finite());
                number.ok_or_else(|| format!("`{text}` is no number"))
            };
            let (ends, unit, written) = if from_unit.is_empty() {
                ([read(a)?, read(b)?], unit, [format!("{a} {unit}"), to.to_owned()])
            } else if from_unit == unit {
                ([read(a)?, read(b)?], unit, [from.to_owned(), to.to_owned()])
            } else {
                let other =
                    || format!("both ends of a range are of one kind, not in `{from_unit}` and `{unit}`");
                let (ends, unit) = same_kind(from, to).ok_or_else(other)?;
                (ends, unit, [from.to_owned(), to.to_owned()])
            };
            let written = written.map(|end| end.trim().to_owned());
            let count = count
                .map(|count| match count.parse() {
                    Ok(count @ 1..=MAX_CASES) => Ok(count),
                    _ => Err(format!("`{count}` is no count of values, 1 to {MAX_CASES}")),
                })
                .transpose()?;
            if is_log && !(ends[0] > 0.0 && ends[1] > 0.0) {
                return Err("a logarithmic range has ends above 0".into());
            }
            if ends[0] == ends[1] && count != Some(1) {
                return Err(format!("the range is empty: it begins and ends at {from}"));
            }
            Ok(Self { ends, written, unit: unit.into(), count, is_log })
        };
        Some(range())
    }

    /// The number at a share of the range, rounded to 12 digits, which leave no trace of how it was computed.
    pub fn at(&self, share: f64) -> f64 {
        let [a, b] = self.ends;
        let x = if self.is_log { a * libm::pow(b / a, share) } else { a + (b - a) * share };
        format!("{x:.11e}").parse().unwrap_or(x)
    }

    /// Change of the number with the share, by magnitude.
    pub fn slope(&self, share: f64) -> f64 {
        let [a, b] = self.ends;
        if self.is_log { (self.at(share) * libm::log(b / a)).abs() } else { (b - a).abs() }
    }

    /// The number at a share as it stands in a case file.
    pub fn text_at(&self, share: f64) -> String {
        self.text(&format!("{:?}", self.at(share)))
    }

    fn text(&self, number: &str) -> String {
        if self.unit.is_empty() { number.into() } else { format!("{number} {}", self.unit) }
    }

    fn values(&self) -> Result<Vec<String>, String> {
        let count = self.count.ok_or("a range has a count: FROM:TO:COUNT or FROM:TO:COUNT:log")?;
        let value = |i: usize| match i {
            0 => self.written[0].clone(),
            i if i + 1 == count => self.written[1].clone(),
            i => self.text_at(i as f64 / (count - 1) as f64),
        };
        Ok((0..count).map(value).collect())
    }
}

/// A plain number as a case file may have it: `0x10`, `1_000`, too.
pub fn number(text: &str) -> Option<f64> {
    let in_toml = || match text.parse().ok()? {
        Value::Integer(number) => Some(number as f64),
        Value::Float(number) => Some(number),
        _ => None,
    };
    text.parse().ok().or_else(in_toml)
}

/// Two quantities of one dimension, in its SI unit.
fn same_kind(a: &str, b: &str) -> Option<([f64; 2], &'static str)> {
    [Geometry::Axisymmetric, Geometry::Plane].into_iter().find_map(|geometry| {
        let ((a, unit), (b, other)) = (quantity_si(a, geometry)?, quantity_si(b, geometry)?);
        (unit == other).then_some(([a, b], unit))
    })
}

/// The values of a list, cut at commas outside of brackets and quotes.
fn split(text: &str) -> Vec<String> {
    let (mut values, mut depth, mut quote, mut escaped) = (vec![String::new()], 0, None, false);
    for c in text.chars() {
        // as in a text of TOML: \" does not end it
        let is_escaped = escaped;
        escaped = quote == Some('"') && c == '\\' && !is_escaped;
        match (quote, c) {
            _ if is_escaped => {}
            (Some(open), c) if c == open => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            _ => {}
        }
        match c {
            ',' if depth == 0 && quote.is_none() => values.push(String::new()),
            c => values.last_mut().expect("there is one").push(c),
        }
    }
    values.iter().map(|value| value.trim().to_owned()).collect()
}

fn read_table(path: &Path) -> Result<Axis, SweepError> {
    let fail = SweepError::unread(path);
    let text = read_text(path).map_err(|error| fail(error.to_string()))?;
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let texts = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let keys = texts(reader.headers().map_err(|error| fail(error.to_string()))?);
    if let [key] = &keys[..]
        && key.contains(';')
    {
        return Err(fail("its columns are between semicolons: a CSV file has commas there".into()));
    }
    if keys.iter().any(String::is_empty) {
        return Err(fail("the first line names the key of every column".into()));
    }
    let rows = reader.records().map(|record| Ok(texts(&record?))).collect::<csv::Result<Vec<_>>>();
    Ok(Axis { keys, rows: rows.map_err(|error| fail(error.to_string()))? })
}

/// A Latin hypercube: every range is cut into as many parts as there are samples, in its own scale, and every part has one sample, at a random
/// place in it and in a random order.
fn latin_hypercube(ranges: Vec<(String, Range)>, samples: u64, seed: u64) -> Result<Axis, SweepError> {
    let known = usize::try_from(samples).ok().filter(|samples| (1..=MAX_CASES).contains(samples));
    let Some(samples) = known else {
        return Err(SweepError::Usage(format!("--lhs {samples}: 1 to {MAX_CASES} samples")));
    };
    let mut random = Random(seed);
    let mut rows = vec![Vec::with_capacity(ranges.len()); samples];
    for (_, range) in &ranges {
        let mut parts: Vec<usize> = (0..samples).collect();
        for i in (1..samples).rev() {
            parts.swap(i, random.below(i + 1));
        }
        for (row, part) in rows.iter_mut().zip(parts) {
            let share = (part as f64 + random.unit()) / samples as f64;
            row.push(range.text_at(share));
        }
    }
    Ok(Axis { keys: ranges.into_iter().map(|(key, _)| key).collect(), rows })
}

/// SplitMix64: the same numbers everywhere and in every version.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to below 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number below `count`.
    fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_random_numbers_are_those_of_splitmix64() {
        let mut random = Random(1_234_567);
        assert_eq!([random.next(), random.next()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    fn values(spec: &str) -> Result<Vec<String>, String> {
        let axis = Vary::parse(spec).axis().map_err(|error| error.to_string())?;
        Ok(axis.rows.into_iter().map(|row| row.join("|")).collect())
    }

    #[test]
    fn lists_and_ranges_are_values() {
        for (spec, expected) in [
            ("m=1,2,5,10", vec!["1", "2", "5", "10"]),
            ("m=steel, \"glass, hard\"", vec!["steel", "\"glass, hard\""]),
            ("p=[0.0, 0.5],[1]", vec!["[0.0, 0.5]", "[1]"]),
            (r#"m="3\" a","4\\","5, 6""#, vec![r#""3\" a""#, r#""4\\""#, "\"5, 6\""]),
            ("m=0.1:0.4:4", vec!["0.1", "0.2", "0.3", "0.4"]),
            ("m=1:100:3:log", vec!["1", "10.0", "100"]),
            ("m=1 g:3 g:3", vec!["1 g", "2.0 g", "3 g"]),
            ("m=1:3 g:2", vec!["1 g", "3 g"]),
            ("m=1 g:1 kg:4:log", vec!["1 g", "0.01 kg", "0.1 kg", "1 kg"]),
            ("m=1 kg/m:1 g/cm:2", vec!["1 kg/m", "1 g/cm"]),
            ("m=5:5:1", vec!["5"]),
            ("m=0x10:0b100000:3", vec!["0x10", "24.0", "0b100000"]),
            ("m=1_000:2_000:2", vec!["1_000", "2_000"]),
        ] {
            assert_eq!(
                values(spec),
                Ok(expected.iter().map(|value| (*value).to_owned()).collect()),
                "{spec}"
            );
        }
    }

    #[test]
    fn wrong_variations_say_what_is_possible() {
        for (spec, expected) in [
            ("m=", "a value is missing"),
            ("m=1,,2", "a value is missing"),
            ("=1,2", "the key is missing"),
            ("m=1:1:5", "the range is empty"),
            ("m=1:2", "a range has a count"),
            ("m=1:2:0", "no count of values"),
            ("m=1:2:1000000000", "no count of values"),
            ("m=0:2:5:log", "ends above 0"),
            ("m=1 g:2 m:5", "of one kind, not in `g` and `m`"),
        ] {
            let error = values(spec).expect_err(spec);
            assert!(error.contains(expected) && error.contains(spec), "{error}");
        }
    }

    fn together(specs: &[&str], combine: Combine) -> Result<Vec<Axis>, String> {
        let vary: Vec<Vary> = specs.iter().map(|spec| Vary::parse(spec)).collect();
        axes(&vary, combine).map_err(|error| error.to_string())
    }

    #[test]
    fn variations_can_be_combined() {
        let error = |specs: &[&str], combine| together(specs, combine).expect_err("an error");
        assert!(
            error(&["a=1:2:1000", "b=1:2:1000", "c=1,2"], Combine::Product).contains("1000 x 1000 x 2 cases")
        );
        assert!(error(&["a=1,2", "a=3"], Combine::Product).contains("`a` is varied twice"));
        assert!(error(&["a=1,2", "b=1,2,3"], Combine::Zip).contains("`a` has 2 and `b` has 3"));
        assert!(error(&[], Combine::Product).contains("nothing is varied"));
        let lhs = Combine::Lhs(Samples { samples: 5, seed: 1 });
        assert!(error(&["a=1,2"], lhs).contains("a range is needed"));
        assert!(error(&["a=1:2:5"], lhs).contains("no count"));
        let zipped = together(&["a=1,2", "b=3,4"], Combine::Zip).expect("axes");
        assert_eq!(zipped[0].rows, [["1", "3"], ["2", "4"]]);
    }

    #[test]
    fn a_latin_hypercube_hits_every_part_once() {
        let lhs = |seed| together(&["a=0:1", "b=1 g:100 g:log"], Combine::Lhs(Samples { samples: 50, seed }));
        let axes = lhs(7).expect("axes");
        let parts = |column: usize, share: fn(f64) -> f64| {
            let number = |row: &Vec<String>| split_number(&row[column]).expect("a number").0.parse::<f64>();
            let part = |row| (50.0 * share(number(row).expect("a number"))) as usize;
            let mut parts: Vec<usize> = axes[0].rows.iter().map(part).collect();
            parts.sort_unstable();
            parts
        };
        let all: Vec<usize> = (0..50).collect();
        assert_eq!(parts(0, |x| x), all);
        assert_eq!(parts(1, |x| x.log10() / 2.0), all);
        assert_eq!(lhs(7), Ok(axes));
        assert_ne!(lhs(8), lhs(7));
    }
}
