//! Work compiled for each set of instructions, and the choice among them.

use std::fmt;

#[cfg(target_arch = "x86_64")]
use super::lane::{Avx2, Avx512};
use super::lane::{Lane, Portable};

/// Work on lanes. Closures and maps of arrays are not inlined for certain into what is compiled for wider lanes: in loops there are none.
pub trait Work {
    /// What it gives: the same bits with any instructions.
    type Output;
    /// Does it; always inlined, as are the functions that it calls, so that a caller compiled for wider lanes gets them here.
    ///
    /// * `zero`: zeros, which says that the machine has the instructions
    fn run<L: Lane>(self, zero: L) -> Self::Output;
}

/// Instructions that this machine has: [`Instructions::all`] and [`Instructions::detect`] are the only ways to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instructions(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    /// What every machine has.
    Baseline,
    /// 256-bit vectors with fused multiplication.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// 4 and 8 numbers, one by one.
    #[cfg(test)]
    Plain4,
    #[cfg(test)]
    Plain8,
}

impl fmt::Display for Instructions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "AVX-512",
            _ if cfg!(target_arch = "x86_64") => "no AVX2 and FMA: slowly, with the same results",
            _ => std::env::consts::ARCH,
        })
    }
}

impl Instructions {
    /// What every machine has.
    pub const BASELINE: Self = Self(Set::Baseline);

    /// Lanes of any width, whose loads and stores are of single numbers.
    #[cfg(test)]
    pub const PLAIN: [Self; 3] = [Self(Set::Baseline), Self(Set::Plain4), Self(Set::Plain8)];

    /// The best this machine has.
    pub fn detect() -> Self {
        Self::all().pop().unwrap_or(Self::BASELINE)
    }

    /// All that this machine has, the best one last. `--cfg percuss_without_avx512` leaves the widest out, to measure what other
    /// machines do.
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        use std::arch::is_x86_feature_detected as has;
        let sets = [
            (Set::Baseline, true),
            #[cfg(target_arch = "x86_64")]
            (Set::Avx2, has!("avx2") && has!("fma")),
            #[cfg(target_arch = "x86_64")]
            (Set::Avx512, cfg!(not(percuss_without_avx512)) && has!("avx512f") && has!("fma")),
        ];
        sets.into_iter().filter(|(_, has)| *has).map(|(set, _)| Self(set)).collect()
    }

    /// Numbers in a vector.
    pub fn width(self) -> usize {
        /// Says how wide its lanes are.
        struct Width;

        impl Work for Width {
            type Output = usize;

            #[inline(always)]
            fn run<L: Lane>(self, _: L) -> usize {
                L::WIDTH
            }
        }
        self.run(Width)
    }

    /// What work gives.
    pub fn run<W: Work>(self, work: W) -> W::Output {
        /// For 256-bit vectors.
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn avx2<W: Work>(work: W) -> W::Output {
            // SAFETY: this function has them
            #[expect(unsafe_code, reason = "instructions that not every machine has")]
            work.run(unsafe { Avx2::zero() })
        }

        /// For 512-bit vectors.
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,fma")]
        fn avx512<W: Work>(work: W) -> W::Output {
            // SAFETY: likewise
            #[expect(unsafe_code, reason = "instructions that not every machine has")]
            work.run(unsafe { Avx512::zero() })
        }

        /// Numbers one by one, which every machine has.
        fn portable<W: Work, const N: usize>(work: W) -> W::Output {
            // SAFETY: there are no instructions that a machine may not have
            #[expect(unsafe_code, reason = "instructions that not every machine has")]
            work.run(unsafe { Portable::<N>::zero() })
        }

        match self.0 {
            Set::Baseline => portable::<W, 2>(work),
            // SAFETY, here and below: `all` has found the instructions
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "instructions that not every machine has")]
            Set::Avx2 => unsafe { avx2(work) },
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "instructions that not every machine has")]
            Set::Avx512 => unsafe { avx512(work) },
            #[cfg(test)]
            Set::Plain4 => portable::<W, 4>(work),
            #[cfg(test)]
            Set::Plain8 => portable::<W, 8>(work),
        }
    }
}
