//! The time step of a layered mesh: every layer takes a whole number of steps to cross, over a free back the last one half a step more.

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
    /// Relative change of the wave speed of every layer, `T_k/(N_kΔt) − 1`, that makes its transit time that of its rows of cells: `N_k = J_k`, of
    /// the last one over a free back `J_k + ½`.
    pub changes: Vec<f64>,
}

impl LayerSteps {
    /// The time step that changes wave speeds least: the least `max_k |N_kΔt/T_k − 1|` for `⅔Δt_max ≤ Δt ≤ Δt_max`, of equal ones the largest
    /// step.
    ///
    /// For given N_k the best step lies between those of the layers, `Δt = 2/(min_k N_k/T_k + max_k N_k/T_k)`. Which N_k are worth looking at is
    /// seen where the transit time of one layer is `N_kΔt`. One layer needs no change.
    ///
    /// * `layers`: transit times `T_k = h_k/c_k`, at least one \[R/c_p\], and what lies below the last row of each, [`super::Back::overhang`] of the
    ///   last one of a body
    /// * `largest`: Δt_max \[R/c_p\]
    ///
    /// # Errors
    ///
    /// The number of a layer that is thinner than [`FEWEST`] of the smallest steps, in the last one over a free back half a one more.
    pub fn fit(layers: &[(f64, f64)], largest: f64) -> Result<Self, usize> {
        let smallest = SMALLEST * largest;
        let is_thin = |(transit, overhang): &(f64, f64)| {
            *transit < (FEWEST as f64 + overhang) * smallest * (1.0 - ROUNDING)
        };
        if let Some(thin) = layers.iter().position(is_thin) {
            return Err(thin);
        }
        let candidates = layers.iter().flat_map(|&(transit, overhang)| {
            let [fewest, most] = [transit / largest - ROUNDING, transit / smallest + ROUNDING];
            let [fewest, most] = [(fewest - overhang).ceil(), (most - overhang).floor()];
            let steps = (fewest as usize).max(FEWEST)..=most as usize;
            steps.map(move |steps| transit / (steps as f64 + overhang))
        });
        let near = |dt: f64| Self::near(layers, dt, [smallest, largest]);
        let better = |a: &Self, b: &Self| {
            let (x, y) = (a.largest_change(), b.largest_change());
            // changes that differ by rounding are equal
            if (x - y).abs() <= ROUNDING { a.dt > b.dt } else { x < y }
        };
        let fits = candidates.chain([smallest]).map(near);
        Ok(fits.fold(near(largest), |best, fit| if better(&fit, &best) { fit } else { best }))
    }

    /// The best step for the axial steps that layers have at a step `dt`.
    ///
    /// * `layers`: transit time of each, and what lies below its last row of nodes
    fn near(layers: &[(f64, f64)], dt: f64, [smallest, largest]: [f64; 2]) -> Self {
        let steps =
            |(transit, overhang): &(f64, f64)| ((transit / dt - overhang).round() as usize).max(FEWEST);
        let steps: Vec<usize> = layers.iter().map(steps).collect();
        let rate = |(steps, (transit, overhang)): (&usize, &(f64, f64))| (*steps as f64 + overhang) / transit;
        let rates = || steps.iter().zip(layers).map(rate);
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
    use crate::grid::Back;

    fn best(transits: &[f64], back: Back, largest: f64) -> Result<LayerSteps, usize> {
        let mut layers: Vec<_> = transits.iter().map(|transit| (*transit, 0.0)).collect();
        if let Some(last) = layers.last_mut() {
            last.1 = back.overhang();
        }
        LayerSteps::fit(&layers, largest)
    }

    #[test]
    fn one_layer_has_the_largest_step_and_no_change() {
        for (transit, largest, steps) in [(1.0, 0.021, 48), (1.0, 0.02, 50), (0.7, 0.1, 7), (3.0, 0.9999, 4)]
        {
            let fit = best(&[transit], Back::Rigid, largest).expect("a thick layer");
            assert_eq!(fit.steps, [steps], "{transit}, {largest}");
            assert!((fit.dt * steps as f64 - transit).abs() < 1e-14 && fit.largest_change() < 1e-14);
            // half a step more than a whole number of them, the largest possible
            let fit = best(&[transit], Back::Free, largest).expect("a thick layer");
            let rows = fit.steps[0] as f64 + 0.5;
            assert!((fit.dt * rows / transit - 1.0).abs() < 1e-15 && fit.largest_change() < 1e-14);
            assert!(fit.dt <= largest * (1.0 + 1e-8) && transit / (rows - 1.0) > largest);
        }
    }

    #[test]
    fn commensurate_layers_fit_without_a_change() {
        let fit = best(&[1.0, 0.3, 0.25], Back::Rigid, 0.06).expect("thick layers");
        assert_eq!(fit.steps, [20, 6, 5]);
        assert!((fit.dt - 0.05).abs() < 1e-15 && fit.largest_change() < 1e-14, "{fit:?}");
        let fit = best(&[1.0, 0.3, 0.275], Back::Free, 0.06).expect("thick layers");
        assert_eq!(fit.steps, [20, 6, 5]);
        assert!((fit.dt - 0.05).abs() < 1e-15 && fit.largest_change() < 1e-14, "{fit:?}");
    }

    #[test]
    fn no_step_changes_speeds_less() {
        let stacks: [&[f64]; 4] =
            [&[1.0, 0.071, 2.31], &[0.5, 0.5f64.sqrt()], &[1.0, 0.0137, 0.9, 0.31, 0.77], &[2.0, 0.031]];
        for transits in stacks {
            for (largest, back) in
                [(0.0101, Back::Rigid), (0.005, Back::Free), (0.005, Back::Rigid), (0.0033, Back::Free)]
            {
                let fit = best(transits, back, largest).expect("thick layers");
                assert!(fit.dt <= largest && fit.dt >= SMALLEST * largest);
                // every step of a fine grid
                let error = |dt: f64| {
                    let errors = transits.iter().enumerate().map(|(number, transit)| {
                        let is_last = number + 1 == transits.len();
                        let half = if is_last && back == Back::Free { 0.5 } else { 0.0 };
                        let rows = (transit / dt - half).round().max(FEWEST as f64) + half;
                        (rows * dt / transit - 1.0).abs()
                    });
                    errors.fold(0.0, f64::max)
                };
                let tried = (0..=40_000).map(|n| largest * (1.0 - f64::from(n) / 120_000.0));
                let least = tried.map(error).fold(f64::INFINITY, f64::min);
                assert!(
                    error(fit.dt) <= least + 1e-12,
                    "{transits:?}, {largest}, {back:?}: {fit:?}, {least}"
                );
            }
        }
    }

    #[test]
    fn thin_layers_are_named() {
        assert_eq!(best(&[1.0, 0.012], Back::Rigid, 0.01), Err(1));
        // two of the smallest steps
        assert_eq!(best(&[1.0, 0.0134], Back::Rigid, 0.01).map(|fit| fit.steps[1]), Ok(2));
        // over a free back two and a half
        assert_eq!(best(&[1.0, 0.0164], Back::Free, 0.01), Err(1));
        assert_eq!(best(&[1.0, 0.0168], Back::Free, 0.01).map(|fit| fit.steps[1]), Ok(2));
    }
}
