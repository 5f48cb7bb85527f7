//! Fields of messages: names, units and axes from channel metadata, and what to take of a message into a row.

use prost_reflect::EnumDescriptor;

use crate::{
    axis::{Axis, at},
    overview::Channel,
    table::{Cell, Heading, Kind},
    wire::{COUNT, Layout, List, Type, UNKNOWN, Values},
};

/// Largest number of columns an array is spread over.
pub const MAX_COLUMNS: usize = 10_000;

/// Which fields of a topic are wanted.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Fields: `a.b.c`, `name[index]`, `name@r=position`; all plain fields and arrays if empty.
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
    /// The leaf it is taken from; `None` for the log time.
    pub leaf: Option<usize>,
    take: Take,
}

#[derive(Clone, Debug)]
enum Take {
    LogTime,
    Single { enumeration: Option<EnumDescriptor> },
    Element { index: usize, enumeration: Option<EnumDescriptor> },
    At { axis: Axis, even: bool, position: f64 },
}

/// Leaf of the time of a message: a plain double named `time`.
pub fn time_leaf(layout: &Layout) -> Option<usize> {
    let leaf = layout.find("time")?;
    (layout.leaves[leaf].is_single && layout.leaves[leaf].kind.is_number()).then_some(leaf)
}

/// Columns of a channel, the time first.
///
/// * `longest`: gives the greatest length of the list of a leaf over all messages; asked only where it is needed
///
/// # Errors
///
/// The selection does not fit the channel.
pub fn columns(
    channel: &Channel,
    selection: &Selection,
    longest: &mut dyn FnMut(usize) -> usize,
) -> Result<Vec<Column>, SelectionError> {
    let layout = channel.layout.as_deref().ok_or_else(|| SelectionError::NotProtobuf {
        topic: channel.topic.clone(),
        encoding: channel.encoding.clone(),
        schema: channel.schema.clone(),
    })?;
    let picker = Picker { channel, layout, at: selection.at.as_ref() };
    let time = time_leaf(layout);
    let mut columns = vec![match time {
        Some(leaf) => picker.plain(leaf),
        None => {
            let heading = Heading { name: "log_time".into(), unit: Some("s".into()), kind: Kind::Double };
            Column { heading, leaf: None, take: Take::LogTime }
        }
    }];
    if selection.fields.is_empty() {
        let hidden = channel.axis_parts();
        for (index, leaf) in layout.leaves.iter().enumerate() {
            let is_hidden = hidden.contains(&leaf.path.as_str()) || leaf.path.ends_with(COUNT);
            if Some(index) != time && leaf.kind != Type::Bytes && !is_hidden {
                columns.extend(picker.all(index, longest)?);
            }
        }
    }
    for name in &selection.fields {
        columns.extend(picker.named(name, longest)?);
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
    layout: &'a Layout,
    at: Option<&'a Positions>,
}

impl Picker<'_> {
    fn column(&self, leaf: usize, name: String, take: Take) -> Column {
        let unit = self.channel.unit(&self.layout.leaves[leaf].path).map(str::to_owned);
        let kind = match (&take, &self.layout.leaves[leaf].kind) {
            (Take::At { .. } | Take::LogTime, _) | (_, Type::Double) => Kind::Double,
            (_, Type::Float) => Kind::Float,
            (_, Type::Int) => Kind::Int,
            (_, Type::UInt) => Kind::UInt,
            (_, Type::Bool) => Kind::Bool,
            (_, Type::Enum(_) | Type::Text | Type::Bytes) => Kind::Text,
        };
        Column { heading: Heading { name, unit, kind }, leaf: Some(leaf), take }
    }

    fn plain(&self, leaf: usize) -> Column {
        let enumeration = self.enumeration(leaf);
        self.column(leaf, self.layout.leaves[leaf].path.clone(), Take::Single { enumeration })
    }

    fn enumeration(&self, leaf: usize) -> Option<EnumDescriptor> {
        match &self.layout.leaves[leaf].kind {
            Type::Enum(kind) => Some(kind.clone()),
            _ => None,
        }
    }

    fn element(&self, leaf: usize, index: usize, name: String) -> Column {
        self.column(leaf, name, Take::Element { index, enumeration: self.enumeration(leaf) })
    }

    fn position(&self, leaf: usize, axis: Axis, coordinate: &str, position: f64) -> Column {
        let path = &self.layout.leaves[leaf].path;
        let symmetry = self.channel.metadata.get(&format!("symmetry.{path}"));
        let even = symmetry.is_some_and(|symmetry| symmetry == "even");
        let name = format!("{path}@{coordinate}={position}");
        self.column(leaf, name, Take::At { axis, even, position })
    }

    /// All of a field: a scalar, or an array at the chosen positions, at its listed positions, or element by element.
    /// Matrices are left out.
    fn all(
        &self,
        index: usize,
        longest: &mut dyn FnMut(usize) -> usize,
    ) -> Result<Vec<Column>, SelectionError> {
        let leaf = &self.layout.leaves[index];
        if leaf.lists == 0 {
            return Ok(vec![self.plain(index)]);
        }
        let axis = Axis::of(index, self.layout, self.channel);
        if let Some(at) = self.at.filter(|at| axis.is_named(&at.coordinate)) {
            let column = |&position: &f64| self.position(index, axis.clone(), &at.coordinate, position);
            return Ok(at.values.iter().map(column).collect());
        }
        match axis {
            Axis::Listed(positions) => {
                let name = |position: &f64| format!("{}@r={position}", leaf.path);
                let column = |(i, r): (usize, &f64)| self.element(index, i, name(r));
                Ok(positions.iter().enumerate().map(column).collect())
            }
            Axis::Matrix { .. } => Ok(Vec::new()),
            Axis::Uniform { .. } | Axis::Unknown => {
                let length = longest(index);
                if length > MAX_COLUMNS {
                    return Err(SelectionError::TooMany { field: leaf.path.clone(), length });
                }
                Ok((0..length).map(|i| self.element(index, i, leaf.element(i))).collect())
            }
        }
    }

    /// A field asked for by name: `a.b.c`, `name[index]`, `list[index].name` or `name@r=position`.
    fn named(
        &self,
        name: &str,
        longest: &mut dyn FnMut(usize) -> usize,
    ) -> Result<Vec<Column>, SelectionError> {
        let topic = || self.channel.topic.clone();
        let unknown = || {
            let known = self.layout.leaves.iter().filter(|leaf| leaf.path != UNKNOWN);
            let known: Vec<&str> = known.map(|leaf| leaf.path.as_str()).collect();
            SelectionError::UnknownField { topic: topic(), field: name.into(), known: known.join(", ") }
        };
        let (base, position) = match name.split_once('@') {
            Some((base, at)) => (base, Some(at.parse::<Positions>().map_err(|_| unknown())?)),
            None => (name, None),
        };
        let (path, index) = match base.split_once('[').zip(base.split_once(']')) {
            Some(((before, _), (until, after))) => {
                let index = until.get(before.len() + 1..).and_then(|digits| digits.parse::<usize>().ok());
                (format!("{before}{after}"), Some(index.ok_or_else(unknown)?))
            }
            None => (base.to_owned(), None),
        };
        let leaf = self.layout.find(&path).filter(|_| path != UNKNOWN).ok_or_else(unknown)?;
        let refuse = |what, hint| SelectionError::NotACell { topic: topic(), field: name.into(), what, hint };
        let is_list = self.layout.leaves[leaf].lists > 0;
        if self.layout.leaves[leaf].kind == Type::Bytes {
            return Err(refuse("bytes", "choose a field of numbers or text"));
        }
        let axis = Axis::of(leaf, self.layout, self.channel);
        match (index, position) {
            (Some(_), _) if !is_list => Err(refuse("not an array", "leave out the index")),
            (Some(index), _) => Ok(vec![self.element(leaf, index, name.into())]),
            (None, Some(at)) if is_list && axis.is_named(&at.coordinate) => {
                let column = |&position: &f64| self.position(leaf, axis.clone(), &at.coordinate, position);
                Ok(at.values.iter().map(column).collect())
            }
            (None, Some(at)) => Err(SelectionError::NoAxis { topic: topic(), coordinate: at.coordinate }),
            (None, None) if matches!(axis, Axis::Matrix { .. }) => {
                Err(refuse("a matrix", "choose elements as name[index]"))
            }
            (None, None) => self.all(leaf, longest),
        }
    }
}

impl Column {
    /// The cell of this column for a message.
    ///
    /// * `log_time`: log time of the message \[ns\]
    pub fn cell(&self, values: &Values, log_time: u64) -> Cell {
        let list = self.leaf.map(|leaf| &values.lists[leaf]);
        match (&self.take, list) {
            (Take::LogTime, _) | (_, None) => Cell::Double(log_time as f64 * 1e-9),
            (Take::Single { enumeration }, Some(list)) => cell(list, 0, enumeration.as_ref()),
            (Take::Element { index, enumeration }, Some(list)) => cell(list, *index, enumeration.as_ref()),
            (Take::At { axis, even, position }, Some(list)) => {
                at(list, axis.place(values), *even, *position).map_or(Cell::Empty, Cell::Double)
            }
        }
    }
}

/// A value as a cell; empty where there is none.
pub(crate) fn cell(list: &List, index: usize, enumeration: Option<&EnumDescriptor>) -> Cell {
    let cell = match list {
        List::Double(list) => list.get(index).map(|&value| Cell::Double(value)),
        List::Float(list) => list.get(index).map(|&value| Cell::Float(value)),
        List::Int(list) => list.get(index).map(|&value| Cell::Int(value)),
        List::UInt(list) => list.get(index).map(|&value| Cell::UInt(value)),
        List::Bool(list) => list.get(index).map(|&value| Cell::Bool(value)),
        List::Text(list) => list.get(index).map(|value| Cell::Text(value.clone())),
        List::Enum(list) => list.get(index).map(|&number| {
            let name = enumeration.and_then(|kind| kind.get_value(number));
            Cell::Text(name.map_or_else(|| number.to_string(), |value| value.name().to_owned()))
        }),
        List::Bytes(_) => None,
    };
    cell.unwrap_or(Cell::Empty)
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost_reflect::prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    };
    use prost_reflect::{DescriptorPool, DynamicMessage, Value, prost::Message};
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
            layout: pool.expect("a sound schema").get_message_by_name("P").map(|p| Layout::of(&p).into()),
            count: 0,
            span: None,
        }
    }

    fn message(channel: &Channel, p: &[f64]) -> Values {
        let layout = channel.layout.as_ref().expect("a type");
        let mut message = DynamicMessage::new(layout.descriptor().clone());
        message.set_field_by_name("r0", Value::F64(0.05));
        message.set_field_by_name("dr", Value::F64(0.1));
        message.set_field_by_name("p", Value::List(p.iter().copied().map(Value::F64).collect()));
        let mut values = layout.values();
        layout.decode(&message.encode_to_vec(), &mut values).expect("a message");
        values
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
