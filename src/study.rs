//! Convergence studies: one case on meshes refined by two, and the limits of its numbers.
//!
//! Every quantity has a value per mesh: drag, velocity and stress at given times, what is measured of the whole run, as `percuss.summary` has it, and times of events. From the last three, `v_1, v_2, v_3` on meshes refined by ρ,
//!
//! ```text
//! observed order   p = ln((v_2 − v_1)/(v_3 − v_2))/ln ρ
//! extrapolated     v = v_3 + (v_3 − v_2)/(ρ^p − 1)            (Richardson)
//! error bar        1.25·|v_3 − v_2|/(ρ^q − 1),  q = min(p, 1) (grid convergence index, \[Ro\])
//! ```
//!
//! if the order is between ½ and 2½; otherwise there is no extrapolated value, and the error bar is three times the largest
//! difference. The scheme is of second order at best: a higher order is a difference that is small by chance, and one between 1
//! and 2½ may be, so no error bar assumes more than the first. The bar is about the finest value. Of 2186 triples of values in
//! cases with a closed form, 10 to 256 cells, 1.6 % of the bars miss it; all but two of them by less than four bars, most just
//! before a front. (Orders up to 4 and bars of order p: 16 %, by up to 77 bars.) The turn of a contact that spreads, its extension,
//! is the top of a flat curve whose noise is that of the mesh: its differences have no order, and its bar is the wide one. Where the case has a closed form, errors and
//! their order are those against it.

use std::{
    borrow::Cow,
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use percuss_table::measures::Measure;
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    advice::{Finding, measured},
    case::{Case, CaseErrors, Grading, Sizes},
    contact::{
        Rule,
        event::{Event, EventKind},
    },
    exact::closed_form::ClosedForm,
    measuring,
    session::RunError,
    units::{Dimension, Unit, Units},
    view::View,
};

/// What a study looks at.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Times of drag, velocity and stress \[R/c_p\].
    pub times: Vec<f64>,
    /// Radii of stress \[R\].
    pub probes: Vec<f64>,
    /// What is measured of the whole run, by the names of `percuss.summary`.
    pub measures: Vec<String>,
}

/// Measures of an impact: those that a study looks at unless others are asked for.
///
/// Of a head that does not spread its contact its radius is given.
pub fn default_measures(case: &Case) -> Vec<String> {
    let names = [
        "peak_force",
        "impulse",
        "contact_duration",
        "contact_radius",
        "restitution",
        "restitution_mesh_corrected",
    ];
    let spreads = case.shape().spreads();
    names.iter().filter(|name| spreads || **name != "contact_radius").map(|name| (*name).to_owned()).collect()
}

/// One mesh of a study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Cells as the case gives them.
    pub cells: usize,
    /// Radial distance of nodes \[R, physical cases m\].
    pub dr: f64,
    /// Time step \[R/c_p, physical cases s\].
    pub dt: f64,
    /// Number of the last step.
    pub steps: u64,
    /// Warnings of the case on this mesh and of its results.
    pub warnings: Vec<Finding>,
}

/// A quantity on all meshes, its order and its limit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Quantity {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Values, from the coarsest mesh to the finest; `None` where there is none.
    pub values: Vec<Option<f64>>,
    /// Observed order, if the values have one.
    pub order: Option<f64>,
    /// Extrapolated value, if there is an order.
    pub extrapolated: Option<f64>,
    /// Half-width of the interval about the finest value that is expected to contain the limit.
    pub error_bar: Option<f64>,
    /// Value of the closed form.
    pub exact: Option<f64>,
    /// Errors against the closed form.
    pub errors: Option<Vec<f64>>,
    /// Order of the last two errors against the closed form.
    pub exact_order: Option<f64>,
}

/// A study and its results.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Meshes, from the coarsest to the finest.
    pub levels: Vec<Level>,
    /// Closed form of the case, if it has one.
    pub closed_form: Option<&'static str>,
    /// Quantities.
    pub quantities: Vec<Quantity>,
}

/// Results on one mesh: steps with drag, velocity and stresses, and first times of events.
#[derive(Default)]
struct Trace {
    times: Vec<f64>,
    columns: Vec<Vec<f64>>,
    events: BTreeMap<&'static str, f64>,
    measures: Vec<Measure>,
    /// Interface stress of the last steps, the newest one last.
    pressures: VecDeque<Arc<[f64]>>,
    warnings: Vec<Finding>,
}

/// Steps that the time of an event needs.
const EVENT_STEPS: usize = 3;

/// A case on several meshes, without the frames, which a study does not record.
///
/// On a graded mesh the ratio of neighbouring cells is one that leaves them where they are: half as wide, its root.
///
/// * `cells`: `mesh.cells` of every mesh, on a graded one `mesh.contact_cells`
///
/// # Errors
///
/// A mesh that the case cannot have.
pub fn on_meshes(case: &Case, cells: &[usize]) -> Result<Vec<Case>, CaseErrors> {
    let (key, given) = case.mesh.density();
    let on_mesh = |cells: &usize| {
        let varied = case.vary_surface().set(key, *cells as i64);
        let Some(Grading { ratio, near: [radius, depth], .. }) = case.mesh.grading else {
            return varied.build();
        };
        let ratio = libm::pow(ratio, given as f64 / *cells as f64);
        let near = [("mesh.near_radius", radius), ("mesh.near_depth", depth)];
        let near = near.into_iter().map(|(key, length)| (key, case.written(Dimension::Length, length)));
        near.fold(varied.set("mesh.grading", ratio), |varied, (key, length)| varied.set(key, length)).build()
    };
    cells.iter().map(on_mesh).collect()
}

/// Computes a case on several meshes, in parallel.
///
/// * `cases`: the case on meshes refined by the same factor, from the coarsest to the finest, at least three
/// * `watch`: called with every step of the finest mesh
///
/// # Errors
///
/// A simulation that cannot begin or fails.
///
/// # Panics
///
/// Fewer than three cases.
pub fn study(cases: &[Case], plan: &Plan, mut watch: impl FnMut(u64) + Send) -> Result<Study, RunError> {
    assert!(cases.len() >= 3, "an order needs three meshes");
    let (finest, coarser) = cases.split_last().expect("there are cases");
    let (last, first) = rayon::join(
        || trace(finest, plan, &mut watch),
        || coarser.par_iter().map(|case| trace(case, plan, |_| {})).collect::<Result<Vec<_>, _>>(),
    );
    let mut traces = first?;
    traces.push(last?);
    let level = |(case, trace): (&Case, &Trace)| {
        let (&Sizes { dr, dt, steps, .. }, Units { length, time, .. }) = (&case.sizes, case.units());
        let (cells, warnings) = (case.mesh.density().1, trace.warnings.clone());
        Level { cells, dr: length.of(dr), dt: time.of(dt), steps, warnings }
    };
    let levels: Vec<Level> = cases.iter().zip(&traces).map(level).collect();
    // the closed form of the finest mesh
    let form = ClosedForm::for_case(finest).ok().filter(|form| !form.is_approximate());
    let ratio = levels[levels.len() - 2].dr / levels[levels.len() - 1].dr;
    let units = finest.units();
    let mut quantities = Vec::new();
    for (column, name, unit) in columns(finest, plan) {
        for &time in &plan.times {
            let recorded = |trace: &Trace| trace.at(column, time).map(|value| unit.of(value));
            let values: Vec<_> = traces.iter().map(recorded).collect();
            if values.iter().all(Option::is_none) {
                // the run ends before
                continue;
            }
            let exact = form.as_ref().and_then(|form| exact(form, plan, column, time));
            let (name, exact) =
                (format!("{name}, t = {}", units.time.full_text(time)), exact.map(|value| unit.of(value)));
            quantities.push(Quantity::assess(name, unit.name, values, exact, ratio));
        }
    }
    for name in &plan.measures {
        let found = |trace: &Trace| trace.measures.iter().find(|measure| measure.name == *name).cloned();
        let measures: Vec<Option<Measure>> = traces.iter().map(found).collect();
        let Some(quantity) = measures.iter().flatten().next().map(|measure| measure.quantity) else {
            continue;
        };
        let values: Vec<_> = measures.into_iter().map(|measure| measure?.value).collect();
        if values.iter().any(Option::is_some) {
            let unit = quantity.unit(&measuring::units(units)).unwrap_or_else(|| "1".into());
            quantities.push(Quantity::assess(name.clone(), unit, values, None, ratio));
        }
    }
    let turns = finest.impact.contact == Rule::Unilateral && finest.shape().spreads();
    for (kind, name) in EVENTS {
        let recorded = |trace: &Trace| trace.events.get(name).map(|time| units.time.of(*time));
        let values: Vec<_> = traces.iter().map(recorded).collect();
        if values.iter().any(Option::is_some) {
            let quantity = Quantity::assess(format!("time of {name}"), units.time.name, values, None, ratio);
            let has_order = kind != EventKind::Extension || !turns;
            quantities.push(if has_order { quantity } else { quantity.without_order() });
        }
    }
    Ok(Study { levels, closed_form: form.map(|form| form.name), quantities })
}

/// Number in a trace, name and unit of every column that is a quantity.
fn columns(case: &Case, plan: &Plan) -> Vec<(usize, String, Unit)> {
    let Units { length, speed, stress, force, .. } = case.units();
    let mut columns = vec![(DRAG, "drag".to_owned(), force)];
    if case.indenter.mass.is_finite() {
        columns.push((VELOCITY, "velocity".into(), speed));
    }
    let probe =
        |(i, r): (usize, &f64)| (FIRST_PROBE + i, format!("stress at r = {}", length.full_text(*r)), stress);
    columns.extend(plan.probes.iter().enumerate().map(probe));
    columns
}

/// Value of a closed form at a time; `None` where it has none.
fn exact(form: &ClosedForm, plan: &Plan, column: usize, time: f64) -> Option<f64> {
    let value = match column {
        DRAG => form.drag_at(time),
        VELOCITY => return None,
        probe => form.pressure_at(plan.probes[probe - FIRST_PROBE], time),
    };
    value.is_finite().then_some(value)
}

/// Events whose times are quantities.
const EVENTS: [(EventKind, &str); 3] = [
    (EventKind::Extension, "extension"),
    (EventKind::Rebound, "rebound"),
    (EventKind::Separation, SEPARATION),
];
const SEPARATION: &str = "separation";

/// Columns of a trace.
const DRAG: usize = 0;
const VELOCITY: usize = 1;
const FIRST_PROBE: usize = 2;

fn trace(case: &Case, plan: &Plan, mut watch: impl FnMut(u64)) -> Result<Trace, RunError> {
    let columns = vec![Vec::new(); FIRST_PROBE + plan.probes.len()];
    let mut trace = Trace { columns, ..Trace::default() };
    (trace.measures, trace.warnings) = measured(case, |view| {
        trace.observe(view, plan);
        watch(view.step);
    })?;
    if !trace.events.contains_key(SEPARATION) {
        // the contact outlasts the run
        trace.measures.retain(|measure| measure.name != "contact_duration");
    }
    Ok(trace)
}

impl Trace {
    fn observe(&mut self, view: &View<'_>, plan: &Plan) {
        self.times.push(view.time);
        let stresses = plan.probes.iter().map(|&r| view.interface.stress_at(r));
        let numbers = [view.drag, view.velocity].into_iter().chain(stresses);
        self.columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        self.pressures.push_back(Arc::clone(&view.interface.pressure));
        if self.pressures.len() > EVENT_STEPS {
            self.pressures.pop_front();
        }
        for event in &*view.events {
            if let Some((_, name)) = EVENTS.iter().find(|(kind, _)| *kind == event.kind) {
                let time = self.time_of(event, view);
                self.events.entry(name).or_insert(time);
            }
        }
    }

    /// Time of an event that is seen at the newest step, between steps.
    fn time_of(&self, event: &Event, view: &View<'_>) -> f64 {
        let steps = self.times.len();
        match (event.kind, event.r, event.since) {
            (EventKind::Rebound, ..) => zero_of(&self.times, &self.columns[VELOCITY]),
            (EventKind::Extension, _, Some(since)) => since,
            (EventKind::Extension, Some(r), None) => {
                let node = view.interface.place(r).round() as usize;
                let at_node = |pressure: &Arc<[f64]>| pressure.get(node).copied().unwrap_or(0.0);
                let pressures: Vec<f64> = self.pressures.iter().map(at_node).collect();
                zero_of(&self.times[steps - pressures.len()..], &pressures)
            }
            (EventKind::Separation, _, Some(since)) => {
                let lost = self.times.partition_point(|time| *time < since) + 1;
                zero_of(&self.times[..lost], &self.columns[DRAG][..lost])
            }
            _ => view.time,
        }
    }

    /// Value at `time`, linear between steps; `None` if the run ended before.
    fn at(&self, column: usize, time: f64) -> Option<f64> {
        let values = &self.columns[column];
        // the last step may lie half a step before the end time
        let half = 0.5 * self.times.get(1).unwrap_or(&0.0);
        let last = *self.times.last()?;
        if time > last + half {
            return None;
        }
        let i = self.times.partition_point(|t| *t < time.min(last));
        let before = i.saturating_sub(1);
        let span = self.times[i] - self.times[before];
        let share = if span > 0.0 { (time.min(last) - self.times[before]) / span } else { 0.0 };
        Some(values[before] + share * (values[i] - values[before]))
    }
}

/// Time at which a quantity has fallen to 0, which it has at the last of some steps but not at the one before: linear between
/// the two if it continues below 0, else, cut off at 0, from the two steps before.
fn zero_of(times: &[f64], values: &[f64]) -> f64 {
    match (times, values) {
        (&[.., t0, t1], &[.., v0, v1]) if v0 > 0.0 && v1 < 0.0 => t0 + (t1 - t0) * v0 / (v0 - v1),
        (&[.., t0, t1], &[.., before, v0, _]) if before > v0 && v0 > 0.0 => {
            t0 + (t1 - t0) * (v0 / (before - v0)).min(1.0)
        }
        (&[.., last], _) => last,
        _ => 0.0,
    }
}

/// Relative difference that may be rounding.
const ROUNDING: f64 = 1e-12;

/// Error bar of values without an order: three times their largest difference.
fn wide_bar([v1, v2, v3]: [f64; 3]) -> f64 {
    3.0 * (v2 - v1).abs().max((v3 - v2).abs()).max((v3 - v1).abs())
}

impl Quantity {
    /// Order, limit and errors of the values of a quantity.
    ///
    /// * `ratio`: factor of the refinement
    fn assess(
        name: String,
        unit: impl Into<Cow<'static, str>>,
        values: Vec<Option<f64>>,
        exact: Option<f64>,
        ratio: f64,
    ) -> Self {
        const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=2.5;
        let mut quantity = Self { name, unit: unit.into(), values, exact, ..Self::default() };
        let Some(known) = quantity.values.iter().copied().collect::<Option<Vec<f64>>>() else {
            return quantity;
        };
        if let [.., v1, v2, v3] = known[..] {
            let (coarse, fine) = (v2 - v1, v3 - v2);
            let order = (coarse / fine).ln() / ratio.ln();
            if ORDERS.contains(&order) && fine.abs() > ROUNDING * v3.abs() {
                let rest = fine / (ratio.powf(order) - 1.0);
                quantity.order = Some(order);
                quantity.extrapolated = Some(v3 + rest);
                quantity.error_bar = Some(1.25 * fine.abs() / (ratio.powf(order.min(1.0)) - 1.0));
            } else {
                quantity.error_bar = Some(wide_bar([v1, v2, v3]));
            }
        }
        if let Some(exact) = exact {
            let errors: Vec<f64> = known.iter().map(|value| value - exact).collect();
            if let [.., coarse, fine] = errors[..] {
                let order = (coarse / fine).abs().ln() / ratio.ln();
                quantity.exact_order =
                    Some(order).filter(|order| order.is_finite() && fine.abs() > ROUNDING * exact.abs());
            }
            quantity.errors = Some(errors);
        }
        quantity
    }

    /// The same of a quantity whose differences are noise.
    fn without_order(self) -> Self {
        let known: Option<Vec<f64>> = self.values.iter().copied().collect();
        let error_bar = known.and_then(|known| known.last_chunk().copied()).map(wide_bar);
        Self { order: None, extrapolated: None, error_bar, ..self }
    }

    /// Relative difference of a value from the best known one: that of the closed form, the extrapolated one, the finest one;
    /// `None` where it may be rounding.
    pub fn relative_error(&self, value: f64) -> Option<f64> {
        let best = self.exact.or(self.extrapolated).or(self.values.last().copied().flatten())?;
        Some(((value - best) / best).abs()).filter(|error| error.is_finite() && *error > ROUNDING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_lie_between_steps() {
        let times = [0.0, 0.5, 1.0, 1.5];
        // a straight line through 0 at 1.3, below 0 and cut off there
        let line = |t: f64| 2.6 - 2.0 * t;
        assert!((zero_of(&times, &times.map(line)) - 1.3).abs() < 1e-15);
        assert!((zero_of(&times, &times.map(|t| line(t).max(0.0))) - 1.3).abs() < 1e-15);
        // a contact that ends at once
        assert_eq!(zero_of(&times, &[1.0, 1.0, 1.0, 0.0]), 1.5);
        assert_eq!(zero_of(&[0.0], &[0.0]), 0.0);
    }

    fn assess(values: [f64; 3], exact: Option<f64>) -> Quantity {
        Quantity::assess("q".into(), "1", values.map(Some).to_vec(), exact, 2.0)
    }

    #[test]
    fn a_known_order_is_observed_and_extrapolated() {
        for p in [1.0, 1.7, 2.0] {
            let v = |h: f64| 3.0 + 0.4 * h.powf(p);
            let quantity = assess([v(1.0), v(0.5), v(0.25)], Some(3.0));
            assert!((quantity.order.expect("an order") - p).abs() < 1e-12);
            assert!((quantity.exact_order.expect("an order") - p).abs() < 1e-12);
            assert!((quantity.extrapolated.expect("a value") - 3.0).abs() < 1e-12);
            assert!(quantity.error_bar.expect("a bar") >= (v(0.25) - 3.0).abs());
            let error = quantity.relative_error(v(0.5)).expect("more than rounding");
            assert!((error / (0.4 / 3.0 * 0.5_f64.powf(p)) - 1.0).abs() < 1e-9);
            assert_eq!(quantity.relative_error(3.0), None);
        }
    }

    #[test]
    fn values_without_a_limit_have_no_order() {
        // the last is of order 3.3: the scheme has no such order
        for values in [[1.0, 2.0, 1.0], [1.0, 1.1, 1.3], [1.0, 1.0, 1.0], [1.0, 1.1, 1.11]] {
            let quantity = assess(values, None);
            assert_eq!((quantity.order, quantity.extrapolated), (None, None));
            let spread = values.iter().fold(0.0, |most: f64, v| most.max((v - values[2]).abs()));
            assert!(quantity.error_bar.expect("a bar") >= spread);
        }
        let partly = Quantity::assess("q".into(), "1", vec![Some(1.0), None, Some(2.0)], None, 2.0);
        assert_eq!(partly.error_bar, None);
    }

    /// A ball on a thin free plate, whose contact turns back at t = 2.98 (240, 320 cells: 2.96, 2.99; the first node leaves at 32.9 with 30 cells,
    /// at 12.8 with 100).
    const THIN_PLATE: &str = "model = \"elastic\"\n[target]\nthickness = 0.2\nback = \"free\"\nshear_wave_speed = 0.5\n\
        [indenter]\nshape = \"sphere\"\nnose_radius = 1.0\nmass = 0.5\n[impact]\nvelocity = 0.005\n[mesh]\ncells = 40\n\
        [run]\nend_time = 30\nstop = \"extension\"\n[record]\nframes = 0\n";

    #[test]
    fn the_turn_of_a_contact_converges_within_its_error_bar() {
        let case = Case::sound(THIN_PLATE, &[]);
        for cells in [[25, 50, 100], [30, 60, 120], [40, 80, 160]] {
            let cases = on_meshes(&case, &cells).expect("meshes");
            let study = study(&cases, &Plan::default(), |_| {}).expect("a solver");
            let turn = study
                .quantities
                .iter()
                .find(|quantity| quantity.name == "time of extension")
                .expect("a turn");
            for value in turn.values.iter().map(|value| value.expect("it turns")) {
                assert!((value / 2.98 - 1.0).abs() < 0.05, "{turn:?}");
            }
            let [finest, bar] = [turn.values[2], turn.error_bar].map(|value| value.expect("a number"));
            assert!((finest - 2.98).abs() < bar && bar < 0.5, "{turn:?}");
        }
    }

    #[test]
    fn error_bars_hold_closed_forms() {
        // 24 times and 4 radii of three cases that are solved in closed form, on meshes coarse enough to be wrong
        let (mut bars, mut missed, mut worst) = (0, 0, 0.0_f64);
        for name in ["fig2-prescribed", "fig6a", "fig7a"] {
            let cases = on_meshes(&Case::sound(name, &[]), &[13, 26, 52]).expect("meshes");
            let end = cases[0].run.end_time;
            let plan = Plan {
                times: (1..25).map(|m| f64::from(m) / 24.5 * end).collect(),
                probes: vec![0.1, 0.3, 0.5, 0.7],
                ..Plan::default()
            };
            let study = study(&cases, &plan, |_| {}).expect("a solver");
            for quantity in &study.quantities {
                if let (Some(bar), Some(errors)) = (quantity.error_bar, &quantity.errors) {
                    let error = errors[2].abs();
                    bars += 1;
                    missed += usize::from(error > bar.max(1e-12));
                    worst = worst.max(error / bar.max(1e-12));
                }
            }
        }
        assert!(bars > 300, "{bars}");
        assert!(25 * missed < bars, "{missed} of {bars} error bars miss");
        assert!(worst < 10.0, "by {worst} bars");
    }
}
