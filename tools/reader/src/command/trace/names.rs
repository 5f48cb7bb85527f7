//! Names of columns, each of which is there once.

use std::collections::HashSet;

/// Names that are given, as they stand in archives.
#[derive(Default)]
pub(super) struct Names(HashSet<String>);

impl Names {
    /// A name that is free: the wanted one, else that with its topic in front, else that with a number behind.
    pub(super) fn take(&mut self, topic: &str, name: &str) -> String {
        let with_topic = (!name.contains(['/', ':'])).then(|| format!("{topic}.{name}"));
        let numbered = (2..).map(|number| format!("{name}#{number}"));
        let mut names = [name.to_owned()].into_iter().chain(with_topic).chain(numbered);
        let is_free = |name: &String| self.0.insert(name.trim_start_matches('/').replace('/', "."));
        names.find(is_free).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_given_once() {
        let mut names = Names::default();
        let taken =
            ["time", "time", "time", "/p.time", "x", "/a/b.x", "/a.b.x"].map(|name| names.take("/p", name));
        assert_eq!(taken, ["time", "/p.time", "time#2", "/p.time#2", "x", "/a/b.x", "/a.b.x#2"]);
    }
}
