//! The indenter: its head and mass, and the contact rules that only some indenters allow.

use std::{f64::consts::PI, path::Path};

use super::{
    Body, Stop,
    keys::BODY,
    numbers::{Bounds, HUGE, TINY},
    profile,
    values::Values,
};
use crate::{
    contact::Rule,
    geometry::Geometry,
    material::Preset,
    shape::{Head, Shape},
    units::Dimension,
};

pub(super) fn indenter(values: &mut Values<'_>, folder: &Path) -> Option<Body> {
    check_rule(values);
    if let Some(diameter) = values.take("indenter.diameter") {
        let key = if values.shape.as_deref() == Some("sphere") { "nose_radius" } else { "radius" };
        values.set(&format!("indenter.{key}"), 0.5 * diameter);
    }
    let radius = values.number("indenter.radius");
    let head = head(values, radius, folder);
    let material = values.get::<String>("indenter.material").and_then(|name| Preset::find(&name));
    let density = match material {
        Some(preset) if !values.is_given("indenter.mass") => {
            let scales = values.system.scales;
            Some(scales.map_or(preset.density, |scales| scales.reduce(Dimension::Density, preset.density)))
        }
        _ => values.number("indenter.density"),
    };
    let of_mass = ["mass", "density", "material", "length"].map(|key| format!("indenter.{key}"));
    if !of_mass[..3].iter().any(|key| values.is_given(key)) {
        let help = "add indenter.density or indenter.material, or give indenter.mass instead";
        values.unwanted("indenter.length", " is given, but not what the body is made of", help);
    }
    let head = head?;
    if let Some(density) = density {
        let mass = mass(values, &head, radius, density)?;
        values.set("indenter.mass", values.system.default(Dimension::Mass, mass));
    }
    let radius = Some(Shape::new(head.clone(), radius).radius()).filter(|radius| radius.is_finite());
    // the radius of a profile is its last point, and would be the unit of length if it were written
    if let Some(radius) = radius.filter(|_| !values.checked.contains_key("length_unit")) {
        values.set("indenter.radius", radius);
    }
    if values.is_table(BODY.path) {
        let what = " is given, but the layers of its body have a mass";
        let given = of_mass.iter().find(|key| values.is_given(key));
        given.into_iter().for_each(|key| values.unwanted(key, what, "leave it out"));
    }
    Some(Body { head, radius, mass: values.number("indenter.mass")?, material, striker: None })
}

fn head(values: &mut Values<'_>, radius: Option<f64>, folder: &Path) -> Option<Head> {
    let nose_radius = values.number("indenter.nose_radius");
    match values.shape.as_deref()? {
        "flat" => {
            if !values.is_given("indenter.diameter") {
                values.need("indenter.radius", "a flat punch has a radius");
            }
            let edge_radius = values.number("indenter.edge_radius")?;
            if edge_radius > radius? {
                let radius = values.system.written(Dimension::Length, radius?);
                let help = format!("allowed: at most {radius}, the radius");
                values.refuse("indenter.edge_radius", " is larger than indenter.radius", &help);
            }
            Some(Head::Flat { edge_radius })
        }
        "paraboloid" => {
            values.need("indenter.nose_radius", "radius of curvature ρ at the tip, f = r²/(2ρ)");
            Some(Head::Paraboloid { nose_radius: nose_radius? })
        }
        "sphere" => {
            if !values.is_given("indenter.diameter") {
                values.need("indenter.nose_radius", "radius ρ of the sphere; or diameter");
            }
            if radius.is_some_and(|radius| nose_radius.is_some_and(|nose_radius| radius > nose_radius)) {
                let rho = values.system.written(Dimension::Length, nose_radius?);
                let help = format!("allowed: at most {rho}, or leave it out for the whole sphere");
                values.refuse("indenter.radius", " is larger than indenter.nose_radius", &help)?;
            }
            Some(Head::Sphere { nose_radius: nose_radius? })
        }
        "cone" => {
            if !values.is_given("indenter.half_angle") {
                values.need("indenter.slope", "the number df/dr; or half_angle, in degrees from the axis");
            }
            if let Some(angle) = values.take("indenter.half_angle") {
                // s = cot of the angle between axis and flank
                let slope = 1.0 / libm::tan(angle.to_radians());
                if !Bounds::within(TINY, HUGE).contain(slope) {
                    let help = "allowed: degrees from the axis, so that the slope, its cotangent, is from 1e-6 to 1e6";
                    values.refuse("indenter.half_angle", " is not possible", help)?;
                }
                values.set("indenter.slope", slope);
            }
            Some(Head::Cone { slope: values.number("indenter.slope")? })
        }
        _ => profile::head(values, radius, folder),
    }
}

/// Mass in the units of the case, where a plane mass is that of the half x ≥ 0: of a whole sphere, in the plane a whole
/// cylinder, and of a body of radius a whose flat end is L behind the tip.
///
/// ```text
/// 4πρ³d/3 / (πγR³) = 4ρ³d/3          plane: πρ²d/2 / (γR²)
/// d·(a²L − 2∫_0^a f r dr)            plane: d·(aL − ∫_0^a f dx)
/// ```
///
/// * `density`: d \[γ\]
fn mass(values: &mut Values<'_>, head: &Head, radius: Option<f64>, density: f64) -> Option<f64> {
    let key = if values.checked.remove("indenter.density").is_some() { "density" } else { "material" };
    let length = values.take("indenter.length");
    let geometry = values.system.geometry;
    match (head, length) {
        (Head::Sphere { nose_radius: rho }, _) if radius.is_none_or(|radius| radius == *rho) => {
            if length.is_some() {
                let help = "leave it out, or give indenter.radius, smaller than nose_radius";
                values.refuse("indenter.length", ", but a whole sphere is as long as it is wide", help);
            }
            Some(match geometry {
                Geometry::Axisymmetric => 4.0 / 3.0 * rho.powi(3) * density,
                Geometry::Plane => 0.5 * PI * rho * rho * density,
            })
        }
        (_, Some(length)) => {
            let shape = Shape::new(head.clone(), radius);
            if shape.radius().is_infinite() {
                let help = "give indenter.radius too, or indenter.mass instead of the length";
                values.refuse("indenter.length", ", but the body has no radius", help)?;
            }
            let (_, head_length) = shape.depths(0.0, shape.radius());
            if length < head_length {
                let help =
                    format!("allowed: at least {}", values.system.written(Dimension::Length, head_length));
                values.refuse("indenter.length", " ends inside the head", &help)?;
            }
            Some(density * shape.content(length, geometry))
        }
        (_, None) => {
            let what = " gives a mass only to a whole sphere: the length of other bodies is not known";
            let instead = if key == "density" { " in place of the density" } else { "" };
            let help =
                format!("give indenter.length, from the tip to the flat end, or indenter.mass{instead}");
            values.refuse(&format!("indenter.{key}"), what, &help)?;
            None
        }
    }
}

/// Contact rules that only some indenters allow.
fn check_rule(values: &Values<'_>) {
    let rule = values.get::<Rule>("impact.contact");
    let has_corner = values.number("indenter.edge_radius").is_some_and(|edge| edge > 0.0);
    let is_flat = values.shape.as_deref().is_none_or(|shape| shape == "flat");
    if rule == Some(Rule::Bilateral) && (has_corner || !is_flat) {
        let message = "`impact.contact` = \"bilateral\" glues a fixed zone and needs shape = \"flat\" with a sharp edge";
        values.problem(
            "impact.contact",
            message,
            "use contact = \"unilateral\" for heads that touch gradually",
        );
    }
    let is_finite = values.number("indenter.mass").is_some_and(f64::is_finite);
    if rule == Some(Rule::Prescribed) && is_finite {
        let what = ", but contact = \"prescribed\" gives the motion";
        values.refuse("indenter.mass", what, "set mass = inf, or another contact rule");
    }
}

/// What several bounces need: a whole sphere that flies, in runs that end when it has left.
///
/// * `indenter`: a sound one
pub(super) fn check_bounces(values: &mut Values<'_>, indenter: Option<&Body>) {
    if values.get::<u32>("run.bounces").is_none_or(|bounces| bounces == 1) {
        return values.set("run.bounces", 1);
    }
    let is_sphere = |Body { head, radius, .. }: &Body| matches!(head, Head::Sphere { nose_radius } if *radius == Some(*nose_radius));
    let is_plane = values.system.geometry == Geometry::Plane;
    let is_other = values.is_loaded || values.is_table(BODY.path) || is_plane;
    let (what, help) = if is_other || indenter.is_some_and(|body| !is_sphere(body)) {
        (" is of a whole sphere", "leave it out, or give indenter.shape = \"sphere\" without indenter.radius")
    } else if indenter.is_some_and(|body| body.mass.is_infinite()) {
        (", but a sphere of infinite mass does not rebound", "give indenter.material, density or mass")
    } else if values.get("run.stop") != Some(Stop::Separation) {
        (" needs runs that end when the sphere has left", "set run.stop = \"separation\"")
    } else {
        return;
    };
    values.refuse("run.bounces", what, help);
}
