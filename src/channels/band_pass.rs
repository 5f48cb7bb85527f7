//! A band-pass without a shift of phase: Butterworth filters forward and backward over a whole series.
//!
//! A low-pass and a high-pass of second order, by the bilinear transform with the corner where it is asked for: with `K = tan(πfΔt)` and
//! `D = 1 + √2K + K²`
//!
//! ```text
//! low     (K², 2K², K²)/D        high    (1, −2, 1)/D        both    1 + 2(K² − 1)/D z⁻¹ + (1 − √2K + K²)/D z⁻²
//! ```
//!
//! Forward and backward the gains are `1/(1 + (K_f/K)⁴)` and `1/(1 + (K/K_f)⁴)` at the frequency f of K_f: a half at the corners, as
//! `|H|²` of one pass. Before the series there is rest; after it its last value stays, for three periods of the lower corner, by when what a
//! filter remembers has gone down to 1e-6, or for four times its own length if that is less.

use std::f64::consts::{PI, SQRT_2};

/// A filter of second order: `y_k = b·(x_k, x_{k−1}, x_{k−2}) − a·(y_{k−1}, y_{k−2})`.
struct Filter {
    b: [f64; 3],
    a: [f64; 2],
}

impl Filter {
    /// * `corner`: in sampling rates, below ½
    fn new(corner: f64, is_low: bool) -> Self {
        let k = libm::tan(PI * corner);
        let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
        let numerator = if is_low { [k * k, 2.0 * k * k, k * k] } else { [1.0, -2.0, 1.0] };
        Self {
            b: numerator.map(|b| b * scale),
            a: [2.0 * (k * k - 1.0) * scale, (1.0 - SQRT_2 * k + k * k) * scale],
        }
    }

    /// Filters a series in place.
    ///
    /// * `before`: what it has always been before
    fn run<'a>(&self, before: f64, series: impl Iterator<Item = &'a mut f64>) {
        let Self { b: [b0, b1, b2], a: [a1, a2] } = *self;
        let steady = before * (b0 + b1 + b2) / (1.0 + a1 + a2);
        let mut second = b2 * before - a2 * steady;
        let mut first = b1 * before - a1 * steady + second;
        for x in series {
            let y = b0 * *x + first;
            first = b1 * *x - a1 * y + second;
            second = b2 * *x - a2 * y;
            *x = y;
        }
    }
}

/// A series through a band-pass.
///
/// * `band`: corners, in sampling rates, below ½
pub fn band_pass(series: &[f64], band: [f64; 2]) -> Vec<f64> {
    let count = series.len();
    let last = series.last().copied().unwrap_or_default();
    let rest = ((3.0 / band[0]) as usize).min(4 * count);
    let mut series: Vec<f64> = series.iter().copied().chain(std::iter::repeat_n(last, rest)).collect();
    let filters = [Filter::new(band[0], false), Filter::new(band[1], true)];
    // both backward last: what they give before the series, which is cut off, is not looked at
    filters.iter().for_each(|filter| filter.run(0.0, series.iter_mut()));
    for filter in filters {
        let last = series.last().copied().unwrap_or_default();
        filter.run(last, series.iter_mut().rev());
    }
    series.truncate(count);
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain of a filter whose output leads by the phase, in the middle of a long sine wave.
    fn response(band: [f64; 2], frequency: f64) -> [f64; 2] {
        let count = 40_000;
        let angle = |k: usize| 2.0 * PI * frequency * k as f64;
        let wave: Vec<f64> = (0..count).map(|k| angle(k).sin()).collect();
        let filtered = band_pass(&wave, band);
        // whole periods
        let middle = count / 4..3 * count / 4;
        let part = |of: fn(f64) -> f64| -> f64 {
            middle.clone().map(|k| filtered[k] * of(angle(k))).sum::<f64>() * 2.0 / middle.len() as f64
        };
        [part(f64::sin), part(f64::cos)]
    }

    #[test]
    fn gains_are_those_of_butterworth_and_phases_zero() {
        let band = [0.001, 0.1];
        for frequency in [0.0005, 0.001, 0.002, 0.01, 0.05, 0.1, 0.2, 0.4] {
            let ratio = |corner: f64| ((PI * frequency).tan() / (PI * corner).tan()).powi(4);
            let expected = 1.0 / (1.0 + 1.0 / ratio(band[0])) / (1.0 + ratio(band[1]));
            let [gain, phase] = response(band, frequency);
            assert!(
                (gain - expected).abs() < 1e-9 && phase.abs() < 1e-9,
                "{frequency}: {gain} {phase} {expected}"
            );
        }
    }

    #[test]
    fn before_the_series_there_is_rest_and_after_it_the_last_value() {
        let band = [0.002, 0.1];
        let series: Vec<f64> = (0..600).map(|k| (0.02 * f64::from(k)).sin() + 0.002 * f64::from(k)).collect();
        let longer = [&[0.0; 20_000][..], &series, &[series[599]; 20_000]].concat();
        let longer = band_pass(&longer, band);
        for (found, expected) in band_pass(&series, band).iter().zip(&longer[20_000..]) {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn a_series_that_ends_high_leaves_no_step_there() {
        let ramp: Vec<f64> = (0..2000).map(|k| (f64::from(k) / 400.0).min(1.0)).collect();
        let filtered = band_pass(&ramp, [0.005, 0.2]);
        assert!(filtered[1000..].iter().all(|x| x.abs() < 1e-3), "{:?}", &filtered[1990..]);
        assert!(band_pass(&[], [0.1, 0.2]).is_empty());
    }
}
