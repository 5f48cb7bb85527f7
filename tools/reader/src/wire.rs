//! Messages decoded into leaves: every number, text or byte string a message type can hold, by its path.
//!
//! A message type becomes a [`Layout`] once; a message then becomes [`Values`], one typed list per leaf. Arrays of
//! numbers are copied straight from the wire, which is what makes reading whole recordings cheap: the general dynamic
//! messages of `prost-reflect` take some fifty bytes and an allocation per number.
//!
//! ```text
//! message M { double time = 1; repeated double p = 2; Vec v = 3; repeated Item items = 4; }
//! leaves: time, p, v.x, v.y, items.[#] (how many), items.name, …
//! ```
//!
//! Missing proto3 scalars read as the default of their type.
//! A type inside itself is not unfolded again but kept as bytes, so the number of leaves is finite; fields that the
//! schema does not know are kept as bytes in the leaf [`UNKNOWN`]. Nothing that a message holds is lost. JSON messages have
//! leaves of the same kinds.

mod cursor;
mod decode;
mod dynamic;
pub(crate) mod json;
mod layout;
mod leaf;
mod list;
pub(crate) mod schema;
mod seen;

pub(crate) use dynamic::dynamic;
pub use layout::Layout;
pub(crate) use layout::Slot;
pub use leaf::{COUNT, DecodeError, Leaf, Type, UNKNOWN};
pub use list::{Key, List, Values};
