//! Lateral damping of a row of the scheme of cells, a vector at a time on the way outwards.
//!
//! The operations are those of [`crate::model::cell_scheme`] in the same order: [`crate::model::scheme::double_radial`], and
//! [`crate::model::scheme::take_radial`] of what that gives.

use super::vector::{BLOCK, Vector};

/// Columns around a node that damping depends on.
pub const REACH: usize = 4;

/// Vectors of weights at column `i`, outward and inward.
///
/// # Safety
///
/// The machine must have the instructions of `V`; there are vectors at `i`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn both<V: Vector>(weights: [*const f64; 2], i: usize) -> [V; 2] {
    // SAFETY: the caller's promise
    unsafe { [V::load(weights[0].add(i)), V::load(weights[1].add(i))] }
}

/// What a displacement has moved by from level k−1 to k, and `−√(4σ)·E_r` of it, on the way outwards.
#[derive(Clone, Copy)]
pub struct Moves<V> {
    /// Moved by in the next vector of nodes, and two nodes inside that.
    moved: [V; 2],
    /// The operator on that in the vector of nodes, and two nodes inside that.
    once: [V; 2],
}

/// [`crate::model::scheme::double_radial`] on vectors, and what is two nodes inside the next vector.
///
/// * `values`: two nodes inside the vector, the vector, the next one
/// * `weights`: at these columns, outward and inward
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn double_radial<V: Vector>([inside, here, next]: [V; 3], weights: [V; 2]) -> [V; 2] {
    // SAFETY: the caller's promise
    unsafe {
        let (outside, next_inside) = V::wide_seam(here, next);
        [weights[0].mul(outside.sub(here)).sub_product(weights[1], here.sub(inside)), next_inside]
    }
}

/// The vector at column `i` of what a displacement has moved by.
///
/// # Safety
///
/// The machine must have the instructions of `V`; the vectors are ones of numbers at both levels.
#[inline(always)]
#[expect(unsafe_code, reason = "vectors of a field that threads share")]
unsafe fn moved<V: Vector>(before: *const f64, now: *const f64, i: isize) -> V {
    // SAFETY: the caller's promise
    unsafe { V::load(now.offset(i)).sub(V::load(before.offset(i))) }
}

#[expect(unsafe_code, reason = "vectors of a field that threads share")]
impl<V: Vector> Moves<V> {
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
    /// The machine must have the instructions of `V`; the vector before the first (two of two numbers, one with images at the
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
            let (i, width) = (first as isize, V::WIDTH as isize);
            let [inner, here, outer]: [V; 3] =
                [moved(before, now, i - width), moved(before, now, i), moved(before, now, i + width)];
            let inside = V::wide_seam(inner, here).1;
            let [once, outer_inside] = double_radial([inside, here, outer], both(weights, first));
            let once_before = match first.checked_sub(V::WIDTH) {
                Some(before_first) => {
                    let far = if V::WIDTH < REACH { moved(before, now, i - 2 * width) } else { inner };
                    let values = [V::wide_seam(far, inner).1, inner, here];
                    double_radial(values, both(weights, before_first))[0]
                }
                None => {
                    // images about the axis, of which the last two are read
                    let (mut numbers, mut images) = ([0.0; BLOCK], [0.0; BLOCK]);
                    once.store(numbers.as_mut_ptr());
                    let sign = if is_odd { -1.0 } else { 1.0 };
                    (images[V::WIDTH - 1], images[V::WIDTH - 2]) = (sign * numbers[0], sign * numbers[1]);
                    V::load(images.as_ptr())
                }
            };
            Self { moved: [outer, outer_inside], once: [once, V::wide_seam(once_before, once).1] }
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
    /// The machine must have the instructions of `V`; the vectors from `i` on up to one after `end`, those of two numbers up to two
    /// after, are ones of numbers at both levels, and two from `i` on ones of weights.
    #[inline(always)]
    pub unsafe fn damped(
        &mut self,
        free: V,
        [before, now]: [*const f64; 2],
        [i, end]: [usize; 2],
        weights: [*const f64; 2],
    ) -> V {
        let second = i + 2 * V::WIDTH;
        let second = if V::WIDTH < REACH { second } else { second.min(end) };
        // SAFETY: the caller's promise
        unsafe {
            let ([next, next_inside], [once, once_inside]) = (self.moved, self.once);
            let after = moved(before, now, second as isize);
            let there = i + V::WIDTH;
            let [next_once, after_inside] = double_radial([next_inside, next, after], both(weights, there));
            let (once_outside, next_once_inside) = V::wide_seam(once, next_once);
            *self = Self { moved: [after, after_inside], once: [next_once, next_once_inside] };
            let [outward, inward] = both(weights, i);
            free.sub_product(outward, once_outside.sub(once)).add_product(inward, once.sub(once_inside))
        }
    }
}
