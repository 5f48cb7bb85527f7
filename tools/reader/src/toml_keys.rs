//! TOML files by dotted keys: `indenter.mass = 1.0`.

use std::collections::BTreeMap;

use toml::Value;

/// Largest file that is read \[bytes\].
const MAX_LENGTH: usize = 1 << 20;

/// The values of a file by their dotted keys; `None` if it is no TOML or too long.
pub(crate) fn entries(content: &[u8]) -> Option<BTreeMap<String, Value>> {
    let text = std::str::from_utf8(content).ok().filter(|text| text.len() <= MAX_LENGTH)?;
    let mut flat = BTreeMap::new();
    flatten("", Value::Table(text.parse().ok()?), &mut flat);
    Some(flat)
}

fn flatten(prefix: &str, value: Value, into: &mut BTreeMap<String, Value>) {
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                let path = if prefix.is_empty() { key } else { format!("{prefix}.{key}") };
                flatten(&path, value, into);
            }
        }
        other => drop(into.insert(prefix.into(), other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_dotted() {
        let flat = entries(b"a = 1\n[b]\nc = inf\nd = [1, 2]\n").expect("TOML");
        let keys: Vec<&str> = flat.keys().map(String::as_str).collect();
        assert_eq!(keys, ["a", "b.c", "b.d"]);
        assert_eq!(flat["b.d"].to_string(), "[1, 2]");
        assert!(entries(b"a = ").is_none());
    }
}
