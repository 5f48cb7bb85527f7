//! The viewport: visible part of the target, scales and colour ranges, all derived from the case.

use std::f64::consts::PI;

use super::world::World;
use crate::{
    case::{Case, Grading, Sizes},
    contact::load::Load,
    geometry::Geometry,
    model::Field,
    shape::{Head, Shape, Tip},
};

/// Points on one side of the outline of a head that is not flat.
const HEAD_POINTS: u32 = 24;
/// Share of the smaller side of the section in view that the deepest displacement may take.
const DEEPEST: f64 = 0.2;
/// Distance between sheets as a share of the smaller side of the section in view: some hundred times the resolution of viewers.
const SHEET: f64 = 0.01;
/// Margin for peaks above the front pressure: under the tip of a cone, beside an edge, behind a reflection.
const HEADROOM: f64 = 1.25;

/// Section of a graded mesh that is shown, in its near zones.
const AROUND: f64 = 4.0;
/// Section that viewers open with, in largest contact radii.
const IN_VIEW: f64 = 20.0;
/// Greatest depth of it, in halves of its width: of a bar not all.
const SLENDER: f64 = 10.0;
/// Least width of a panel with a section, in its heights.
const ASPECT: f64 = 2.4;

/// Layers of pictures, from the back to the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sheet {
    /// The field over the section.
    Field,
    Fronts,
    Backing,
    /// Filling of the indenter.
    Body,
    Outline,
    Surface,
    /// Contact radius, drag, values.
    Marks,
}

/// Part of the target in pictures, and their scales.
#[derive(Clone, Debug)]
pub struct Viewport {
    /// Shown out to this radius, to both sides of the axis \[R\].
    pub half_width: f64,
    /// Shown down to this depth \[R\].
    pub depth: f64,
    /// Length of the edge of a pixel \[R\].
    pub pixel: f64,
    /// Pixels of half a row.
    pub columns: usize,
    /// Rows of pixels of the target.
    pub rows: usize,
    /// Rows of pixels above it, which show an indenter that gives.
    pub above: usize,
    /// Factor by which displacements and heads are drawn higher than they are.
    pub exaggeration: f64,
    /// Right half of the face of the indenter in its own frame, from the axis outwards, to scale: shape `(n, [x, y])` \[R\].
    pub face: Vec<[f64; 2]>,
    /// Upper end of the indenter in its own frame \[R\].
    pub top: f64,
    /// Largest radius that contact reaches \[R\].
    pub reach: f64,
    /// Waves of the edge, the fastest first; none if the contact outruns them to the end.
    pub waves: Vec<EdgeWave>,
    /// Thickness of the target \[R\]; `None` for a half-space.
    pub thickness: Option<f64>,
    /// Layers, where there are several: name and depth of the upper face \[R\].
    pub layers: Vec<(String, f64)>,
    /// What viewers open with.
    pub window: Window,
    /// Makes the geometry of pictures from these lengths.
    pub world: World,
}

/// The part of the scene that viewers open with: the contact, and both bodies around it. The rest is one turn of the wheel away.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Half of its width, which may be more than that of the section \[R\].
    pub half_width: f64,
    /// Height of all of it \[R\].
    pub height: f64,
    /// Height of its middle over the surface \[R\].
    pub middle: f64,
    /// Section in it: half of its width, and its depth \[R\].
    pub section: [f64; 2],
    /// Upper end of the indenter before the impact \[R\].
    pub ceiling: f64,
    /// Half of the width of the indenter \[R\].
    pub indenter: f64,
}

impl Window {
    /// * `section`: half of its width, and its depth, of what is in view
    /// * `indenter`: half of its width, and its height
    fn new(section: [f64; 2], [indenter, ceiling]: [f64; 2]) -> Self {
        let span = section[1] + ceiling;
        // with room for a line of text at either end
        let height = (1.3 * span).max(2.1 * section[0] / ASPECT);
        Self {
            half_width: ASPECT * height / 2.1,
            height,
            middle: 0.5 * (ceiling - section[1]) + 0.04 * span,
            section,
            ceiling,
            indenter,
        }
    }
}

/// Waves that the edge of the contact emits from the point on at which it no longer outruns them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeWave {
    /// Radius \[R\].
    pub r: f64,
    /// Time \[R/c_p\].
    pub time: f64,
    /// Speeds along r and along z \[c_p\].
    pub speeds: [f64; 2],
}

impl Viewport {
    pub fn new(case: &Case) -> Self {
        let sizes = &case.sizes;
        let shape = case.shape();
        let end_time = sizes.steps as f64 * sizes.dt;
        let reach = sizes.contact_reach;
        let half_width =
            (reach + case.wave_speed() * end_time).min(sizes.outer_radius).min(case.record.r_max);
        let depth = if sizes.has_back { sizes.depth } else { end_time.min(sizes.depth) };
        // around the near zone of a graded mesh
        let [half_width, depth] = match case.mesh.grading {
            Some(Grading { near: [radius, down], .. }) => {
                [half_width.min(AROUND * radius), depth.min(AROUND * down)]
            }
            None => [half_width, depth],
        };
        // a tenth of the nodes, so that pictures are small beside fields, and not many more than recorded nodes
        let nodes = (half_width / sizes.dr) * (depth / sizes.dz);
        let shown = nodes / (case.record.field_every as f64).powi(2);
        let pixels = (nodes / 10.0).min(shown).clamp(8e3, 4e4);
        let pixel = (half_width * depth / pixels).sqrt();
        let in_view = match case.load {
            Some(_) => f64::INFINITY,
            None => IN_VIEW * case.likely_radius().max(sizes.dr),
        };
        let in_view = [half_width, depth].map(|length| length.min(in_view));
        let in_view = [in_view[0], in_view[1].min(SLENDER * in_view[0])];
        let smaller = in_view[0].min(in_view[1]);
        // of an indenter that gives, as much as of the target, and to scale
        let striker = case.indenter.striker.as_ref();
        let above = striker.map_or(0.0, |striker| {
            let height = |height| depth.min(height + shape.profile(half_width.min(reach)));
            striker.body.thickness.map_or(depth, height)
        });
        let exaggeration = match striker {
            Some(_) => 1.0,
            None => round_down(DEEPEST * smaller / largest_displacement(case)),
        };
        let face = face(&shape, &case.indenter.head, reach.min(half_width), exaggeration);
        let highest = face.iter().map(|point| point[1]).fold(0.0, f64::max);
        let top = highest + 0.4 * reach.min(smaller);
        let edge = face.last().map_or(0.0, |point| point[0]);
        let indenter = match striker {
            Some(striker) => {
                [striker.body.radius.unwrap_or(half_width).min(half_width), above.min(in_view[1]).max(top)]
            }
            None => [edge, top],
        };
        Self {
            half_width,
            depth,
            pixel,
            columns: ((half_width / pixel).ceil() as usize).max(1),
            rows: ((depth / pixel).ceil() as usize).max(1),
            above: (above / pixel).ceil() as usize,
            exaggeration,
            top,
            window: Window::new(in_view, indenter),
            face,
            reach,
            waves: waves(case, &shape),
            thickness: case.target.thickness,
            layers: layers(case),
            world: World { unit: case.units().length },
        }
    }

    /// Radius of the face that is drawn \[R\].
    pub fn edge(&self) -> f64 {
        self.face.last().map_or(0.0, |point| point[0])
    }

    /// Height at which a displacement into the target is drawn.
    pub fn height(&self, displacement: f64) -> f64 {
        -displacement * self.exaggeration
    }

    /// Height of a sheet above the plane of the field \[R\].
    pub fn height_of(&self, sheet: Sheet) -> f64 {
        let [half_width, depth] = self.window.section;
        f64::from(sheet as u8) * SHEET * depth.min(half_width)
    }
}

/// Layers of a target of several: name and depth of the upper face \[R\].
fn layers(case: &Case) -> Vec<(String, f64)> {
    let (grid, layers) = (case.grid(), case.target.computed());
    let named = layers.into_iter().zip(&grid.layers).map(|(layer, rows)| (layer.name, rows.top));
    named.filter(|_| grid.layers.len() > 1).collect()
}

/// Half of the colour range of every picture of a run, the report's included, in the unit of the field in the recording:
/// estimated from the case and rounded up to 1, 1.25, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten.
///
/// *Velocity* is 1.25·V0. *Displacement* is that of the indenter, V0·T under constant velocity, about `V0·T·M/(T + M)` under a
/// mass. *Stress* is `1.25·V0 + p`: a front has V0, plus peaks at tips and edges; behind it the stress rises by p
/// while the indenter moves on,
///
/// ```text
///               driven at V0 to time T     stopped by the stress (energy ½MV0²)
/// layer         V0·2⌊T/2h⌋                 V0·√(m/h)                reflections, a column of stiffness 1/h
/// half-space    V0·T·2c_s/πa               V0·√(m·c_s/πa)           centre of a disc at rest, p(0) = 2c_s·w/πa
/// ```
///
/// with the largest contact radius a and the mass m = M/a² over its area (plane: M/a). p is the smaller of the two
/// columns, and for a layer the larger of the two rows: a thick layer begins as a half-space.
///
/// Values beyond it have the colour of the end. In the built-in cases these are 0 to 0.8 % of the moved part of a section,
/// mostly under edges, where the stress is unbounded.
pub fn range(case: &Case, field: Field) -> f64 {
    let [displacement, velocity, stress] = match &case.load {
        Some(load) => of_load(case, load),
        None => {
            let velocity = case.impact.velocity;
            [largest_displacement(case), HEADROOM * velocity, velocity * (HEADROOM + rise(case))]
        }
    };
    let largest = match field {
        Field::Displacement | Field::DisplacementR => displacement,
        Field::Velocity | Field::VelocityR => velocity,
        Field::Stress
        | Field::StressRr
        | Field::StressTt
        | Field::StressRz
        | Field::Pressure
        | Field::VonMises
        | Field::MaxShear => stress,
        Field::DamageRatio => 1.0,
    };
    round_up(field.unit(&case.units()).of(largest))
}

/// p/V0 of [`range`]; under a ball on a graded mesh the largest pressure by Hertz, `2Ma/(πρ)` with the modulus M of the contact.
fn rise(case: &Case) -> f64 {
    if let (Some(_), Tip::Round(nose_radius)) = (case.mesh.grading, case.indenter.head.tip()) {
        return 2.0 * case.modulus() * case.likely_radius() / (PI * nose_radius * case.impact.velocity);
    }
    let end_time = case.sizes.steps as f64 * case.sizes.dt;
    let reach = case.sizes.contact_reach.max(case.sizes.dr);
    let area = match case.geometry {
        Geometry::Axisymmetric => reach * reach,
        Geometry::Plane => reach,
    };
    let mass = case.indenter.mass / area;
    // stiffness of the centre of a disc
    let stiffness = 2.0 * case.target.material.shear_wave_speed / (PI * reach);
    let half_space = (stiffness * end_time).min((0.5 * stiffness * mass).sqrt());
    let layer = case.target.thickness.map_or(0.0, |thickness| {
        (2.0 * (end_time / (2.0 * thickness)).floor()).min((mass / thickness).sqrt())
    });
    half_space.max(layer)
}

/// Displacement, velocity and stress by a load of force F at a distance x from it, its radius or a tenth of the picture, by Boussinesq: stress
/// `3F/2x²`, velocity as in a wave of that stress, displacement `F/2µx`.
fn of_load(case: &Case, load: &Load) -> [f64; 3] {
    let Sizes { outer_radius, .. } = case.sizes;
    let width =
        case.mesh.grading.map_or(outer_radius.min(case.record.r_max), |grading| AROUND * grading.near[0]);
    let x = load.radius.unwrap_or_default().max(0.1 * width);
    let (force, c_s) = (load.force.largest(), case.target.material.shear_wave_speed);
    let stress = 1.5 * force / (x * x);
    [force / (2.0 * c_s * c_s * x), stress, stress]
}

fn largest_displacement(case: &Case) -> f64 {
    if let Some(load) = &case.load {
        return of_load(case, load)[0];
    }
    let end_time = case.sizes.steps as f64 * case.sizes.dt;
    // T·M/(T + M), finite for an infinite mass
    case.impact.velocity * end_time / (1.0 + end_time / case.indenter.mass)
}

/// Numbers of these digits from 1e-15 to 1e15 and beyond, in their order.
fn round_numbers<const N: usize>(digits: [&str; N]) -> impl Iterator<Item = f64> {
    (-15..=15)
        .flat_map(move |decade| digits.map(|digits| format!("{digits}e{decade}").parse().expect("a number")))
}

/// The largest of 1, 2, 5, 10, 20, … that is not above `x`, decades down to 1e-15 too.
pub fn round_down(x: f64) -> f64 {
    round_numbers(["1", "2", "5"]).take_while(|step| *step <= x).last().unwrap_or(1e-15)
}

/// The smallest round number that is not below `x`, up to rounding.
fn round_up(x: f64) -> f64 {
    let mut numbers = round_numbers(["1", "1.25", "1.5", "2", "2.5", "3", "4", "5", "6", "8"]);
    numbers.find(|round| *round >= x * (1.0 - 1e-12)).unwrap_or(x)
}

fn face(shape: &Shape, head: &Head, reach: f64, exaggeration: f64) -> Vec<[f64; 2]> {
    if head.is_flat() {
        return vec![[0.0, 0.0], [reach, 0.0]];
    }
    let radius = |part| reach * f64::from(part) / f64::from(HEAD_POINTS);
    (0..=HEAD_POINTS).map(|part| [radius(part), shape.profile(radius(part)) * exaggeration]).collect()
}

/// Waves of the edge: in the simplified theory one, with c_s along r and c_p along z, in the full theory P and S waves.
fn waves(case: &Case, shape: &Shape) -> Vec<EdgeWave> {
    let c_s = case.target.material.shear_wave_speed;
    // in other materials fronts are no circles
    if !case.target.layers[0].stiffness.is_isotropic() {
        return Vec::new();
    }
    let speeds = case.model.waves(1.0, c_s).into_iter();
    speeds.filter_map(|speeds| edge_wave(case, shape, speeds)).collect()
}

/// Waves from the first step on at which the contact spreads no faster than they do; `None` if it outruns them to the end.
fn edge_wave(case: &Case, shape: &Shape, speeds: [f64; 2]) -> Option<EdgeWave> {
    const SAMPLES: u64 = 10_000;
    let &Sizes { dt, steps, .. } = &case.sizes;
    let samples = steps.min(SAMPLES);
    let time = |sample: u64| sample as f64 / samples as f64 * steps as f64 * dt;
    let reach = |sample| shape.reach(case.impact.velocity * time(sample));
    let slow =
        |sample: &u64| reach(sample + 1) - reach(*sample) <= speeds[0] * (time(sample + 1) - time(*sample));
    (0..samples).find(slow).map(|sample| EdgeWave { r: reach(sample), time: time(sample), speeds })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn viewport(name: &str) -> (Case, Viewport) {
        let case = Case::sound(name, &[]);
        let viewport = Viewport::new(&case);
        (case, viewport)
    }

    #[test]
    fn scales_are_round() {
        for (x, round) in [(0.03, 0.02), (0.05, 0.05), (1.0, 1.0), (999.0, 500.0)] {
            assert_eq!(round_down(x), round);
        }
        for (x, round) in
            [(0.125, 0.125), (1.25 * 0.1, 0.125), (1.0, 1.0), (7.25, 8.0), (8.1, 10.0), (2e-4, 2e-4)]
        {
            assert_eq!(round_up(x), round);
        }
    }

    #[test]
    fn ranges_follow_from_the_case() {
        let range = |name: &str, change: &str| {
            let case = Case::sound(name, &[change]);
            [Field::Stress, Field::Velocity, Field::Displacement].map(|field| range(&case, field))
        };
        // a layer: 1.25 + 2⌊6/2⌋; before the first reflection, 1.25 + 2·0.5·1.5/π
        assert_eq!(range("fig5", "mesh.cells=20"), [8.0, 1.25, 6.0]);
        assert_eq!(range("fig5", "run.end_time=1.5"), [2.0, 1.25, 1.5]);
        // a mass of 4 is stopped by a stress of √4
        assert_eq!(range("fig5", "indenter.mass=4.0")[0], 4.0);
        // a half-space: 1.25 + 2·0.5·10/π, and 1.25 + √(0.5·1/π) for a mass of 1
        assert_eq!(range("fig9-minf", "mesh.cells=20")[0], 5.0);
        assert_eq!(range("fig9-m1", "mesh.cells=20")[0], 2.0);
        // a cone that spreads: 1.25 + 2·0.5·4/8π
        assert_eq!(range("fig6a", "mesh.cells=20")[0], 1.5);
        assert_eq!(range("fig5", "impact.velocity=0.001")[0], 0.008);
    }

    #[test]
    fn sheets_over_the_field_lie_above_it() {
        let (_, viewport) = viewport("fig5");
        let sheets = [
            Sheet::Field,
            Sheet::Fronts,
            Sheet::Backing,
            Sheet::Body,
            Sheet::Outline,
            Sheet::Surface,
            Sheet::Marks,
        ];
        let heights = sheets.map(|sheet| viewport.height_of(sheet));
        assert_eq!(heights[0], 0.0);
        assert!(heights.windows(2).all(|pair| pair[1] - pair[0] > 0.005), "{heights:?}");
    }

    #[test]
    fn viewers_open_with_the_contact_and_both_bodies() {
        let windows = ["fig5", "fig9-minf", "ball", "laminate-glass", "coating", "coating-soft", "bar"]
            .map(|name| (name, viewport(name)));
        let elastic = Case::sound("ball", &["indenter.body=elastic"]);
        let elastic = Viewport::new(&elastic);
        for (name, (case, viewport)) in &windows {
            let Window { half_width, height, section, .. } = viewport.window;
            let radius = case.likely_radius();
            assert!(radius > 0.01 * height && radius < section[0] * 1.001, "{name}: {radius} of {height}");
            assert!(2.0 * half_width <= 1.001 * ASPECT * height, "{name}");
        }
        // the coating is seen, at a displacement that is not drawn beyond the window
        let (case, coating) = &windows[4].1;
        assert!(coating.layers[1].1 > 0.04 * coating.window.section[1]);
        assert!(coating.exaggeration * largest_displacement(case) < 0.2 * coating.window.height);
        for striker in [&windows[6].1.1, &elastic] {
            let Window { height, middle, section, ceiling, .. } = striker.window;
            assert!(striker.above as f64 * striker.pixel > 0.5 * section[1], "both bodies");
            assert!(middle + 0.5 * height > ceiling && middle - 0.5 * height < -section[1]);
        }
    }

    #[test]
    fn a_flat_punch_has_its_edge_at_once() {
        let (_, viewport) = viewport("fig5");
        assert_eq!(viewport.waves, [EdgeWave { r: 1.0, time: 0.0, speeds: [0.5, 1.0] }]);
        assert_eq!(viewport.face, [[0.0, 0.0], [1.0, 0.0]]);
        // w = 6 at the end of the run, drawn no deeper than a fifth of the layer
        assert_eq!(viewport.exaggeration, 0.02);
        assert!(2.0 * viewport.half_width / viewport.pixel < 800.0);
    }

    #[test]
    fn edge_of_a_paraboloid_is_where_it_slows_down_to_c_s() {
        let (case, viewport) = viewport("fig2");
        // r*² = k·t: dr*/dt = c_s at t = k/(4 c_s²), r = k/(2 c_s)
        let Head::Paraboloid { nose_radius } = case.indenter.head else { panic!("a paraboloid") };
        let k = 2.0 * nose_radius * case.impact.velocity;
        let c_s = case.target.material.shear_wave_speed;
        let edge = *viewport.waves.first().expect("it slows down");
        let step = case.sizes.steps as f64 * case.sizes.dt / 1e4;
        assert!((edge.time - k / (4.0 * c_s * c_s)).abs() < 2.0 * case.sizes.dt.max(step), "{edge:?}");
        assert!((edge.r - k / (2.0 * c_s)).abs() < 0.02, "{edge:?}");
    }

    #[test]
    fn a_fast_cone_has_no_edge() {
        assert_eq!(viewport("fig6a").1.waves, []);
        // with a radius it has one, at the cylinder
        let edge = *viewport("fig6c").1.waves.first().expect("an edge");
        assert!((edge.r - 1.0).abs() < 0.02 && (edge.time - 0.5).abs() < 0.02, "{edge:?}");
    }
}
