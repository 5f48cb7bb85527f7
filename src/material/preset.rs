//! Materials by name.
//!
//! Waves are what counts, so presets are given by measured speeds of longitudinal and shear waves in bulk where a handbook has them,
//! else by Young's modulus and Poisson's ratio. Real materials differ from sample to sample by some per cent, polymers by
//! more: measured values of the material at hand are better than any of these.

use super::Elastic;

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
pub const PRESETS: [Preset; 19] = [
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
