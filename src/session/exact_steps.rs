//! The steps of a closed form, returned like those of a computed run.

use super::{Source, Status, Steps};
use crate::{
    case::Case,
    exact::closed_form::{ClosedForm, NoClosedForm},
    simulation::SimulationError,
    validity::Validity,
    view::View,
};

/// The steps of the closed form for a case, as long as it holds.
pub struct ExactSteps<'a> {
    case: &'a Case,
    form: ClosedForm,
    next_step: u64,
    is_interrupted: bool,
    validity: Validity,
}

impl<'a> ExactSteps<'a> {
    /// The steps of the closed form for `case`.
    ///
    /// # Errors
    ///
    /// The reason why there is none.
    pub fn new(case: &'a Case) -> Result<Self, NoClosedForm> {
        let validity = Validity::new(case.impact.velocity, case.indenter.head.is_flat());
        Ok(Self { case, form: ClosedForm::for_case(case)?, next_step: 0, is_interrupted: false, validity })
    }

    /// The closed form.
    pub fn form(&self) -> &ClosedForm {
        &self.form
    }

    /// The source to record.
    pub fn source(&self) -> Source {
        Source::Exact { form: self.form.name, knows_drag: self.form.has_drag }
    }
}

impl Steps for ExactSteps<'_> {
    fn step(&mut self) -> Result<Option<View<'_>>, SimulationError> {
        if self.is_interrupted || self.next_step > self.form.last_step() {
            return Ok(None);
        }
        let view = self.form.evaluate(self.next_step);
        self.next_step += 1;
        for (i, p) in view.interface.pressure.iter().enumerate() {
            let place = (view.interface.r(i), 0.0);
            self.validity.pressure.observe(p.abs(), view.step, view.time, place);
            self.validity.strain.observe(p.abs(), view.step, view.time, place);
        }
        for &r in &self.case.record.probes {
            let strain = view.interface.stress_at(r).abs();
            self.validity.probes.observe(strain, view.step, view.time, (r, 0.0));
        }
        Ok(Some(view))
    }

    fn interrupt(&mut self) {
        self.is_interrupted = true;
    }

    fn resume(&mut self) {
        self.is_interrupted = false;
    }

    fn ending(&self) -> Option<Status> {
        let last = self.form.last_step();
        if self.next_step <= last {
            return None;
        }
        Some(if last == self.case.sizes.steps {
            Status::Completed
        } else {
            let end = self.case.units().time.full_text(self.form.end_time);
            Status::Stopped(format!("the closed form holds until t = {end}"))
        })
    }

    fn validity(&mut self) -> Validity {
        self.validity.clone()
    }
}
