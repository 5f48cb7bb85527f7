//! `/probes`: interface stress at chosen radii, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, view::View};

/// The probes channel.
pub struct Probes {
    radii: Vec<f64>,
    message: percuss::Probes,
}

impl Probes {
    /// At the radii of `case`.
    pub fn new(case: &Case) -> Self {
        Self { radii: case.record.probes.clone(), message: percuss::Probes::default() }
    }
}

impl Channel for Probes {
    fn topic(&self) -> &'static str {
        "/probes"
    }

    fn schema(&self) -> &'static str {
        "percuss.Probes"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let radii: Vec<String> = self.radii.iter().map(f64::to_string).collect();
        let meaning = "interface stress p = -sigma_zz, compression positive, at the radii of the axis";
        vec![FieldNote::new("stress", "γc_p²", meaning).along(radii.join(","))]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        self.message.step = view.step;
        self.message.time = view.time;
        self.message.stress.clear();
        self.message.stress.extend(self.radii.iter().map(|&r| view.interface.stress_at(r)));
        outlet.put(&self.message);
    }
}
