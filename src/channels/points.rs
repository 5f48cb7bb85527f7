//! `/points`: motion and stress at chosen points in the target, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The points channel.
pub struct Points {
    points: Vec<[f64; 2]>,
    units: Units,
    message: percuss::Points,
}

impl Points {
    /// At the points of `case`.
    pub fn new(case: &Case) -> Self {
        Self { points: case.record.points.clone(), units: case.units(), message: percuss::Points::default() }
    }

    /// Radii, or depths, of all points.
    ///
    /// * `coordinate`: 0 for radii, 1 for depths
    fn list(&self, coordinate: usize) -> String {
        let numbers: Vec<String> =
            self.points.iter().map(|point| self.units.length.of(point[coordinate]).to_string()).collect();
        numbers.join(",")
    }

    /// True if radii alone tell the points apart, and values between them mean something: at one depth, from the axis outwards.
    fn has_axis(&self) -> bool {
        self.points.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] == pair[1][1])
    }
}

impl Channel for Points {
    fn topic(&self) -> &str {
        "/points"
    }

    fn schema(&self) -> &'static str {
        "percuss.Points"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let notes = [
            FieldNote::new(
                "displacement",
                self.units.length.name,
                "displacement u_z into the target at the points (r, z)",
            ),
            FieldNote::new(
                "velocity",
                self.units.speed.name,
                "velocity of u_z into the target at the points (r, z)",
            ),
            FieldNote::new(
                "stress",
                self.units.stress.name,
                "stress -sigma_zz, compression positive like the interface stress, at the points (r, z)",
            ),
        ];
        let with_axis = |note: FieldNote| if self.has_axis() { note.along(self.list(0)) } else { note };
        notes.map(with_axis).into()
    }

    fn remarks(&self) -> Vec<(String, String)> {
        vec![("r".into(), self.list(0)), ("z".into(), self.list(1))]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(gauges) = &view.gauges else { return };
        let message = &mut self.message;
        let Units { length, time, speed, stress, .. } = self.units;
        (message.step, message.time) = (view.step, time.of(view.time));
        message.displacement.clear();
        message.velocity.clear();
        message.stress.clear();
        for point in &gauges.points {
            message.displacement.push(length.of(point.displacement));
            message.velocity.push(speed.of(point.velocity));
            message.stress.push(stress.of(point.stress));
        }
        outlet.put(message);
    }
}
