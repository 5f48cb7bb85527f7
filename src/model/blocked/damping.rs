//! Lateral damping of a row of the scheme of cells, a vector at a time on the way outwards.
//!
//! [`scheme::double_radial`], and [`scheme::take_radial`] of what that gives, as in [`crate::model::cell_scheme`].

use super::lane::{BLOCK, Lane};
use crate::model::scheme::{self, RadialWeights};

/// Columns around a node that damping depends on.
pub const REACH: usize = 4;

/// Weights of the lanes at column `i`.
///
/// * `weights`: by column, outward and inward
///
/// # Safety
///
/// The machine has the instructions of `L`; there are lanes at `i`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn at<L: Lane>(weights: [*const f64; 2], i: usize) -> RadialWeights<L> {
    // SAFETY: the caller's promise
    unsafe { RadialWeights { outward: L::load(weights[0].add(i)), inward: L::load(weights[1].add(i)) } }
}

/// What a displacement has moved by from level k−1 to k, and `−√(4σ)·E_r` of it, on the way outwards.
#[derive(Clone, Copy)]
pub struct Moves<L> {
    /// Moved by in the next vector of nodes, and two nodes inside that.
    moved: [L; 2],
    /// The operator on that in the vector of nodes, and two nodes inside that.
    once: [L; 2],
}

/// [`scheme::double_radial`] of lanes, and what is two nodes inside the next ones.
///
/// * `values`: two nodes inside the lanes, they, the next ones
#[inline(always)]
fn double_radial<L: Lane>([inside, here, next]: [L; 3], weights: RadialWeights<L>) -> [L; 2] {
    let (outside, next_inside) = L::wide_seam(here, next);
    [scheme::double_radial([inside, here, outside], weights), next_inside]
}

/// The vector at column `i` of what a displacement has moved by.
///
/// # Safety
///
/// The machine has the instructions of `L`; the vectors are ones of numbers at both levels.
#[inline(always)]
#[expect(unsafe_code, reason = "vectors of a field that threads share")]
unsafe fn moved<L: Lane>(before: *const f64, now: *const f64, i: isize) -> L {
    // SAFETY: the caller's promise
    unsafe { L::load(now.offset(i)) - L::load(before.offset(i)) }
}

#[expect(unsafe_code, reason = "vectors of a field that threads share")]
impl<L: Lane> Moves<L> {
    /// Where the first vector of nodes is at column `first`.
    ///
    /// Damping reaches [`REACH`] columns. Vectors of that many numbers and more do not read the second one before: nothing of it
    /// would count, and another thread may be overwriting it.
    ///
    /// * `levels`: column 0 at levels k−1 and k
    /// * `weights`: by column, outward and inward
    /// * `is_odd`: about the axis
    ///
    /// # Safety
    ///
    /// The machine has the instructions of `L`; the vector before the first (two of two numbers, one with images at the
    /// axis) and two from it on are ones of numbers at both levels.
    #[inline(always)]
    pub unsafe fn new(
        [before, now]: [*const f64; 2],
        first: usize,
        weights: [*const f64; 2],
        is_odd: bool,
    ) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            let (i, width) = (first as isize, L::WIDTH as isize);
            let [inner, here, outer]: [L; 3] =
                [moved(before, now, i - width), moved(before, now, i), moved(before, now, i + width)];
            let inside = L::wide_seam(inner, here).1;
            let [once, outer_inside] = double_radial([inside, here, outer], at(weights, first));
            let once_before = match first.checked_sub(L::WIDTH) {
                Some(before_first) => {
                    let far = if L::WIDTH < REACH { moved(before, now, i - 2 * width) } else { inner };
                    let values = [L::wide_seam(far, inner).1, inner, here];
                    double_radial(values, at(weights, before_first))[0]
                }
                None => {
                    // images about the axis, of which the last two are read
                    let (mut numbers, mut images) = ([0.0; BLOCK], [0.0; BLOCK]);
                    once.store(numbers.as_mut_ptr());
                    let sign = if is_odd { -1.0 } else { 1.0 };
                    (images[L::WIDTH - 1], images[L::WIDTH - 2]) = (sign * numbers[0], sign * numbers[1]);
                    L::load(images.as_ptr())
                }
            };
            Self { moved: [outer, outer_inside], once: [once, L::wide_seam(once_before, once).1] }
        }
    }

    /// The vector of nodes at column `i` with damping, [`crate::model::scheme::take_radial`], and on to the next one.
    ///
    /// As before the first vector, vectors of [`REACH`] numbers and more do not read the second one from `end` on.
    ///
    /// * `free`: without it
    /// * `end`: column after the last vector of nodes
    ///
    /// # Safety
    ///
    /// The machine has the instructions of `L`; the vectors from `i` on up to one after `end`, those of two numbers up to two
    /// after, are ones of numbers at both levels, and two from `i` on ones of weights.
    #[inline(always)]
    pub unsafe fn damped(
        &mut self,
        free: L,
        [before, now]: [*const f64; 2],
        [i, end]: [usize; 2],
        weights: [*const f64; 2],
    ) -> L {
        let second = i + 2 * L::WIDTH;
        let second = if L::WIDTH < REACH { second } else { second.min(end) };
        // SAFETY: the caller's promise
        unsafe {
            let ([next, next_inside], [once, once_inside]) = (self.moved, self.once);
            let after = moved(before, now, second as isize);
            let there = i + L::WIDTH;
            let [next_once, after_inside] = double_radial([next_inside, next, after], at(weights, there));
            let (once_outside, next_once_inside) = L::wide_seam(once, next_once);
            *self = Self { moved: [after, after_inside], once: [next_once, next_once_inside] };
            scheme::take_radial(free, [once_inside, once, once_outside], at(weights, i))
        }
    }
}
