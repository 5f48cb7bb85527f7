//! Lanes: neighbouring nodes of a row, in each set of instructions a machine may have.

use std::ops::{Add, Mul, Sub};

/// Columns are computed in blocks of this many: the width of the widest lanes.
pub use crate::model::cone::BLOCK;
use crate::model::number::Number;

/// Numbers by column, with zeros for the columns that fill the last block.
pub fn padded(numbers: impl Iterator<Item = f64>, columns: usize) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.resize(columns, 0.0);
    numbers
}

/// Some neighbouring numbers. They come from memory or from others of their kind: where there are some, the machine has the instructions.
pub trait Lane: Number {
    /// How many.
    const WIDTH: usize;

    /// Zeros.
    ///
    /// # Safety
    ///
    /// The machine has the instructions.
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn zero() -> Self;

    /// # Safety
    ///
    /// The machine has the instructions; [`Lane::WIDTH`] numbers may be read there.
    #[expect(unsafe_code, reason = "fields that threads share")]
    unsafe fn load(from: *const f64) -> Self;

    /// # Safety
    ///
    /// [`Lane::WIDTH`] numbers may be written there.
    #[expect(unsafe_code, reason = "fields that threads share")]
    unsafe fn store(self, to: *mut f64);

    /// The numbers of a row from `i` on.
    ///
    /// # Panics
    ///
    /// If the row ends before.
    #[inline(always)]
    #[expect(unsafe_code, reason = "where there is a vector the machine has the instructions")]
    fn read(self, row: &[f64], i: usize) -> Self {
        let lanes = &row[i..i + Self::WIDTH];
        // SAFETY: `self` is one; so many numbers are there
        unsafe { Self::load(lanes.as_ptr()) }
    }

    /// Puts the numbers into a row from `i` on.
    ///
    /// # Panics
    ///
    /// If the row ends before.
    #[inline(always)]
    #[expect(unsafe_code, reason = "where there is a vector the machine has the instructions")]
    fn write(self, row: &mut [f64], i: usize) {
        let lanes = &mut row[i..i + Self::WIDTH];
        // SAFETY: so many numbers are there
        unsafe { self.store(lanes.as_mut_ptr()) }
    }

    /// Where one vector ends and the next begins: for every number of `before` the one after it, and for every number of
    /// `after` the one before it.
    fn seam(before: Self, after: Self) -> (Self, Self);

    /// The same with the second one after, and the second one before.
    fn wide_seam(before: Self, after: Self) -> (Self, Self);
}

/// Numbers one by one: two, which compilers know how to keep together on most machines, or in tests as many as any vector has.
/// Interpreters and sanitizers look at each of them, and not at what wide instructions load and store.
#[derive(Clone, Copy)]
pub struct Portable<const N: usize>([f64; N]);

impl<const N: usize> Portable<N> {
    #[inline(always)]
    fn of(number: impl Fn(usize) -> f64) -> Self {
        // a plain loop takes an interpreter a quarter of the time
        let (mut numbers, mut i) = ([0.0; N], 0);
        while i < N {
            numbers[i] = number(i);
            i += 1;
        }
        Self(numbers)
    }

    /// The numbers of `before` and then `after`, from number `from` on.
    #[inline(always)]
    fn across(before: Self, after: Self, from: usize) -> Self {
        Self::of(|i| if from + i < N { before.0[from + i] } else { after.0[from + i - N] })
    }
}

impl<const N: usize> Add for Portable<N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::of(|i| self.0[i] + other.0[i])
    }
}

impl<const N: usize> Sub for Portable<N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::of(|i| self.0[i] - other.0[i])
    }
}

impl<const N: usize> Mul for Portable<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::of(|i| self.0[i] * other.0[i])
    }
}

impl<const N: usize> Number for Portable<N> {
    #[inline(always)]
    fn splat(self, number: f64) -> Self {
        Self([number; N])
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        Self::of(|i| self.0[i].add_product(a.0[i], b.0[i]))
    }

    #[inline(always)]
    fn sub_product(self, a: Self, b: Self) -> Self {
        Self::of(|i| self.0[i].sub_product(a.0[i], b.0[i]))
    }

    #[inline(always)]
    fn add_twice(self, other: Self) -> Self {
        Self::of(|i| self.0[i].add_twice(other.0[i]))
    }

    #[inline(always)]
    fn twice_less(self, other: Self) -> Self {
        Self::of(|i| self.0[i].twice_less(other.0[i]))
    }
}

#[expect(unsafe_code, reason = "fields that threads share")]
impl<const N: usize> Lane for Portable<N> {
    const WIDTH: usize = N;

    #[inline(always)]
    unsafe fn zero() -> Self {
        Self([0.0; N])
    }

    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        // SAFETY: N numbers may be read there
        Self::of(|i| unsafe { *from.add(i) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        let mut i = 0;
        while i < N {
            // SAFETY: N numbers may be written there
            unsafe { *to.add(i) = self.0[i] };
            i += 1;
        }
    }

    #[inline(always)]
    fn seam(before: Self, after: Self) -> (Self, Self) {
        (Self::across(before, after, 1), Self::across(before, after, N - 1))
    }

    #[inline(always)]
    fn wide_seam(before: Self, after: Self) -> (Self, Self) {
        (Self::across(before, after, 2), Self::across(before, after, N - 2))
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Add, Lane, Mul, Number, Sub};

    // SAFETY of all blocks below: where there is a vector, the machine has its instructions, see `Lane`; the caller of `load` and `store`
    // says that, and where numbers may be read and written.

    /// Lanes of one set of instructions: what does each of the operations, and both seams.
    macro_rules! lanes {
        ($name:ident($vector:ty), $width:literal, $load:ident, $store:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident,
         $add_product:ident, $sub_product:ident, $product_less:ident, $seams:ident) => {
            #[derive(Clone, Copy)]
            pub struct $name($vector);

            impl Add for $name {
                type Output = Self;

                #[inline(always)]
                fn add(self, other: Self) -> Self {
                    Self(unsafe { $add(self.0, other.0) })
                }
            }

            impl Sub for $name {
                type Output = Self;

                #[inline(always)]
                fn sub(self, other: Self) -> Self {
                    Self(unsafe { $sub(self.0, other.0) })
                }
            }

            impl Mul for $name {
                type Output = Self;

                #[inline(always)]
                fn mul(self, other: Self) -> Self {
                    Self(unsafe { $mul(self.0, other.0) })
                }
            }

            impl Number for $name {
                #[inline(always)]
                fn splat(self, number: f64) -> Self {
                    Self(unsafe { $splat(number) })
                }

                #[inline(always)]
                fn add_product(self, a: Self, b: Self) -> Self {
                    Self(unsafe { $add_product(a.0, b.0, self.0) })
                }

                #[inline(always)]
                fn sub_product(self, a: Self, b: Self) -> Self {
                    Self(unsafe { $sub_product(a.0, b.0, self.0) })
                }

                #[inline(always)]
                fn add_twice(self, other: Self) -> Self {
                    Self(unsafe { $add_product($splat(2.0), other.0, self.0) })
                }

                #[inline(always)]
                fn twice_less(self, other: Self) -> Self {
                    Self(unsafe { $product_less($splat(2.0), self.0, other.0) })
                }
            }

            impl Lane for $name {
                const WIDTH: usize = $width;

                #[inline(always)]
                unsafe fn zero() -> Self {
                    Self(unsafe { $splat(0.0) })
                }

                #[inline(always)]
                unsafe fn load(from: *const f64) -> Self {
                    Self(unsafe { $load(from) })
                }

                #[inline(always)]
                unsafe fn store(self, to: *mut f64) {
                    unsafe { $store(to, self.0) }
                }

                #[inline(always)]
                fn seam(before: Self, after: Self) -> (Self, Self) {
                    let (outside, inside) = unsafe { $seams::<1>(before.0, after.0) };
                    (Self(outside), Self(inside))
                }

                #[inline(always)]
                fn wide_seam(before: Self, after: Self) -> (Self, Self) {
                    let (outside, inside) = unsafe { $seams::<2>(before.0, after.0) };
                    (Self(outside), Self(inside))
                }
            }
        };
    }

    lanes!(
        Avx2(__m256d),
        4,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        _mm256_set1_pd,
        _mm256_add_pd,
        _mm256_sub_pd,
        _mm256_mul_pd,
        _mm256_fmadd_pd,
        _mm256_fnmadd_pd,
        _mm256_fmsub_pd,
        seams_of_4
    );
    lanes!(
        Avx512(__m512d),
        8,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        _mm512_set1_pd,
        _mm512_add_pd,
        _mm512_sub_pd,
        _mm512_mul_pd,
        _mm512_fmadd_pd,
        _mm512_fnmadd_pd,
        _mm512_fmsub_pd,
        seams_of_8
    );

    /// Both numbers of [`Lane::seam`] (`BY` 1) or [`Lane::wide_seam`] (2).
    #[inline(always)]
    unsafe fn seams_of_4<const BY: usize>(before: __m256d, after: __m256d) -> (__m256d, __m256d) {
        unsafe {
            // the last two of `before` and the first two of `after`
            let middle = _mm256_permute2f128_pd::<0x21>(before, after);
            match BY {
                1 => {
                    (_mm256_shuffle_pd::<0b0101>(before, middle), _mm256_shuffle_pd::<0b0101>(middle, after))
                }
                _ => (middle, middle),
            }
        }
    }

    /// The same for 8.
    #[inline(always)]
    unsafe fn seams_of_8<const BY: usize>(before: __m512d, after: __m512d) -> (__m512d, __m512d) {
        unsafe {
            let (b, a) = (_mm512_castpd_si512(before), _mm512_castpd_si512(after));
            let (outside, inside) = match BY {
                1 => (_mm512_alignr_epi64::<1>(a, b), _mm512_alignr_epi64::<7>(a, b)),
                _ => (_mm512_alignr_epi64::<2>(a, b), _mm512_alignr_epi64::<6>(a, b)),
            };
            (_mm512_castsi512_pd(outside), _mm512_castsi512_pd(inside))
        }
    }
}
