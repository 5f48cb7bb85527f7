//! A load in place of an indenter, `[load]`: a pulse, the rows of a table, or the force of a recording.

use std::path::Path;

use super::{
    Body, Impact, Stop,
    keys::{FORCE, FORCE_ROWS},
    numbers::{MAX_LIST, System},
    profile::read_pairs,
    values::{Values, join},
};
use crate::{
    contact::{
        Rule,
        load::{Force, Load, Pulse},
    },
    message::percuss::Drag,
    recording::copy::messages,
    shape::Head,
    units::Dimension,
};

const TABLE_HELP: &str = "a table of forces is a CSV file with two columns, headed t,F or in a physical case t [us],F [N], times increasing; \
                          its path counts from the folder of the case";
const RECORDING_HELP: &str = "it is a recording of a physical case, whose /drag is the force";

pub(super) fn load(values: &mut Values<'_>, folder: &Path) -> Option<Load> {
    let mut kinds = ["pulse"].iter().chain(&FORCE_ROWS).map(|key| join(FORCE.path, key));
    let given = kinds.find(|key| values.is_given(key));
    let force = match given.as_deref() {
        None => {
            let help = "add pulse with peak and duration, table, recording, or points";
            values.unwanted(FORCE.path, " has no pulse, table, recording or points", help);
            None
        }
        Some("load.force.pulse") => pulse(values),
        Some(name) => points(values, name, folder),
    };
    if values.get::<Stop>("run.stop").is_some_and(|stop| stop != Stop::Never) {
        values.refuse("run.stop", " is of an indenter, and this case has a load", "leave it out");
    }
    let (radius, distribution) = (values.number("load.radius"), values.get("load.distribution")?);
    if radius.is_none() && !values.is_given("load.radius") {
        let what = " is given, but the load is on a point";
        values.unwanted("load.distribution", what, "give load.radius, or leave it out");
    }
    if radius.zip(values.number("target.radius")).is_some_and(|(radius, rim)| radius > rim) {
        values.refuse("load.radius", " is larger than target.radius", "make it smaller, or the target wider");
    }
    if radius.is_none() {
        values.checked.remove("load.distribution");
    }
    Some(Load { radius, distribution, force: force? })
}

fn pulse(values: &mut Values<'_>) -> Option<Force> {
    let form = values.get::<Pulse>("load.force.pulse")?;
    let [rise, duration] = ["load.force.rise", "load.force.duration"];
    let (key, other, meaning) = match form {
        Pulse::Step => (rise, duration, "time in which the force rises; 0 for a jump"),
        Pulse::Hertz | Pulse::Cosine | Pulse::Ricker => (duration, rise, "time that the pulse lasts"),
    };
    let what = format!(" does not belong to pulse = {}", values.written("load.force.pulse"));
    values.unwanted(other, &what, &format!("leave it out; `{key}` does"));
    values.need("load.force.peak", "the largest force");
    values.need(key, meaning);
    let duration = values.number(key)?;
    if form != Pulse::Step && duration == 0.0 {
        values.refuse(key, " is no time", "make it larger than 0")?;
    }
    Some(Force::Pulse { form, peak: values.number("load.force.peak")?, duration })
}

fn points(values: &mut Values<'_>, name: &str, folder: &Path) -> Option<Force> {
    for key in ["peak", "duration", "rise"] {
        values.unwanted(&join(FORCE.path, key), " belongs to a pulse", "leave it out");
    }
    let file = values.checked.remove(name);
    let (points, help) = match file {
        Some(toml::Value::String(file)) if name == "load.force.table" => {
            (read_pairs(&folder.join(file), &values.system, [Dimension::Time, Dimension::Force]), TABLE_HELP)
        }
        Some(toml::Value::String(file)) => (read_drag(&folder.join(file), &values.system), RECORDING_HELP),
        file => (Ok(file?.try_into().ok()?), "give pairs [time, force], times increasing"),
    };
    let points = points.and_then(|points| check(&points).map(|()| points));
    let points = points.map_err(|error| values.refuse(name, &format!(": {error}"), help)).ok()?;
    values.set("load.force.points", points.iter().map(|point| point.to_vec()).collect::<Vec<_>>());
    Some(Force::Points(points))
}

fn check(points: &[[f64; 2]]) -> Result<(), String> {
    if !(2..=MAX_LIST).contains(&points.len()) {
        return Err(format!("there are {} rows, allowed are 2 to {MAX_LIST}", points.len()));
    }
    if points.as_flattened().iter().any(|number| !number.is_finite()) {
        return Err("a number is not finite".into());
    }
    let late = points.windows(2).position(|pair| pair[1][0] <= pair[0][0]);
    late.map_or(Ok(()), |row| Err(format!("time does not increase from row {} to row {}", row + 1, row + 2)))
}

fn read_drag(path: &Path, system: &System) -> Result<Vec<[f64; 2]>, String> {
    let scales = system.scales.ok_or("this case has no units")?;
    let drags: Vec<Drag> = messages(path, "/drag", &[("unit.time", "s"), ("unit.force", "N")], MAX_LIST)?;
    let point = |drag: &Drag| {
        [scales.reduce(Dimension::Time, drag.time), scales.reduce(Dimension::Force, drag.force)]
    };
    Ok(drags.iter().map(point).collect())
}

impl Load {
    /// What stands in the place of an indenter: a flat face of its radius that moves by itself.
    pub(super) fn body(&self) -> Body {
        Body {
            head: Head::Flat { edge_radius: 0.0 },
            radius: self.radius,
            mass: f64::INFINITY,
            material: None,
            striker: None,
        }
    }

    pub(super) fn impact() -> Impact {
        Impact { velocity: 0.0, contact: Rule::Load }
    }
}
