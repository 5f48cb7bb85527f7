//! Mass of an indenter from its density or material.

use std::f64::consts::PI;

use super::{
    bounds::{Bounds, HUGE, TINY},
    document::{Given, Section},
    read_target::read_preset,
    system::System,
};
use crate::{
    geometry::Geometry,
    material::Preset,
    shape::{Head, Shape},
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

/// What the mass of a body follows from.
pub(super) struct GivenBody<'a> {
    pub head: &'a Head,
    pub radius: Option<&'a Given<f64>>,
    /// From the tip to the flat end.
    pub length: Option<&'a Given<f64>>,
    /// With its key.
    pub density: (&'static str, Given<f64>),
}

impl GivenBody<'_> {
    /// Mass in the units of the case, where a plane mass is that of the half x ≥ 0: of a whole sphere, in the plane a whole
    /// cylinder, and of a body of radius a whose flat end is L behind the tip.
    ///
    /// ```text
    /// 4πρ³d/3 / (πγR³) = 4ρ³d/3          plane: πρ²d/2 / (γR²)
    /// d·(a²L − 2∫_0^a f r dr)            plane: d·(aL − ∫_0^a f dx)
    /// ```
    pub(super) fn mass(self, section: &Section<'_>, geometry: Geometry, system: &System) -> Option<f64> {
        let (key, Given { value: density, span }) = &self.density;
        match (self.head, self.length) {
            (Head::Sphere { nose_radius }, length)
                if self.radius.is_none_or(|radius| radius.value == *nose_radius) =>
            {
                if let Some(length) = length {
                    let given = section.document.written(&length.span);
                    let message =
                        format!("`indenter.length` = {given}, but a whole sphere is as long as it is wide");
                    let help = "leave it out, or give indenter.radius, smaller than nose_radius";
                    section.problem(length.span.clone(), message, help);
                }
                Some(match geometry {
                    Geometry::Axisymmetric => 4.0 / 3.0 * nose_radius.powi(3) * density,
                    Geometry::Plane => 0.5 * PI * nose_radius * nose_radius * density,
                })
            }
            (head, Some(length)) => {
                let shape = Shape::new(head.clone(), self.radius.map(|radius| radius.value));
                if shape.radius().is_infinite() {
                    let given = section.document.written(&length.span);
                    let message = format!("`indenter.length` = {given}, but the body has no radius");
                    let help = "give indenter.radius too, or indenter.mass instead of the length";
                    section.problem(length.span.clone(), message, help);
                    return None;
                }
                let (_, head_length) = shape.depths(0.0, shape.radius());
                if length.value < head_length {
                    let given = section.document.written(&length.span);
                    let message = format!("`indenter.length` = {given} ends inside the head");
                    let least = system.quoted(Dimension::Length, head_length);
                    section.problem(length.span.clone(), message, format!("allowed: at least {least}"));
                    return None;
                }
                Some(density * shape.content(length.value, geometry))
            }
            (_, None) => {
                let message = format!(
                    "`indenter.{key}` = {} gives a mass only to a whole sphere: the length of other bodies is not known",
                    section.document.written(span)
                );
                let help = match *key {
                    "material" => "give indenter.length, from the tip to the flat end, or indenter.mass",
                    _ => {
                        "give indenter.length, from the tip to the flat end, or indenter.mass in place of the density"
                    }
                };
                section.problem(span.clone(), message, help);
                None
            }
        }
    }
}

/// Reads the length, which needs a density and no mass.
pub(super) fn read_length(
    section: &mut Section<'_>,
    has_mass: bool,
    has_substance: bool,
    system: &System,
) -> Option<Given<f64>> {
    let length = section.quantity("length", Dimension::Length, Bounds::within(TINY, HUGE), system)?;
    let (message, help) = if has_mass {
        (
            "`indenter.mass` and `indenter.length` are both given",
            "keep one of them: the length is there to give a mass",
        )
    } else if !has_substance {
        (
            "`indenter.length` is given, but not what the body is made of",
            "add indenter.density or indenter.material, or give indenter.mass instead",
        )
    } else {
        return Some(length);
    };
    section.problem(length.span, message, help);
    None
}

#[cfg(test)]
mod tests {
    use crate::{case::Case, units::Dimension};

    fn mass(text: &str) -> f64 {
        let case = Case::parse("t", text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
        let again = Case::parse("again", &case.resolved_toml(), &[], "".as_ref()).expect("a case");
        assert_eq!(again.indenter, case.indenter);
        case.scales.map_or(case.indenter.mass, |scales| scales.expand(Dimension::Mass, case.indenter.mass))
    }

    #[test]
    fn a_length_gives_a_punch_its_mass() {
        // a steel cylinder of 20 mm and 50 mm: 7850 kg/m³·π·(10 mm)²·50 mm
        let punch = "[target]\nthickness = \"10 mm\"\nmaterial = \"pmma\"\n[indenter]\nshape = \"flat\"\n\
                     radius = \"10 mm\"\nlength = \"50 mm\"\nmaterial = \"steel\"\n[impact]\nvelocity = \"5 m/s\"\n[run]\nend_time = \"9 us\"\n";
        assert!((mass(punch) / (7850.0 * std::f64::consts::PI * 5e-6) - 1.0).abs() < 1e-9, "{}", mass(punch));
        // a cone of height 1 under a cylinder of length 1, half of it in the plane
        let cone = "[target]\nthickness = 1.0\nshear_wave_speed = 0.5\n[indenter]\nshape = \"cone\"\nslope = 1.0\n\
                    radius = 1.0\nlength = 2.0\ndensity = 3.0\n[run]\nend_time = 1.0\n";
        assert!((mass(cone) - 3.0 * (1.0 + 1.0 / 3.0)).abs() < 1e-13);
        assert!((mass(&format!("geometry = \"plane\"\n{cone}")) - 3.0 * 1.5).abs() < 1e-13);
    }
}
