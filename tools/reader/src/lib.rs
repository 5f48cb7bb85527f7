//! Reads MCAP recordings whose messages are protobuf or JSON: tables, pictures and comparisons of what is in them.
//!
//! The reader knows nothing of the solver. It decodes messages through the descriptors that are embedded in the file,
//! and takes units and axes from the metadata of the channels, so it reads recordings of any version of percuss and any
//! other MCAP file with protobuf or JSON messages. What it knows of percuss's conventions (names of metadata, topics, fields and attachments)
//! stands in one file, [`convention`], and nowhere else.
//!
//! ```text
//! file -> recording::Scan -> messages::Recording, Messages -> wire::Layout, Values -+-> field::Column -> percuss_table::Sink
//!                                                                                   +-> slice::{Profile, Slice} -> percuss_picture
//!                                                                                   +-> compare
//! ```
//!
//! | Module | Owns |
//! |---|---|
//! | [`recording`] | opening a file, limits, checksums, the index, records in the order of the file, skipping damage |
//! | [`messages`] | a recording that is open: its channels, and the messages of some of them, by the index if there is one |
//! | [`pass`] | one reading of a recording for all who look at its messages: each chunk read once, each message decoded once |
//! | `instant` | when a message is: by its own time or by its log time, to the nanosecond |
//! | [`channel`], [`directory`] | what a channel is, and how the definitions of a file become channels |
//! | [`convention`] | what the reader knows of percuss |
//! | [`wire`] | messages decoded into typed lists, one per leaf of their type |
//! | [`field`], `axis`, `path` | fields of messages as columns; positions on the axes of arrays and values between them; elements of nested lists |
//! | [`extent`] | how far arrays reach over all messages |
//! | [`select`] | patterns of topics and windows of times, the same for every verb |
//! | [`mod@slice`] | arrays over their axis and matrices, at one time |
//! | [`prefix`] | engineering prefixes of SI units, and tables in prefixed units |
//! | [`units`] | units in which quantities are shown, chosen or with the prefix that fits |
//! | [`scales`] | numbers of one recording in the units of another |
//! | `toml_keys` | TOML files by dotted keys |
//! | `percuss-table` | named columns with units, what takes their rows as CSV and Parquet, measures of an impact: a crate of its own |
//! | [`mod@format`] | what takes rows and fields in other formats, one file each |
//! | [`tabular`] | tables that were written, read back: columns by their names |
//! | [`measured`] | tables as recordings, beside those whose fields they have |
//! | [`timeline`] | messages by their log time, from any time on |
//! | `percuss-serve` | messages to viewers over the Foxglove WebSocket protocol, a crate of its own |
//! | [`compare`] | two recordings number by number: structure, alignment, tolerances, measures. Pure: no output |
//! | `percuss-canvas` | the painter of sections, for films, plots and pages, a crate of its own |
//! | `percuss-picture` | curves and images as SVG, PNG or text, a crate of its own |
//! | [`failure`] | why something could not be done, and the exit status that says so |
//! | [`verb`] | what all verbs share: how they are run and end, where their output goes, formats of tables |
//! | [`command`] | the verbs, one file each: arguments and work |
//! | [`cli`] | the command line: which verbs there are |
//!
//! There are no circles among modules: `tests/house.rs` of percuss reads what each file uses.
//!
//! # Damage and limits
//!
//! Every checksum of what is read is verified, chunks before anything in them is used. A damaged part is skipped and
//! reported, and makes the exit status 3. Where the index at the end of a file is sound, only chunks that hold what is asked
//! for are read; `verify` and `info` always read everything. `--max-memory` caps what a file can make the reader take,
//! with the shares of [`recording::Limits`]: what is kept is charged before it is allocated, with what it takes in memory,
//! not in the file. What is beyond the limit is refused and reported: a record or chunk like a damaged one, a schema
//! as an unknown one, a message as one that does not fit its schema (status 3; `verify`: not sound); a table, a picture
//! or a comparison for which too much would have to wait is not made (status 1; `diff`: 2). The limit is per file.
//!
//! A recording is a regular file: folders, pipes, sockets and devices are refused before they are opened. Errors of the system
//! name the file, the place in it and the cause. A name that ends in `.part` is that of a recording that is still being written,
//! or was interrupted: it is read like any file without an end, which is said once. A file that grows while it is read is
//! read as far as it was at first; one that becomes shorter is an error. `replay` reports what is lost as it comes up, and ends at once where nothing
//! can be played.
//!
//! Lengths inside a record are checked before it is parsed. Descriptor sets are filtered before they are parsed: those
//! of another syntax than proto2 and proto3, with public imports in circles, or with more than 65 536 elements are not
//! sound. A type inside itself, nested deeper than 32, or beyond 10 000 fields is kept as bytes. Names from a file are shown with
//! what could command a terminal, or the machine that runs a job, made visible ([`percuss_output::text`]).
//!
//! Memory does not depend on the length of a recording, with three exceptions, all within `--max-memory`: NumPy files begin with
//! their lengths, so their columns, or the arrays of a topic over time, are kept; Parquet files end with a place for every column of every group of
//! rows; pictures keep the points of their curves. What is beyond the limit is refused. So is a table to be read back, of which the columns that are
//! asked for are kept beside the file.
//!
//! # Recordings of other programs
//!
//! Defaults for files of other programs, the same for every verb:
//!
//! - **Topic.** Without `--topic`, `trace` and `plot` show the drag of a percuss recording, else the first topic in the order
//!   of the file whose messages hold floating-point numbers, else other numbers, beside those that only say when; else the first that is
//!   decoded.
//! - **Time.** Messages without a field `time` are timed by their log time. Where log times are dates, the first being
//!   later than 1970, times count in seconds from the first message of the recording: in the column `time`, in `--from`, `--to`
//!   and `--at-time`, and in pictures. `--epoch` counts from 1970; `trace --time iso` and `--time ns` write dates of ISO 8601 and whole
//!   nanoseconds. Of several files each counts from its own start, unless dates are written. `diff` and `replay`
//!   select by log time.
//! - **Stamps.** What is in a `header`, a `stamp`, a `timestamp`, a `google.protobuf.Timestamp` or `Duration`, or in seconds
//!   `sec` beside `nsec` or `nanosec`, is not drawn unless it is named. `trace` shows it.
//! - **Maps.** `gains[kd]` is the value of a map at a key: a text, a whole number, `true` or `false`. A map without a key is a
//!   column for every key in any message, up to 1000. `gains[0].key` and `gains[0].value` are the entries by number, in
//!   the order of their bytes.
//! - **Names of numbers.** Tables hold the names, and the number where it has none; curves are drawn of the numbers.
//! - **JSON.** The type of every field is taken from the JSON schema of the channel (`type`, `properties`, `items`,
//!   `prefixItems`, `allOf`, a single alternative to `null`, `$ref` inside the schema). Where it leaves any open, or there is none, the first 100
//!   messages of the channel say what is there. Numbers are double-precision, or whole where the schema says
//!   `integer` or where they are beyond 2⁵³; texts, also in base64, are texts; objects and arrays are fields and lists like those of
//!   protobuf, arrays inside arrays one after the other; `null` is nothing, NaN in an array of numbers. A field
//!   that is of several types, or nested deeper than 30, is a text, that of JSON where it is none. Fields that come up later are kept as
//!   bytes. In the names of fields `.`, `[`, `]`, `@`, `,` and `;` are written `_`. A message that is no JSON (NaN without quotes is
//!   none), has a field twice, is nested deeper than 127, or has another type than its field, does not fit its schema. The field `time`
//!   of JSON messages is a field like others.
//! - **Images.** `export --topic` writes messages with the fields of `foxglove.CompressedImage` as they are.
//!
//! # Channel metadata
//!
//! | Key | Meaning |
//! |---|---|
//! | `unit.<field>` | unit, `1` for plain numbers |
//! | `meaning.<field>` | the field in words |
//! | `axis.<field>` | positions of an array: `r0,dr` names two fields of the message, the first position and the step; a list of numbers is the positions; `z0,dz,nz;r0,dr,nr` is a row-major matrix: rows and columns that a message leaves out and others have are at rest there, 0. One more name, `s0,ds,s` or `z0,dz,nz,z;…`, is that of a list of doubles: where a message has any, they are the positions instead |
//! | `derived` | the channel shows in another form what others hold; `diff` leaves it out unless it is named, or one recording has it without this key |
//! | `symmetry.<field>` | `even`: the array is even about the origin of its axis |
//!
//! # Layers
//!
//! Rows at listed depths need not be evenly apart. None is less than the one before it, and the depth of an interface between layers
//! stands twice: its first row is the last of the layer above, its second the first of the layer below. What jumps there
//! stays a jump: pictures end cells at the interface, nothing is averaged or interpolated across it, and `diff` compares each side with the
//! same side. A position on the interface, as in `--at r=0,z=0.5`, is its upper side. The table of a line over depths, `--at r=0`, has one
//! column for it; curves and exported fields have both sides, a `.vtr` as a layer of cells without height. The names of layers, and
//! where they begin and end, are in the metadata record `percuss.run`.
//!
//! # How a comparison goes
//!
#![doc = include_str!("compare/rules.md")]
//!
//! Channels are paired by topic and message type, fields by name, then by number. Messages are paired by step if equal steps are at
//! equal times, else by exact time if more than half of them have a partner, else, with a tolerance, between times; the
//! first 16 messages of a channel decide, `--align` does so for good. Two messages at one time are a jump: nothing is interpolated
//! across it, and each is paired with that of its number. Elements of arrays without a place (NaN, or more than the axis lists) are
//! compared by their number. Values are checked against the first rule that fits `topic.field`, see [`compare::Tolerance`].

use percuss_output::text;

mod axis;
pub mod channel;
pub mod cli;
pub mod command;
pub mod compare;
pub mod convention;
pub mod directory;
mod extent;
pub mod failure;
mod field;
mod format;
mod instant;
pub mod measured;
pub mod messages;
pub mod pass;
mod path;
pub mod prefix;
pub mod recording;
pub mod scales;
pub mod select;
pub mod slice;
pub mod tabular;
pub mod timeline;
mod toml_keys;
pub mod units;
pub mod verb;
pub mod wire;
