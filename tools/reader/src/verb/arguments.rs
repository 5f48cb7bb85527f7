//! Arguments that are the same for several verbs: fields of topics, formats of tables.

use clap::{
    Args, ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use percuss_table::{Sink, csv::Csv, parquet::Parquet, units::LENGTH};

use crate::{
    field::{Positions, Selection},
    format::{
        aligned::Aligned,
        json::Json,
        npy::{Npy, Shape},
        sac::Sac,
    },
    prefix::typed,
    recording::Limits,
    select::Pattern,
};

/// Which fields of which topics.
#[derive(Clone, Debug, Args)]
pub struct Chosen {
    /// Topics, separated by commas; `*` stands for anything [default: /drag of percuss, else the first with
    /// numbers; plot --at-time: /interface/stress]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    pub(crate) topics: Vec<Pattern>,
    /// Fields, separated by commas: name, a.b.c, list[3].name, map[key], name@r=0.5, name@r=0,z=0.5 [default: all]
    #[arg(long = "field", value_name = "NAME")]
    fields: Vec<String>,
    /// Positions on the axis of arrays, r=0,0.5,0.9, or points of matrices, r=0,z=0.5, interpolated; may be repeated. One
    /// coordinate of a matrix is a line over the other. With or without a unit, r=0.1mm
    #[arg(long, value_name = "R=LIST")]
    at: Vec<Positions>,
}

/// The names in a list separated by commas; positions go on behind theirs: `a,b@r=0,z=0.5,c` is `a`, `b@r=0,z=0.5`, `c`.
fn split_fields(text: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for item in text.split(',') {
        let is_position = (item.contains('=') && !item.contains('@')) || typed(item, LENGTH).is_ok();
        match names.last_mut().filter(|last| is_position && last.contains('@')) {
            Some(last) => {
                last.push(',');
                last.push_str(item);
            }
            None => names.push(item.to_owned()),
        }
    }
    names
}

impl Chosen {
    /// Fields and positions.
    pub(crate) fn selection(&self) -> Selection {
        Selection {
            fields: self.fields.iter().flat_map(|text| split_fields(text)).collect(),
            at: self.at.clone(),
            for_curves: false,
        }
    }
}

/// Name and version of the program, for files that say what made them.
const PROGRAM: &str = concat!("percuss-read ", env!("CARGO_PKG_VERSION"));

/// Units of SI columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum UnitChoice {
    /// With the prefix that suits the largest number of a column: µs, kN, MPa
    #[default]
    Prefixed,
    /// As they are recorded: s, N, Pa
    Base,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// Aligned columns, numbers of five digits
    Text,
    /// Comma-separated values, names and units in the first line
    Csv,
    /// One document: units by column, and a list of rows
    Json,
    /// One JSON object per line
    Jsonl,
    /// Apache Parquet, units in its metadata
    Parquet,
    /// One NumPy matrix of all columns
    Npy,
    /// NumPy arrays, one per column; of one topic with a field, a profile or a line, all of it over time, z and r, with these
    Npz,
    /// SAC, a trace of seismology: the first of the fields, m and m/s as nm and nm/s
    Sac,
}

impl TableFormat {
    /// Those of a row for every time, by extension.
    pub(crate) const TRACE: [(&'static str, Self); 8] = [
        ("csv", Self::Csv),
        ("jsonl", Self::Jsonl),
        ("ndjson", Self::Jsonl),
        ("json", Self::Jsonl),
        ("parquet", Self::Parquet),
        ("npy", Self::Npy),
        ("npz", Self::Npz),
        ("sac", Self::Sac),
    ];
    /// Those of a row for every recording, by extension.
    pub(crate) const SUMMARY: [(&'static str, Self); 4] =
        [("txt", Self::Text), ("csv", Self::Csv), ("json", Self::Json), ("parquet", Self::Parquet)];

    /// Takes one of some formats from the command line.
    pub(crate) fn among(known: &[(&str, Self)]) -> impl TypedValueParser<Value = Self> {
        let is_known = |format: &&Self| known.iter().any(|(_, known)| known == *format);
        let values = Self::value_variants().iter().filter(is_known).filter_map(ValueEnum::to_possible_value);
        PossibleValuesParser::new(values.collect::<Vec<_>>())
            .map(|name| Self::from_str(&name, false).expect("one of the possible values"))
    }

    /// True if people read it: SI units get prefixes.
    pub(crate) fn is_for_reading(self) -> bool {
        matches!(self, Self::Text | Self::Csv)
    }

    pub(crate) fn sink<'a>(
        self,
        output: &'a mut (dyn std::io::Write + Send),
        limits: Limits,
    ) -> Box<dyn Sink + 'a> {
        match self {
            Self::Text => Box::new(Aligned::new(output)),
            Self::Csv => Box::new(Csv::new(output)),
            Self::Json => Box::new(Json::document(output)),
            Self::Jsonl => Box::new(Json::lines(output)),
            Self::Parquet => Box::new(Parquet::new(output, PROGRAM, limits.kept())),
            Self::Npy => Box::new(Npy::new(output, Shape::Matrix, limits.memory)),
            Self::Npz => Box::new(Npy::new(output, Shape::Archive, limits.memory)),
            Self::Sac => Box::new(Sac::new(output, limits.kept())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_stay_with_their_field() {
        assert_eq!(split_fields("a,b.c[2]"), ["a", "b.c[2]"]);
        assert_eq!(split_fields("a@r=0,0.5,b@r=1,z=2,c"), ["a@r=0,0.5", "b@r=1,z=2", "c"]);
        assert_eq!(split_fields("a@r=0,0.5mm,b"), ["a@r=0,0.5mm", "b"]);
    }
}
