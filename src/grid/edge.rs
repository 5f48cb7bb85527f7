//! Where schemes see the edge of a contact.

use crate::table::table;

/// Where a matched mesh sees a sharp punch edge, in cells past the last contact node: at `offset − slope·(1 − λ)`, with the radial
/// Courant number λ. With the edge there stresses converge at second order, and the drag of a plane flat punch is exact (order 2)
/// or within 1e-6 (order 4; full theory, 200 cells: 2e-5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Offset for λ = 1.
    pub offset: f64,
    /// How it falls with λ.
    pub slope: f64,
}

/// β = c_s/c_p and offset. Measured on the plane punch with 60 cells, whose drag is known; the kink is where the stiffness k of the
/// cells reaches its limit. Lateral damping adds less than 0.001 for β ≥ 0.3, 0.009 at 0.2.
const ELASTIC: [[f64; 2]; 20] = [
    [0.10, 0.2403],
    [0.15, 0.2453],
    [0.20, 0.2466],
    [0.25, 0.2502],
    [0.30, 0.2538],
    [0.35, 0.2586],
    [0.40, 0.2659],
    [0.45, 0.2749],
    [0.50, 0.2861],
    [0.505, 0.2873],
    [0.52, 0.2858],
    [0.55, 0.2810],
    [0.577, 0.2784],
    [0.60, 0.2776],
    [0.65, 0.2804],
    [0.70, 0.2905],
    [0.75, 0.3088],
    [0.80, 0.3389],
    [0.83, 0.3662],
    [0.86, 0.4048],
];

impl Edge {
    /// The scheme of second order: a quarter cell.
    pub const SECOND: Self = Self { offset: 0.25, slope: 0.0 };
    /// The scheme of fourth order; measured on the plane punch, the same for any number of cells and any damping.
    pub const FOURTH: Self = Self { offset: 0.2613, slope: 0.0173 };

    /// The scheme of the full theory, linear between measured values.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    pub fn elastic(c_s: f64) -> Self {
        let offset = table(&ELASTIC.map(|row| row[0]), c_s, |i| ELASTIC[i][1]);
        Self { offset, slope: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_theory_has_measured_offsets() {
        let edge = |c_s| Edge::elastic(c_s).offset;
        assert_eq!((edge(0.5), edge(0.05), edge(0.865)), (0.2861, 0.2403, 0.4048));
        assert!((edge(0.275) - 0.2520).abs() < 1e-12);
    }
}
