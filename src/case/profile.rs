//! Profiles: points in a case, or in a file beside it.

use std::path::Path;

use super::{
    numbers::{MAX_LIST, System},
    values::Values,
};
use crate::{
    input::read_text,
    shape::{Head, Profile},
    units::Dimension,
};

const FILE_HELP: &str = "a profile is a CSV file with two columns, headed r,f or in a physical case r [mm],f [mm], from the tip \
                         at 0,0 outwards; its path counts from the folder of the case";
const POINTS_HELP: &str = "points go from the tip outwards: 0, 0 first, then r increasing and f ≥ 0";

pub(super) fn head(values: &mut Values<'_>, radius: Option<f64>, folder: &Path) -> Option<Head> {
    if !values.is_given("indenter.points") {
        let meaning = "a CSV file with the points r, f of the profile; or points, a list of pairs [r, f]";
        values.need("indenter.file", meaning);
    }
    let (name, points) = match values.checked.remove("indenter.file") {
        Some(file) => {
            let file: String = file.try_into().ok()?;
            let points = read_pairs(&folder.join(file), &values.system, [Dimension::Length; 2])
                .map_err(|error| values.refuse("indenter.file", &format!(": {error}"), FILE_HELP))
                .ok()?;
            ("indenter.file", points)
        }
        None => ("indenter.points", values.get::<Vec<[f64; 2]>>("indenter.points")?),
    };
    let refuse = |error| match name {
        "indenter.file" => values.refuse(name, &format!(": {error}"), POINTS_HELP),
        _ => values.problem(name, format!("`{name}`: {error}"), POINTS_HELP),
    };
    let curve = curve(&points, &values.system).map_err(refuse).ok()?;
    let last = curve.last_radius();
    if radius.is_some_and(|radius| radius > last) {
        let last = values.system.written(Dimension::Length, last);
        let what = format!(" is larger than the last point of the profile, r = {last}");
        values.refuse("indenter.radius", &what, "add points, or leave the radius out");
    }
    values.set("indenter.points", points.into_iter().map(|point| point.to_vec()).collect::<Vec<_>>());
    Some(Head::Profile(curve))
}

fn curve(points: &[[f64; 2]], system: &System) -> Result<Profile, String> {
    if points.len() > MAX_LIST {
        return Err(format!("there are {} points, at most {MAX_LIST} are allowed", points.len()));
    }
    Profile::new(points).map_err(|error| {
        let Some(scales) = system.scales else { return error };
        // the same error with the numbers of a physical case
        let in_si = points.iter().map(|point| point.map(|x| scales.expand(Dimension::Length, x)));
        let in_si = Profile::new(&in_si.collect::<Vec<_>>()).err().unwrap_or(error);
        format!("{in_si} (in m)")
    })
}

/// Reads rows of two numbers; a first row without numbers is a heading, which may carry units, `r [mm],f [mm]`; `#` starts a comment.
///
/// * `of`: their dimensions
pub(super) fn read_pairs(path: &Path, system: &System, of: [Dimension; 2]) -> Result<Vec<[f64; 2]>, String> {
    let text = read_text(path).map_err(|error| error.to_string())?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut points = Vec::new();
    let mut units: Option<[String; 2]> = None;
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let cells: Vec<&str> = record.iter().collect();
        let cells = match cells[..] {
            [r, f] => [r, f],
            [cell] if cell.contains(';') => {
                return Err(format!(
                    "line {line} has its columns between semicolons: a CSV file has commas there"
                ));
            }
            _ => return Err(format!("line {line} does not have 2 columns, but {}", cells.len())),
        };
        let is_heading = index == 0 && cells.iter().any(|cell| cell.parse::<f64>().is_err());
        if is_heading {
            units = read_heading(cells)?;
        }
        if index == 0 {
            system.check_heading(units.as_ref(), of)?;
        }
        if !is_heading {
            let unit = |i: usize| units.as_ref().map(|units| units[i].as_str());
            let number = |i: usize| system.number(cells[i], unit(i), of[i]);
            let point = number(0).and_then(|first| Ok([first, number(1)?]));
            points.push(point.map_err(|error| format!("line {line}: {error}"))?);
        }
    }
    Ok(points)
}

/// The units of a heading, if it has any: `r [mm],f [mm]`.
fn read_heading(cells: [&str; 2]) -> Result<Option<[String; 2]>, String> {
    let unit = |cell: &str| {
        let (_, unit) = cell.strip_suffix(']')?.split_once('[')?;
        Some(unit.trim().to_owned())
    };
    match cells.map(unit) {
        [Some(r), Some(f)] => Ok(Some([r, f])),
        [None, None] => Ok(None),
        _ => Err(format!(
            "its heading `{},{}` has one unit: write none, or one to each column",
            cells[0], cells[1]
        )),
    }
}
