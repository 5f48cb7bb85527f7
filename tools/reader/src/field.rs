//! Fields of messages: names, units and axes from channel metadata, and what to take of a message into a row.

use prost_reflect::{DynamicMessage, FieldDescriptor, Kind, Value};

use crate::{
    axis::{Axis, at},
    overview::Channel,
    table::{Cell, Heading},
};

/// Largest number of columns an array is spread over.
pub const MAX_COLUMNS: usize = 10_000;

/// Which fields of a topic are wanted.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Names of fields, or `name[index]`; all plain fields and arrays if empty.
    pub fields: Vec<String>,
    /// Positions on the axes of arrays.
    pub at: Option<Positions>,
}

/// Positions `r=0,0.5,0.9`.
#[derive(Clone, Debug, PartialEq)]
pub struct Positions {
    /// Name of the coordinate.
    pub coordinate: String,
    /// The positions.
    pub values: Vec<f64>,
}

impl std::str::FromStr for Positions {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (coordinate, list) = text.split_once('=').ok_or("write positions as r=0,0.5,0.9")?;
        let parse = |item: &str| match item.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("`{item}` is not a number")),
        };
        let values = list.split(',').map(parse).collect::<Result<_, _>>()?;
        Ok(Self { coordinate: coordinate.trim().into(), values })
    }
}

/// Why a selection does not fit a channel.
#[derive(Debug, thiserror::Error)]
pub enum SelectionError {
    /// There is no such field.
    #[error("`{topic}` has no field `{field}`; it has {known}")]
    UnknownField {
        /// Topic.
        topic: String,
        /// Name asked for.
        field: String,
        /// Names that exist.
        known: String,
    },
    /// A field has no axis to choose positions on.
    #[error("no array of `{topic}` has an axis named `{coordinate}` to choose positions on")]
    NoAxis {
        /// Topic.
        topic: String,
        /// Coordinate asked for.
        coordinate: String,
    },
    /// A field cannot be put into a cell.
    #[error("`{field}` of `{topic}` is {what}; {hint}")]
    NotACell {
        /// Topic.
        topic: String,
        /// Field.
        field: String,
        /// What it is.
        what: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// An array would take too many columns.
    #[error("`{field}` has up to {length} elements; choose some with --at or --field {field}[0],{field}[1]")]
    TooMany {
        /// Field.
        field: String,
        /// Its length.
        length: usize,
    },
    /// The messages cannot be decoded.
    #[error(
        "messages of `{topic}` are {encoding} with schema `{schema}`; only protobuf with a sound schema is read"
    )]
    NotProtobuf {
        /// Topic.
        topic: String,
        /// Encoding.
        encoding: String,
        /// Schema.
        schema: String,
    },
}

/// One column: how to find its cell in a message.
#[derive(Clone, Debug)]
pub struct Column {
    /// Name and unit.
    pub heading: Heading,
    take: Take,
}

#[derive(Clone, Debug)]
enum Take {
    LogTime,
    Field(FieldDescriptor),
    Element { field: FieldDescriptor, index: usize },
    At { field: FieldDescriptor, axis: Axis, even: bool, position: f64 },
}

/// Columns of a channel, the time first.
///
/// * `longest`: gives the greatest length of an array field over all messages; asked only where it is needed
///
/// # Errors
///
/// The selection does not fit the channel.
pub fn columns(
    channel: &Channel,
    selection: &Selection,
    longest: &mut dyn FnMut(&FieldDescriptor) -> usize,
) -> Result<Vec<Column>, SelectionError> {
    let message = channel.message.as_ref().ok_or_else(|| SelectionError::NotProtobuf {
        topic: channel.topic.clone(),
        encoding: channel.encoding.clone(),
        schema: channel.schema.clone(),
    })?;
    let picker = Picker { channel, at: selection.at.as_ref() };
    let time = message.get_field_by_name("time").filter(|field| is_scalar(field) && is_number(field));
    let mut columns = vec![match &time {
        Some(field) => picker.plain(field),
        None => {
            let heading = Heading { name: "log_time".into(), unit: Some("s".into()) };
            Column { heading, take: Take::LogTime }
        }
    }];
    if selection.fields.is_empty() {
        let hidden = channel.axis_parts();
        for field in message.fields().filter(|field| Some(field) != time.as_ref()) {
            if is_cell(&field) && !hidden.contains(&field.name()) {
                columns.extend(picker.all(&field, longest)?);
            }
        }
    }
    for name in &selection.fields {
        columns.extend(picker.named(message, name, longest)?);
    }
    let positioned = columns.iter().any(|column| matches!(column.take, Take::At { .. }));
    match &selection.at {
        Some(at) if !positioned => {
            Err(SelectionError::NoAxis { topic: channel.topic.clone(), coordinate: at.coordinate.clone() })
        }
        _ => Ok(columns),
    }
}

struct Picker<'a> {
    channel: &'a Channel,
    at: Option<&'a Positions>,
}

impl Picker<'_> {
    fn heading(&self, field: &FieldDescriptor, name: String) -> Heading {
        Heading { name, unit: self.channel.unit(field.name()).map(str::to_owned) }
    }

    fn plain(&self, field: &FieldDescriptor) -> Column {
        Column { heading: self.heading(field, field.name().into()), take: Take::Field(field.clone()) }
    }

    /// All of a field: a scalar, or an array at the chosen positions, at its listed positions, or element by element.
    /// Matrices are left out.
    fn all(
        &self,
        field: &FieldDescriptor,
        longest: &mut dyn FnMut(&FieldDescriptor) -> usize,
    ) -> Result<Vec<Column>, SelectionError> {
        if is_scalar(field) {
            return Ok(vec![self.plain(field)]);
        }
        let axis = Axis::of(field, self.channel);
        if let Some(at) = self.at.filter(|at| axis.is_named(&at.coordinate)) {
            let symmetry = self.channel.metadata.get(&format!("symmetry.{}", field.name()));
            let even = symmetry.is_some_and(|symmetry| symmetry == "even");
            let column = |&position: &f64| Column {
                heading: self.heading(field, format!("{}@{}={position}", field.name(), at.coordinate)),
                take: Take::At { field: field.clone(), axis: axis.clone(), even, position },
            };
            return Ok(at.values.iter().map(column).collect());
        }
        let element = |index: usize, name: String| Column {
            heading: self.heading(field, name),
            take: Take::Element { field: field.clone(), index },
        };
        match axis {
            Axis::Listed(positions) => {
                let name = |position: &f64| format!("{}@r={position}", field.name());
                Ok(positions.iter().enumerate().map(|(index, r)| element(index, name(r))).collect())
            }
            Axis::Matrix => Ok(Vec::new()),
            Axis::Uniform { .. } | Axis::Unknown => {
                let length = longest(field);
                if length > MAX_COLUMNS {
                    return Err(SelectionError::TooMany { field: field.name().into(), length });
                }
                Ok((0..length).map(|index| element(index, format!("{}[{index}]", field.name()))).collect())
            }
        }
    }

    /// A field asked for by name: `name` or `name[index]`.
    fn named(
        &self,
        message: &prost_reflect::MessageDescriptor,
        name: &str,
        longest: &mut dyn FnMut(&FieldDescriptor) -> usize,
    ) -> Result<Vec<Column>, SelectionError> {
        let (base, index) = match name.strip_suffix(']').and_then(|rest| rest.split_once('[')) {
            Some((base, index)) => (base, index.parse::<usize>().ok()),
            None => (name, None),
        };
        let topic = || self.channel.topic.clone();
        let found = message.get_field_by_name(base).filter(|_| index.is_some() || base == name);
        let field = found.ok_or_else(|| {
            let known: Vec<String> = message.fields().map(|field| field.name().to_owned()).collect();
            SelectionError::UnknownField { topic: topic(), field: name.into(), known: known.join(", ") }
        })?;
        let refuse = |what, hint| SelectionError::NotACell { topic: topic(), field: name.into(), what, hint };
        if !is_cell(&field) {
            return Err(refuse("a nested message or bytes", "choose a field of numbers or text"));
        }
        match index {
            Some(_) if is_scalar(&field) => Err(refuse("not an array", "leave out the index")),
            Some(index) => Ok(vec![Column {
                heading: self.heading(&field, name.into()),
                take: Take::Element { field, index },
            }]),
            None if matches!(Axis::of(&field, self.channel), Axis::Matrix) => {
                Err(refuse("a matrix", "choose elements as name[index]"))
            }
            None => self.all(&field, longest),
        }
    }
}

fn is_scalar(field: &FieldDescriptor) -> bool {
    !field.is_list() && !field.is_map()
}

fn is_number(field: &FieldDescriptor) -> bool {
    !matches!(field.kind(), Kind::Bool | Kind::String | Kind::Bytes | Kind::Message(_) | Kind::Enum(_))
}

/// True if the field, or its elements, can stand in a cell.
fn is_cell(field: &FieldDescriptor) -> bool {
    !field.is_map() && !matches!(field.kind(), Kind::Message(_) | Kind::Bytes)
}

impl Column {
    /// The cell of this column for a message.
    ///
    /// * `log_time`: log time of the message \[ns\]
    pub fn cell(&self, message: &DynamicMessage, log_time: u64) -> Cell {
        match &self.take {
            Take::LogTime => Cell::Double(log_time as f64 * 1e-9),
            Take::Field(field) if field.supports_presence() && !message.has_field(field) => Cell::Empty,
            Take::Field(field) => cell(field, &message.get_field(field)),
            Take::Element { field, index } => match message.get_field(field).as_list() {
                Some(list) => list.get(*index).map_or(Cell::Empty, |value| cell(field, value)),
                None => Cell::Empty,
            },
            Take::At { field, axis, even, position } => {
                let value = message.get_field(field);
                let list = value.as_list().unwrap_or_default();
                at(list, field, &axis.place(message), *even, *position).map_or(Cell::Empty, Cell::Double)
            }
        }
    }
}

/// A value as a cell; empty for bytes, messages and collections.
pub(crate) fn cell(field: &FieldDescriptor, value: &Value) -> Cell {
    match value {
        Value::Bool(value) => Cell::Bool(*value),
        Value::I32(value) => Cell::Int(i64::from(*value)),
        Value::I64(value) => Cell::Int(*value),
        Value::U32(value) => Cell::UInt(u64::from(*value)),
        Value::U64(value) => Cell::UInt(*value),
        Value::F32(value) => Cell::Float(*value),
        Value::F64(value) => Cell::Double(*value),
        Value::String(value) => Cell::Text(value.clone()),
        Value::EnumNumber(number) => match field.kind() {
            Kind::Enum(kind) => match kind.get_value(*number) {
                Some(value) => Cell::Text(value.name().into()),
                None => Cell::Int(i64::from(*number)),
            },
            _ => Cell::Int(i64::from(*number)),
        },
        Value::Bytes(_) | Value::Message(_) | Value::List(_) | Value::Map(_) => Cell::Empty,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost_reflect::DescriptorPool;
    use prost_reflect::prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    };
    use std::collections::BTreeMap;

    /// `message P { double time = 1; double r0 = 2; double dr = 3; repeated double p = 4; }`
    fn channel(metadata: &[(&str, &str)]) -> Channel {
        let field = |name: &str, number, label: Label| FieldDescriptorProto {
            name: Some(name.into()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(Type::Double.into()),
            ..Default::default()
        };
        let message = DescriptorProto {
            name: Some("P".into()),
            field: vec![
                field("time", 1, Label::Optional),
                field("r0", 2, Label::Optional),
                field("dr", 3, Label::Optional),
                field("p", 4, Label::Repeated),
            ],
            ..Default::default()
        };
        let file = FileDescriptorProto {
            name: Some("p.proto".into()),
            syntax: Some("proto3".into()),
            message_type: vec![message],
            ..Default::default()
        };
        let pool = DescriptorPool::from_file_descriptor_set(FileDescriptorSet { file: vec![file] });
        Channel {
            topic: "/p".into(),
            schema: "P".into(),
            encoding: "protobuf".into(),
            metadata: metadata
                .iter()
                .map(|(k, v)| (k.to_string(), v.to_string()))
                .collect::<BTreeMap<_, _>>(),
            message: pool.expect("a sound schema").get_message_by_name("P"),
            count: 0,
            span: None,
        }
    }

    fn message(channel: &Channel, p: &[f64]) -> DynamicMessage {
        let mut message = DynamicMessage::new(channel.message.clone().expect("a type"));
        message.set_field_by_name("r0", Value::F64(0.05));
        message.set_field_by_name("dr", Value::F64(0.1));
        message.set_field_by_name("p", Value::List(p.iter().copied().map(Value::F64).collect()));
        message
    }

    fn cells(channel: &Channel, at: &str, p: &[f64]) -> Vec<Cell> {
        let selection = Selection { at: Some(at.parse().expect("positions")), ..Selection::default() };
        let columns = columns(channel, &selection, &mut |_| 3).expect("a selection");
        columns.iter().skip(1).map(|column| column.cell(&message(channel, p), 0)).collect()
    }

    #[test]
    fn uniform_axes_are_interpolated() {
        let even = channel(&[("axis.p", "r0,dr"), ("symmetry.p", "even")]);
        let plain = channel(&[("axis.p", "r0,dr")]);
        let p = [1.0, 2.0, 4.0];
        let near = |cell: &Cell, value: f64| (cell.number().expect("a number") - value).abs() < 1e-12;
        let got = cells(&even, "r=0,0.05,0.2,0.29,0.31", &p);
        assert!(near(&got[0], (9.0 * p[0] - p[1]) / 8.0));
        assert!(near(&got[1], 1.0) && near(&got[2], 3.0) && near(&got[3], 4.0));
        assert_eq!(got[4], Cell::Empty);
        assert!(near(&cells(&plain, "r=0", &p)[0], 1.0));
        assert_eq!(cells(&plain, "r=0", &[]), [Cell::Empty]);
        assert!(near(&cells(&plain, "r=0.08", &[7.0])[0], 7.0));
    }

    #[test]
    fn listed_axes_are_interpolated_inside() {
        let listed = channel(&[("axis.p", "0,0.5,1")]);
        // r0 and dr are plain fields here and come first
        let got = cells(&listed, "r=0.5,0.75,1.1", &[1.0, 2.0, 4.0]);
        assert_eq!(got[2..], [Cell::Double(2.0), Cell::Double(3.0), Cell::Empty]);
    }

    #[test]
    fn axis_fields_are_no_columns_and_units_are_found() {
        let channel = channel(&[("axis.p", "r0,dr"), ("unit.p", "Pa")]);
        let columns = columns(&channel, &Selection::default(), &mut |_| 2).expect("columns");
        let names: Vec<String> = columns.iter().map(|column| column.heading.with_unit()).collect();
        assert_eq!(names, ["time", "p[0] [Pa]", "p[1] [Pa]"]);
    }

    #[test]
    fn misfits_are_explained() {
        let channel = channel(&[]);
        let select = |field: &str, at: Option<&str>| {
            let fields = if field.is_empty() { Vec::new() } else { vec![field.to_owned()] };
            let at = at.map(|at| at.parse().expect("positions"));
            columns(&channel, &Selection { fields, at }, &mut |_| 20_000).expect_err("a misfit").to_string()
        };
        assert!(select("q", None).contains("time, r0, dr, p"));
        assert!(select("p[x]", None).contains("no field `p[x]`"));
        assert!(select("r0[1]", None).contains("not an array"));
        assert!(select("", Some("r=1")).contains("axis named `r`") || select("p", None).contains("20000"));
        assert!("0,1".parse::<Positions>().is_err());
    }
}
