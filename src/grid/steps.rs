//! The time step of a layered mesh: every layer takes a whole number of steps to cross.

/// Fewest axial steps of a layer: the full theory is not stable with one under a free back.
pub const FEWEST: usize = 2;

/// Smallest time step that is looked at, relative to the largest one.
const SMALLEST: f64 = 2.0 / 3.0;

/// Slack for quotients that are whole numbers within rounding.
const ROUNDING: f64 = 1e-9;

/// A time step, and the axial steps of layers.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerSteps {
    /// Time step Δt \[R/c_p\].
    pub dt: f64,
    /// Axial steps J_k of every layer.
    pub steps: Vec<usize>,
    /// Relative change of the wave speed of every layer, `T_k/(J_kΔt) − 1`, that makes its transit time a whole number of steps.
    pub changes: Vec<f64>,
}

impl LayerSteps {
    /// The time step that changes wave speeds least: the least `max_k |J_kΔt/T_k − 1|` for `⅔Δt_max ≤ Δt ≤ Δt_max`, of equal ones the largest
    /// step.
    ///
    /// For given J_k the best step lies between those of the layers, `Δt = 2/(min_k J_k/T_k + max_k J_k/T_k)`. Which J_k are worth looking at is
    /// seen where the transit time of one layer is a whole number of steps. One layer needs no change.
    ///
    /// * `transits`: transit times `T_k = h_k/c_k`, at least one \[R/c_p\]
    /// * `largest`: Δt_max \[R/c_p\]
    ///
    /// # Errors
    ///
    /// The number of a layer that is thinner than [`FEWEST`] of the smallest steps.
    pub fn fit(transits: &[f64], largest: f64) -> Result<Self, usize> {
        let smallest = SMALLEST * largest;
        if let Some(thin) =
            transits.iter().position(|transit| *transit < FEWEST as f64 * smallest * (1.0 - ROUNDING))
        {
            return Err(thin);
        }
        let whole = |transit: &f64| {
            let [fewest, most] = [transit / largest - ROUNDING, transit / smallest + ROUNDING];
            (fewest.ceil() as usize).max(FEWEST)..=most.floor() as usize
        };
        let candidates =
            transits.iter().flat_map(|transit| whole(transit).map(move |steps| transit / steps as f64));
        let near = |dt: f64| Self::near(transits, dt, [smallest, largest]);
        let better = |a: &Self, b: &Self| {
            let (x, y) = (a.largest_change(), b.largest_change());
            // changes that differ by rounding are equal
            if (x - y).abs() <= ROUNDING { a.dt > b.dt } else { x < y }
        };
        let fits = candidates.chain([smallest]).map(near);
        Ok(fits.fold(near(largest), |best, fit| if better(&fit, &best) { fit } else { best }))
    }

    /// The best step for the axial steps that layers have at a step `dt`.
    fn near(transits: &[f64], dt: f64, [smallest, largest]: [f64; 2]) -> Self {
        let steps: Vec<usize> =
            transits.iter().map(|transit| ((transit / dt).round() as usize).max(FEWEST)).collect();
        let rates = || steps.iter().zip(transits).map(|(steps, transit)| *steps as f64 / transit);
        let (least, most) = rates().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
        let dt = (2.0 / (least + most)).clamp(smallest, largest);
        let changes = rates().map(|rate| 1.0 / (rate * dt) - 1.0).collect();
        Self { dt, steps, changes }
    }

    /// The largest change of a wave speed by magnitude.
    pub fn largest_change(&self) -> f64 {
        self.changes.iter().fold(0.0, |largest, change| largest.max(change.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_layer_has_the_largest_step_and_no_change() {
        for (transit, largest, steps) in [(1.0, 0.021, 48), (1.0, 0.02, 50), (0.7, 0.1, 7), (3.0, 0.9999, 4)]
        {
            let fit = LayerSteps::fit(&[transit], largest).expect("a thick layer");
            assert_eq!(fit.steps, [steps], "{transit}, {largest}");
            assert!((fit.dt * steps as f64 - transit).abs() < 1e-14 && fit.largest_change() < 1e-14);
        }
    }

    #[test]
    fn commensurate_layers_fit_without_a_change() {
        let fit = LayerSteps::fit(&[1.0, 0.3, 0.25], 0.06).expect("thick layers");
        assert_eq!(fit.steps, [20, 6, 5]);
        assert!((fit.dt - 0.05).abs() < 1e-15 && fit.largest_change() < 1e-14, "{fit:?}");
    }

    #[test]
    fn no_step_changes_speeds_less() {
        let stacks: [&[f64]; 4] =
            [&[1.0, 0.071, 2.31], &[0.5, 0.5f64.sqrt()], &[1.0, 0.0137, 0.9, 0.31, 0.77], &[2.0, 0.031]];
        for transits in stacks {
            for largest in [0.0101, 0.005, 0.0033] {
                let fit = LayerSteps::fit(transits, largest).expect("thick layers");
                assert!(fit.dt <= largest && fit.dt >= SMALLEST * largest);
                // every step of a fine grid
                let error = |dt: f64| {
                    let errors = transits.iter().map(|transit| {
                        let steps = (transit / dt).round().max(FEWEST as f64);
                        (steps * dt / transit - 1.0).abs()
                    });
                    errors.fold(0.0, f64::max)
                };
                let tried = (0..=40_000).map(|n| largest * (1.0 - f64::from(n) / 120_000.0));
                let least = tried.map(error).fold(f64::INFINITY, f64::min);
                assert!(error(fit.dt) <= least + 1e-12, "{transits:?}, {largest}: {fit:?}, {least}");
            }
        }
    }

    #[test]
    fn thin_layers_are_named() {
        assert_eq!(LayerSteps::fit(&[1.0, 0.012], 0.01), Err(1));
        // two of the smallest steps
        assert_eq!(LayerSteps::fit(&[1.0, 0.0134], 0.01).map(|fit| fit.steps[1]), Ok(2));
    }
}
