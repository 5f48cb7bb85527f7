//! The layout of Lichtblick, which Foxglove imports too: a section with indenter above, plots against time and along the
//! surface below, and the log.

use serde_json::{Map, Value, json};

use super::LayoutBuilder;
use crate::{
    channels::{
        log_time,
        view::{INDENTER, PROFILE_MARGIN, WORLD, range},
    },
    model::Field,
    units::{self, Units},
};

/// Panels by their names, and how they share the window.
#[derive(Default)]
struct Panels(Map<String, Value>);

impl Panels {
    /// Adds a panel and returns its name.
    fn add(&mut self, kind: &str, name: &str, title: &str, mut settings: Value) -> Value {
        // one key is Foxglove's, the other Lichtblick's
        settings["foxglovePanelTitle"] = title.into();
        settings["lichtblickPanelTitle"] = title.into();
        let name = format!("{kind}!{name}");
        self.0.insert(name.clone(), settings);
        name.into()
    }
}

pub fn layout(builder: &LayoutBuilder<'_>) -> Value {
    let mut panels = Panels::default();
    let views = ["/view/field", "/view/scene", "/view/fronts"].iter().any(|topic| builder.has(topic));
    let section = views.then(|| panels.add("3D", "section", &builder.case.title, section(builder)));
    let time = time_axis(builder);
    let motion = motion(builder, &time, &mut panels);
    let probes = probes(builder, &time, &mut panels);
    let profiles = if builder.has("/view/profile") { profiles(builder, &mut panels) } else { Vec::new() };
    let log = panels.add("RosOut", "log", "Log", json!({ "searchTerms": [], "minLogLevel": 1 }));

    let left = match stack("column", motion) {
        Some(motion) => split("column", motion, log, 70),
        None => log,
    };
    let plots = [probes, stack("column", profiles)].into_iter().flatten().collect();
    let lower = match stack("row", plots) {
        Some(plots) => split("row", left, plots, 33),
        None => left,
    };
    let layout = match section {
        Some(section) => split("column", section, lower, 45),
        None => lower,
    };
    json!({
        "configById": panels.0,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": layout,
    })
}

/// Label and right end of the time axis. Viewers count the seconds of log time, and cannot scale what they plot: a label
/// says what a second is.
fn time_axis(builder: &LayoutBuilder<'_>) -> (String, f64) {
    let (case, rate) = (builder.case, builder.case.record.playback_rate);
    let end = builder.units.time.of(case.sizes.steps as f64 * case.sizes.dt);
    if builder.is_physical() {
        let second = units::short(1.0 / rate, builder.units.time.name);
        // whole nanoseconds: viewers print all digits of an end
        return (format!("log time [s], 1 s = {second}"), log_time(end, rate) as f64 / 1e9);
    }
    let label = if rate == 1.0 { "t [R/c_p]" } else { "log time [s]" };
    (label.into(), end * rate)
}

fn motion(builder: &LayoutBuilder<'_>, time: &(String, f64), panels: &mut Panels) -> Vec<Value> {
    let Units { force, speed, .. } = builder.units;
    let drag = builder.has("/drag").then_some(("drag", "Drag", "/drag.force", format!("F [{}]", force.name)));
    let velocity = ("velocity", "Velocity", "/velocity.velocity", format!("V [{}]", speed.name));
    let add = |(name, title, field, label): (&str, &str, &str, String)| {
        let plot = without_legend(plot(&[path(field, &label)], time, &label));
        panels.add("Plot", name, &format!("{title} against time"), plot)
    };
    drag.into_iter().chain([velocity]).map(add).collect()
}

fn probes(builder: &LayoutBuilder<'_>, time: &(String, f64), panels: &mut Panels) -> Option<Value> {
    let Units { length, stress, .. } = builder.units;
    let radius =
        |r: f64| if builder.is_physical() { units::short(length.of(r), length.name) } else { r.to_string() };
    let curve = |(i, r)| path(&format!("/probes.stress[{i}]"), &format!("r = {}", radius(r)));
    let curves: Vec<Value> = builder.probes().map(curve).collect();
    (!curves.is_empty()).then(|| {
        let plot = plot(&curves, time, &format!("stress [{}]", stress.name));
        panels.add("Plot", "probes", &format!("Interface stress [{}] against time", stress.name), plot)
    })
}

/// Stress and displacements along the surface: their sizes have nothing to do with each other.
fn profiles(builder: &LayoutBuilder<'_>, panels: &mut Panels) -> Vec<Value> {
    let (length, stress) = (builder.units.length.name, builder.units.stress.name);
    let curve = |field: &str, label: &str| path(&format!("/view/profile.{field}[:]"), label);
    let label = format!("stress [{stress}]");
    let mut pressed = without_legend(profile(builder, &[curve("stress", &label)], &label));
    if builder.case.indenter.head.is_flat() {
        // the peak at the edge grows with the mesh, and would flatten the rest
        let range = range(builder.case, Field::Stress);
        (pressed["minYValue"], pressed["maxYValue"]) = ((-0.25 * range).into(), range.into());
    }
    let [surface, indenter] =
        [("displacement", "surface"), ("indenter", "indenter")].map(|(field, label)| curve(field, label));
    // of a load there is no indenter
    let (shown, title) = match builder.case.load {
        None => (vec![surface, indenter], "Surface and indenter at the current time"),
        Some(_) => (vec![surface], "Surface at the current time"),
    };
    let displacements = profile(builder, &shown, &format!("displacement [{length}]"));
    vec![
        panels.add("Plot", "profile", "Stress along the surface at the current time", pressed),
        panels.add("Plot", "surface", title, displacements),
    ]
}

/// Curves along the surface, out to the radius of the profile.
fn profile(builder: &LayoutBuilder<'_>, curves: &[Value], label: &str) -> Value {
    let length = builder.units.length;
    let outer_radius = length.of(PROFILE_MARGIN * builder.case.sizes.contact_reach);
    let mut settings = plot(curves, &(format!("r [{}]", length.name), outer_radius), label);
    settings["xAxisVal"] = "currentCustom".into();
    settings["xAxisPath"] = json!({ "value": "/view/profile.r[:]", "enabled": true });
    settings["isSynced"] = false.into();
    settings
}

/// A plot of one curve: the axis names it, and the legend would cover it.
fn without_legend(mut plot: Value) -> Value {
    plot["showLegend"] = false.into();
    plot["legendDisplay"] = "none".into();
    plot
}

/// Panels side by side or one above the other, of equal size; nothing if there are none.
fn stack(direction: &str, panels: Vec<Value>) -> Option<Value> {
    let mut panels = panels.into_iter().rev();
    let last = panels.next()?;
    Some((2..).zip(panels).fold(last, |rest, (count, panel)| split(direction, panel, rest, 100 / count)))
}

fn split(direction: &str, first: Value, second: Value, percentage: u32) -> Value {
    json!({ "direction": direction, "first": first, "second": second, "splitPercentage": percentage })
}

fn path(value: &str, label: &str) -> Value {
    json!({ "value": value, "label": label, "enabled": true, "timestampMethod": "receiveTime", "showLine": true })
}

/// * `(x_label, end)`: label and right end of the horizontal axis, which begins at 0
fn plot(paths: &[Value], (x_label, end): &(String, f64), y_label: &str) -> Value {
    json!({
        "paths": paths,
        "xAxisVal": "timestamp",
        "minXValue": 0,
        "maxXValue": end,
        "xAxisLabel": x_label,
        "yAxisLabel": y_label,
        "showXAxisLabels": true,
        "showYAxisLabels": true,
        "showLegend": true,
        "legendDisplay": "left",
        "showPlotValuesInLegend": false,
        "isSynced": true,
        "sidebarDimension": 170,
    })
}

/// The section from the front, without perspective: the contact and both bodies in view.
fn section(builder: &LayoutBuilder<'_>) -> Value {
    let window = &builder.viewport.window;
    let length = |length| builder.units.length.of(length);
    // without perspective, the height that a panel shows
    let distance = length(window.height);
    json!({
        "cameraState": {
            "perspective": false,
            "distance": distance,
            "phi": 0,
            "thetaOffset": 0,
            "target": [0, 0, 0],
            "targetOffset": [0, length(window.middle), 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            // close enough to each other for viewers to resolve the sheets of the scene
            "near": 1e-3 * distance,
            "far": 20.0 * distance,
        },
        "followMode": "follow-none",
        "followTf": WORLD,
        // all of the few transforms at once: otherwise Lichtblick asks for it with an alert
        "scene": { "backgroundColor": "#ffffff", "transforms": { "showLabel": false, "enablePreloading": true } },
        "transforms": {
            format!("frame:{WORLD}"): { "visible": false },
            format!("frame:{INDENTER}"): { "visible": false },
        },
        "topics": topics(builder),
        "layers": {},
    })
}

fn topics(builder: &LayoutBuilder<'_>) -> Map<String, Value> {
    let mut topics = Map::new();
    if builder.has("/view/field") {
        // colours of our own: viewers have no map with white in the middle
        topics.insert("/view/field".into(), json!({ "visible": true, "colorMode": "rgba-fields" }));
    }
    for topic in ["/view/scene", "/view/fronts"] {
        if builder.has(topic) {
            topics.insert(topic.into(), json!({ "visible": true }));
        }
    }
    topics
}
