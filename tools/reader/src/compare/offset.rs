//! The time by which the new recording has to be moved.
//!
//! ```text
//! minimise over s:  Σ_f 1/n Σ_i (a_f(t_i) − b_f(t_i − s))² / (1/N Σ_i a_f(t_i)²)
//! ```
//!
//! over the plain fields f of both, b between its messages linear, where at least half of the shorter recording takes part: first
//! on a grid as fine as the messages, then by golden sections around the best of its local minima.

use super::structure::Pair;
use crate::{
    axis::linear, convention, failure::Failure, messages::Recording, pass::Pass, select::Window, wire::Type,
};

/// Fields that take part, at most.
const FIELDS: usize = 8;

/// Samples of a curve, and points of the grid, at most.
const SAMPLES: usize = 4000;

/// Local minima of the grid that are looked at between its points, at most.
const MINIMA: usize = 32;

/// A field over time.
type Curve = Vec<(f64, f64)>;

/// The shift of the least squares.
pub(super) fn fit(a: &Recording, b: &Recording, pairs: &[Pair]) -> Result<f64, Failure> {
    let mut left = FIELDS;
    let mut chosen = Vec::new();
    for pair in pairs {
        let (channel_a, channel_b) = (&a.channels[&pair.a], &b.channels[&pair.b]);
        let (Some(layout_a), Some(layout_b)) = (&channel_a.layout, &channel_b.layout) else { continue };
        let is_plain = |&&(i, j): &&(usize, usize)| {
            let (leaf, other) = (&layout_a.leaves[i], &layout_b.leaves[j]);
            let are_single = leaf.lists == 0 && other.lists == 0 && leaf.path != convention::TIME;
            are_single && matches!(leaf.kind, Type::Double | Type::Float) && other.kind.is_number()
        };
        let plain = pair.leaves.iter().filter(is_plain).take(left);
        let before = chosen.len();
        chosen.extend(plain.map(|&(i, j)| [(pair.a, i), (pair.b, j)]));
        left -= chosen.len() - before;
    }
    let of = |recording, side: usize| read(recording, chosen.iter().map(|pair| pair[side]));
    let varies = |(curve, _): &(Curve, Curve)| curve.iter().any(|(_, value)| *value != curve[0].1);
    let curves: Vec<(Curve, Curve)> =
        of(a, 0)?.into_iter().zip(of(b, 1)?).filter(|(_, b)| b.len() > 1).filter(varies).collect();
    let spans = |of: fn(&(Curve, Curve)) -> &Curve| {
        let ends = curves.iter().map(of).flat_map(|curve| [curve[0].0, curve[curve.len() - 1].0]);
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), time| (from.min(time), to.max(time)))
    };
    let ((from_a, to_a), (from_b, to_b)) = (spans(|curves| &curves.0), spans(|curves| &curves.1));
    let shorter = (to_a - from_a).min(to_b - from_b);
    let longest = curves.iter().map(|(a, b)| a.len().max(b.len())).max().unwrap_or(0);
    if longest < 3 || !shorter.is_finite() || shorter <= 0.0 {
        return Err(no_fit());
    }
    let (low, high) = (
        (from_a - from_b).min(to_a - to_b) - 0.5 * shorter,
        (from_a - from_b).max(to_a - to_b) + 0.5 * shorter,
    );
    let points = (2 * longest).min(SAMPLES);
    let cost = |shift: f64| curves.iter().map(|(a, b)| mismatch(a, b, shift)).sum::<f64>();
    least((low, high), points, cost).ok_or_else(no_fit)
}

/// Least point of a function of which a grid of so many points shows where to look; `None` if it is finite at none of them.
fn least((low, high): (f64, f64), points: usize, cost: impl Fn(f64) -> f64) -> Option<f64> {
    let step = (high - low) / points as f64;
    let grid: Vec<f64> = (0..=points).map(|i| low + i as f64 * step).collect();
    let costs: Vec<f64> = grid.iter().map(|shift| cost(*shift)).collect();
    let refined = minima(&costs).into_iter().flat_map(|i| [golden(grid[i], step, &cost), grid[i]]);
    refined.min_by(|x, y| cost(*x).total_cmp(&cost(*y)))
}

/// The least of the local minima among finite costs; of equal neighbours the first.
fn minima(costs: &[f64]) -> Vec<usize> {
    let at = |i: Option<usize>| i.and_then(|i| costs.get(i)).copied().unwrap_or(f64::INFINITY);
    let is_least =
        |&i: &usize| costs[i].is_finite() && costs[i] < at(i.checked_sub(1)) && costs[i] <= at(Some(i + 1));
    let mut minima: Vec<usize> = (0..costs.len()).filter(is_least).collect();
    minima.sort_by(|i, j| costs[*i].total_cmp(&costs[*j]));
    minima.truncate(MINIMA);
    minima
}

/// There is nothing to find a time offset by.
fn no_fit() -> Failure {
    let text = "--time-offset fit needs plain numbers that both recordings have and that vary; give a number instead";
    Failure::Failed(text.into())
}

/// Least point of a function within `step` of another, by golden sections.
fn golden(middle: f64, step: f64, cost: impl Fn(f64) -> f64) -> f64 {
    /// Each leaves 0.618 of what was left: together a part in 10^10.
    const SECTIONS: usize = 48;
    let share = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (middle - step, middle + step);
    for _ in 0..SECTIONS {
        let (left, right) = (high - share * (high - low), low + share * (high - low));
        if cost(left) < cost(right) { high = right } else { low = left }
    }
    0.5 * (low + high)
}

/// Mean square of the difference where both are, relative to that of the reference; infinite if that is less than half of
/// the shorter curve.
fn mismatch(a: &Curve, b: &Curve, shift: f64) -> f64 {
    let (mut sum, mut count, mut all) = (0.0, 0, 0.0);
    for &(time, value) in a {
        all += value * value;
        let Some(other) = linear(b, time - shift) else { continue };
        sum += (value - other) * (value - other);
        count += 1;
    }
    let span = |curve: &Curve| curve[curve.len() - 1].0 - curve[0].0;
    let least = 0.5 * a.len() as f64 * (span(b) / span(a)).min(1.0);
    if f64::from(count) < least || count == 0 {
        f64::INFINITY
    } else {
        sum / f64::from(count) * a.len() as f64 / all
    }
}

/// Fields of channels over time, with finite values only, thinned evenly to [`SAMPLES`].
fn read(
    recording: &Recording,
    fields: impl ExactSizeIterator<Item = (u16, usize)>,
) -> Result<Vec<Curve>, Failure> {
    let mut curves = vec![Curve::new(); fields.len()];
    let mut pass = Pass::over(recording, Window::default());
    for ((id, leaf), curve) in fields.zip(&mut curves) {
        pass.each(id, move |moment, budget| {
            let number = moment.values.lists[leaf].number(0).filter(|value| value.is_finite());
            let Some(value) = number.filter(|_| moment.time.is_finite()) else { return Ok(()) };
            if !budget.spend(2 * size_of::<(f64, f64)>()) {
                return Err(recording.no_room("the curves that are fitted"));
            }
            curve.push((moment.time, value));
            Ok(())
        });
    }
    pass.run()?;
    for curve in &mut curves {
        curve.sort_by(|x, y| x.0.total_cmp(&y.0));
        let every = curve.len().div_ceil(SAMPLES).max(1);
        *curve = curve.iter().step_by(every).copied().collect();
    }
    Ok(curves)
}

#[cfg(test)]
mod tests {
    use super::least;

    #[test]
    fn a_minimum_between_points_of_the_grid_is_found_beside_a_flat_tail() {
        let cost = |x: f64| if x > 8.0 { 1e-3 } else { (x - 3.0) * (x - 3.0) };
        let found = least((0.05, 10.05), 100, cost).expect("a minimum");
        assert!((found - 3.0).abs() < 1e-6, "{found}");
    }
}
