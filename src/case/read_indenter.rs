//! The `[indenter]` section: shapes, masses, and contact rules that only some shapes allow.

use std::path::Path;

use serde::Deserialize;
use toml::Value;

use super::{
    Body,
    bounds::{Bounds, HUGE, TINY},
    document::{Given, Section, Span, span_of, value},
    read_mass::{GivenBody, read_length, read_substance},
    read_profile::GivenProfile,
    system::System,
};
use crate::{contact::Rule, geometry::Geometry, shape::Head, units::Dimension};

/// Name of a shape in a case file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ShapeName {
    Flat,
    Paraboloid,
    Sphere,
    Cone,
    Profile,
}

impl ShapeName {
    /// The name.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

/// What reading an indenter needs beside its section.
pub(super) struct IndenterParts<'a> {
    /// Folder of relative paths.
    pub folder: &'a Path,
    /// Symmetry.
    pub geometry: Geometry,
    /// System of the numbers.
    pub system: &'a System,
    /// V0, or its default; `None` if it is missing or refused \[c_p\].
    pub velocity: Option<f64>,
    /// Contact rule, if it is given.
    pub contact: Option<&'a Given<Rule>>,
}

/// The keys of the head.
struct GivenHead {
    radius: Option<Given<f64>>,
    edge_radius: Option<Given<f64>>,
    nose_radius: Option<Given<f64>>,
    slope: Option<Given<f64>>,
    half_angle: Option<Given<f64>>,
    file: Option<Given<String>>,
    points: Option<Given<Vec<[f64; 2]>>>,
}

impl GivenHead {
    fn read(section: &mut Section<'_>, system: &System) -> Self {
        let size = Bounds::within(TINY, HUGE);
        let mut length = |key, bounds| section.quantity(key, Dimension::Length, bounds, system);
        Self {
            radius: length("radius", size),
            edge_radius: length("edge_radius", Bounds::within(0.0, HUGE)),
            nose_radius: length("nose_radius", size),
            slope: section.number("slope", size),
            half_angle: section.number("half_angle", Bounds::between(0.0, 90.0)),
            file: section.get("file", "the path of a CSV file with columns r, f"),
            points: section.places("points", "points", Bounds::within(0.0, HUGE), system),
        }
    }
}

/// Reads the section.
pub(super) fn read_indenter(mut section: Section<'_>, parts: &IndenterParts<'_>) -> Option<Body> {
    let names = "flat, paraboloid, sphere, cone, profile";
    let shape: Option<Given<ShapeName>> = section.require("shape", names);
    let shape = shape.map(value);
    let given = GivenHead::read(&mut section, parts.system);
    refuse_old_keys(&mut section, shape, parts);
    let has_mass = section.has("mass");
    let has_substance = section.has("density") || section.has("material");
    let mass =
        section.quantity("mass", Dimension::Mass, Bounds::within(TINY, 1e12).or_infinite(), parts.system);
    let (density, material) = read_substance(&mut section, has_mass, parts.system);
    let length = read_length(&mut section, has_mass, has_substance, parts.system);
    check_rule(&section, parts.contact, shape, mass.as_ref(), given.edge_radius.as_ref());
    let radius = given.radius.clone();
    let head = shape.and_then(|shape| given.head(&mut section, shape, parts));
    let mass = mass.map(value).or_else(|| {
        let (radius, length) = (radius.as_ref(), length.as_ref());
        let body = GivenBody { head: head.as_ref()?, radius, length, density: density? };
        let mass = body.mass(&section, parts.geometry, parts.system)?;
        Some(parts.system.default(Dimension::Mass, mass))
    });
    section.end();
    let head = head?;
    let radius = match &head {
        Head::Profile(curve) => Some(radius.map_or(curve.last_radius(), value)),
        Head::Sphere { nose_radius } => Some(radius.map_or(*nose_radius, value)),
        Head::Flat { .. } | Head::Paraboloid { .. } | Head::Cone { .. } => radius.map(value),
    };
    Some(Body { head, radius, mass: mass.unwrap_or(f64::INFINITY), material })
}

/// A key of format 1, which named a shape by how fast its contact spread at V0.
struct OldKey {
    key: &'static str,
    shape: ShapeName,
    /// Key of the shape itself, its dimension if it has one, and how it follows.
    new: (&'static str, Option<Dimension>, &'static str),
    /// The new value from the old one and V0.
    convert: fn(f64, f64) -> f64,
}

const OLD_KEYS: [OldKey; 2] = [
    OldKey {
        key: "curvature",
        shape: ShapeName::Paraboloid,
        new: ("nose_radius", Some(Dimension::Length), "curvature/(2 V0)"),
        convert: |curvature, velocity| curvature / (2.0 * velocity),
    },
    OldKey {
        key: "spread_rate",
        shape: ShapeName::Cone,
        new: ("slope", None, "V0/spread_rate"),
        convert: |rate, velocity| velocity / rate,
    },
];

/// Refuses the keys of format 1.
fn refuse_old_keys(section: &mut Section<'_>, shape: Option<ShapeName>, parts: &IndenterParts<'_>) {
    for old in OLD_KEYS {
        if section.has(old.key) {
            old.refuse(section, shape, parts);
        }
    }
    if section.has("scale") {
        let span = section.get::<Value>("scale", "").map_or(section.span(), |given| given.span);
        let help = "leave it out; a case in SI units has target.material, and every quantity with its unit: \
                    radius = \"10 mm\"";
        section.problem(span, "`indenter.scale` is a key of format 1", help);
    }
}

impl OldKey {
    /// Refuses the key, and names the new one with its value where it is known.
    fn refuse(&self, section: &mut Section<'_>, shape: Option<ShapeName>, parts: &IndenterParts<'_>) {
        let span = section.place(self.key);
        let message =
            format!("`indenter.{}` = {} is a key of format 1", self.key, section.document.written(&span));
        let old = section.get::<Value>(self.key, "").map(|given| given.value);
        let old = old.and_then(|old| old.as_float().or(old.as_integer().map(|old| old as f64)));
        let (name, dimension, formula) = self.new;
        let system = parts.system;
        let write = |x| dimension.map_or(format!("{x:?}"), |dimension| system.quoted(dimension, x));
        let new = old.zip(parts.velocity).map(|(old, velocity)| (self.convert)(old, velocity));
        let new = new.filter(|new| Bounds::within(TINY, HUGE).contain(*new));
        let is_written = dimension.is_none() || system.can_write();
        let help = match (new.filter(|_| is_written), parts.velocity) {
            _ if shape.is_some_and(|shape| shape != self.shape) => {
                format!("leave it out; it belongs to shape = \"{}\"", self.shape.name())
            }
            (Some(new), Some(velocity)) => {
                let velocity = system.quoted(Dimension::Speed, velocity);
                format!("write {name} = {}, the same shape at V0 = {velocity}", write(new))
            }
            _ => format!("write {name} = …, the value of {formula} in units of R and c_p"),
        };
        // what is missing because of it is no problem of its own
        section.mark_refused(name);
        section.problem(span, message, help);
    }
}

impl GivenHead {
    /// The head of a shape, or the problems with it.
    fn head(self, section: &mut Section<'_>, shape: ShapeName, parts: &IndenterParts<'_>) -> Option<Head> {
        self.check_keys(section, shape);
        match shape {
            ShapeName::Flat => {
                section.need("radius", self.radius.is_some(), "a flat punch has a radius");
                let (radius, edge) = (self.radius?.value, self.edge_radius.as_ref());
                if let Some(edge) = edge.filter(|edge| edge.value > radius) {
                    let message = format!(
                        "`indenter.edge_radius` = {} is larger than indenter.radius",
                        section.document.written(&edge.span)
                    );
                    let radius = parts.system.quoted(Dimension::Length, radius);
                    section.problem(
                        edge.span.clone(),
                        message,
                        format!("allowed: at most {radius}, the radius"),
                    );
                }
                Some(Head::Flat { edge_radius: self.edge_radius.map_or(0.0, value) })
            }
            ShapeName::Paraboloid => {
                let meaning = "radius of curvature ρ at the tip, f = r²/(2ρ)";
                section.need("nose_radius", self.nose_radius.is_some(), meaning);
                self.nose_radius.map(|rho| Head::Paraboloid { nose_radius: rho.value })
            }
            ShapeName::Sphere => self.sphere(section, parts.system),
            ShapeName::Cone => self.cone(section),
            ShapeName::Profile => {
                let given = GivenProfile { radius: self.radius, file: self.file, points: self.points };
                given.head(section, parts.folder, parts.system)
            }
        }
    }

    /// Keys of other shapes.
    fn check_keys(&self, section: &Section<'_>, shape: ShapeName) {
        use ShapeName::{Cone, Flat, Paraboloid, Profile, Sphere};
        let only = |key: &str, span: Option<Span>, owners: &[ShapeName]| {
            let Some(span) = span.filter(|_| !owners.contains(&shape)) else { return };
            let names: Vec<String> = owners.iter().map(|owner| format!("\"{}\"", owner.name())).collect();
            let names = names.join(" or ");
            let message = format!("`indenter.{key}` belongs to shape = {names}, not to \"{}\"", shape.name());
            section.problem(span, message, format!("remove it, or set indenter.shape = {names}"));
        };
        only("edge_radius", span_of(&self.edge_radius), &[Flat]);
        only("nose_radius", span_of(&self.nose_radius), &[Paraboloid, Sphere]);
        only("slope", span_of(&self.slope), &[Cone]);
        only("half_angle", span_of(&self.half_angle), &[Cone]);
        only("file", span_of(&self.file), &[Profile]);
        only("points", span_of(&self.points), &[Profile]);
    }

    fn sphere(self, section: &Section<'_>, system: &System) -> Option<Head> {
        section.need("nose_radius", self.nose_radius.is_some(), "radius ρ of the sphere");
        let nose_radius = self.nose_radius?.value;
        if let Some(radius) = self.radius.filter(|radius| radius.value > nose_radius) {
            let given = section.document.written(&radius.span);
            let message = format!("`indenter.radius` = {given} is larger than indenter.nose_radius");
            let rho = system.quoted(Dimension::Length, nose_radius);
            let help = format!("allowed: at most {rho}, or leave it out for the whole sphere");
            section.problem(radius.span, message, help);
            return None;
        }
        Some(Head::Sphere { nose_radius })
    }

    fn cone(self, section: &mut Section<'_>) -> Option<Head> {
        let slope = match (self.slope, self.half_angle) {
            (Some(_), Some(angle)) => {
                let message = "`indenter.slope` and `indenter.half_angle` are both given";
                section.problem(angle.span, message, "keep one of them, as each gives the other");
                return None;
            }
            (Some(slope), None) => slope.value,
            // s = cot of the angle between axis and flank
            (None, Some(Given { value, span })) => {
                let slope = 1.0 / libm::tan(value.to_radians());
                if !Bounds::within(TINY, HUGE).contain(slope) {
                    let message = format!("`indenter.half_angle` = {value:?} is not possible");
                    return section.refuse(
                        "half_angle",
                        span,
                        message,
                        "degrees from the axis, so that the slope, its cotangent, is from 1e-6 to 1e6",
                    );
                }
                slope
            }
            (None, None) => {
                let is_refused = section.is_refused("half_angle");
                section.need(
                    "slope",
                    is_refused,
                    "the number df/dr; or half_angle, in degrees from the axis",
                );
                return None;
            }
        };
        Some(Head::Cone { slope })
    }
}

/// Contact rules that only some indenters allow.
fn check_rule(
    section: &Section<'_>,
    contact: Option<&Given<Rule>>,
    shape: Option<ShapeName>,
    mass: Option<&Given<f64>>,
    edge_radius: Option<&Given<f64>>,
) {
    let Some(contact) = contact else { return };
    let has_corner = edge_radius.is_some_and(|edge| edge.value > 0.0);
    if contact.value == Rule::Bilateral && (has_corner || shape.is_some_and(|shape| shape != ShapeName::Flat))
    {
        let message = "`impact.contact` = \"bilateral\" glues a fixed zone and needs shape = \"flat\" with a sharp edge";
        let help = "use contact = \"unilateral\" for heads that touch gradually";
        section.problem(contact.span.clone(), message, help);
    }
    if let Some(mass) = mass.filter(|mass| mass.value.is_finite() && contact.value == Rule::Prescribed) {
        let given = section.document.written(&mass.span);
        let message = format!("`indenter.mass` = {given}, but contact = \"prescribed\" gives the motion");
        section.problem(mass.span.clone(), message, "set mass = inf, or another contact rule");
    }
}
