//! How far an indenter of a known material is from rigid: the ratio of contact moduli, and what it does to the peak force, the time of
//! contact and the energy that waves take.
//!
//! Bodies in contact yield as one of the modulus `1/E*_both = 1/E*_target + 1/E*_indenter`, with `E* = E/(1 − ν²)` of each. A rigid
//! indenter leaves out the second term, as if the contact were stiffer by `E*_target/E*_both = 1 + q`, q the ratio of moduli. A head
//! at rest needs a force `F ∝ E*·wⁿ`; a mass that comes with a given energy, `∝ E*·wⁿ⁺¹`, therefore meets a peak force
//!
//! ```text
//! F_rigid/F = (1 + q)^(1/(n+1))
//! ```
//!
//! | Head | n | exponent |
//! |---|---|---|
//! | sphere, paraboloid (Hertz); a profile, taken as one | 3/2 | 2/5 |
//! | cone | 2 | 1/3 |
//! | flat face; any head in the plane, up to a logarithm of w | 1 | 1/2 |
//! | any head of infinite mass, whose w is given | | 1 |
//!
//! The largest w of a mass is `∝ E*^(−1/(n+1))`, and so is the time of contact, `∝ w/V0`; by Hertz `T = 2.87 (M²/(E*² R V0))^(1/5)`. Waves
//! take `∫ Ḟ² dt ∝ F²/T` from a force that acts on a half-space, and `∝ F²` from one on a line in the plane, where a wave of frequency ω
//! carries `ω F²`:
//!
//! ```text
//! T_rigid/T = F/F_rigid                W_rigid/W = (F_rigid/F)³   (plane: (F_rigid/F)²)
//! ```
//!
//! This is the quasistatic estimate on a half-space, of several layers that of the struck one alone, while waves take a small part of
//! the energy. A steel ball on PMMA: q = 2.1 %, the force is 0.8 % too high; on alumina: 168 %, the force is 1.48 times too high; on steel:
//! 100 %, the force is 1.32 times too high, contact 24 % too short, and the radiated energy 2.3 times what it is.

use serde::Serialize;

use crate::{case::Case, geometry::Geometry, shape::Tip};

/// Excess of the peak force above which `percuss run` and `percuss check` warn.
pub const NOTED: f64 = 0.05;

/// How far an indenter is from rigid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rigidity {
    /// Contact modulus of the target over that of the indenter.
    pub modulus_ratio: f64,
    /// Estimated peak force under a rigid indenter over that under one of its material.
    pub force_ratio: f64,
    /// Estimated energy that waves take from a mass under a rigid indenter over that under one of its material, and the ratio of times of
    /// contact is that of forces, inverted; none of an infinite mass.
    #[serde(skip)]
    pub wave_energy_ratio: Option<f64>,
    /// True if there are layers below the struck one, whose moduli do not enter.
    #[serde(skip)]
    pub is_layered: bool,
    /// True in the full theory, where the indenter can give.
    #[serde(skip)]
    pub can_give: bool,
}

impl Rigidity {
    /// That of a case; `None` unless both materials are known.
    pub fn of(case: &Case) -> Option<Self> {
        if case.indenter.striker.is_some() {
            return None;
        }
        let modulus = case.indenter.material?.elastic().contact_modulus();
        let modulus_ratio = case.target.material.si?.contact_modulus() / modulus;
        let exponent = match (case.geometry, case.indenter.head.tip()) {
            _ if case.indenter.mass.is_infinite() => 1.0,
            (Geometry::Plane, _) | (_, Tip::Face) => 1.0 / 2.0,
            (_, Tip::Point(_)) => 1.0 / 3.0,
            (_, Tip::Round(_) | Tip::Other) => 2.0 / 5.0,
        };
        let force_ratio = libm::pow(1.0 + modulus_ratio, exponent);
        let power = match case.geometry {
            Geometry::Axisymmetric => 3.0,
            Geometry::Plane => 2.0,
        };
        let has_mass = case.indenter.mass.is_finite();
        let wave_energy_ratio = has_mass.then(|| libm::pow(force_ratio, power));
        let is_layered = case.sizes.layers.len() > 1;
        let can_give = case.model.has_shear();
        Some(Self { modulus_ratio, force_ratio, wave_energy_ratio, is_layered, can_give })
    }

    /// True if a user is to be warned.
    pub fn is_notable(&self) -> bool {
        self.force_ratio - 1.0 > NOTED
    }

    /// The ratios in a line.
    pub fn text(&self) -> String {
        let percent = |share: f64| format!("{:.*} %", usize::from(share < 0.1), 100.0 * share);
        let (modulus, excess) = (percent(self.modulus_ratio), percent(self.force_ratio - 1.0));
        let target = if self.is_layered { "struck layer" } else { "target" };
        let time = percent(1.0 - self.force_ratio.recip());
        let more = self.wave_energy_ratio.map_or_else(String::new, |energy| {
            format!(
                ", the contact time {time} too short, and the radiated energy {energy:.2} times what it is"
            )
        });
        format!(
            "the indenter is taken as rigid; the contact modulus E/(1 - ν²) of the {target} is {modulus} of its own: \
             the peak force is about {excess} too high{more}{}",
            if self.can_give { "; indenter.body = \"elastic\" lets it give" } else { "" }
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rigidity(target: &str, indenter: &str, more: &[&str]) -> Option<Rigidity> {
        let text = format!(
            "[target]\nthickness = \"half-space\"\nmaterial = \"{target}\"\n[indenter]\n{indenter}\n\
             [impact]\nvelocity = \"1 m/s\"\n[mesh]\ncells = 10\n[run]\nend_time = \"5 us\"\n"
        );
        let case = Case::sound(&text, more);
        // the case that the recording carries knows the material too
        let again = Case::sound(&case.resolved_toml(), &[]);
        assert_eq!(Rigidity::of(&again), Rigidity::of(&case));
        Rigidity::of(&case)
    }

    const BALL: &str = "shape = \"sphere\"\nnose_radius = \"10 mm\"\nmaterial = \"steel\"";

    #[test]
    fn a_steel_ball_is_rigid_on_pmma_and_not_on_alumina() {
        let soft = rigidity("pmma", BALL, &[]).expect("both materials");
        assert!((soft.modulus_ratio - 0.0205).abs() < 1e-4 && (soft.force_ratio - 1.0082).abs() < 1e-4);
        assert!(!soft.is_notable() && soft.text().contains("2.1 %") && soft.text().contains("0.8 %"));
        let hard = rigidity("alumina", BALL, &[]).expect("both materials");
        assert!((hard.force_ratio - 1.483).abs() < 1e-3 && hard.is_notable(), "{hard:?}");
        assert!(hard.text().contains("168 %") && hard.text().contains("48 %"), "{}", hard.text());
    }

    #[test]
    fn the_force_follows_from_the_head() {
        // of the same material: 2^(1/(n+1))
        let factor =
            |indenter: &str, more: &[&str]| rigidity("steel", indenter, more).map(|found| found.force_ratio);
        let near =
            |found: Option<f64>, exact: f64| found.is_some_and(|found| (found / exact - 1.0).abs() < 1e-14);
        let flat = "shape = \"flat\"\nradius = \"10 mm\"\nmaterial = \"steel\"";
        let cone = "shape = \"cone\"\nradius = \"10 mm\"\nslope = 0.5\nmaterial = \"steel\"\nmass = \"30 g\"";
        assert!(near(factor(BALL, &[]), 2f64.powf(0.4)));
        assert!(near(factor(BALL, &["geometry=plane"]), 2f64.sqrt()));
        assert!(near(factor(flat, &["indenter.mass=\"30 g\""]), 2f64.sqrt()));
        assert!(near(factor(flat, &["indenter.mass=inf"]), 2.0));
        assert!(near(factor(cone, &[]), 2f64.cbrt()));
    }

    #[test]
    fn contact_time_and_waves_follow_from_the_force() {
        // Hertz's time of contact 2.87 (M²/(E*² R V0))^(1/5) with both moduli and with that of the target alone
        let time = |modulus: f64| 2.87 * libm::pow(1.0 / (modulus * modulus), 0.2);
        let found = rigidity("steel", BALL, &[]).expect("both materials");
        assert!((time(1.0) / time(0.5) * found.force_ratio - 1.0).abs() < 1e-12, "{found:?}");
        let text = found.text();
        assert!(text.contains("32 % too high") && text.contains("24 % too short"), "{text}");
        assert!(text.contains("the radiated energy 2.30 times"), "{text}");
        let plane = rigidity("steel", BALL, &["geometry=plane"]).expect("both materials");
        assert!(plane.wave_energy_ratio.is_some_and(|ratio| (ratio - 2.0).abs() < 1e-12), "{plane:?}");
        // the motion is given
        let driven = rigidity("steel", BALL, &["indenter.mass=inf"]).expect("both materials");
        assert!(driven.wave_energy_ratio.is_none() && !driven.text().contains("contact time"), "{driven:?}");
    }

    #[test]
    fn nothing_is_known_of_a_body_without_a_material() {
        for known in ["mass = \"30 g\"", "density = \"7.85 g/cm3\""] {
            assert_eq!(rigidity("alumina", &BALL.replace("material = \"steel\"", known), &[]), None);
        }
    }
}
