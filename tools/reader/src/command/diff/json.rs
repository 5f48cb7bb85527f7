//! A comparison for scripts.

use clap::ValueEnum;
use serde_json::{Map, Value, json};

use super::verdict;
use crate::{
    compare::{ChannelReport, Comparison, Difference, Divergence, FieldReport, Location, Measure},
    format::json::special,
};

/// Version of the JSON form. 2: verdict `not_compared`, `gaps`, `starts`, `outside_a` and `outside_b` for `outside`. 3: what is empty,
/// null or none is left out; channels and fields in which nothing differs are in `equal`, with how much of them was compared. 4: what lay outside the other
/// recording is in `only_a` and `only_b`; they are no difference with `common`; no `shift`.
pub const JSON_VERSION: u32 = 4;

/// One comparison. Numbers that are not finite are texts, as in the JSON mapping of protobuf.
///
/// `channels` lists those in which anything is to be reported, and `fields` their fields that differ or were not compared in full.
/// `equal` holds the others by their names: messages of a channel, values of a field. What is null, an empty list, a count of
/// none or a flag that is not set is left out.
pub fn to_json(names: (&str, &str), comparison: &Comparison) -> Value {
    let structure = comparison.structure.iter().map(|finding| {
        let kind = match &finding.difference {
            Difference::Missing => "missing",
            Difference::Extra => "extra",
            Difference::Renamed(_) => "renamed",
            Difference::Type(..) => "type",
            Difference::Number(..) => "number",
            Difference::Metadata { key, .. } => key,
        };
        json!({ "topic": finding.topic, "field": finding.field, "kind": kind, "text": finding.to_string() })
    });
    let damages = comparison.damages.iter().map(|(path, damage)| {
        let mut value = json!(damage);
        value["file"] = path.to_string_lossy().into();
        value
    });
    let first = |beyond| {
        comparison.first(beyond).map(|(topic, field, divergence)| {
            let mut value = divergence_json(divergence);
            (value["topic"], value["field"]) = (topic.into(), field.path.as_str().into());
            value
        })
    };
    let channels = || comparison.channels.iter();
    let equal = channels().filter(|channel| is_equal(channel));
    let equal: Map<String, Value> =
        equal.map(|channel| (channel.topic.clone(), channel.compared.into())).collect();
    without_none(json!({
        "a": names.0,
        "b": names.1,
        "verdict": match verdict(comparison) {
            super::Verdict::Equal => "equal",
            super::Verdict::Within => "within",
            super::Verdict::NotCompared => "not_compared",
            super::Verdict::Different => "different",
        },
        "lossy": flag(comparison.is_lossy()),
        "converted": comparison.converted.map(|converted| converted.text(names)),
        "time_offset": comparison.offset.map(number),
        "stopped_early": flag(comparison.stopped_early),
        "gaps": comparison.gaps.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "damages": damages.collect::<Vec<_>>(),
        "derived": comparison.derived,
        "residuals": comparison.residuals,
        "stamps_not_compared": comparison.unseen_stamps(),
        "partial": comparison.partial.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(),
        "structure": structure.collect::<Vec<_>>(),
        "provenance": comparison.provenance,
        "first": first(false),
        "first_beyond": first(true),
        "equal": equal,
        "channels": channels().filter(|channel| !is_equal(channel)).map(channel_json).collect::<Vec<_>>(),
    }))
}

/// True if nothing of a channel is to be reported.
fn is_equal(channel: &ChannelReport) -> bool {
    let mut fields = channel.fields.iter();
    !channel.is_notable() && channel.hint.is_none() && fields.all(|field| field.ignored || is_same(field))
}

/// True if all values of a field were compared, and none differs.
fn is_same(field: &FieldReport) -> bool {
    let Measure { differing, skipped, lengths, apart, dropped, .. } = &field.measure;
    field.within
        && !field.ignored
        && !field.untolerated
        && [differing, skipped, lengths, apart, dropped] == [&0; 5]
}

/// A count, unless it is of none.
fn count(number: u64) -> Option<u64> {
    (number > 0).then_some(number)
}

/// A flag, if it is set.
fn flag(is_set: bool) -> Option<bool> {
    is_set.then_some(true)
}

/// An object without what is null or empty in it.
fn without_none(mut value: Value) -> Value {
    let is_none = |value: &Value| {
        value.is_null()
            || value.as_array().is_some_and(Vec::is_empty)
            || value.as_object().is_some_and(Map::is_empty)
    };
    value.as_object_mut().into_iter().for_each(|object| object.retain(|_, value| !is_none(value)));
    value
}

fn channel_json(channel: &ChannelReport) -> Value {
    // as they are typed
    let mode = channel.alignment.mode.and_then(|mode| Some(mode.to_possible_value()?.get_name().to_owned()));
    let same = channel.fields.iter().filter(|field| is_same(field) && field.measure.elements > 0);
    let same: Map<String, Value> =
        same.map(|field| (field.path.clone(), field.measure.elements.into())).collect();
    without_none(json!({
        "topic": channel.topic,
        "within": channel.is_within(),
        "align": mode,
        "align_chosen": channel.alignment.automatic,
        "starts": channel.alignment.starts.map(|starts| starts.map(number)),
        "messages_a": channel.messages[0],
        "messages_b": channel.messages[1],
        "compared": channel.compared,
        "common": flag(channel.common),
        "only_a": count(channel.only_a),
        "only_b": count(channel.only_b),
        "first_alone": channel.first_unmatched.as_ref().map(|(place, in_a)| {
            let mut value = place_json(place);
            value["in"] = if *in_a { "a" } else { "b" }.into();
            value
        }),
        "between": count(channel.between),
        "undecoded": count(channel.undecoded),
        "interpolated": flag(channel.interpolated),
        "hint": channel.hint.map(|hint| hint.to_string()),
        "axes_differ": flag(channel.axes_differ),
        "equal": same,
        "fields": channel.fields.iter().filter(|field| !is_same(field)).map(field_json).collect::<Vec<_>>(),
    }))
}

fn field_json(field: &FieldReport) -> Value {
    let measure = &field.measure;
    let sprague_geers = measure.sprague_geers();
    without_none(json!({
        "field": field.path,
        "unit": field.unit,
        "compared": !field.ignored,
        "within": field.within,
        "untolerated": flag(field.untolerated),
        "tolerance": field.rule.as_ref().map_or("bitwise".to_owned(), |rule| rule.tolerance.to_string()),
        "rule": field.rule.as_ref().map(|rule| &rule.origin),
        "values": measure.elements,
        "differing": measure.differing,
        "beyond": measure.beyond,
        "skipped": count(measure.skipped),
        "lengths": count(measure.lengths),
        "apart": count(measure.apart),
        "dropped": count(measure.dropped),
        "max_abs": measure.max.as_ref().map(|(max, _)| number(*max)),
        "max_abs_at": measure.max.as_ref().map(|(_, place)| place_json(place)),
        "max_peak_rel": measure.peak_relative().map(number),
        "peak": number(measure.scale.peak),
        "l1": number(measure.sums.d1),
        "l1_rel": measure.l1_relative().map(number),
        "l2": number(measure.sums.difference.value()),
        "l2_rel": measure.l2_relative().map(number),
        "linf": measure.max.as_ref().map(|(max, _)| number(*max)),
        "sprague_geers": sprague_geers.map(|[magnitude, phase, combined]| json!({
            "magnitude": number(magnitude), "phase": number(phase), "combined": number(combined),
        })),
        "correlation": measure.correlation().map(number),
        "first": measure.first.as_ref().map(divergence_json),
        "first_beyond": measure.first_beyond.as_ref().map(divergence_json),
    }))
}

fn divergence_json(divergence: &Divergence) -> Value {
    let mut value = place_json(&divergence.place);
    (value["a"], value["b"]) = (divergence.a.as_str().into(), divergence.b.as_str().into());
    value
}

fn place_json(place: &Location) -> Value {
    without_none(json!({
        "sample": place.sample,
        "step": place.step,
        "time": number(place.time),
        "nanoseconds": place.nanoseconds.and_then(|time| i64::try_from(time).ok()),
        "element": place.element,
        "position": place.position,
    }))
}

fn number(value: f64) -> Value {
    if value.is_finite() { value.into() } else { special(value).into() }
}
