//! Axes of arrays: positions of their elements, and values between them.

use prost_reflect::{DynamicMessage, FieldDescriptor, Value};

use crate::{field::cell, overview::Channel};

/// Positions of the elements of an array.
#[derive(Clone, Debug)]
pub(crate) enum Axis {
    /// `start + i·step`, taken from fields of the same message.
    Uniform { start: FieldDescriptor, step: FieldDescriptor },
    /// Listed in the metadata.
    Listed(Vec<f64>),
    /// Rows and columns: not one axis.
    Matrix,
    /// Not given.
    Unknown,
}

impl Axis {
    /// The axis of an array field, from the metadata of its channel.
    pub(crate) fn of(field: &FieldDescriptor, channel: &Channel) -> Self {
        let Some(text) = channel.metadata.get(&format!("axis.{}", field.name())) else {
            return Self::Unknown;
        };
        if text.contains(';') {
            return Self::Matrix;
        }
        let numbers: Option<Vec<f64>> = text.split(',').map(|item| item.trim().parse().ok()).collect();
        if let Some(positions) = numbers {
            return Self::Listed(positions);
        }
        let mut names = text.split(',').map(|name| field.parent_message().get_field_by_name(name.trim()));
        match (names.next().flatten(), names.next().flatten()) {
            (Some(start), Some(step)) => Self::Uniform { start, step },
            _ => Self::Unknown,
        }
    }

    /// True if the axis is that of `coordinate`: `r0,dr` is `r`; lists carry no name and fit any.
    pub(crate) fn is_named(&self, coordinate: &str) -> bool {
        match self {
            Self::Uniform { start, .. } => start.name().trim_end_matches('0') == coordinate,
            Self::Listed(_) => true,
            Self::Matrix | Self::Unknown => false,
        }
    }
}

/// An axis with its numbers.
pub(crate) enum Place<'a> {
    Uniform { start: f64, step: f64 },
    Listed(&'a [f64]),
    Unknown,
}

impl Axis {
    /// The axis as it is in a message.
    pub(crate) fn place(&self, message: &DynamicMessage) -> Place<'_> {
        let number = |field: &FieldDescriptor| cell(field, &message.get_field(field)).number();
        match self {
            Self::Uniform { start, step } => match (number(start), number(step)) {
                (Some(start), Some(step)) if step > 0.0 => Place::Uniform { start, step },
                _ => Place::Unknown,
            },
            Self::Listed(positions) => Place::Listed(positions),
            Self::Matrix | Self::Unknown => Place::Unknown,
        }
    }
}

/// Value of an array at a position of its axis.
///
/// Linear between elements. Up to half a step beyond the first and last element their values hold, or, where the
/// array is even about the origin and the position lies between it and the first element, the parabola through the
/// first two. Nothing farther out.
pub(crate) fn at(
    list: &[Value],
    field: &FieldDescriptor,
    place: &Place<'_>,
    even: bool,
    position: f64,
) -> Option<f64> {
    let value = |i: usize| list.get(i).and_then(|value| cell(field, value).number());
    match place {
        Place::Uniform { start, step } => {
            let x = (position - start) / step;
            let last = list.len().checked_sub(1)? as f64;
            // half a step, and some room for rounding
            let reach = 0.5 + 1e-9;
            if x < -reach || x > last + reach {
                None
            } else if x < 0.0 && even && list.len() > 1 {
                let (r0, r1) = (*start, start + step);
                let (p0, p1) = (value(0)?, value(1)?);
                Some(p0 + (p1 - p0) * (position * position - r0 * r0) / (r1 * r1 - r0 * r0))
            } else {
                let x = x.clamp(0.0, last);
                let i = (x as usize).min(list.len().saturating_sub(2));
                let (from, to) = (value(i)?, value(i + 1).or_else(|| value(i))?);
                Some(from + (to - from) * (x - i as f64))
            }
        }
        Place::Listed(positions) => {
            if let Some(i) = positions.iter().position(|&p| p == position) {
                return value(i);
            }
            let i = positions.windows(2).position(|pair| pair[0] < position && position < pair[1])?;
            let share = (position - positions[i]) / (positions[i + 1] - positions[i]);
            let (from, to) = (value(i)?, value(i + 1)?);
            Some(from + (to - from) * share)
        }
        Place::Unknown => None,
    }
}
