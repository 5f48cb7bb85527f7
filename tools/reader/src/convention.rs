//! What the reader knows of percuss: names of metadata, fields, topics and attachments, and what they mean.
//!
//! All else is read from the descriptors and the metadata of a file, whatever program wrote it. Where a file has none of
//! these names, the reader treats it like any other MCAP file. Versions of the format are shown and never
//! decide anything: the names below are the same in all of them.

use std::collections::BTreeMap;

use percuss_picture::Layer;

/// Files in the directory of a sweep: a row of measures for every case, and the journal.
pub const SUMMARY: &str = "summary.csv";
/// What a random sample comes to: mean and band of every measure, and what explains it.
pub const UNCERTAINTY: &str = "uncertainty.csv";
/// The journal of a sweep: a JSON object a line, with the number of a case and the name of its recording below the directory.
pub const MANIFEST: &str = "manifest.jsonl";
/// Column of the number of a case in [`SUMMARY`].
pub const CASE_NUMBER: &str = "case";
/// Column of how a case ended: parameters stand before it, measures behind it.
pub const STATUS_COLUMN: &str = "status";

/// Column of what a case is warned of in [`SUMMARY`]: words between semicolons.
pub const WARNINGS_COLUMN: &str = "warnings";

/// Extension that a recording has until it is complete: `run.mcap.part`.
pub const PART: &str = "part";

/// Metadata records: what a run is, where and when it ran, what its numbers are good for, what was measured of it, and how it ended.
pub const RUN: &str = "percuss.run";
/// Record of where and when a run took place; of it only [`COMMIT`] is compared.
pub const HOST: &str = "percuss.host";
/// Key of the commit of the program in the record [`HOST`].
pub const COMMIT: &str = "commit";
/// Record of the range in which the numbers of a run are valid.
pub const VALIDITY: &str = "percuss.validity";
/// Record of what the messages of a run say of the impact, by the names of [`percuss_table::measures`], without units; from format 2.3 on.
pub const MEASURES: &str = "percuss.summary";
/// Record of how a run ended.
pub const STATUS: &str = "percuss.status";
/// Record of what was lost, which `recover` writes.
pub const RECOVERED: &str = "percuss.recovered";
/// Record of what was compared, which `diff --write-diff` writes.
pub const DIFFERENCE: &str = "percuss.diff";

/// Metadata records of every percuss recording besides [`RUN`].
pub const RECORDS: [&str; 3] = [HOST, VALIDITY, STATUS];

/// Attachment with the case as it was given.
pub const CASE: &str = "case.toml";
/// Attachment with every default of the case written out.
pub const RESOLVED_CASE: &str = "case.resolved.toml";
/// Keys of a case that follow from the others, unless they are given.
pub const DERIVED_KEYS: [&str; 3] = ["mesh.outer_radius", "record.r_max", "record.layer_tension"];

/// Topic of the drag, a message every step.
pub const DRAG: &str = "/drag";
/// Field of the contact radius, beside the force.
pub const RADIUS: &str = "contact_radius";
/// Topic of the velocity of the indenter, a message every step.
pub const VELOCITY: &str = "/velocity";
/// Field of the displacement of the indenter, beside its velocity.
pub const DISPLACEMENT: &str = "displacement";
/// Topic of the stress along the interface.
pub const INTERFACE: &str = "/interface/stress";
/// Topic of what happened, in words.
pub const EVENT: &str = "/event";
/// Topic of the energies of target and indenter, at frames.
pub const ENERGY: &str = "/energy";
/// Field of [`ENERGY`] that is nothing but rounding: its bits say nothing of the physics.
pub const RESIDUAL: &str = "residual";
/// Topic of the surface at frames, for viewers.
pub const PROFILE: &str = "/view/profile";
/// Field of [`PROFILE`]: the face of the indenter, downwards, over the field `r`; NaN beside the indenter, in older recordings 0.
pub const FACE: &str = "indenter";
/// Topic of the stress in the target.
pub const FIELD_STRESS: &str = "/field/stress";
/// Beginning of the topics of fields in the target.
pub const FIELDS: &str = "/field/";
/// Put before the topics of a recording of differences.
pub const DIFFERENCES: &str = "/diff";

/// Beginning of the names of percuss's own schemas.
pub const SCHEMAS: &str = "percuss.";
/// Key of the metadata of a channel that has values along a line in the target: `r = 0`, `z = 0.5`.
pub const LINE: &str = "line";
/// Beginning of the texts of events that warn of results that mislead.
pub const WARNING: &str = "warning: ";

/// Key of the largest strain in the record [`VALIDITY`]; `.time`, `.r` and `.z` behind it say when and where.
pub const LARGEST_STRAIN: &str = "largest_strain";

/// Key of the velocity of the impact in the record [`VALIDITY`], in the unit of velocities.
pub const IMPACT_VELOCITY: &str = "impact_velocity";
/// Key of the energy lost by the mesh in the record [`VALIDITY`], as a share of that of the indenter.
pub const MESH_LOSS: &str = "mesh_loss";
/// Key of the largest interface pressure in the record [`VALIDITY`], with the same keys behind it.
pub const LARGEST_PRESSURE: &str = "largest_pressure";

/// A chart of a report: identifier, title, topic and fields.
pub type Chart = (&'static str, &'static str, &'static str, &'static [&'static str]);

/// Charts of a report.
pub const CHARTS: [Chart; 4] = [
    ("drag", "Drag", DRAG, &["force"]),
    ("velocity", "Velocity of the indenter", VELOCITY, &["velocity"]),
    ("probes", "Interface stress at the probes", "/probes", &["stress"]),
    (
        "energy",
        "Energy",
        ENERGY,
        &["kinetic", "strain", "indenter", "dissipated", "damped", "work", "residual"],
    ),
];

/// Field that holds the time of a message.
pub const TIME: &str = "time";
/// Field that holds the step of a message.
pub const STEP: &str = "step";

/// Entry of the metadata records of percuss that is the checksum of the others.
pub const CHECKSUM: &str = "checksum";

/// True for metadata records with a [`CHECKSUM`]; those of older recordings have none.
pub fn has_checksum(name: &str) -> bool {
    [RUN, HOST, VALIDITY, MEASURES, STATUS].contains(&name)
}

/// The [`CHECKSUM`] of other entries: CRC-32 of keys and values in the order of the keys, each followed by a zero.
pub fn checksum(entries: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for text in entries.iter().flat_map(|(key, value)| [key, value]) {
        hasher.update(text.as_bytes());
        hasher.update(&[0]);
    }
    format!("{:08x}", hasher.finalize())
}

/// Key in the metadata of channels that show in another form what other channels hold.
pub const DERIVED: &str = "derived";

/// Key of the unit of a field.
pub fn unit(field: &str) -> String {
    format!("unit.{field}")
}

/// Key of a field in words.
pub fn meaning(field: &str) -> String {
    format!("meaning.{field}")
}

/// Key of the axis of an array.
pub fn axis(field: &str) -> String {
    format!("{AXIS}{field}")
}

/// The numbers of a list in metadata, separated by commas; `None` if one is none.
pub fn numbers(list: &str) -> Option<Vec<f64>> {
    list.split(',').map(|number| number.trim().parse().ok()).collect()
}

/// Begins the keys of axes.
pub const AXIS: &str = "axis.";

/// True if an array is even about the origin of its axis.
pub fn is_even(metadata: &BTreeMap<String, String>, field: &str) -> bool {
    metadata.get(&format!("symmetry.{field}")).is_some_and(|symmetry| symmetry == "even")
}

/// True for keys of the metadata of a channel that say how its numbers are to be read: unit, axis, symmetry.
pub fn is_structure(key: &str) -> bool {
    ["unit.", AXIS, "symmetry."].iter().any(|beginning| key.starts_with(beginning))
}

/// What the metadata of a channel says of a field, with its keys for a field of two names.
pub fn compared(a: &str, b: &str) -> [(&'static str, String, String); 3] {
    ["unit", "axis", "symmetry"].map(|key| (key, format!("{key}.{a}"), format!("{key}.{b}")))
}

/// The colours of `/field/<name>` reach from −value to value, by the metadata of a view: `colour_range.<name>` with both ends.
pub fn colour_range(metadata: &BTreeMap<String, String>, topic: &str) -> Option<f64> {
    let (low, high) =
        metadata.get(&format!("colour_range.{}", topic.rsplit('/').next()?))?.split_once(',')?;
    let range = f64::max(-low.parse::<f64>().ok()?, high.parse().ok()?);
    (range.is_finite() && range > 0.0).then_some(range)
}

/// Log time that passes in a unit of the time of messages \[s\], by the record [`RUN`].
pub fn playback_rate(run: &BTreeMap<String, String>) -> Option<f64> {
    run.get("playback_rate")?.parse().ok()
}

/// Layers of the target from the struck surface down, by the record [`RUN`]: `layers` is their number, `layer.<n>.name`, `.top` and
/// `.bottom` those of layer n from 1 on. None where there is but one.
pub fn layers(run: &BTreeMap<String, String>) -> Vec<Layer> {
    let count = run.get("layers").and_then(|layers| layers.parse().ok()).unwrap_or(0);
    let layer = |n: usize| {
        let depth = |key: &str| run.get(&format!("layer.{n}.{key}"))?.parse().ok();
        let name = run.get(&format!("layer.{n}.name")).cloned().unwrap_or_default();
        Some(Layer { name, top: depth("top")?, bottom: depth("bottom")? })
    };
    if count > 1 { (1..=count).map_while(layer).collect() } else { Vec::new() }
}

/// Coordinate of the depths in a target.
pub const DEPTH: &str = "z";

/// The names that say where the elements of an array are, in the text of an axis, without that of a list: versions before 2.2 of the
/// format have none.
pub fn steps(axis: &str) -> String {
    let (count, sides): (usize, Vec<&str>) =
        if axis.contains(';') { (3, axis.split(';').collect()) } else { (2, vec![axis]) };
    let steps = |side: &&str| side.split(',').take(count).collect::<Vec<_>>().join(",");
    sides.iter().map(steps).collect::<Vec<_>>().join(";")
}

/// Topics that every recording holds, by the record [`RUN`]: all closed forms know the stress, not all of them the drag.
pub fn required_topics(run: &BTreeMap<String, String>) -> &'static [&'static str] {
    match run.get("source").map(String::as_str) {
        Some("exact") => &[INTERFACE, VELOCITY],
        _ => &[INTERFACE, DRAG, VELOCITY],
    }
}

/// How a run ended, by its record [`STATUS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// At the last of its steps.
    Completed,
    /// Where the case says.
    Stopped,
    /// Before its planned end.
    Early,
}

impl Ending {
    /// The ending that a status stands for.
    pub fn of(status: &str) -> Option<Self> {
        match status {
            "completed" => Some(Self::Completed),
            "stopped" => Some(Self::Stopped),
            "interrupted" | "failed" => Some(Self::Early),
            _ => None,
        }
    }
}
