//! Where schemes see the edge of a contact.

/// Where a matched mesh sees a sharp punch edge, in cells past the last contact node: at `offset − slope·(1 − λ)`, with the radial
/// Courant number λ. With the edge there stresses converge at second order, and the drag of a plane flat punch is exact (order 2)
/// or within 1e-6 (order 4; full theory, 200 cells: 2e-5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Offset for λ = 1.
    pub offset: f64,
    /// How it falls with λ.
    pub slope: f64,
    /// Part of the offset that a moving edge has too: lateral damping holds the surface beside the contact.
    pub damped: f64,
}

/// β = c_s/c_p, offset without damping, and what damping adds to it: `σ/β` times the last number. Measured on the plane punch with 60
/// cells, whose drag is known; the kink is where the stiffness k of the cells reaches its limit.
const ELASTIC: [[f64; 3]; 20] = [
    [0.10, 0.2403, 0.0833],
    [0.15, 0.2453, 0.0871],
    [0.20, 0.2466, 0.0868],
    [0.25, 0.2502, 0.0849],
    [0.30, 0.2538, 0.0831],
    [0.35, 0.2586, 0.0816],
    [0.40, 0.2659, 0.0801],
    [0.45, 0.2749, 0.0788],
    [0.50, 0.2861, 0.0781],
    [0.505, 0.2873, 0.0780],
    [0.52, 0.2858, 0.0780],
    [0.55, 0.2810, 0.0781],
    [0.577, 0.2784, 0.0785],
    [0.60, 0.2776, 0.0790],
    [0.65, 0.2804, 0.0809],
    [0.70, 0.2905, 0.0840],
    [0.75, 0.3088, 0.0899],
    [0.80, 0.3389, 0.0998],
    [0.83, 0.3662, 0.1086],
    [0.86, 0.4048, 0.1215],
];

impl Edge {
    /// The scheme of second order: a quarter cell.
    pub const SECOND: Self = Self { offset: 0.25, slope: 0.0, damped: 0.0 };
    /// The scheme of fourth order; measured on the plane punch, the same for any number of cells and any damping.
    pub const FOURTH: Self = Self { offset: 0.2613, slope: 0.0173, damped: 0.0 };

    /// The scheme of the full theory, linear between measured values.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    /// * `damping`: σ of the lateral damping
    pub fn elastic(c_s: f64, damping: f64) -> Self {
        let place = ELASTIC.partition_point(|row| row[0] < c_s).clamp(1, ELASTIC.len() - 1);
        let [below, above] = [ELASTIC[place - 1], ELASTIC[place]];
        let part = ((c_s - below[0]) / (above[0] - below[0])).clamp(0.0, 1.0);
        let [offset, damped] = [1, 2].map(|column| below[column] + part * (above[column] - below[column]));
        let damped = damping / c_s * damped;
        Self { offset: offset + damped, slope: 0.0, damped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_theory_has_measured_offsets() {
        let edge = |c_s, damping| Edge::elastic(c_s, damping).offset;
        assert_eq!((edge(0.5, 0.0), edge(0.05, 0.0), edge(0.865, 0.0)), (0.2861, 0.2403, 0.4048));
        assert!((edge(0.275, 0.0) - 0.2520).abs() < 1e-12);
        assert!((edge(0.5, 0.5) - 0.2861 - 0.0781).abs() < 1e-12);
    }
}
