//! The new recording in the units of the reference, where one is in SI and the other dimensionless.

use std::sync::Arc;

use crate::{
    axis::Axis,
    channel::Channel,
    convention,
    scales::{Conversion, Scales},
    wire::{Leaf, List, Type, Values},
};

/// Distance of positions that counts as rounding, relative to the farthest.
const ROUNDING: f64 = 1e-9;

/// What leads from the units of a new channel to those of its reference.
#[derive(Clone, Debug, Default)]
pub(super) struct Converter {
    /// Leaves of the new channel.
    leaves: Vec<(usize, Conversion)>,
    time: Option<Conversion>,
    /// Of lists of positions, which are lengths.
    length: Option<Conversion>,
}

impl Converter {
    /// * `leaves`: those of both channels
    pub(super) fn of(a: &Channel, b: &Channel, leaves: &[(usize, usize)], scales: &Scales) -> Self {
        let (Some(layout_a), Some(layout_b)) = (&a.layout, &b.layout) else { return Self::default() };
        let converted = |&(i, j): &(usize, usize)| {
            let conversion = conversion((a, &layout_a.leaves[i]), (b, &layout_b.leaves[j]), scales)?;
            Some((j, conversion))
        };
        let leaves: Vec<(usize, Conversion)> = leaves.iter().filter_map(converted).collect();
        let time = b.time_leaf().and_then(|time| leaves.iter().find(|(leaf, _)| *leaf == time));
        let time = time.map(|(_, conversion)| *conversion);
        let length = leaves.first().and_then(|(_, conversion)| length(*conversion, scales));
        Self { leaves, time, length }
    }

    /// True if the units are the same, or nothing leads from one to the other.
    pub(super) fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// True if the new recording is in SI.
    pub(super) fn is_from_si(&self) -> bool {
        matches!(self.leaves.first(), Some((_, Conversion::Divide(_))))
    }

    /// Converts a message of the new channel.
    pub(super) fn apply(&self, values: &mut Values) {
        for (leaf, conversion) in &self.leaves {
            match &mut values.lists[*leaf] {
                List::Double(list) => list.iter_mut().for_each(|value| *value = conversion.apply(*value)),
                List::Float(list) => {
                    list.iter_mut().for_each(|value| *value = conversion.apply(f64::from(*value)) as f32);
                }
                _ => {}
            }
        }
    }

    /// A time of the new channel.
    pub(super) fn time(&self, time: f64) -> f64 {
        self.time.map_or(time, |conversion| conversion.apply(time))
    }

    /// An axis of the new channel; that of the reference if they only differ by rounding.
    pub(super) fn axis(&self, new: Axis, reference: &Axis) -> Axis {
        let (Some(conversion), Axis::Listed(positions)) = (self.length, &new) else { return new };
        let positions: Arc<[f64]> = positions.iter().map(|position| conversion.apply(*position)).collect();
        match reference {
            Axis::Listed(known) if are_near(known, &positions) => reference.clone(),
            _ => Axis::Listed(positions),
        }
    }
}

/// What leads from the unit of a field of the new recording to that of the reference.
fn conversion(
    (a, leaf): (&Channel, &Leaf),
    (b, other): (&Channel, &Leaf),
    scales: &Scales,
) -> Option<Conversion> {
    let is_float = |leaf: &Leaf| matches!(leaf.kind, Type::Double | Type::Float);
    let (to, from) = (a.unit(&leaf.path)?, b.unit(&other.path)?);
    scales.conversion(from, to).filter(|_| is_float(leaf) && is_float(other))
}

/// The conversion of lengths in the same direction as another.
fn length(other: Conversion, scales: &Scales) -> Option<Conversion> {
    match other {
        Conversion::Divide(_) => scales.conversion("m", "R"),
        Conversion::Multiply(_) => scales.conversion("R", "m"),
    }
}

fn are_near(a: &[f64], b: &[f64]) -> bool {
    let farthest = a.iter().fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x == y || (x - y).abs() <= ROUNDING * farthest)
}

/// True if a difference of the metadata of a field goes away by conversion: another unit, or the same positions in it.
pub(super) fn explains(
    key: &str,
    [text_a, text_b]: [&str; 2],
    a: (&Channel, &Leaf),
    b: (&Channel, &Leaf),
    scales: &Scales,
) -> bool {
    let Some(conversion) = conversion(a, b, scales) else { return false };
    let [list_a, list_b] = [text_a, text_b].map(convention::numbers);
    match (key, length(conversion, scales), list_a, list_b) {
        ("unit", ..) => true,
        ("axis", Some(length), Some(a), Some(b)) => {
            are_near(&a, &b.iter().map(|position| length.apply(*position)).collect::<Vec<_>>())
        }
        _ => false,
    }
}
