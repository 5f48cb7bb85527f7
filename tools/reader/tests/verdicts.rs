//! What could not be compared is never equal: parts of recordings against each other, with every way of comparing, in both
//! directions.

use percuss_reader::{
    compare::{Mode, Options, Rules, Verdict, compare},
    messages::Recording,
    recording::Limits,
};

use crate::{
    desk::Desk,
    raw::{Foreign, foreign, types},
};

/// Messages of the whole recording.
const WHOLE: usize = 24;

/// Message `i` of the whole recording, every 0.1 s: a curve that no line follows.
fn part(chosen: &[usize]) -> Vec<u8> {
    let message = |&i: &usize| {
        let time = i as f64 * 0.1;
        let content = format!("{{\"time\":{time:?},\"x\":{:?}}}", (3.0 * time).sin() + 2.0);
        (i as u64 * 100_000_000, content.into_bytes())
    };
    let mut curve = Foreign::new("/curve", "json", &types(""), &[]);
    curve.messages = chosen.iter().map(message).collect();
    foreign(&[curve], None)
}

#[test]
fn parts_are_equal_only_to_themselves() {
    let parts: [Vec<usize>; 14] = [
        (0..WHOLE).collect(),
        vec![0],
        vec![WHOLE - 1],
        vec![0, WHOLE - 1],
        vec![11],
        (0..WHOLE).step_by(2).collect(),
        (1..WHOLE).step_by(2).collect(),
        (0..WHOLE).step_by(3).collect(),
        (0..12).collect(),
        (12..WHOLE).collect(),
        (6..18).collect(),
        (0..WHOLE).filter(|&i| i != 7).collect(),
        (0..WHOLE - 1).collect(),
        (1..WHOLE).collect(),
    ];
    let modes = [Mode::Step, Mode::Time, Mode::Nearest, Mode::Linear, Mode::Cubic].map(Some);
    let modes: Vec<Option<Mode>> = modes.into_iter().chain([None]).collect();
    let rules = ["rel=1e-6", "abs=1e-6", "peak_rel=1e-6", "l2_rel=1e-6", "abs=10"].map(Some);
    let desk = Desk::new(&[]);
    let recordings: Vec<Recording> = (0..parts.len())
        .map(|i| {
            desk.put(&i.to_string(), part(&parts[i]));
            Recording::open(&desk.path(&i.to_string()), Limits::default()).expect("a recording")
        })
        .collect();
    let ways = modes.iter().flat_map(|mode| rules.iter().chain([&None]).map(move |rule| (*mode, *rule)));
    let ways: Vec<_> = ways.flat_map(|way| [(way, false), (way, true)]).collect();
    let pairs = (0..parts.len()).flat_map(|i| (0..parts.len()).map(move |j| (i, j)));
    for ((i, j), ((mode, rule), common)) in pairs.flat_map(|pair| ways.iter().map(move |way| (pair, *way))) {
        let (a, b) = (&parts[i], &parts[j]);
        let rules = Rules { rules: rule.into_iter().map(|rule| rule.parse().expect("a rule")).collect() };
        let options = Options { mode, common, rules, ..Options::default() };
        let found = compare(&recordings[i], &recordings[j], &options, None).expect("a comparison");
        let (is_within, channel) = (!found.verdict().has_failed(), &found.channels[0]);
        let case = format!("{a:?}, {b:?}, {mode:?}, {rule:?}, {common}");
        assert_eq!(channel.messages, [a.len() as u64, b.len() as u64], "{case}");
        // every message of the reference is compared or counted
        assert_eq!(channel.compared + channel.only[0], a.len() as u64, "{case}");
        assert_eq!(found.verdict() == Verdict::Equal, i == j, "{case}");
        if common {
            assert!(!is_within || channel.compared > 0, "{case}");
        }
        if common || i == j {
            continue;
        }
        assert!(!is_within || channel.only == [0; 2], "{case}");
        let [ends_a, ends_b] = [a, b].map(|part| (part[0], part[part.len() - 1]));
        let is_inside = ends_a.0 >= ends_b.0 && ends_a.1 <= ends_b.1;
        // interpolated where that is asked for or allowed by 10: all of the reference has to lie in the new one;
        // without any time in common, times count from the start of each, which is reported
        let is_apart = ends_a.1 < ends_b.0 || ends_b.1 < ends_a.0;
        let is_chosen = mode.is_none() && rule == Some("abs=10");
        let between = mode.is_some_and(Mode::is_between) || is_chosen;
        match is_chosen && is_apart {
            true => assert!(channel.starts.is_some(), "{case}"),
            false => assert!(!is_within || (between && is_inside), "{case}"),
        }
    }
}
