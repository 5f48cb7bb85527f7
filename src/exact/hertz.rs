//! Quasistatic impact of a rigid ball on a half-space: the contact of Hertz.
//!
//! Waves are left out: every moment is a contact at rest. This holds for slow impacts, whose contact lasts many times as long as a wave
//! takes across it, and for contacts that are small against the ball, whose surface is taken as a paraboloid. With
//! the contact modulus of the half-space, `E* = E/(1 − ν²) = 4c_s²(1 − c_s²)` in units of γc_p² (c_s in units of c_p),
//!
//! ```text
//! a² = ρw      F = (4/3π)·E*·√ρ·w^(3/2)      p = (2E*/πρ)·√(a² − r²)
//! ```
//!
//! and `M·ẅ = −F` conserves energy: with the largest depth `w_m` and `w = w_m·sin^(4/5) φ`
//!
//! ```text
//! ½MV0² = (8/15π)·E*·√ρ·w_m^(5/2)      ẇ = V0·cos φ
//! t = (w_m/V0)·∫_0^v (φ/sin φ)^(1/5) dv      φ = v^(4/5)... see `Hertz::clock`
//! ```
//!
//! until φ = π/2, and back the same way: the contact lasts 2.9433·w_m/V0. K. L. Johnson, *Contact mechanics* (1985), Eq. 4.22 to 4.24
//! and 11.24.

