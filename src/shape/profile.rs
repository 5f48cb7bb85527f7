//! A profile given by points `(r, f)`, joined by a monotone cubic.

/// Points `(r, f)` of an indenter joined by the piecewise cubic of \[FC\] (Fritsch–Carlson): continuous slope, and
/// monotone wherever the points are, so it never overshoots them.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    r: Vec<f64>,
    f: Vec<f64>,
    slope: Vec<f64>,
}

impl Profile {
    /// Joins points `[r, f]` \[R\], ordered from the tip outwards.
    ///
    /// # Errors
    ///
    /// The first point, counted from 1, that is not finite, out of order or negative; a first point that is not `(0, 0)`.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, String> {
        if points.len() < 2 {
            return Err(format!("a profile needs at least 2 points, there are {}", points.len()));
        }
        let mut previous = f64::NEG_INFINITY;
        for (point, &[r, f]) in (1..).zip(points) {
            if !r.is_finite() || !f.is_finite() {
                return Err(format!("point {point} is not finite: r = {r}, f = {f}"));
            }
            if point == 1 && (r != 0.0 || f != 0.0) {
                return Err(format!("point 1 must be the tip r = 0, f = 0, it is r = {r}, f = {f}"));
            }
            if f < 0.0 {
                let rule = "f ≥ 0 everywhere: the tip at r = 0 must be the foremost point";
                return Err(format!("point {point} has f = {f}, but {rule}"));
            }
            if r <= previous {
                let rule = "radii must increase, f must be single-valued";
                return Err(format!("point {point} has r = {r} after r = {previous}: {rule}"));
            }
            previous = r;
        }
        let (r, f): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p[0], p[1])).unzip();
        let slope = slopes(&r, &f);
        Ok(Self { r, f, slope })
    }

    /// Radius of the last point \[R\].
    pub fn last_radius(&self) -> f64 {
        self.r[self.r.len() - 1]
    }

    /// Radius of the flat face around the axis \[R\]; 0 if the depth grows from there on.
    pub fn face_radius(&self) -> f64 {
        let flat = self.f.iter().take_while(|f| **f == 0.0).count();
        self.r[flat - 1]
    }

    /// True if it is neither flat at the tip nor a straight cone.
    pub fn is_rounded(&self) -> bool {
        self.r.len() > 2 && self.f[1] > 0.0
    }

    /// Radii of the points \[R\].
    pub fn knots(&self) -> impl Iterator<Item = f64> + '_ {
        self.r.iter().copied()
    }

    /// Depth f(r) \[R\]; the end values outside the points.
    pub fn at(&self, r: f64) -> f64 {
        let last = self.r.len() - 1;
        if r >= self.r[last] {
            return self.f[last];
        }
        let i = self.r.partition_point(|&knot| knot <= r).saturating_sub(1);
        let h = self.r[i + 1] - self.r[i];
        let t = (r - self.r[i]) / h;
        // cubic Hermite basis
        let (a, b) = (1.0 - t, t);
        a * a * ((1.0 + 2.0 * t) * self.f[i] + t * h * self.slope[i])
            + b * b * ((3.0 - 2.0 * t) * self.f[i + 1] - a * h * self.slope[i + 1])
    }

    /// Radius between `from` and `to`, between which f is monotone and passes `depth`, at which `f = depth` \[R\].
    pub fn crossing(&self, depth: f64, from: f64, to: f64) -> f64 {
        let (mut low, mut high) = (from, to);
        let rising = self.at(to) > self.at(from);
        // bisection down to neighbouring numbers
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle;
            }
            if (self.at(middle) < depth) == rising { low = middle } else { high = middle }
        }
    }

    /// Largest radius with `f ≤ depth` \[R\].
    pub fn reach(&self, depth: f64) -> f64 {
        let last = self.r.len() - 1;
        if self.f[last] <= depth {
            return self.r[last];
        }
        (0..last)
            .rev()
            .find(|&i| self.f[i] <= depth)
            .map_or(0.0, |i| self.crossing(depth, self.r[i], self.r[i + 1]))
    }
}

/// Slopes at the points: weighted harmonic mean of the neighbouring secants, 0 at extrema; \[FC\] with the weights
/// of Brodlie, one-sided three-point formula at the ends.
fn slopes(r: &[f64], f: &[f64]) -> Vec<f64> {
    let n = r.len();
    let h: Vec<f64> = r.windows(2).map(|w| w[1] - w[0]).collect();
    let secant: Vec<f64> = (0..n - 1).map(|i| (f[i + 1] - f[i]) / h[i]).collect();
    if n == 2 {
        return vec![secant[0]; 2];
    }
    let mut slope = vec![0.0; n];
    for i in 1..n - 1 {
        let (before, after) = (secant[i - 1], secant[i]);
        if before * after > 0.0 {
            let (w1, w2) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
            slope[i] = (w1 + w2) / (w1 / before + w2 / after);
        }
    }
    slope[0] = end_slope(h[0], h[1], secant[0], secant[1]);
    slope[n - 1] = end_slope(h[n - 2], h[n - 3], secant[n - 2], secant[n - 3]);
    slope
}

/// Slope at an end with neighbouring steps `h0` (adjacent), `h1` and secants `s0`, `s1`, limited so that the cubic
/// stays monotone.
fn end_slope(h0: f64, h1: f64, s0: f64, s1: f64) -> f64 {
    let slope = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
    if slope * s0 <= 0.0 {
        0.0
    } else if s0 * s1 <= 0.0 && slope.abs() > 3.0 * s0.abs() {
        3.0 * s0
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolates_and_never_overshoots() {
        let points = [[0.0, 0.0], [0.2, 0.01], [0.3, 0.4], [0.9, 0.41], [1.0, 1.0]];
        let profile = Profile::new(&points).expect("valid");
        for [r, f] in points {
            assert!((profile.at(r) - f).abs() < 1e-15);
        }
        let mut last = 0.0;
        for m in 0..=1000 {
            let f = profile.at(m as f64 / 1000.0);
            assert!(f >= last - 1e-15, "falls at {m}");
            last = f;
        }
    }

    #[test]
    fn bad_points_are_named() {
        let cases = [
            (vec![[0.0, 0.0]], "at least 2"),
            (vec![[0.0, 0.1], [1.0, 1.0]], "point 1"),
            (vec![[0.0, 0.0], [0.5, -0.1], [1.0, 1.0]], "point 2"),
            (vec![[0.0, 0.0], [0.5, 0.1], [0.5, 1.0]], "point 3"),
            (vec![[0.0, 0.0], [f64::NAN, 0.1]], "point 2"),
        ];
        for (points, part) in cases {
            let message = Profile::new(&points).expect_err("bad points");
            assert!(message.contains(part), "{message}");
        }
    }
}
