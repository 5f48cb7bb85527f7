//! From a selection to columns.

use std::collections::HashSet;

use percuss_picture::Side;
use percuss_table::{CellType, Heading};

use super::{
    Column, Columns, MAX_TABLE, Take,
    selection::{Name, Positions, Selection, SelectionError},
};
use crate::{
    axis::Axis,
    channel::Channel,
    convention,
    extent::{Extent, MAX_COLUMNS, Reach},
    path::{Element, Index, Path},
    wire::{Layout, Type},
};

/// Longest that the names of the columns of a topic may be together \[bytes\].
const MAX_NAMES: usize = 32 << 20;

/// Most entries of maps that become columns.
const MAX_ENTRIES: usize = 1000;

/// Columns of a channel.
///
/// * `extent`: gives how far the array of a leaf reaches over all messages; asked only where it is needed. If it knows no
///   positions, none are refused
pub fn columns(
    channel: &Channel,
    selection: &Selection,
    extent: &mut dyn FnMut(usize) -> Extent,
) -> Result<Columns, SelectionError> {
    let layout = channel.layout.as_deref().ok_or_else(|| SelectionError::not_decoded(channel))?;
    let at = selection.at.as_slice();
    let (unused, for_curves) = (at.iter().collect(), selection.for_curves);
    let mut picker = Picker { channel, layout, at, unused, for_curves, extent };
    let time = picker.time();
    let (mut fields, mut left_out) = (Vec::new(), Vec::new());
    if selection.fields.is_empty() {
        (fields, left_out) = picker.every()?;
    }
    let mut known = HashSet::new();
    for name in &selection.fields {
        let named = picker.named(name)?.into_iter();
        let new: Vec<Column> = named.filter(|column| !known.contains(&column.heading.name)).collect();
        known.extend(new.iter().map(|column| column.heading.name.clone()));
        fields.extend(new);
    }
    match picker.unused.first() {
        Some(at) => Err(SelectionError::no_axis(&[channel], at)),
        None => Ok(Columns { time, fields, left_out }),
    }
}

struct Picker<'a> {
    channel: &'a Channel,
    layout: &'a Layout,
    at: &'a [Positions],
    /// Those of them that have not been of use.
    unused: Vec<&'a Positions>,
    for_curves: bool,
    extent: &'a mut dyn FnMut(usize) -> Extent,
}

impl Picker<'_> {
    fn column(&self, leaf: usize, name: String, take: Take) -> Column {
        let unit = self.channel.unit(&self.layout.leaves[leaf].path).map(str::to_owned);
        let kind = match (&take, &self.layout.leaves[leaf].kind) {
            (Take::At { .. } | Take::Point { .. } | Take::LogTime { .. }, _) | (_, Type::Double) => {
                CellType::Double
            }
            (_, Type::Float) => CellType::Float,
            (_, Type::Int) => CellType::Int,
            (_, Type::UInt) => CellType::UInt,
            (_, Type::Bool) => CellType::Bool,
            (Take::Element { enumeration: None, .. }, Type::Enum(_)) => CellType::Int,
            (_, Type::Enum(_) | Type::Text | Type::Bytes) => CellType::Text,
        };
        Column { heading: Heading { name, unit, kind }, leaf: Some(leaf), take }
    }

    fn time(&self) -> Column {
        if let Some(leaf) = self.channel.time_leaf() {
            return self.plain(leaf);
        }
        let origin = self.channel.origin;
        // a field of this name is no time if it is in lists, or need not be there
        let is_free = origin > 0 && self.layout.find(convention::TIME).is_none();
        let name = if is_free { convention::TIME } else { "log_time" };
        let heading = Heading::new(name, Some("s"));
        Column { heading, leaf: None, take: Take::LogTime { origin } }
    }

    /// All fields but the time and what describes axes, and why others are left out.
    fn every(&mut self) -> Result<(Vec<Column>, Vec<SelectionError>), SelectionError> {
        let (hidden, time) = (self.channel.axis_parts(), self.channel.time_leaf());
        let (mut fields, mut left_out, mut names, mut weight) = (Vec::new(), Vec::new(), 0, 0);
        for (index, field) in self.layout.leaves.iter().enumerate() {
            let is_not_drawn = self.for_curves && self.layout.says_when(index);
            if is_not_drawn || field.is_key {
                continue;
            }
            if Some(index) == time || hidden.contains(field.path.as_str()) || !field.is_data() {
                continue;
            }
            match self.all(index) {
                Ok(columns) => {
                    names += columns.iter().map(|column| column.heading.name.len()).sum::<usize>();
                    weight += columns.iter().map(Column::weight).sum::<usize>();
                    fields.extend(columns);
                }
                Err(error @ SelectionError::NotColumns(_)) => left_out.push(error),
                Err(error) => return Err(error),
            }
            // as much as four messages may take is a quarter of all memory
            if fields.len() > MAX_TABLE || names > MAX_NAMES || weight > self.layout.room.saturating_mul(4) {
                return Err(SelectionError::too_wide(&self.channel.topic, fields.len()));
            }
        }
        Ok((fields, left_out))
    }

    fn plain(&self, leaf: usize) -> Column {
        self.element(Path::of(self.layout, leaf), None)
    }

    /// The column of an element, under its own name if no other is given.
    fn element(&self, path: Path, name: Option<String>) -> Column {
        let leaf = path.leaf;
        let enumeration = match &self.layout.leaves[leaf].kind {
            Type::Enum(kind) if !self.for_curves => Some(kind.clone()),
            _ => None,
        };
        let name = name.unwrap_or_else(|| path.name());
        self.column(leaf, name, Take::Element { path, enumeration })
    }

    fn refuse(&self, field: &str, what: &str, hint: &str) -> SelectionError {
        SelectionError::NotColumns(format!("`{field}` of `{}` is {what}; {hint}", self.channel.topic))
    }

    fn too_many(&self, field: &str, most: usize, example: &str) -> SelectionError {
        let topic = &self.channel.topic;
        SelectionError::NotColumns(format!(
            "`{field}` of `{topic}` has more than {most} elements; choose some with --at or --field {example}"
        ))
    }

    /// All of a field: a scalar, or an array at the chosen positions, at its listed positions, or element by element.
    fn all(&mut self, leaf: usize) -> Result<Vec<Column>, SelectionError> {
        let (field, path) = (&self.layout.leaves[leaf], Path::of(self.layout, leaf));
        if field.kind == Type::Bytes {
            return Err(self.refuse(&field.path, "bytes", "percuss-read cat shows them"));
        }
        if field.lists == 0 {
            return Ok(vec![self.plain(leaf)]);
        }
        let axis = Axis::of(leaf, self.layout, self.channel);
        let mut columns = Vec::new();
        let mut is_chosen = false;
        for at in self.at.iter().filter(|at| at.fit(&axis)) {
            is_chosen = true;
            self.unused.retain(|unused| *unused != at);
            columns.extend(self.positions(&path, &axis, at)?);
        }
        if is_chosen {
            return Ok(columns);
        }
        if axis.is_matrix() {
            let [row, column] = [0, 1].map(|side| axis.coordinates()[side]);
            let hint = format!(
                "choose points, as in --at {column}=0,{row}=0; whole it is in an .npz of trace, at one time in export and plot"
            );
            return Err(self.refuse(&field.path, "a matrix", &hint));
        }
        if matches!(&axis, Axis::Listed(positions) if positions.len() > MAX_COLUMNS) {
            return Err(self.too_many(&field.path, MAX_COLUMNS, &path.example()));
        }
        let Some(places) = self.places(leaf, &axis) else { return self.elements(&path) };
        let column = |(i, place): (usize, &String)| {
            let name = format!("{}@{place}", field.path);
            self.element(path.at([Element::Number(i)]), Some(name))
        };
        Ok(places.iter().enumerate().map(column).collect())
    }

    /// Where the elements of an array are, if that is listed: `r=0.5`, of a channel of points `r=0,z=2mm`.
    fn places(&mut self, leaf: usize, axis: &Axis) -> Option<Vec<String>> {
        let channel = self.channel;
        let points = channel.points().filter(|points| match axis {
            Axis::Listed(positions) => positions.len() == points.len(),
            _ => {
                let is_list = self.layout.leaves[leaf].lists == 1;
                is_list && points.len() <= MAX_COLUMNS && (self.extent)(leaf).length == points.len()
            }
        });
        match (points, axis) {
            (Some(points), _) => {
                let label =
                    |[r, z]: &[f64; 2]| format!("{},{}", channel.label("r", *r), channel.label("z", *z));
                Some(points.iter().map(label).collect())
            }
            (None, Axis::Listed(positions)) => {
                Some(positions.iter().map(|r| channel.label("r", *r)).collect())
            }
            (None, _) => None,
        }
    }

    /// The column of an array that [`all`](Self::all) gives this name.
    fn labelled(&mut self, leaf: usize, name: &str) -> Option<Column> {
        let axis = Axis::of(leaf, self.layout, self.channel);
        let places = self.places(leaf, &axis).filter(|places| places.len() <= MAX_COLUMNS)?;
        let path = &self.layout.leaves[leaf].path;
        let i = places.iter().position(|place| name == format!("{path}@{place}"))?;
        Some(self.element(Path::of(self.layout, leaf).at([Element::Number(i)]), Some(name.into())))
    }

    /// A column for every element that is not chosen yet.
    fn elements(&mut self, path: &Path) -> Result<Vec<Column>, SelectionError> {
        if path.is_value() {
            return Ok(vec![self.element(path.clone(), None)]);
        }
        let name = path.name();
        if path.numbers_entries() {
            let hint = "choose them by their keys, map[key], or every element by its number";
            return Err(self.refuse(&name, "some entries of a map by number", hint));
        }
        let extent = (self.extent)(path.leaf);
        // their names are kept; entries are looked for by their keys, one after the other
        let most = if path.has_keys() { MAX_ENTRIES } else { MAX_COLUMNS };
        let most = most.min(MAX_NAMES / name.len().max(1));
        if extent.length.max(extent.places.len()) > most {
            return Err(self.too_many(&name, most, &path.example()));
        }
        if path.lists() == 1 && !path.has_keys() {
            let column = |i| self.element(path.at([Element::Number(i)]), None);
            return Ok((0..extent.length).map(column).collect());
        }
        let places = extent.places.iter().filter(|place| path.holds(place));
        Ok(places.map(|place| self.element(path.at(place.iter().cloned()), None)).collect())
    }

    /// Columns of an array at positions that fit its axis.
    fn positions(&mut self, way: &Path, axis: &Axis, at: &Positions) -> Result<Vec<Column>, SelectionError> {
        at.check_units(self.channel)?;
        let leaf = way.leaf;
        let path = &self.layout.leaves[leaf].path;
        let names = axis.coordinates();
        let reaches = match axis {
            Axis::Listed(positions) => Reach::of(Side::Listed(positions.clone())).into_iter().collect(),
            _ => {
                let extent = (self.extent)(leaf);
                if let Some(flaw) = extent.flaw {
                    return Err(SelectionError::misplaced(&self.channel.topic, path, &flaw));
                }
                extent.reaches
            }
        };
        for (name, reach) in names.iter().zip(&reaches) {
            SelectionError::check(reach, &self.channel.topic, path, name, at.on(name).unwrap_or_default())?;
        }
        if names.len() == 2 {
            return self.points(leaf, axis, at, reaches);
        }
        let even = convention::is_even(&self.channel.metadata, path);
        let column = |&position: &f64| {
            let name = format!("{path}@{}={position}", names[0]);
            self.column(leaf, name, Take::At { path: way.clone(), axis: axis.clone(), even, position })
        };
        Ok(at.coordinates.iter().flat_map(|(_, values)| values).map(column).collect())
    }

    /// Columns of a matrix at points, or along lines: at all positions of the coordinate that is left out.
    fn points(
        &self,
        leaf: usize,
        axis: &Axis,
        at: &Positions,
        reaches: Vec<Reach>,
    ) -> Result<Vec<Column>, SelectionError> {
        let (path, names) = (&self.layout.leaves[leaf].path, axis.coordinates());
        let mut coordinates = at.coordinates.clone();
        for (i, name) in names.iter().enumerate().filter(|(_, name)| at.on(name).is_none()) {
            let side = reaches.get(i).map(|reach| &reach.side);
            let others: usize = at.coordinates.iter().map(|(_, values)| values.len()).product();
            let side = side.filter(|side| side.length().saturating_mul(others) <= MAX_COLUMNS);
            let topic = &self.channel.topic;
            let side = side.ok_or_else(|| {
                SelectionError::Refused(format!(
                    "`{path}` of `{topic}` at {at} is a line over {name}; choose places on it: --at {at},{name}=..."
                ))
            })?;
            // at an interface a position stands for the upper side
            let places = (0..side.length()).filter(|&i| !side.is_below_interface(i)).map(|i| side.at(i));
            coordinates.push(((*name).into(), places.collect()));
        }
        let [(first, outer), (second, inner)] = coordinates.as_slice() else { return Ok(Vec::new()) };
        if outer.len().saturating_mul(inner.len()) > MAX_COLUMNS {
            let example = format!("{path}@{}=0,{}=0", names[0], names[1]);
            return Err(self.too_many(path, MAX_COLUMNS, &example));
        }
        let (whole, even) =
            (<[Reach; 2]>::try_from(reaches).ok(), convention::is_even(&self.channel.metadata, path));
        let points = outer.iter().flat_map(|x| inner.iter().map(move |y| (*x, *y)));
        let columns = points.map(|(x, y)| {
            let point = if first == names[0] { (x, y) } else { (y, x) };
            let name = format!("{path}@{first}={x},{second}={y}");
            self.column(leaf, name, Take::Point { axis: axis.clone(), even, point, whole: whole.clone() })
        });
        Ok(columns.collect())
    }

    /// A field asked for by name: `a.b.c`, `name[index]`, `list[index].name`, `map[key]` or `name@r=position`.
    fn named(&mut self, text: &str) -> Result<Vec<Column>, SelectionError> {
        let unknown = || SelectionError::unknown_field(self.channel, text);
        let name = Name::parse(text).ok_or_else(unknown)?;
        let found = name.leaf(self.layout).filter(|(leaf, _)| self.layout.leaves[*leaf].is_data());
        let (leaf, indices) = found.ok_or_else(unknown)?;
        // a number where no key of a map can be
        let is_sound = |index: &Index| index.is_key || index.text.parse::<usize>().is_ok();
        if !indices.iter().flatten().all(is_sound) {
            return Err(unknown());
        }
        let path = Path::of(self.layout, leaf);
        let axis = Axis::of(leaf, self.layout, self.channel);
        let is_indexed = name.is_indexed();
        if let Some(at) = name.at {
            if let Some(column) = self.labelled(leaf, text) {
                return Ok(vec![column]);
            }
            let at: Positions =
                at.parse().map_err(|error: String| SelectionError::Refused(format!("`{text}`: {error}")))?;
            if is_indexed {
                return Err(self.refuse(text, "an element", "leave out its index or its position"));
            }
            if !at.fit(&axis) {
                return Err(SelectionError::no_axis(&[self.channel], &at));
            }
            return self.positions(&path, &axis, &at);
        }
        if !is_indexed || self.layout.leaves[leaf].kind == Type::Bytes {
            return self.all(leaf);
        }
        let Some(chosen) = path.indexed(&indices) else {
            return Err(match path.lists() {
                0 => self.refuse(text, "not an array", "leave out the index"),
                _ => {
                    let right = path.example();
                    self.refuse(text, "an array at another part of its name", &format!("write {right}"))
                }
            });
        };
        if axis.is_matrix() && (self.extent)(leaf).varies {
            let hint = "its elements are at other places; choose points with --at";
            return Err(self.refuse(text, "of a matrix that changes its shape", hint));
        }
        self.elements(&chosen)
    }
}
