//! The table of errors in the guide: the tests allow the errors that it states.
//!
//! Its numbers stand nowhere else. A test reads those of its case and compares its measured errors with them, so neither
//! the table nor the program can change alone.

const DOCUMENTATION: &str = include_str!("../../tools/guide/src/theory.md");

/// Heading of the columns of the table.
const HEADING: &str = "| Case | Compared with | Error |";

/// Measured errors are those stated within this factor, either way: the table rounds to one or two digits, and a
/// pessimistic one is wrong too.
const FACTOR: f64 = 1.5;

/// Files that are searched for rows.
const TESTS: [&str; 7] = [
    include_str!("energy_and_momentum.rs"),
    include_str!("fig2_paraboloid.rs"),
    include_str!("fig4_half_space.rs"),
    include_str!("fig5_layer.rs"),
    include_str!("fig6_cones.rs"),
    include_str!("fig8_finite_mass.rs"),
    include_str!("plane_flat_punch.rs"),
];

/// First and last cell of every row: what is computed, and its error.
fn rows() -> Vec<(&'static str, &'static str)> {
    let body = DOCUMENTATION.lines().skip_while(|line| *line != HEADING).skip(2);
    let rows = body.map_while(|line| Some(line).filter(|row| row.starts_with('|')));
    let cells = |line: &'static str| -> Vec<_> { line.trim_matches('|').split('|').map(str::trim).collect() };
    rows.map(|line| match cells(line)[..] {
        [case, _, error] => (case, error),
        _ => panic!("three cells: {line}"),
    })
    .collect()
}

/// Numbers of a text in their order, percentages as fractions.
fn numbers(text: &str) -> Vec<f64> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |i: usize| {
        let value: f64 = words[i].trim_matches(['(', ')', ',', ';', ':']).parse().ok()?;
        let is_percentage = words.get(i + 1).is_some_and(|unit| unit.starts_with('%'));
        Some(if is_percentage { 0.01 * value } else { value })
    };
    (0..words.len()).filter_map(number).collect()
}

/// Numbers that the table states as errors of a case.
pub fn stated<const N: usize>(case: &str) -> [f64; N] {
    let (_, error) = *rows().iter().find(|row| row.0 == case).unwrap_or_else(|| panic!("no row `{case}`"));
    numbers(error).try_into().unwrap_or_else(|found| panic!("`{error}` has the numbers {found:?}"))
}

/// Compares a measured error with the stated one.
pub fn assert_stated(what: &str, measured: f64, stated: f64) {
    assert!(
        stated / FACTOR <= measured && measured <= stated * FACTOR,
        "{what}: the error is {measured:e}, the documentation states {stated:e}"
    );
}

/// Compares a rounding error, which may be smaller by chance, with the stated one.
pub fn assert_rounding(what: &str, measured: f64, stated: f64) {
    assert!(
        measured <= stated * FACTOR,
        "{what}: the error is {measured:e}, the documentation states {stated:e}"
    );
}

#[test]
fn every_row_is_asserted() {
    let rows = rows();
    assert!(rows.len() >= 10, "the table is there: {rows:?}");
    for (case, error) in rows {
        assert!(!numbers(error).is_empty(), "{case}: `{error}` is no number");
        assert!(TESTS.iter().any(|test| test.contains(&format!("\"{case}\""))), "`{case}` has no test");
    }
}

#[test]
fn numbers_are_found_in_words() {
    assert_eq!(numbers("1.7e-6, 6.9e-6, second order"), [1.7e-6, 6.9e-6]);
    assert_eq!(numbers("0.5 % rms (paper's mesh: 4 %), orders 1.6 to 2"), [0.005, 0.04, 1.6, 2.0]);
}
