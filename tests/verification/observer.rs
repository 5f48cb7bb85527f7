//! Recording is an observer: drag, velocity, interface stress, events and largest strains and tractions of random cases are the same bits whatever is recorded,
//! on any number of threads, and by the plain stepper.
//!
//! Cases have all shapes, both theories and geometries, one to three layers on all backs, every rule of contact, masses from light to
//! infinite, and from 5 to 300 nodes in contact.

use std::{
    fmt::Write,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
};

use percuss::{
    advice::Advised,
    case::Case,
    session,
    simulation::{Engine, Simulation},
    validity::{Peak, Validity},
    view::{Event, EventKind, View},
};
use rayon::prelude::*;

use crate::is_full;

/// A linear congruential generator, by its state.
struct Noise(u64);

impl Noise {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    fn pick<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[self.below(choices.len())]
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.unit()
    }
}

/// The text of a random case without its section `[record]`; some are refused.
fn text(noise: &mut Noise) -> String {
    let mut text = String::new();
    let model = noise.pick(&["rakhmatulin", "elastic"]);
    writeln!(text, "model = \"{model}\"\ngeometry = \"{}\"", noise.pick(&["axisymmetric", "plane"]))
        .expect("text");
    let back = noise.pick(&["rigid", "rigid", "free", "half-space"]);
    let layers = [1, 1, 2, 3][noise.below(4)];
    writeln!(text, "[target]").expect("text");
    if back == "free" {
        writeln!(text, "back = \"free\"").expect("text");
    }
    for layer in 0..layers {
        writeln!(text, "[[target.layer]]").expect("text");
        match layer + 1 == layers && back == "half-space" {
            true => writeln!(text, "thickness = \"half-space\""),
            false => writeln!(text, "thickness = {:.4}", noise.between(0.3, 1.6)),
        }
        .expect("text");
        writeln!(text, "shear_wave_speed = {:.4}", noise.between(0.3, 0.6)).expect("text");
        if layer > 0 {
            writeln!(
                text,
                "density = {:.3}\nwave_speed = {:.3}",
                noise.between(0.3, 3.0),
                noise.between(0.8, 1.6)
            )
            .expect("text");
            if model == "elastic" && noise.below(3) == 0 {
                writeln!(text, "bond = \"sliding\"").expect("text");
            }
        }
    }
    let (head, velocity) = match noise.below(6) {
        0 => ("shape = \"flat\"\nradius = 1.0".to_owned(), 1.0),
        1 => ("shape = \"flat\"\nradius = 1.0\nedge_radius = 0.2".to_owned(), 0.02),
        2 => (format!("shape = \"paraboloid\"\nnose_radius = {:.3}", noise.between(1.0, 20.0)), 0.05),
        3 => ("shape = \"sphere\"\nnose_radius = 1.0".to_owned(), 0.02),
        4 => (format!("shape = \"cone\"\nslope = {:.3}", noise.between(0.03, 0.5)), 0.02),
        _ => (
            "shape = \"profile\"\npoints = [[0.0, 0.0], [0.4, 0.01], [0.8, 0.05], [1.0, 0.2]]".to_owned(),
            0.03,
        ),
    };
    writeln!(text, "[indenter]\n{head}").expect("text");
    let contact = noise.pick(&["unilateral", "unilateral", "unilateral", "bilateral", "prescribed"]);
    if noise.below(2) == 0 && contact != "prescribed" {
        writeln!(text, "mass = {:.3}", noise.between(0.1, 5.0)).expect("text");
    }
    let velocity = velocity * noise.between(0.3, 3.0);
    writeln!(text, "[impact]\nvelocity = {velocity:.4}\ncontact = \"{contact}\"").expect("text");
    // few cells for long, or many for a while
    let (cells, end_time) = match noise.below(8) {
        0 => (60 + noise.below(240), noise.between(0.2, 0.5)),
        _ => (5 + noise.below(20), noise.between(2.0, 12.0)),
    };
    writeln!(text, "[mesh]\ncells = {cells}").expect("text");
    if model == "rakhmatulin" {
        writeln!(text, "order = {}", noise.pick(&["2", "4", "4"])).expect("text");
    }
    if noise.below(4) == 0 {
        writeln!(text, "damping = 0.0").expect("text");
    }
    writeln!(text, "[run]\nend_time = {end_time:.3}").expect("text");
    text
}

/// What a run is recorded with: nothing, or a random choice of frames, points, lines and probes.
fn records(noise: &mut Noise) -> [String; 2] {
    let place = |noise: &mut Noise| [noise.between(0.0, 4.0), noise.between(0.0, 2.0)];
    let mut rich = "probes = [0.0, 0.33]\n".to_owned();
    let frames = noise.below(3) * noise.below(20);
    writeln!(rich, "frames = {frames}").expect("text");
    if noise.below(2) == 0 {
        let points: Vec<_> = (0..1 + noise.below(4)).map(|_| place(noise)).collect();
        writeln!(rich, "points = {points:?}").expect("text");
    }
    if noise.below(3) == 0 {
        let [r, z] = place(noise);
        writeln!(rich, "lines = [{{ {} }}]", [format!("r = {r}"), format!("z = {z}")][noise.below(2)])
            .expect("text");
    }
    ["frames = 0\nprobes = []\n".to_owned(), rich]
}

/// All steps of a run, with its warnings, and what is said of it as a whole, but for the probes.
type Seen = (Vec<View<'static>>, Validity);

fn views(case: &Case, engine: Engine) -> Seen {
    let mut views = Vec::new();
    let mut look = |view: &View<'_>| views.push(view.share());
    let mut steps = Advised::new(case, Simulation::with_engine(case, engine));
    let mut validity = session::run(&mut steps, &mut [&mut look]).expect("finite numbers").validity;
    validity.probes = Peak::default();
    (views, validity)
}

/// The first step at which two runs differ, if they do, and in what.
fn difference((a, of_a): &Seen, (b, of_b): &Seen) -> Option<String> {
    let numbers = |view: &View<'_>| {
        let indenter = [view.drag, view.velocity, view.depth, view.contact_radius];
        let all = indenter.into_iter().chain(view.interface.pressure.iter().copied());
        all.map(f64::to_bits).collect::<Vec<_>>()
    };
    // one warning is of the places that are recorded
    let events = |view: &View<'_>| -> Vec<Event> {
        view.events.iter().filter(|event| event.kind != EventKind::Warning("far")).cloned().collect()
    };
    let pair = a.iter().zip(b).find(|(a, b)| numbers(a) != numbers(b) || events(a) != events(b));
    let text = pair.map(|(a, b)| {
        let what = if events(a) == events(b) { "numbers" } else { "events" };
        format!(
            "{what} at step {}: drag {:e} {:e}, events {:?} {:?}",
            a.step, a.drag, b.drag, a.events, b.events
        )
    });
    text.or_else(|| (a.len() != b.len()).then(|| format!("{} and {} steps", a.len(), b.len())))
        .or_else(|| (of_a != of_b).then(|| format!("{of_a:?} {of_b:?}")))
}

/// Compares the runs of a random case; `None` if it is refused.
fn differences(seed: u64) -> Option<Vec<String>> {
    let noise = &mut Noise(seed);
    let text = text(noise);
    let cases = records(noise).map(|record| {
        let views = if noise.below(2) == 0 { "views = []\n" } else { "" };
        let text = format!("{text}[record]\n{record}{views}");
        Case::parse("random", &text, &[], Path::new("")).map_err(|errors| errors.to_string())
    });
    let [Ok(bare), Ok(rich)] = cases else { return None };
    let plain = views(&bare, Engine::Blocked);
    let mut others = vec![("recorded", views(&rich, Engine::Blocked))];
    if seed.is_multiple_of(16) {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        for threads in [1, 3] {
            others.push(("on other threads", pool(threads).install(|| views(&rich, Engine::Blocked))));
        }
    }
    if seed.is_multiple_of(8) && bare.sizes.nr * bare.sizes.nz * plain.0.len() < 20_000_000 {
        others.push(("by the plain stepper", views(&bare, Engine::Reference)));
    }
    let found = others.iter().filter_map(|(how, other)| Some((how, difference(&plain, other)?)));
    Some(found.map(|(how, what)| format!("seed {seed}, {how}: {what}\n{text}")).collect())
}

#[test]
fn nothing_depends_on_what_is_recorded() {
    let (wanted, compared) = (if is_full() { 5000 } else { 500 }, AtomicUsize::new(0));
    let differ: Vec<String> = (0..2 * wanted)
        .into_par_iter()
        .filter_map(|seed| {
            let found = differences(seed)?;
            compared.fetch_add(1, Ordering::Relaxed);
            Some(found)
        })
        .flatten_iter()
        .collect();
    let compared = compared.into_inner();
    assert!(compared as u64 >= wanted, "only {compared} cases are accepted");
    assert!(
        differ.is_empty(),
        "{} of {compared} cases: {}",
        differ.len(),
        differ[..differ.len().min(3)].join("\n")
    );
}
