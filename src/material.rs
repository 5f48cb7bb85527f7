//! Elastic constants of the target, and materials by name.
//!
//! Waves are what counts, so presets are given by measured speeds of longitudinal and shear waves in bulk where a handbook has them,
//! else by Young's modulus and Poisson's ratio. Real materials differ from sample to sample by some per cent, polymers by
//! more: measured values of the material at hand are better than any of these.

/// The target material: speeds relative to `c_p`, and SI values where they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Shear wave speed c_s \[c_p\].
    pub shear_wave_speed: f64,
    /// The material in SI units.
    pub si: Option<Elastic>,
}

/// What the schemes need to know of a layer, in units of c_p and γ of the struck one. Its longitudinal wave speed is in the
/// distance of its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// Impedance Z of longitudinal waves \[γc_p\].
    pub impedance: f64,
    /// Shear wave speed c_s \[c_p\].
    pub shear: f64,
}

impl Waves {
    /// The only layer, or the struck one.
    ///
    /// * `shear`: shear wave speed c_s \[c_p\]
    pub fn struck(shear: f64) -> Self {
        Self { impedance: 1.0, shear }
    }
}

/// Two elastic constants and the density, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Young's modulus E \[Pa\], with `poisson_ratio`.
    pub youngs_modulus: Option<f64>,
    /// Poisson's ratio ν.
    pub poisson_ratio: Option<f64>,
    /// Bulk modulus K \[Pa\], with `shear_modulus`.
    pub bulk_modulus: Option<f64>,
    /// Shear modulus µ \[Pa\].
    pub shear_modulus: Option<f64>,
    /// Density γ \[kg/m³\].
    pub density: f64,
}

/// Why elastic constants are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Neither pair of constants, or parts of both.
    #[error(
        "a material has youngs_modulus and poisson_ratio, or bulk_modulus and shear_modulus, and density"
    )]
    Incomplete,
    /// A constant is out of range.
    #[error("material {name} = {value} is not possible: {bound}")]
    OutOfRange {
        /// Key.
        name: &'static str,
        /// Value given.
        value: f64,
        /// Allowed range.
        bound: &'static str,
    },
}

impl Elastic {
    /// Bulk and shear modulus `(K, µ)` \[Pa\], `K = E/(3(1−2ν))`, `µ = E/(2(1+ν))`.
    ///
    /// # Errors
    ///
    /// Constants that are missing, or that no stable solid has.
    pub fn moduli(&self) -> Result<(f64, f64), MaterialError> {
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(MaterialError::OutOfRange { name, value, bound: "a finite number > 0" })
            }
        };
        positive("density", self.density)?;
        match (self.youngs_modulus, self.poisson_ratio, self.bulk_modulus, self.shear_modulus) {
            (Some(e), Some(nu), None, None) => {
                positive("youngs_modulus", e)?;
                if !(nu > -1.0 && nu < 0.5) {
                    let bound = "-1 < poisson_ratio < 0.5";
                    return Err(MaterialError::OutOfRange { name: "poisson_ratio", value: nu, bound });
                }
                Ok((e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))))
            }
            (None, None, Some(k), Some(mu)) => {
                Ok((positive("bulk_modulus", k)?, positive("shear_modulus", mu)?))
            }
            _ => Err(MaterialError::Incomplete),
        }
    }

    /// Poisson's ratio ν and Young's modulus E \[Pa\], `ν = (3K − 2µ)/(2(3K + µ))`, `E = 9Kµ/(3K + µ)`.
    ///
    /// # Errors
    ///
    /// As [`Elastic::moduli`].
    pub fn youngs_pair(&self) -> Result<(f64, f64), MaterialError> {
        let (bulk, shear) = self.moduli()?;
        let sum = 3.0 * bulk + shear;
        Ok(((3.0 * bulk - 2.0 * shear) / (2.0 * sum), 9.0 * bulk * shear / sum))
    }

    /// Contact modulus `E* = E/(1 − ν²)` \[Pa\].
    ///
    /// # Errors
    ///
    /// As [`Elastic::moduli`].
    pub fn contact_modulus(&self) -> Result<f64, MaterialError> {
        let (nu, e) = self.youngs_pair()?;
        Ok(e / (1.0 - nu * nu))
    }

    /// Speeds `(c_p, c_s)` \[m/s\] of longitudinal and shear waves, `c_p² = (K + 4µ/3)/γ`, `c_s² = µ/γ`; \[KA\] Eq. 1.
    ///
    /// # Errors
    ///
    /// As [`Elastic::moduli`].
    pub fn wave_speeds(&self) -> Result<(f64, f64), MaterialError> {
        let (bulk, shear) = self.moduli()?;
        Ok((((bulk + 4.0 / 3.0 * shear) / self.density).sqrt(), (shear / self.density).sqrt()))
    }
}

/// A material with a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Name in case files.
    pub name: &'static str,
    /// Density γ \[kg/m³\].
    pub density: f64,
    constants: Constants,
    /// Where the values are from.
    pub source: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Constants {
    /// Speeds of longitudinal and shear waves \[m/s\].
    Speeds(f64, f64),
    /// Young's modulus \[Pa\] and Poisson's ratio.
    Young(f64, f64),
}

/// Table of wave speeds in solids.
const CRC: &str = "CRC Handbook of Chemistry and Physics, Speed of sound in various media";
/// Tables of elastic constants.
const KAYE_LABY: &str = "Kaye & Laby, Tables of physical and chemical constants, 2.2.2";
/// Values that vary with the product.
const TYPICAL: &str = "typical of data sheets";

const fn speeds(name: &'static str, density: f64, c_p: f64, c_s: f64) -> Preset {
    Preset { name, density, constants: Constants::Speeds(c_p, c_s), source: CRC }
}

const fn young(name: &'static str, density: f64, e: f64, nu: f64, source: &'static str) -> Preset {
    Preset { name, density, constants: Constants::Young(e, nu), source }
}

/// All presets, by name.
pub const PRESETS: [Preset; 20] = [
    young("alumina", 3900.0, 370e9, 0.22, TYPICAL),
    speeds("aluminium", 2700.0, 6420.0, 3040.0),
    speeds("brass", 8600.0, 4700.0, 2110.0),
    speeds("copper", 8930.0, 5010.0, 2270.0),
    young("epoxy", 1200.0, 3.5e9, 0.35, TYPICAL),
    speeds("fused-silica", 2200.0, 5968.0, 3764.0),
    young("glass", 2500.0, 71.3e9, 0.22, KAYE_LABY),
    speeds("iron", 7850.0, 5960.0, 3240.0),
    speeds("lead", 11_340.0, 1960.0, 690.0),
    speeds("nylon", 1110.0, 2620.0, 1070.0),
    speeds("pmma", 1180.0, 2680.0, 1100.0),
    speeds("polyethylene", 900.0, 1950.0, 540.0),
    speeds("polystyrene", 1060.0, 2350.0, 1120.0),
    // G = 0.47 GPa, K = 2 GPa
    young("pvb", 1100.0, 1.31e9, 0.391, "typical at impact rates, glassy"),
    speeds("pyrex", 2320.0, 5640.0, 3280.0),
    young("silicon-carbide", 3100.0, 410e9, 0.14, TYPICAL),
    speeds("stainless-steel", 7900.0, 5790.0, 3100.0),
    young("steel", 7850.0, 211.9e9, 0.291, KAYE_LABY),
    speeds("titanium", 4500.0, 6070.0, 3125.0),
    speeds("tungsten-carbide", 13_800.0, 6655.0, 3980.0),
];

impl Preset {
    /// The preset of a name; upper and lower case, and `aluminum`, are the same.
    pub fn find(name: &str) -> Option<&'static Self> {
        let name = name.to_lowercase();
        let name = if name == "aluminum" { "aluminium" } else { &name };
        PRESETS.iter().find(|preset| preset.name == name)
    }

    /// Its elastic constants.
    pub fn elastic(&self) -> Elastic {
        let nothing = Elastic {
            youngs_modulus: None,
            poisson_ratio: None,
            bulk_modulus: None,
            shear_modulus: None,
            density: self.density,
        };
        match self.constants {
            Constants::Speeds(c_p, c_s) => {
                // µ = γc_s², K = γ(c_p² − 4c_s²/3)
                let shear = self.density * c_s * c_s;
                let bulk = self.density * c_p * c_p - 4.0 / 3.0 * shear;
                Elastic { bulk_modulus: Some(bulk), shear_modulus: Some(shear), ..nothing }
            }
            Constants::Young(e, nu) => {
                Elastic { youngs_modulus: Some(e), poisson_ratio: Some(nu), ..nothing }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel() -> Elastic {
        Elastic {
            youngs_modulus: Some(210e9),
            poisson_ratio: Some(0.3),
            bulk_modulus: None,
            shear_modulus: None,
            density: 7850.0,
        }
    }

    #[test]
    fn both_pairs_of_constants_give_the_same_speeds() {
        let (k, mu) = steel().moduli().expect("steel");
        let same = Elastic {
            youngs_modulus: None,
            poisson_ratio: None,
            bulk_modulus: Some(k),
            shear_modulus: Some(mu),
            ..steel()
        };
        assert_eq!(steel().wave_speeds(), same.wave_speeds());
        let (c_p, c_s) = steel().wave_speeds().expect("steel");
        // c_s/c_p = sqrt((1−2ν)/(2(1−ν)))
        assert!((c_s / c_p - (0.4f64 / 1.4).sqrt()).abs() < 1e-15);
        assert!((c_p - 6001.0).abs() < 1.0);
    }

    #[test]
    fn impossible_constants_are_refused() {
        assert_eq!(Elastic { poisson_ratio: None, ..steel() }.moduli(), Err(MaterialError::Incomplete));
        assert!(Elastic { poisson_ratio: Some(0.5), ..steel() }.moduli().is_err());
        assert!(Elastic { density: f64::NAN, ..steel() }.moduli().is_err());
    }

    #[test]
    fn presets_are_possible_materials_in_order() {
        assert!(PRESETS.is_sorted_by(|a, b| a.name < b.name));
        for preset in PRESETS {
            let (c_p, c_s) = preset.elastic().wave_speeds().expect(preset.name);
            let (nu, e) = preset.elastic().youngs_pair().expect(preset.name);
            assert!(nu > 0.0 && nu < 0.5 && e > 1e8 && e < 1e12, "{}: {nu}, {e}", preset.name);
            if let Constants::Speeds(longitudinal, shear) = preset.constants {
                assert!((c_p / longitudinal - 1.0).abs() < 1e-14 && (c_s / shear - 1.0).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn names_are_found_as_people_write_them() {
        for name in ["PMMA", "pmma", "aluminum", "Aluminium"] {
            assert!(Preset::find(name).is_some(), "{name}");
        }
        assert_eq!(Preset::find("cheese"), None);
    }
}
