//! What could not be compared is never equal: parts of recordings against each other, with every way of comparing, in both
//! directions.

use percuss_reader::{
    compare::{Comparison, Mode, Options, Rules, compare},
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

fn comparison(desk: &Desk, names: [&str; 2], options: &Options) -> Comparison {
    let open = |name: &str| Recording::open(&desk.path(name), Limits::default()).expect("a recording");
    compare(&open(names[0]), &open(names[1]), options, None).expect("a comparison")
}

#[test]
fn parts_are_equal_only_to_themselves() {
    let all = 0..WHOLE;
    let parts: Vec<Vec<usize>> = vec![
        all.clone().collect(),
        vec![0],
        vec![WHOLE - 1],
        vec![0, WHOLE - 1],
        vec![11],
        all.clone().step_by(2).collect(),
        all.clone().skip(1).step_by(2).collect(),
        all.clone().step_by(3).collect(),
        (0..12).collect(),
        (12..WHOLE).collect(),
        (6..18).collect(),
        all.clone().filter(|&i| i != 7).collect(),
        (0..WHOLE - 1).collect(),
        (1..WHOLE).collect(),
    ];
    let names: Vec<String> = (0..parts.len()).map(|i| format!("{i}.mcap")).collect();
    let files: Vec<(&str, Vec<u8>)> =
        names.iter().map(String::as_str).zip(parts.iter().map(|part| self::part(part))).collect();
    let desk = Desk::new(&files);
    let modes = [
        None,
        Some(Mode::Step),
        Some(Mode::Time),
        Some(Mode::Nearest),
        Some(Mode::Linear),
        Some(Mode::Cubic),
    ];
    let tolerances: [&[&str]; 6] =
        [&[], &["rel=1e-6"], &["abs=1e-6"], &["peak_rel=1e-6"], &["l2_rel=1e-6"], &["abs=10"]];
    let mut cases = 0;
    for (i, a) in parts.iter().enumerate() {
        for (j, b) in parts.iter().enumerate() {
            for (mode, rules) in
                modes.iter().flat_map(|mode| tolerances.iter().map(move |rules| (*mode, *rules)))
            {
                for common in [false, true] {
                    cases += 1;
                    let list = rules.iter().map(|rule| rule.parse().expect("a rule")).collect();
                    let options =
                        Options { mode, common, rules: Rules { rules: list }, ..Options::default() };
                    let found = comparison(&desk, [&names[i], &names[j]], &options);
                    let case = format!("{a:?}, {b:?}, {mode:?}, {rules:?}, {common}");
                    let channel = &found.channels[0];
                    assert_eq!(channel.messages, [a.len() as u64, b.len() as u64], "{case}");
                    // every message of the reference is compared or counted
                    assert_eq!(channel.compared + channel.only_a, a.len() as u64, "{case}");
                    if i == j {
                        assert!(found.is_equal(), "{case}");
                        continue;
                    }
                    assert!(!found.is_equal(), "{case}");
                    if common {
                        assert!(!found.is_within() || channel.compared > 0, "{case}");
                        continue;
                    }
                    assert!(!found.is_within() || channel.only_a + channel.only_b == 0, "{case}");
                    let ends = |part: &[usize]| (part[0], part[part.len() - 1]);
                    let is_inside = ends(a).0 >= ends(b).0 && ends(a).1 <= ends(b).1;
                    // interpolated where that is asked for or allowed by 10: all of the reference has to lie in the new one;
                    // without any time in common, times count from the start of each, which is reported
                    let is_apart = ends(a).1 < ends(b).0 || ends(b).1 < ends(a).0;
                    let is_chosen = mode.is_none() && rules == ["abs=10"];
                    let between = mode.is_some_and(Mode::is_between) || is_chosen;
                    if is_chosen && is_apart {
                        assert!(channel.alignment.starts.is_some(), "{case}");
                        continue;
                    }
                    assert!(!found.is_within() || (between && is_inside), "{case}");
                }
            }
        }
    }
    assert_eq!(cases, parts.len() * parts.len() * modes.len() * tolerances.len() * 2);
}
