//! Mass of an indenter from its density or material.

use std::f64::consts::PI;

use super::{
    bounds::{Bounds, HUGE, TINY},
    document::{Given, Section},
    read_indenter::IndenterParts,
    read_target::read_preset,
    system::System,
};
use crate::{
    geometry::Geometry,
    material::Preset,
    shape::Head,
    units::{Dimension, Scales},
};

/// Density that gives the mass \[γ\], with its key, and material of the indenter.
///
/// * `has_mass`: true if the mass is given, which leaves no place for a density; beside it a material has only its stiffness
pub(super) fn read_substance(
    section: &mut Section<'_>,
    has_mass: bool,
    system: &System,
) -> (Option<(&'static str, Given<f64>)>, Option<&'static Preset>) {
    let both = match ["density", "material"].map(|key| section.has(key)) {
        [true, _] if has_mass => Some(["mass", "density"]),
        [true, true] => Some(["density", "material"]),
        _ => None,
    };
    let place = both.map(|[_, last]| section.place(last));
    let span = section.place("material");
    let density = section.quantity("density", Dimension::Density, Bounds::within(TINY, HUGE), system);
    let preset = read_body_material(section, system);
    if let Some(([first, last], place)) = both.zip(place) {
        let message = format!("`indenter.{first}` and `indenter.{last}` are both given");
        section.problem(place, message, "keep one of them: mass, density or material gives the mass");
        return (None, preset);
    }
    let of_material = preset.filter(|_| !has_mass).map(|preset| {
        let reduce = |scales: Scales| scales.reduce(Dimension::Density, preset.density);
        ("material", Given { value: system.scales().map_or(preset.density, reduce), span })
    });
    (density.map(|density| ("density", density)).or(of_material), preset)
}

/// Material of the indenter.
fn read_body_material(section: &mut Section<'_>, system: &System) -> Option<&'static Preset> {
    section.know("material");
    if !section.has("material") {
        return None;
    }
    let span = section.place("material");
    let preset = read_preset(section)?;
    if let System::Dimensionless = system {
        let message = "`indenter.material` needs a physical case, and this one is dimensionless";
        section.problem(span, message, "give indenter.density in units of γ, or the target a material");
        return None;
    }
    Some(preset)
}

/// Mass of a whole sphere, plane of a whole cylinder, in the units of the case, where a plane mass is that of the half x ≥ 0.
///
/// ```text
/// 4πρ³d/3 / (πγR³) = 4ρ³d/3          plane: πρ²d/2 / (γR²)
/// ```
pub(super) fn mass_of(
    section: &Section<'_>,
    head: &Head,
    radius: Option<&Given<f64>>,
    (key, density): (&str, Given<f64>),
    parts: &IndenterParts<'_>,
) -> Option<f64> {
    match head {
        Head::Sphere { nose_radius } if radius.is_none_or(|radius| radius.value == *nose_radius) => {
            Some(match parts.geometry {
                Geometry::Axisymmetric => 4.0 / 3.0 * nose_radius.powi(3) * density.value,
                Geometry::Plane => 0.5 * PI * nose_radius * nose_radius * density.value,
            })
        }
        _ => {
            let message = format!(
                "`indenter.{key}` = {} gives a mass only to a whole sphere: the length of other bodies is not known",
                section.document.written(&density.span)
            );
            let help = match key {
                "material" => "give indenter.mass too",
                _ => "leave it out and give indenter.mass",
            };
            section.problem(density.span, message, help);
            None
        }
    }
}
