//! The largest impact velocity that keeps the strain of a case within the limit of linear theory, or its stresses within strengths.
//!
//! Under a flat face strains are proportional to V0, and one run gives the velocity. Under any other head they are not: at the same
//! *geometry* of the head, a slower indenter has a sharper contact, and the strain decreases more slowly than V0, under a cone
//! slower than the waves hardly at all. There is no closed relation for all heads, so the velocity is found by trials of the
//! case itself, on its own mesh.

use crate::{
    case::{Case, CaseErrors},
    session::{self, RunError},
    simulation::Simulation,
    units::Dimension,
    validity::{STRAIN_LIMIT, Validity},
    view::View,
};

/// Values from this share of a limit up to the limit itself count as having reached it.
pub const CLOSE: f64 = 0.97;
/// Value that trials aim at, relative to the limit.
const AIM: f64 = 0.985;
/// Nodes in contact that a trial needs at least: with fewer, the strain depends on the mesh and not on the head.
const FEWEST_NODES: usize = 6;
/// Largest number of trials.
const MOST_TRIALS: usize = 40;
/// Largest ratio of the velocities of two trials while all strains lie on one side of the limit.
const LARGEST_STEP: f64 = 30.0;

/// What is kept within its limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Limit {
    /// Largest strain, within 0.005
    #[default]
    Strain,
    /// Stress of von Mises, within the yield strength
    Yield,
    /// First principal stress, within the tensile strength
    Tensile,
    /// Tension and shear at interfaces of layers, within the strength of their bonds
    Bond,
}

impl Limit {
    /// The largest value of a run over its limit; `None` where it is not measured.
    fn reached(self, validity: &Validity) -> Option<f64> {
        let peak = match self {
            Self::Strain => return Some(validity.strain.value / STRAIN_LIMIT),
            Self::Yield => validity.yield_ratio,
            Self::Tensile => validity.tensile_ratio,
            Self::Bond => {
                let ratios = validity.interfaces.iter().flatten().filter_map(|peaks| peaks.ratio);
                ratios.reduce(|a, b| if b.value > a.value { b } else { a })
            }
        };
        peak.map(|peak| peak.value)
    }

    /// What is compared, in words.
    fn subject(self) -> &'static str {
        match self {
            Self::Strain => "strains",
            Self::Yield => "the stress of von Mises",
            Self::Tensile => "the first principal stress",
            Self::Bond => "the tractions of interfaces",
        }
    }

    /// What is kept, in words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Strain => "the strain within 0.005",
            Self::Yield => "stresses within the yield strength",
            Self::Tensile => "stresses within the tensile strength",
            Self::Bond => "interfaces within the strength of their bonds",
        }
    }
}

/// A run of the case at a velocity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Trial {
    /// Impact velocity V0 \[c_p\].
    pub velocity: f64,
    /// Largest strain of the whole target, see [`crate::validity`].
    pub strain: f64,
    /// What is limited, over its limit.
    pub ratio: f64,
    /// Surface nodes in contact, up to the outermost ever.
    pub nodes: usize,
}

/// Why no velocity is found.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// The case is invalid at the velocity of a trial.
    #[error(transparent)]
    Case(#[from] CaseErrors),
    /// A trial failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// There is no such velocity, or the mesh is too coarse to find it.
    #[error(
        "no impact velocity is found that keeps {}: at V0 = {velocity} the limit is reached by a factor of {:.4}, with {} nodes in contact (at least {FEWEST_NODES} are needed); make mesh.cells larger, or the head is too sharp for any velocity",
        .limit.text(), .trial.ratio, .trial.nodes
    )]
    NotFound {
        /// The limit.
        limit: Limit,
        /// The trial that came nearest.
        trial: Trial,
        /// Its velocity with its unit.
        velocity: String,
    },
    /// The limit is not measured.
    #[error(
        "no run of this case compares {} with what it bears: strengths are those of materials (yield_strength, tensile_strength) and of bonds (bond_strength of a layer) of a physical case, and compared in model = \"elastic\"; give them",
        .0.subject()
    )]
    Unknown(Limit),
}

/// Finds the largest velocity at which a value stays within its limit, and no less than [`CLOSE`] of it.
///
/// * `watch`: called after every trial
///
/// # Errors
///
/// A trial that is invalid or fails, or no such velocity.
pub fn find(case: &Case, limit: Limit, mut watch: impl FnMut(&Trial)) -> Result<Trial, SearchError> {
    let not_found = |trial: Trial| SearchError::NotFound {
        limit,
        trial,
        velocity: case.units().speed.short_text(trial.velocity),
    };
    let mut run = |velocity: f64| -> Result<Trial, SearchError> {
        let trial = run(&at_velocity(case, velocity)?, limit)?;
        watch(&trial);
        Ok(trial)
    };
    if case.indenter.head.is_flat() {
        let trial = run(case.impact.velocity)?;
        let factor = 1.0 / trial.ratio;
        return Ok(Trial {
            velocity: factor * trial.velocity,
            strain: factor * trial.strain,
            ratio: 1.0,
            ..trial
        });
    }
    let mut velocity = match limit {
        // first contact strains the target by V0, as in one dimension: no larger velocity is admissible
        Limit::Strain => STRAIN_LIMIT,
        Limit::Yield | Limit::Tensile | Limit::Bond => case.impact.velocity,
    };
    let mut search = Search::default();
    for _ in 0..MOST_TRIALS {
        let trial = run(velocity)?;
        if trial.ratio > 1.0 && trial.nodes < FEWEST_NODES {
            return Err(not_found(trial));
        }
        match search.next(trial) {
            Next::Found(found) if found.nodes >= FEWEST_NODES => return Ok(found),
            Next::Found(found) => return Err(not_found(found)),
            Next::Try(next) => velocity = next,
        }
    }
    Err(not_found(search.fastest_within.or(search.slowest_beyond).unwrap_or(Trial {
        velocity,
        strain: f64::NAN,
        ratio: f64::NAN,
        nodes: 0,
    })))
}

/// The case at another velocity, without frames.
fn at_velocity(case: &Case, velocity: f64) -> Result<Case, CaseErrors> {
    case.vary_surface().set("impact.velocity", case.written(Dimension::Speed, velocity)).build()
}

fn run(case: &Case, limit: Limit) -> Result<Trial, SearchError> {
    let mut nodes = 0;
    let mut count = |view: &View<'_>| nodes = view.interface.pressure.len();
    let outcome = session::run(&mut Simulation::new(case), &mut [&mut count])?;
    let ratio = limit.reached(&outcome.validity).ok_or(SearchError::Unknown(limit))?;
    Ok(Trial { velocity: case.impact.velocity, strain: outcome.validity.strain.value, ratio, nodes })
}

/// Results of the trials so far.
#[derive(Clone, Copy, Debug, Default)]
struct Search {
    fastest_within: Option<Trial>,
    slowest_beyond: Option<Trial>,
    last: Option<Trial>,
}

enum Next {
    Found(Trial),
    Try(f64),
}

impl Search {
    /// Secants of `ln ratio` over `ln V0`, kept inside the bracket once there is one.
    fn next(&mut self, trial: Trial) -> Next {
        if (CLOSE..=1.0).contains(&trial.ratio) {
            return Next::Found(trial);
        }
        let before = self.last.replace(trial);
        if trial.ratio <= 1.0 {
            self.fastest_within = Some(trial);
        } else {
            self.slowest_beyond = Some(trial);
        }
        let missing = (AIM / trial.ratio).ln();
        match (self.fastest_within, self.slowest_beyond) {
            (Some(within), Some(beyond)) => {
                let width = (beyond.velocity / within.velocity).ln();
                if width < 1.0 - CLOSE {
                    // the strain jumps here from one number of nodes in contact to the next
                    return Next::Found(within);
                }
                let rise = (beyond.ratio / within.ratio).ln();
                let share = ((AIM / within.ratio).ln() / rise).clamp(0.1, 0.9);
                Next::Try(within.velocity * (share * width).exp())
            }
            _ => {
                let slope = before.map_or(0.5, |before| {
                    (trial.ratio / before.ratio).ln() / (trial.velocity / before.velocity).ln()
                });
                // between a cone's and a flat face's
                let step = missing / slope.clamp(0.05, 1.0);
                Next::Try(trial.velocity * step.clamp(-LARGEST_STEP.ln(), LARGEST_STEP.ln()).exp())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Velocity and number of trials for a known relation.
    fn search(strain: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut search = Search::default();
        let mut velocity = STRAIN_LIMIT;
        for trials in 1..MOST_TRIALS {
            match search.next(Trial {
                velocity,
                strain: strain(velocity),
                ratio: strain(velocity) / STRAIN_LIMIT,
                nodes: 10,
            }) {
                Next::Found(trial) => return (trial.velocity, trials),
                Next::Try(next) => velocity = next,
            }
        }
        panic!("no end");
    }

    #[test]
    fn known_relations_are_inverted() {
        // a paraboloid on its axis, p² = V0² + b·V0; a cone with a least strain; one whose first strain is small; a jump
        let relations: [&dyn Fn(f64) -> f64; 4] =
            [&|v| f64::sqrt(v * v + 0.3 * v), &|v| 0.004 + 3.0 * v, &|v| 0.4 * v.powf(0.9), &|v| {
                if v < 1e-4 { 10.0 * v } else { 100.0 * v }
            }];
        for (i, relation) in relations.iter().enumerate() {
            let (velocity, trials) = search(relation);
            assert!(relation(velocity) <= STRAIN_LIMIT && trials < 20, "{i}: {velocity}, {trials}");
            // a slightly larger velocity is inadmissible
            assert!(relation(1.06 * velocity) > CLOSE * STRAIN_LIMIT, "{i}: {velocity}");
        }
    }
}
