//! How a contact spreads over the surface.

/// Contact radius as a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Front {
    /// Everywhere at once.
    Flat,
    /// `r* = V*·t`.
    Cone {
        /// V* \[c_p\]
        spread_rate: f64,
    },
    /// `r*² = k·t`.
    Paraboloid {
        /// k \[R·c_p\]
        curvature: f64,
    },
}

impl Front {
    /// Time τ(r) at which the contact reaches `r` \[R/c_p\].
    pub fn arrival(&self, r: f64) -> f64 {
        match *self {
            Self::Flat => 0.0,
            Self::Cone { spread_rate } => r / spread_rate,
            Self::Paraboloid { curvature } => r * r / curvature,
        }
    }

    /// Slowness τ'(r) of the contact \[1/c_p\].
    pub fn slowness(&self, r: f64) -> f64 {
        match *self {
            Self::Flat => 0.0,
            Self::Cone { spread_rate } => 1.0 / spread_rate,
            Self::Paraboloid { curvature } => 2.0 * r / curvature,
        }
    }

    /// Contact radius r*(t) \[R\].
    pub fn radius(&self, t: f64) -> f64 {
        match *self {
            _ if t < 0.0 => 0.0,
            Self::Flat => f64::INFINITY,
            Self::Cone { spread_rate } => spread_rate * t,
            Self::Paraboloid { curvature } => (curvature * t).sqrt(),
        }
    }

    /// Radius out to which the contact spreads at least as fast as waves of speed `c` \[R\].
    pub fn sonic_radius(&self, c: f64) -> f64 {
        match *self {
            Self::Flat => f64::INFINITY,
            Self::Cone { spread_rate } if spread_rate >= c => f64::INFINITY,
            Self::Cone { .. } => 0.0,
            Self::Paraboloid { curvature } => 0.5 * curvature / c,
        }
    }
}
