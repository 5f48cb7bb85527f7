//! `/view/fronts`: wave fronts by geometry, as thin lines. A separate topic, which a viewer can switch off.
//!
//! The edge of the contact emits waves from the time at which they outrun it. In the equation of motion \[KA\] Eq. 18
//! they run at c_p along z and at c_s along r, so their front is an ellipse about the edge; in the full theory there are a P and an
//! S wave, circles. The far side of a layer folds them back; of several layers they are drawn in the struck one alone. A flat punch also has the
//! plane front.

use std::sync::Arc;

use super::{Sheet, Viewport, WORLD, entity, viewport::EdgeWave, world::World};
use crate::{
    case::Case,
    channels::{Channel, FieldNote, Rate},
    message::foxglove::{LinePrimitive, Point3, SceneUpdate},
};

/// Points of half an ellipse.
const POINTS: u32 = 36;
/// Crossings of the layer after which fronts are no longer drawn.
const CROSSINGS: f64 = 4.0;

struct Fronts {
    viewport: Arc<Viewport>,
    is_flat: bool,
    /// Unit half circle, `(cos, sin)` from r = 1 over z = 1 to r = −1.
    circle: Vec<(f64, f64)>,
}

pub fn channel(case: &Case, viewport: &Arc<Viewport>) -> Channel {
    let meaning = if case.model.has_shear() {
        "wave fronts from the edge of the contact by geometry: (r - r_e)² + z² = c²(t - t_e)² with c_p and c_s"
    } else {
        "wave fronts from the edge of the contact by geometry: ((r - r_e)/c_s)² + (z/c_p)² = (t - t_e)²"
    };
    let note = FieldNote::new("entities", viewport.world.unit.name, meaning);
    let fronts = Fronts::new(case, viewport);
    let channel = Channel::new("/view/fronts", "foxglove.SceneUpdate", vec![note], move |view, outlet| {
        if view.frame.is_none() {
            return;
        }
        let mut entity = entity("fronts", WORLD, outlet);
        entity.lines = fronts.lines(view.time);
        outlet.put(&SceneUpdate { deletions: Vec::new(), entities: vec![entity] });
    })
    .emits(Rate::Frame(4 << 10));
    match viewport.waves.first() {
        Some(edge) => channel
            .remark("edge.r", viewport.world.length(edge.r).to_string())
            .remark("edge.time", case.units().time.of(edge.time).to_string()),
        None => channel,
    }
}

impl Fronts {
    fn new(case: &Case, viewport: &Arc<Viewport>) -> Self {
        let part = |part: u32| on_circle(2.0 * f64::from(part) / f64::from(POINTS) - 1.0);
        Self {
            viewport: Arc::clone(viewport),
            is_flat: case.indenter.head.is_flat(),
            circle: (0..=POINTS).map(part).collect(),
        }
    }

    fn lines(&self, time: f64) -> Vec<LinePrimitive> {
        let world = self.viewport.world;
        let mut lines = Vec::new();
        for (number, wave) in self.viewport.waves.iter().enumerate() {
            let age = time - wave.time;
            if age <= 0.0 || self.viewport.thickness.is_some_and(|thickness| age > CROSSINGS * thickness) {
                continue;
            }
            for side in [-1.0, 1.0] {
                let run =
                    self.arc(wave, age).into_iter().map(|(r, z)| world.point(side * r, -self.folded(z)));
                lines.push(run.collect());
            }
            if self.is_flat && number == 0 && age <= self.lowest() {
                let depth = self.folded(age);
                lines.push([-wave.r, wave.r].map(|r| world.point(r, -depth)).to_vec());
            }
        }
        let z = self.viewport.height_of(Sheet::Fronts);
        let thin =
            |points: Vec<Point3>| LinePrimitive { thickness: 1.0, ..world.line(points, z, World::FRONT) };
        lines.into_iter().filter(|points: &Vec<_>| points.len() > 1).map(thin).collect()
    }

    /// The part of the front from the edge at r > 0 that is in the viewport: points `(r, z)` of the unfolded ellipse.
    fn arc(&self, wave: &EdgeWave, age: f64) -> Vec<(f64, f64)> {
        let [along_r, along_z] = wave.speeds.map(|speed| speed * age);
        let points = self.circle.iter().map(|(cos, sin)| (wave.r + along_r * cos, along_z * sin));
        let is_shown = |z: f64| z <= self.lowest() && self.folded(z) <= self.viewport.depth;
        points.filter(|(r, z)| r.abs() <= self.viewport.half_width && is_shown(*z)).collect()
    }

    /// Unfolded depth down to which fronts are drawn.
    fn lowest(&self) -> f64 {
        self.viewport.layers.get(1).map_or(f64::INFINITY, |(_, top)| *top)
    }

    /// Depth of a front whose unfolded depth is z: backing and surface fold it.
    fn folded(&self, z: f64) -> f64 {
        match self.viewport.thickness {
            None => z,
            Some(thickness) => {
                let rest = z % (2.0 * thickness);
                rest.min(2.0 * thickness - rest)
            }
        }
    }
}

/// A point of the half circle, from (1, 0) at s = −1 over (0, 1) to (−1, 0) at s = 1: the rational parametrisation, the
/// same bits on every machine.
fn on_circle(s: f64) -> (f64, f64) {
    (-2.0 * s / (1.0 + s * s), (1.0 - s * s) / (1.0 + s * s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_a_circle() {
        assert_eq!([-1.0, 0.0, 1.0].map(on_circle), [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]);
        let points: Vec<(f64, f64)> = (-18..=18).map(|part| on_circle(f64::from(part) / 18.0)).collect();
        assert!(points.iter().all(|(x, y)| (x * x + y * y - 1.0).abs() < 1e-15));
        assert!(points.windows(2).all(|pair| pair[0].0 > pair[1].0), "once around");
    }

    #[test]
    fn fronts_are_folded_by_a_layer() {
        let case = Case::sound("fig5", &[]);
        let fronts = Fronts::new(&case, &Arc::new(Viewport::new(&case)));
        for (z, depth) in [(0.25, 0.25), (1.25, 0.75), (2.25, 0.25), (3.0, 1.0)] {
            assert!((fronts.folded(z) - depth).abs() < 1e-15, "{z}");
        }
        // t = 1.5: the plane front is on its way back at z = 0.5, the ellipse is 2 · 0.75 wide at the surface
        let lines = fronts.lines(1.5);
        assert_eq!(lines.len(), 3);
        let point = |x, y| fronts.viewport.world.point(x, y);
        assert_eq!(lines[2].points, [point(-1.0, -0.5), point(1.0, -0.5)]);
        assert_eq!(lines[1].points[0], point(1.75, 0.0));
        assert!(fronts.lines(0.0).is_empty() && fronts.lines(4.5).is_empty());
    }
}
