//! Fields that say when, or to what, the others belong: not what is measured.

use prost_reflect::Kind;

use super::layout::Layout;

/// Messages whose fields are a time together.
const TIMES: [&str; 2] = ["google.protobuf.Timestamp", "google.protobuf.Duration"];

impl Layout {
    /// True for what is in a `header`, a `stamp` or a `timestamp`, or in a message or object that is a time: of type
    /// `google.protobuf.Timestamp` or `Duration`, or with seconds in `sec` beside `nsec` or `nanosec`.
    pub fn says_when(&self, leaf: usize) -> bool {
        let path = &self.leaves[leaf].path;
        let (parents, name) = path.rsplit_once('.').unwrap_or(("", path));
        let beside = |name: &str| self.find(&format!("{parents}.{name}")).is_some();
        let is_time = !parents.is_empty() && beside("sec") && (beside("nsec") || beside("nanosec"));
        path.starts_with("header.")
            || path.split('.').any(|part| matches!(part, "stamp" | "timestamp"))
            || (is_time && matches!(name, "sec" | "nsec" | "nanosec"))
            || self.is_inside(leaf, &TIMES)
    }

    /// True if a leaf is in a message of one of some types.
    fn is_inside(&self, leaf: usize, types: &[&str]) -> bool {
        let mut message = self.descriptor().clone();
        for &number in &self.leaves[leaf].numbers {
            match message.get_field(number).map(|field| field.kind()) {
                Some(Kind::Message(inner)) if types.contains(&inner.full_name()) => return true,
                Some(Kind::Message(inner)) => message = inner,
                _ => return false,
            }
        }
        false
    }
}
