//! Elastic constants of the target.

mod preset;

pub use preset::{PRESETS, Preset};

/// The target material: speeds relative to `c_p`, and SI values where they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Shear wave speed c_s \[c_p\].
    pub shear_wave_speed: f64,
    /// The material in SI units.
    pub si: Option<Elastic>,
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
}
