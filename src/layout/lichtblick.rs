//! The layout of Lichtblick, which Foxglove imports too: a section with indenter above, plots against time and along the
//! surface below, and the log.

use serde_json::{Map, Value, json};

use super::LayoutBuilder;
use crate::channels::view::{INDENTER, PROFILE_MARGIN, WORLD, level_range};

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

/// The layout.
pub fn layout(builder: &LayoutBuilder<'_>) -> Value {
    let mut panels = Panels::default();
    let case = builder.case;
    // viewers count the seconds of log time
    let seconds = case.sizes.steps as f64 * case.sizes.dt * case.record.playback_rate;
    let views = ["/view/field", "/view/scene", "/view/fronts"].iter().any(|topic| builder.has(topic));
    let section = views.then(|| panels.add("3D", "section", &case.title, section(builder)));
    let mut motion = Vec::new();
    if builder.has("/drag") {
        motion.push(path("/drag.force", &format!("drag F [{}]", case.units().force.name)));
    }
    motion.push(path("/velocity.velocity", "velocity V [c_p]"));
    let time = (if case.record.playback_rate == 1.0 { "t [R/c_p]" } else { "log time [s]" }, seconds);
    let motion = panels.add(
        "Plot",
        "motion",
        "Drag and velocity against time",
        plot(&motion, time, &format!("F [{}], V [c_p]", case.units().force.name)),
    );
    let probes: Vec<Value> =
        builder.probes().map(|(i, r)| path(&format!("/probes.stress[{i}]"), &format!("r = {r}"))).collect();
    let probes = (!probes.is_empty()).then(|| {
        let plot = plot(&probes, time, "stress [γc_p²]");
        panels.add("Plot", "probes", "Interface stress [γc_p²] against time", plot)
    });
    let profile = builder.has("/view/profile").then(|| {
        let title = "Along the surface at the current time, against r [R]";
        panels.add("Plot", "profile", title, profile(PROFILE_MARGIN * case.sizes.contact_reach))
    });
    let log = panels.add("RosOut", "log", "Log", json!({ "searchTerms": [], "minLogLevel": 1 }));

    let left = split("column", motion, log, 70);
    let plots =
        [probes, profile].into_iter().flatten().rev().reduce(|right, left| split("row", left, right, 50));
    let lower = match plots {
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

fn split(direction: &str, first: Value, second: Value, percentage: u32) -> Value {
    json!({ "direction": direction, "first": first, "second": second, "splitPercentage": percentage })
}

fn path(value: &str, label: &str) -> Value {
    json!({ "value": value, "label": label, "enabled": true, "timestampMethod": "receiveTime", "showLine": true })
}

/// * `(x_label, end)`: label and right end of the horizontal axis, which begins at 0
fn plot(paths: &[Value], (x_label, end): (&str, f64), y_label: &str) -> Value {
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
        "legendDisplay": "floating",
        "showPlotValuesInLegend": false,
        "isSynced": true,
        "sidebarDimension": 240,
    })
}

/// Stress and displacements along the surface, out to a radius.
fn profile(outer_radius: f64) -> Value {
    let curves =
        [("stress", "stress [γc_p²]"), ("displacement", "surface [R]"), ("indenter", "indenter [R]")];
    let curves = curves.map(|(field, label)| path(&format!("/view/profile.{field}[:]"), label));
    let mut settings = plot(&curves, ("r [R]", outer_radius), "stress [γc_p²], surface and indenter [R]");
    settings["xAxisVal"] = "currentCustom".into();
    settings["xAxisPath"] = json!({ "value": "/view/profile.r[:]", "enabled": true });
    settings["isSynced"] = false.into();
    settings
}

/// The section from the front, without perspective, all of it in view.
fn section(builder: &LayoutBuilder<'_>) -> Value {
    let viewport = &builder.viewport;
    // such a panel is two to three times as wide as it is high
    let width = 2.0 * viewport.half_width;
    let height = viewport.depth + 2.0 * viewport.top;
    let distance = 1.1 * height.max(width / 2.5);
    json!({
        "cameraState": {
            "perspective": false,
            "distance": distance,
            "phi": 0,
            "thetaOffset": 0,
            "target": [0, 0, 0],
            "targetOffset": [0, 0.5 * (1.5 * viewport.top - viewport.depth), 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            // close enough to each other for viewers to resolve the sheets of the scene
            "near": 1e-3 * distance,
            "far": 20.0 * distance,
        },
        "followMode": "follow-none",
        "followTf": WORLD,
        "scene": { "backgroundColor": "#ffffff", "transforms": { "showLabel": false } },
        "transforms": {
            format!("frame:{WORLD}"): { "visible": false },
            format!("frame:{INDENTER}"): { "visible": false },
        },
        "topics": topics(builder),
        "layers": {},
    })
}

/// Settings of the topics of the section.
fn topics(builder: &LayoutBuilder<'_>) -> Map<String, Value> {
    let mut topics = Map::new();
    if builder.has("/view/field")
        && let Some(field) = builder.case.record.fields.first()
    {
        let (low, high) = level_range();
        topics.insert(
            "/view/field".into(),
            json!({
                "visible": true,
                "colorMode": "colormap",
                "colorField": field.name(),
                "colorMap": "turbo",
                "minValue": low,
                "maxValue": high,
            }),
        );
    }
    for topic in ["/view/scene", "/view/fronts"] {
        if builder.has(topic) {
            topics.insert(topic.into(), json!({ "visible": true }));
        }
    }
    topics
}
