//! Vectors of neighbouring nodes of a row, in each set of instructions a machine may have.
//!
//! Every operation rounds once, products that are added are fused with their sum where the scheme says so and nowhere else: the bits are the same
//! for vectors of any width.

/// Columns are computed in blocks of this many: the width of the widest vector.
pub use crate::model::cone::BLOCK;

/// Numbers by column, with zeros for the columns that fill the last block.
pub fn padded(numbers: impl Iterator<Item = f64>, columns: usize) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.resize(columns, 0.0);
    numbers
}

/// Plain loops that compilers make vectors of, for any instructions.
pub trait Work {
    /// What it gives: the same bits with any instructions.
    type Output;
    /// Does it; always inlined, as are the functions that it calls, so that a caller compiled for wider vectors gets them here.
    fn run(self) -> Self::Output;
}

/// Some neighbouring numbers.
///
/// # Safety
///
/// All methods: the machine must have the instructions of the vector. `load` and `store`: [`Vector::WIDTH`] numbers may be
/// read or written there.
#[expect(unsafe_code, reason = "instructions that not every machine has")]
pub trait Vector: Copy {
    /// How many.
    const WIDTH: usize;
    /// How many vectors the machine has at hand.
    const REGISTERS: usize;
    unsafe fn load(from: *const f64) -> Self;
    unsafe fn store(self, to: *mut f64);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// `self + a·b`, rounded once.
    unsafe fn add_product(self, a: Self, b: Self) -> Self;
    /// `self − a·b`, rounded once.
    unsafe fn sub_product(self, a: Self, b: Self) -> Self;
    /// `self + 2·other`; twice a number is exact, so this rounds once however it is done.
    unsafe fn add_twice(self, other: Self) -> Self;
    /// `2·self − other`; rounds once, too.
    unsafe fn twice_less(self, other: Self) -> Self;
    /// The same number everywhere.
    unsafe fn splat(number: f64) -> Self;
    /// Where one vector ends and the next begins: for every number of `before` the one after it, and for every number of
    /// `after` the one before it.
    unsafe fn seam(before: Self, after: Self) -> (Self, Self);
    /// The same with the second one after, and the second one before.
    unsafe fn wide_seam(before: Self, after: Self) -> (Self, Self);
}

/// Numbers one by one: two, which compilers know how to keep together on most machines, or in tests as many as any vector has.
/// Interpreters and sanitizers look at each of them, and not at what wide instructions load and store.
#[derive(Clone, Copy)]
pub struct Lanes<const N: usize>([f64; N]);

impl<const N: usize> Lanes<N> {
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

#[expect(unsafe_code, reason = "loads and stores; the rest is safe")]
impl<const N: usize> Vector for Lanes<N> {
    const WIDTH: usize = N;
    // in tests those of 8 numbers go the way of 512-bit vectors
    const REGISTERS: usize = if N == BLOCK { 32 } else { 16 };

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
    unsafe fn add(self, other: Self) -> Self {
        Self::of(|i| self.0[i] + other.0[i])
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        Self::of(|i| self.0[i] - other.0[i])
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        Self::of(|i| self.0[i] * other.0[i])
    }

    #[inline(always)]
    unsafe fn add_product(self, a: Self, b: Self) -> Self {
        Self::of(|i| a.0[i].mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    unsafe fn sub_product(self, a: Self, b: Self) -> Self {
        Self::of(|i| (-a.0[i]).mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    unsafe fn add_twice(self, other: Self) -> Self {
        Self::of(|i| self.0[i] + 2.0 * other.0[i])
    }

    #[inline(always)]
    unsafe fn twice_less(self, other: Self) -> Self {
        Self::of(|i| 2.0 * self.0[i] - other.0[i])
    }

    #[inline(always)]
    unsafe fn splat(number: f64) -> Self {
        Self([number; N])
    }

    #[inline(always)]
    unsafe fn seam(before: Self, after: Self) -> (Self, Self) {
        (Self::across(before, after, 1), Self::across(before, after, N - 1))
    }

    #[inline(always)]
    unsafe fn wide_seam(before: Self, after: Self) -> (Self, Self) {
        (Self::across(before, after, 2), Self::across(before, after, N - 2))
    }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Vector;

    // SAFETY of all blocks below: the caller says that the machine has the instructions, and where numbers may be read
    // and written.

    impl Vector for __m256d {
        const WIDTH: usize = 4;
        const REGISTERS: usize = 16;

        #[inline(always)]
        unsafe fn load(from: *const f64) -> Self {
            unsafe { _mm256_loadu_pd(from) }
        }

        #[inline(always)]
        unsafe fn store(self, to: *mut f64) {
            unsafe { _mm256_storeu_pd(to, self) }
        }

        #[inline(always)]
        unsafe fn add(self, other: Self) -> Self {
            unsafe { _mm256_add_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn sub(self, other: Self) -> Self {
            unsafe { _mm256_sub_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn mul(self, other: Self) -> Self {
            unsafe { _mm256_mul_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn add_product(self, a: Self, b: Self) -> Self {
            unsafe { _mm256_fmadd_pd(a, b, self) }
        }

        #[inline(always)]
        unsafe fn sub_product(self, a: Self, b: Self) -> Self {
            unsafe { _mm256_fnmadd_pd(a, b, self) }
        }

        #[inline(always)]
        unsafe fn add_twice(self, other: Self) -> Self {
            unsafe { _mm256_fmadd_pd(_mm256_set1_pd(2.0), other, self) }
        }

        #[inline(always)]
        unsafe fn twice_less(self, other: Self) -> Self {
            unsafe { _mm256_fmsub_pd(_mm256_set1_pd(2.0), self, other) }
        }

        #[inline(always)]
        unsafe fn splat(number: f64) -> Self {
            unsafe { _mm256_set1_pd(number) }
        }

        #[inline(always)]
        unsafe fn wide_seam(before: Self, after: Self) -> (Self, Self) {
            // the last two of `before` and the first two of `after`
            let middle = unsafe { _mm256_permute2f128_pd::<0x21>(before, after) };
            (middle, middle)
        }

        #[inline(always)]
        unsafe fn seam(before: Self, after: Self) -> (Self, Self) {
            unsafe {
                // the last two of `before` and the first two of `after`
                let middle = _mm256_permute2f128_pd::<0x21>(before, after);
                (_mm256_shuffle_pd::<0b0101>(before, middle), _mm256_shuffle_pd::<0b0101>(middle, after))
            }
        }
    }

    impl Vector for __m512d {
        const WIDTH: usize = 8;
        const REGISTERS: usize = 32;

        #[inline(always)]
        unsafe fn load(from: *const f64) -> Self {
            unsafe { _mm512_loadu_pd(from) }
        }

        #[inline(always)]
        unsafe fn store(self, to: *mut f64) {
            unsafe { _mm512_storeu_pd(to, self) }
        }

        #[inline(always)]
        unsafe fn add(self, other: Self) -> Self {
            unsafe { _mm512_add_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn sub(self, other: Self) -> Self {
            unsafe { _mm512_sub_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn mul(self, other: Self) -> Self {
            unsafe { _mm512_mul_pd(self, other) }
        }

        #[inline(always)]
        unsafe fn add_product(self, a: Self, b: Self) -> Self {
            unsafe { _mm512_fmadd_pd(a, b, self) }
        }

        #[inline(always)]
        unsafe fn sub_product(self, a: Self, b: Self) -> Self {
            unsafe { _mm512_fnmadd_pd(a, b, self) }
        }

        #[inline(always)]
        unsafe fn add_twice(self, other: Self) -> Self {
            unsafe { _mm512_fmadd_pd(_mm512_set1_pd(2.0), other, self) }
        }

        #[inline(always)]
        unsafe fn twice_less(self, other: Self) -> Self {
            unsafe { _mm512_fmsub_pd(_mm512_set1_pd(2.0), self, other) }
        }

        #[inline(always)]
        unsafe fn splat(number: f64) -> Self {
            unsafe { _mm512_set1_pd(number) }
        }

        #[inline(always)]
        unsafe fn wide_seam(before: Self, after: Self) -> (Self, Self) {
            unsafe {
                let (b, a) = (_mm512_castpd_si512(before), _mm512_castpd_si512(after));
                (
                    _mm512_castsi512_pd(_mm512_alignr_epi64::<2>(a, b)),
                    _mm512_castsi512_pd(_mm512_alignr_epi64::<6>(a, b)),
                )
            }
        }

        #[inline(always)]
        unsafe fn seam(before: Self, after: Self) -> (Self, Self) {
            unsafe {
                let (b, a) = (_mm512_castpd_si512(before), _mm512_castpd_si512(after));
                (
                    _mm512_castsi512_pd(_mm512_alignr_epi64::<1>(a, b)),
                    _mm512_castsi512_pd(_mm512_alignr_epi64::<7>(a, b)),
                )
            }
        }
    }
}
