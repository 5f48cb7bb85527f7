//! How stresses compare with strengths: the largest ratios in a target, and where they first pass 1.
//!
//! Strengths change nothing that is computed: beyond them linear elasticity goes on. Stresses are looked at where and when strains are
//! ([`super::strain`]): in the middle of cells and on both faces. Only the full theory has them.

use serde::{Deserialize, Serialize};

use super::{Field, cells::Stress};

/// What a layer bears, as far as it is known \[γc_p²\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strength {
    /// Stress of von Mises at which it yields.
    pub yielding: Option<f64>,
    /// First principal stress at which it breaks.
    pub tensile: Option<f64>,
    /// Tension and shear at which its bond to the layer above breaks.
    pub bond: Option<[f64; 2]>,
}

impl Strength {
    /// True if stresses within the layer are compared with something.
    pub fn is_known(&self) -> bool {
        self.yielding.is_some() || self.tensile.is_some()
    }

    /// The largest of the ratios of a stress within the layer to what is known of these, 0 if nothing is: of von Mises to the yield strength, of the
    /// first principal stress to the tensile strength.
    ///
    /// * `stress`: \[γc_p²\]
    pub fn largest_ratio(&self, stress: &Stress) -> f64 {
        self.ratios(stress).into_iter().flatten().fold(0.0, f64::max)
    }

    /// What a field of stress shows.
    ///
    /// * `unit`: of the stress \[γc_p²\]
    ///
    /// # Panics
    ///
    /// If the field is none of stress.
    #[inline(always)]
    pub fn shown(&self, field: Field, stress: &Stress, unit: f64) -> f64 {
        match field {
            Field::DamageRatio => self.largest_ratio(&stress.times(unit)),
            field => unit * stress.shown(field),
        }
    }

    /// Both of them.
    fn ratios(&self, stress: &Stress) -> [Option<f64>; 2] {
        [
            self.yielding.map(|strength| stress.von_mises() / strength),
            self.tensile.map(|strength| stress.first_principal() / strength),
        ]
    }

    /// `√((⟨σ_n⟩/N)² + (τ/S)²)` at its bond to the layer above, the quadratic criterion of delamination (J.C. Brewer, P.A. Lagace, J. Compos.
    /// Mater. 22, 1988).
    ///
    /// * `traction`: −σ_n and τ \[γc_p²\]
    pub fn bond_ratio(&self, [normal, shear]: [f64; 2]) -> Option<f64> {
        let [tension, slip] = self.bond?;
        let [opening, slipping] = [(-normal).max(0.0) / tension, shear / slip];
        Some((opening * opening + slipping * slipping).sqrt())
    }
}

/// Which strength a ratio is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// That of yielding.
    Yield,
    /// That of breaking in tension.
    Tensile,
    /// That of the bond of layers.
    Bond,
}

/// A strength that is passed for the first time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure {
    /// Of what.
    pub criterion: Criterion,
    /// Number of the interface, which is that of the layer above it.
    pub interface: Option<usize>,
    /// The ratio, and where it is the largest in this step.
    pub peak: RatioPeak,
}

/// A largest ratio of a stress to a strength so far: where there are several, that of the earliest step, then nearest to the surface, then to the
/// axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RatioPeak {
    /// The ratio.
    pub ratio: f64,
    /// Step.
    pub step: u64,
    /// Radius \[R\].
    pub r: f64,
    /// Depth \[R\].
    pub z: f64,
}

/// The largest ratios so far; `None` of strengths that are not known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RatioPeaks {
    /// Von Mises to yield strength.
    pub yielding: Option<RatioPeak>,
    /// First principal stress to tensile strength.
    pub tensile: Option<RatioPeak>,
    /// Of the bonds of layers, from the struck surface down.
    pub bonds: Vec<Option<RatioPeak>>,
}

impl RatioPeak {
    /// The larger of two peaks.
    pub fn larger(self, other: Self) -> Self {
        let place = |peak: &Self| (peak.step, peak.z, peak.r);
        let is_first = place(&other) < place(&self);
        if other.ratio > self.ratio || (other.ratio == self.ratio && is_first) { other } else { self }
    }

    /// Of two peaks that of the earlier step in which a ratio is beyond 1, in one step the larger.
    pub fn earlier(self, other: Self) -> Self {
        if other.ratio <= 1.0 || (self.ratio > 1.0 && self.step < other.step) {
            self
        } else if self.ratio > 1.0 && self.step == other.step {
            self.larger(other)
        } else {
            other
        }
    }
}

/// Raises a peak to a ratio, if that is larger.
fn raise(peak: &mut Option<RatioPeak>, ratio: Option<f64>, step: u64, place: impl Fn() -> (f64, f64)) {
    if let (Some(peak), Some(ratio)) = (peak, ratio)
        && ratio > 0.0
        && ratio >= peak.ratio
    {
        let (r, z) = place();
        *peak = peak.larger(RatioPeak { ratio, step, r, z });
    }
}

impl RatioPeaks {
    /// Those of a target at rest.
    ///
    /// * `strengths`: of its layers, from the surface down
    pub fn new(strengths: &[Strength]) -> Self {
        Self { bonds: Self::of_bonds(strengths).bonds, ..Self::within(strengths) }
    }

    /// Those within its layers.
    pub fn within(strengths: &[Strength]) -> Self {
        let start = |is_known: fn(&Strength) -> bool| strengths.iter().any(is_known).then(RatioPeak::default);
        Self {
            yielding: start(|layer| layer.yielding.is_some()),
            tensile: start(|layer| layer.tensile.is_some()),
            bonds: Vec::new(),
        }
    }

    /// Those of its bonds.
    pub fn of_bonds(strengths: &[Strength]) -> Self {
        let start = |below: &Strength| below.bond.map(|_| RatioPeak::default());
        Self { bonds: strengths.iter().skip(1).map(start).collect(), ..Self::default() }
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &RatioPeak> {
        self.yielding.iter().chain(&self.tensile).chain(self.bonds.iter().flatten())
    }

    /// Joins those of other stresses to these.
    ///
    /// * `join`: [`RatioPeak::larger`] or [`RatioPeak::earlier`]
    pub fn merge(&mut self, others: &Self, join: impl Fn(RatioPeak, RatioPeak) -> RatioPeak) {
        let Self { yielding, tensile, bonds } = self;
        let pairs = [(yielding, &others.yielding), (tensile, &others.tensile)];
        for (peak, other) in pairs.into_iter().chain(bonds.iter_mut().zip(&others.bonds)) {
            if let (Some(peak), Some(other)) = (peak, other) {
                *peak = join(*peak, *other);
            }
        }
    }

    /// Takes a stress in a layer \[γc_p²\].
    pub fn take(&mut self, strength: &Strength, stress: &Stress, step: u64, place: impl Fn() -> (f64, f64)) {
        let [of_yield, of_tension] = strength.ratios(stress);
        raise(&mut self.yielding, of_yield, step, &place);
        raise(&mut self.tensile, of_tension, step, &place);
    }

    /// Takes the traction of an interface: −σ_n and τ \[γc_p²\].
    ///
    /// * `below`: strength of the layer below it
    pub fn take_traction(
        &mut self,
        interface: usize,
        below: &Strength,
        traction: [f64; 2],
        step: u64,
        place: impl Fn() -> (f64, f64),
    ) {
        raise(&mut self.bonds[interface], below.bond_ratio(traction), step, place);
    }

    /// Strengths that were not passed before.
    pub fn passed(&self, before: &Self) -> Vec<Failure> {
        let mut first = self.clone();
        // one that was passed before is none of these
        first.merge(before, |now, before| if before.ratio > 1.0 { RatioPeak::default() } else { now });
        first.beyond(|_| true)
    }

    /// Those beyond 1.
    ///
    /// * `counts`: which of them
    pub fn beyond(&self, counts: impl Fn(&RatioPeak) -> bool) -> Vec<Failure> {
        let failure = |criterion, interface, peak: &Option<RatioPeak>| {
            let peak = peak.filter(|peak| peak.ratio > 1.0 && counts(peak))?;
            Some(Failure { criterion, interface, peak })
        };
        let within = [(Criterion::Yield, &self.yielding), (Criterion::Tensile, &self.tensile)];
        let within = within.into_iter().map(|(criterion, peak)| failure(criterion, None, peak));
        let bonds = self.bonds.iter().enumerate();
        let bonds = bonds.map(|(number, peak)| failure(Criterion::Bond, Some(number), peak));
        within.chain(bonds).flatten().collect()
    }
}
