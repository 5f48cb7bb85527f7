//! Harmonic fields of the full theory in layers, `cos kx` along the surface, at rest or moving along it with the phase speed c: those
//! that the far side allows, carried up to the surface.
//!
//! With `u_z = w·cos kx`, `u_r = v·sin kx`, `σ_zz = k·s·cos kx`, `σ_rz = k·q·sin kx`, `x = kz` and the constants of a layer
//! `M = γc_p²`, `G = γc_s²`, `Λ = M − 2G`, the equations of motion are (Thomson 1950; Haskell 1953)
//!
//! ```text
//! w' = (s − Λv)/M                  v' = q/G + w
//! s' = −γc²·w − q                  q' = −γc²·v + (Λ/M)·s + (M − Λ²/M)·v
//! ```
//!
//! Two of their four solutions meet the conditions at the far side. They are carried up by exponentials of matrices over small steps
//! and made orthonormal again after each, so that neither is lost beside the one that grows faster. All four numbers are continuous at
//! a welded interface.

use percuss::exact::stack::{Stack, StackLayer};

/// w, v, s and q.
type State = [f64; 4];

/// Two fields that satisfy the conditions at the far side.
#[derive(Clone, Copy, Debug)]
pub struct Fields([State; 2]);

/// Largest norm of the exponent of a step, and the terms of its series: the rest is 1e-18.
const LONGEST: f64 = 1.0;
const TERMS: usize = 18;

impl Fields {
    /// Static fields at the surface of a stack with a smooth rigid back, `w = q = 0` there.
    ///
    /// * `k`: wave number \[1/R\]
    pub fn on_rigid_back(stack: &Stack, k: f64) -> Self {
        Self([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]).carried(stack.layers(), k, 0.0)
    }

    /// Fields at the surface of a stack over a half-space that decay in it: with `a² = 1 − c²/c_p²`, `b² = 1 − c²/c_s²` there, the
    /// potentials `e^{−ax}` and `e^{−bx}`.
    ///
    /// * `k`: wave number \[1/R\]
    /// * `speed`: phase speed c, below c_s of the half-space \[c_p\]
    pub fn on_half_space(stack: &Stack, k: f64, speed: f64) -> Self {
        let (space, above) = stack.layers().split_last().expect("a stack has layers");
        let [m, g] = moduli(space);
        let decay = |wave: f64| (1.0 - (speed / wave).powi(2)).sqrt();
        let (a, b) = (decay(space.wave_speed), decay(space.shear_wave_speed));
        let longitudinal = [a, 1.0, (m - 2.0 * g) - m * a * a, -2.0 * g * a];
        let shear = [1.0, b, -2.0 * g * b, -g * (1.0 + b * b)];
        Self([longitudinal, shear]).carried(above, k, speed)
    }

    /// The fields at the top of layers.
    fn carried(mut self, layers: &[StackLayer], k: f64, speed: f64) -> Self {
        for layer in layers.iter().rev() {
            let matrix = matrix(layer, speed);
            let norm =
                matrix.iter().map(|row| row.iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
            let depth = k * layer.thickness;
            let steps = (depth * norm / LONGEST).ceil().max(1.0);
            let step = exponential(&matrix, -depth / steps);
            // stresses in units of the layer
            let unit = moduli(layer)[0];
            self.scale(1.0 / unit);
            for _ in 0..steps as usize {
                self = Self(self.0.map(|state| times(&step, state))).orthonormal();
            }
            self.scale(unit);
        }
        self
    }

    fn scale(&mut self, factor: f64) {
        for state in &mut self.0 {
            state[2] *= factor;
            state[3] *= factor;
        }
    }

    /// Combinations of both of unit length and at right angles, by a matrix with a positive determinant.
    fn orthonormal(self) -> Self {
        let [first, second] = self.0;
        let dot = |a: &State, b: &State| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let unit = |state: State| state.map(|value| value / dot(&state, &state).sqrt());
        let first = unit(first);
        let share = dot(&first, &second);
        let second: State = std::array::from_fn(|i| second[i] - share * first[i]);
        Self([first, unit(second)])
    }

    /// `−w/s` of the field without shear stress at the surface: its displacement times wave number per unit of pressure \[1/γc_p²\].
    pub fn compliance(&self) -> f64 {
        let [a, b] = self.0;
        (b[3] * a[0] - a[3] * b[0]) / (a[3] * b[2] - b[3] * a[2])
    }

    /// A number that vanishes where a field is free of stress at the surface, and is continuous in the phase speed.
    pub fn secular(&self) -> f64 {
        let [a, b] = self.0;
        a[2] * b[3] - a[3] * b[2]
    }
}

/// M and G \[γc_p² of the first layer\].
fn moduli(layer: &StackLayer) -> [f64; 2] {
    let density = layer.impedance / layer.wave_speed;
    [layer.wave_speed, layer.shear_wave_speed].map(|speed| density * speed * speed)
}

/// The matrix of the equations of motion with stresses in units of M.
fn matrix(layer: &StackLayer, speed: f64) -> [State; 4] {
    let shear = (layer.shear_wave_speed / layer.wave_speed).powi(2);
    let (lame, inertia) = (1.0 - 2.0 * shear, (speed / layer.wave_speed).powi(2));
    [
        [0.0, -lame, 1.0, 0.0],
        [1.0, 0.0, 0.0, 1.0 / shear],
        [-inertia, 0.0, 0.0, -1.0],
        [0.0, 1.0 - lame * lame - inertia, lame, 0.0],
    ]
}

fn times(matrix: &[State; 4], state: State) -> State {
    std::array::from_fn(|i| matrix[i].iter().zip(state).map(|(entry, value)| entry * value).sum())
}

/// `e^{tA}` by its series.
fn exponential(matrix: &[State; 4], t: f64) -> [State; 4] {
    // columns: what becomes of each of the four states
    let column = |j: usize| {
        let mut term: State = std::array::from_fn(|i| f64::from(u8::from(i == j)));
        let mut sum = term;
        for n in 1..=TERMS {
            term = times(matrix, term).map(|value| value * t / n as f64);
            sum = std::array::from_fn(|i| sum[i] + term[i]);
        }
        sum
    };
    let columns: [State; 4] = std::array::from_fn(column);
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use percuss::{exact::surface_impedance::SurfaceImpedance, grid::Back};

    fn layer(impedance: f64, wave_speed: f64, shear_wave_speed: f64, thickness: f64) -> StackLayer {
        StackLayer { impedance, wave_speed, shear_wave_speed, thickness }
    }

    #[test]
    fn one_layer_on_a_rigid_back_is_known() {
        // κ·(cosh 2x − 1)/(sinh 2x + 2x) of `layer_kernel`, in one layer and cut into three
        for beta in [0.1, 0.4, 0.8] {
            let stiffness = SurfaceImpedance::new(beta).expect("a material").stiffness();
            let cut = [0.2, 1.1, 0.5].map(|thickness| layer(1.0, 1.0, beta, thickness));
            let whole = [layer(1.0, 1.0, beta, 1.8)];
            for k in [1e-3_f64, 0.1, 0.7, 3.0, 15.0, 200.0] {
                let x = 1.8 * k;
                let rest = (1.0 + 2.0 * x - (-2.0 * x).exp()) / ((2.0 * x).sinh() + 2.0 * x);
                for layers in [&whole[..], &cut] {
                    let stack = Stack::new(layers, Back::Rigid).expect("a stack");
                    let found = stiffness * Fields::on_rigid_back(&stack, k).compliance();
                    let expected = if x < 300.0 { 1.0 - rest } else { 1.0 };
                    assert!(
                        (found / expected - 1.0).abs() < 1e-10,
                        "β = {beta}, k = {k}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn short_waves_see_the_first_layer_and_long_ones_columns_without_poissons_effect() {
        let stack = [layer(1.0, 1.0, 0.4, 0.3), layer(0.1, 0.5, 0.3, 0.2), layer(4.0, 1.7, 0.9, 0.5)];
        let stack = Stack::new(&stack, Back::Rigid).expect("a stack");
        let stiffness = SurfaceImpedance::new(0.4).expect("a material").stiffness();
        assert!((stiffness * Fields::on_rigid_back(&stack, 60.0).compliance() - 1.0).abs() < 1e-12);
        // ν = 0 in all layers: w/p = Σ h/M
        let column = |impedance: f64, speed: f64, thickness: f64| {
            layer(impedance, speed, speed * 0.5f64.sqrt(), thickness)
        };
        let columns = [column(1.0, 1.0, 0.3), column(0.1, 0.5, 0.2), column(4.0, 1.7, 0.5)];
        let stack = Stack::new(&columns, Back::Rigid).expect("a stack");
        let k = 1e-3;
        let found = Fields::on_rigid_back(&stack, k).compliance() / k;
        let expected = 0.3 + 0.2 / 0.05 + 0.5 / 6.8;
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}
