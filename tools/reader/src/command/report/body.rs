//! The indenter over the section: its outline, its depth and the contact radius at the frames.

use serde_json::{Value, json};

use crate::{
    command::view::{Scale, find, find_leaf, nearest},
    convention::{FACE, PROFILE, VELOCITY},
    messages::Recording,
    pass::{Moment, Pass},
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

/// Where the outline of the indenter is: of the profile in which it is deepest; of one that gives of the first in which it is, while it is
/// hardly deformed.
///
/// ```text
/// outline f(r) = w − y(r)      w: depth of the indenter, y: its face at the same time
/// ```
#[derive(Default)]
pub(in crate::command) struct Outline {
    deepest: Option<[Vec<f64>; 2]>,
    /// Times and depths of the nose of one that gives.
    nose: Vec<(f64, f64)>,
}

impl Outline {
    pub(in crate::command) fn watch<'a>(&'a mut self, recording: &Recording, pass: &mut Pass<'a>) {
        let leaf = |field| find_leaf(recording, PROFILE, field);
        let (Some((id, radius)), Some((_, face))) = (leaf("r"), leaf(FACE)) else { return };
        // the type has this field whatever the indenter is
        let motion = find(recording, |topic| topic == VELOCITY);
        let gives = motion.is_some_and(|id| recording.channels[&id].unit("nose").is_some());
        let Self { deepest, nose } = self;
        pass.each(id, move |moment, _| {
            let depth = moment.values.lists[face].number(0).unwrap_or(0.0);
            let known = deepest.as_ref().and_then(|[_, face]| face.first().copied());
            if gives {
                nose.push((moment.time, depth));
            }
            if depth > known.unwrap_or(0.0) && !(gives && known.is_some()) {
                *deepest = Some([radius, face].map(|leaf| numbers(moment, leaf)));
            }
            Ok(())
        });
    }

    /// The indenter at some times.
    ///
    /// * `depths`, `radii`: of the tip and of the contact over time
    /// * `times`: of the frames, rising
    pub(in crate::command) fn body(
        &self,
        depths: &[(f64, f64)],
        radii: &[(f64, f64)],
        times: &[f64],
    ) -> Body {
        let at_times =
            |curve: &[(f64, f64)]| if curve.is_empty() { Vec::new() } else { nearest(curve, times) };
        let depths = if self.nose.is_empty() { depths } else { &self.nose };
        let is_known = !times.is_empty() && !depths.is_empty();
        let (outline, is_cut) = match &self.deepest {
            Some([radii, face]) if is_known => cut(radii, face),
            _ => (Vec::new(), false),
        };
        Body { depths: at_times(depths), radii: at_times(radii), outline, is_cut }
    }
}

impl Body {
    /// As a page has it.
    ///
    /// * `length`: how lengths are read
    pub(super) fn json(&self, length: &Scale) -> Value {
        let [r, height] = [0, 1].map(|part| length.numbers(self.outline.iter().map(|point| point[part])));
        let [depths, radii] = [&self.depths, &self.radii].map(|list| length.numbers(list.iter().copied()));
        json!({ "depths": depths, "radii": radii, "r": r, "height": height, "is_cut": self.is_cut })
    }
}

/// The part of a face that is the indenter, relative to its tip: what lies beside it is no number, in older recordings 0.
fn cut(radii: &[f64], face: &[f64]) -> (Vec<[f64; 2]>, bool) {
    let tip = face.first().copied().unwrap_or_default();
    let points = radii.iter().zip(face).take_while(|(_, height)| height.is_finite() && **height != 0.0);
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
        let (punch, is_cut) = cut(&[0.5, 1.5, 2.5], &[0.25, 0.25, f64::NAN]);
        assert_eq!((punch, is_cut), (vec![[0.5, 0.0], [1.5, 0.0]], true));
        let (cone, is_cut) = cut(&[0.0, 1.0, 2.0], &[0.5, -0.5, -1.5]);
        assert_eq!((cone, is_cut), (vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], false));
    }
}
