//! Elastic constants of the target, and materials by name.
//!
//! Materials have one axis of symmetry, z; most are alike in all directions. Waves are what counts, so presets are given by measured
//! speeds of longitudinal and shear waves in bulk where a handbook has them, else by Young's modulus and Poisson's ratio. Real materials differ from sample to sample by some per cent, polymers by
//! more: measured values of the material at hand are better than any of these. So it is with strengths, which depend on the grade more than
//! moduli do: a preset has those of a grade that is named with them, where a standard or a data sheet gives them. They change no result.

use serde::Serialize;

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

/// Stiffness of a layer whose axis of symmetry is z, in units of its C33.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// A = C11/C33
    pub lateral: f64,
    /// λ = C13/C33
    pub coupled: f64,
    /// µ = C44/C33
    pub shear: f64,
    /// C66/C33
    pub plane: f64,
}

impl Stiffness {
    /// That of a material that is alike in all directions: A = 1, λ = 1 − 2µ.
    ///
    /// * `ratio`: c_s/c_p
    pub fn isotropic(ratio: f64) -> Self {
        let shear = ratio * ratio;
        Self { lateral: 1.0, coupled: 1.0 - 2.0 * shear, shear, plane: shear }
    }

    /// True if it is that of a material that is alike in all directions.
    pub fn is_isotropic(&self) -> bool {
        *self == Self { lateral: 1.0, coupled: 1.0 - 2.0 * self.shear, plane: self.shear, ..*self }
    }

    /// c_s over the speed of the slower longitudinal waves, those along z or along r.
    pub fn slowness(&self) -> f64 {
        (self.shear / self.lateral.min(1.0)).sqrt()
    }

    /// Indentation modulus M, `E/(1 − ν²)` of isotropic materials:
    ///
    /// ```text
    /// M = 2√{(C11C33 − C13²)/C11 · [1/C44 + 2/(√(C11C33) + C13)]⁻¹}
    /// ```
    ///
    /// (A. Delafargue, F.-J. Ulm, Int. J. Solids Struct. 41, 2004).
    pub fn indentation_modulus(&self) -> f64 {
        let Self { lateral, coupled, shear, .. } = *self;
        if self.is_isotropic() {
            return 4.0 * shear * (1.0 - shear);
        }
        let compliance = 1.0 / shear + 2.0 / (lateral.sqrt() + coupled);
        2.0 * ((lateral - coupled * coupled) / lateral / compliance).sqrt()
    }
}

/// Elastic constants of a material whose axis of symmetry is z, and its density, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Density γ \[kg/m³\].
    pub density: f64,
    /// C33, along z \[Pa\].
    axial: f64,
    /// C44 \[Pa\].
    shear: f64,
    /// The others; none of an isotropic material.
    anisotropy: Option<Anisotropy>,
}

/// C11, C13 and C66 \[Pa\].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Anisotropy {
    lateral: f64,
    coupled: f64,
    plane: f64,
}

/// Strengths of a material, as far as they are known \[Pa\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Strengths {
    /// Stress at which it yields, in a tensile test; that of a polymer in compression.
    pub yield_strength: Option<f64>,
    /// Tension at which it breaks.
    pub tensile_strength: Option<f64>,
    /// Compression at which it breaks, in a test of a cylinder.
    pub compressive_strength: Option<f64>,
}

/// Names of the strengths of a material.
pub const STRENGTHS: [&str; 3] = ["yield_strength", "tensile_strength", "compressive_strength"];

impl Strengths {
    /// * `of`: one of [`STRENGTHS`] by its name
    pub fn new(of: impl Fn(&str) -> Option<f64>) -> Self {
        let [yield_strength, tensile_strength, compressive_strength] = STRENGTHS.map(of);
        Self { yield_strength, tensile_strength, compressive_strength }
    }

    /// All of them, in the order of [`STRENGTHS`].
    pub fn all(&self) -> [Option<f64>; 3] {
        [self.yield_strength, self.tensile_strength, self.compressive_strength]
    }
}

/// Strength of the bond of two layers \[Pa\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BondStrength {
    /// Tension across the interface, may be infinite.
    pub normal: f64,
    /// Shear stress along it, may be infinite.
    pub shear: f64,
}

/// Why elastic constants are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Too few constants, or some that cannot be combined.
    #[error("{0}")]
    Incomplete(String),
    /// A constant is out of range.
    #[error("{0}, which no stable solid has")]
    OutOfRange(String),
}

/// Constants of isotropic materials, two of which are given.
pub const ISOTROPIC: [&str; 6] =
    ["youngs_modulus", "poisson_ratio", "bulk_modulus", "shear_modulus", "wave_speed", "shear_wave_speed"];
/// Stiffness of a material whose axis of symmetry is z.
pub const STIFFNESS: [&str; 5] = ["C11", "C33", "C13", "C44", "C66"];
/// Engineering constants of such a material.
pub const ENGINEERING: [&str; 5] = ["E_r", "E_z", "nu_rt", "nu_zr", "G_rz"];

/// Bulk and shear modulus of two constants.
///
/// * `given`: of each of [`ISOTROPIC`], if it is given
fn moduli(given: [Option<f64>; 6], density: f64) -> Option<(f64, f64)> {
    let [youngs, poisson, bulk, shear, speed, shear_speed] = given;
    // M = γc_p², µ = γc_s²
    let shear = shear.or(shear_speed.map(|speed| density * speed * speed));
    let longitudinal = speed.map(|speed| density * speed * speed);
    Some(match (youngs, poisson, bulk, shear, longitudinal) {
        (Some(e), Some(nu), ..) => (e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))),
        (Some(e), _, Some(k), ..) => (k, 3.0 * k * e / (9.0 * k - e)),
        (Some(e), _, _, Some(mu), _) => (e * mu / (3.0 * (3.0 * mu - e)), mu),
        (Some(e), _, _, _, Some(m)) => {
            // of two solutions the one with ν ≥ 0
            let mu = (3.0 * m + e - ((e - m) * (e - 9.0 * m)).sqrt()) / 8.0;
            (m - 4.0 / 3.0 * mu, mu)
        }
        (_, _, Some(k), Some(mu), _) => (k, mu),
        (_, Some(nu), Some(k), ..) => (k, 1.5 * k * (1.0 - 2.0 * nu) / (1.0 + nu)),
        (_, _, Some(k), _, Some(m)) => (k, 0.75 * (m - k)),
        (_, Some(nu), _, Some(mu), _) => (2.0 * mu * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)), mu),
        (_, Some(nu), _, _, Some(m)) => {
            let mu = m * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu));
            (m - 4.0 / 3.0 * mu, mu)
        }
        (_, _, _, Some(mu), Some(m)) => (m - 4.0 / 3.0 * mu, mu),
        _ => return None,
    })
}

impl Elastic {
    /// A material of constants by the names of their keys in case files: two of [`ISOTROPIC`], all of [`STIFFNESS`] or all of
    /// [`ENGINEERING`] (of these `nu_zr` is the strain along r under stress along z).
    ///
    /// * `constant`: in SI units, if it is given
    /// * `density`: γ \[kg/m³\]
    ///
    /// # Errors
    ///
    /// Constants that are missing, or that no stable solid has.
    pub fn new(constant: impl Fn(&str) -> Option<f64>, density: f64) -> Result<Self, MaterialError> {
        let names = ISOTROPIC.iter().chain(&STIFFNESS).chain(&ENGINEERING);
        let given: Vec<&str> = names.copied().filter(|name| constant(name).is_some()).collect();
        let all = |names: [&str; 5]| {
            let numbers = names.map(&constant);
            let is_all = given.len() == names.len() && numbers.iter().all(Option::is_some);
            is_all.then(|| numbers.map(Option::unwrap_or_default))
        };
        if let Some(stiffness) = all(STIFFNESS) {
            return Self::transverse(stiffness, density);
        }
        if let Some([e_r, e_z, nu_rt, nu_zr, shear]) = all(ENGINEERING) {
            // the compliance, S11 = 1/E_r, S12 = −ν_rt/E_r, S13 = −ν_zr/E_z, S33 = 1/E_z, inverted
            let (sum, coupled, axial) = ((1.0 - nu_rt) / e_r, -nu_zr / e_z, 1.0 / e_z);
            let determinant = axial * sum - 2.0 * coupled * coupled;
            let plane = e_r / (2.0 * (1.0 + nu_rt));
            if determinant <= 0.0 {
                let text = format!("(1 − nu_rt)·E_z/E_r = {:.4e} is not above 2·nu_zr²", sum * e_z);
                return Err(MaterialError::OutOfRange(text));
            }
            let stiffness =
                [0.5 * axial / determinant + plane, sum / determinant, -coupled / determinant, shear, plane];
            return Self::transverse(stiffness, density);
        }
        let pair = ISOTROPIC.map(&constant);
        let is_pair = given.len() == 2 && given.iter().all(|name| ISOTROPIC.contains(name));
        let Some((bulk, shear)) = moduli(pair, density).filter(|_| is_pair) else {
            return Err(MaterialError::Incomplete(match &given[..] {
                [] => "no elastic constants".into(),
                [name] => format!("the elastic constant {name} alone"),
                [others @ .., last] => format!("the elastic constants {} and {last}", others.join(", ")),
            }));
        };
        if !(bulk > 0.0 && shear > 0.0 && bulk.is_finite() && shear.is_finite()) {
            let text = format!("{} and {} make K = {bulk:.4e} Pa and µ = {shear:.4e} Pa", given[0], given[1]);
            return Err(MaterialError::OutOfRange(text));
        }
        Ok(Self { density, axial: bulk + 4.0 / 3.0 * shear, shear, anisotropy: None })
    }

    /// A material of its stiffness C11, C33, C13, C44, C66, which must be positive definite.
    fn transverse(
        [lateral, axial, coupled, shear, plane]: [f64; 5],
        density: f64,
    ) -> Result<Self, MaterialError> {
        for (name, number) in [("C44", shear), ("C66", plane), ("C33", axial), ("C11 − C66", lateral - plane)]
        {
            if number.is_nan() || number <= 0.0 {
                let text = format!("{name} = {number:.4e} Pa is not positive");
                return Err(MaterialError::OutOfRange(text));
            }
        }
        // (C11 + C12)·C33 > 2C13², C12 = C11 − 2C66
        let [bulk, most] = [2.0 * (lateral - plane) * axial, 2.0 * coupled * coupled];
        if bulk <= most {
            let text = format!("(C11 + C12)·C33 = {bulk:.4e} Pa² is not above 2·C13² = {most:.4e} Pa²");
            return Err(MaterialError::OutOfRange(text));
        }
        Ok(Self { density, axial, shear, anisotropy: Some(Anisotropy { lateral, coupled, plane }) })
    }

    /// Its stiffness in units of C33.
    pub fn stiffness(&self) -> Stiffness {
        match self.anisotropy {
            None => {
                let (c_p, c_s) = self.wave_speeds();
                Stiffness::isotropic(c_s / c_p)
            }
            Some(Anisotropy { lateral, coupled, plane }) => Stiffness {
                lateral: lateral / self.axial,
                coupled: coupled / self.axial,
                shear: self.shear / self.axial,
                plane: plane / self.axial,
            },
        }
    }

    /// Young's moduli along r and z \[Pa\] and Poisson's ratios ν_rt, ν_zr, which of an isotropic material are the same,
    /// `ν = (3K − 2µ)/(2(3K + µ))`, `E = 9Kµ/(3K + µ)`.
    pub fn engineering(&self) -> ([f64; 2], [f64; 2]) {
        let Some(Anisotropy { lateral, coupled, plane }) = self.anisotropy else {
            let (bulk, shear) = (self.axial - 4.0 / 3.0 * self.shear, self.shear);
            let sum = 3.0 * bulk + shear;
            return ([9.0 * bulk * shear / sum; 2], [(3.0 * bulk - 2.0 * shear) / (2.0 * sum); 2]);
        };
        // the stiffness inverted
        let sum = 2.0 * (lateral - plane);
        let determinant = sum * self.axial - 2.0 * coupled * coupled;
        let axial = determinant / sum;
        let [half_sum, half_difference] = [0.5 * self.axial / determinant, 0.25 / plane];
        let radial = 1.0 / (half_sum + half_difference);
        ([radial, axial], [(half_difference - half_sum) * radial, coupled / sum])
    }

    /// Indentation modulus M, of isotropic materials `E/(1 − ν²)` \[Pa\].
    pub fn contact_modulus(&self) -> f64 {
        self.axial * self.stiffness().indentation_modulus()
    }

    /// Speeds `(c_p, c_s)` \[m/s\] of longitudinal and shear waves along z, `c_p² = C33/γ = (K + 4µ/3)/γ`, `c_s² = C44/γ = µ/γ`; \[KA\] Eq. 1.
    pub fn wave_speeds(&self) -> (f64, f64) {
        ((self.axial / self.density).sqrt(), (self.shear / self.density).sqrt())
    }

    /// Speed of longitudinal waves along r, `c² = C11/γ` \[m/s\].
    pub fn lateral_speed(&self) -> f64 {
        (self.anisotropy.map_or(self.axial, |anisotropy| anisotropy.lateral) / self.density).sqrt()
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
    /// Strengths of a grade.
    pub strengths: Strengths,
    /// The grade, and where its strengths are from.
    pub grade: &'static str,
}

/// Elastic constants by the names of their keys in case files, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Constants {
    Isotropic([(&'static str, f64); 2]),
    /// [`STIFFNESS`].
    Transverse([f64; 5]),
}

/// Table of wave speeds in solids.
const CRC: &str = "CRC Handbook of Chemistry and Physics, Speed of sound in various media";
/// Tables of elastic constants.
const KAYE_LABY: &str = "Kaye & Laby, Tables of physical and chemical constants, 2.2.2";
/// Values that vary with the product.
const TYPICAL: &str = "typical of data sheets";
/// Laminates: strains in the plane and stresses across it are those of all plies.
const CARBON: &str = "T300/5208 quasi-isotropic, homogenised from its ply (Tsai & Hahn 1980; ν_23 = 0.45)";
const GLASS: &str =
    "Scotchply 1002 cross-ply, homogenised from its ply (Tsai & Hahn 1980; ν_23 = 0.45), mean of directions";

/// Medians of sintered α-alumina of 99.5 %.
const MUNRO: &str = "99.5 %: Munro, J. Am. Ceram. Soc. 80 (1997) 1919";
/// Lower 5 % of bending tests on annealed glass.
const FLOAT: &str = "float, bending: EN 572-1; compression: data sheets of Saint-Gobain, AGC";
/// Tension at break by ISO 527, yield stress in compression by ISO 604.
const CAST: &str = "cast Plexiglas GS: Röhm 211-1";
/// The softest temper.
const CDA: &str = "CuZn37: Copper Development Association, Publication 120";

/// Of speeds of longitudinal and shear waves \[m/s\].
const fn speeds(name: &'static str, density: f64, c_p: f64, c_s: f64) -> Preset {
    // µ = γc_s², K = γ(c_p² − 4c_s²/3)
    let shear = density * c_s * c_s;
    let bulk = density * c_p * c_p - 4.0 / 3.0 * shear;
    plain(name, density, Constants::Isotropic([("bulk_modulus", bulk), ("shear_modulus", shear)]), CRC)
}

/// Of Young's modulus \[Pa\] and Poisson's ratio.
const fn young(name: &'static str, density: f64, e: f64, nu: f64, source: &'static str) -> Preset {
    let constants = [("youngs_modulus", e), ("poisson_ratio", nu)];
    plain(name, density, Constants::Isotropic(constants), source)
}

const fn laminate(name: &'static str, density: f64, stiffness: [f64; 5], source: &'static str) -> Preset {
    plain(name, density, Constants::Transverse(stiffness), source)
}

/// A preset without strengths.
const fn plain(name: &'static str, density: f64, constants: Constants, source: &'static str) -> Preset {
    let strengths = Strengths { yield_strength: None, tensile_strength: None, compressive_strength: None };
    Preset { name, density, constants, source, strengths, grade: "" }
}

/// All presets, by name.
pub const PRESETS: [Preset; 22] = [
    young("alumina", 3900.0, 370e9, 0.22, TYPICAL).breaks(267e6, 3e9, MUNRO),
    speeds("aluminium", 2700.0, 6420.0, 3040.0).yields(240e6, 290e6, "6061-T6: ASTM B209"),
    speeds("brass", 8600.0, 4700.0, 2110.0).yields(125e6, 355e6, CDA),
    laminate("carbon-epoxy", 1600.0, [78.81e9, 13.07e9, 5.648e9, 4.750e9, 26.88e9], CARBON),
    speeds("copper", 8930.0, 5010.0, 2270.0).yields(180e6, 240e6, "Cu-DHP R240: EN 1652"),
    young("epoxy", 1200.0, 3.5e9, 0.35, TYPICAL),
    speeds("fused-silica", 2200.0, 5968.0, 3764.0).breaks(48e6, 1.1e9, "data sheet of GE 124"),
    young("glass", 2500.0, 71.3e9, 0.22, KAYE_LABY).breaks(45e6, 1e9, FLOAT),
    laminate("glass-epoxy", 1800.0, [22.42e9, 10.79e9, 4.606e9, 3.377e9, 7.469e9], GLASS),
    speeds("iron", 7850.0, 5960.0, 3240.0),
    speeds("lead", 11_340.0, 1960.0, 690.0),
    speeds("nylon", 1110.0, 2620.0, 1070.0),
    speeds("pmma", 1180.0, 2680.0, 1100.0).breaks(80e6, 110e6, CAST).yields(110e6, 80e6, CAST),
    speeds("polyethylene", 900.0, 1950.0, 540.0),
    speeds("polystyrene", 1060.0, 2350.0, 1120.0),
    // G = 0.47 GPa, K = 2 GPa
    young("pvb", 1100.0, 1.31e9, 0.391, "typical at impact rates, glassy"),
    speeds("pyrex", 2320.0, 5640.0, 3280.0),
    young("silicon-carbide", 3100.0, 410e9, 0.14, TYPICAL),
    speeds("stainless-steel", 7900.0, 5790.0, 3100.0).yields(205e6, 515e6, "304: ASTM A240"),
    young("steel", 7850.0, 211.9e9, 0.291, KAYE_LABY).yields(355e6, 470e6, "S355: EN 10025-2"),
    speeds("titanium", 4500.0, 6070.0, 3125.0).yields(275e6, 345e6, "grade 2: ASTM B265"),
    speeds("tungsten-carbide", 13_800.0, 6655.0, 3980.0),
];

impl Preset {
    /// That of a grade that yields.
    const fn yields(self, at: f64, tensile: f64, grade: &'static str) -> Self {
        let (yield_strength, tensile_strength) = (Some(at), Some(tensile));
        Self { strengths: Strengths { yield_strength, tensile_strength, ..self.strengths }, grade, ..self }
    }

    /// That of a grade that breaks, in tension and in compression.
    const fn breaks(self, tensile: f64, compressive: f64, grade: &'static str) -> Self {
        let (tensile_strength, compressive_strength) = (Some(tensile), Some(compressive));
        Self {
            strengths: Strengths { tensile_strength, compressive_strength, ..self.strengths },
            grade,
            ..self
        }
    }

    /// The preset of a name; upper and lower case, and `aluminum`, are the same.
    pub fn find(name: &str) -> Option<&'static Self> {
        let name = name.to_lowercase();
        let name = if name == "aluminum" { "aluminium" } else { &name };
        PRESETS.iter().find(|preset| preset.name == name)
    }

    /// Its elastic constants by the names of their keys in case files, in SI units.
    pub fn constants(&self) -> Vec<(&'static str, f64)> {
        match self.constants {
            Constants::Isotropic(constants) => constants.to_vec(),
            Constants::Transverse(stiffness) => STIFFNESS.into_iter().zip(stiffness).collect(),
        }
    }

    /// The material.
    pub fn elastic(&self) -> Elastic {
        let constants = self.constants();
        Elastic::new(|key| find(&constants, key), self.density).expect("a stable solid")
    }
}

/// A constant by its name.
fn find(constants: &[(&str, f64)], key: &str) -> Option<f64> {
    constants.iter().find(|(name, _)| *name == key).map(|(_, number)| *number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(constants: &[(&str, f64)], density: f64) -> Result<Elastic, MaterialError> {
        Elastic::new(|key| find(constants, key), density)
    }

    #[test]
    fn any_two_constants_give_the_same_speeds() {
        let steel = of(&[("youngs_modulus", 210e9), ("poisson_ratio", 0.3)], 7850.0).expect("steel");
        let (c_p, c_s) = steel.wave_speeds();
        // c_s/c_p = sqrt((1−2ν)/(2(1−ν)))
        assert!((c_s / c_p - (0.4f64 / 1.4).sqrt()).abs() < 1e-15 && (c_p - 6001.0).abs() < 1.0);
        let mu = 7850.0 * c_s * c_s;
        let numbers = [210e9, 0.3, 7850.0 * c_p * c_p - 4.0 / 3.0 * mu, mu, c_p, c_s];
        let mut pairs = 0;
        for first in 0..6 {
            for second in first + 1..6 {
                let pair = [first, second].map(|i| (ISOTROPIC[i], numbers[i]));
                if (first, second) == (3, 5) {
                    assert!(matches!(of(&pair, 7850.0), Err(MaterialError::Incomplete(_))), "{pair:?}");
                    continue;
                }
                let same = of(&pair, 7850.0).expect("steel").wave_speeds();
                assert!((same.0 / c_p - 1.0).abs() < 1e-12 && (same.1 / c_s - 1.0).abs() < 1e-12, "{pair:?}");
                pairs += 1;
            }
        }
        assert_eq!(pairs, 14);
    }

    #[test]
    fn stiffness_and_engineering_constants_are_of_one_material() {
        let carbon = Preset::find("carbon-epoxy").expect("a preset").elastic();
        let ([e_r, e_z], [nu_rt, nu_zr]) = carbon.engineering();
        let numbers = [e_r, e_z, nu_rt, nu_zr, 4.750e9];
        let constants: Vec<_> = ENGINEERING.into_iter().zip(numbers).collect();
        let same = of(&constants, 1600.0).expect("a material").stiffness();
        let Stiffness { lateral, coupled, shear, plane } = carbon.stiffness();
        for (a, b) in
            [(same.lateral, lateral), (same.coupled, coupled), (same.shear, shear), (same.plane, plane)]
        {
            assert!((a / b - 1.0).abs() < 1e-12, "{same:?}");
        }
        // of an isotropic one both forms of the modulus are the same
        let isotropic = Stiffness::isotropic(0.55);
        let nearly = Stiffness { lateral: 1.0 + 1e-15, ..isotropic };
        assert!((isotropic.indentation_modulus() / nearly.indentation_modulus() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn impossible_constants_are_refused() {
        let stiffness = |c13, c44| {
            let constants = [("C11", 10e9), ("C33", 5e9), ("C13", c13), ("C44", c44), ("C66", 4e9)];
            of(&constants, 1000.0).map_err(|error| error.to_string())
        };
        assert!(stiffness(1e9, 1e9).is_ok());
        assert!(stiffness(6e9, 1e9).is_err_and(|error| error.contains("(C11 + C12)·C33")));
        assert!(stiffness(1e9, -1e9).is_err_and(|error| error.contains("C44 = -1")));
        let refused = |constants: &[(&str, f64)]| of(constants, 1000.0).expect_err("impossible").to_string();
        let alone = refused(&[("youngs_modulus", 1e9)]);
        assert_eq!(alone, "the elastic constant youngs_modulus alone");
        assert!(refused(&[("youngs_modulus", 1e9), ("shear_modulus", 1e8)]).contains("make K ="));
    }

    #[test]
    fn presets_are_possible_materials_in_order() {
        assert!(PRESETS.is_sorted_by(|a, b| a.name < b.name));
        for preset in PRESETS {
            let (c_p, c_s) = preset.elastic().wave_speeds();
            let (moduli, ratios) = preset.elastic().engineering();
            assert!(ratios.iter().all(|nu| *nu > 0.0 && *nu < 0.5), "{}: {ratios:?}", preset.name);
            assert!(moduli.iter().all(|e| *e > 1e8 && *e < 1e12), "{}: {moduli:?}", preset.name);
            // of strengths it is said whose they are; none is above a thirtieth of a modulus
            let known: Vec<f64> = preset.strengths.all().into_iter().flatten().collect();
            assert_eq!(known.is_empty(), preset.grade.is_empty(), "{}", preset.name);
            assert!(known.iter().all(|strength| *strength > 1e7 && *strength < moduli[0] / 30.0));
            // of speeds of a table the constants are moduli
            if let Constants::Isotropic([("bulk_modulus", _), _]) = preset.constants {
                let whole = |speed: f64| (speed / speed.round() - 1.0).abs() < 1e-14;
                assert!(whole(c_p) && whole(c_s), "{} {c_p} {c_s}", preset.name);
            }
            if preset.name == "aluminium" {
                assert!((c_p / 6420.0 - 1.0).abs() < 1e-14 && (c_s / 3040.0 - 1.0).abs() < 1e-14);
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
