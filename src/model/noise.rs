//! Numbers for tests that look random and repeat.

/// A linear congruential generator, by its state.
pub struct Noise(pub u64);

impl Noise {
    fn step(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// A number from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.step() >> 40) as f64 / (1u64 << 24) as f64
    }

    /// A whole number from 0 on.
    pub fn below(&mut self, count: usize) -> usize {
        (self.step() >> 33) as usize % count
    }
}
