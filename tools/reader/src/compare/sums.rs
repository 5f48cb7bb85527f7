//! The sums of a comparison: over two lists of numbers and their difference, in lanes that are added in a fixed order.
//! They are the same on any machine, and the lanes make them fast.

/// Largest and least value of a reference field.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Largest magnitude.
    pub peak: f64,
    pub least: f64,
    pub greatest: f64,
}

impl Default for Scale {
    fn default() -> Self {
        Self { peak: 0.0, least: f64::INFINITY, greatest: f64::NEG_INFINITY }
    }
}

impl Scale {
    /// Takes finite values into account.
    pub fn add(&mut self, values: &[f64]) {
        for &value in values.iter().filter(|value| value.is_finite()) {
            self.join(&Self { peak: value.abs(), least: value, greatest: value });
        }
    }

    /// Takes the values of another scale into account.
    pub(super) fn join(&mut self, other: &Self) {
        self.peak = self.peak.max(other.peak);
        self.least = self.least.min(other.least);
        self.greatest = self.greatest.max(other.greatest);
    }

    /// A share of the range, `share·(greatest − least)`; the range itself may be too large for a number.
    pub(super) fn share_of_range(&self, share: f64) -> f64 {
        if self.least > self.greatest { 0.0 } else { share * self.greatest - share * self.least }
    }
}

/// An L2 norm √Σx² that neither overflows nor underflows where its squares do: `2^exponent·√sum`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Norm {
    /// Sum of squares, each scaled by 2^(−2·exponent).
    sum: f64,
    exponent: i32,
}

impl Norm {
    /// Magnitudes from 2^−480 to 2^480 are squared as they are.
    const LARGE: f64 = f64::from_bits((1023 + 480) << 52);
    /// Exponent for those beyond: 5e-324 and 1.8e308 are then among them.
    const SCALED: i32 = 960;

    /// Adds a sum of squares of numbers of which the largest has the magnitude `largest`, if it needs no scaling.
    fn add_plain(&mut self, largest: f64, squares: f64) -> bool {
        let plain = Self::exponent_of(largest) == 0 && squares.is_finite();
        if plain && largest > 0.0 {
            self.join(Self { sum: squares, exponent: 0 });
        }
        plain
    }

    /// Adds finite numbers.
    fn add(&mut self, numbers: impl Iterator<Item = f64>) {
        for x in numbers.filter(|x| *x != 0.0) {
            let exponent = Self::exponent_of(x.abs());
            let scaled = x * 2.0_f64.powi(-exponent);
            self.join(Self { sum: scaled * scaled, exponent });
        }
    }

    /// Exponent for numbers of a magnitude.
    fn exponent_of(magnitude: f64) -> i32 {
        match magnitude {
            large if large > Self::LARGE => Self::SCALED,
            small if small > 0.0 && small < Self::LARGE.recip() => -Self::SCALED,
            _ => 0,
        }
    }

    /// Adds the squares of another norm.
    fn join(&mut self, other: Self) {
        let (larger, smaller) = match () {
            () if self.sum == 0.0 => (other, *self),
            () if other.sum == 0.0 || self.exponent >= other.exponent => (*self, other),
            () => (other, *self),
        };
        let shift = 2.0_f64.powi(smaller.exponent - larger.exponent);
        *self = Self { sum: larger.sum + smaller.sum * shift * shift, exponent: larger.exponent };
    }

    /// The norm; infinite if it is too large for a number.
    pub fn value(&self) -> f64 {
        self.sum.sqrt() * 2.0_f64.powi(self.exponent)
    }

    /// True if all numbers are 0.
    pub fn is_zero(&self) -> bool {
        self.sum == 0.0
    }

    /// `self / other`; `None` if the other is 0.
    pub fn relative_to(&self, other: &Self) -> Option<f64> {
        let ratio = self.sum.sqrt() / other.sum.sqrt();
        (!other.is_zero())
            .then(|| if self.is_zero() { 0.0 } else { ratio * 2.0_f64.powi(self.exponent - other.exponent) })
    }
}

/// Sums over all elements compared.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// Number of elements.
    pub n: f64,
    /// Σ|a − b| and Σ|a|.
    pub d1: f64,
    pub a1: f64,
    /// Σa, Σb, Σa², Σb² and Σab.
    pub a: f64,
    pub b: f64,
    pub aa: f64,
    pub bb: f64,
    pub ab: f64,
    /// ‖a − b‖₂ and ‖a‖₂.
    pub difference: Norm,
    pub reference: Norm,
}

impl Sums {
    /// The sums over one element whose difference `d` may be known better than from the numbers.
    pub(super) fn of(a: f64, b: f64, d: f64) -> Self {
        let mut sums =
            Self { n: 1.0, d1: d, a1: a.abs(), a, b, aa: a * a, bb: b * b, ab: a * b, ..Self::default() };
        sums.difference.add([d].into_iter());
        sums.reference.add([a].into_iter());
        sums
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.n += other.n;
        self.d1 += other.d1;
        self.a1 += other.a1;
        self.a += other.a;
        self.b += other.b;
        self.aa += other.aa;
        self.bb += other.bb;
        self.ab += other.ab;
        self.difference.join(other.difference);
        self.reference.join(other.reference);
    }

    /// False if any number was not finite (or their squares are too large).
    pub(super) fn are_finite(&self) -> bool {
        self.aa.is_finite() && self.bb.is_finite()
    }
}

/// What the elements of a message add to the measure of a field.
pub(super) struct Block {
    pub(super) sums: Sums,
    pub(super) scale: Scale,
    /// Largest absolute difference.
    pub(super) max: f64,
    /// Elements that differ at all.
    pub(super) differing: u64,
}

impl Block {
    /// Sums over two lists of the same length; `SAME` saves half of the work where both hold the same bits.
    pub(super) fn of<const SAME: bool>(a: &[f64], b: &[f64]) -> Self {
        // as many lanes as there are registers for
        if SAME { Self::in_lanes::<SAME, 8>(a, b) } else { Self::in_lanes::<SAME, 4>(a, b) }
    }

    fn in_lanes<const SAME: bool, const LANES: usize>(a: &[f64], b: &[f64]) -> Self {
        let [mut a1, mut sum_a, mut aa, mut sum_b, mut bb, mut ab] = [[0.0; LANES]; 6];
        let [mut d1, mut d2, mut max] = [[0.0; LANES]; 3];
        let (mut least, mut greatest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let mut differing = [0_u64; LANES];
        let mut add = |lane: usize, x: f64, y: f64| {
            a1[lane] += x.abs();
            sum_a[lane] += x;
            aa[lane] += x * x;
            least[lane] = if x < least[lane] { x } else { least[lane] };
            greatest[lane] = if x > greatest[lane] { x } else { greatest[lane] };
            if !SAME {
                let d = (x - y).abs();
                sum_b[lane] += y;
                bb[lane] += y * y;
                ab[lane] += x * y;
                d1[lane] += d;
                d2[lane] += d * d;
                max[lane] = if d > max[lane] { d } else { max[lane] };
                differing[lane] += u64::from(x.to_bits() != y.to_bits());
            }
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
        let [a1, sum_a, aa, sum_b, bb, ab, d1, d2] =
            [a1, sum_a, aa, sum_b, bb, ab, d1, d2].map(|lanes| lanes.iter().sum::<f64>());
        let least = least.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = greatest.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let peak = if least <= greatest { least.abs().max(greatest.abs()) } else { 0.0 };
        let max = max.iter().copied().fold(0.0, f64::max);
        let (mut difference, mut reference) = (Norm::default(), Norm::default());
        if !difference.add_plain(max, d2) {
            difference.add(a.iter().zip(b).map(|(x, y)| x - y));
        }
        if !reference.add_plain(peak, aa) {
            reference.add(a.iter().copied());
        }
        let (b, bb, ab) = if SAME { (sum_a, aa, aa) } else { (sum_b, bb, ab) };
        Self {
            sums: Sums { n: a.len() as f64, d1, a1, a: sum_a, b, aa, bb, ab, difference, reference },
            scale: Scale { peak, least, greatest },
            max,
            differing: differing.iter().sum(),
        }
    }
}
