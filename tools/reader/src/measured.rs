//! Tables as recordings: what was measured beside what was computed.
//!
//! ```text
//! time [ms],force [kN]            topic of the other recording that has a field `force`, in s and N
//! time,/drag.force,/velocity.velocity
//! ```
//!
//! Every row is a message at its `time`, every other column a field. Columns without a topic belong to that of the other recording with
//! most fields of their names. Units with a prefix become those without, as they are recorded; columns without one are in the unit of
//! the field.

use std::{
    collections::{BTreeMap, HashSet},
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::Args;
use mcap::records::MessageHeader;
use percuss_table::{Cell, Heading};
use prost_reflect::{
    prost::{Message, encoding},
    prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, OneofDescriptorProto,
        field_descriptor_proto::{Label, Type},
    },
};

use crate::{
    channel::Channel,
    convention::{self, TIME},
    failure::Failure,
    field::place_and_field,
    messages::Recording,
    prefix::plain,
    recording::Limits,
    tabular,
};

/// A column and the field that it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rename {
    column: String,
    field: String,
}

impl FromStr for Rename {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((column, field)) if !column.is_empty() && !field.is_empty() => {
                Ok(Self { column: column.into(), field: field.into() })
            }
            _ => Err("write a column and the field that it is, as in load=force".into()),
        }
    }
}

/// How recordings are opened that may be tables.
#[derive(Args, Clone, Debug, Default)]
pub struct Sources {
    /// A column of a table (CSV, Parquet, JSON lines) and the field of the recording that it is, load=force or load=/drag.force;
    /// may be repeated
    #[arg(long = "rename", value_name = "COLUMN=FIELD")]
    renames: Vec<Rename>,
    /// True if a table is opened as a recording.
    #[arg(skip)]
    takes_tables: bool,
    /// The recording whose topics the columns of tables belong to.
    #[arg(skip)]
    like: Option<PathBuf>,
    /// Added to the times of tables, in the unit of the recording.
    #[arg(skip)]
    pub offset: f64,
}

/// True for the name of a table.
pub fn is_table(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| tabular::EXTENSIONS.contains(&extension.as_str()))
}

impl Sources {
    /// The same for some files: columns of the tables among them are fields of the first that is none.
    ///
    /// # Errors
    ///
    /// Columns are renamed where there is no table.
    pub fn among<'a>(&self, mut files: impl Iterator<Item = &'a PathBuf> + Clone) -> Result<Self, String> {
        if !files.clone().any(|file| is_table(file)) {
            if let Some(Rename { column, field }) = self.renames.first() {
                return Err(format!("--rename {column}={field} is for a table: there is none"));
            }
            if self.offset != 0.0 {
                return Err(format!("--time-offset {} is for a table: there is none", self.offset));
            }
        }
        let like = files.find(|file| !is_table(file)).cloned();
        Ok(Self { takes_tables: true, like, ..self.clone() })
    }

    /// Opens a recording, or a table as one.
    ///
    /// # Errors
    ///
    /// It cannot be read, or its columns are not those of the other.
    pub fn open(&self, path: &Path, limits: Limits) -> Result<Recording, Failure> {
        if !(self.takes_tables && is_table(path)) {
            return Recording::open(path, limits);
        }
        let like = self.like.as_ref().map(|like| Recording::open(like, limits)).transpose()?;
        let unfit = |reason: String| Failure::Usage(format!("`{}`: {reason}", path.display()));
        let mut table = tabular::read(path, None, limits)?;
        let known = names(&table.headings);
        for Rename { column, field } in &self.renames {
            let heading = table.headings.iter_mut().find(|heading| heading.name == *column);
            // several tables need not have the same columns
            if let Some(heading) = heading {
                heading.name.clone_from(field);
            }
        }
        let time = table.headings.iter().position(|heading| heading.name == TIME);
        let time = time.ok_or_else(|| {
            unfit(format!("it has no column `{TIME}` but {known}; say which it is, --rename COLUMN={TIME}"))
        })?;
        if let Some(cell) = table.columns[time].iter().find(|cell| cell.number().is_none()) {
            return Err(unfit(format!("its column `{TIME}` has a row without a number: `{cell}`")));
        }
        let channels = channels(&table.headings, time, like.as_ref()).map_err(unfit)?;
        let rate = like.as_ref().and_then(|like| convention::playback_rate(like.entries(convention::RUN)?));
        let failed = |error: String| unfit(format!("it cannot be taken as a recording: {error}"));
        if let Some(like) = &like {
            take_units(&mut table.headings, time, &channels, like);
        }
        let file = write(&table, time, &channels, (rate.unwrap_or(1.0), self.offset)).map_err(failed)?;
        Recording::of(file, path, limits)
    }
}

/// Names of columns in words.
fn names(headings: &[Heading]) -> String {
    headings.iter().map(|heading| heading.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Columns by the topics that they belong to, each with its field.
type Channels = BTreeMap<String, Vec<(usize, String)>>;

/// * `time`: the column of the times
fn channels(headings: &[Heading], time: usize, like: Option<&Recording>) -> Result<Channels, String> {
    let (mut channels, mut plain) = (Channels::new(), Vec::new());
    for (column, Heading { name, .. }) in headings.iter().enumerate().filter(|(column, _)| *column != time) {
        let (place, field) = place_and_field(name);
        match place.strip_suffix('.').filter(|topic| topic.starts_with('/')) {
            Some(topic) => {
                channels.entry(topic.to_owned()).or_default().push((column, field.to_owned()));
            }
            None => plain.push((column, name.clone())),
        }
    }
    let mut names = HashSet::new();
    if let Some(twice) = headings.iter().find(|heading| !names.insert(heading.name.as_str())) {
        return Err(format!("it has two columns `{}`; rename one of them", twice.name));
    }
    if headings.len() < 2 {
        return Err(format!("it has no column but `{TIME}`"));
    }
    if plain.is_empty() {
        return Ok(channels);
    }
    let topic = match like {
        None => "/table".to_owned(),
        Some(like) => {
            let count = |(_, channel): &(&u16, &Channel)| {
                let has =
                    |name: &str| channel.layout.as_ref().is_some_and(|layout| layout.find(name).is_some());
                plain.iter().filter(|(_, name)| has(name)).count()
            };
            // the first of several
            let best = like.channels.iter().rev().max_by_key(count).filter(|channel| count(channel) > 0);
            let topic = best.map(|(_, channel)| channel.topic.clone());
            topic.ok_or_else(|| {
                let names = plain.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(", ");
                format!(
                    "no topic of `{}` has a field {names}; name the columns like its fields, --rename COLUMN=FIELD",
                    like.path.display()
                )
            })?
        }
    };
    channels.entry(topic).or_default().extend(plain);
    Ok(channels)
}

/// Numbers without a unit are in that of the recording.
fn take_units(headings: &mut [Heading], time: usize, channels: &Channels, like: &Recording) {
    for (topic, columns) in channels {
        let Some(channel) = like.channels.values().find(|channel| channel.topic == *topic) else { continue };
        for (column, field) in
            columns.iter().map(|(column, field)| (*column, field.as_str())).chain([(time, TIME)])
        {
            let unit = &mut headings[column].unit;
            *unit = unit.take().or_else(|| channel.unit(field).map(str::to_owned));
        }
    }
}

/// Writes a table as a recording that has no name.
///
/// * `rate`: seconds of the log for a unit of time
/// * `offset`: added to the times
fn write(
    table: &tabular::Table,
    time: usize,
    channels: &Channels,
    (rate, offset): (f64, f64),
) -> Result<std::fs::File, String> {
    let text = |error: mcap::McapError| error.to_string();
    let file = tempfile::tempfile().map_err(|error| error.to_string())?;
    let copy = file.try_clone().map_err(|error| error.to_string())?;
    let mut writer = mcap::Writer::new(std::io::BufWriter::new(copy)).map_err(text)?;
    let kinds: Vec<Type> =
        table.headings.iter().zip(&table.columns).map(|(heading, cells)| kind(heading, cells)).collect();
    let number = |column: usize, row: usize| {
        let value = table.columns[column][row].number()?;
        let unit = table.headings[column].unit.as_deref().and_then(plain);
        Some(unit.map_or(value, |(power, _)| scaled(value, power)))
    };
    let mut ids = Vec::new();
    for (topic, columns) in channels {
        let fields = [(time, TIME.to_owned())].into_iter().chain(columns.iter().cloned());
        let may_lack = |column: usize| column != time && table.columns[column].contains(&Cell::Empty);
        // in proto3 a field that may be missing is alone in a group
        let lacking = columns.iter().filter(|(column, _)| may_lack(*column));
        let groups: Vec<String> = lacking.map(|(_, name)| format!("_{name}")).collect();
        let field = |(i, (column, name)): (usize, (usize, String))| FieldDescriptorProto {
            number: Some(i as i32 + 1),
            label: Some(Label::Optional.into()),
            r#type: Some(kinds[column].into()),
            proto3_optional: may_lack(column).then_some(true),
            oneof_index: may_lack(column)
                .then(|| groups.iter().position(|group| group[1..] == name).unwrap_or(0) as i32),
            name: Some(name),
            ..FieldDescriptorProto::default()
        };
        let group = |name: &String| OneofDescriptorProto { name: Some(name.clone()), options: None };
        let message = DescriptorProto {
            name: Some("Row".into()),
            field: fields.clone().enumerate().map(field).collect(),
            oneof_decl: groups.iter().map(group).collect(),
            ..DescriptorProto::default()
        };
        let descriptors = FileDescriptorProto {
            name: Some("row.proto".into()),
            syntax: Some("proto3".into()),
            message_type: vec![message],
            ..FileDescriptorProto::default()
        };
        let set = FileDescriptorSet { file: vec![descriptors] }.encode_to_vec();
        let unit = |(column, name): (usize, String)| {
            let unit = table.headings[column].unit.as_deref()?;
            Some((convention::unit(&name), plain(unit).map_or(unit, |(_, base)| base).to_owned()))
        };
        let schema = writer.add_schema("Row", "protobuf", &set).map_err(text)?;
        let metadata = fields.filter_map(unit).collect();
        ids.push(writer.add_channel(schema, topic, "protobuf", &metadata).map_err(text)?);
    }
    for row in 0..table.columns[time].len() {
        let Some(at) = number(time, row).map(|time| time + offset) else { continue };
        let log_time = (at * rate * 1e9).round().max(0.0) as u64;
        for (&channel_id, columns) in ids.iter().zip(channels.values()) {
            let mut data = Vec::new();
            encoding::double::encode(1, &at, &mut data);
            for (i, (column, _)) in columns.iter().enumerate() {
                let tag = i as u32 + 2;
                match (&table.columns[*column][row], kinds[*column]) {
                    (Cell::Empty, _) => {}
                    (Cell::Bool(truth), Type::Bool) => encoding::bool::encode(tag, truth, &mut data),
                    (Cell::Int(count), Type::Int64) => encoding::int64::encode(tag, count, &mut data),
                    (Cell::UInt(count), Type::Uint64) => encoding::uint64::encode(tag, count, &mut data),
                    (Cell::Int(count), Type::Uint64) => {
                        encoding::uint64::encode(tag, &count.unsigned_abs(), &mut data);
                    }
                    (cell, Type::String) => encoding::string::encode(tag, &cell.to_string(), &mut data),
                    _ => number(*column, row)
                        .into_iter()
                        .for_each(|value| encoding::double::encode(tag, &value, &mut data)),
                }
            }
            let header = MessageHeader { channel_id, sequence: row as u32, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &data).map_err(text)?;
        }
    }
    writer.finish().map_err(text)?;
    Ok(file)
}

/// Of a column: texts if any cell is one, or nothing else holds all cells, and whole numbers if all are, without a prefix.
fn kind(heading: &Heading, cells: &[Cell]) -> Type {
    let any = |fits: fn(&Cell) -> bool| cells.iter().any(fits);
    let is_scaled = heading.unit.as_deref().and_then(plain).is_some_and(|(power, _)| power != 0);
    if any(|cell| matches!(cell, Cell::Text(_))) {
        Type::String
    } else if any(|cell| matches!(cell, Cell::Bool(_))) {
        if any(|cell| cell.number().is_some()) { Type::String } else { Type::Bool }
    } else if is_scaled
        || heading.name == TIME
        || any(|cell| matches!(cell, Cell::Float(_) | Cell::Double(_)))
    {
        Type::Double
    } else if !any(|cell| matches!(cell, Cell::UInt(_))) {
        Type::Int64
    } else if any(|cell| matches!(cell, Cell::Int(..0))) {
        Type::String
    } else {
        Type::Uint64
    }
}

/// A number times a power of ten, rounded once: only whole powers are exact.
fn scaled(value: f64, power: i32) -> f64 {
    if power < 0 { value / 10f64.powi(-power) } else { value * 10f64.powi(power) }
}
