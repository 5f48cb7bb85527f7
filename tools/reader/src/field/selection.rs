//! What is wanted of a topic: fields by name, positions on the axes of arrays; and why it cannot be had.

use percuss_table::units::LENGTH;

use crate::{
    axis::Axis,
    channel::Channel,
    extent::Reach,
    failure::Failure,
    path::Index,
    prefix::{UnitError, typed},
    wire::{Layout, Slot},
};

/// Which fields of a topic are wanted.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Fields: `a.b.c`, `list[index].name`, `map[key]`, `name@r=position`; all plain fields and arrays if empty.
    pub fields: Vec<String>,
    /// Positions on the axes of arrays, one after the other.
    pub at: Vec<Positions>,
    /// For curves: names of numbers as these numbers, and of all fields those left out that only say when.
    pub for_curves: bool,
}

/// Positions `r=0,0.5,0.9`, or points `r=0,z=0.5`: every combination of the positions of several coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Positions {
    /// Names of the coordinates and the positions on each.
    pub coordinates: Vec<(String, Vec<f64>)>,
    /// True if any was written with a unit: then those are in metres.
    pub(crate) has_unit: bool,
}

impl std::str::FromStr for Positions {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mut coordinates, mut has_unit) = (Vec::<(String, Vec<f64>)>::new(), false);
        for item in text.split(',') {
            let number = match item.split_once('=') {
                Some((name, number)) => {
                    let name = name.trim();
                    if coordinates.iter().any(|(known, _)| known == name) {
                        return Err(format!(
                            "`{name}` is given twice; write {name}=0,0.5 for several positions"
                        ));
                    }
                    coordinates.push((name.into(), Vec::new()));
                    number
                }
                None => item,
            };
            let (_, values) = coordinates.last_mut().ok_or("write positions as r=0,0.5,0.9 or r=0,z=0.5")?;
            let (number, is_in_metres) = typed(number, LENGTH)?;
            has_unit |= is_in_metres;
            match number.parse::<f64>() {
                Ok(value) if value.is_finite() => values.push(value),
                _ => return Err(format!("`{number}` is not a finite number")),
            }
        }
        Ok(Self { coordinates, has_unit })
    }
}

impl std::fmt::Display for Positions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, (name, values)) in self.coordinates.iter().enumerate() {
            let values: Vec<String> = values.iter().map(f64::to_string).collect();
            write!(f, "{}{name}={}", if i > 0 { "," } else { "" }, values.join(","))?;
        }
        Ok(())
    }
}

impl Positions {
    /// Positions on a coordinate.
    pub fn on(&self, coordinate: &str) -> Option<&[f64]> {
        let found = self.coordinates.iter().find(|(name, _)| name == coordinate);
        found.map(|(_, values)| values.as_slice())
    }

    /// True if all coordinates are those of an axis.
    pub(crate) fn fit(&self, axis: &Axis) -> bool {
        let known = axis.coordinates();
        self.coordinates.iter().all(|(name, _)| known.contains(&name.as_str()))
    }

    /// Refuses a unit where positions of a channel are in another than metres.
    pub(crate) fn check_units(&self, channel: &Channel) -> Result<(), SelectionError> {
        let mut names = self.coordinates.iter().map(|(name, _)| name);
        Ok(names.try_for_each(|name| {
            let (what, unit) = (format!("positions {name}"), channel.coordinate_unit(name));
            UnitError::check(self.has_unit, LENGTH, &channel.topic, &what, unit)
        })?)
    }

    /// True if they leave out a coordinate of an axis that they fit.
    pub(crate) fn are_lines(&self, axis: &Axis) -> bool {
        self.fit(axis) && self.coordinates.len() < axis.coordinates().len()
    }
}

impl Selection {
    /// Refuses what none of some channels has, like what a single channel has not: the rest, once all was taken out that they have.
    pub(crate) fn refuse_rest(&self, channels: &[&Channel]) -> Result<(), SelectionError> {
        let decoded = channels.iter().find(|channel| channel.layout.is_some()).or(channels.first());
        if let (Some(field), Some(channel)) = (self.fields.first(), decoded) {
            return Err(SelectionError::unknown_field(channel, field));
        }
        self.at.first().map_or(Ok(()), |at| Err(SelectionError::no_axis(channels, at)))
    }
}

/// Why a selection does not fit a channel, in words.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SelectionError {
    /// The channel has no such field, or no axis for these positions.
    #[error("{0}")]
    Absent(String),
    /// Its messages are not decoded.
    #[error("{0}")]
    NotDecoded(String),
    /// A field that is no columns, or too many: where all are asked for, it is left out.
    #[error("{0}")]
    NotColumns(String),
    /// What is asked for is there, but cannot be had so.
    #[error("{0}")]
    Refused(String),
    /// Positions with a unit that is not recorded.
    #[error(transparent)]
    Unit(#[from] UnitError),
}

impl From<SelectionError> for Failure {
    fn from(error: SelectionError) -> Self {
        Self::Usage(error.to_string())
    }
}

impl SelectionError {
    /// The error of a channel whose messages are not decoded.
    pub(crate) fn not_decoded(channel: &Channel) -> Self {
        let Channel { topic, encoding, schema, .. } = channel;
        Self::NotDecoded(format!(
            "messages of `{topic}` are {encoding} with schema `{schema}`; only protobuf with a sound schema and JSON are read"
        ))
    }

    /// The error of positions that none of some channels has the axes for.
    pub(crate) fn no_axis(channels: &[&Channel], at: &Positions) -> Self {
        let mut known: Vec<String> = Vec::new();
        for channel in channels {
            let Some(layout) = channel.layout.as_deref() else { continue };
            for leaf in 0..layout.leaves.len() {
                let names = Axis::of(leaf, layout, channel).coordinates().join(" and ");
                if !names.is_empty() {
                    known.push(format!("`{}` has {names}", layout.leaves[leaf].path));
                }
            }
        }
        let names = |names: Vec<&str>| names.join("`, `");
        let topic = names(channels.iter().map(|channel| channel.topic.as_str()).collect());
        let coordinate = names(at.coordinates.iter().map(|(name, _)| name.as_str()).collect());
        let known = if known.is_empty() { String::new() } else { format!("; {}", known.join(", ")) };
        Self::Absent(format!(
            "no array of `{topic}` has an axis named `{coordinate}` to choose positions on{known}"
        ))
    }

    /// Refuses positions outside an axis.
    pub(crate) fn check(
        reach: &Reach,
        topic: &str,
        field: &str,
        coordinate: &str,
        positions: &[f64],
    ) -> Result<(), Self> {
        // without the last digits, which are rounding errors
        let short = |x: f64| match x.abs() < reach.rounding() {
            true => 0.0,
            false => format!("{x:.8e}").parse().unwrap_or(x),
        };
        match positions.iter().find(|position| !reach.holds(**position)) {
            Some(&position) => {
                let (low, high) = (short(reach.low), short(reach.high));
                Err(Self::Refused(format!(
                    "{coordinate}={position} lies outside `{field}` of `{topic}`, which reaches from {coordinate}={low} to \
                     {coordinate}={high}"
                )))
            }
            None => Ok(()),
        }
    }

    /// The error of a field that a channel has not.
    pub(crate) fn unknown_field(channel: &Channel, field: &str) -> Self {
        let leaves = channel.layout.iter().flat_map(|layout| &layout.leaves);
        let known: Vec<&str> = leaves.filter(|leaf| leaf.is_data()).map(|leaf| leaf.path.as_str()).collect();
        let (topic, known) = (&channel.topic, known.join(", "));
        Self::Absent(format!("`{topic}` has no field `{field}`; it has {known}"))
    }

    /// The error of positions on an axis that a message does not describe soundly.
    pub(crate) fn misplaced(topic: &str, field: &str, flaw: &str) -> Self {
        Self::Refused(format!("`{field}` of `{topic}` {flaw}"))
    }

    /// The error of fields that together take too many columns.
    ///
    /// * `columns`: until it was given up
    pub(crate) fn too_wide(topic: &str, columns: usize) -> Self {
        Self::Refused(format!(
            "the fields of `{topic}` take more than {columns} columns; choose some with --field"
        ))
    }
}

/// A name of a field, `a.b[index].c@r=position`, in its parts.
pub(super) struct Name<'a> {
    parts: Vec<(&'a str, Option<&'a str>)>,
    pub(super) at: Option<&'a str>,
}

impl<'a> Name<'a> {
    pub(super) fn parse(text: &'a str) -> Option<Self> {
        // what is in brackets may be the key of a map: any text
        let (mut parts, mut rest) = (Vec::new(), text);
        loop {
            let end = rest.find(['.', '[', '@']).unwrap_or(rest.len());
            let (name, after) = rest.split_at(end);
            let (index, after) = match after.strip_prefix('[') {
                Some(after) => {
                    let (index, after) = after.split_once(']')?;
                    (Some(index), after)
                }
                None => (None, after),
            };
            parts.push((name, index));
            if after.is_empty() {
                return Some(Self { parts, at: None });
            }
            if let Some(at) = after.strip_prefix('@') {
                return Some(Self { parts, at: Some(at) });
            }
            rest = after.strip_prefix('.')?;
        }
    }

    /// True if any part has an index.
    pub(super) fn is_indexed(&self) -> bool {
        self.parts.iter().any(|(_, index)| index.is_some())
    }

    /// The leaf it names, and the indices of every part of its path: numbers where the path is written out, keys where
    /// `map[key]` stands for `map.value`.
    pub(super) fn leaf(&self, layout: &Layout) -> Option<(usize, Vec<Option<Index>>)> {
        let names: Vec<&str> = self.parts.iter().map(|(name, _)| *name).collect();
        let written = layout.find(&names.join("."));
        let is_named = |slot: &&Slot| written.is_some() || !slot.field.parent_message().is_map_entry();
        let is_meant = |leaf: &usize| {
            let way = layout.way(*leaf).filter(is_named).map(|slot| slot.field.name());
            !layout.leaves[*leaf].is_key && way.eq(names.iter().copied())
        };
        let leaf = written.or_else(|| (0..layout.leaves.len()).find(is_meant))?;
        let mut texts = self.parts.iter().map(|(_, text)| *text);
        let index = |slot: &Slot| {
            let text = if is_named(&slot) { texts.next()? } else { None };
            let is_key = written.is_none() && slot.field.is_map();
            text.map(|text| Index { text: text.to_owned(), is_key })
        };
        Some((leaf, layout.way(leaf).map(index).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_maps_may_be_any_text() {
        let name = Name::parse("a.gains[joint.1@x].b[2]@r=0").expect("a name");
        assert_eq!(name.parts, [("a", None), ("gains", Some("joint.1@x")), ("b", Some("2"))]);
        assert_eq!(name.at, Some("r=0"));
        for bad in ["a[1", "a[1]b", "a[1].[2", "a[1][2]"] {
            assert!(Name::parse(bad).is_none(), "{bad}");
        }
    }

    #[test]
    fn positions_are_lists_or_points() {
        let parse = |text: &str| text.parse::<Positions>();
        let point = parse("r=0, z=0.5,1").expect("points");
        assert_eq!(
            (point.on("r"), point.on("z"), point.on("x")),
            (Some(&[0.0][..]), Some(&[0.5, 1.0][..]), None)
        );
        assert_eq!(point.to_string(), "r=0,z=0.5,1");
        let typed = parse("r=0.1mm,z=2 cm").expect("a point");
        assert_eq!((typed.to_string().as_str(), typed.has_unit), ("r=0.0001,z=0.02", true));
        for bad in ["0,1", "r=", "r=x", "r=nan", "r=0,r=1", ""] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
