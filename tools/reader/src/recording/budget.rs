//! Memory that is spent before it is allocated.

/// Memory that is left for something \[bytes\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Budget {
    left: usize,
}

impl Budget {
    pub(crate) fn new(bytes: usize) -> Self {
        Self { left: bytes }
    }

    /// Spends so many bytes; `false`, and none are spent, if there are not so many.
    #[must_use]
    pub(crate) fn spend(&mut self, bytes: usize) -> bool {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                true
            }
            None => false,
        }
    }

    /// Gets bytes back that were spent.
    pub(crate) fn give_back(&mut self, bytes: usize) {
        self.left += bytes;
    }

    /// What is left \[bytes\].
    pub(crate) fn left(&self) -> usize {
        self.left
    }
}
