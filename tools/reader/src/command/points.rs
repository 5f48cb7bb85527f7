//! Numbers of fields over time, as they are drawn.

use crate::{channel::Channel, messages::Recording, pass::Pass};

/// A curve: times and values.
pub(super) type Curve = Vec<(f64, f64)>;

/// A channel that has messages, by its topic.
pub(super) fn find(recording: &Recording, fits: impl Fn(&str) -> bool) -> Option<u16> {
    let fits = |channel: &Channel| channel.count > 0 && channel.layout.is_some() && fits(&channel.topic);
    recording.channels.iter().find(|(_, channel)| fits(channel)).map(|(id, _)| *id)
}

/// A channel that has messages, and the leaf of one of its fields.
pub(super) fn find_leaf(recording: &Recording, topic: &str, field: &str) -> Option<(u16, usize)> {
    let id = find(recording, |known| known == topic)?;
    Some((id, recording.channels[&id].layout.as_ref()?.find(field)?))
}

/// Some fields of a channel over time.
#[derive(Default)]
pub(super) struct Points {
    id: u16,
    /// Their names and leaves, with a curve for every element.
    fields: Vec<(&'static str, usize, Vec<Curve>)>,
}

impl Points {
    /// Nothing yet of those fields that there are; recordings of earlier versions have fewer.
    pub(super) fn of(recording: &Recording, topic: &str, names: &[&'static str]) -> Self {
        let Some(id) = find(recording, |known| known == topic) else { return Self::default() };
        let layout = recording.channels[&id].layout.as_deref();
        let field = |name: &&'static str| Some((*name, layout?.find(name)?, Vec::new()));
        Self { id, fields: names.iter().filter_map(field).collect() }
    }

    /// Takes the numbers of all messages of the pass.
    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        let Self { id, fields } = self;
        if fields.is_empty() {
            return;
        }
        let mut numbers = Vec::new();
        pass.each(*id, move |moment, budget| {
            for (_, leaf, curves) in fields.iter_mut() {
                if !moment.values.lists[*leaf].numbers(&mut numbers) {
                    continue;
                }
                // a list grows to twice its length
                if !budget.spend(2 * size_of::<(f64, f64)>() * numbers.len()) {
                    return Err(recording.no_room("the points of the curves"));
                }
                curves.resize_with(curves.len().max(numbers.len()), Curve::new);
                let points = numbers.iter().map(|number| (moment.time, *number));
                curves.iter_mut().zip(points).for_each(|(curve, point)| curve.push(point));
            }
            Ok(())
        });
    }

    /// The curves of a field, one for each of its elements; none if it is not recorded.
    pub(super) fn curves(&self, name: &str) -> &[Curve] {
        self.fields.iter().find(|(known, ..)| *known == name).map_or(&[], |(.., curves)| curves)
    }

    /// The curve of a field of single numbers.
    pub(super) fn curve(&self, name: &str) -> &[(f64, f64)] {
        self.curves(name).first().map_or(&[], Vec::as_slice)
    }
}

/// The point of a curve nearest to a place; of two that are equally near, the first.
///
/// * `is_lower`: of two at the place the second is meant
pub(super) fn nearest_point(curve: &[(f64, f64)], (place, is_lower): (f64, bool)) -> Option<(f64, f64)> {
    let next = curve.partition_point(|point| point.0 < place || (is_lower && point.0 == place));
    let around = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| curve.get(i));
    let distance = |point: &&(f64, f64)| (point.0 - place).abs();
    around.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
}

/// The value of a curve at the point nearest to every time; NaN where it has none.
pub(super) fn nearest(curve: &[(f64, f64)], times: &[f64]) -> Vec<f64> {
    times.iter().map(|at| nearest_point(curve, (*at, false)).map_or(f64::NAN, |point| point.1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_counts() {
        let curve = [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)];
        assert_eq!(nearest(&curve, &[-1.0, 0.5, 0.6, 9.0]), [1.0, 1.0, 2.0, 3.0]);
        assert!(nearest(&[], &[0.0])[0].is_nan());
    }
}
