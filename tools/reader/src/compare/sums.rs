//! Sums over lists of numbers, in lanes that are added in a fixed order: the same on any machine, and quick.

/// Sums of a list, in eight lanes that are added in a fixed order.
pub(super) struct Quick {
    pub(super) a1: f64,
    pub(super) a: f64,
    pub(super) aa: f64,
    pub(super) least: f64,
    pub(super) greatest: f64,
}

impl Quick {
    pub(super) fn of(numbers: &[f64]) -> Self {
        const LANES: usize = 8;
        let (mut a1, mut a, mut aa) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut least, mut greatest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let (chunks, rest) = numbers.as_chunks::<LANES>();
        let mut add = |lane: usize, x: f64| {
            a1[lane] += x.abs();
            a[lane] += x;
            aa[lane] += x * x;
            least[lane] = if x < least[lane] { x } else { least[lane] };
            greatest[lane] = if x > greatest[lane] { x } else { greatest[lane] };
        };
        for chunk in chunks {
            for (lane, &x) in chunk.iter().enumerate() {
                add(lane, x);
            }
        }
        for (lane, &x) in rest.iter().enumerate() {
            add(lane, x);
        }
        Self {
            a1: a1.iter().sum(),
            a: a.iter().sum(),
            aa: aa.iter().sum(),
            least: least.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: greatest.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// False if any number was not finite (or their squares are too large).
    pub(super) fn is_finite(&self) -> bool {
        self.aa.is_finite()
    }
}

/// Sums of two lists and their difference, in lanes that are added in a fixed order.
#[derive(Default)]
pub(super) struct Pairs {
    pub(super) a1: f64,
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) aa: f64,
    pub(super) bb: f64,
    pub(super) ab: f64,
    pub(super) d1: f64,
    pub(super) d2: f64,
    pub(super) max: f64,
    pub(super) least: f64,
    pub(super) greatest: f64,
    pub(super) differing: u64,
}

impl Pairs {
    pub(super) fn of(a: &[f64], b: &[f64]) -> Self {
        const LANES: usize = 4;
        let zero = [0.0; LANES];
        let (mut a1, mut sum_a, mut sum_b, mut aa, mut bb, mut ab) = (zero, zero, zero, zero, zero, zero);
        let (mut d1, mut d2, mut max) = (zero, zero, zero);
        let (mut least, mut greatest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let mut differing = [0u64; LANES];
        let mut add = |lane: usize, x: f64, y: f64| {
            let difference = (x - y).abs();
            a1[lane] += x.abs();
            sum_a[lane] += x;
            sum_b[lane] += y;
            aa[lane] += x * x;
            bb[lane] += y * y;
            ab[lane] += x * y;
            d1[lane] += difference;
            d2[lane] += difference * difference;
            max[lane] = if difference > max[lane] { difference } else { max[lane] };
            least[lane] = if x < least[lane] { x } else { least[lane] };
            greatest[lane] = if x > greatest[lane] { x } else { greatest[lane] };
            differing[lane] += u64::from(x.to_bits() != y.to_bits());
        };
        let ((chunks_a, rest_a), (chunks_b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
        for (xs, ys) in chunks_a.iter().zip(chunks_b) {
            for lane in 0..LANES {
                add(lane, xs[lane], ys[lane]);
            }
        }
        for (lane, (&x, &y)) in rest_a.iter().zip(rest_b).enumerate() {
            add(lane, x, y);
        }
        let sum = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
        Self {
            a1: sum(a1),
            a: sum(sum_a),
            b: sum(sum_b),
            aa: sum(aa),
            bb: sum(bb),
            ab: sum(ab),
            d1: sum(d1),
            d2: sum(d2),
            max: max.iter().copied().fold(0.0, f64::max),
            least: least.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: greatest.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            differing: differing.iter().sum(),
        }
    }

    /// False if any number was not finite (or their squares are too large).
    pub(super) fn is_finite(&self) -> bool {
        self.aa.is_finite() && self.bb.is_finite()
    }
}
