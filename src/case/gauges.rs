//! Points and lines in the target: `record.points`, `record.lines`.

use std::collections::BTreeMap;

use super::{Record, values::Values};
use crate::model::Line;

/// Places this little beyond the backing, relative to the thickness, are on it.
const ROUNDING: f64 = 1e-9;

/// `record.lines`.
pub(super) fn lines(values: &Values<'_>) -> Vec<Line> {
    let lines = values.get::<Vec<BTreeMap<String, f64>>>("record.lines").unwrap_or_default();
    let line = |(axis, place): (&String, &f64)| if axis == "r" { Line::R(*place) } else { Line::Z(*place) };
    lines.iter().flat_map(|entries| entries.iter().map(line)).collect()
}

/// Depth of a line along r.
fn depth(line: Line) -> Option<f64> {
    match line {
        Line::Z(z) => Some(z),
        Line::R(_) => None,
    }
}

/// Notes points and lines along r that lie behind the target.
///
/// * `thickness`: of the target, if it is no half-space
/// * `height`: of an indenter that gives, infinite of a half-space
pub(super) fn check_depths(values: &Values<'_>, thickness: Option<f64>, height: Option<f64>) {
    let thickness = thickness.unwrap_or(f64::INFINITY);
    let points = values.get::<Vec<[f64; 2]>>("record.points").unwrap_or_default();
    let points = points.iter().map(|[_, z]| *z).collect();
    let lines = lines(values).into_iter().filter_map(depth).collect();
    for (name, depths) in [("record.points", points), ("record.lines", lines)] {
        let depths: Vec<f64> = depths;
        if let Some(z) = depths.iter().find(|z| -*z * (1.0 - ROUNDING) > height.unwrap_or(0.0)) {
            let place = if height.is_some() { "behind the indenter" } else { "above the target" };
            let message = format!("`{name}` has z = {}, {place}", values.system.length_text(*z));
            let least = match height {
                Some(height) => {
                    format!("from {}, that of the rear of the indenter", values.system.length_text(-height))
                }
                None => "from 0; with indenter.body = \"elastic\" the indenter has points at z < 0".into(),
            };
            values.problem(name, message, format!("allowed: z {least}"));
        }
        if let Some(z) = depths.iter().find(|z| *z * (1.0 - ROUNDING) > thickness) {
            let [z, thickness] = [*z, thickness].map(|length| values.system.length_text(length));
            let message = format!("`{name}` has z = {z}, behind the target");
            values.problem(
                name,
                message,
                format!("allowed: z from 0 to the thickness of the target, {thickness}"),
            );
        }
    }
}

impl Record {
    /// Depth of the deepest point or line along r \[R\]; infinite with lines along z.
    pub(super) fn deepest(&self) -> f64 {
        let lines = self.lines.iter().map(|line| depth(*line).unwrap_or(f64::INFINITY));
        self.points.iter().map(|[_, z]| *z).chain(lines).fold(0.0, f64::max)
    }

    /// Notes points and lines along z that lie beyond a mesh and would see waves there.
    ///
    /// * `outer`: outer radius of the mesh, as it is given \[R\]
    /// * `reach`: radius that waves do not pass during the run \[R\]
    pub(super) fn check_radii(&self, values: &Values<'_>, outer: f64, reach: f64) -> Option<()> {
        let lines = self.lines.iter().filter_map(|line| match line {
            Line::R(r) => Some((*r, "lines")),
            Line::Z(_) => None,
        });
        let sensors = self.sensors.iter().map(|sensor| (sensor.r + sensor.aperture, "sensor"));
        let radii = self.points.iter().map(|[r, _]| (*r, "points")).chain(lines).chain(sensors);
        let lost = radii.filter(|(r, _)| *r > outer && *r < reach).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((r, key)) = lost else { return Some(()) };
        let message = format!("`mesh.outer_radius` = {outer:?} leaves out r = {r:?} of record.{key}");
        let help = format!("allowed: at least {r:?}, or leave the key out to have it derived");
        values.problem("mesh.outer_radius", message, help);
        None
    }
}

#[cfg(test)]
mod tests {
    use crate::case::Case;

    #[test]
    fn the_mesh_is_as_large_as_points_need() {
        let sizes = |settings: &[&str]| {
            let settings = [&["record.frames=0", "record.fields=[]", "mesh.cells=40"][..], settings].concat();
            Case::sound("fig8-m5", &settings).sizes.clone()
        };
        let (none, frames) = (sizes(&[]), sizes(&["record.frames=2", "record.fields=[\"stress\"]"]));
        let (shallow, deep) =
            (sizes(&["record.points=[[0.0, 1.0]]"]), sizes(&["record.points=[[0.0, 900.0]]"]));
        assert!(none.nz < shallow.nz && shallow.nz < deep.nz && deep.nz == frames.nz);
        let (near, far) = (sizes(&["record.points=[[0.5, 0.0]]"]), sizes(&["record.points=[[900.0, 0.0]]"]));
        assert_eq!((near.nr, far.nr), (none.nr, frames.nr));
        // waves that the backing or the outer radius return come too late
        let rows = 1.0 / none.dz;
        assert!(2.0 * shallow.nz as f64 - rows > none.steps as f64);
        let line = sizes(&["record.lines=[{ r = 0.0 }]"]);
        assert_eq!((line.nz, line.nr), (frames.nz, none.nr));
    }
}
