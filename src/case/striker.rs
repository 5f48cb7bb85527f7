//! An indenter that gives, `indenter.body`: in short, or with layers of its own.

use super::{Body, Striker, Target, TargetLayer, keys::BODY, target, values::Values};
use crate::{
    contact::Rule,
    geometry::Geometry,
    grid::{Back, Rim},
    material::Material,
};

/// The body of an indenter that gives; none of a rigid one, or after a problem.
///
/// * `indenter`: head, radius, mass and material
/// * `target`: what it strikes
pub(super) fn striker(values: &mut Values<'_>, indenter: &Body, target: &Target) -> Option<Striker> {
    let has_layers = values.is_table(BODY.path);
    if !has_layers && values.get::<String>("indenter.body").as_deref() != Some("elastic") {
        return None;
    }
    if values.get("impact.contact") == Some(Rule::Prescribed) {
        let what = " gives the motion of the surface, which an indenter that gives does not";
        values.refuse("impact.contact", what, "use another contact rule, or leave indenter.body out");
    }
    let Some(radius) = values.number("indenter.body.radius").or(indenter.radius) else {
        let key = if has_layers { "indenter.body.radius" } else { "indenter.radius" };
        values.need(key, "the radius of the body, as the head has none");
        return None;
    };
    let struck = target.layers.first()?;
    let (layers, weight) = match has_layers {
        true => {
            let meaning = "its layers, from the nose up, as [[indenter.body.layer]]; or body = \"elastic\"";
            values.need("indenter.body.layer", meaning);
            values.count("indenter.body.layer")?;
            let weight = values.number("indenter.body.back.mass");
            let layers = target::layers(values, BODY.path, Some(struck), false)?;
            if weight.is_some() && layers.last()?.thickness.is_none() {
                let message =
                    "`indenter.body.back` is given, but the last layer is a half-space, which has no back";
                values.problem("indenter.body.back", message, "leave it out, or give the layer a thickness");
            }
            (layers, weight)
        }
        false => (vec![whole(values, indenter, radius)?], None),
    };
    let thickness = layers.iter().map(|layer| layer.thickness).sum();
    let material = Material { shear_wave_speed: struck.waves.shear, si: struck.si };
    let back = if weight.is_some() { Back::Rigid } else { Back::Free };
    // one guide holds both
    let rim = if target.radius.is_some() { target.rim } else { Rim::Free };
    let body = Target { thickness, material, layers, back, radius: Some(radius), rim };
    Some(Striker { body, weight })
}

/// A body of the indenter's material, as long as its mass asks: `M = γπa²L`, in the plane `M = γaL` of the half x ≥ 0.
fn whole(values: &Values<'_>, indenter: &Body, radius: f64) -> Option<TargetLayer> {
    let (Some(preset), Some(scales)) = (indenter.material, values.system.scales) else {
        let help = "give indenter.material, or the layers of the body: [[indenter.body.layer]]";
        values.refuse("indenter.body", ", but its material is not known", help);
        return None;
    };
    if indenter.mass.is_infinite() {
        let help = "give indenter.mass, or the layers of the body, the last of which may be a half-space";
        values.refuse("indenter.body", ", but its mass is not known", help);
        return None;
    }
    let layer = TargetLayer::of(preset, &scales);
    let area = values.system.geometry.area(radius);
    Some(TargetLayer { thickness: Some(indenter.mass / (layer.density * area)), ..layer })
}

impl Striker {
    /// Mass of its layers and of what is bonded to its back; infinite of a half-space \[πγR³; plane γR²\].
    pub fn mass(&self, geometry: Geometry) -> f64 {
        let area = geometry.area(self.body.radius.unwrap_or_default());
        let layers = self.body.layers.iter();
        let layers = layers.map(|layer| layer.thickness.map_or(f64::INFINITY, |h| layer.density * area * h));
        layers.sum::<f64>() + self.weight.unwrap_or_default()
    }
}
