//! What the impact of a ball comes to, before any run: by Hertz with the moduli of both bodies.
//!
//! The target is the half-space of its struck layer. Whether that is so the back decides: its echo comes after `2h/c_p`, in a thick target when the
//! contact is over. A plate with a free back is thin to bending waves that are six times as long as it is thick (L. Cremer, M. Heckl,
//! *Structure-borne sound*, 1973), here those of the period of two contact times, and is then that of Zener; between the two only a run tells.
//!
//! A body yields first below the surface, where the largest pressure is 1.6 times its yield strength by von Mises, for ν about 0.3 (K. L. Johnson,
//! *Contact mechanics*, 1985, Eq. 6.10); the largest pressure is as `V0^(2/5)`.

use std::f64::consts::PI;

use serde::Serialize;

use super::rigidity::Rigidity;
use crate::{
    case::Case,
    exact::{
        hertz::Hertz,
        hertz_radiation::{Impact, inelasticity, on_half_space, on_plate},
    },
    grid::Back,
    units::{Unit, Units, engineering},
};

/// Largest pressure at first yield, in yield strengths.
const FIRST_YIELD: f64 = 1.6;
/// Length of bending waves above which a plate is thin, in thicknesses.
const THIN: f64 = 6.0;

/// What is expected of an impact, in the units of the case's recording.
#[derive(Clone, Debug, Serialize)]
pub struct Expected {
    /// False if the indenter is taken as rigid, as its material is not known.
    pub both_moduli: bool,
    /// Largest force by Hertz.
    pub peak_force: f64,
    /// Time of contact.
    pub duration: f64,
    /// Largest contact radius.
    pub contact_radius: f64,
    /// Largest approach of the bodies.
    pub indentation: f64,
    /// Largest pressure.
    pub pressure: f64,
    /// Restitution by the waves that a half-space of the struck layer takes; none if that is not alike in all directions.
    pub restitution: Option<f64>,
    /// Of bodies whose yield strength is known.
    pub first_yield: Vec<FirstYield>,
    /// Of a target that has a back.
    pub echo: Option<Echo>,
    /// Of a target of one layer without end and with a free back.
    pub plate: Option<Plate>,
    #[serde(skip)]
    units: Units,
}

/// First yield of a body.
#[derive(Clone, Debug, Serialize)]
pub struct FirstYield {
    /// `target` or `indenter`.
    pub body: &'static str,
    /// Name of its material.
    pub material: String,
    /// \[Pa\]
    pub yield_strength: f64,
    /// Impact velocity from which on it yields.
    pub velocity: f64,
}

/// The echo of what the layers lie on.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Echo {
    /// The back of the target, or a half-space below its layers.
    pub of: &'static str,
    /// Time of longitudinal waves through the target and back.
    pub time: f64,
    /// True if the contact is over by then.
    pub is_thick: bool,
}

/// The target as a plate.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Plate {
    /// Zener's parameter λ.
    pub inelasticity: f64,
    /// Bending waves of the period of two contact times, in thicknesses.
    pub bending_wave: f64,
    /// True if these are long enough for the impact by Zener.
    pub is_thin: bool,
    /// The impact on a thin plate by Zener; none if the ball hardly comes back.
    pub impact: Option<Impact>,
}

impl Expected {
    /// That of a case; `None` unless [`Hertz::of`] covers it.
    pub fn of(case: &Case) -> Option<Self> {
        let units = case.units();
        let Units { length, time, speed, force, stress, .. } = units;
        let rigidity = Rigidity::of(case);
        let modulus = case.modulus() / (1.0 + rigidity.map_or(0.0, |rigidity| rigidity.modulus_ratio));
        let hertz = Hertz::of_modulus(case, modulus)?;
        // a target that ends within the contact is no half-space
        if hertz.largest_radius() > case.within_rims(f64::INFINITY) {
            return None;
        }
        let struck = &case.target.layers[0];
        let is_isotropic = struck.stiffness.is_isotropic();
        let half_space = on_half_space(&hertz, case.target.material.shear_wave_speed).ok();
        let layers = case.target.layers.iter();
        let ways: Vec<f64> =
            layers.filter_map(|layer| Some(2.0 * layer.thickness? / layer.wave_speed)).collect();
        let echo = (!ways.is_empty()).then(|| ways.iter().sum::<f64>());
        let pressure = hertz.pressure(0.0, hertz.largest_depth);
        let first_yield = |(body, material, strength): (_, &str, Option<f64>)| {
            let yield_strength = strength?;
            let ratio = FIRST_YIELD * yield_strength / stress.of(pressure);
            let velocity = speed.of(hertz.velocity * libm::pow(ratio, 2.5));
            Some(FirstYield { body, material: material.into(), yield_strength, velocity })
        };
        let of_target = ("target", struck.name.as_str(), struck.strengths.yield_strength);
        let striker = case.indenter.striker.as_ref().map(|striker| &striker.body.layers[0]);
        let of_indenter = match (striker, case.indenter.material) {
            (Some(layer), _) => Some(("indenter", layer.name.as_str(), layer.strengths.yield_strength)),
            (None, preset) => preset.map(|preset| ("indenter", preset.name, preset.strengths.yield_strength)),
        };
        Some(Self {
            both_moduli: rigidity.is_some() || striker.is_some(),
            peak_force: force.of(hertz.largest_force()),
            duration: time.of(hertz.duration()),
            contact_radius: length.of(hertz.largest_radius()),
            indentation: length.of(hertz.largest_depth),
            pressure: stress.of(pressure),
            restitution: half_space
                .filter(|_| is_isotropic && case.target.radius.is_none())
                .map(|impact| impact.restitution),
            first_yield: [Some(of_target), of_indenter]
                .into_iter()
                .flatten()
                .filter_map(first_yield)
                .collect(),
            echo: echo.map(|echo| Echo {
                of: if case.target.thickness.is_some() { "back" } else { "half-space below" },
                time: time.of(echo),
                is_thick: echo >= hertz.duration(),
            }),
            plate: plate(case, &hertz),
            units,
        })
    }

    /// The impact in rows of names and texts.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let Units { length, time, speed, force, stress, .. } = self.units;
        let text = |unit: Unit, x: f64| unit.text(x / unit.scale);
        let [radius, indentation] = [self.contact_radius, self.indentation].map(|x| text(length, x));
        let moduli = if self.both_moduli { "with the moduli of both bodies" } else { "of a rigid indenter" };
        let restitution = self.restitution.map_or_else(String::new, |e| {
            format!("; restitution {e:.3} by the waves that a half-space takes")
        });
        let mut rows = vec![(
            "impact",
            format!(
                "by Hertz {moduli}: peak force {}, contact {}, contact radius {radius}, indentation {indentation}, largest pressure {}{restitution}",
                text(force, self.peak_force),
                text(time, self.duration),
                text(stress, self.pressure)
            ),
        )];
        let bodies =
            self.first_yield.iter().map(|FirstYield { body, material, yield_strength, velocity }| {
                let strength = engineering(*yield_strength, "Pa");
                format!("{body} ({material}, {strength}) from V0 = {}", text(speed, *velocity))
            });
        let bodies: Vec<String> = bodies.collect();
        if !bodies.is_empty() {
            rows.push((
                "yield",
                format!(
                    "first by von Mises, at a pressure of {FIRST_YIELD} yield strengths: {}",
                    bodies.join(", ")
                ),
            ));
        }
        rows.extend(self.echo.map(|Echo { of, time: echo, is_thick }| {
            let back = text(time, echo);
            let what = match (is_thick, self.plate) {
                (true, _) => "when the contact is over: a thick target".into(),
                (false, Some(plate)) if plate.is_thin => {
                    format!("the contact lasts {:.1} times as long: a thin plate", self.duration / echo)
                }
                (false, _) => {
                    format!("the contact lasts {:.1} times as long: no half-space", self.duration / echo)
                }
            };
            ("echo", format!("of the {of} after {back}, {what}"))
        }));
        rows.extend(self.plate.map(|Plate { inelasticity, bending_wave, is_thin, impact }| {
            let impact = match impact {
                _ if !is_thin => {
                    format!("; bending waves are {bending_wave:.1} thicknesses long, too short for its force")
                }
                None => "; the ball hardly comes back".into(),
                Some(Impact { force: peak, peak_time, duration, restitution, .. }) => {
                    let [at, duration] = [peak_time, duration].map(|t| text(time, t));
                    format!(
                        ": peak force {} at {at}, contact {duration}, restitution {restitution:.3}",
                        text(force, peak)
                    )
                }
            };
            ("plate", format!("by Zener, without end, λ = {inelasticity:.3}{impact}"))
        }));
        rows
    }
}

/// The plate that a case has.
fn plate(case: &Case, hertz: &Hertz) -> Option<Plate> {
    let Units { length, time, force, .. } = case.units();
    let computed = case.target.computed();
    let [layer] = &computed[..] else { return None };
    let h = layer.thickness.filter(|_| case.target.back == Back::Free && case.target.radius.is_none())?;
    // B = C·h³/12 in units of γc_p², C = E/(1 − ν²) of an isotropic plate, C11 − C13²/C33 of others
    let bending = (layer.stiffness.lateral - layer.stiffness.coupled.powi(2)) * h.powi(3) / 12.0;
    let impedance = 8.0 / PI * (bending * h).sqrt();
    // k⁴ = γhω²/B
    let frequency = PI / hertz.duration();
    let bending_wave = 2.0 * PI * (bending / h).sqrt().sqrt() / frequency.sqrt() / h;
    let impact = on_plate(hertz, impedance).map(|impact| Impact {
        force: force.of(impact.force),
        peak_time: time.of(impact.peak_time),
        duration: time.of(impact.duration),
        contact_radius: length.of(impact.contact_radius),
        ..impact
    });
    Some(Plate {
        inelasticity: inelasticity(hertz, impedance),
        bending_wave,
        is_thin: bending_wave >= THIN,
        impact,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEEL: &str = "{ youngs_modulus = \"206 GPa\", poisson_ratio = 0.3, density = \"7.8 g/cm3\", yield_strength = \"1 GPa\" }";

    /// What is expected of a ball.
    ///
    /// * `ball`: its diameter \[mm\] and material
    /// * `target`: keys of its section
    fn expected(ball: (f64, &str), target: &str, velocity: &str) -> Expected {
        let (diameter, material) = ball;
        // a cylinder as heavy as the ball
        let length = diameter * 2.0 / 3.0;
        let text = format!(
            "model = \"elastic\"\n[target]\n{target}\n[indenter]\nshape = \"sphere\"\ndiameter = \"{diameter} mm\"\n\
             [[indenter.body.layer]]\nthickness = \"{length} mm\"\nmaterial = {material}\n[impact]\n{velocity}\n\
             [mesh]\ncontact_cells = 8\n[run]\nend_time = \"1 us\"\n"
        );
        Expected::of(&Case::sound(&text, &[])).expect("a ball")
    }

    /// On steel, as `more` says.
    fn on_steel(diameter: f64, more: &str, velocity: &str) -> Expected {
        expected((diameter, STEEL), &format!("material = {STEEL}\n{more}"), velocity)
    }

    fn near(found: f64, known: f64, digits: f64) {
        assert!((found / known - 1.0).abs() < digits, "{found} {known}");
    }

    #[test]
    fn a_kilogram_of_steel_from_half_a_metre_on_steel() {
        let block = "thickness = \"half-space\"";
        let found = on_steel(62.4, block, "drop = \"0.5 m\"");
        // of 0.9925 kg
        near(found.peak_force, 66.59e3 * 0.9925f64.powf(0.6), 1e-3);
        near(found.duration, 173e-6 * 0.9925f64.powf(0.4), 1e-3);
        near(found.pressure, 1.5 * found.peak_force / (PI * found.contact_radius.powi(2)), 1e-12);
        near(found.indentation, found.contact_radius.powi(2) / 0.0312, 1e-12);
        assert!(found.both_moduli && found.echo.is_none() && found.plate.is_none(), "{found:?}");
        let [target, indenter] = &found.first_yield[..] else { panic!("{found:?}") };
        assert_eq!((target.body, indenter.body, target.velocity), ("target", "indenter", indenter.velocity));
        let slow = format!("velocity = \"{:?} m/s\"", target.velocity);
        near(on_steel(62.4, block, &slow).pressure, 1.6e9, 1e-9);
    }

    /// A. H. Kharaz, D. A. Gorham, A. D. Salman, Powder Technol. 120 (2001) 281: they measure a restitution of 0.98.
    #[test]
    fn an_alumina_ball_on_glass() {
        let alumina = "{ youngs_modulus = \"380 GPa\", poisson_ratio = 0.23, density = \"4 g/cm3\" }";
        let glass = "{ youngs_modulus = \"70 GPa\", poisson_ratio = 0.25, density = \"2.5 g/cm3\" }";
        let target = format!("thickness = \"half-space\"\nmaterial = {glass}");
        let found = expected((5.0, alumina), &target, "velocity = \"3.9 m/s\"");
        near(found.peak_force, 293.3, 1e-3);
        near(found.duration, 12.81e-6, 1e-3);
        near(found.contact_radius, 206e-6, 2e-3);
        assert!(found.first_yield.is_empty() && found.restitution.is_some_and(|e| e > 0.98), "{found:?}");
    }

    /// C. Zener, Phys. Rev. 59 (1941) 669, his equation solved, and his λ in the form in which he gives it (his plate is 2h thick).
    #[test]
    fn a_steel_ball_on_thin_plates() {
        let found = on_steel(20.0, "thickness = \"8 mm\"\nback = \"free\"", "velocity = \"1 m/s\"");
        let Some(Plate { inelasticity, is_thin: true, impact: Some(thin), .. }) = found.plate else {
            panic!("{found:?}")
        };
        near(found.peak_force, 1730.4, 1e-4);
        near(found.duration, 69.5e-6, 1e-3);
        near(thin.force, 1379.7, 1e-4);
        near(thin.peak_time, 32.7e-6, 2e-3);
        near(thin.duration, 73e-6, 1e-3);
        near(thin.restitution, 0.664, 1e-3);
        let speed = (206e9 / (7800.0 * (1.0 - 0.3_f64.powi(2)))).sqrt();
        let zener = PI.powf(0.6) / 3f64.sqrt() * (10.0 / 8f64).powi(2) * speed.powf(-0.2) * 0.5f64.powf(0.4);
        near(inelasticity, zener, 1e-9);
        let pmma = "{ youngs_modulus = \"2.4 GPa\", poisson_ratio = 0.37, density = \"1.18 g/cm3\" }";
        let plate = format!("thickness = \"10 mm\"\nback = \"free\"\nmaterial = {pmma}");
        for (diameter, force, duration, restitution) in
            [(10.0, 119.2, 150e-6, 0.692), (4.0, 22.6, 57.9e-6, 0.942)]
        {
            let thin =
                expected((diameter, STEEL), &plate, "velocity = \"1.4 m/s\"").plate.expect("a plate").impact;
            let thin = thin.expect("a rebound");
            near(thin.force, force, 2e-3);
            near(thin.duration, duration, 5e-3);
            near(thin.restitution, restitution, 1e-3);
        }
    }

    #[test]
    fn a_target_is_thick_if_its_echo_is_late() {
        let of = |thickness: &str| {
            let found = on_steel(
                20.0,
                &format!("thickness = \"{thickness}\"\nback = \"free\""),
                "velocity = \"1 m/s\"",
            );
            (found.echo.expect("a back").is_thick, found.plate.expect("a plate").is_thin)
        };
        assert_eq!(["0.3 m", "50 mm", "8 mm"].map(of), [(true, false), (false, false), (false, true)]);
    }
}
