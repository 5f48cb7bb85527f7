//! Fields of messages: names, units and axes from channel metadata, and what to take of a message into a row.

mod selection;

use std::cell::Cell as Mark;

use prost_reflect::EnumDescriptor;

use crate::{
    axis::{Axis, at_point, between},
    channel::Channel,
    convention,
    extent::{Extent, Reach},
    nest::{Counts, Nest, Spot},
    recording::seconds,
    table::{Cell, Heading, Kind, MAX_COLUMNS},
    wire::{COUNT, Layout, List, Type, UNKNOWN, Values},
};

use selection::Name;
pub use selection::{Positions, Selection, SelectionError};

/// Largest number of columns of a table, and longest that the names of those of a topic may be together \[bytes\].
pub(crate) const MAX_TABLE: usize = 1 << 18;
const MAX_NAMES: usize = 32 << 20;

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
    Element {
        spot: Spot,
        enumeration: Option<EnumDescriptor>,
    },
    At {
        spot: Spot,
        axis: Axis,
        even: bool,
        position: f64,
    },
    /// Of a matrix; with its rows and columns over all messages, if those are known.
    Point {
        axis: Axis,
        even: bool,
        point: (f64, f64),
        whole: Option<[Reach; 2]>,
    },
}

/// What of a channel is taken into rows.
#[derive(Debug)]
pub struct Columns {
    /// Its time.
    pub time: Column,
    /// Its fields.
    pub fields: Vec<Column>,
    /// Why fields are left out, where all of a channel are asked for.
    pub left_out: Vec<SelectionError>,
}

/// Columns of a channel.
///
/// * `extent`: gives how far the array of a leaf reaches over all messages; asked only where it is needed. If it knows no
///   positions, none are refused
///
/// # Errors
///
/// The selection does not fit the channel.
pub fn columns(
    channel: &Channel,
    selection: &Selection,
    extent: &mut dyn FnMut(usize) -> Extent,
) -> Result<Columns, SelectionError> {
    let layout = channel.layout.as_deref().ok_or_else(|| SelectionError::NotProtobuf {
        topic: channel.topic.clone(),
        encoding: channel.encoding.clone(),
        schema: channel.schema.clone(),
    })?;
    let at: Vec<(&Positions, Mark<bool>)> = selection.at.iter().map(|at| (at, Mark::new(false))).collect();
    let mut picker = Picker { channel, layout, counts: Counts::of(layout), at: &at, extent };
    let leaf = channel.time_leaf();
    let time = match leaf {
        Some(leaf) => picker.plain(leaf),
        None => {
            let heading = Heading { name: "log_time".into(), unit: Some("s".into()), kind: Kind::Double };
            Column { heading, leaf: None, take: Take::LogTime }
        }
    };
    let (mut fields, mut left_out) = (Vec::new(), Vec::new());
    if selection.fields.is_empty() {
        let hidden = channel.axis_parts();
        let mut names = 0;
        for (index, field) in layout.leaves.iter().enumerate() {
            let path = field.path.as_str();
            if Some(index) == leaf || hidden.contains(&path) || path.ends_with(COUNT) || path == UNKNOWN {
                continue;
            }
            match picker.all(index) {
                Ok(columns) => {
                    names += columns.iter().map(|column| column.heading.name.len()).sum::<usize>();
                    fields.extend(columns);
                }
                Err(error @ (SelectionError::NotACell { .. } | SelectionError::TooMany { .. })) => {
                    left_out.push(error);
                }
                Err(error) => return Err(error),
            }
            if fields.len() > MAX_TABLE || names > MAX_NAMES {
                return Err(SelectionError::TooWide { topic: channel.topic.clone(), columns: fields.len() });
            }
        }
    }
    for name in &selection.fields {
        fields.extend(picker.named(name)?);
    }
    match at.iter().find(|(_, used)| !used.get()) {
        Some((at, _)) => Err(SelectionError::no_axis(&[channel], at)),
        None => Ok(Columns { time, fields, left_out }),
    }
}

struct Picker<'a> {
    channel: &'a Channel,
    layout: &'a Layout,
    counts: Counts<'a>,
    /// Positions, and whether they have been of use.
    at: &'a [(&'a Positions, Mark<bool>)],
    extent: &'a mut dyn FnMut(usize) -> Extent,
}

impl Picker<'_> {
    fn column(&self, leaf: usize, name: String, take: Take) -> Column {
        let unit = self.channel.unit(&self.layout.leaves[leaf].path).map(str::to_owned);
        let kind = match (&take, &self.layout.leaves[leaf].kind) {
            (Take::At { .. } | Take::Point { .. } | Take::LogTime, _) | (_, Type::Double) => Kind::Double,
            (_, Type::Float) => Kind::Float,
            (_, Type::Int) => Kind::Int,
            (_, Type::UInt) => Kind::UInt,
            (_, Type::Bool) => Kind::Bool,
            (_, Type::Enum(_) | Type::Text | Type::Bytes) => Kind::Text,
        };
        Column { heading: Heading { name, unit, kind }, leaf: Some(leaf), take }
    }

    fn nest(&self, leaf: usize) -> Nest {
        Nest::of(self.layout, &self.counts, leaf)
    }

    fn plain(&self, leaf: usize) -> Column {
        self.element(leaf, &self.nest(leaf), &[], None)
    }

    /// The column of an element, under its own name if no other is given.
    fn element(&self, leaf: usize, nest: &Nest, elements: &[Option<usize>], name: Option<String>) -> Column {
        let enumeration = match &self.layout.leaves[leaf].kind {
            Type::Enum(kind) => Some(kind.clone()),
            _ => None,
        };
        let name = name.unwrap_or_else(|| nest.name(elements));
        self.column(leaf, name, Take::Element { spot: nest.spot(elements), enumeration })
    }

    fn refuse(&self, field: &str, what: &'static str, hint: impl Into<String>) -> SelectionError {
        let (topic, field) = (self.channel.topic.clone(), field.into());
        SelectionError::NotACell { topic, field, what, hint: hint.into() }
    }

    /// All of a field: a scalar, or an array at the chosen positions, at its listed positions, or element by element.
    fn all(&mut self, leaf: usize) -> Result<Vec<Column>, SelectionError> {
        let (field, nest) = (&self.layout.leaves[leaf], self.nest(leaf));
        if field.kind == Type::Bytes {
            return Err(self.refuse(&field.path, "bytes", "percuss-read cat shows them"));
        }
        if field.lists == 0 {
            return Ok(vec![self.plain(leaf)]);
        }
        let axis = Axis::of(leaf, self.layout, self.channel);
        let mut columns = Vec::new();
        let fitting = self.at.iter().filter(|(at, _)| at.fit(&axis));
        let mut is_chosen = false;
        for (at, used) in fitting {
            used.set(true);
            is_chosen = true;
            columns.extend(self.positions(leaf, &nest, &axis, at)?);
        }
        if is_chosen {
            return Ok(columns);
        }
        match &axis {
            Axis::Listed(positions) if positions.len() > MAX_COLUMNS => Err(SelectionError::TooMany {
                topic: self.channel.topic.clone(),
                field: field.path.clone(),
                example: nest.name(&[Some(0)]),
            }),
            Axis::Listed(positions) => {
                let column = |(i, r): (usize, &f64)| {
                    self.element(leaf, &nest, &[Some(i)], Some(format!("{}@r={r}", field.path)))
                };
                Ok(positions.iter().enumerate().map(column).collect())
            }
            Axis::Matrix { coordinates: [row, column], .. } => {
                let hint =
                    format!("choose points, as in --at {column}=0,{row}=0; plot and export show it whole");
                Err(self.refuse(&field.path, "a matrix", hint))
            }
            Axis::Uniform { .. } | Axis::Unknown => self.elements(leaf, &nest, &vec![None; nest.lists()]),
        }
    }

    /// A column for every element that is not chosen yet.
    fn elements(
        &mut self,
        leaf: usize,
        nest: &Nest,
        chosen: &[Option<usize>],
    ) -> Result<Vec<Column>, SelectionError> {
        if chosen.iter().all(Option::is_some) {
            return Ok(vec![self.element(leaf, nest, chosen, None)]);
        }
        let extent = (self.extent)(leaf);
        // their names are kept
        let most = MAX_COLUMNS.min(MAX_NAMES / nest.name(chosen).len().max(1));
        if extent.length.max(extent.places.len()) > most {
            return Err(SelectionError::TooMany {
                topic: self.channel.topic.clone(),
                field: nest.name(chosen),
                example: nest.name(&vec![Some(0); chosen.len()]),
            });
        }
        let column = |elements: &[Option<usize>]| self.element(leaf, nest, elements, None);
        if chosen.len() == 1 {
            return Ok((0..extent.length).map(|element| column(&[Some(element)])).collect());
        }
        let fits = |place: &&Vec<usize>| {
            place.iter().zip(chosen).all(|(element, chosen)| chosen.is_none_or(|chosen| chosen == *element))
        };
        let places = extent.places.iter().filter(fits);
        Ok(places.map(|place| column(&place.iter().copied().map(Some).collect::<Vec<_>>())).collect())
    }

    /// Columns of an array at positions that fit its axis.
    fn positions(
        &mut self,
        leaf: usize,
        nest: &Nest,
        axis: &Axis,
        at: &Positions,
    ) -> Result<Vec<Column>, SelectionError> {
        let path = &self.layout.leaves[leaf].path;
        let even = convention::is_even(&self.channel.metadata, path);
        let names = axis.coordinates();
        let reaches = match axis {
            Axis::Listed(positions) => Reach::listed(positions).into_iter().collect(),
            _ => (self.extent)(leaf).reaches,
        };
        for (name, reach) in names.iter().zip(&reaches) {
            SelectionError::check(reach, &self.channel.topic, path, name, at.on(name).unwrap_or_default())?;
        }
        let [row, column] = names.as_slice() else {
            let spot = nest.spot(&[None]);
            let positions = at.coordinates.iter().flat_map(|(_, values)| values);
            let column = |&position: &f64| {
                let name = format!("{path}@{}={position}", names[0]);
                let (spot, axis) = (spot.clone(), axis.clone());
                self.column(leaf, name, Take::At { spot, axis, even, position })
            };
            return Ok(positions.map(column).collect());
        };
        // the coordinate that is left out at all its positions
        let mut coordinates = at.coordinates.clone();
        for (i, name) in names.iter().enumerate().filter(|(_, name)| at.on(name).is_none()) {
            let side = reaches.get(i).map(|reach| reach.side);
            let others: usize = at.coordinates.iter().map(|(_, values)| values.len()).product();
            let side = side.filter(|side| side.length.saturating_mul(others) <= MAX_COLUMNS);
            let side = side.ok_or_else(|| SelectionError::Line {
                topic: self.channel.topic.clone(),
                field: path.clone(),
                at: at.to_string(),
                missing: (*name).into(),
            })?;
            coordinates.push(((*name).into(), (0..side.length).map(|i| side.at(i)).collect()));
        }
        let [(first, outer), (second, inner)] = coordinates.as_slice() else { return Ok(Vec::new()) };
        if outer.len().saturating_mul(inner.len()) > MAX_COLUMNS {
            let (topic, field) = (self.channel.topic.clone(), path.clone());
            return Err(SelectionError::TooMany {
                topic,
                field,
                example: format!("{path}@{row}=0,{column}=0"),
            });
        }
        let whole = <[Reach; 2]>::try_from(reaches).ok();
        let columns = outer.iter().flat_map(|x| inner.iter().map(move |y| (*x, *y))).map(|(x, y)| {
            let point = if first == row { (x, y) } else { (y, x) };
            let name = format!("{path}@{first}={x},{second}={y}");
            self.column(leaf, name, Take::Point { axis: axis.clone(), even, point, whole })
        });
        Ok(columns.collect())
    }

    /// A field asked for by name: `a.b.c`, `name[index]`, `list[index].name` or `name@r=position`.
    fn named(&mut self, text: &str) -> Result<Vec<Column>, SelectionError> {
        let unknown = || SelectionError::unknown_field(self.channel, text);
        let name = Name::parse(text).ok_or_else(unknown)?;
        let is_field = name.path != UNKNOWN && !name.path.ends_with(COUNT);
        let leaf = self.layout.find(&name.path).filter(|_| is_field).ok_or_else(unknown)?;
        let nest = self.nest(leaf);
        let axis = Axis::of(leaf, self.layout, self.channel);
        let is_indexed = name.indices.iter().any(Option::is_some);
        if let Some(at) = name.at {
            let at: Positions =
                at.parse().map_err(|error| SelectionError::Positions { field: text.into(), error })?;
            if is_indexed {
                return Err(self.refuse(text, "an element", "leave out its index or its position"));
            }
            if !at.fit(&axis) {
                return Err(SelectionError::no_axis(&[self.channel], &at));
            }
            return self.positions(leaf, &nest, &axis, &at);
        }
        if !is_indexed {
            return self.all(leaf);
        }
        if self.layout.leaves[leaf].kind == Type::Bytes {
            return self.all(leaf);
        }
        let Some(elements) = nest.elements(&name.indices) else {
            return Err(match nest.lists() {
                0 => self.refuse(text, "not an array", "leave out the index"),
                lists => {
                    let right = nest.name(&vec![Some(0); lists]);
                    self.refuse(text, "an array at another part of its name", format!("write {right}"))
                }
            });
        };
        if matches!(axis, Axis::Matrix { .. }) && (self.extent)(leaf).varies {
            let hint = "its elements are at other places; choose points with --at";
            return Err(self.refuse(text, "of a matrix that changes its shape", hint));
        }
        self.elements(leaf, &nest, &elements)
    }
}

impl Column {
    /// The cell of this column for a message.
    ///
    /// * `log_time`: log time of the message \[ns\]
    pub fn cell(&self, values: &Values, log_time: u64) -> Cell {
        let list = self.leaf.map(|leaf| &values.lists[leaf]);
        match (&self.take, list) {
            (Take::LogTime, _) | (_, None) => Cell::Double(seconds(log_time)),
            (Take::Element { spot, enumeration }, Some(list)) => {
                spot.rank(values, 0).map_or(Cell::Empty, |rank| cell(list, rank, enumeration.as_ref()))
            }
            (Take::At { spot, axis, even, position }, Some(list)) => {
                let value = |i: usize| list.number(spot.rank(values, i)?);
                let found = between(spot.length(values), axis.nodes(values), *even, *position, value);
                found.map_or(Cell::Empty, Cell::Double)
            }
            (Take::Point { axis, even, point, whole }, Some(list)) => {
                let found = axis.grid(values).and_then(|grid| {
                    let (rows, columns) = (grid.rows, grid.columns);
                    let size = whole.map_or((rows.length, columns.length), |[down, across]| {
                        (down.length(&rows), across.length(&columns))
                    });
                    at_point(list, &grid, size, *even, *point)
                });
                found.map_or(Cell::Empty, Cell::Double)
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

    /// That of an array of so many elements, on an axis that nothing is known of.
    fn array(length: usize) -> Extent {
        Extent { length, ..Extent::default() }
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
        let selection = Selection { at: vec![at.parse().expect("positions")], ..Selection::default() };
        let columns = columns(channel, &selection, &mut |_| array(9)).expect("a selection");
        columns.fields.iter().map(|column| column.cell(&message(channel, p), 0)).collect()
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
        let got = cells(&listed, "r=0.5,0.75,1", &[1.0, 2.0, 4.0]);
        assert_eq!(got[2..], [Cell::Double(2.0), Cell::Double(3.0), Cell::Double(4.0)]);
        let outside = Selection { at: vec!["r=1.1".parse().expect("positions")], ..Selection::default() };
        let error = columns(&listed, &outside, &mut |_| Extent::default()).expect_err("outside");
        assert!(error.to_string().contains("from r=0 to r=1"), "{error}");
    }

    #[test]
    fn axis_fields_are_no_columns_and_units_are_found() {
        let channel = channel(&[("axis.p", "r0,dr"), ("unit.p", "Pa")]);
        let columns = columns(&channel, &Selection::default(), &mut |_| array(2)).expect("columns");
        let names: Vec<String> = columns.fields.iter().map(|column| column.heading.with_unit()).collect();
        assert_eq!(names, ["p[0] [Pa]", "p[1] [Pa]"]);
    }

    #[test]
    fn misfits_are_explained() {
        let channel = channel(&[]);
        let select = |field: &str, at: Option<&str>| {
            let fields = if field.is_empty() { Vec::new() } else { vec![field.to_owned()] };
            let at = at.map(|at| at.parse().expect("positions")).into_iter().collect();
            let selected = columns(&channel, &Selection { fields, at }, &mut |_| array(20_000));
            selected.expect_err("a misfit").to_string()
        };
        assert!(select("q", None).contains("time, r0, dr, p"));
        assert!(select("p[x]", None).contains("no field `p[x]`"));
        assert!(select("r0[1]", None).contains("not an array"));
        assert!(select("", Some("r=1")).contains("axis named `r`"));
        assert!(select("p", None).contains("more than 10000"));
    }
}
