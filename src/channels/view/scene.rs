//! `/view/scene`: indenter, deformed surface, drag and contact radius, and the colours of the field, for the 3D panels of viewers.

use std::sync::Arc;

use percuss_canvas::DIVERGING;

use super::{
    INDENTER, Sheet, Viewport, WORLD, entity,
    viewport::{Window, range},
    world::World,
};
use crate::{
    case::Case,
    channels::{Channel, FieldNote, Outlet, Rate},
    geometry::Geometry,
    message::foxglove::{
        ArrowPrimitive, Color, LinePrimitive, Point3, Pose, Quaternion, SceneEntity, SceneUpdate,
        TextPrimitive, TriangleListPrimitive, line_primitive,
    },
    model::Field,
    units::Units,
    view::View,
};

/// Largest number of points on one side of the surface.
const SURFACE_POINTS: f64 = 100.0;

struct Scene {
    viewport: Arc<Viewport>,
    /// Length of the arrow per unit of drag, dimensionless.
    drag_scale: f64,
    units: Units,
    /// Shown nodes of the surface, and every how many of them.
    nodes: usize,
    every: usize,
    /// Outline and filling of a rigid indenter, the same in all frames.
    body: Option<(LinePrimitive, TriangleListPrimitive)>,
    /// Nodes of the face of one that gives, with their places on it before the impact.
    face: Vec<(usize, [f64; 2])>,
    backing: Option<LinePrimitive>,
    /// Interfaces between layers, and names of the layers.
    layers: (Vec<LinePrimitive>, Vec<TextPrimitive>),
    /// The colours of the field and their values, where a field is shown.
    colours: Option<SceneEntity>,
}

pub fn channel(case: &Case, viewport: &Arc<Viewport>) -> Channel {
    let Units { length, force, .. } = case.units();
    let note = FieldNote::new(
        "entities",
        length.name,
        "indenter, deformed surface, backing, interfaces between layers with their names, contact radius, drag, colours of the field; x = r, y up, displacements times exaggeration, z only for what covers what",
    );
    let scene = Scene::new(case, viewport);
    let per_drag = length.of(scene.drag_scale) / force.scale;
    Channel::new("/view/scene", "foxglove.SceneUpdate", vec![note], move |view, outlet| {
        if view.frame.is_some() {
            outlet.put(&SceneUpdate { deletions: Vec::new(), entities: scene.entities(view, outlet) });
        }
    })
    .emits(Rate::Frame(6 << 10))
    .remark("exaggeration", viewport.exaggeration.to_string())
    .remark("arrow_length_per_drag", per_drag.to_string())
}

impl Scene {
    fn new(case: &Case, viewport: &Arc<Viewport>) -> Self {
        let nodes = case.column(viewport.half_width).floor();
        // the largest stress of the colour range on all of the contact is an arrow of half the section in view
        let reach = viewport.reach.min(viewport.half_width);
        let area = match case.geometry {
            Geometry::Axisymmetric => reach * reach,
            Geometry::Plane => reach,
        };
        let [half_width, depth] = viewport.window.section;
        let full = 0.5 * depth.min(half_width);
        let units = case.units();
        let largest = range(case, Field::Stress) / units.stress.scale;
        let world = viewport.world;
        let across = |depth: f64| {
            let ends = [-viewport.half_width, viewport.half_width].map(|x| world.point(x, -depth));
            world.line(ends.to_vec(), viewport.height_of(Sheet::Backing), World::OUTLINE)
        };
        let shown = viewport.layers.iter().skip(1).filter(|(_, top)| *top < viewport.depth);
        let interfaces = shown.map(|(_, top)| LinePrimitive { thickness: 1.0, ..across(*top) });
        let (leaders, names) = names(viewport);
        let layers = (interfaces.chain(leaders).collect(), names);
        let every = ((nodes / SURFACE_POINTS).ceil() as usize).max(1);
        let gives = case.indenter.striker.is_some();
        let face = if gives { face(case, viewport.edge(), every) } else { Vec::new() };
        Self {
            drag_scale: full / (largest * area),
            units,
            nodes: nodes as usize,
            every,
            body: (case.load.is_none() && !gives).then(|| body(viewport)),
            face,
            backing: viewport.thickness.map(across),
            layers,
            colours: case.record.fields.first().map(|field| colour_bar(case, *field, viewport)),
            viewport: Arc::clone(viewport),
        }
    }

    fn surface(&self, view: &View<'_>) -> Vec<Point3> {
        let displacement = view.frame.as_ref().map_or(&[][..], |frame| &frame.fields.surface);
        let moved = self.nodes.min(displacement.len());
        let radius = |i: usize| view.interface.r(i);
        let node = |i: usize| (radius(i), self.viewport.height(displacement[i]));
        let mut right: Vec<(f64, f64)> = (0..moved).step_by(self.every).map(node).collect();
        // the rest is level: its two ends suffice
        let rest = radius(moved);
        if rest < self.viewport.half_width {
            right.extend([(rest, 0.0), (self.viewport.half_width, 0.0)]);
        }
        self.mirrored(&right)
    }

    fn face(&self, view: &View<'_>) -> Vec<Point3> {
        let moved = |(node, [x, y]): &(usize, [f64; 2])| (*x, y + self.viewport.height(view.face(*node)));
        self.mirrored(&self.face.iter().map(moved).collect::<Vec<_>>())
    }

    /// A line from the axis to the right, with that to the left.
    fn mirrored(&self, right: &[(f64, f64)]) -> Vec<Point3> {
        let left = right.iter().rev().map(|(x, y)| (-x, *y));
        left.chain(right.iter().copied()).map(|(x, y)| self.viewport.world.rounded(x, y)).collect()
    }

    fn entities(&self, view: &View<'_>, outlet: &Outlet<'_>) -> Vec<SceneEntity> {
        let viewport = &self.viewport;
        let world = viewport.world;
        let new = |id: &str, frame: &str| entity(id, frame, outlet);
        let lines = |lines: Vec<LinePrimitive>, entity: SceneEntity| SceneEntity { lines, ..entity };
        let mut entities = vec![lines(
            vec![world.line(self.surface(view), viewport.height_of(Sheet::Surface), World::SURFACE)],
            new("surface", WORLD),
        )];
        if let Some((outline, filling)) = &self.body {
            entities.push(SceneEntity {
                lines: vec![outline.clone()],
                triangles: vec![filling.clone()],
                ..new("indenter", INDENTER)
            });
        }
        if !self.face.is_empty() {
            // its field shows the body
            let line = world.line(self.face(view), viewport.height_of(Sheet::Outline), World::OUTLINE);
            entities.push(lines(vec![line], new("indenter", WORLD)));
        }
        if let Some(backing) = &self.backing {
            entities.push(lines(vec![backing.clone()], new("backing", WORLD)));
        }
        if !self.layers.1.is_empty() {
            let (lines, texts) = self.layers.clone();
            entities.push(SceneEntity { lines, texts, ..new("layers", WORLD) });
        }
        if let Some(colours) = &self.colours {
            let (triangles, texts) = (colours.triangles.clone(), colours.texts.clone());
            entities.push(SceneEntity { triangles, texts, ..new("colours", WORLD) });
        }
        let tick = 0.05 * viewport.window.section[1];
        let foot = viewport.height(view.face(0));
        let contact = [-1.0, 1.0].map(|side| side * view.contact_radius);
        let points =
            contact.iter().flat_map(|x| [world.rounded(*x, foot), world.rounded(*x, foot - tick)]).collect();
        entities.push(lines(
            vec![LinePrimitive {
                r#type: line_primitive::Type::LineList.into(),
                ..world.line(points, viewport.height_of(Sheet::Marks), World::CONTACT)
            }],
            new("contact", WORLD),
        ));
        let tail = foot + viewport.top;
        let marks = viewport.height_of(Sheet::Marks);
        let [time, drag] = [(self.units.time, view.time), (self.units.force, view.drag)]
            .map(|(unit, x)| unit.text_with_unit(3, x));
        let Window { half_width, height, ceiling, .. } = viewport.window;
        // a long text: above the indenter
        let [x, y] = [0.65 * half_width, ceiling + 0.05 * height];
        entities.push(SceneEntity {
            arrows: arrow(world, (tail, marks), self.drag_scale * view.drag, tick),
            texts: vec![label(format!("t = {time}   F = {drag}"), world.at(-x, y, marks))],
            ..new("drag", WORLD)
        });
        entities
    }
}

/// Every so many nodes of the face of an indenter, from the axis out to its edge, and their places before the impact.
fn face(case: &Case, edge: f64, every: usize) -> Vec<(usize, [f64; 2])> {
    let (grid, shape) = (case.grid(), case.shape());
    let nodes = (0..grid.nr()).step_by(every).map(|i| (i, grid.r(i))).take_while(|(_, r)| *r < edge);
    let mut face: Vec<_> = nodes.map(|(i, r)| (i, [r, shape.profile(r)])).collect();
    let last = face.last().map_or(0, |(i, _)| *i);
    face.push((last, [edge, shape.profile(edge)]));
    face
}

/// Outline and filling of a rigid indenter in its own frame.
fn body(viewport: &Viewport) -> (LinePrimitive, TriangleListPrimitive) {
    let world = viewport.world;
    let point = |x, y| world.point(x, y);
    let mirror = |[x, y]: [f64; 2]| [-x, y];
    let face: Vec<[f64; 2]> =
        viewport.face.iter().skip(1).rev().map(|p| mirror(*p)).chain(viewport.face.iter().copied()).collect();
    let edge = viewport.edge();
    let mut outline: Vec<Point3> = face.iter().map(|[x, y]| point(*x, *y)).collect();
    outline.extend([point(edge, viewport.top), point(-edge, viewport.top)]);
    let corners = |pair: &[[f64; 2]]| {
        let ([a, b], [c, d]) = (pair[0], pair[1]);
        let top = viewport.top;
        [point(a, b), point(c, d), point(c, top), point(a, b), point(c, top), point(a, top)]
    };
    let outline = LinePrimitive {
        r#type: line_primitive::Type::LineLoop.into(),
        ..world.line(outline, viewport.height_of(Sheet::Outline), World::OUTLINE)
    };
    let filling = TriangleListPrimitive {
        pose: Some(world.at(0.0, 0.0, viewport.height_of(Sheet::Body))),
        points: face.windows(2).flat_map(corners).collect(),
        color: Some(World::BODY),
        ..TriangleListPrimitive::default()
    };
    (outline, filling)
}

/// Names of layers on the right, each with a line to its layer if that is too thin for it.
fn names(viewport: &Viewport) -> (Vec<LinePrimitive>, Vec<TextPrimitive>) {
    let Window { half_width, height, section, .. } = viewport.window;
    // beside a narrow section
    let middle =
        if section[0] < 0.5 * half_width { section[0] + 0.2 * half_width } else { 0.85 * section[0] };
    let (world, marks) = (viewport.world, viewport.height_of(Sheet::Marks));
    let faces: Vec<f64> = viewport.layers.iter().map(|(_, top)| *top).collect();
    let pitch = 0.06 * height;
    let (mut leaders, mut names) = (Vec::new(), Vec::new());
    for (i, at) in spread(&faces, section[1], pitch) {
        let lower = faces.get(i + 1).map_or(section[1], |next| next.min(section[1]));
        if lower - faces[i] < pitch {
            let [near, far] = [0.11, 0.17].map(|back| middle - back * half_width);
            let line = vec![world.point(far, -0.5 * (faces[i] + lower)), world.point(near, -at)];
            leaders.push(LinePrimitive { thickness: 1.0, ..world.line(line, marks, World::OUTLINE) });
        }
        names.push(label(viewport.layers[i].0.clone(), world.at(middle, -at, marks)));
    }
    (leaders, names)
}

/// A place beside the indenter, or above it where it is too wide: the middle of what is written there.
fn beside(window: &Window) -> [f64; 2] {
    let height = if window.indenter < 0.33 * window.half_width {
        (0.5 * window.ceiling).max(0.05 * window.height)
    } else {
        window.ceiling + 0.03 * window.height
    };
    [0.65 * window.half_width, height]
}

/// The colours of a field from the lowest level to the highest, with their values.
fn colour_bar(case: &Case, field: Field, viewport: &Viewport) -> SceneEntity {
    let world = viewport.world;
    let ([middle, y], marks) = (beside(&viewport.window), viewport.height_of(Sheet::Marks));
    let (half, height) = (0.11 * viewport.window.half_width, 0.03 * viewport.window.height);
    // colours are linear between these
    let shares: Vec<f64> =
        (0..DIVERGING.len()).map(|i| 2.0 * i as f64 / (DIVERGING.len() - 1) as f64 - 1.0).collect();
    let (mut points, mut colors) = (Vec::new(), Vec::new());
    for (pair, shades) in shares.windows(2).zip(DIVERGING.windows(2)) {
        let corner = |i: usize, up: f64| (world.point(middle + half * pair[i], y + up * height), shades[i]);
        for (point, [red, green, blue]) in
            [corner(0, 0.0), corner(1, 0.0), corner(1, 1.0), corner(0, 0.0), corner(1, 1.0), corner(0, 1.0)]
        {
            points.push(point);
            let [red, green, blue] = [red, green, blue].map(|part| f64::from(part) / 255.0);
            colors.push(World::opaque(red, green, blue));
        }
    }
    let unit = field.unit(&case.units());
    let end = range(case, field) / unit.scale;
    // the values at its ends, the name above it
    let text = |share: f64, up: f64, text: String| {
        label(text, world.at(middle + half * share, y + up * height, marks))
    };
    let name = field.name().replace('_', " ");
    SceneEntity {
        triangles: vec![TriangleListPrimitive {
            pose: Some(world.at(0.0, 0.0, marks)),
            points,
            colors,
            ..TriangleListPrimitive::default()
        }],
        texts: vec![
            text(-2.2, 0.5, unit.short_with_unit(-end)),
            text(0.0, 2.6, name),
            text(2.2, 0.5, unit.short_with_unit(end)),
        ],
        ..SceneEntity::default()
    }
}

/// The drag: up from the indenter where the target pushes, down where it pulls, no arrow without drag.
fn arrow(world: World, (tail, z): (f64, f64), length: f64, width: f64) -> Vec<ArrowPrimitive> {
    if !length.is_finite() || length.abs() < 1e-3 * width {
        return Vec::new();
    }
    let head = length.abs().min(1.5 * width);
    // arrows point along x: a quarter turn about z
    let half = 0.5_f64.sqrt();
    let turn = Quaternion { x: 0.0, y: 0.0, z: half * length.signum(), w: half };
    vec![ArrowPrimitive {
        pose: Some(world.turned(0.0, tail, z, turn)),
        shaft_length: world.length(length.abs() - head),
        shaft_diameter: world.length(0.5 * width),
        head_length: world.length(head),
        head_diameter: world.length(width),
        color: Some(World::DRAG),
    }]
}

fn label(text: String, pose: Pose) -> TextPrimitive {
    TextPrimitive {
        pose: Some(pose),
        billboard: true,
        font_size: 14.0,
        scale_invariant: true,
        color: Some(Color { a: 1.0, ..Color::default() }),
        text,
    }
}

/// Heights of names, each in the middle of its layer where there is room, and beside it otherwise; of more layers than there is room
/// for, every second one or fewer: pairs of the number of a layer and the depth of its name.
///
/// * `faces`: depths of the upper faces of the layers, from the surface down
/// * `depth`: the lower end of the picture
/// * `pitch`: least distance of names
pub fn spread(faces: &[f64], depth: f64, pitch: f64) -> Vec<(usize, f64)> {
    let shown = faces.partition_point(|face| *face < depth);
    let room = ((depth / pitch) as usize).max(1);
    let every = shown.div_ceil(room).max(1);
    let middle = |i: usize| 0.5 * (faces[i] + faces.get(i + 1).map_or(depth, |next| next.min(depth)));
    let mut names: Vec<(usize, f64)> = (0..shown).step_by(every).map(|i| (i, middle(i))).collect();
    // down, then up again from the lower end
    let mut least = 0.5 * pitch;
    for (_, at) in &mut names {
        *at = at.max(least);
        least = *at + pitch;
    }
    let mut most = depth - 0.5 * pitch;
    for (_, at) in names.iter_mut().rev() {
        *at = at.min(most);
        most = *at - pitch;
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_their_distance() {
        // thick layers: in their middles
        assert_eq!(spread(&[0.0, 4.0], 10.0, 1.0), [(0, 2.0), (1, 7.0)]);
        // a coating on a half-space, two of them, and one above the lower end
        assert_eq!(spread(&[0.0, 0.1], 10.0, 1.0), [(0, 0.5), (1, 5.05)]);
        assert_eq!(spread(&[0.0, 0.1, 0.2], 10.0, 1.0), [(0, 0.5), (1, 1.5), (2, 5.1)]);
        assert_eq!(spread(&[0.0, 9.8, 9.9], 10.0, 1.0), [(0, 4.9), (1, 8.5), (2, 9.5)]);
        // below the picture; more than there is room for
        assert_eq!(spread(&[0.0, 4.0, 11.0], 10.0, 1.0), [(0, 2.0), (1, 7.0)]);
        let plies: Vec<f64> = (0..20).map(f64::from).collect();
        let names = spread(&plies, 20.0, 3.0);
        assert!(names.len() == 5 && names.windows(2).all(|pair| pair[1].1 - pair[0].1 > 2.999), "{names:?}");
    }
}
