//! Vectors of neighbouring nodes of a row, in whatever instructions the machine has.
//!
//! Every operation rounds once and none is fused with another, so the bits are the same for vectors of any width.

use std::ops::Range;

use super::stencil::{Patch, Tally, advance};

/// Columns come in packs: the widest vector. Whoever works on vectors works on whole packs.
pub const PACK: usize = 8;

/// Instructions that this machine has: there is no other way to one of these than to ask it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lanes(Kind);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// What every machine has.
    Baseline,
    /// 256-bit vectors with fused multiplication.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Lanes {
    /// What every machine has.
    pub const BASELINE: Self = Self(Kind::Baseline);

    /// The best this machine has.
    pub fn detect() -> Self {
        Self::all().pop().unwrap_or(Self::BASELINE)
    }

    /// All that this machine has, the best one last.
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        use std::arch::is_x86_feature_detected as has;
        let kinds = [
            (Kind::Baseline, true),
            #[cfg(target_arch = "x86_64")]
            (Kind::Avx2, has!("avx2") && has!("fma")),
            #[cfg(target_arch = "x86_64")]
            (Kind::Avx512, has!("avx512f")),
        ];
        kinds.into_iter().filter(|(_, has)| *has).map(|(kind, _)| Self(kind)).collect()
    }

    /// Numbers in a vector.
    pub fn width(self) -> usize {
        match self.0 {
            Kind::Baseline => Pair::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => std::arch::x86_64::__m256d::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => std::arch::x86_64::__m512d::WIDTH,
        }
    }

    /// Advances `rows` of `columns`, whole vectors.
    ///
    /// # Safety
    ///
    /// As [`advance`] about memory; the machine has the instructions.
    #[expect(unsafe_code, reason = "the kernel works in place, by several threads")]
    pub unsafe fn advance(self, patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
        match self.0 {
            // SAFETY: handed on to the caller
            Kind::Baseline => unsafe { advance::<Pair, false>(patch, rows, columns, &[], &mut []) },
            // SAFETY: handed on to the caller; the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::advance_avx2::<false>(patch, rows, columns, &[], &mut []) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::advance_avx512::<false>(patch, rows, columns, &[], &mut []) },
        }
    }

    /// Advances `rows` of `columns`, whole vectors, and adds their energy to their tallies.
    ///
    /// * `area`: cell areas, by column
    /// * `tallies`: of `rows`
    ///
    /// # Safety
    ///
    /// As [`Lanes::advance`].
    #[expect(unsafe_code, reason = "the kernel works in place, by several threads")]
    pub unsafe fn advance_and_count(
        self,
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        tallies: &mut [Tally],
    ) {
        match self.0 {
            // SAFETY: handed on to the caller
            Kind::Baseline => unsafe { advance::<Pair, true>(patch, rows, columns, area, tallies) },
            // SAFETY: handed on to the caller; the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::advance_avx2::<true>(patch, rows, columns, area, tallies) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::advance_avx512::<true>(patch, rows, columns, area, tallies) },
        }
    }
}

/// Some neighbouring numbers.
///
/// # Safety
///
/// All methods: the machine must have the instructions of the vector. `load` and `store`: [`Vector::WIDTH`] numbers may be
/// read or written there.
#[expect(unsafe_code, reason = "instructions that not every machine has")]
#[expect(missing_docs, clippy::missing_safety_doc, reason = "said above, once for all methods")]
pub trait Vector: Copy {
    /// How many.
    const WIDTH: usize;
    unsafe fn load(from: *const f64) -> Self;
    unsafe fn store(self, to: *mut f64);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// `self + 2·other`; twice a number is exact, so this rounds once however it is done.
    unsafe fn add_twice(self, other: Self) -> Self;
    /// Where one vector ends and the next begins: for every number of `before` the one after it, and for every number of
    /// `after` the one before it.
    unsafe fn seam(before: Self, after: Self) -> (Self, Self);
}

/// Two numbers, which compilers know how to keep together on most machines.
#[derive(Clone, Copy)]
pub struct Pair(f64, f64);

#[expect(unsafe_code, reason = "loads and stores; the rest is safe")]
impl Vector for Pair {
    const WIDTH: usize = 2;

    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        // SAFETY: two numbers may be read there
        unsafe { Self(*from, *from.add(1)) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        // SAFETY: two numbers may be written there
        unsafe {
            *to = self.0;
            *to.add(1) = self.1;
        }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }

    #[inline(always)]
    unsafe fn add_twice(self, other: Self) -> Self {
        Self(self.0 + 2.0 * other.0, self.1 + 2.0 * other.1)
    }

    #[inline(always)]
    unsafe fn seam(before: Self, after: Self) -> (Self, Self) {
        (Self(before.1, after.0), Self(before.1, after.0))
    }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
mod x86 {
    use std::{arch::x86_64::*, ops::Range};

    use super::{Vector, advance};
    use crate::model::stencil::{Patch, Tally};

    /// [`advance`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn advance_avx2<const COUNTS: bool>(
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        tallies: &mut [Tally],
    ) {
        // SAFETY: handed on to the caller
        unsafe { advance::<__m256d, COUNTS>(patch, rows, columns, area, tallies) }
    }

    /// [`advance`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f")]
    pub unsafe fn advance_avx512<const COUNTS: bool>(
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        tallies: &mut [Tally],
    ) {
        // SAFETY: handed on to the caller
        unsafe { advance::<__m512d, COUNTS>(patch, rows, columns, area, tallies) }
    }

    // SAFETY of all blocks below: the caller says that the machine has the instructions, and where numbers may be read
    // and written.

    impl Vector for __m256d {
        const WIDTH: usize = 4;

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
        unsafe fn add_twice(self, other: Self) -> Self {
            unsafe { _mm256_fmadd_pd(_mm256_set1_pd(2.0), other, self) }
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
        unsafe fn add_twice(self, other: Self) -> Self {
            unsafe { _mm512_fmadd_pd(_mm512_set1_pd(2.0), other, self) }
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
