//! The material of a layer, and the system of the numbers of a case, which follows from that of the struck layer.

use toml::{Value, de::DeValue};

use super::{
    bounds::{Bounds, TINY},
    document::{Given, Section, Span, value},
    quantity,
    system::System,
};
use crate::{
    geometry::Geometry,
    material::{Elastic, PRESETS, Preset},
    units::{Dimension, Scales},
};

/// Bounds of SI values that scales are made of.
const POSITIVE: Bounds = Bounds::above(0.0, 1e30);

/// Keys of elastic constants.
const CONSTANTS: [&str; 4] = ["youngs_modulus", "poisson_ratio", "bulk_modulus", "shear_modulus"];
/// Bounds of a unit of length \[m\]: scales that follow from it are far from overflow.
const LENGTH_UNIT: Bounds = Bounds::within(1e-12, 1e9);

/// The material of the struck layer, or why there is none.
pub(super) enum GivenMaterial {
    /// c_s/c_p alone: the case is dimensionless.
    Ratio(f64),
    /// In SI units: the case is physical.
    Physical(Elastic),
    /// Refused, in a case that is meant to be dimensionless.
    BadRatio,
    /// Refused, in a case that is meant to be physical.
    BadConstants,
    /// Missing, or given in two ways.
    Unclear,
}

/// Reads the material of the struck layer.
///
/// * `largest`: bound of c_s/c_p
/// * `has_quantities`: true if other sections have quantities
pub(super) fn read_material(
    section: &mut Section<'_>,
    geometry: Geometry,
    largest: f64,
    has_quantities: bool,
) -> GivenMaterial {
    let (has_ratio, has_material) = (section.has("shear_wave_speed"), section.has("material"));
    let place = section.place("shear_wave_speed");
    let ratio = section.get::<f64>("shear_wave_speed", "a number, c_s/c_p");
    section.know("material");
    match (has_ratio, has_material) {
        (true, true) => {
            let [ratio, material] = ["shear_wave_speed", "material"].map(|key| section.name(key));
            let message = format!("`{ratio}` and `{material}` are both given");
            let help = "keep shear_wave_speed for a dimensionless case, material for a physical one";
            section.problem(place, message, help);
            drop(section.get::<Value>("material", ""));
            GivenMaterial::Unclear
        }
        (true, false) => ratio.map_or(GivenMaterial::BadRatio, |ratio| read_ratio(section, ratio, largest)),
        (false, true) if has_plain_constants(section) => refuse_plain_constants(section, has_quantities),
        (false, true) => {
            let elastic = read_elastic(section, geometry, largest);
            elastic.map_or(GivenMaterial::BadConstants, GivenMaterial::Physical)
        }
        (false, false) => {
            let (key, meaning) = if has_quantities {
                (
                    "material",
                    "the material of the target by name (`percuss materials` lists them) or with its constants as quantities",
                )
            } else {
                let meaning = "the number c_s/c_p, for a dimensionless case; or material, the material of the target by name or \
                               with its constants, for a physical one";
                ("shear_wave_speed", meaning)
            };
            section.need(key, false, meaning);
            GivenMaterial::Unclear
        }
    }
}

/// True for a table of format 1, whose constants are plain SI numbers.
fn has_plain_constants(section: &Section<'_>) -> bool {
    section.table("material").is_some_and(|table| {
        let is_number = |key: &str| {
            table
                .get(key)
                .is_none_or(|value| matches!(value.get_ref(), DeValue::Integer(_) | DeValue::Float(_)))
        };
        table.contains_key("density") && CONSTANTS.iter().chain(&["density"]).all(|key| is_number(key))
    })
}

/// Refuses a table of format 1, which stood for its c_s/c_p.
///
/// * `has_quantities`: true if other sections have quantities, as no case of format 1 has
fn refuse_plain_constants(section: &mut Section<'_>, has_quantities: bool) -> GivenMaterial {
    let name = section.name("material");
    let mut table = section.section("material");
    let span = table.span();
    let mut number = |key| table.get::<f64>(key, "a number").map(value);
    let density = number("density").unwrap_or_default();
    let [youngs_modulus, poisson_ratio, bulk_modulus, shear_modulus] = CONSTANTS.map(&mut number);
    table.end();
    let elastic = Elastic { youngs_modulus, poisson_ratio, bulk_modulus, shear_modulus, density };
    let ratio = elastic.wave_speeds().map_or_else(
        |_| "shear_wave_speed".to_owned(),
        |(c_p, c_s)| format!("shear_wave_speed = {:?}", c_s / c_p),
    );
    let help = format!(
        "write {ratio}, the same case without dimensions; or, for a physical case, each constant with its unit, such as \
         \"210 GPa\", and all other quantities too"
    );
    section.problem(span, format!("`{name}` has plain numbers, as in format 1"), help);
    if has_quantities { GivenMaterial::Unclear } else { GivenMaterial::BadRatio }
}

fn read_ratio(section: &Section<'_>, ratio: Given<f64>, largest: f64) -> GivenMaterial {
    let bounds = Bounds::between(0.0, largest);
    if bounds.contain(ratio.value) && ratio.value >= TINY {
        return GivenMaterial::Ratio(ratio.value);
    }
    let message = format!("`{}` = {:?} is not possible", section.name("shear_wave_speed"), ratio.value);
    let least =
        if ratio.value > 0.0 && ratio.value < TINY { format!(", at least {TINY}") } else { String::new() };
    section.problem(ratio.span, message, format!("allowed: {bounds}, in units of c_p{least}"));
    GivenMaterial::BadRatio
}

/// A preset, or a table of constants.
///
/// * `largest`: bound of c_s/c_p
pub(super) fn read_elastic(section: &mut Section<'_>, geometry: Geometry, largest: f64) -> Option<Elastic> {
    let name = section.name("material");
    if section.text("material").is_some() {
        return read_preset(section).map(|preset| preset.elastic());
    }
    if section.table("material").is_none() {
        let given = section.get::<Value>("material", "")?;
        let message = format!("`{name}` = {} is not possible", given.value);
        return section.refuse(
            "material",
            given.span,
            message,
            "the name of a material, or a table of constants",
        );
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
    // constants that are missing are reported with the density
    let elastic = Elastic {
        youngs_modulus,
        poisson_ratio,
        bulk_modulus,
        shear_modulus,
        density: density.unwrap_or(1.0),
    };
    match elastic.wave_speeds() {
        Ok((c_p, c_s)) => {
            density.and_then(|_| check_ratio(section, span, &name, (c_s / c_p, largest)).then_some(elastic))
        }
        // the reason is a constant that was refused
        Err(_) if is_refused => None,
        Err(_) => {
            let help = "give two: youngs_modulus and poisson_ratio, or bulk_modulus and shear_modulus";
            section.problem(span, format!("`{name}` has {}", constants(&elastic)), help);
            None
        }
    }
}

/// True if the theory allows a ratio of wave speeds; those near ν = −1 and ν = 1/2 it may not.
///
/// * `name`: of what has it
/// * `ratio`, `largest`: c_s/c_p and its bound
pub(super) fn check_ratio(
    section: &Section<'_>,
    span: Span,
    name: &str,
    (ratio, largest): (f64, f64),
) -> bool {
    let is_allowed = ratio < largest && ratio >= TINY;
    if !is_allowed {
        let message = format!("`{name}` has c_s/c_p = {ratio:?}, which the theory does not allow");
        section.problem(span, message, format!("allowed: c_s/c_p ≥ {TINY} and < {largest:?}"));
    }
    is_allowed
}

/// The elastic constants that are given, in words.
fn constants(elastic: &Elastic) -> String {
    let Elastic { youngs_modulus, poisson_ratio, bulk_modulus, shear_modulus, .. } = elastic;
    let values = [youngs_modulus, poisson_ratio, bulk_modulus, shear_modulus];
    let given = CONSTANTS.iter().zip(values).filter(|(_, value)| value.is_some());
    let names: Vec<&str> = given.map(|(name, _)| *name).collect();
    match names.split_last() {
        None => "no elastic constants".into(),
        Some((name, [])) => format!("the elastic constant {name} alone"),
        Some((last, others)) => format!("the elastic constants {} and {last}", others.join(", ")),
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
        let allowed = format!("{}; `percuss materials` lists their constants", names.join(", "));
        section.refuse::<()>("material", name.span, message, &allowed);
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
        GivenMaterial::Ratio(_) | GivenMaterial::BadRatio => {
            if let Some(unit) = root.get::<Value>("length_unit", "a length in a physical case") {
                let message = "`length_unit` needs a physical case, and this one is dimensionless";
                root.problem(unit.span, message, "give the target a material, or leave length_unit out");
            }
            return (System::Dimensionless, false);
        }
        GivenMaterial::Physical(elastic) => Some(elastic),
        GivenMaterial::BadConstants => None,
        GivenMaterial::Unclear => {
            drop(root.get::<Value>("length_unit", ""));
            return (System::Unclear { geometry }, false);
        }
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
    let allowed = LENGTH_UNIT.in_unit(1.0, "m");
    match (own, given) {
        (Some(own), Some(given)) => {
            let message =
                format!("`length_unit` = {} is given, but indenter.{own} is the unit of length", given.value);
            root.problem(given.span, message, "leave length_unit out");
            None
        }
        // what is wrong with it is reported where it is read
        (Some(own), None) => {
            let text = indenter.text(own)?;
            let length = read(text)?;
            if !LENGTH_UNIT.contain(length) {
                let message = format!("`indenter.{own}` = \"{text}\" cannot be the unit of length");
                root.problem(indenter.place(own), message, format!("allowed: {allowed}"));
            }
            Some(length).filter(|length| LENGTH_UNIT.contain(*length))
        }
        (None, Some(given)) => {
            let found = given.value.as_str().and_then(read).filter(|length| LENGTH_UNIT.contain(*length));
            if found.is_none() {
                let message = format!("`length_unit` = {} is not possible", given.value);
                let lengths = quantity::allowed(Dimension::Length, geometry);
                root.problem(given.span, message, format!("allowed: {lengths}, {allowed}"));
            }
            found
        }
        // another shape lacks its radius, which is the unit
        (None, None) if !["cone", "profile"].contains(&indenter.text("shape")?) => None,
        (None, None) => {
            let meaning =
                "the unit of length, such as \"10 mm\", as the indenter has no radius or nose_radius";
            root.need("length_unit", false, meaning);
            None
        }
    }
}
