//! Formats of tables.

use clap::{
    ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use percuss_table::{Sink, csv::Csv, parquet::Parquet};

use crate::{
    format::{
        aligned::Aligned,
        json::Json,
        json_lines::JsonLines,
        npy::{Npy, Shape},
        sac::Sac,
    },
    recording::Limits,
};

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

/// A format of tables.
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

    /// What takes the rows.
    pub(crate) fn sink<'a>(
        self,
        output: &'a mut (dyn std::io::Write + Send),
        limits: Limits,
    ) -> Box<dyn Sink + 'a> {
        match self {
            Self::Text => Box::new(Aligned::new(output)),
            Self::Csv => Box::new(Csv::new(output)),
            Self::Json => Box::new(Json::new(output)),
            Self::Jsonl => Box::new(JsonLines::new(output)),
            Self::Parquet => Box::new(Parquet::new(output, PROGRAM, limits.kept())),
            Self::Npy => Box::new(Npy::new(output, Shape::Matrix, limits.memory)),
            Self::Npz => Box::new(Npy::new(output, Shape::Archive, limits.memory)),
            Self::Sac => Box::new(Sac::new(output, limits.kept())),
        }
    }
}
