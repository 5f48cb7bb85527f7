//! TOML files by dotted keys: `indenter.mass = 1.0`.

use std::collections::BTreeMap;

use toml::Value;

use crate::recording::Budget;

/// Largest file that is read \[bytes\].
const MAX_LENGTH: usize = 1 << 20;

/// Memory of a file while it is parsed, for each of its bytes \[bytes\].
const OF_BYTE: usize = 128;

/// Memory of a value, besides its text: its place in a list that grows, or in a tree with its key \[bytes\].
const VALUE: usize = 160;

/// The values of a file by their dotted keys; `None` if it is no TOML, too long, or takes more memory than there is for it.
pub(crate) fn entries(content: &[u8], budget: &mut Budget) -> Option<BTreeMap<String, Value>> {
    let text = std::str::from_utf8(content).ok().filter(|text| text.len() <= MAX_LENGTH)?;
    if text.len() * OF_BYTE > budget.left() {
        return None;
    }
    let mut flat = BTreeMap::new();
    flatten("", Value::Table(text.parse().ok()?), budget, &mut flat)?;
    Some(flat)
}

/// Memory of a value \[bytes\].
fn weight(value: &Value) -> usize {
    match value {
        Value::String(text) => VALUE + text.len(),
        Value::Array(list) => VALUE + list.iter().map(weight).sum::<usize>(),
        Value::Table(table) => {
            VALUE + table.iter().map(|(key, value)| VALUE + key.len() + weight(value)).sum::<usize>()
        }
        _ => VALUE,
    }
}

/// Adds the values of a table; `None` where there is no room for them: what is in a table has its name once more each.
fn flatten(
    prefix: &str,
    value: Value,
    budget: &mut Budget,
    into: &mut BTreeMap<String, Value>,
) -> Option<()> {
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                let path = if prefix.is_empty() { key } else { format!("{prefix}.{key}") };
                flatten(&path, value, budget, into)?;
            }
        }
        other if budget.spend(weight(&other) + prefix.len()) => drop(into.insert(prefix.into(), other)),
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_keys_are_charged_with_every_value() {
        let content = format!("[{}]\na = 1\nb = 2\n", "k".repeat(4000));
        assert!(entries(content.as_bytes(), &mut Budget::new(1 << 20)).is_some());
        let many: String = (0..1000).map(|i| format!("k{i} = 1\n")).collect();
        assert!(entries((content + &many).as_bytes(), &mut Budget::new(2 << 20)).is_none());
    }

    #[test]
    fn keys_are_dotted() {
        let mut budget = Budget::new(1 << 20);
        let flat = entries(b"a = 1\n[b]\nc = inf\nd = [1, 2]\n", &mut budget).expect("TOML");
        let keys: Vec<&str> = flat.keys().map(String::as_str).collect();
        assert_eq!(keys, ["a", "b.c", "b.d"]);
        assert_eq!(flat["b.d"].to_string(), "[1, 2]");
        assert!(entries(b"a = ", &mut budget).is_none());
    }
}
