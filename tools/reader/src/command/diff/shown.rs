//! A comparison as it may be shown: names and values of the files without commands for the terminal.

use std::path::{Path, PathBuf};

use crate::{
    compare::{Comparison, Difference, Divergence, Location},
    text::printable,
};

/// A comparison with every text that is from a file on one line, and what commands a terminal escaped.
pub(super) struct Shown {
    /// Name of the reference.
    pub(super) a: String,
    /// Name of the new recording.
    pub(super) b: String,
    pub(super) comparison: Comparison,
}

impl Shown {
    pub(super) fn of(a: &Path, b: &Path, comparison: &Comparison) -> Self {
        let [a, b] = [a, b].map(|path| printable(&path.to_string_lossy()).into_owned());
        Self { a, b, comparison: escaped(comparison.clone()) }
    }
}

fn escaped(mut comparison: Comparison) -> Comparison {
    for (path, damage) in &mut comparison.damages {
        escape_path(path);
        escape(&mut damage.reason);
    }
    comparison.partial.iter_mut().for_each(escape_path);
    for finding in &mut comparison.structure {
        escape(&mut finding.topic);
        finding.field.as_mut().map(escape);
        match &mut finding.difference {
            Difference::Missing | Difference::Extra | Difference::Number(..) => {}
            Difference::Renamed(name) => escape(name),
            Difference::Type(a, b) | Difference::Metadata { a, b, .. } => [a, b].into_iter().for_each(escape),
        }
    }
    for change in &mut comparison.provenance {
        escape(&mut change.place);
        escape(&mut change.key);
        [&mut change.a, &mut change.b].into_iter().flatten().for_each(escape);
    }
    comparison.derived = comparison.derived.iter().map(|topic| printable(topic).into_owned()).collect();
    comparison.residuals = comparison.residuals.iter().map(|name| printable(name).into_owned()).collect();
    for channel in &mut comparison.channels {
        escape(&mut channel.topic);
        if let Some((place, _)) = &mut channel.first_unmatched {
            escape_place(place);
        }
        for field in &mut channel.fields {
            escape(&mut field.leaf.path);
            field.unit.as_mut().map(escape);
            if let Some((_, place)) = &mut field.measure.max {
                escape_place(place);
            }
            for divergence in
                [&mut field.measure.first, &mut field.measure.first_beyond].into_iter().flatten()
            {
                let Divergence { place, a, b } = divergence;
                escape_place(place);
                [a, b].into_iter().for_each(escape);
            }
        }
    }
    comparison
}

fn escape(text: &mut String) {
    *text = printable(text).into_owned();
}

fn escape_path(path: &mut PathBuf) {
    *path = printable(&path.to_string_lossy()).into_owned().into();
}

fn escape_place(place: &mut Location) {
    place.position.as_mut().map(escape);
}
