//! The `[target]` section: one layer, or a list of them.

use toml::Value;

use super::{
    Target, TargetLayer,
    bounds::{Bounds, HUGE, TINY},
    document::{Given, Section, Span, span_of, value},
    read_target::{GivenMaterial, check_ratio, read_elastic, read_material},
    rows::LARGEST_CHANGE,
    system::System,
};
use crate::{
    geometry::Geometry,
    grid::{Back, Bond},
    material::{Elastic, Material, PRESETS, Waves},
    model::ModelKind,
    units::Dimension,
};

/// Largest number of layers.
const MAX_LAYERS: usize = 100;
/// Bounds of densities and wave speeds in units of those of the struck layer.
const RELATIVE: Bounds = Bounds::within(TINY, HUGE);

/// The sections of the target and of its layers.
pub(super) struct TargetSections<'t> {
    /// Layers from the surface down; that of the target, if it has no list of them. None after a problem.
    layers: Vec<Section<'t>>,
    /// True if there is a list of layers.
    is_list: bool,
    back: Option<Given<Back>>,
    geometry: Geometry,
    model: ModelKind,
}

/// A target, and what its sizes need of its text.
pub(super) struct GivenTarget {
    pub target: Target,
    /// Name and place of the thickness of every layer.
    pub thicknesses: Vec<Given<String>>,
}

/// Constants of a layer in units of the struck one.
struct Constants {
    si: Option<Elastic>,
    density: f64,
    wave_speed: f64,
    shear: f64,
}

impl<'t> TargetSections<'t> {
    /// Takes the section of the target apart.
    pub fn new(mut section: Section<'t>, geometry: Geometry, model: ModelKind) -> Self {
        let back = section.get("back", "rigid, free");
        let (layers, is_list) = match section.sections("layer") {
            None => (vec![section], false),
            Some(list) => (read_list(section, list), true),
        };
        Self { layers, is_list, back, geometry, model }
    }

    /// Bound of c_s/c_p: in the full theory the bulk modulus is positive, c_s²/c_p² < 3/4. Where wave speeds of layers are changed,
    /// after the change.
    fn largest_ratio(&self) -> f64 {
        match self.model {
            ModelKind::Rakhmatulin => 1.0,
            ModelKind::Elastic if self.layers.len() > 1 => 0.75f64.sqrt() / (1.0 + LARGEST_CHANGE),
            ModelKind::Elastic => 0.75f64.sqrt(),
        }
    }

    /// Reads the material of the struck layer.
    ///
    /// * `has_quantities`: true if other sections have quantities
    pub fn read_material(&mut self, has_quantities: bool) -> GivenMaterial {
        let largest = self.largest_ratio();
        let struck = self.layers.first_mut();
        struck.map_or(GivenMaterial::Unclear, |section| {
            read_material(section, self.geometry, largest, has_quantities)
        })
    }

    /// Reads the rest of the target.
    ///
    /// * `material`: of the struck layer
    pub fn read(mut self, material: &GivenMaterial, system: &System) -> Option<GivenTarget> {
        let sections = std::mem::take(&mut self.layers);
        let count = sections.len();
        let largest = self.largest_ratio();
        let mut layers = Vec::new();
        let mut thicknesses = Vec::new();
        for (number, mut section) in (1..).zip(sections) {
            let constants = match number {
                1 => struck_constants(&mut section, material, self.is_list),
                _ => read_constants(&mut section, material, (self.geometry, largest)),
            };
            let bond = if self.is_list { read_bond(&mut section, number, self.model) } else { Bond::Welded };
            let thickness = read_thickness(&mut section, system);
            if let Some((None, span)) = thickness.as_ref().filter(|_| number < count) {
                let message = format!(
                    "`{}` = \"half-space\", but there are layers below it",
                    section.name("thickness")
                );
                section.problem(span.clone(), message, "only the last layer can be a half-space");
            }
            if let (Some((None, _)), Some(Given { value: Back::Free, span })) = (&thickness, &self.back)
                && number == count
            {
                let message =
                    "`target.back` = \"free\", but the last layer is a half-space, which has no back";
                section.problem(
                    span.clone(),
                    message,
                    "leave target.back out, or give the layer a thickness",
                );
            }
            let name = section.name("thickness");
            section.end();
            let Some((constants, (thickness, span))) = constants.zip(thickness) else { continue };
            thicknesses.push(Given { value: name, span });
            layers.push(constants.layer(number, thickness, bond));
        }
        let material = Material { shear_wave_speed: layers.first()?.waves.shear, si: layers[0].si };
        let thickness = layers.iter().map(|layer| layer.thickness).sum();
        let back = self.back.map_or(Back::Rigid, value);
        // after a problem layers are missing
        (layers.len() == count)
            .then_some(GivenTarget { target: Target { thickness, material, layers, back }, thicknesses })
    }
}

/// The sections of a list of layers; the target has no other keys of one layer then.
fn read_list<'t>(
    mut target: Section<'t>,
    Given { value: mut layers, span }: Given<Vec<Section<'t>>>,
) -> Vec<Section<'t>> {
    for key in ["thickness", "shear_wave_speed", "material"] {
        if target.has(key) {
            let message = format!("`target.{key}` and `target.layer` are both given");
            target.problem(
                target.place(key),
                message,
                "give each layer its own, or leave the list of layers out",
            );
        }
        drop(target.get::<Value>(key, ""));
    }
    if !(1..=MAX_LAYERS).contains(&layers.len()) && !target.is_refused("layer") {
        let message = format!("`target.layer` has {} layers", layers.len());
        target.problem(span, message, format!("allowed: 1 to {MAX_LAYERS}"));
    }
    target.end();
    // what is said of too many layers is enough
    if layers.len() > MAX_LAYERS {
        layers.truncate(1);
    }
    layers
}

/// Constants of the struck layer, the units of the others.
fn struck_constants(section: &mut Section<'_>, material: &GivenMaterial, is_list: bool) -> Option<Constants> {
    let (si, shear) = match material {
        GivenMaterial::Ratio(ratio) => (None, *ratio),
        GivenMaterial::Physical(elastic) => {
            let (c_p, c_s) = elastic.wave_speeds().ok()?;
            (Some(*elastic), c_s / c_p)
        }
        GivenMaterial::BadRatio | GivenMaterial::BadConstants | GivenMaterial::Unclear => return None,
    };
    for key in ["density", "wave_speed"].into_iter().filter(|_| is_list && si.is_none()) {
        if let Some(Given { value, span }) = section.number(key, RELATIVE).filter(|given| given.value != 1.0)
        {
            let message = format!("`{}` = {value:?} is not possible", section.name(key));
            section.problem(
                span,
                message,
                "allowed: 1, as the first layer is the unit of the others; or leave the key out",
            );
        }
    }
    Some(Constants { si, density: 1.0, wave_speed: 1.0, shear })
}

/// Constants of a layer below the struck one.
///
/// * `struck`: material of the struck layer
/// * `largest`: bound of c_s/c_p
fn read_constants(
    section: &mut Section<'_>,
    struck: &GivenMaterial,
    (geometry, largest): (Geometry, f64),
) -> Option<Constants> {
    let shear = match struck {
        GivenMaterial::Ratio(ratio) => *ratio,
        GivenMaterial::Physical(struck) => return read_physical(section, struck, (geometry, largest)),
        GivenMaterial::BadRatio | GivenMaterial::BadConstants | GivenMaterial::Unclear => {
            for key in ["material", "density", "wave_speed", "shear_wave_speed"] {
                drop(section.get::<Value>(key, ""));
            }
            return None;
        }
    };
    if section.has("material") {
        let message = format!(
            "`{}` is given, but the first layer makes the case dimensionless",
            section.name("material")
        );
        section.problem(section.place("material"), message, "give every layer a material, or none");
        drop(section.get::<Value>("material", ""));
    }
    let [density, wave_speed, given] =
        ["density", "wave_speed", "shear_wave_speed"].map(|key| section.number(key, RELATIVE));
    let key = if given.is_some() { "shear_wave_speed" } else { "wave_speed" };
    let place = span_of(&given).or(span_of(&wave_speed)).unwrap_or(section.span());
    let wave_speed = wave_speed.map_or(1.0, value);
    let shear = given.map_or(shear, value);
    if !section.has_refused() {
        check_ratio(section, place, &section.name(key), (shear / wave_speed, largest));
    }
    Some(Constants { si: None, density: density.map_or(1.0, value), wave_speed, shear })
}

/// Constants of a layer in SI units.
fn read_physical(
    section: &mut Section<'_>,
    struck: &Elastic,
    (geometry, largest): (Geometry, f64),
) -> Option<Constants> {
    let place = section.place("material");
    let is_given = section.has("material");
    let elastic = if is_given { read_elastic(section, geometry, largest) } else { None };
    section.know("material");
    section.need("material", is_given, "its material, as the first layer makes the case physical");
    let elastic = elastic?;
    let ((unit, _), (c_p, c_s)) = (struck.wave_speeds().ok()?, elastic.wave_speeds().ok()?);
    let (density, wave_speed) = (elastic.density / struck.density, c_p / unit);
    for (noun, ratio) in [("density", density), ("wave speed", wave_speed)] {
        if !RELATIVE.contain(ratio) {
            let message =
                format!("`{}` has {ratio:e} times the {noun} of the first layer", section.name("material"));
            section.problem(place.clone(), message, format!("allowed: {RELATIVE}"));
        }
    }
    Some(Constants { si: Some(elastic), density, wave_speed, shear: c_s / unit })
}

impl Constants {
    /// The layer of these constants.
    fn layer(self, number: usize, thickness: Option<f64>, bond: Bond) -> TargetLayer {
        let Self { si, density, wave_speed, shear } = self;
        let preset = PRESETS.iter().find(|preset| si == Some(preset.elastic()));
        TargetLayer {
            name: preset.map_or_else(|| format!("layer {number}"), |preset| preset.name.into()),
            thickness,
            si,
            density,
            wave_speed,
            waves: Waves { impedance: density * wave_speed, shear },
            bond,
        }
    }
}

/// How a layer is joined to the one above.
fn read_bond(section: &mut Section<'_>, number: usize, model: ModelKind) -> Bond {
    let Some(Given { value, span }) = section.get("bond", "welded, sliding") else { return Bond::Welded };
    let name = section.name("bond");
    if number == 1 {
        let message = format!("`{name}` is given, but nothing is above the first layer");
        section.problem(span, message, "leave the key out");
    } else if value == Bond::Sliding && model == ModelKind::Rakhmatulin {
        let message = format!("`{name}` = \"sliding\" needs model = \"elastic\"");
        section.problem(
            span,
            message,
            "leave the key out: the simplified theory has no displacements along the layers",
        );
    }
    value
}

/// Thickness, `None` for a half-space, and its place.
fn read_thickness(section: &mut Section<'_>, system: &System) -> Option<(Option<f64>, Span)> {
    if section.text("thickness") == Some("half-space") {
        let given = section.get::<String>("thickness", "")?;
        return Some((None, given.span));
    }
    let bounds = Bounds::within(TINY, HUGE);
    let lengths = (Dimension::Length, bounds);
    let given = section.quantity_or("thickness", lengths, ", or \"half-space\"", system);
    let allowed = format!("{}, or \"half-space\"", system.allowed(Dimension::Length, bounds));
    section.need("thickness", given.is_some(), &allowed);
    given.map(|Given { value, span }| (Some(value), span))
}
