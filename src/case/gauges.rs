//! What is recorded in and on the target: `record.points`, `record.lines`, and `record.sensor` on its faces.
//!
//! The mean of a function of the radius over the disc of a sensor, of radius a, whose middle is at the distance r from the axis, is an integral
//! over the circles about the axis, each as far as the disc cuts it:
//!
//! ```text
//! mean = 1/(πa²) ∫ u(ρ)·2φ(ρ)ρ dρ        cos φ = (ρ² + r² − a²)/(2rρ), φ = π for ρ < a − r
//! ```
//!
//! over `|r − a| < ρ < r + a`, and from 0 where the disc has the axis in it. Either part is summed at 32 radii, dense at its ends, where φ is a
//! square root: a field that is linear in ρ comes out to 3e-4 or better.

use std::{f64::consts::PI, ops::Range};

use serde::{Deserialize, Serialize};

use super::{
    Parameters, Record, Target,
    keys::SENSOR,
    values::{Values, join},
};
use crate::{geometry::Geometry, grid::Back, model::Line};

/// Radii in either part of a disc.
const RADII: usize = 32;
/// Places this little beyond a face or a rim, relative to it, are on it.
const ROUNDING: f64 = 1e-9;

/// A sensor on a face: what it shows is a mean over a disc.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Sensor {
    /// Radius of its middle \[R\].
    pub r: f64,
    /// Where it is.
    pub face: Face,
    /// Radius of the disc, in the plane half the width of the strip; 0 for a point \[R\].
    pub aperture: f64,
    /// What it shows.
    pub quantity: Quantity,
    /// Corners of its band-pass, if it has one \[c_p/R\].
    pub band: Option<[f64; 2]>,
}

/// A face of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// The struck one.
    Front,
    /// The far one.
    Back,
}

/// What a sensor shows, positive along the blow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Displacement u_z.
    Displacement,
    /// Velocity ∂u_z/∂t.
    Velocity,
}

/// All sensors, of sound values.
pub(super) fn sensors(values: &Values<'_>) -> Vec<Sensor> {
    (1..=values.count(SENSOR.path).unwrap_or(0)).map(|number| values.section(&path(number))).collect()
}

/// Section of a sensor.
///
/// * `number`: counted from 1
fn path(number: usize) -> String {
    format!("{}.{number}", SENSOR.path)
}

/// Depth of a line along r.
fn depth(line: &Line) -> Option<f64> {
    match line {
        Line::Z(z) => Some(*z),
        Line::R(_) => None,
    }
}

/// Notes points and lines along r that lie behind the target.
///
/// * `thickness`: of the target, if it is no half-space
/// * `height`: of an indenter that gives, infinite of a half-space
pub(super) fn check_depths(values: &Values<'_>, thickness: Option<f64>, height: Option<f64>) {
    let text = |z: f64| values.system.length_text(z);
    let thickness = thickness.unwrap_or(f64::INFINITY);
    let (above, least) = match height {
        Some(height) => {
            ("behind the indenter", format!("{}, that of the rear of the indenter", text(-height)))
        }
        None => (
            "above the target",
            "0; with indenter.body = \"elastic\" the indenter has points at z < 0".to_owned(),
        ),
    };
    let most = format!("0 to the thickness of the target, {}", text(thickness));
    let points: Vec<[f64; 2]> = values.get("record.points").unwrap_or_default();
    let lines: Vec<Line> = values.get("record.lines").unwrap_or_default();
    let lines = lines.iter().filter_map(depth).collect();
    for (name, depths) in
        [("record.points", points.iter().map(|[_, z]| *z).collect::<Vec<_>>()), ("record.lines", lines)]
    {
        let is_above = |z: &&f64| -**z * (1.0 - ROUNDING) > height.unwrap_or(0.0);
        let is_below = |z: &&f64| **z * (1.0 - ROUNDING) > thickness;
        let above = depths.iter().find(is_above).map(|z| (z, above, &least));
        let below = depths.iter().find(is_below).map(|z| (z, "behind the target", &most));
        for (z, place, allowed) in above.into_iter().chain(below) {
            let message = format!("`{name}` has z = {}, {place}", text(*z));
            values.problem(name, message, format!("allowed: z from {allowed}"));
        }
    }
}

/// Notes sensors that are beyond the target, or where nothing moves, and bands that are none.
pub(super) fn check_sensors(values: &Values<'_>, target: Option<&Target>) {
    for number in 1..=values.count(SENSOR.path).unwrap_or(0) {
        let path = path(number);
        let key = join(&path, "face");
        match target.filter(|_| values.get(&key) == Some(Face::Back)) {
            Some(Target { thickness: None, .. }) => {
                let help = "put the sensor on the front, or give the last layer a thickness";
                values.refuse(&key, ", but the target is a half-space, which has no back", help);
            }
            Some(Target { back: Back::Rigid, .. }) => {
                let help = "set target.back = \"free\", or put the sensor on the front";
                values.refuse(&key, ", but the back is rigid, where nothing moves", help);
            }
            _ => {}
        }
        let reach = ["r", "aperture"].map(|key| values.number(&join(&path, key)).unwrap_or_default());
        let reach = reach.into_iter().sum::<f64>();
        let rim = target.and_then(|target| target.radius);
        if let Some(rim) = rim.filter(|rim| reach > rim * (1.0 + ROUNDING)) {
            let [reach, rim] = [reach, rim].map(|length| values.system.length_text(length));
            let message = format!("`{path}` reaches to r = {reach}, beyond the rim of the target");
            values.problem(&join(&path, "r"), message, format!("allowed: r + aperture up to {rim}"));
        }
        let key = join(&path, "band");
        let is_band = |corners: Vec<f64>| matches!(corners[..], [lower, upper] if lower < upper);
        if values.get(&key).is_some_and(|corners| !is_band(corners)) {
            let help = "allowed: a lower and a higher corner frequency, [\"20 kHz\", \"1 MHz\"]; in dimensionless cases plain numbers";
            values.refuse(&key, " is no band", help);
        }
    }
}

impl Sensor {
    /// Radii and their shares in the mean.
    fn radii(&self, geometry: Geometry) -> Vec<(f64, f64)> {
        let Self { r, aperture: a, .. } = *self;
        if a == 0.0 {
            return vec![(r, 1.0)];
        }
        if geometry == Geometry::Plane {
            let count = 2 * RADII;
            let place = |k: usize| r + a * ((2 * k + 1) as f64 / count as f64 - 1.0);
            return (0..count).map(|k| (place(k).abs(), 1.0 / count as f64)).collect();
        }
        let part = |from: f64, to: f64| {
            let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
            (0..RADII).map(move |k| {
                let angle = PI * (k as f64 + 0.5) / RADII as f64;
                let rho = middle - half * libm::cos(angle);
                let cut = (rho * rho + r * r - a * a) / (2.0 * r * rho);
                (rho, half * libm::sin(angle) * rho * libm::acos(cut.clamp(-1.0, 1.0)))
            })
        };
        let inside = (a > r).then(|| part(0.0, a - r));
        let cut = (r > 0.0).then(|| part((r - a).abs(), r + a));
        let radii: Vec<_> = inside.into_iter().flatten().chain(cut.into_iter().flatten()).collect();
        let whole: f64 = radii.iter().map(|(_, share)| share).sum();
        radii.into_iter().map(|(rho, share)| (rho, share / whole)).collect()
    }
}

impl Record {
    /// Places among the gauges, which have the points first, of the points of a sensor, and their shares in its mean.
    ///
    /// * `number`: counted from 0
    pub(crate) fn sensor(&self, number: usize, geometry: Geometry) -> (Range<usize>, Vec<f64>) {
        let count = |sensor: &Sensor| sensor.radii(geometry).len();
        let start = self.points.len() + self.sensors[..number].iter().map(count).sum::<usize>();
        let shares: Vec<f64> =
            self.sensors[number].radii(geometry).into_iter().map(|(_, share)| share).collect();
        (start..start + shares.len(), shares)
    }

    /// Depth of the deepest point or line along r \[R\]; infinite with lines along z.
    pub(super) fn deepest(&self) -> f64 {
        let lines = self.lines.iter().map(|line| depth(line).unwrap_or(f64::INFINITY));
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
        values.problem("mesh.outer_radius", message, help)
    }
}

impl Parameters {
    /// Points `[r, z]` of all sensors \[R\].
    pub(super) fn sensor_points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.record.sensors.iter().flat_map(|sensor| {
            let z = match sensor.face {
                Face::Front => 0.0,
                Face::Back => self.target.thickness.unwrap_or_default(),
            };
            sensor.radii(self.geometry).into_iter().map(move |(r, _)| [r, z])
        })
    }

    /// Notes bands that the time step does not resolve.
    pub(super) fn check_bands(&self, values: &Values<'_>) -> Option<()> {
        let most = 0.5 / self.sizes.dt;
        let upper = |sensor: &Sensor| sensor.band.map_or(0.0, |[_, upper]| upper);
        let mut sensors = (1..).zip(&self.record.sensors);
        let Some((number, _)) = sensors.find(|(_, sensor)| upper(sensor) >= most) else { return Some(()) };
        let most = self.units().frequency.full_text(most);
        let what = " reaches beyond half the sampling rate, which is that of the steps";
        let help = format!("allowed: below {most}, or make the mesh finer");
        values.refuse(&join(&path(number), "band"), what, &help)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    fn mean(r: f64, aperture: f64, geometry: Geometry, field: impl Fn(f64) -> f64) -> f64 {
        let (face, quantity, band) = (Face::Front, Quantity::Displacement, None);
        let sensor = Sensor { r, face, aperture, quantity, band };
        sensor.radii(geometry).into_iter().map(|(r, share)| share * field(r)).sum()
    }

    #[test]
    fn means_over_discs_are_those_of_their_integrals() {
        // ∫ρ² over a disc is a²/2 + r², and ∫ρ over one about the axis 2a/3
        for (r, a) in [(0.0, 0.5), (0.2, 0.5), (0.5, 0.5), (0.51, 0.5), (2.0, 0.5), (7.0, 1e-3)] {
            let square = mean(r, a, Geometry::Axisymmetric, |rho| rho * rho);
            let exact = 0.5 * a * a + r * r;
            assert!((square / exact - 1.0).abs() < 1e-3, "{r} {a}: {square} {exact}");
        }
        let linear = mean(0.0, 0.6, Geometry::Axisymmetric, |rho| rho);
        assert!((linear / 0.4 - 1.0).abs() < 3e-4, "{linear}");
        // far from the axis √((r + x)² + y²) has the mean r + a²/8r
        let linear = mean(10.0, 1.0, Geometry::Axisymmetric, |rho| rho);
        assert!((linear - 10.0125).abs() < 1e-4, "{linear}");
        assert_eq!(mean(3.0, 0.0, Geometry::Axisymmetric, |rho| rho), 3.0);
        for (r, exact) in [(0.0, 0.25), (1.0, 1.0)] {
            assert!((mean(r, 0.5, Geometry::Plane, |x| x) - exact).abs() < 1e-3);
        }
    }

    #[test]
    fn sensors_are_points_behind_those_of_the_case() {
        let settings = [
            "record.points=[[0, 0.25]]",
            "record.sensor=[{ r = 0.5 }, { r = 0, aperture = 0.25, quantity = \"velocity\", band = [0.5, 5] }]",
        ];
        let case = Case::sound("fig5", &settings);
        assert_eq!(case.gauges().points.len(), 2 + RADII);
        assert_eq!(
            (case.gauges().points[1], case.record.sensor(1, case.geometry).0),
            ([0.5, 0.0], 2..2 + RADII)
        );
        let again = Case::sound(&case.resolved_toml(), &["record.sensor.2.aperture=0.1"]);
        assert_eq!(again.record.sensors[1], Sensor { aperture: 0.1, ..case.record.sensors[1].clone() });
    }

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
