//! The `[target]` section, and the system of the numbers of a case, which follows from its material.

use toml::Value;

use super::{
    Target,
    bounds::Bounds,
    document::{Given, Section},
    quantity,
    read::{HUGE, Span, TINY, value},
    system::System,
};
use crate::{
    grid::Geometry,
    material::{Elastic, Material, PRESETS, Preset},
    model::ModelKind,
    units::{Dimension, Scales},
};

/// Bounds of SI values that scales are made of.
const POSITIVE: Bounds = Bounds::above(0.0, 1e30);

/// The material of the target, or why there is none.
pub(super) enum GivenMaterial {
    /// c_s/c_p alone: the case is dimensionless.
    Ratio(f64),
    /// In SI units: the case is physical.
    Physical(Elastic),
    /// Missing or refused.
    Bad {
        /// True if the case is meant to be physical.
        is_physical: bool,
    },
}

/// Reads the material.
///
/// * `has_quantities`: true if other sections have quantities
pub(super) fn read_material(
    section: &mut Section<'_>,
    geometry: Geometry,
    model: ModelKind,
    has_quantities: bool,
) -> GivenMaterial {
    let (has_ratio, has_material) = (section.has("shear_wave_speed"), section.has("material"));
    let ratio = section.get::<f64>("shear_wave_speed", "a number, c_s/c_p");
    let elastic = if has_material { read_elastic(section, geometry) } else { None };
    match (ratio, elastic) {
        (Some(ratio), _) if has_material => {
            let message = "`target.shear_wave_speed` and `target.material` are both given";
            section.problem(ratio.span, message, "keep one of them");
            GivenMaterial::Bad { is_physical: true }
        }
        (Some(ratio), _) => read_ratio(section, ratio, model),
        (None, Some(elastic)) => GivenMaterial::Physical(elastic),
        (None, None) => {
            let is_physical = has_material || (has_quantities && !has_ratio);
            let key = if is_physical { "material" } else { "shear_wave_speed" };
            let meaning = "the material of the target with its constants as quantities or by name (`percuss materials` lists \
                           them), for a physical case; or shear_wave_speed = c_s/c_p, for a dimensionless one";
            section.need(key, has_material || has_ratio, meaning);
            GivenMaterial::Bad { is_physical }
        }
    }
}

fn read_ratio(section: &Section<'_>, ratio: Given<f64>, model: ModelKind) -> GivenMaterial {
    let bounds = Bounds::between(0.0, fastest(model));
    if bounds.contain(ratio.value) && ratio.value >= TINY {
        return GivenMaterial::Ratio(ratio.value);
    }
    let message = format!("`target.shear_wave_speed` = {:?} is not possible", ratio.value);
    section.problem(ratio.span, message, format!("allowed: {bounds}, in units of c_p"));
    GivenMaterial::Bad { is_physical: false }
}

/// Bound of c_s/c_p: in the full theory the bulk modulus is positive, c_s²/c_p² < 3/4.
fn fastest(model: ModelKind) -> f64 {
    if model == ModelKind::Elastic { 0.75f64.sqrt() } else { 1.0 }
}

/// A preset, or a table of constants.
fn read_elastic(section: &mut Section<'_>, geometry: Geometry) -> Option<Elastic> {
    if section.text("material").is_some() {
        return read_preset(section).map(|preset| preset.elastic());
    }
    let mut table = section.section("material");
    let system = System::Physical {
        geometry,
        // SI values, as the scales are made of them
        scales: Some(Scales { geometry: Geometry::Plane, length: 1.0, speed: 1.0, density: 1.0 }),
    };
    let mut modulus = |key| table.quantity(key, Dimension::Stress, POSITIVE, &system).map(value);
    let (youngs_modulus, bulk_modulus, shear_modulus) =
        (modulus("youngs_modulus"), modulus("bulk_modulus"), modulus("shear_modulus"));
    let poisson_ratio = table.number("poisson_ratio", Bounds::between(-1.0, 0.5)).map(value);
    let density = table.require_quantity("density", Dimension::Density, POSITIVE, &system).map(value);
    let is_refused = table.has_refused();
    let span = table.span();
    table.end();
    let elastic = Elastic { youngs_modulus, poisson_ratio, bulk_modulus, shear_modulus, density: density? };
    match elastic.wave_speeds() {
        Ok(_) => Some(elastic),
        // the reason is a constant that was refused
        Err(_) if is_refused => None,
        Err(error) => {
            let help =
                "give youngs_modulus and poisson_ratio, or bulk_modulus and shear_modulus, and density";
            section.problem(span, format!("`target.material`: {error}"), help);
            None
        }
    }
}

/// A material by name, in a section.
pub(super) fn read_preset(section: &mut Section<'_>) -> Option<&'static Preset> {
    let name = section.get::<String>("material", "the name of a material")?;
    let found = Preset::find(&name.value);
    if found.is_none() {
        let message =
            format!("`{}` = \"{}\" is no material known here", section.name("material"), name.value);
        let names: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
        section.refuse::<()>("material", name.span, message, &names.join(", "));
    }
    found
}

/// The system of the numbers of a case: physical with the unit of length of its indenter.
///
/// * `indenter`: its section, unread
pub(super) fn read_system(
    root: &mut Section<'_>,
    indenter: &Section<'_>,
    geometry: Geometry,
    material: &GivenMaterial,
) -> (System, bool) {
    let elastic = match material {
        GivenMaterial::Ratio(_) | GivenMaterial::Bad { is_physical: false } => {
            if let Some(unit) = root.get::<Value>("length_unit", "a length in a physical case") {
                let message = "`length_unit` needs a physical case, and this one is dimensionless";
                root.problem(unit.span, message, "give target.material, or leave length_unit out");
            }
            return (System::Dimensionless, false);
        }
        GivenMaterial::Physical(elastic) => Some(elastic),
        GivenMaterial::Bad { is_physical: true } => None,
    };
    let own = ["radius", "nose_radius"].into_iter().find(|key| indenter.has(key));
    let unit = read_length_unit(root, indenter, geometry, own);
    let speed = elastic.and_then(|elastic| Some((elastic, elastic.wave_speeds().ok()?.0)));
    let scales = unit.zip(speed).map(|(length, (elastic, speed))| Scales {
        geometry,
        length,
        speed,
        density: elastic.density,
    });
    (System::Physical { geometry, scales }, own.is_none())
}

/// The unit of length \[m\].
///
/// * `own`: key of the indenter that is the unit of length
fn read_length_unit(
    root: &mut Section<'_>,
    indenter: &Section<'_>,
    geometry: Geometry,
    own: Option<&str>,
) -> Option<f64> {
    let given = root.get::<Value>("length_unit", &quantity::allowed(Dimension::Length, geometry));
    let read = |text: &str| quantity::parse(text, Dimension::Length, geometry).ok().filter(|si| *si > 0.0);
    match (own, given) {
        (Some(own), Some(given)) => {
            let message = format!("`length_unit` is given, but indenter.{own} is the unit of length");
            root.problem(given.span, message, "leave length_unit out");
            None
        }
        // what is wrong with it is reported where it is read
        (Some(own), None) => read(indenter.text(own)?),
        (None, Some(given)) => {
            let found = given.value.as_str().and_then(read);
            if found.is_none() {
                let message = format!("`length_unit` = {} is not possible", given.value);
                let allowed = quantity::allowed(Dimension::Length, geometry);
                root.problem(given.span, message, format!("allowed: {allowed}, > 0"));
            }
            found
        }
        (None, None) => {
            let meaning =
                "the unit of length, such as \"10 mm\", as the indenter has no radius or nose_radius";
            root.need("length_unit", false, meaning);
            None
        }
    }
}

/// The target with its thickness, and the place of the thickness.
pub(super) fn read_target(
    mut section: Section<'_>,
    material: &GivenMaterial,
    model: ModelKind,
    system: &System,
) -> Option<(Target, Span)> {
    let thickness = read_thickness(&mut section, system);
    let material = match material {
        GivenMaterial::Ratio(shear_wave_speed) => {
            Some(Material { shear_wave_speed: *shear_wave_speed, si: None })
        }
        GivenMaterial::Physical(elastic) => {
            let ratio = elastic.wave_speeds().ok().map(|(c_p, c_s)| c_s / c_p);
            // ν = −1 and what is near it
            let ratio = ratio.filter(|ratio| *ratio < fastest(model) && *ratio >= TINY);
            if ratio.is_none() {
                let message = "`target.material` has a c_s/c_p that the theory does not allow";
                let help = format!("allowed: c_s/c_p from {TINY} to {:.4}", fastest(model));
                section.problem(section.span(), message, help);
            }
            ratio.map(|shear_wave_speed| Material { shear_wave_speed, si: Some(*elastic) })
        }
        GivenMaterial::Bad { .. } => None,
    };
    section.end();
    let (thickness, span) = thickness?;
    Some((Target { thickness, material: material? }, span))
}

/// Thickness, `None` for a half-space, and its place.
fn read_thickness(section: &mut Section<'_>, system: &System) -> Option<(Option<f64>, Span)> {
    if section.text("thickness") == Some("half-space") {
        let given = section.get::<String>("thickness", "")?;
        return Some((None, given.span));
    }
    let bounds = Bounds::within(TINY, HUGE);
    let given = section.quantity("thickness", Dimension::Length, bounds, system);
    let allowed = format!("{}, or \"half-space\"", system.allowed(Dimension::Length, bounds));
    section.need("thickness", given.is_some(), &allowed);
    given.map(|Given { value, span }| (Some(value), span))
}
