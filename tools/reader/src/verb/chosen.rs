//! Arguments that choose fields, the same for every verb.

use clap::Args;
use percuss_table::units::LENGTH;

use crate::{
    field::{Positions, Selection},
    prefix::typed,
    select::Pattern,
};

/// Which fields of which topics.
#[derive(Clone, Debug, Args)]
pub struct Chosen {
    /// Topics, separated by commas; `*` stands for anything [default: /drag of percuss, else the first with
    /// numbers; plot --at-time: /interface/stress]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    pub(crate) topics: Vec<Pattern>,
    /// Fields, separated by commas: name, a.b.c, list[3].name, map[key], name@r=0.5, name@r=0,z=0.5 [default: all]
    #[arg(long = "field", value_name = "NAME")]
    fields: Vec<String>,
    /// Positions on the axis of arrays, r=0,0.5,0.9, or points of matrices, r=0,z=0.5, interpolated; may be repeated. One
    /// coordinate of a matrix is a line over the other. With or without a unit, r=0.1mm
    #[arg(long, value_name = "R=LIST")]
    at: Vec<Positions>,
}

/// The names in a list separated by commas; positions go on behind theirs: `a,b@r=0,z=0.5,c` is `a`, `b@r=0,z=0.5`, `c`.
fn split_fields(text: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for item in text.split(',') {
        let is_position = (item.contains('=') && !item.contains('@')) || typed(item, LENGTH).is_ok();
        match names.last_mut().filter(|last| is_position && last.contains('@')) {
            Some(last) => {
                last.push(',');
                last.push_str(item);
            }
            None => names.push(item.to_owned()),
        }
    }
    names
}

impl Chosen {
    /// Fields and positions.
    pub(crate) fn selection(&self) -> Selection {
        Selection {
            fields: self.fields.iter().flat_map(|text| split_fields(text)).collect(),
            at: self.at.clone(),
            for_curves: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_stay_with_their_field() {
        assert_eq!(split_fields("a,b.c[2]"), ["a", "b.c[2]"]);
        assert_eq!(split_fields("a@r=0,0.5,b@r=1,z=2,c"), ["a@r=0,0.5", "b@r=1,z=2", "c"]);
        assert_eq!(split_fields("a@r=0,0.5mm,b"), ["a@r=0,0.5mm", "b"]);
    }
}
