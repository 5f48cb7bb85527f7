//! Complex numbers, as far as the contour of `lamb` needs them.

use std::ops::{Add, Div, Mul, Neg};

/// `re + i·im`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Complex {
    pub re: f64,
    pub im: f64,
}

impl Complex {
    /// Principal square root: its real part is not negative, and its imaginary part has the sign of `im`, that of zero
    /// included.
    pub fn sqrt(self) -> Self {
        let size = self.re.hypot(self.im);
        // the half of the root without cancellation, then the other by 2·re·im
        let larger = (0.5 * (size + self.re.abs())).sqrt();
        let smaller = if larger == 0.0 { 0.0 } else { 0.5 * self.im.abs() / larger };
        let (re, im) = if self.re >= 0.0 { (larger, smaller) } else { (smaller, larger) };
        Self { re, im: im.copysign(self.im) }
    }
}

impl From<f64> for Complex {
    fn from(re: f64) -> Self {
        Self { re, im: 0.0 }
    }
}

impl Add for Complex {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Add<f64> for Complex {
    type Output = Self;

    fn add(self, other: f64) -> Self {
        Self { re: self.re + other, im: self.im }
    }
}

impl Neg for Complex {
    type Output = Self;

    fn neg(self) -> Self {
        Self { re: -self.re, im: -self.im }
    }
}

impl Mul for Complex {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl Mul<f64> for Complex {
    type Output = Self;

    fn mul(self, other: f64) -> Self {
        Self { re: self.re * other, im: self.im * other }
    }
}

impl Div for Complex {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let size = other.re * other.re + other.im * other.im;
        self * Self { re: other.re / size, im: -other.im / size }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_and_quotients() {
        for (re, im) in
            [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (1e-9, -2.0), (0.0, 0.0), (-5.0, -0.0), (7.0, 0.0)]
        {
            let z = Complex { re, im };
            let root = z.sqrt();
            let square = root * root;
            assert!(
                (square.re - re).abs() < 1e-14 * 7.0 && (square.im - im).abs() < 1e-14 * 7.0,
                "{z:?} {root:?}"
            );
            assert!(root.re >= 0.0 && root.im.is_sign_negative() == im.is_sign_negative());
            let back = (z * Complex { re: 0.3, im: -2.0 }) / Complex { re: 0.3, im: -2.0 };
            assert!((back.re - re).abs() < 1e-14 && (back.im - im).abs() < 1e-14);
        }
        assert_eq!(-Complex::from(2.0) + Complex { re: 1.0, im: 3.0 } + 4.0, Complex { re: 3.0, im: 3.0 });
    }
}
