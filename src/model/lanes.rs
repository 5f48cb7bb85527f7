//! Vectors of neighbouring nodes of a row, in whatever instructions the machine has.
//!
//! Every operation rounds once and none is fused with another, so the bits are the same for vectors of any width.

use std::ops::Range;

use super::stencil::{Interleaved, Patch, Rows, Tally, add_energy, add_kinetic, advance};

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

    /// Adds the energy of some columns of a row to its tally, see [`add_energy`].
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    pub fn add_energy(self, rows: Rows<'_>, area: &[f64], face: &[f64], first: usize, tally: &mut Tally) {
        match self.0 {
            // SAFETY: every machine has these
            Kind::Baseline => unsafe { add_energy::<Pair>(rows, area, face, first, tally) },
            // SAFETY: the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::add_energy_avx2(rows, area, face, first, tally) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::add_energy_avx512(rows, area, face, first, tally) },
        }
    }

    /// Adds the kinetic energy of some columns of a row to its sum, see [`add_kinetic`].
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    pub fn add_kinetic(
        self,
        earlier: &[f64],
        later: &[f64],
        area: &[f64],
        first: usize,
        sum: &mut Interleaved,
    ) {
        match self.0 {
            // SAFETY: every machine has these
            Kind::Baseline => unsafe { add_kinetic::<Pair>(earlier, later, area, first, sum) },
            // SAFETY: the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::add_kinetic_avx2(earlier, later, area, first, sum) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::add_kinetic_avx512(earlier, later, area, first, sum) },
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
            Kind::Baseline => unsafe { advance::<Pair>(patch, rows, columns) },
            // SAFETY: handed on to the caller; the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::advance_avx2(patch, rows, columns) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::advance_avx512(patch, rows, columns) },
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

    use super::{Vector, add_energy, add_kinetic, advance};
    use crate::model::stencil::{Interleaved, Patch, Rows, Tally};

    /// [`advance`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn advance_avx2(patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
        // SAFETY: handed on to the caller
        unsafe { advance::<__m256d>(patch, rows, columns) }
    }

    /// [`advance`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f")]
    pub unsafe fn advance_avx512(patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
        // SAFETY: handed on to the caller
        unsafe { advance::<__m512d>(patch, rows, columns) }
    }

    /// [`add_energy`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn add_energy_avx2(
        rows: Rows<'_>,
        area: &[f64],
        face: &[f64],
        first: usize,
        tally: &mut Tally,
    ) {
        // SAFETY: handed on to the caller
        unsafe { add_energy::<__m256d>(rows, area, face, first, tally) }
    }

    /// [`add_energy`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f")]
    pub unsafe fn add_energy_avx512(
        rows: Rows<'_>,
        area: &[f64],
        face: &[f64],
        first: usize,
        tally: &mut Tally,
    ) {
        // SAFETY: handed on to the caller
        unsafe { add_energy::<__m512d>(rows, area, face, first, tally) }
    }

    /// [`add_kinetic`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn add_kinetic_avx2(
        earlier: &[f64],
        later: &[f64],
        area: &[f64],
        first: usize,
        sum: &mut Interleaved,
    ) {
        // SAFETY: handed on to the caller
        unsafe { add_kinetic::<__m256d>(earlier, later, area, first, sum) }
    }

    /// [`add_kinetic`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f")]
    pub unsafe fn add_kinetic_avx512(
        earlier: &[f64],
        later: &[f64],
        area: &[f64],
        first: usize,
        sum: &mut Interleaved,
    ) {
        // SAFETY: handed on to the caller
        unsafe { add_kinetic::<__m512d>(earlier, later, area, first, sum) }
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
