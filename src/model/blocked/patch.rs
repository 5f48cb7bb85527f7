//! Part of a field, as the kernels get it.

/// Part of a field that is advanced in place.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Node (0, 0) of level k−1.
    pub before: *const f64,
    /// Node (0, 0) of level k.
    pub now: *const f64,
    /// Node (0, 0) of level k+1, which is written; without the mixed-derivative correction it may be level k−1 itself.
    pub next: *mut f64,
    /// Distance from a node to the one below it, in numbers.
    pub stride: usize,
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub outward: &'a [f64],
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub inward: &'a [f64],
    /// The mixed-derivative correction, if there is one.
    pub corner: Option<CornerTerm<'a>>,
}

/// The mixed-derivative correction of the scheme, see [`crate::model::scheme::Corner`].
#[derive(Clone, Copy)]
pub struct CornerTerm<'a> {
    /// ρ: share of level k−1 in the combination of levels.
    pub share: f64,
    /// Radial weights times α, by column, see [`crate::model::scheme::corner_weights`].
    pub outward: &'a [f64],
    /// Radial weights times α, by column.
    pub inward: &'a [f64],
}
