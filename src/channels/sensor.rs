//! `/sensor/…`: mean displacement or velocity of a face over a disc, every step.
//!
//! The band-pass of a sensor takes the whole series, as its phase is zero. So the values of such a sensor are held back, 8 bytes a step, and its
//! messages stand at the end of the recording; a checkpoint has what is held back.

use std::ops::Range;

use super::{Channel, FieldNote, HEAD, Rate, band_pass::band_pass};
use crate::{
    case::{Case, Face, Quantity},
    message::percuss,
    model::PointState,
    units::{Unit, Units},
    view::View,
};

struct Mean {
    /// Its points among the gauges, and their shares.
    points: Range<usize>,
    shares: Vec<f64>,
    quantity: Quantity,
    /// Unit of the recording.
    unit: Unit,
}

impl Mean {
    fn new(case: &Case, number: usize) -> Self {
        let (points, shares) = case.record.sensor(number, case.geometry);
        let (Units { length, speed, .. }, quantity) = (case.units(), case.record.sensors[number].quantity);
        let unit = match quantity {
            Quantity::Displacement => length,
            Quantity::Velocity => speed,
        };
        Self { points, shares, quantity, unit }
    }

    fn of(&self, view: &View<'_>) -> Option<f64> {
        let points = view.gauges.as_ref()?.points.get(self.points.clone())?;
        let number = |point: &PointState| match self.quantity {
            Quantity::Displacement => point.displacement,
            Quantity::Velocity => point.velocity,
        };
        Some(self.unit.of(points.iter().zip(&self.shares).map(|(point, share)| share * number(point)).sum()))
    }
}

/// The channel of sensor number `number` of `case`; the messages of one with a band are those of [`Held`].
pub fn channel(case: &Case, number: usize) -> Channel {
    let Units { length, time, frequency, .. } = case.units();
    let sensor = &case.record.sensors[number];
    let (quantity, name) = match sensor.quantity {
        Quantity::Displacement => ("displacement", "displacement u_z"),
        Quantity::Velocity => ("velocity", "velocity of u_z"),
    };
    let face = match sensor.face {
        Face::Front => "front",
        Face::Back => "back",
    };
    let mean = Mean::new(case, number);
    let unit = mean.unit.name;
    let mut fields = vec![FieldNote::new(
        "value",
        unit,
        format!("{name} along the blow, mean over the aperture, as computed"),
    )];
    if sensor.band.is_some() {
        fields.push(FieldNote::new("filtered", unit, "the same through the band-pass"));
    }
    let is_held = sensor.band.is_some();
    let channel = Channel::new(format!("/sensor/{number}"), "percuss.Sensor", fields, move |view, outlet| {
        let Some(value) = mean.of(view).filter(|_| !is_held) else { return };
        outlet.put(&percuss::Sensor { step: view.step, time: time.of(view.time), value, filtered: None });
    })
    .emits(Rate::Step(HEAD))
    .remark("quantity", quantity)
    .remark("face", face)
    .remark("r", length.of(sensor.r).to_string())
    .remark("aperture", length.of(sensor.aperture).to_string());
    let Some(band) = sensor.band else { return channel };
    let [low, high] = band.map(|corner| format!("{} {}", frequency.of(corner), frequency.name));
    channel
        .remark("band", format!("{low}, {high}"))
        .remark("filter", "Butterworth, second order at either corner, forward and backward: zero phase, half the amplitude at the corners")
}

/// What a sensor with a band holds back.
pub struct Held {
    pub channel: usize,
    mean: Mean,
    /// Corners, in sampling rates.
    band: [f64; 2],
    /// Time step \[R/c_p\], and its unit in the recording.
    dt: f64,
    time: Unit,
    /// Its values in all steps so far.
    pub values: Vec<f64>,
}

impl Held {
    /// What sensor number `number` of `case` holds back, if it has a band.
    ///
    /// * `channel`: number of its channel
    pub fn new(case: &Case, number: usize, channel: usize) -> Option<Self> {
        let (dt, time) = (case.sizes.dt, case.units().time);
        let band = case.record.sensors[number].band?.map(|corner| corner * dt);
        Some(Self { channel, mean: Mean::new(case, number), band, dt, time, values: Vec::new() })
    }

    pub fn take(&mut self, view: &View<'_>) {
        self.values.extend(self.mean.of(view));
    }

    /// The messages of its steps.
    pub fn messages(&self) -> impl Iterator<Item = percuss::Sensor> {
        let filtered = band_pass(&self.values, self.band);
        let sensor = |(step, (&value, filtered)): (u64, (&f64, f64))| percuss::Sensor {
            step,
            time: self.time.of(step as f64 * self.dt),
            value,
            filtered: Some(filtered),
        };
        (0..).zip(self.values.iter().zip(filtered)).map(sensor)
    }
}
