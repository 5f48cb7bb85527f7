//! The kernel compiled for each set of instructions, and the choice among them.

use std::{fmt, ops::Range};

use super::{
    cells::{CellPatch, cell_march},
    energy::EnergySum,
    kernel::advance,
    levels::Patch,
    vector::{Lanes, Vector, Work},
};

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

    /// Vectors of any width, whose loads and stores are of single numbers.
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
        match self.0 {
            Set::Baseline => Lanes::<2>::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => std::arch::x86_64::__m256d::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => std::arch::x86_64::__m512d::WIDTH,
            #[cfg(test)]
            Set::Plain4 => Lanes::<4>::WIDTH,
            #[cfg(test)]
            Set::Plain8 => Lanes::<8>::WIDTH,
        }
    }

    /// Advances `rows` of `columns`, whole vectors, and if `COUNTS` adds their energy to `sums`.
    ///
    /// * `area`: cell areas, by column; none if nothing is counted
    /// * `sums`: of `rows`; none if nothing is counted
    ///
    /// # Safety
    ///
    /// As [`advance`] about memory; the machine has the instructions, or there would be no `self`.
    #[expect(unsafe_code, reason = "the kernel works in place, on several threads")]
    pub unsafe fn advance<const COUNTS: bool>(
        self,
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        sums: &mut [EnergySum],
    ) {
        match self.0 {
            // SAFETY: memory is the caller's promise; every machine has these instructions
            Set::Baseline => unsafe { advance::<Lanes<2>, COUNTS>(patch, rows, columns, area, sums) },
            // SAFETY: memory is the caller's promise; `all` has found the instructions
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { x86::advance_avx2::<COUNTS>(patch, rows, columns, area, sums) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { x86::advance_avx512::<COUNTS>(patch, rows, columns, area, sums) },
            // SAFETY: as for the baseline
            #[cfg(test)]
            Set::Plain4 => unsafe { advance::<Lanes<4>, COUNTS>(patch, rows, columns, area, sums) },
            // SAFETY: likewise
            #[cfg(test)]
            Set::Plain8 => unsafe { advance::<Lanes<8>, COUNTS>(patch, rows, columns, area, sums) },
        }
    }

    /// Advances `columns`, whole vectors, of row `j` of both displacements, and if `COUNTS` adds their energy to `energy`.
    ///
    /// # Safety
    ///
    /// As [`cell_march`] about memory; the machine has the instructions, or there would be no `self`.
    #[expect(unsafe_code, reason = "the kernel works in place, on several threads")]
    pub unsafe fn advance_cells<const ROW: usize, const COUNTS: bool>(
        self,
        patch: CellPatch<'_>,
        j: usize,
        columns: Range<usize>,
        energy: &mut EnergySum,
    ) {
        match self.0 {
            // SAFETY: memory is the caller's promise; every machine has these instructions
            Set::Baseline => unsafe { cell_march::<Lanes<2>, ROW, COUNTS>(patch, j, columns, energy) },
            // SAFETY: memory is the caller's promise; `all` has found the instructions
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { x86::cells_avx2::<ROW, COUNTS>(patch, j, columns, energy) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { x86::cells_avx512::<ROW, COUNTS>(patch, j, columns, energy) },
            // SAFETY: as for the baseline
            #[cfg(test)]
            Set::Plain4 => unsafe { cell_march::<Lanes<4>, ROW, COUNTS>(patch, j, columns, energy) },
            // SAFETY: likewise
            #[cfg(test)]
            Set::Plain8 => unsafe { cell_march::<Lanes<8>, ROW, COUNTS>(patch, j, columns, energy) },
        }
    }

    /// What work gives.
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        match self.0 {
            // SAFETY: `all` has found the instructions
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { x86::run_avx2(work) },
            // SAFETY: likewise
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { x86::run_avx512(work) },
            _ => work.run(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
mod x86 {
    use std::{
        arch::x86_64::{__m256d, __m512d},
        ops::Range,
    };

    use super::{CellPatch, EnergySum, Patch, Work, advance, cell_march};

    /// [`advance`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn advance_avx2<const COUNTS: bool>(
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        sums: &mut [EnergySum],
    ) {
        // SAFETY: the caller's promise; the function is compiled for these instructions
        unsafe { advance::<__m256d, COUNTS>(patch, rows, columns, area, sums) }
    }

    /// [`advance`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f,fma")]
    pub unsafe fn advance_avx512<const COUNTS: bool>(
        patch: Patch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &[f64],
        sums: &mut [EnergySum],
    ) {
        // SAFETY: the caller's promise; the function is compiled for these instructions
        unsafe { advance::<__m512d, COUNTS>(patch, rows, columns, area, sums) }
    }

    /// [`super::Instructions::run`] for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub fn run_avx2<W: Work>(work: W) -> W::Output {
        work.run()
    }

    /// [`super::Instructions::run`] for 512-bit vectors.
    #[target_feature(enable = "avx512f,fma")]
    pub fn run_avx512<W: Work>(work: W) -> W::Output {
        work.run()
    }

    /// [`cell_march`] compiled for 256-bit vectors.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn cells_avx2<const ROW: usize, const COUNTS: bool>(
        patch: CellPatch<'_>,
        j: usize,
        columns: Range<usize>,
        energy: &mut EnergySum,
    ) {
        // SAFETY: the caller's promise; the function is compiled for these instructions
        unsafe { cell_march::<__m256d, ROW, COUNTS>(patch, j, columns, energy) }
    }

    /// [`cell_march`] compiled for 512-bit vectors.
    #[target_feature(enable = "avx512f,fma")]
    pub unsafe fn cells_avx512<const ROW: usize, const COUNTS: bool>(
        patch: CellPatch<'_>,
        j: usize,
        columns: Range<usize>,
        energy: &mut EnergySum,
    ) {
        // SAFETY: the caller's promise; the function is compiled for these instructions
        unsafe { cell_march::<__m512d, ROW, COUNTS>(patch, j, columns, energy) }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{energy::RowEnergy, vector::BLOCK},
        *,
    };

    #[test]
    fn the_energy_of_a_row_is_the_plain_sum_with_any_instructions_and_cuts() {
        let columns = 9 * BLOCK;
        let stride = columns + 2 * BLOCK;
        let noise = |seed: usize, length: usize| -> Vec<f64> {
            (0..length).map(|i| ((i * 7 + seed * 13) % 31) as f64 / 31.0 - 0.4).collect()
        };
        // two rows abreast and one alone, with a row and a block around them
        let [before, now] = [0, 1].map(|seed| noise(seed, 5 * stride));
        let [outward, inward, area] = [2, 3, 4].map(|seed| noise(seed, columns));
        let advanced = |instructions: Instructions, cuts: &[usize]| {
            let (mut next, mut sums) = (before.clone(), [EnergySum::default(); 3]);
            let (read, write) = (now[BLOCK..].as_ptr(), next[BLOCK..].as_mut_ptr());
            let patch = Patch {
                before: write,
                now: read,
                next: write,
                stride,
                around: None,
                outward: &outward,
                inward: &inward,
                corner: None,
            };
            for cut in cuts.windows(2) {
                // SAFETY: a row and a block are left on all sides
                #[expect(unsafe_code, reason = "the function under test")]
                unsafe {
                    instructions.advance::<true>(patch, 1..4, cut[0]..cut[1], &area, &mut sums);
                }
            }
            (next, sums.map(|sum| sum.total()))
        };
        let baseline = advanced(Instructions::BASELINE, &[0, columns]);
        let (next, energies) = &baseline;
        for (j, energy) in (1..).zip(energies) {
            let row = |level: &[f64]| level[j * stride + BLOCK..][..columns].to_vec();
            let [before, now, next] = [&before, &now, next].map(|level| row(level));
            let mut plain = RowEnergy::default();
            for i in 0..columns {
                let force = next[i] - 2.0 * now[i] + before[i];
                let moved = [now[i] - before[i], next[i] - now[i]];
                for (place, ends) in [before[i], next[i]].into_iter().enumerate() {
                    plain.kinetic[place] += area[i] * moved[place].powi(2);
                    plain.strain[place] -= area[i] * ends * force;
                }
            }
            let numbers = |energy: &RowEnergy| [energy.kinetic, energy.strain].concat();
            let pairs: Vec<_> = numbers(energy).into_iter().zip(numbers(&plain)).collect();
            assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-13), "{energy:?} {plain:?}");
            let surface = EnergySum::of_surface(&area, [&before, &now, &next], &next).total();
            assert_eq!(*energy, surface);
        }
        for instructions in Instructions::all().into_iter().chain(Instructions::PLAIN) {
            let w = instructions.width();
            for cuts in [vec![0, columns], vec![0, w, columns], vec![0, 3 * w, 4 * w, columns - w, columns]] {
                assert_eq!(advanced(instructions, &cuts), baseline, "{instructions:?}, {cuts:?}");
            }
        }
    }
}
