//! `/field/displacement`, `/field/velocity`, `/field/stress`: a field over the section, at frames.

use std::sync::{Arc, Mutex};

use super::{Channel, FieldNote, MESSAGE_OVERHEAD, Outlet, lock, step_and_time};
use crate::{
    case::Case,
    message::percuss,
    model::{Extent, Field},
    view::View,
};

/// A field as it was sampled last.
pub type SharedSlice = Arc<Mutex<percuss::FieldSlice>>;

/// The channel of one field.
pub struct FieldSlice {
    field: Field,
    /// Nodes from one that is shown to the next.
    every: usize,
    /// Rows and columns of every message: those of the whole mesh.
    whole: Extent,
    message: SharedSlice,
}

impl FieldSlice {
    /// The channel of `field`, with as many nodes as `case` asks for.
    pub fn new(case: &Case, field: Field) -> Self {
        Self {
            field,
            every: case.record.field_every,
            whole: case.slice_extent(),
            message: SharedSlice::default(),
        }
    }

    /// What this channel has sampled, for the channels after it.
    pub fn shared(&self) -> SharedSlice {
        Arc::clone(&self.message)
    }
}

impl Channel for FieldSlice {
    fn topic(&self) -> &'static str {
        match self.field {
            Field::Displacement => "/field/displacement",
            Field::Velocity => "/field/velocity",
            Field::Stress => "/field/stress",
        }
    }

    fn schema(&self) -> &'static str {
        "percuss.FieldSlice"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let (unit, meaning) = match self.field {
            Field::Displacement => ("R", "displacement u_z into the target, row-major [z][r]"),
            Field::Velocity => ("c_p", "velocity of u_z into the target, row-major [z][r]"),
            Field::Stress => (
                "γc_p²",
                "stress -sigma_zz, compression positive like the interface stress, row-major [z][r]",
            ),
        };
        let mut fields = step_and_time().to_vec();
        fields.extend([
            FieldNote::new("r0", "R", "radius of the first column"),
            FieldNote::new("dr", "R", "distance between columns"),
            FieldNote::new("nr", "1", "number of columns"),
            FieldNote::new("z0", "R", "depth of the first row"),
            FieldNote::new("dz", "R", "distance between rows"),
            FieldNote::new("nz", "1", "number of rows"),
            FieldNote::new("values", unit, meaning).along("z0,dz,nz;r0,dr,nr"),
        ]);
        fields
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = view.frame else { return };
        let message = &mut *lock(&self.message);
        let extent = frame.fields.sample(self.field, &mut message.values);
        spread(&mut message.values, extent, self.whole);
        let lattice = frame.fields.lattice();
        (message.step, message.time) = (view.step, view.time);
        let every = self.every as f64;
        (message.r0, message.dr, message.nr) = (lattice.r0, every * lattice.dr, self.whole.nr as u32);
        (message.z0, message.dz, message.nz) = (0.0, every * lattice.dz, self.whole.nz as u32);
        outlet.put(message);
    }

    fn size(&self, case: &Case) -> u64 {
        let values = (self.whole.nr * self.whole.nz) as u64;
        case.frames().count() * (4 * values + 70 + MESSAGE_OVERHEAD)
    }
}

/// Brings values of some rows and columns, row-major, to the shape of the whole section; what is beyond them is at rest.
fn spread(values: &mut Vec<f32>, extent: Extent, whole: Extent) {
    assert!(extent.nr <= whole.nr && extent.nz <= whole.nz, "{extent:?} of {whole:?}");
    values.resize(whole.nr * whole.nz, 0.0);
    if extent.nr == whole.nr {
        return;
    }
    // rows move towards the end, the last one first: none is written to before it has moved
    for row in (0..extent.nz).rev() {
        let start = row * whole.nr;
        values.copy_within(row * extent.nr..(row + 1) * extent.nr, start);
        values[start + extent.nr..start + whole.nr].fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_of_any_extent_get_one_shape() {
        let whole = Extent { nr: 5, nz: 4 };
        for (nr, nz) in [(0, 0), (1, 1), (2, 3), (5, 2), (3, 4), (5, 4)] {
            let mut values: Vec<f32> = (1..=nr * nz).map(|m| m as f32).collect();
            spread(&mut values, Extent { nr, nz }, whole);
            assert_eq!(values.len(), 20);
            for (m, value) in values.iter().enumerate() {
                let (j, i) = (m / 5, m % 5);
                let expected = if j < nz && i < nr { (j * nr + i + 1) as f32 } else { 0.0 };
                assert_eq!(*value, expected, "({j}, {i}) of ({nz}, {nr})");
            }
        }
    }
}
