//! What a report says in words: what came out, and of what run. Numbers have their unit and four digits.

use std::collections::BTreeMap;

use percuss_table::{
    measures::{BODIES, Measure, RATIO, RATIOS, TRACTIONS, Units},
    units::{RECORDED, Unit},
};
use serde_json::{Value, json};

use super::curves::Charts;
use crate::{
    command::{summary::Reading, view::find},
    convention::{
        self, CHARTS, DEPTH, ENERGY, HOST, INTERFACE, LARGEST_PRESSURE, LARGEST_STRAIN, RUN, STATUS, VALIDITY,
    },
    messages::Recording,
    prefix::engineering,
};

/// Measures in words, in the order of the page.
const RESULTS: [(&str, &str); 10] = [
    ("peak_force", "Peak force"),
    ("impulse", "Impulse"),
    ("contact_duration", "Duration of contact"),
    ("contact_radius", "Largest contact radius"),
    ("depth", "Largest depth of the indenter"),
    ("rebound_velocity", "Velocity of rebound"),
    ("restitution", "Coefficient of restitution"),
    ("restitution_mesh_corrected", "Restitution with the mesh's loss returned"),
    ("t_ext", "First tension, or turn of the contact"),
    ("energy_left", "Energy left in the target"),
];

/// Rows of names and texts: `results`, `run` and `energy`.
pub(super) fn facts(recording: &Recording, reading: &Reading, charts: &Charts<'_>) -> Value {
    json!({
        "results": results(recording, reading),
        "run": run(recording, &reading.units),
        "energy": energy(recording, charts),
    })
}

type Rows = Vec<(String, String)>;

fn results(recording: &Recording, reading: &Reading) -> Rows {
    let units = &reading.units;
    let measure = |name: &str| reading.measures.iter().find(|measure| measure.name == name);
    let text = |Measure { quantity, value, .. }: &Measure| {
        Some(engineering((*value)?, quantity.unit(units).as_deref()))
    };
    let row = |(name, label): (&str, &str)| {
        let mut text = text(measure(name)?)?;
        let peak_time =
            measure("peak_time").filter(|_| name == "peak_force").and_then(|measure| measure.value);
        if let Some(time) = peak_time {
            text += &format!(" at t = {}", engineering(time, units.time.as_deref()));
        }
        if name == "t_ext" {
            text = format!("at t = {text}");
        }
        Some((label.to_owned(), text))
    };
    let mut rows: Rows = RESULTS.into_iter().filter_map(row).collect();
    let Some(validity) = recording.entries(VALIDITY) else { return rows };
    let stress =
        find(recording, |topic| topic == INTERFACE).and_then(|id| recording.channels[&id].unit("stress"));
    let single = [
        ("Largest pressure", LARGEST_PRESSURE, stress),
        ("Largest strain", LARGEST_STRAIN, None),
        ("Largest ratio of von Mises to yield strength", RATIOS[0], None),
        ("Largest ratio of tension to tensile strength", RATIOS[1], None),
    ];
    let single = single.into_iter().map(|(label, key, unit)| (label.to_owned(), key.to_owned(), unit));
    let interfaces = BODIES.into_iter().zip(["", " of the indenter"]).flat_map(|(body, of)| {
        let rows = (1..).map(move |number| {
            TRACTIONS.map(|name| {
                let (what, unit) =
                    if name == RATIO { ("ratio to the strength of the bond", None) } else { (name, stress) };
                let label = format!("Largest {what} at interface {number}{of}");
                (label, format!("{body}interface.{number}.{name}"), unit)
            })
        });
        rows.take_while(|[(_, key, _), ..]| validity.contains_key(key)).flatten()
    });
    rows.extend(single.chain(interfaces).filter_map(|(label, key, unit)| {
        let number = |key: &str| validity.get(key)?.parse::<f64>().ok();
        let length = units.length.as_deref();
        let place = [("r", length), ("z", length), ("time", units.time.as_deref())];
        let place = place.into_iter().filter_map(|(name, unit)| {
            let number = number(&format!("{key}.{name}"))?;
            Some(format!("{} = {}", if name == "time" { "t" } else { name }, engineering(number, unit)))
        });
        let place: Vec<String> = place.collect();
        let at = if place.is_empty() { String::new() } else { format!(" at {}", place.join(", ")) };
        Some((label, engineering(number(&key)?, unit) + &at))
    }));
    if let Some(limit) = validity.get("strain_limit") {
        rows.push(("Limit of linear theory".into(), format!("strain {limit}")));
    }
    rows
}

fn run(recording: &Recording, units: &Units) -> Rows {
    let empty = BTreeMap::new();
    let [run, status, host] = [RUN, STATUS, HOST].map(|name| recording.entries(name).unwrap_or(&empty));
    let number = |key: &str| run.get(key)?.parse::<f64>().ok();
    let (length, time) = (units.length.as_deref(), units.time.as_deref());
    let words = |keys: &[&str]| {
        let words: Vec<&str> = keys.iter().filter_map(|key| run.get(*key)).map(String::as_str).collect();
        (!words.is_empty()).then(|| words.join(", "))
    };
    let layers = recording
        .layers(DEPTH)
        .into_iter()
        .map(|layer| format!("{} {}", layer.name, engineering(layer.bottom - layer.top, length)));
    let layers: Vec<String> = layers.collect();
    let spacing = || {
        Some(format!(
            "dr = {}, dz = {}",
            engineering(number("dr")?, length),
            engineering(number("dz")?, length)
        ))
    };
    let steps = || {
        let made = status.get("last_step").or(run.get("steps"))?;
        Some(format!("{made} of {} steps of {}", run.get("steps")?, engineering(number("dt")?, time)))
    };
    let scales = || {
        let scale = |Unit { plain, si, scale, .. }: &Unit| {
            Some(format!("{plain} = {}", engineering(number(scale)?, Some(si))))
        };
        let scales: Vec<String> = RECORDED.iter().filter_map(scale).collect();
        (!scales.is_empty()).then(|| scales.join(", "))
    };
    let rows = [
        ("Theory", words(&["model", "geometry"])),
        ("Contact", words(&["contact"])),
        ("Layers", (!layers.is_empty()).then(|| layers.join(", "))),
        ("Mesh", run.get("nr").zip(run.get("nz")).map(|(nr, nz)| format!("{nr} × {nz} nodes"))),
        ("Spacing", spacing()),
        ("Time", steps()),
        ("Units", scales()),
        ("Computed", host.get("start_time").cloned()),
    ];
    rows.into_iter().filter_map(|(name, text)| Some((name.to_owned(), text?))).collect()
}

/// Energies at the end, with what each is.
fn energy(recording: &Recording, charts: &Charts<'_>) -> Rows {
    let Some(id) = find(recording, |topic| topic == ENERGY) else { return Vec::new() };
    let channel = &recording.channels[&id];
    let fields = CHARTS.iter().filter(|(.., topic, _)| *topic == ENERGY).flat_map(|(.., fields)| *fields);
    let row = |name: &&str| {
        let curve = charts.of_topic(ENERGY)?.curve(name);
        let last = curve.iter().rev().map(|point| point.1).find(|value| value.is_finite())?;
        let meaning = channel.metadata.get(&convention::meaning(name)).map_or(*name, String::as_str);
        let (first, rest) = meaning.split_at(meaning.chars().next().map_or(0, char::len_utf8));
        Some((first.to_uppercase() + rest, engineering(last, channel.unit(name))))
    };
    fields.filter_map(row).collect()
}
