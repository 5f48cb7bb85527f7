//! The form against the closed one on the axis, limits, and integrals of the pressure.

use super::*;
use crate::{
    exact::{paraboloid::Paraboloid, stack::StackLayer},
    grid::Back,
    model::ModelKind,
};

const CONE: Front = Front::Cone { spread_rate: 2.0 };

#[test]
fn agrees_with_the_closed_form_on_the_axis() {
    for (v, k, c, h) in [(0.1, 0.2, 0.5, Some(1.0)), (1.0, 2.5, 0.3, None), (0.7, 0.6, 0.9, Some(0.4))] {
        let closed = Paraboloid::new(ModelKind::Rakhmatulin, v, k, c, h).expect("parameters");
        let general = Spreading::new(Front::Paraboloid { curvature: k }, v, c, h).expect("parameters");
        for t in [0.013, 0.3, 0.77, 1.87, 2.33, 4.93] {
            for z in [0.0, 0.1, 0.37] {
                let (a, b) = (closed.axis_pressure(z, t), general.pressure(0.0, z, t));
                let (a, b) = (a.expect("range"), b.expect("range"));
                assert!((a - b).abs() <= 1e-10 * v, "k={k} c={c} z={z} t={t}: {a} {b}");
            }
        }
    }
}

#[test]
fn is_smooth_towards_the_axis_and_where_the_centre_changes() {
    // just off the axis the value is that of the axis; the centre of the rays changes with the arrival of d
    let front = Front::Paraboloid { curvature: 0.2 };
    let layer = Spreading::new(front, 0.1, 0.5, Some(1.0)).expect("parameters");
    let axis = layer.pressure(0.0, 0.0, 4.3).expect("range");
    assert!((layer.pressure(1e-5, 0.0, 4.3).expect("range") - axis).abs() < 1e-8);
    let r = 0.5;
    let switch = 2.0 + front.arrival(r);
    let [before, after] = [-1e-7, 1e-7].map(|step| layer.pressure(r, 0.0, switch + step).expect("range"));
    assert!((before - after).abs() < 1e-6, "{before} {after}");
}

#[test]
fn drag_is_the_integral_of_pressure() {
    // faster than all waves: closed form against pressure integrated over the contact
    let paraboloid = Front::Paraboloid { curvature: 2.5 };
    for (front, h, t) in [(CONE, None, 0.7), (CONE, Some(0.2), 1.1), (paraboloid, Some(0.3), 1.5)] {
        let contact = Spreading::new(front, 0.8, 0.4, h).expect("parameters");
        check(contact, front, t);
    }
    let stack = layers(&[[1.0, 1.0, 0.2], [0.3, 0.6, 0.15]], Back::Rigid);
    check(Spreading::on_stack(CONE, 0.8, stack).expect("parameters"), CONE, 1.3);

    fn check(contact: Spreading, front: Front, t: f64) {
        let edge = front.radius(t);
        let mut sum = 0.0;
        // pressure jumps where reflections end
        let mut ends: Vec<f64> = vec![0.0, edge];
        for (d, _) in contact.stack.arrivals(0.0, t).expect("range").into_iter().filter(|path| path.0 > 0.0) {
            ends.push(bisect(edge, 60, |r| contact.first_arrival(r, d).0 <= t).0);
        }
        ends.sort_by(f64::total_cmp);
        for ends in ends.windows(2) {
            sum += singular_at_ends(ends[1] - ends[0], |x, rest| {
                let r = if x < rest { ends[0] + x } else { ends[1] - rest };
                if r <= 0.0 || r >= edge {
                    0.0
                } else {
                    2.0 * r * contact.pressure(r, 0.0, t).expect("contact")
                }
            });
        }
        let drag = contact.drag(t).expect("range");
        assert!((sum / drag - 1.0).abs() < 1e-6, "{front:?}, t = {t}: {sum} {drag}");
    }
}

#[test]
fn drag_is_continuous_where_the_contact_falls_behind_the_waves() {
    // F is continuous where the contact falls behind the waves, r* = k/2c
    let front = Front::Paraboloid { curvature: 0.2 };
    let contact = Spreading::new(front, 1.0, 0.5, Some(1.0)).expect("parameters");
    let [before, after] = [0.2 - 1e-6, 0.2 + 1e-6].map(|t| contact.drag(t).expect("range"));
    assert!((before - after).abs() < 1e-5, "{before} {after}");
    assert!((before - 0.04).abs() < 1e-5);
}

#[test]
fn front_of_a_cone() {
    // a plane front of slowness 1/V* carries V0·√(1 − c²/V*²), on the surface as in the depth
    let (c, rate) = (0.5, 2.0);
    let layer = Spreading::new(CONE, 1.0, c, Some(1.0)).expect("parameters");
    let amplitude = (1.0 - (c / rate).powi(2)).sqrt();
    let r = 3.0;
    let front = layer.pressure(r, 0.0, r / rate + 1e-9).expect("range");
    assert!((front - amplitude).abs() < 1e-6, "{front} {amplitude}");
    assert_eq!(layer.pressure(r, 0.0, r / rate - 1e-9), Ok(0.0));
    // the first reflection arrives d·√(1 − c²/V*²) after the contact, for a while like a plane wave
    let arrival = r / rate + 2.0 * amplitude;
    let [before, after] = [-1e-6, 1e-6].map(|step| layer.pressure(r, 0.0, arrival + step).expect("range"));
    assert!(after - before > amplitude && after - before < 2.0 * amplitude, "{before} {after}");
}

#[test]
fn scaling_of_a_cone() {
    // a cone on a half-space has no length: p depends on r/t alone
    let space = Spreading::new(CONE, 0.3, 0.6, None).expect("parameters");
    let p = space.pressure(0.4, 0.0, 0.9).expect("range");
    for factor in [1e-3, 7.0] {
        let scaled = space.pressure(0.4 * factor, 0.0, 0.9 * factor).expect("range");
        assert!((scaled / p - 1.0).abs() < 1e-10);
    }
}

#[test]
fn without_shear_waves_every_column_is_a_rod() {
    let layer = Spreading::new(CONE, 0.5, 1e-4, Some(1.0)).expect("parameters");
    // 0.25 after the contact reaches r, then two reflections later
    for (t, expected) in [(0.75, 0.5), (3.0, 1.5), (5.0, 2.5)] {
        let p = layer.pressure(1.0, 0.0, t).expect("range");
        assert!((p - expected).abs() < 1e-3, "{t}: {p}");
    }
}

#[test]
fn the_flat_face_is_a_plane_wave() {
    let layer = Spreading::new(Front::Flat, 2.0, 0.5, Some(1.0)).expect("parameters");
    for (z, t, expected) in
        [(0.0, 0.0, 1.0), (0.0, 0.5, 2.0), (0.0, 2.0, 4.0), (0.0, 2.1, 6.0), (0.5, 1.0, 2.0)]
    {
        assert_eq!(layer.pressure(0.3, z, t), Ok(expected), "{z} {t}");
    }
}

#[test]
fn half_a_jump_where_a_front_arrives() {
    let layer =
        Spreading::new(Front::Paraboloid { curvature: 0.2 }, 0.1, 0.5, Some(1.0)).expect("parameters");
    assert!((layer.pressure(0.0, 0.0, 0.0).expect("range") - 0.05).abs() < 1e-6);
    let [before, at, after] =
        [2.0 - 1e-7, 2.0, 2.0 + 1e-7].map(|t| layer.pressure(0.0, 0.0, t).expect("range"));
    assert!((at - 0.5 * (before + after)).abs() < 1e-6 && after > before + 0.03);
}

#[test]
fn outside_its_range_it_is_an_error() {
    let cone = Spreading::new(CONE, 1.0, 0.5, None).expect("parameters");
    assert!(cone.pressure(0.0, 0.0, 1.0).is_err(), "the tip");
    assert!(cone.pressure(0.0, 0.1, 1.0).is_ok());
    let paraboloid =
        Spreading::new(Front::Paraboloid { curvature: 0.2 }, 1.0, 0.5, Some(1.0)).expect("parameters");
    assert!(paraboloid.pressure(0.9, 0.0, 1.0).is_err(), "beyond a slow contact");
    assert!(paraboloid.pressure(0.1, 1.2, 1.0).is_err(), "below the layer");
    assert!(paraboloid.pressure(0.1, 0.0, f64::NAN).is_err());
    assert!(Spreading::new(Front::Cone { spread_rate: -1.0 }, 1.0, 0.5, None).is_err());
}

fn layers(values: &[[f64; 3]], back: Back) -> Stack {
    let layer = |&[impedance, wave_speed, thickness]: &[f64; 3]| StackLayer {
        impedance,
        wave_speed,
        shear_wave_speed: 0.4,
        thickness,
    };
    Stack::new(&values.iter().map(layer).collect::<Vec<_>>(), back).expect("a stack")
}

#[test]
fn layers_of_one_material_are_one_layer() {
    let stack = layers(&[[1.0, 1.0, 0.3], [1.0, 1.0, 0.2], [1.0, 1.0, 0.7]], Back::Rigid);
    let front = Front::Paraboloid { curvature: 0.3 };
    let cut = Spreading::on_stack(front, 0.2, stack).expect("parameters");
    let whole = Spreading::new(front, 0.2, 0.4, Some(1.2)).expect("parameters");
    for (r, z, t) in [(0.0, 0.0, 3.1), (0.4, 0.0, 5.3), (0.2, 0.3, 2.9), (0.2, 0.45, 4.0)] {
        let [cut, whole] = [&cut, &whole].map(|form| form.pressure(r, z, t).expect("range"));
        assert!((cut - whole).abs() < 1e-12, "{r} {z} {t}: {cut} {whole}");
    }
    let [cut, whole] = [&cut, &whole].map(|form| form.drag(4.0).expect("range"));
    assert!((cut - whole).abs() < 1e-12, "{cut} {whole}");
}

#[test]
fn stress_goes_on_through_an_interface_and_vanishes_at_a_free_back() {
    let stack = layers(&[[1.0, 1.0, 0.5], [0.2, 0.6, 0.3]], Back::Free);
    let form = Spreading::on_stack(CONE, 0.5, stack).expect("parameters");
    let at = |z: f64| form.pressure(0.2, z, 3.3).expect("range");
    let [above, interface, below] = [0.5 - 1e-8, 0.5, 0.5 + 1e-8].map(at);
    assert!(
        (above - interface).abs() < 1e-6 && (below - interface).abs() < 1e-6,
        "{above} {interface} {below}"
    );
    assert!(interface.abs() > 1e-3 && at(0.8) == 0.0);
}

#[test]
fn layers_of_different_shear_wave_speeds_carry_plane_waves_alone() {
    let layer = |shear_wave_speed: f64| StackLayer {
        impedance: 1.0,
        wave_speed: 1.0,
        shear_wave_speed,
        thickness: 1.0,
    };
    let stack = Stack::new(&[layer(0.5), layer(0.3)], Back::Rigid).expect("a stack");
    assert!(Spreading::on_stack(CONE, 1.0, stack.clone()).is_err());
    let flat = Spreading::on_stack(Front::Flat, 1.0, stack.clone()).expect("parameters");
    for t in [0.0, 1.7, 4.0, 9.0] {
        assert_eq!(flat.pressure(0.3, 0.0, t), stack.pressure(0.0, t));
    }
}
