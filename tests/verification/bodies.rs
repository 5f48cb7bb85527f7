//! Targets that are not alike in all directions, and targets that end: against static stiffness, plane waves and bars.
//!
//! ```text
//!   z ↑ axis of symmetry          punch
//!   ────────────────────        ┌───────┐
//!   layers of a laminate        │  bar  │ rim: free, or in a smooth guide
//!   ────────────────────        │       │
//! ```

use std::f64::consts::PI;

use percuss::{
    case::Case,
    exact::stack::{Stack, StackLayer},
    grid::Back,
};

use super::run;

fn sound(text: &str, settings: &[&str]) -> Case {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Case::parse("bodies", text, &settings, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

/// Slope of the drag over time from `from` on, by least squares.
fn slope(curve: &[(f64, f64)], from: f64) -> f64 {
    let late: Vec<_> = curve.iter().filter(|(time, _)| *time >= from).collect();
    let count = late.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| late.iter().map(|point| of(point)).sum::<f64>() / count;
    let (time, drag) = (mean(|point| point.0), mean(|point| point.1));
    let of = |square: fn(f64, f64) -> f64| {
        late.iter().map(|point| square(point.0 - time, point.1 - drag)).sum::<f64>()
    };
    of(|t, f| t * f) / of(|t, _| t * t)
}

/// A flat punch on a half-space whose axis of symmetry is z is as stiff as its indentation modulus says, `F = 2aMw`: 16 cells across the
/// punch's radius, 22 to 32 transit times of it after the impact.
#[test]
fn a_punch_on_a_laminate_meets_its_indentation_modulus() {
    let materials = [
        [60.0, 13.0, 6.5, 4.5, 20.0],
        [31.0, 22.0, 9.0, 6.5, 11.0],
        [3.0, 10.0, 1.0, 1.5, 1.0],
        [10.0, 10.0, 5.0, 2.5, 2.5],
    ];
    for [c11, c33, c13, c44, c66] in materials {
        let text = format!(
            "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nmaterial = {{ C11 = \"{c11} GPa\", C33 = \"{c33} GPa\", C13 = \"{c13} GPa\", \
             C44 = \"{c44} GPa\", C66 = \"{c66} GPa\", density = \"1000 kg/m3\" }}\n[indenter]\nshape = \"flat\"\nradius = \"10 mm\"\n\
             [impact]\nvelocity = \"1 m/s\"\n[mesh]\ncontact_cells = 32\n[run]\nend_time = \"{} us\"\n[record]\nframes = 0\n",
            32e4 / (c33 * 1e6_f64).sqrt()
        );
        let case = sound(&text, &[]);
        let curve = run(&case, |view| (view.time, view.drag));
        // M of A. Delafargue and F.-J. Ulm (2004), in units of C33
        let (root, product) = ((c11 * c33).sqrt(), c11 * c33 - c13 * c13);
        let modulus = 2.0 * (product / c11 / (1.0 / c44 + 2.0 / (root + c13))).sqrt() / c33;
        // forces are per πR²
        let ratio = slope(&curve, 22.0) / (2.0 * modulus * case.impact.velocity / PI);
        println!("C11 … C44 = {c11}, {c33}, {c13}, {c44}: {ratio:.4} of 2aMV0");
        assert!((ratio - 1.0).abs() < 3e-3, "{c11} {c33} {c13} {c44}: {ratio}");
    }
}

/// In a smooth guide plane waves along z are exact for ever: a rod of two layers under a punch of its own radius against the sum of rays.
#[test]
fn a_guided_rod_is_the_sum_of_rays() {
    let text = "model = \"elastic\"\n[target]\nradius = 1.0\nrim = \"guided\"\nback = \"free\"\nlayer = [\
                { thickness = 0.5, shear_wave_speed = 0.5 }, { thickness = 0.3, density = 0.5, wave_speed = 0.8, shear_wave_speed = 0.4 }]\n\
                [indenter]\nshape = \"flat\"\nradius = 1.0\n[impact]\ncontact = \"bilateral\"\n[mesh]\ncells = 21\n[run]\nend_time = 9.0\n\
                [record]\nframes = 0\n";
    for geometry in ["axisymmetric", "plane"] {
        let case = sound(text, &[&format!("geometry={geometry}")]);
        let layers =
            case.target.computed().into_iter().zip(&case.sizes.layers).map(|(layer, rows)| StackLayer {
                impedance: layer.waves.impedance,
                wave_speed: rows.dz / case.sizes.dt,
                shear_wave_speed: layer.waves.shear,
                thickness: layer.thickness.expect("a layer"),
            });
        let stack = Stack::new(&layers.collect::<Vec<_>>(), Back::Free).expect("layers");
        let area = if geometry == "plane" { case.target.radius.expect("a rod") } else { 1.0 };
        let mut largest: f64 = 0.0;
        for (time, drag) in run(&case, |view| (view.time, view.drag)) {
            let stress = |time: f64| stack.pressure(0.0, time).expect("a time");
            // in the step in which a front arrives it is in between
            let [before, after] = [-0.6, 0.6].map(|steps| stress((time + steps * case.sizes.dt).max(0.0)));
            if (before - after).abs() < 1e-9 {
                largest = largest.max((drag / area - after).abs());
            }
        }
        println!("{geometry}: {largest:e} of γc_pV0");
        assert!(largest < 1e-12, "{geometry}: {largest:e}");
    }
}
