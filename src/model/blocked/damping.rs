//! Lateral damping of a row of the scheme of cells, a vector at a time on the way outwards.
//!
//! The operations are those of [`crate::model::elastic`] in the same order: [`crate::model::scheme::double_radial`] twice.

use super::vector::{BLOCK, Vector};

/// Columns around a node that damping depends on.
pub const REACH: usize = 4;

/// The vector at `i` of weights.
///
/// # Safety
///
/// The machine must have the instructions of `V`; there is a vector at `i`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
pub unsafe fn at<V: Vector>(weights: &[f64], i: usize) -> V {
    // SAFETY: the caller's promise
    unsafe { V::load(weights.as_ptr().add(i)) }
}

/// What a displacement has moved by from level k−1 to k, and `−√(4σ)·E_r` of it, on the way outwards.
#[derive(Clone, Copy)]
pub struct Moves<V> {
    /// Moved by, in the vector of nodes and the next one.
    moved: [V; 2],
    /// The operator on that, in the vector before and the vector of nodes.
    once: [V; 2],
}

/// [`crate::model::scheme::double_radial`] on vectors.
///
/// * `weights`: at these columns, outward and inward
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn double_radial<V: Vector>(inner: V, here: V, outer: V, weights: [V; 2]) -> V {
    // SAFETY: the caller's promise
    unsafe {
        let outward = V::wide_seam(here, outer).0.sub(here);
        let inward = here.sub(V::wide_seam(inner, here).1);
        weights[0].mul(outward).sub(weights[1].mul(inward))
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
    /// * `offset`: of the displacement in its row
    /// * `weights`: by column, outward and inward
    /// * `field`: number of the displacement
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector before the first (two of two numbers, one with images at the
    /// axis) and two from it on are ones of numbers at both levels.
    #[inline(always)]
    pub unsafe fn new(
        before: *const f64,
        now: *const f64,
        offset: usize,
        first: usize,
        weights: &[Vec<f64>; 2],
        field: usize,
    ) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            let (before, now) = (before.add(offset), now.add(offset));
            let (i, width) = (first as isize, V::WIDTH as isize);
            let [inner, here, outer]: [V; 3] =
                [moved(before, now, i - width), moved(before, now, i), moved(before, now, i + width)];
            let once = double_radial(inner, here, outer, [at(&weights[0], first), at(&weights[1], first)]);
            let once_inside = match first.checked_sub(V::WIDTH) {
                Some(inside) => {
                    let far = if V::WIDTH < REACH { moved(before, now, i - 2 * width) } else { inner };
                    double_radial(far, inner, here, [at(&weights[0], inside), at(&weights[1], inside)])
                }
                None => {
                    // images about the axis, of which the last two are read
                    let (mut numbers, mut images) = ([0.0; BLOCK], [0.0; BLOCK]);
                    once.store(numbers.as_mut_ptr());
                    let sign = if field == 1 { -1.0 } else { 1.0 };
                    (images[V::WIDTH - 1], images[V::WIDTH - 2]) = (sign * numbers[0], sign * numbers[1]);
                    V::load(images.as_ptr())
                }
            };
            Self { moved: [here, outer], once: [once_inside, once] }
        }
    }

    /// What damping takes from the vector of nodes at column `i`, and on to the next one.
    ///
    /// As before the first vector, vectors of [`REACH`] numbers and more do not read the second one from `end` on.
    ///
    /// * `end`: column after the last vector of nodes
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vectors from `i` on up to one after `end`, those of two numbers up to two
    /// after, are ones of numbers at both levels, and two from `i` on ones of weights.
    #[inline(always)]
    pub unsafe fn damped(
        &mut self,
        before: *const f64,
        now: *const f64,
        [i, end]: [usize; 2],
        weights: &[Vec<f64>; 2],
    ) -> V {
        let second = i + 2 * V::WIDTH;
        let second = if V::WIDTH < REACH { second } else { second.min(end) };
        // SAFETY: the caller's promise
        unsafe {
            let ([here, next], [once_inside, once]) = (self.moved, self.once);
            let after = moved(before, now, second as isize);
            let there = i + V::WIDTH;
            let once_outside =
                double_radial(here, next, after, [at(&weights[0], there), at(&weights[1], there)]);
            *self = Self { moved: [next, after], once: [once, once_outside] };
            double_radial(once_inside, once, once_outside, [at(&weights[0], i), at(&weights[1], i)])
        }
    }
}
