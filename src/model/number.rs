//! Numbers that the operators of the schemes are written for: one, or neighbouring ones of a row at once.
//!
//! Every operation rounds once. A product that is added to something is fused with the sum where an operator says so and nowhere else, so
//! the bits are the same for any number of neighbours.

use std::ops::{Add, Mul, Sub};

/// One number, or some neighbouring ones of a row.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A number, everywhere.
    fn splat(self, number: f64) -> Self;
    /// `self + a·b`, rounded once.
    fn add_product(self, a: Self, b: Self) -> Self;
    /// `self − a·b`, rounded once.
    fn sub_product(self, a: Self, b: Self) -> Self;
    /// `self + 2·other`; twice a number is exact, so this rounds once however it is done.
    fn add_twice(self, other: Self) -> Self;
    /// `2·self − other`; rounds once, too.
    fn twice_less(self, other: Self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn splat(self, number: f64) -> Self {
        number
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn sub_product(self, a: Self, b: Self) -> Self {
        (-a).mul_add(b, self)
    }

    #[inline(always)]
    fn add_twice(self, other: Self) -> Self {
        self + 2.0 * other
    }

    #[inline(always)]
    fn twice_less(self, other: Self) -> Self {
        2.0 * self - other
    }
}

/// The C library of MinGW rounds `fma` twice, and [`f64::mul_add`] calls it where code is compiled for processors without fused
/// multiplication. This one, of the same name, is linked in its place.
#[cfg(all(windows, target_env = "gnu"))]
#[expect(unsafe_code, reason = "a name of the C library")]
// SAFETY: the same signature, and what C says of `fma`
#[unsafe(no_mangle)]
extern "C" fn fma(a: f64, b: f64, c: f64) -> f64 {
    libm::fma(a, b, c)
}
