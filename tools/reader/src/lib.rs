//! Reads MCAP recordings whose messages are protobuf: what is in them, and any field against time.
//!
//! The reader knows nothing of the program that wrote a recording. It decodes messages through the descriptors that
//! are embedded in the file, and takes units and axes from the metadata of the channels, so it reads recordings of
//! any version of percuss and any other protobuf MCAP file.
//!
//! ```text
//! file -> recording::Scan -> overview::Overview                         -> command::info
//!                         -> field::Column (what to take of a message)  -> table::Sink -> command::trace
//! ```
//!
//! | Module | Owns |
//! |---|---|
//! | [`recording`] | opening a file, limits, checksums, records in the order of the file |
//! | [`overview`] | what a recording holds: channels, counts, times, metadata, attachments |
//! | [`field`], `axis` | fields of messages: names, units; positions on the axes of arrays and values between them |
//! | [`table`] | named columns with units, and what takes their rows |
//! | [`mod@format`] | one file per output format |
//! | [`command`] | one file per verb |
//! | [`cli`] | arguments, errors, exit status |
//!
//! Every checksum of a file is verified (chunks before anything in them is used), and no record larger than a stated
//! limit is taken into memory. A file that ends early or is damaged is read up to there, and that is said.
//!
//! # Channel metadata
//!
//! | Key | Meaning |
//! |---|---|
//! | `unit.<field>` | unit, `1` for plain numbers |
//! | `meaning.<field>` | the field in words |
//! | `axis.<field>` | positions of an array: `r0,dr` names two fields of the message, the first position and the step; a list of numbers is the positions; `z0,dz,nz;r0,dr,nr` is a row-major matrix |
//! | `symmetry.<field>` | `even`: the array is even about the origin of its axis |

mod axis;
pub mod cli;
pub mod command;
pub mod compare;
pub mod field;
pub mod format;
pub mod messages;
pub mod overview;
pub mod plot;
pub mod recording;
pub mod select;
pub mod slice;
pub mod table;
pub mod wire;
