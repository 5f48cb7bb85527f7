//! A comparison for scripts.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::{
    compare::{ChannelReport, Comparison, Difference, Divergence, FieldReport, Location, Measure, Verdict},
    format::json::special,
};

/// Version of the JSON form. 2: verdict `not_compared`, `gaps`, `starts`, `outside_a` and `outside_b` for `outside`. 3: what is empty,
/// null or none is left out; channels and fields in which nothing differs are in `equal`, with how much of them was compared. 4: what lay outside the other
/// recording is in `only_a` and `only_b`; they are no difference with `common`; no `shift`.
pub(super) const JSON_VERSION: u32 = 4;

/// One comparison. Numbers that are not finite are texts, as in the JSON mapping of protobuf.
///
/// `channels` lists those in which anything is to be reported, and `fields` their fields that differ or were not compared in full.
/// `equal` holds the others by their names: messages of a channel, values of a field. What is null, an empty list, a count of
/// none or a flag that is not set is left out.
pub(super) fn to_json(a: &Path, b: &Path, comparison: &Comparison) -> Value {
    let [a, b] = [a, b].map(Path::to_string_lossy);
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
            (value["topic"], value["field"]) = (topic.into(), field.leaf.path.as_str().into());
            value
        })
    };
    let channels = || comparison.channels.iter();
    let equal = channels().filter(|channel| is_equal(channel));
    let equal: Map<String, Value> =
        equal.map(|channel| (channel.topic.clone(), channel.compared.into())).collect();
    without_none(json!({
        "a": a,
        "b": b,
        "verdict": comparison.verdict(),
        "lossy": any(comparison.is_lossy()),
        "converted": comparison.converted.map(|converted| converted.text(&a, &b)),
        "time_offset": comparison.offset.map(number),
        "stopped_early": any(comparison.stopped_early),
        "gaps": comparison.gaps,
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
    channel.verdict() == Verdict::Equal
        && channel.hint.is_none()
        && fields.all(|field| field.ignored || is_same(field))
}

/// True if all values of a field were compared, and none differs.
fn is_same(field: &FieldReport) -> bool {
    let Measure { differing, skipped, lengths, apart, dropped, .. } = &field.measure;
    field.within
        && !field.ignored
        && !field.untolerated
        && [differing, skipped, lengths, apart, dropped] == [&0; 5]
}

/// A count unless it is of none, or a flag if it is set.
fn any<T: Default + PartialEq>(value: T) -> Option<T> {
    (value != T::default()).then_some(value)
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
    let same = channel.fields.iter().filter(|field| is_same(field) && field.measure.elements > 0);
    let same: Map<String, Value> =
        same.map(|field| (field.leaf.path.clone(), field.measure.elements.into())).collect();
    without_none(json!({
        "topic": channel.topic,
        "within": !channel.verdict().has_failed(),
        "align": channel.mode,
        "align_chosen": channel.automatic,
        "starts": channel.starts.map(|starts| starts.map(number)),
        "messages_a": channel.messages[0],
        "messages_b": channel.messages[1],
        "compared": channel.compared,
        "common": any(channel.common),
        "only_a": any(channel.only[0]),
        "only_b": any(channel.only[1]),
        "first_alone": channel.first_unmatched.as_ref().map(|(place, in_a)| {
            let mut value = place_json(place);
            value["in"] = if *in_a { "a" } else { "b" }.into();
            value
        }),
        "between": any(channel.between),
        "undecoded": any(channel.undecoded),
        "interpolated": any(channel.interpolated),
        "hint": channel.hint.map(|hint| hint.to_string()),
        "axes_differ": any(channel.axes_differ),
        "equal": same,
        "fields": channel.fields.iter().filter(|field| !is_same(field)).map(field_json).collect::<Vec<_>>(),
    }))
}

fn field_json(field: &FieldReport) -> Value {
    let measure = &field.measure;
    without_none(json!({
        "field": field.leaf.path,
        "unit": field.unit,
        "compared": !field.ignored,
        "within": field.within,
        "untolerated": any(field.untolerated),
        "tolerance": field.rule.as_ref().map_or("bitwise".to_owned(), |rule| rule.tolerance.to_string()),
        "rule": field.rule.as_ref().map(|rule| &rule.origin),
        "values": measure.elements,
        "differing": measure.differing,
        "beyond": measure.beyond,
        "skipped": any(measure.skipped),
        "lengths": any(measure.lengths),
        "apart": any(measure.apart),
        "dropped": any(measure.dropped),
        "max_abs": measure.max.as_ref().map(|(max, _)| number(*max)),
        "max_abs_at": measure.max.as_ref().map(|(_, place)| place_json(place)),
        "max_peak_rel": measure.peak_relative().map(number),
        "peak": number(measure.scale.peak),
        "l1": number(measure.sums.d1),
        "l1_rel": measure.l1_relative().map(number),
        "l2": number(measure.sums.difference.value()),
        "l2_rel": measure.l2_relative().map(number),
        "linf": measure.max.as_ref().map(|(max, _)| number(*max)),
        "sprague_geers": measure.sprague_geers().map(|[magnitude, phase, combined]| json!({
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
        "time": number(place.time.number()),
        "nanoseconds": place.time.nanoseconds().and_then(|time| i64::try_from(time).ok()),
        "element": place.element,
        "position": place.position,
    }))
}

fn number(value: f64) -> Value {
    if value.is_finite() { value.into() } else { special(value).into() }
}
