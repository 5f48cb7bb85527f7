//! Speed of waves along the free surface of a coated half-space, or of one of several layers, in the full theory of elasticity.
//!
//! A wave that decays with the depth moves along the surface with the phase speed c at which a field that the half-space allows is
//! free of stress at the surface: a root of the secular function of `transfer`, `c < c_s` of the half-space. The first root belongs to
//! the wave that is Rayleigh's without a coating. One over a stiff coating is long: its speed rises with `kh` until it reaches
//! that c_s, and then it radiates into the half-space.

use percuss::exact::stack::Stack;

use super::transfer::Fields;

/// Phase speeds that are tried, from 0 to c_s of the half-space.
const TRIED: u32 = 400;

/// Halvings of the interval between two of them.
const HALVINGS: u32 = 50;

/// Phase speed of the slowest surface wave \[c_p of the first layer\]; `None` if none is slower than c_s of the half-space.
///
/// * `stack`: layers, the last one a half-space
/// * `wave_number`: k along the surface \[1/R\]
pub fn phase_speed(stack: &Stack, wave_number: f64) -> Option<f64> {
    let space = stack.layers().last().expect("a stack has layers");
    let secular = |speed: f64| Fields::on_half_space(stack, wave_number, speed).secular();
    let tried = |n: u32| space.shear_wave_speed * f64::from(n) / f64::from(TRIED);
    // at rest both potentials are one, which is a root for every half-space
    let first = (1..TRIED - 1).find(|n| secular(tried(*n)) * secular(tried(n + 1)) <= 0.0)?;
    let (mut low, mut high) = (tried(first), tried(first + 1));
    let sign = secular(low);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if secular(middle) * sign > 0.0 { &mut low } else { &mut high }) = middle;
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use percuss::{
        exact::{stack::StackLayer, surface_impedance::SurfaceImpedance},
        grid::Back,
    };

    fn rayleigh_speed(beta: f64) -> f64 {
        SurfaceImpedance::new(beta).expect("a material").rayleigh_speed()
    }

    fn coated(coating: [f64; 3], thickness: f64) -> Stack {
        let [impedance, wave_speed, shear_wave_speed] = coating;
        let coating = StackLayer { impedance, wave_speed, shear_wave_speed, thickness };
        let space =
            StackLayer { impedance: 1.0, wave_speed: 1.0, shear_wave_speed: 0.5, thickness: f64::INFINITY };
        Stack::new(&[coating, space], Back::Rigid).expect("a stack")
    }

    #[test]
    fn limits_are_rayleigh_waves() {
        let space = rayleigh_speed(0.5);
        let bare = Stack::single(0.5, None).expect("a half-space");
        assert!((phase_speed(&bare, 3.0).expect("a wave") - space).abs() < 1e-13);
        let same = coated([1.0, 1.0, 0.5], 0.4);
        assert!((phase_speed(&same, 5.0).expect("a wave") - space).abs() < 1e-12);
        // a soft coating: from the Rayleigh wave of the half-space to that of the coating
        let soft = coated([0.5, 0.6, 0.25], 1.0);
        let coating = 0.6 * rayleigh_speed(0.25 / 0.6);
        assert!((phase_speed(&soft, 1e-4).expect("a wave") / space - 1.0).abs() < 1e-3);
        assert!((phase_speed(&soft, 40.0).expect("a wave") / coating - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_thin_coating_changes_the_speed_in_proportion() {
        // Tiersten (1969), a thin film: a stiff one speeds the wave up and a heavy one slows it down, by as much as it is thick
        let space = rayleigh_speed(0.5);
        let change =
            |coating: [f64; 3], h: f64| phase_speed(&coated(coating, h), 1.0).expect("a wave") / space - 1.0;
        for (coating, sign) in [([2.0, 1.9, 1.1], 1.0), ([3.0, 0.8, 0.4], -1.0)] {
            let [thin, thinner] = [2e-4, 1e-4].map(|h| change(coating, h));
            assert!((thin / thinner - 2.0).abs() < 0.01 && thin * sign > 0.0, "{thin} {thinner}");
        }
    }

    #[test]
    fn short_waves_of_a_stiff_coating_radiate() {
        let stiff = [2.0, 1.9, 1.1];
        assert!(phase_speed(&coated(stiff, 1.0), 0.1).is_some());
        assert!(phase_speed(&coated(stiff, 1.0), 5.0).is_none());
    }
}
