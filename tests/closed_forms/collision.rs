//! Saint-Venant's collision of two stacks of layers, by rays: plane waves in rods that are kept from getting wider.
//!
//! Nodes are the free rear of the striker, its interfaces, the contact, those of the target, and its back. In a layer of impedance Z a wave has the pressure D
//! downwards or U upwards, `p = D + U`, and the velocity `(D − U)/Z`. At t = 0 the striker has the velocity V0: the contact sends
//! `p = V0·Z₁Z₂/(Z₁ + Z₂)` both ways, in the layers at either side of it. As long as it is pressed it is an interface like any other. Once it would be pulled
//! the bodies part, and its faces are free: with the pressure p before and what arrives, D₁ and U₂, they send `U₁ = −p − D₁` and `D₂ = −p − U₂`, and from then
//! on return whatever arrives with −1. That they meet again is left out.

use std::collections::BTreeMap;

/// A layer: impedance, and the time in which a wave crosses it, infinite for a half-space.
pub type Layer = (f64, f64);

/// A pressure over time: times in ascending order, and the pressure from there on.
pub type Steps = Vec<(f64, f64)>;

/// Two stacks that collide with the velocity 1.
pub struct Collision {
    /// From the rear of the striker down to the back of the target.
    layers: Vec<Layer>,
    /// Number of layers of the striker, which is that of the node of contact.
    contact: usize,
    /// Reflection at the back of the target: −1 of a free one, 1 of a rigid one.
    back: f64,
}

/// Times are told apart to this part of a unit.
const TICKS: f64 = 1e9;

impl Collision {
    /// * `striker`: from the nose up
    /// * `target`: from the surface down
    pub fn new(striker: &[Layer], target: &[Layer], back: f64) -> Self {
        let layers = striker.iter().rev().chain(target).copied().collect();
        Self { layers, contact: striker.len(), back }
    }

    /// Steps of the pressure of the contact as long as it is pressed; the last is the time at which it ends, if it does before `until`, with what the pressure
    /// would be.
    pub fn pressure(&self, until: f64) -> Steps {
        let (mut steps, parting) = self.rays(self.contact, until);
        if let Some(parting) = parting {
            steps.retain(|step| step.0 < parting.0);
            steps.push(parting);
        }
        steps
    }

    /// Steps of the pressure at an interface of the target, whatever becomes of the contact.
    ///
    /// * `interface`: 0 for the contact, 1 for the back of the first layer
    pub fn pressure_below(&self, interface: usize, until: f64) -> Steps {
        self.rays(self.contact + interface, until).0
    }

    /// Steps of the pressure at a node, and when the bodies part, with what the pressure of the contact would be.
    fn rays(&self, watched: usize, until: f64) -> (Steps, Option<(f64, f64)>) {
        let (upper, lower) = (self.layers[self.contact - 1], self.layers[self.contact]);
        let mut contact = upper.0 * lower.0 / (upper.0 + lower.0);
        let mut parting = None;
        let mut pressure = if watched == self.contact { contact } else { 0.0 };
        let mut found = vec![(0.0, pressure)];
        // pressures that come to a node, from above and from below, by time
        let mut under_way: BTreeMap<(u64, usize), [f64; 2]> = BTreeMap::new();
        let send = |under_way: &mut BTreeMap<_, [f64; 2]>, time: f64, node: usize, side: usize, p: f64| {
            if time <= until && p.abs() > 1e-15 {
                under_way.entry(((time * TICKS).round() as u64, node)).or_default()[side] += p;
            }
        };
        send(&mut under_way, upper.1, self.contact - 1, 1, contact);
        send(&mut under_way, lower.1, self.contact + 1, 0, contact);
        while let Some(((ticks, node), [from_above, from_below])) = under_way.pop_first() {
            let time = ticks as f64 / TICKS;
            let [mut up, mut down] = self.sent(node, from_above, from_below);
            if node == self.contact {
                let joined = contact + from_above + up;
                if parting.is_none() && joined < -1e-12 {
                    parting = Some((time, joined));
                }
                if parting.is_some() {
                    [up, down] = [-contact - from_above, -contact - from_below];
                    contact = 0.0;
                } else {
                    contact = joined;
                }
            }
            if node == watched {
                pressure += if node > 0 { from_above + up } else { from_below + down };
                found.push((time, pressure));
            }
            if node > 0 {
                send(&mut under_way, time + self.layers[node - 1].1, node - 1, 1, up);
            }
            if node < self.layers.len() {
                send(&mut under_way, time + self.layers[node].1, node + 1, 0, down);
            }
        }
        (found, parting)
    }

    /// What a node sends up and down for what arrives there, its layers joined.
    fn sent(&self, node: usize, from_above: f64, from_below: f64) -> [f64; 2] {
        if node == 0 {
            return [0.0, -from_below];
        }
        if node == self.layers.len() {
            return [self.back * from_above, 0.0];
        }
        let (above, below) = (self.layers[node - 1].0, self.layers[node].0);
        let r = (below - above) / (below + above);
        [r * from_above + (1.0 - r) * from_below, (1.0 + r) * from_above - r * from_below]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn impulse(steps: &Steps, until: f64) -> f64 {
        let ends = steps.iter().skip(1).map(|step| step.0).chain([until]);
        steps.iter().zip(ends).map(|((from, pressure), to)| pressure * (to - from)).sum()
    }

    #[test]
    fn a_rod_stops_on_its_like() {
        let rods = Collision::new(&[(2.0, 1.5)], &[(2.0, 1.0), (2.0, f64::INFINITY)], 0.0);
        assert_eq!(rods.pressure_below(0, 9.0), [(0.0, 1.0), (3.0, 0.0)]);
        assert_eq!(rods.pressure_below(1, 9.0), [(0.0, 0.0), (1.0, 1.0), (4.0, 0.0)]);
    }

    #[test]
    fn what_presses_the_contact_goes_down_the_bar_even_after_the_bodies_part() {
        const UNTIL: f64 = 400.0;
        for specimen in [(1.0, 0.5), (9.0, 0.7), (0.3, 0.9)] {
            let bars = Collision::new(&[(5.0, 4.0)], &[specimen, (5.0, 1.0), (5.0, f64::INFINITY)], 0.0);
            let mut pressed = bars.pressure(UNTIL);
            let (end, after) = pressed.pop().expect("a step");
            assert!(after < 0.0 && end < 0.5 * UNTIL, "{specimen:?}: they part");
            let [above, below] = [impulse(&pressed, end), impulse(&bars.pressure_below(2, UNTIL), UNTIL)];
            assert!((above / below - 1.0).abs() < 1e-9, "{specimen:?}: {above} {below}");
            assert!(above > 0.5 * 5.0 * 8.0, "{specimen:?}: {above} of the striker's momentum");
        }
    }
}
