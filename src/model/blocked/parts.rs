//! Numbers that several threads write.

use std::{marker::PhantomData, ops::Range, sync::Mutex};

use super::sync::{AtomicPtr, Ordering};

/// Numbers that several threads write, each its own part. They can be taken out once, when all parts are written.
pub struct Parts<T> {
    /// The first number; null once they have been taken.
    first: AtomicPtr<T>,
    length: usize,
    /// One thread at a time reaches each of them, as if under a lock: so they may be shared if they may be sent.
    numbers: PhantomData<Mutex<T>>,
}

#[expect(unsafe_code, reason = "several threads fill one sampler")]
impl<T: Default + Clone> Parts<T> {
    /// `length` zeros; large untouched ones take no memory.
    pub fn new(length: usize) -> Self {
        let numbers = vec![T::default(); length].into_boxed_slice();
        Self { first: AtomicPtr::new(Box::into_raw(numbers).cast()), length, numbers: PhantomData }
    }

    /// Some of the numbers.
    ///
    /// # Safety
    ///
    /// No other thread reaches these while the slice lives, nor is there another slice of them.
    #[expect(clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        // relaxed: the pointer is changed by `take` alone, which by the caller's promise has not been called
        let first = self.first.load(Ordering::Relaxed);
        assert!(!first.is_null() && range.start <= range.end && range.end <= self.length);
        // SAFETY: the range lies inside the numbers, which have not been taken; the caller promises the rest
        unsafe { std::slice::from_raw_parts_mut(first.add(range.start), range.len()) }
    }

    /// Takes all numbers out.
    ///
    /// # Safety
    ///
    /// All writing to them has happened before, and none follows.
    ///
    /// # Panics
    ///
    /// If they have been taken before.
    pub unsafe fn take(&self) -> Vec<T> {
        // relaxed: it only decides which call has the numbers; that they are written is the caller's promise
        let first = self.first.swap(std::ptr::null_mut(), Ordering::Relaxed);
        assert!(!first.is_null(), "numbers are taken once");
        // SAFETY: the pointer comes from a box of this length, and was swapped out, so no other call has it; the caller
        // promises that no slice of it is alive
        unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(first, self.length)) }.into_vec()
    }
}

impl<T> Drop for Parts<T> {
    fn drop(&mut self) {
        // relaxed: what `&mut self` excludes needs no order
        let first = self.first.load(Ordering::Relaxed);
        if !first.is_null() {
            // SAFETY: the pointer comes from a box of this length; slices of it borrow `self`, so none is alive
            #[expect(unsafe_code, reason = "numbers that were never taken")]
            drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(first, self.length)) });
        }
    }
}
