//! Saint-Venant's collision of two stacks of layers, by rays: plane waves in rods that are kept from getting wider.
//!
//! Nodes are the free rear of the striker, its interfaces, the contact, those of the target, and its back. In a layer of impedance Z a wave has the pressure D
//! downwards or U upwards, `p = D + U`, and the velocity `(D − U)/Z`. At t = 0 the striker has the velocity V0: the contact sends
//! `p = V0·Z₁Z₂/(Z₁ + Z₂)` both ways, in the layers at either side of it. As long as it is pressed it is an interface like any other.

use std::collections::BTreeMap;

/// A layer: impedance, and the time in which a wave crosses it, infinite for a half-space.
pub type Layer = (f64, f64);

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

    /// Steps of the pressure of the contact as long as it is pressed: times in ascending order, and the pressure from there on; the last is the time at
    /// which it ends, if it does before `until`, with what the pressure would be.
    pub fn pressure(&self, until: f64) -> Vec<(f64, f64)> {
        let (upper, lower) = (self.layers[self.contact - 1], self.layers[self.contact]);
        let first = upper.0 * lower.0 / (upper.0 + lower.0);
        let mut pressure = first;
        let mut found = vec![(0.0, pressure)];
        // pressures that come to a node, from above and from below, by time
        let mut under_way: BTreeMap<(u64, usize), [f64; 2]> = BTreeMap::new();
        let send = |under_way: &mut BTreeMap<_, [f64; 2]>, time: f64, node: usize, side: usize, p: f64| {
            if time <= until && p.abs() > 1e-15 {
                under_way.entry(((time * TICKS).round() as u64, node)).or_default()[side] += p;
            }
        };
        send(&mut under_way, upper.1, self.contact - 1, 1, first);
        send(&mut under_way, lower.1, self.contact + 1, 0, first);
        while let Some(((ticks, node), [from_above, from_below])) = under_way.pop_first() {
            let time = ticks as f64 / TICKS;
            let [up, down] = if node == 0 {
                [0.0, -from_below]
            } else if node == self.layers.len() {
                [self.back * from_above, 0.0]
            } else {
                let (above, below) = (self.layers[node - 1].0, self.layers[node].0);
                let r = (below - above) / (below + above);
                [r * from_above + (1.0 - r) * from_below, (1.0 + r) * from_above - r * from_below]
            };
            if node == self.contact {
                pressure += from_above + up;
                found.push((time, pressure));
                if pressure < -1e-12 {
                    return found;
                }
            }
            if node > 0 {
                send(&mut under_way, time + self.layers[node - 1].1, node - 1, 1, up);
            }
            if node < self.layers.len() {
                send(&mut under_way, time + self.layers[node].1, node + 1, 0, down);
            }
        }
        found
    }
}
