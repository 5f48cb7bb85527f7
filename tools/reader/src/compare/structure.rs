//! What two recordings have in common before any number is compared: channels, fields, units; and where their metadata
//! and attachments differ.

use std::{
    collections::{BTreeMap, BTreeSet, HashSet, hash_map::DefaultHasher},
    hash::{Hash, Hasher},
};

use prost_reflect::{EnumDescriptor, Kind};

use super::{
    convert::{self, Converter},
    options::Options,
    tolerance::{Rule, Rules},
};
use crate::{
    channel::Channel,
    convention,
    failure::Failure,
    instant::Instant,
    messages::Recording,
    recording::Budget,
    scales::Scales,
    toml_keys,
    wire::{COUNT, Layout, Leaf, Type, UNKNOWN},
};

/// A difference of structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    pub topic: String,
    /// Field, if it is about one.
    pub field: Option<String>,
    pub difference: Difference,
}

/// What is different.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// Only the reference has it.
    Missing,
    /// Only the new recording has it.
    Extra,
    /// A field with this number has another name in the new recording.
    Renamed(String),
    /// Type, message type or encoding.
    Type(String, String),
    /// The number of the field, or of one of those that it is in.
    Number(u32, u32),
    /// Entry of the channel metadata: unit, axis, symmetry.
    Metadata { key: String, a: String, b: String },
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.topic)?;
        if let Some(field) = &self.field {
            write!(f, ".{field}")?;
        }
        match &self.difference {
            Difference::Missing => f.write_str(": missing from the new recording"),
            Difference::Extra => f.write_str(": only in the new recording"),
            Difference::Renamed(name) => write!(f, ": renamed to `{name}`"),
            Difference::Type(a, b) => write!(f, ": type {a} became {b}"),
            Difference::Number(a, b) => write!(f, ": field number {a} became {b}"),
            Difference::Metadata { key, a, b } => write!(f, ": {key} `{a}` became `{b}`"),
        }
    }
}

/// Two channels to be compared.
pub(super) struct Pair {
    pub(super) a: u16,
    pub(super) b: u16,
    /// Leaves of both; empty where messages are compared as bytes.
    pub(super) leaves: Vec<(usize, usize)>,
    /// What puts the new channel into the units of the reference.
    pub(super) converter: Converter,
    /// Where the times of both count from; `None` if they are on one clock.
    pub(super) starts: Option<[Instant; 2]>,
}

/// For every rule, whether it fits a topic or field of one of the recordings.
pub(super) fn fitting(a: &Recording, b: &Recording, rules: &Rules) -> Vec<bool> {
    let channels = || a.channels.values().chain(b.channels.values());
    let fits = |rule: &Rule| {
        channels().any(|channel| {
            let leaves = channel.layout.iter().flat_map(|layout| &layout.leaves);
            let paths = leaves.map(|leaf| leaf.path.as_str());
            let last = |path: &str| path.rsplit('.').next().is_some_and(|field| rule.fits_time(field));
            let mut all = paths.chain(channel.layout.is_none().then_some(WHOLE));
            all.any(|path| rule.fits(&channel.topic, path) || last(path))
        })
    };
    rules.rules.iter().map(fits).collect()
}

/// Path of a message that is compared as bytes.
pub(super) const WHOLE: &str = "(message)";

/// Finds every topic and field that was asked for in one of the recordings.
pub(super) fn find_chosen(a: &Recording, b: &Recording, options: &Options) -> Result<(), Failure> {
    let channels = || a.channels.values().chain(b.channels.values());
    for topic in &options.topics {
        if !channels().any(|channel| topic.fits(&channel.topic)) {
            return Err(Failure::Usage(format!("neither recording has a topic `{}`", topic.text())));
        }
    }
    let chosen = |channel: &&Channel| {
        options.topics.is_empty() || options.topics.iter().any(|topic| topic.fits(&channel.topic))
    };
    for field in &options.fields {
        let paths = channels().filter(chosen).filter_map(|channel| channel.layout.as_ref());
        if !paths.flat_map(|layout| &layout.leaves).any(|leaf| field.fits(&leaf.path)) {
            return Err(Failure::Usage(format!("neither recording has a field `{}`", field.text())));
        }
    }
    Ok(())
}

/// Residuals of rounding that both recordings have and that are not compared.
pub(super) fn residuals(a: &Recording, pairs: &[Pair], options: &Options) -> BTreeSet<String> {
    let of_pair = |pair: &Pair| {
        let channel = &a.channels[&pair.a];
        let paths = channel.layout.iter().flat_map(|layout| &layout.leaves).map(|leaf| &leaf.path);
        let left_out = paths.filter(|path| options.leaves_out_residual(&channel.topic, path));
        left_out.map(|path| format!("{}.{path}", channel.topic)).collect::<Vec<_>>()
    };
    pairs.iter().flat_map(of_pair).collect()
}

/// Topics that are left out because they are derived from others, in every recording that has them, and were not asked for.
pub(super) fn derived(a: &Recording, b: &Recording, options: &Options) -> BTreeSet<String> {
    let channels = || a.channels.values().chain(b.channels.values());
    let own: HashSet<&str> =
        channels().filter(|channel| !channel.is_derived()).map(|channel| channel.topic.as_str()).collect();
    let left_out = |channel: &&Channel| options.topics.is_empty() && !own.contains(channel.topic.as_str());
    channels().filter(left_out).map(|channel| channel.topic.clone()).collect()
}

/// Pairs the channels of two recordings, and reports what cannot be paired.
pub(super) fn pair(a: &Recording, b: &Recording, options: &Options) -> (Vec<Pair>, Vec<Finding>) {
    let (topics, derived) = (&options.topics, derived(a, b, options));
    let chosen = |channel: &Channel| {
        let asked = match topics.as_slice() {
            // what it is made from is compared
            [] => !derived.contains(&channel.topic),
            topics => topics.iter().any(|topic| topic.fits(&channel.topic)),
        };
        asked && !options.rules.ignores(&channel.topic, None)
    };
    let scales = Scales::between(b, a);
    let (mut pairs, mut findings) = (Vec::new(), Vec::new());
    let whole =
        |channel: &Channel, difference| Finding { topic: channel.topic.clone(), field: None, difference };
    // what is left of the other recording
    let key = |id: u16| (b.channels[&id].topic.as_str(), b.channels[&id].schema.as_str(), id);
    let mut left: BTreeSet<(&str, &str, u16)> = b.channels.keys().map(|&id| key(id)).collect();
    for (&id_a, channel_a) in a.channels.iter().filter(|(_, channel)| chosen(channel)) {
        let (topic, schema) = (channel_a.topic.as_str(), channel_a.schema.as_str());
        let same = left.range((topic, schema, 0)..=(topic, schema, u16::MAX)).next();
        let of_topic = left.range((topic, "", 0)..).take_while(|(other, ..)| *other == topic);
        let Some(&partner) = same.or_else(|| of_topic.min_by_key(|(.., id)| *id)) else {
            findings.push(whole(channel_a, Difference::Missing));
            continue;
        };
        left.remove(&partner);
        let (id_b, channel_b) = (partner.2, &b.channels[&partner.2]);
        let leaves = fields((channel_a, channel_b), options, &scales, &mut findings);
        let converter = Converter::of(channel_a, channel_b, &leaves, &scales);
        pairs.push(Pair { a: id_a, b: id_b, leaves, converter, starts: None });
    }
    let extra = b.channels.iter().filter(|(id, channel)| left.contains(&key(**id)) && chosen(channel));
    findings.extend(extra.map(|(_, channel)| whole(channel, Difference::Extra)));
    (pairs, findings)
}

/// Pairs the fields of two channels by name, then by number.
fn fields(
    (a, b): (&Channel, &Channel),
    options: &Options,
    scales: &Scales,
    findings: &mut Vec<Finding>,
) -> Vec<(usize, usize)> {
    let topic = &a.topic;
    let by_name = options.by_name;
    let mut find = |field: Option<&str>, difference: Difference| {
        if field.map_or_else(|| !options.rules.ignores(topic, None), |field| options.chooses(topic, field)) {
            findings.push(Finding { topic: topic.clone(), field: field.map(str::to_owned), difference });
        }
    };
    if a.encoding != b.encoding && !(by_name && a.layout.is_some() && b.layout.is_some()) {
        find(None, Difference::Type(a.encoding.clone(), b.encoding.clone()));
        return Vec::new();
    }
    if a.schema != b.schema && !by_name {
        find(None, Difference::Type(a.schema.clone(), b.schema.clone()));
    }
    let (Some(layout_a), Some(layout_b)) = (&a.layout, &b.layout) else {
        if a.layout.is_some() != b.layout.is_some() {
            let state =
                |channel: &Channel| if channel.layout.is_some() { "sound schema" } else { "no sound schema" };
            find(None, Difference::Type(state(a).into(), state(b).into()));
        }
        return Vec::new();
    };
    let mut pairs = Vec::new();
    let mut taken = BTreeSet::new();
    for (i, leaf) in layout_a.leaves.iter().enumerate() {
        let renamed = || if by_name { None } else { by_number(leaf, layout_a, layout_b) };
        let Some(j) = layout_b.find(&leaf.path).or_else(renamed) else {
            // what no message holds is not missing
            if !(by_name && (leaf.path == UNKNOWN || is_implied(i, layout_a, layout_b))) {
                find(Some(&leaf.path), Difference::Missing);
            }
            continue;
        };
        taken.insert(j);
        let other = &layout_b.leaves[j];
        let both_numbers = leaf.kind.is_number() && other.kind.is_number();
        let is_pair =
            both_numbers || std::mem::discriminant(&leaf.kind) == std::mem::discriminant(&other.kind);
        let mut found = differences((a, leaf), (b, other), scales);
        if by_name {
            // what one of them does not say, and how numbers are written
            found.retain(|difference| match difference {
                Difference::Metadata { a, b, .. } => !a.is_empty() && !b.is_empty(),
                Difference::Type(..) => !is_pair,
                Difference::Number(..) => false,
                _ => true,
            });
        }
        found.into_iter().for_each(|found| find(Some(&leaf.path), found));
        if is_pair {
            pairs.push((i, j));
        }
    }
    let is_expected = |j: usize| taken.contains(&j) || (by_name && is_implied(j, layout_b, layout_a));
    for j in (0..layout_b.leaves.len()).filter(|&j| !is_expected(j)) {
        find(Some(&layout_b.leaves[j].path), Difference::Extra);
    }
    pairs
}

/// True if a leaf only says that a message is there whose fields the other layout has: those say it there.
fn is_implied(leaf: usize, layout: &Layout, other: &Layout) -> bool {
    let message = layout.leaves[leaf].path.trim_end_matches(COUNT);
    layout.counts_presence(leaf) && other.leaves.iter().any(|leaf| leaf.path.starts_with(message))
}

/// The field with the number of another whose name it has not.
fn by_number(leaf: &Leaf, layout: &Layout, other: &Layout) -> Option<usize> {
    let is_same = |other: &Leaf| other.numbers == leaf.numbers && layout.find(&other.path).is_none();
    other.leaves.iter().position(is_same)
}

/// What is different of a field that both channels have: its name, its type, its metadata.
fn differences(
    (a, leaf): (&Channel, &Leaf),
    (b, other): (&Channel, &Leaf),
    scales: &Scales,
) -> Vec<Difference> {
    let mut differences = Vec::new();
    if other.path != leaf.path {
        differences.push(Difference::Renamed(other.path.clone()));
    }
    let [kind, other_kind] = [leaf, other].map(|leaf| {
        let list = if leaf.lists > 0 { "repeated " } else { "" };
        match &leaf.declared {
            Some(Kind::Message(_)) => format!("{list}message"),
            Some(kind) => format!("{list}{kind:?}"),
            None => format!("{list}{}", leaf.kind.name()),
        }
    });
    if kind != other_kind {
        differences.push(Difference::Type(kind, other_kind));
    }
    // those of JSON are of the order in which its fields come up
    let are_numbered =
        [a, b].iter().all(|channel| channel.layout.as_ref().is_some_and(|layout| !layout.is_json()));
    let numbers = leaf.numbers.iter().zip(&other.numbers).find(|(number, other)| number != other);
    if let Some((number, other)) = numbers.filter(|_| are_numbered) {
        differences.push(Difference::Number(*number, *other));
    }
    for (key, of_a, of_b) in convention::compared(&leaf.path, &other.path) {
        let (of_a, of_b) = (a.metadata.get(&of_a), b.metadata.get(&of_b));
        // the list of places that an axis names need not be there
        let are_steps = |a: &&String| key == "axis" && convention::numbers(a).is_none();
        let steps = |axis: Option<&String>| axis.filter(are_steps).map(|axis| convention::steps(axis));
        if of_a == of_b || steps(of_a).is_some_and(|a| Some(a) == steps(of_b)) {
            continue;
        }
        let texts = [of_a, of_b].map(|text| text.cloned().unwrap_or_default());
        if !convert::explains(key, texts.each_ref().map(String::as_str), (a, leaf), (b, other), scales) {
            let [a, b] = texts;
            differences.push(Difference::Metadata { key: key.into(), a, b });
        }
    }
    differences
}

/// A difference of metadata or attachments. It explains why numbers differ, and is no difference of its own.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Change {
    /// Record or attachment, and the key in it.
    pub place: String,
    pub key: String,
    /// What reference and new recording have there, if they do.
    pub a: Option<String>,
    pub b: Option<String>,
}

/// What differs of two channels and says nothing of their numbers: metadata but units, axes and symmetries, which are
/// structure, and the names of the values of enums.
pub(super) fn remarks(a: &Recording, b: &Recording, pair: &Pair) -> Vec<Change> {
    let (a, b) = (&a.channels[&pair.a], &b.channels[&pair.b]);
    let mut changes = Vec::new();
    let other = |channel: &Channel| -> BTreeMap<String, String> {
        let other = channel.metadata.iter().filter(|(key, _)| !convention::is_structure(key));
        other.map(|(key, value)| (key.clone(), value.clone())).collect()
    };
    compare_entries(&a.topic, &other(a), &other(b), &mut changes);
    let (Some(layout_a), Some(layout_b)) = (&a.layout, &b.layout) else { return changes };
    for &(leaf_a, leaf_b) in &pair.leaves {
        let (leaf, other) = (&layout_a.leaves[leaf_a], &layout_b.leaves[leaf_b]);
        let (Type::Enum(names), Type::Enum(others)) = (&leaf.kind, &other.kind) else { continue };
        let table = |names: &EnumDescriptor| -> BTreeMap<String, String> {
            let values = names.values();
            values.map(|value| (format!("name of {}", value.number()), value.name().to_owned())).collect()
        };
        compare_entries(&format!("{}.{}", a.topic, leaf.path), &table(names), &table(others), &mut changes);
    }
    changes
}

/// Compares metadata records and attachments; attachments in TOML key by key.
pub(super) fn provenance(a: &Recording, b: &Recording) -> Result<Vec<Change>, Failure> {
    let mut changes = Vec::new();
    let names: BTreeSet<&str> =
        a.metadata.iter().chain(&b.metadata).map(|record| record.name.as_str()).collect();
    for name in names {
        let compared = |recording: &Recording| {
            let mut entries = recording.entries(name).cloned().unwrap_or_default();
            entries.retain(|key, _| name != convention::HOST || key == convention::COMMIT);
            entries
        };
        compare_entries(name, &compared(a), &compared(b), &mut changes);
    }
    let (all_a, all_b) = (digests(a)?, digests(b)?);
    let names: BTreeSet<&String> = all_a.keys().chain(all_b.keys()).collect();
    // the resolved case says all that the case file says
    let resolved = names.iter().any(|name| *name == convention::RESOLVED_CASE);
    for name in names.into_iter().filter(|name| !(resolved && *name == convention::CASE)) {
        let (of_a, of_b) = (all_a.get(name), all_b.get(name));
        if of_a.map(|digest| digest.hash) == of_b.map(|digest| digest.hash) {
            continue;
        }
        let table =
            |digest: Option<&Digest>| digest.map_or(Some(BTreeMap::new()), |digest| digest.table.clone());
        match (table(of_a), table(of_b)) {
            (Some(a), Some(b)) => compare_entries(name, &a, &b, &mut changes),
            _ => {
                let size = |digest: Option<&Digest>| digest.map(|digest| format!("{} bytes", digest.size));
                let (a, b) = (size(of_a), size(of_b));
                changes.push(Change { place: name.clone(), key: "content".into(), a, b });
            }
        }
    }
    if !a.library.is_empty() && !b.library.is_empty() && a.library != b.library {
        let (a, b) = (Some(a.library.clone()), Some(b.library.clone()));
        changes.push(Change { place: "header".into(), key: "library".into(), a, b });
    }
    Ok(changes)
}

/// What is kept of an attachment to compare it.
struct Digest {
    size: u64,
    hash: u64,
    /// Entries of a TOML file, by dotted keys.
    table: Option<BTreeMap<String, String>>,
}

/// Digests of all attachments by name, in one pass.
fn digests(recording: &Recording) -> Result<BTreeMap<String, Digest>, Failure> {
    let mut digests = BTreeMap::new();
    // as many as the recording has room for in its own list
    let room = recording.attachments.len();
    let mut budget = Budget::new(recording.limits().kept());
    recording.find_attachment(|name, content| {
        let is_toml = name.ends_with(".toml");
        let entries = |content| toml_keys::entries(content, &mut budget);
        let table = content.ok().filter(|_| is_toml).and_then(entries);
        let table =
            table.map(|table| table.into_iter().map(|(key, value)| (key, value.to_string())).collect());
        let mut hasher = DefaultHasher::new();
        content.hash(&mut hasher);
        let size = content.map_or_else(|left_out| left_out.size, |content| content.len() as u64);
        digests.insert(name.to_owned(), Digest { size, hash: hasher.finish(), table });
        (digests.len() >= room).then_some(())
    })?;
    Ok(digests)
}

fn compare_entries(
    place: &str,
    a: &BTreeMap<String, String>,
    b: &BTreeMap<String, String>,
    changes: &mut Vec<Change>,
) {
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    for key in keys.into_iter().filter(|key| a.get(*key) != b.get(*key)) {
        let (a, b) = (a.get(key).cloned(), b.get(key).cloned());
        changes.push(Change { place: place.into(), key: key.clone(), a, b });
    }
}
