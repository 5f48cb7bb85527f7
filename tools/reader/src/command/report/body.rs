//! The indenter over the section: its outline, its depth and the contact radius at the frames.

use serde_json::{Value, json};

use super::{curves::number, find};
use crate::{
    convention::{DRAG, FACE, PROFILE, VELOCITY},
    messages::Recording,
    recording::{Damage, OpenError},
    slice::{Moment, nearest, visit},
};

/// The indenter at some times, and its outline; no numbers where they are not recorded.
#[derive(Default)]
pub(in crate::command) struct Body {
    /// Depth of the tip at every time.
    pub depths: Vec<f64>,
    /// Contact radius at every time.
    pub radii: Vec<f64>,
    /// The outline in the frame of the indenter, `[r, f]` from the axis outwards.
    pub outline: Vec<[f64; 2]>,
    /// True if the outline ends at the edge of the indenter, not where the profile does.
    is_cut: bool,
}

/// Depths and contact radii at times, and the outline in the frame of the indenter.
///
/// ```text
/// outline f(r) = w − y(r)      w: depth of the indenter, y: its face at the same time
/// ```
///
/// * `times`: of the frames, rising
pub(in crate::command) fn body(
    recording: &Recording,
    times: &[f64],
    damages: &mut Vec<Damage>,
) -> Result<Body, OpenError> {
    let depths = at_times(recording, (VELOCITY, "displacement"), times, damages)?;
    let radii = at_times(recording, (DRAG, "contact_radius"), times, damages)?;
    let is_known = !times.is_empty() && !depths.is_empty();
    let (outline, is_cut) = if is_known { outline(recording, damages)? } else { (Vec::new(), false) };
    Ok(Body { depths, radii, outline, is_cut })
}

impl Body {
    /// As a page has it.
    pub(super) fn json(&self) -> Value {
        let list = |values: &[f64]| values.iter().map(|value| number(*value)).collect::<Vec<_>>();
        let [r, height] =
            [0, 1].map(|part| self.outline.iter().map(|point| number(point[part])).collect::<Vec<_>>());
        let (depths, radii) = (list(&self.depths), list(&self.radii));
        json!({ "depths": depths, "radii": radii, "r": r, "height": height, "is_cut": self.is_cut })
    }
}

/// A field of a channel at the message nearest to every time; nothing if it is not recorded.
fn at_times(
    recording: &Recording,
    (topic, field): (&str, &str),
    times: &[f64],
    damages: &mut Vec<Damage>,
) -> Result<Vec<f64>, OpenError> {
    let Some(id) = find(recording, |known| known == topic) else { return Ok(Vec::new()) };
    let layout = recording.channels[&id].layout.as_ref();
    let Some(leaf) = layout.and_then(|layout| layout.find(field)) else { return Ok(Vec::new()) };
    let value = |moment: &Moment| numbers(moment, leaf).first().copied();
    let (values, damaged) = nearest(recording, id, times, value)?;
    damages.extend(damaged);
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}

/// The outline of the indenter as `[r, height]` from the axis outwards, of the profile in which it is deepest; and true if it ends at
/// the edge of the indenter, not where the profile does.
fn outline(recording: &Recording, damages: &mut Vec<Damage>) -> Result<(Vec<[f64; 2]>, bool), OpenError> {
    let none = (Vec::new(), false);
    let Some(id) = find(recording, |known| known == PROFILE) else { return Ok(none) };
    let layout = recording.channels[&id].layout.as_ref();
    let leaves = layout.and_then(|layout| Some([layout.find("r")?, layout.find(FACE)?]));
    let Some([radius, face]) = leaves else { return Ok(none) };
    let mut deepest: Option<[Vec<f64>; 2]> = None;
    damages.extend(visit(recording, id, 1, |moment| {
        let lists = [radius, face].map(|leaf| numbers(&moment, leaf));
        let depth = |lists: &[Vec<f64>; 2]| lists[1].first().copied().unwrap_or(0.0);
        if depth(&lists) > deepest.as_ref().map_or(0.0, depth) {
            deepest = Some(lists);
        }
    })?);
    Ok(deepest.map_or(none, |[radii, face]| cut(&radii, &face)))
}

/// The part of a face that is the indenter, relative to its tip: what lies beside it is 0.
fn cut(radii: &[f64], face: &[f64]) -> (Vec<[f64; 2]>, bool) {
    let tip = face.first().copied().unwrap_or_default();
    let points = radii.iter().zip(face).take_while(|(_, height)| **height != 0.0);
    let points: Vec<[f64; 2]> = points.map(|(r, height)| [*r, tip - height]).collect();
    let is_cut = points.len() < face.len();
    (points, is_cut)
}

fn numbers(moment: &Moment, leaf: usize) -> Vec<f64> {
    let mut values = Vec::new();
    moment.values.lists[leaf].numbers(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_ends_at_the_edge() {
        let (punch, is_cut) = cut(&[0.5, 1.5, 2.5], &[0.25, 0.25, 0.0]);
        assert_eq!((punch, is_cut), (vec![[0.5, 0.0], [1.5, 0.0]], true));
        let (cone, is_cut) = cut(&[0.0, 1.0, 2.0], &[0.5, -0.5, -1.5]);
        assert_eq!((cone, is_cut), (vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], false));
    }
}
