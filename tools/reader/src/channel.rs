//! A channel: its topic, its metadata and the type of its messages.

use std::{
    collections::{BTreeMap, HashSet},
    sync::Arc,
};

use crate::{convention, instant::Instant, prefix::Prefixed, wire::Layout};

/// A channel.
#[derive(Clone, Debug, Default)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Name of the schema, empty if there is none.
    pub schema: String,
    /// Encoding of the messages.
    pub encoding: String,
    /// Metadata: units, meanings, axes.
    pub metadata: BTreeMap<String, String>,
    /// Type of the messages, if they are protobuf with a sound schema, or JSON.
    pub layout: Option<Arc<Layout>>,
    /// Log time that counts as 0 \[ns\]: the first of the recording where log times are dates, else 0.
    pub origin: u64,
    /// Number of messages.
    pub count: u64,
    /// First and last log time \[ns\].
    pub span: Option<(u64, u64)>,
}

impl Channel {
    /// Unit of a field; `None` if unknown or a plain number.
    pub fn unit(&self, field: &str) -> Option<&str> {
        self.metadata.get(&convention::unit(field)).map(String::as_str).filter(|unit| *unit != "1")
    }

    /// True if it shows in another form what other channels hold.
    pub fn is_derived(&self) -> bool {
        self.metadata.contains_key(convention::DERIVED)
    }

    /// Leaf of the time of a message: a plain number named `time`.
    pub fn time_leaf(&self) -> Option<usize> {
        let layout = self.layout.as_ref()?;
        let leaf = layout.find(convention::TIME)?;
        (layout.leaves[leaf].is_single && layout.leaves[leaf].kind.is_number()).then_some(leaf)
    }

    /// What its times are called: those of its field, else log times.
    pub fn time_name(&self) -> &'static str {
        if self.has_time() { convention::TIME } else { "log_time" }
    }

    /// Unit of the times of messages.
    pub fn time_unit(&self) -> Option<&str> {
        if self.has_time() { self.unit(convention::TIME) } else { Some("s") }
    }

    /// When a message is: by its field `time`, else by its log time from the origin.
    pub(crate) fn instant(&self, bytes: &[u8], log_time: u64, origin: u64) -> Instant {
        let time = self.layout.as_ref().and_then(|layout| layout.peek(self.time_leaf()?, bytes));
        time.map_or_else(|| Instant::log(log_time, origin), Instant::Number)
    }

    /// True if messages have a field `time`.
    pub fn has_time(&self) -> bool {
        self.time_leaf().is_some()
    }

    /// Radii and depths of the points whose values are the elements of every array, if it is a channel of points.
    pub(crate) fn points(&self) -> Option<Vec<[f64; 2]>> {
        let list = |key: &str| convention::numbers(self.metadata.get(key)?);
        let (r, z) = (list("r")?, list("z")?);
        (r.len() == z.len()).then(|| r.into_iter().zip(z).map(|(r, z)| [r, z]).collect())
    }

    /// Unit of the positions on a coordinate: that of the field that holds the first one, or of the coordinate; metres in recordings in SI.
    pub(crate) fn coordinate_unit(&self, coordinate: &str) -> Option<&str> {
        let is_si = self.schema.starts_with(convention::SCHEMAS) && self.unit(convention::TIME) == Some("s");
        let unit = self.unit(&format!("{coordinate}0")).or_else(|| self.unit(coordinate));
        unit.or(is_si.then_some("m"))
    }

    /// What a coordinate is called where it is shown: that of a line in a target is the one along it.
    pub(crate) fn along<'a>(&self, coordinate: &'a str) -> &'a str {
        match self.metadata.get(convention::LINE).map(String::as_str) {
            Some(line) if line.starts_with("r =") => "z",
            Some(line) if line.starts_with("z =") => "r",
            _ => coordinate,
        }
    }

    /// A position on a coordinate for a label: `r=0.5`; in a recording in SI with the prefix that fits, `z=2mm`.
    pub(crate) fn label(&self, coordinate: &str, position: f64) -> String {
        match self
            .coordinate_unit(coordinate)
            .filter(|_| position != 0.0)
            .and_then(|unit| Prefixed::fitting(unit, position))
        {
            // what a number in another unit has beyond twelve digits is rounding
            Some(prefixed) => {
                let number = format!("{:.11e}", prefixed.apply(position)).parse().unwrap_or(position);
                format!("{coordinate}={number}{}", prefixed.unit)
            }
            None => format!("{coordinate}={position}"),
        }
    }

    /// What the axes of arrays are made of: names of fields that only describe them.
    pub fn axis_parts(&self) -> HashSet<&str> {
        /// Names of an axis at most: start, step, number and list of rows and of columns. More parts are positions.
        const NAMES: usize = 8;
        let axes = self.metadata.iter().filter(|(key, _)| key.starts_with(convention::AXIS));
        let parts = axes.map(|(_, axis)| axis.split([',', ';']).map(str::trim));
        parts.filter(|parts| parts.clone().nth(NAMES).is_none()).flatten().collect()
    }
}
