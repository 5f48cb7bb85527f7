//! `/probes`: interface stress at chosen radii, every step.

use super::{Channel, FieldNote, HEAD, Rate, list};
use crate::{case::Case, message::percuss, units::Units};

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, stress, .. } = case.units();
    let radii = case.record.probes.clone();
    let meaning = "interface stress p = -sigma_zz, compression positive, at the radii of the axis";
    let note = FieldNote::new("stress", stress.name, meaning).along(list(length, radii.iter().copied()));
    let mut message = percuss::Probes::default();
    Channel::new("/probes", "percuss.Probes", vec![note], move |view, outlet| {
        (message.step, message.time) = (view.step, time.of(view.time));
        message.stress.clear();
        message.stress.extend(radii.iter().map(|&r| stress.of(view.interface.stress_at(r))));
        outlet.put(&message);
    })
    .emits(Rate::Step(HEAD + 8 * case.record.probes.len() as u64))
}
