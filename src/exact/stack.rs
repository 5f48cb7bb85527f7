//! Waves along z in a stack of layers: reflections and transmissions without end, summed.
//!
//! In a layer of impedance Z the pressure is that of a wave downwards and one upwards, `p = D + U`, with the velocity `(D − U)/Z`.
//! Both are continuous at an interface, Z₁ above and Z₂ below, so that
//!
//! ```text
//! r = (Z₂ − Z₁)/(Z₂ + Z₁)       D₂ = (1 + r)·D₁ − r·U₂       U₁ = r·D₁ + (1 − r)·U₂
//! surface, velocity V           D = Z₁·V + U                 back   rigid U = D,  free U = −D
//! ```
//!
//! The pressure at a depth after an impulse of velocity at the surface is thus a row of impulses, `p(t) = Σ a_n·δ(t − t_n)`: with
//! layers of one transit time the recursion of Goupillaud (1961). Impulses that arrive at one time are one, so that their number grows
//! with time like a power, whose exponent is the number of incommensurate transit times.
//!
//! Layers of one shear wave speed carry the waves of the simplified theory in the same way, whatever their wave number, see
//! [`super::spreading`].

use std::collections::BTreeMap;

use super::{ExactError, outside, positive};
use crate::grid::Back;

/// A layer, in units of the first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StackLayer {
    /// Impedance Z of longitudinal waves \[γc_p\].
    pub impedance: f64,
    /// Longitudinal wave speed \[c_p\].
    pub wave_speed: f64,
    /// Shear wave speed c_s \[c_p\].
    pub shear_wave_speed: f64,
    /// Thickness h \[R\]; infinite for a half-space, which only the last one can be.
    pub thickness: f64,
}

/// Layers from the struck surface down, welded together.
#[derive(Clone, Debug, PartialEq)]
pub struct Stack {
    layers: Vec<StackLayer>,
    back: Back,
}

/// Two arrivals this near to one another, relative to their time, are one.
const ROUNDING: f64 = 1e-12;

/// Most arrivals that are summed.
const MOST: usize = 100_000;

impl Stack {
    /// * `layers`: at least one
    /// * `back`: far side of the last layer; a half-space has none
    ///
    /// # Errors
    ///
    /// No layer, a constant that is not positive and finite, a layer with `c_s ≥ c`, or a half-space that is not the last layer.
    pub fn new(layers: &[StackLayer], back: Back) -> Result<Self, ExactError> {
        positive("number of layers", layers.len() as f64, f64::INFINITY, "at least one")?;
        for (number, layer) in layers.iter().enumerate() {
            positive("impedance", layer.impedance, f64::INFINITY, "Z > 0")?;
            let speed = positive("wave_speed", layer.wave_speed, f64::INFINITY, "c > 0")?;
            positive("shear_wave_speed", layer.shear_wave_speed, speed, "0 < c_s < c of the layer")?;
            if layer.thickness != f64::INFINITY || number + 1 < layers.len() {
                positive(
                    "thickness",
                    layer.thickness,
                    f64::INFINITY,
                    "h > 0, finite but for the last layer",
                )?;
            }
        }
        Ok(Self { layers: layers.to_vec(), back })
    }

    /// One layer on a rigid back, or a half-space.
    ///
    /// * `shear_wave_speed`: c_s \[c_p\]
    /// * `thickness`: h \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// As [`Stack::new`].
    pub fn single(shear_wave_speed: f64, thickness: Option<f64>) -> Result<Self, ExactError> {
        let thickness = thickness.unwrap_or(f64::INFINITY);
        let layer = StackLayer { impedance: 1.0, wave_speed: 1.0, shear_wave_speed, thickness };
        Self::new(&[layer], Back::Rigid)
    }

    /// The layers.
    pub fn layers(&self) -> &[StackLayer] {
        &self.layers
    }

    /// The far side of the last layer, if it has one.
    pub fn back(&self) -> Option<Back> {
        self.thickness().is_finite().then_some(self.back)
    }

    /// Thickness of all layers \[R\].
    pub fn thickness(&self) -> f64 {
        self.layers.iter().map(|layer| layer.thickness).sum()
    }

    /// What arrives at depth `z` until a time after an impulse of velocity 1 at the surface: times \[R/c_p\] in ascending order, and
    /// the pressure `a_n` of each \[γc_p\].
    ///
    /// The surface moves with the given velocity, whatever comes back to it.
    ///
    /// # Errors
    ///
    /// `z` is not in the stack, `until` is negative or not finite, or there are too many arrivals: more than a hundred thousand.
    pub fn arrivals(&self, z: f64, until: f64) -> Result<Vec<(f64, f64)>, ExactError> {
        let depth = self.thickness();
        if !(z >= 0.0 && z <= depth) {
            return outside("z", z, format!("0 ≤ z ≤ {depth}"));
        }
        if !(until >= 0.0 && until.is_finite()) {
            return outside("t", until, "t ≥ 0");
        }
        let (sections, observed) = self.cut(z);
        let back = match self.back() {
            Some(Back::Rigid) => 1.0,
            Some(Back::Free) => -1.0,
            None => 0.0,
        };
        let mut waves = Waves::default();
        waves.send(0.0, 0, [sections[0].0, 0.0]);
        let mut found = Vec::new();
        while let Some((time, nodes)) = waves.next().filter(|next| next.0 <= until * (1.0 + ROUNDING)) {
            let mut pressure = 0.0;
            for (node, [from_above, from_below]) in nodes {
                // the waves that leave the node: the one upwards, and the one downwards
                let [up, down] = match node {
                    0 => [0.0, from_above + from_below],
                    _ if node == sections.len() => [back * from_above, 0.0],
                    _ => {
                        let (upper, lower) = (sections[node - 1].0, sections[node].0);
                        let r = (lower - upper) / (lower + upper);
                        [r * from_above + (1.0 - r) * from_below, (1.0 + r) * from_above - r * from_below]
                    }
                };
                if node == observed {
                    pressure = if node == 0 { from_below + down } else { from_above + up };
                }
                if up != 0.0 {
                    waves.send(time + sections[node - 1].1, node - 1, [0.0, up]);
                }
                if down != 0.0 {
                    waves.send(time + sections[node].1, node + 1, [down, 0.0]);
                }
            }
            if pressure != 0.0 {
                found.push((time, pressure));
            }
            if found.len() > MOST {
                return outside("t", until, format!("at most {MOST} arrivals, t < {time}"));
            }
        }
        Ok(found)
    }

    /// The same until `t`, with half the pressure of a wave that arrives at `t`.
    pub(super) fn arrived(&self, z: f64, t: f64) -> Result<Vec<(f64, f64)>, ExactError> {
        let share = |time: f64| if (t - time).abs() <= ROUNDING * t { 0.5 } else { 1.0 };
        let arrivals = self.arrivals(z, t)?.into_iter();
        Ok(arrivals.map(|(time, pressure)| (time, share(time) * pressure)).collect())
    }

    /// Pressure at depth `z` and time `t` after the surface has been set in motion with velocity 1 \[γc_p\]; half the jump of a wave
    /// that arrives at `t`.
    ///
    /// # Errors
    ///
    /// As [`Stack::arrivals`].
    pub fn pressure(&self, z: f64, t: f64) -> Result<f64, ExactError> {
        Ok(self.arrived(z, t)?.into_iter().map(|(_, pressure)| pressure).sum())
    }

    /// Impedances and transit times, with the layer around depth `z` cut there, and the number of the node that is at `z`.
    fn cut(&self, z: f64) -> (Vec<(f64, f64)>, usize) {
        let (mut sections, mut observed, mut top) = (Vec::new(), 0, 0.0);
        let slack = ROUNDING * z;
        for layer in &self.layers {
            let inside = z - top;
            if inside > slack && inside < layer.thickness - slack {
                sections.push((layer.impedance, inside / layer.wave_speed));
                observed = sections.len();
                sections.push((layer.impedance, (layer.thickness - inside) / layer.wave_speed));
            } else {
                sections.push((layer.impedance, layer.thickness / layer.wave_speed));
                if inside > slack {
                    observed = sections.len();
                }
            }
            top += layer.thickness;
        }
        (sections, observed)
    }
}

/// Pressures of the waves that come to a node, from above and from below.
type Incoming = BTreeMap<usize, [f64; 2]>;

/// Waves under way, by the bits of the time at which they come to the next node.
#[derive(Default)]
struct Waves(BTreeMap<u64, Incoming>);

impl Waves {
    /// Adds what comes to a node at a time, which may be infinite.
    fn send(&mut self, time: f64, node: usize, pressures: [f64; 2]) {
        // the bits of positive numbers are in their order
        let near = (time * (1.0 - ROUNDING)).to_bits()..=(time * (1.0 + ROUNDING)).to_bits();
        let key = self.0.range(near).next().map_or(time.to_bits(), |(bits, _)| *bits);
        let sum = self.0.entry(key).or_default().entry(node).or_default();
        sum.iter_mut().zip(pressures).for_each(|(sum, pressure)| *sum += pressure);
    }

    /// Takes out what comes first.
    fn next(&mut self) -> Option<(f64, Incoming)> {
        self.0.pop_first().map(|(bits, incoming)| (f64::from_bits(bits), incoming))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(impedance: f64, wave_speed: f64, thickness: f64) -> StackLayer {
        StackLayer { impedance, wave_speed, shear_wave_speed: 0.1, thickness }
    }

    fn stack(layers: &[StackLayer], back: Back) -> Stack {
        Stack::new(layers, back).expect("a stack")
    }

    #[test]
    fn one_layer_has_a_wave_for_every_passage() {
        let rigid = Stack::single(0.5, Some(0.7)).expect("a layer");
        let found = rigid.arrivals(0.2, 3.0).expect("range");
        for (found, expected) in found.iter().zip([0.2, 1.2, 1.6, 2.6, 3.0]) {
            assert!((found.0 - expected).abs() < 1e-14 && found.1 == 1.0, "{found:?} {expected}");
        }
        assert_eq!(found.len(), 5);
        assert_eq!(rigid.arrivals(0.0, 1.4), Ok(vec![(0.0, 1.0), (1.4, 2.0)]));
        assert_eq!(rigid.arrivals(0.7, 1.0), Ok(vec![(0.7, 2.0)]));
        let free = stack(&[layer(1.0, 2.0, 1.0)], Back::Free);
        assert_eq!(free.arrivals(0.0, 2.0), Ok(vec![(0.0, 1.0), (1.0, -2.0), (2.0, 2.0)]));
        assert_eq!(free.arrivals(1.0, 2.0), Ok(vec![]));
        let space = Stack::single(0.5, None).expect("a half-space");
        assert_eq!(space.arrivals(3.0, 1e6), Ok(vec![(3.0, 1.0)]));
    }

    #[test]
    fn two_layers_reflect_as_their_impedances_say() {
        // r = ½, transmission 3/2 and back ½
        let coated = stack(&[layer(1.0, 1.0, 1.0), layer(3.0, 2.0, f64::INFINITY)], Back::Rigid);
        assert_eq!(coated.arrivals(0.0, 5.0), Ok(vec![(0.0, 1.0), (2.0, 1.0), (4.0, 0.5)]));
        assert_eq!(coated.arrivals(2.0, 4.0), Ok(vec![(1.5, 1.5), (3.5, 0.75)]));
        assert_eq!(coated.pressure(0.0, 2.0), Ok(1.5));
        // the interface at 1 is at 1, whatever layer it is taken to be of
        let [above, below] = [1.0 - 1e-13, 1.0 + 1e-13].map(|z| coated.arrivals(z, 3.5));
        assert_eq!(above, below);
    }

    #[test]
    fn long_after_a_push_the_stack_is_at_rest_or_moves_with_the_surface() {
        // a half-space moves as it is moved, p = Z_L·V; a layer with a free back moves along without pressure, in the mean
        let layers = [layer(1.0, 1.0, 0.3), layer(0.6, 0.7, 0.11), layer(2.0, 1.3, f64::INFINITY)];
        let late = stack(&layers, Back::Rigid).pressure(0.0, 40.0).expect("range");
        assert!((late - 2.0).abs() < 1e-9, "{late}");
        let free = stack(&[layer(1.0, 1.0, 0.3), layer(0.2, 0.7, 0.11)], Back::Free);
        let arrivals = free.arrivals(0.0, 60.0).expect("range");
        let impulse: f64 = arrivals.iter().map(|(time, pressure)| pressure * (60.0 - time)).sum();
        // ∫p dt is the momentum of the mass Σ Zh/c, and what oscillates
        let mass = 0.3 + 0.2 * 0.11 / 0.7;
        assert!((impulse - mass).abs() < 0.5, "{impulse} {mass}");
        // rigid: the pressure grows by the static stiffness 1/Σ(h/Zc)
        let rigid = stack(&[layer(1.0, 1.0, 0.3), layer(0.2, 0.7, 0.11)], Back::Rigid);
        let slope =
            (rigid.pressure(0.0, 60.0).expect("range") - rigid.pressure(0.0, 20.0).expect("range")) / 40.0;
        let expected = 1.0 / (0.3 + 0.11 / (0.2 * 0.7));
        assert!((slope / expected - 1.0).abs() < 0.05, "{slope} {expected}");
    }

    #[test]
    fn arrivals_at_one_time_are_one() {
        // commensurate: one for every step; incommensurate: as many as combinations of passages of both layers
        let count = |speed: f64| {
            let layers = [layer(1.0, 1.0, 0.5), layer(0.3, speed, 0.5)];
            stack(&layers, Back::Rigid).arrivals(0.0, 30.0).expect("range").len()
        };
        assert_eq!(count(1.0), 31);
        let passages =
            (0..31).map(|n| if n == 0 { 1 } else { 1 + ((30 - n) as f64 / 0.5f64.sqrt()) as usize });
        assert_eq!(count(2f64.sqrt()), passages.sum::<usize>());
        let many =
            [layer(1.0, 1.0, 0.5), layer(0.3, 0.7, 0.31), layer(2.0, 1.3, 0.17), layer(0.4, 0.9, 0.23)];
        assert!(stack(&many, Back::Rigid).arrivals(0.0, 60.0).is_err());
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        let good = layer(1.0, 1.0, 1.0);
        for bad in
            [layer(0.0, 1.0, 1.0), layer(1.0, f64::NAN, 1.0), layer(1.0, 1.0, -1.0), layer(1.0, 0.05, 1.0)]
        {
            assert!(Stack::new(&[good, bad], Back::Free).is_err(), "{bad:?}");
        }
        assert!(Stack::new(&[], Back::Rigid).is_err());
        assert!(Stack::new(&[layer(1.0, 1.0, f64::INFINITY), good], Back::Rigid).is_err());
        let rigid = stack(&[good], Back::Rigid);
        assert!(rigid.arrivals(1.1, 1.0).is_err() && rigid.arrivals(0.0, f64::INFINITY).is_err());
    }
}
