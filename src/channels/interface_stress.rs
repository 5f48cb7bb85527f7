//! `/interface/stress`: stress at the surface nodes out to the largest radius ever in contact, every so many steps and at the last one.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, units::Units};

pub fn channel(case: &Case) -> Channel {
    let every = case.record.interface_every;
    let nodes = case.column(case.sizes.contact_reach) as u64;
    let Units { length, time, stress, .. } = case.units();
    let meaning = "interface stress p = -sigma_zz, compression positive, at r0 + i dr";
    let is_graded = case.grid().is_graded();
    let fields = vec![
        FieldNote::new("r0", length.name, "radius of the first node"),
        FieldNote::new("dr", length.name, "distance between nodes"),
        FieldNote::new("r", length.name, "radii of these nodes, where the mesh is graded"),
        FieldNote::new("stress", stress.name, meaning).along("r0,dr,r").even(),
    ];
    let mut message = percuss::InterfaceStress::default();
    Channel::new("/interface/stress", "percuss.InterfaceStress", fields, move |view, outlet| {
        if !view.step.is_multiple_of(every) && !view.is_last {
            return;
        }
        (message.step, message.time) = (view.step, time.of(view.time));
        (message.r0, message.dr) = (length.of(view.interface.r0), length.of(view.interface.dr));
        message.stress.clear();
        message.stress.extend(view.interface.pressure.iter().map(|p| stress.of(*p)));
        message.r.clear();
        if is_graded {
            message.r.extend((0..message.stress.len()).map(|i| length.of(view.interface.r(i))));
        }
        outlet.put(&message);
    })
    .emits(Rate::Interval(HEAD + 8 * nodes))
}
