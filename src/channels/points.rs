//! `/points`: motion and stress at chosen points in the target, every step.

use super::{Channel, FieldNote, HEAD, Rate, list};
use crate::{case::Case, message::percuss, units::Units};

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, speed, stress, .. } = case.units();
    let points = &case.record.points;
    let [radii, depths] = [0, 1].map(|coordinate| list(length, points.iter().map(|point| point[coordinate])));
    // radii alone tell the points apart, and values between them mean something: at one depth, from the axis outwards
    let has_axis = points.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] == pair[1][1]);
    let fields = [
        ("displacement", length, "displacement u_z into the target at the points (r, z)"),
        ("velocity", speed, "velocity of u_z into the target at the points (r, z)"),
        (
            "stress",
            stress,
            "stress -sigma_zz, compression positive like the interface stress, at the points (r, z)",
        ),
    ]
    .map(|(name, unit, meaning)| {
        let note = FieldNote::new(name, unit.name, meaning);
        if has_axis { note.along(&radii) } else { note }
    });
    let count = points.len();
    let mut message = percuss::Points::default();
    Channel::new("/points", "percuss.Points", fields.into(), move |view, outlet| {
        let Some(gauges) = &view.gauges else { return };
        (message.step, message.time) = (view.step, time.of(view.time));
        message.displacement.clear();
        message.velocity.clear();
        message.stress.clear();
        for point in &gauges.points[..count] {
            message.displacement.push(length.of(point.displacement));
            message.velocity.push(speed.of(point.velocity));
            message.stress.push(stress.of(point.stress));
        }
        outlet.put(&message);
    })
    .emits(Rate::Step(HEAD + 24 * count as u64))
    .remark("r", radii)
    .remark("z", depths)
}
