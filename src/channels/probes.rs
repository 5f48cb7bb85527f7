//! `/probes`: interface stress at chosen radii, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The probes channel.
pub struct Probes {
    radii: Vec<f64>,
    units: Units,
    message: percuss::Probes,
}

impl Probes {
    /// At the radii of `case`.
    pub fn new(case: &Case) -> Self {
        let (radii, units) = (case.record.probes.clone(), case.units());
        Self { radii, units, message: percuss::Probes::default() }
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
        let radii: Vec<String> = self.radii.iter().map(|r| self.units.length.of(*r).to_string()).collect();
        let meaning = "interface stress p = -sigma_zz, compression positive, at the radii of the axis";
        vec![FieldNote::new("stress", self.units.stress.name, meaning).along(radii.join(","))]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        self.message.step = view.step;
        self.message.time = self.units.time.of(view.time);
        self.message.stress.clear();
        let stress = self.units.stress;
        self.message.stress.extend(self.radii.iter().map(|&r| stress.of(view.interface.stress_at(r))));
        outlet.put(&self.message);
    }
}
