//! `/line/…`: stress along a line in the target, at the interval of the interface stress.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, model::Line, units::Units, view::View};

/// The channel of one line.
pub struct LineSlice {
    topic: String,
    number: usize,
    line: Line,
    units: Units,
    message: percuss::LineSlice,
}

impl LineSlice {
    /// The channel of line number `number` of `case`.
    pub fn new(case: &Case, number: usize, line: Line) -> Self {
        let (s0, ds) = match line {
            Line::R(_) => (0.0, case.sizes.dz),
            Line::Z(_) => (case.grid().r0, case.sizes.dr),
        };
        let units = case.units();
        let [s0, ds] = [s0, ds].map(|x| units.length.of(x));
        let message = percuss::LineSlice { s0, ds, ..percuss::LineSlice::default() };
        Self { topic: format!("/line/{number}"), number, line, units, message }
    }
}

impl Channel for LineSlice {
    fn topic(&self) -> &str {
        &self.topic
    }

    fn schema(&self) -> &'static str {
        "percuss.LineSlice"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let meaning = "stress -sigma_zz, compression positive like the interface stress, at s0 + n ds";
        let stress = FieldNote::new("stress", self.units.stress.name, meaning).along("s0,ds");
        let (first, stress) = match self.line {
            Line::R(_) => ("depth of the first node", stress),
            Line::Z(_) => ("radius of the first node", stress.even()),
        };
        let unit = self.units.length.name;
        vec![FieldNote::new("s0", unit, first), FieldNote::new("ds", unit, "distance between nodes"), stress]
    }

    fn remarks(&self) -> Vec<(String, String)> {
        let length = self.units.length;
        let line = match self.line {
            Line::R(r) => format!("r = {}", length.of(r)),
            Line::Z(z) => format!("z = {}", length.of(z)),
        };
        vec![("line".into(), line)]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(stress) = view.gauges.as_ref().and_then(|gauges| gauges.lines.get(self.number)) else {
            return;
        };
        let message = &mut self.message;
        (message.step, message.time) = (view.step, self.units.time.of(view.time));
        message.stress.clear();
        message.stress.extend(stress.iter().map(|p| self.units.stress.of(*p)));
        outlet.put(message);
    }
}
