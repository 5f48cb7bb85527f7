//! A tolerance file: read, and asked for fields.

#![no_main]

use libfuzzer_sys::fuzz_target;
use percuss_reader::compare::Rules;

fuzz_target!(|text: &str| {
    let mut rules = Rules::default();
    if rules.add_file("tolerances.toml", text).is_err() {
        return;
    }
    for (topic, field) in [("/drag", "force"), ("/interface/stress", "stress"), ("", "")] {
        rules.ignores(topic, Some(field));
        if let Some(rule) = rules.of(topic, field) {
            drop(rule.tolerance.to_string());
        }
    }
});
