//! Prefixed units of a report: one for the time, one for every other axis. Dimensionless reports stay as they are.

use serde_json::{Value, json};

use super::curves::number;
use crate::prefix::Prefixed;

/// Puts the numbers of a report into the units in which they are best read.
pub fn prefix(data: &mut Value) {
    let charts = || data["charts"].as_array().into_iter().flatten();
    let label = charts().next().map_or(Value::Null, |chart| chart["x"].clone());
    let times = charts()
        .flat_map(|chart| numbers(&chart["curves"], "x"))
        .chain(numbers(&data["profiles"]["frames"], "time"));
    if let Some(time) = chosen(&label, times.fold(0.0, f64::max)) {
        scale(&mut data["events"], "time", &time);
        // what is not recorded stays null
        data.pointer_mut("/profiles/frames").into_iter().for_each(|frames| scale(frames, "time", &time));
        data.pointer_mut("/field/times").into_iter().for_each(|times| scale_numbers(times, &time));
        data["charts"]
            .as_array_mut()
            .into_iter()
            .flatten()
            .for_each(|chart| axis(chart, "curves", "x", Some(&time)));
        data["time_unit"] = time.unit.into();
    }
    for chart in data["charts"].as_array_mut().into_iter().flatten() {
        axis(chart, "curves", "y", None);
    }
    for coordinate in ["x", "y"] {
        axis(&mut data["profiles"], "frames", coordinate, None);
    }
    field(&mut data["field"]);
}

/// The unit at the end of a label in brackets, with the prefix for its largest number.
fn chosen(label: &Value, largest: f64) -> Option<Prefixed> {
    let (_, unit) = label.as_str()?.strip_suffix(']')?.rsplit_once('[')?;
    Prefixed::choose(unit, largest)
}

/// All numbers of a key of the objects in a list, by magnitude; lists of numbers are taken apart.
fn numbers<'a>(list: &'a Value, key: &'a str) -> impl Iterator<Item = f64> + 'a {
    let values = list.as_array().into_iter().flatten().map(move |object| &object[key]);
    values
        .flat_map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice))
        .filter_map(|value| value.as_f64().map(f64::abs))
}

/// Scales an axis of a chart: its label, and the lists of that name. What is known of it by another axis comes as `unit`.
fn axis(chart: &mut Value, curves: &str, coordinate: &str, unit: Option<&Prefixed>) {
    let largest = numbers(&chart[curves], coordinate).fold(0.0, f64::max);
    let Some(unit) = unit.cloned().or_else(|| chosen(&chart[coordinate], largest)) else { return };
    scale(&mut chart[curves], coordinate, &unit);
    let name =
        chart[coordinate].as_str().and_then(|label| label.rsplit_once('[')).map_or("", |(name, _)| name);
    chart[coordinate] = format!("{name}[{}]", unit.unit).into();
    if coordinate == "y" {
        chart["unit"] = unit.unit.into();
    }
}

/// Scales what objects in a list have under a key.
fn scale(list: &mut Value, key: &str, unit: &Prefixed) {
    let objects = list.as_array_mut().into_iter().flatten();
    objects.filter_map(|object| object.get_mut(key)).for_each(|value| scale_numbers(value, unit));
}

/// Scales a number, or all numbers of a list.
fn scale_numbers(value: &mut Value, unit: &Prefixed) {
    if let Some(known) = value.as_f64() {
        *value = number(unit.apply(known));
    }
    value.as_array_mut().into_iter().flatten().for_each(|value| scale_numbers(value, unit));
}

/// The range of the colours, and the size of the section.
fn field(field: &mut Value) {
    let number = |value: &Value| value.as_f64().unwrap_or_default();
    let unit = |value: &Value, largest| Prefixed::choose(value.as_str()?, largest);
    if let Some(unit) = unit(&field["unit"], number(&field["range"])) {
        scale_numbers(&mut field["range"], &unit);
        field["unit"] = json!(unit.unit);
    }
    let lengths = |view: &Value| number(&view["width"]).max(number(&view["depth"]));
    // as the first view is best read
    let largest = field["views"].get(0).map_or(0.0, lengths);
    if let Some(unit) = unit(&field["length_unit"], largest) {
        for key in ["width", "depth", "pixel"] {
            scale(&mut field["views"], key, &unit);
        }
        for key in ["depths", "radii", "r", "height"] {
            field["body"].get_mut(key).into_iter().for_each(|list| scale_numbers(list, &unit));
        }
        field["length_unit"] = json!(unit.unit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(time: &str, force: &str, length: &str) -> Value {
        json!({
            "charts": [
                { "x": format!("time [{time}]"), "y": format!("force [{force}]"), "curves": [{ "x": [0.0, 2e-5], "y": [null, 1.5e6] }] },
            ],
            "events": [{ "time": 1e-5, "text": "" }],
            "profiles": { "x": format!("r [{length}]"), "y": "stress", "frames": [{ "time": 2e-5, "x": [0.01], "y": [3.0] }] },
            "field": { "unit": "Pa", "range": 2e9, "length_unit": length, "times": [1e-5],
                "views": [{ "width": 0.05, "depth": 0.02, "pixel": 0.001 }, { "width": 0.5, "depth": 0.02, "pixel": 0.01 }],
                "body": { "depths": [0.002], "radii": [null], "r": [0.0, 0.01], "height": [0.0, 0.004] } },
        })
    }

    #[test]
    fn every_number_of_an_axis_is_scaled() {
        let mut si = data("s", "N", "m");
        prefix(&mut si);
        let chart = &si["charts"][0];
        assert_eq!(
            (&chart["x"], &chart["y"], &chart["unit"]),
            (&json!("time [µs]"), &json!("force [MN]"), &json!("MN"))
        );
        assert_eq!(chart["curves"], json!([{ "x": [0.0, 20.0], "y": [null, 1.5] }]));
        assert_eq!(si["events"][0]["time"], 10.0);
        assert_eq!(
            si["profiles"],
            json!({ "x": "r [mm]", "y": "stress", "frames": [{ "time": 20.0, "x": [10.0], "y": [3.0] }] })
        );
        assert_eq!(
            [&si["field"]["unit"], &si["field"]["length_unit"], &si["time_unit"]],
            ["GPa", "mm", "µs"]
        );
        let views = &si["field"]["views"];
        assert_eq!(views[0], json!({ "width": 50.0, "depth": 20.0, "pixel": 1.0 }));
        assert_eq!((&si["field"]["range"], &views[1]["width"]), (&json!(2.0), &json!(500.0)));
        assert_eq!(
            si["field"]["body"],
            json!({ "depths": [2.0], "radii": [null], "r": [0.0, 10.0], "height": [0.0, 4.0] })
        );
        assert_eq!(si["field"]["times"], json!([10.0]));
    }

    #[test]
    fn dimensionless_reports_stay() {
        let mut plain = data("R/c_p", "πR²γc_p²", "R");
        plain["field"] = Value::Null;
        let before = plain.clone();
        prefix(&mut plain);
        assert_eq!(plain, before);
    }
}
