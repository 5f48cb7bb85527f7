//! Descriptor sets, looked through on the wire before they are handed to `prost-reflect`.
//!
//! What a set takes in memory has little to do with its length: two bytes are an empty message of a few hundred, and every
//! name is kept with all names it stands in. So the names, messages and comments of a set are counted first, and only a
//! copy with what the reader uses is parsed: without services, without options but the three that say how values stand
//! on the wire, without comments that belong to nothing. Sets that `prost-reflect` cannot be given (it panics, or does
//! not come back) are refused here: another syntax than proto2 and proto3, files that import each other publicly in
//! circles, maps that are none.

use std::collections::HashMap;

use prost_reflect::{DescriptorPool, Kind as FieldKind, MessageDescriptor};

use super::{Misfit, decode::Wire};

/// Deepest nesting of messages, as in other readers of protobuf.
const MAX_DEPTH: usize = 100;

/// Most messages, fields, enumerations and values of a set, and most imports: some lists are gone through once for each.
const MAX_ELEMENTS: usize = 1 << 16;

/// Most comments, times the elements that they are looked up for.
const MAX_LOOKUPS: usize = 1 << 30;

/// Most ways over which files import each other publicly.
const MAX_WAYS: usize = 1 << 14;

/// Most files, which bounds the length of such a way.
const MAX_FILES: usize = 1 << 11;

/// Longest name with all names it stands in, and longest name of a file \[bytes\].
const MAX_NAME: usize = 1 << 12;

/// Most parts of the name of a package.
const MAX_PARTS: usize = 64;

/// Memory of a text, besides its bytes, in all forms in which a set is kept \[bytes\].
const TEXT: usize = 160;

/// Forms in which the texts of a set are kept: as they are parsed, twice as they are resolved, and as they are handed out.
const COPIES: usize = 4;

/// Why a descriptor set is not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum SchemaError {
    /// It would take more memory than there is for it.
    #[error("it unpacks to more than the {room} bytes that are left for definitions (--max-memory)")]
    TooLarge {
        /// Memory that is left \[bytes\].
        room: usize,
    },
    /// It is not what it should be.
    #[error("{0}")]
    Unsound(String),
}

impl SchemaError {
    fn unsound(text: impl Into<String>) -> Self {
        Self::Unsound(text.into())
    }
}

impl From<Misfit> for SchemaError {
    fn from(_: Misfit) -> Self {
        Self::unsound("it is no descriptor set")
    }
}

/// The types of a descriptor set, and the memory they take \[bytes\].
///
/// * `room`: memory that they may take \[bytes\]
pub(crate) fn pool(bytes: &[u8], room: usize) -> Result<(DescriptorPool, usize), SchemaError> {
    let mut filter = Filter { room, left: room, elements: 0, comments: 0, files: Vec::new() };
    let mut clean = Vec::new();
    filter.message(&SET, bytes, Scope { name: 0, file: 0, depth: 0 }, &mut clean)?;
    if filter.comments.saturating_mul(filter.elements) > MAX_LOOKUPS {
        let (comments, elements) = (filter.comments, filter.elements);
        return Err(SchemaError::unsound(format!("{comments} comments on {elements} elements are too many")));
    }
    find_circles(&filter.files)?;
    let pool =
        DescriptorPool::decode(clean.as_slice()).map_err(|error| SchemaError::unsound(error.to_string()))?;
    let wrong = pool.all_messages().find(|message| message.is_map_entry() && !is_entry(message));
    match wrong {
        Some(message) => Err(SchemaError::unsound(format!("`{}` is no entry of a map", message.full_name()))),
        None => Ok((pool, room - filter.left)),
    }
}

/// True if a message can be an entry of a map.
fn is_entry(message: &MessageDescriptor) -> bool {
    let (Some(key), Some(value)) = (message.get_field(1), message.get_field(2)) else { return false };
    let is_key = !matches!(
        key.kind(),
        FieldKind::Double | FieldKind::Float | FieldKind::Bytes | FieldKind::Enum(_) | FieldKind::Message(_)
    );
    is_key && !key.is_list() && !key.is_map() && !value.is_list() && !value.is_map()
}

/// A message type of `descriptor.proto`, as far as the reader uses it.
struct Kind {
    /// Memory that one of it takes besides its texts \[bytes\]; 0 for what is no element.
    memory: usize,
    /// True if field 1 is its name, which stands in those of all that is in it.
    has_name: bool,
    fields: &'static [(u32, Part)],
}

/// What becomes of a field.
#[derive(Clone, Copy)]
enum Part {
    /// A number.
    Number,
    /// A text.
    Text,
    /// The name that stands in those of all that is in the message.
    Name,
    /// A message.
    Inner(&'static Kind),
    /// Options, of which one, a truth value, is kept.
    Options(u32),
    /// A name that is looked up.
    Import,
    /// A place in the source with its comments.
    Location,
}

use Part::{Import, Inner, Location, Name, Number, Options, Text};

const fn element(memory: usize, fields: &'static [(u32, Part)]) -> Kind {
    Kind { memory, has_name: true, fields }
}

static SET: Kind = Kind { memory: 0, has_name: false, fields: &[(1, Inner(&FILE))] };
static FILE: Kind = Kind {
    memory: 4096,
    has_name: false,
    fields: &[
        (1, Text),
        (2, Name),
        (3, Import),
        (4, Inner(&MESSAGE)),
        (5, Inner(&ENUMERATION)),
        (7, Inner(&FIELD)),
        (9, Inner(&SOURCE)),
        (10, Number),
        (12, Text),
    ],
};
static MESSAGE: Kind = element(
    3072,
    &[
        (1, Name),
        (2, Inner(&FIELD)),
        (3, Inner(&MESSAGE)),
        (4, Inner(&ENUMERATION)),
        (5, Inner(&RANGE)),
        (6, Inner(&FIELD)),
        (7, Options(7)),
        (8, Inner(&ONEOF)),
    ],
);
static FIELD: Kind = element(
    2048,
    &[
        (1, Name),
        (2, Text),
        (3, Number),
        (4, Number),
        (5, Number),
        (6, Text),
        (7, Text),
        (8, Options(2)),
        (9, Number),
        (10, Text),
        (17, Number),
    ],
);
static ENUMERATION: Kind = element(2048, &[(1, Name), (2, Inner(&VALUE)), (3, Options(2))]);
static VALUE: Kind = element(1024, &[(1, Name), (2, Number)]);
static ONEOF: Kind = element(1024, &[(1, Name)]);
static RANGE: Kind = Kind { memory: 512, has_name: false, fields: &[(1, Number), (2, Number)] };
static SOURCE: Kind = Kind { memory: 0, has_name: false, fields: &[(1, Location)] };

/// Where a message stands.
#[derive(Clone, Copy)]
struct Scope {
    /// Length of the names it is in.
    name: usize,
    /// Length of the name of its file.
    file: usize,
    depth: usize,
}

/// What a file says of itself.
#[derive(Default)]
struct File {
    name: String,
    imports: Vec<String>,
    /// Numbers of those imports that are handed on.
    public: Vec<usize>,
}

struct Filter {
    room: usize,
    left: usize,
    elements: usize,
    comments: usize,
    files: Vec<File>,
}

impl Filter {
    fn spend(&mut self, bytes: usize) -> Result<(), SchemaError> {
        self.left = self.left.checked_sub(bytes).ok_or(SchemaError::TooLarge { room: self.room })?;
        Ok(())
    }

    fn text(&mut self, bytes: usize) -> Result<(), SchemaError> {
        self.spend(TEXT + COPIES * bytes)
    }

    fn count(&mut self) -> Result<(), SchemaError> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(SchemaError::unsound(format!("it has more than {MAX_ELEMENTS} elements")));
        }
        Ok(())
    }

    /// Copies what is used of a message.
    fn message(
        &mut self,
        kind: &Kind,
        bytes: &[u8],
        scope: Scope,
        into: &mut Vec<u8>,
    ) -> Result<(), SchemaError> {
        if scope.depth > MAX_DEPTH {
            return Err(SchemaError::unsound(format!("its messages are nested deeper than {MAX_DEPTH}")));
        }
        let is_file = std::ptr::eq(kind, &FILE);
        let mut scope = Scope { depth: scope.depth + 1, ..scope };
        if is_file {
            scope = self.file(bytes, scope)?;
        }
        if kind.has_name {
            scope.name += 1 + last_text(bytes, 1)?.map_or(0, <[u8]>::len);
            if scope.name > MAX_NAME {
                return Err(SchemaError::unsound(format!("a name in it is longer than {MAX_NAME} bytes")));
            }
        }
        if kind.memory > 0 {
            self.count()?;
            // its whole name stands in several lists, the name of its file in what is told of it
            self.spend(kind.memory + COPIES * scope.name + 2 * scope.file)?;
        }
        let mut wire = Wire { bytes };
        while !wire.bytes.is_empty() {
            let start = wire.bytes;
            let (number, wire_type) = wire.key()?;
            let part = kind.fields.iter().find(|(known, _)| *known == number).map(|(_, part)| *part);
            let content = if wire_type == 2 { Some(wire.block()?) } else { None };
            if content.is_none() {
                wire.skip(number, wire_type, 0)?;
            }
            let whole = &start[..start.len() - wire.bytes.len()];
            match (part, content) {
                (None, _) => {}
                (Some(Number), None) => into.extend_from_slice(whole),
                (Some(Number), Some(packed)) => {
                    // numbers of imports, each of which may be one byte
                    self.spend(8 * packed.len())?;
                    into.extend_from_slice(whole);
                }
                (Some(Text | Name), Some(text)) => {
                    self.text(text.len())?;
                    into.extend_from_slice(whole);
                }
                (Some(Import), Some(text)) => {
                    self.count()?;
                    self.text(text.len())?;
                    into.extend_from_slice(whole);
                }
                (Some(Inner(inner)), Some(content)) => {
                    let mut copy = Vec::new();
                    self.message(inner, content, scope, &mut copy)?;
                    put_block(number, &copy, into);
                }
                (Some(Options(kept)), Some(content)) => {
                    if last_number(content, kept)?.is_some_and(|value| value != 0) {
                        put_block(number, &[(kept << 3) as u8, 1], into);
                    }
                }
                (Some(Location), Some(content)) => self.location(number, content, into)?,
                // no descriptor: the parser says so, and takes no memory for it
                (Some(_), None) => return Err(Misfit::Schema.into()),
            }
        }
        Ok(())
    }

    /// Takes note of a file.
    fn file(&mut self, bytes: &[u8], scope: Scope) -> Result<Scope, SchemaError> {
        let (mut file, mut syntax, mut package) = (File::default(), None, &[][..]);
        let mut wire = Wire { bytes };
        while !wire.bytes.is_empty() {
            let (number, wire_type) = wire.key()?;
            if wire_type != 2 {
                let before = wire.bytes;
                wire.skip(number, wire_type, 0)?;
                if (number, wire_type) == (10, 0) {
                    file.public.push(import_number(&mut Wire { bytes: before })?);
                }
                continue;
            }
            let content = wire.block()?;
            match number {
                1 => file.name = to_name(content)?,
                2 => package = content,
                3 => {
                    // charged once more where it is copied
                    self.text(content.len())?;
                    file.imports.push(to_name(content)?);
                }
                10 => {
                    let mut packed = Wire { bytes: content };
                    self.spend(8 * content.len())?;
                    while !packed.bytes.is_empty() {
                        file.public.push(import_number(&mut packed)?);
                    }
                }
                12 => syntax = Some(to_name(content)?),
                _ => {}
            }
        }
        match syntax.as_deref() {
            None | Some("proto2" | "proto3") => {}
            Some(other) => {
                let text = format!("its syntax is `{other}`; only proto2 and proto3 are known");
                return Err(SchemaError::unsound(text));
            }
        }
        let parts = package.iter().filter(|byte| **byte == b'.').count();
        if package.len() > MAX_NAME || parts > MAX_PARTS {
            return Err(SchemaError::unsound(format!(
                "the name of a package has more than {MAX_NAME} bytes or {MAX_PARTS} parts"
            )));
        }
        // every part of it is a name
        self.spend(COPIES * (parts + 1) * (TEXT + package.len()))?;
        let scope = Scope { name: package.len(), file: file.name.len(), ..scope };
        self.files.push(file);
        if self.files.len() > MAX_FILES {
            return Err(SchemaError::unsound(format!("it has more than {MAX_FILES} files")));
        }
        Ok(scope)
    }

    /// Copies a place in the source, if there is a comment before it.
    fn location(&mut self, number: u32, bytes: &[u8], into: &mut Vec<u8>) -> Result<(), SchemaError> {
        const PATH: u32 = 1;
        const COMMENT: u32 = 3;
        /// A place and its lists.
        const MEMORY: usize = 1024;
        let Some(comment) = last_text(bytes, COMMENT)? else { return Ok(()) };
        let Some(path) = last_text(bytes, PATH)? else { return Ok(()) };
        self.comments += 1;
        self.spend(MEMORY + 4 * COPIES * path.len())?;
        self.text(comment.len())?;
        let mut copy = Vec::new();
        put_block(PATH, path, &mut copy);
        put_block(COMMENT, comment, &mut copy);
        put_block(number, &copy, into);
        Ok(())
    }
}

fn import_number(wire: &mut Wire<'_>) -> Result<usize, SchemaError> {
    // a number that fits no import is told by the parser
    Ok(usize::try_from(wire.varint()?).unwrap_or(usize::MAX))
}

fn to_name(bytes: &[u8]) -> Result<String, SchemaError> {
    match std::str::from_utf8(bytes) {
        Ok(name) if name.len() <= MAX_NAME => Ok(name.to_owned()),
        Ok(_) => Err(SchemaError::unsound(format!("a name in it is longer than {MAX_NAME} bytes"))),
        Err(_) => Err(Misfit::Schema.into()),
    }
}

/// The last text with a field number.
fn last_text(bytes: &[u8], wanted: u32) -> Result<Option<&[u8]>, Misfit> {
    let (mut wire, mut last) = (Wire { bytes }, None);
    while !wire.bytes.is_empty() {
        let (number, wire_type) = wire.key()?;
        if wire_type == 2 {
            let block = wire.block()?;
            last = if number == wanted { Some(block) } else { last };
        } else {
            wire.skip(number, wire_type, 0)?;
        }
    }
    Ok(last)
}

/// The last number with a field number.
fn last_number(bytes: &[u8], wanted: u32) -> Result<Option<u64>, Misfit> {
    let (mut wire, mut last) = (Wire { bytes }, None);
    while !wire.bytes.is_empty() {
        let (number, wire_type) = wire.key()?;
        if (number, wire_type) == (wanted, 0) {
            last = Some(wire.varint()?);
        } else {
            wire.skip(number, wire_type, 0)?;
        }
    }
    Ok(last)
}

fn put_block(number: u32, content: &[u8], into: &mut Vec<u8>) {
    let mut put = |mut value: usize| {
        while value >= 0x80 {
            into.push(value as u8 | 0x80);
            value >>= 7;
        }
        into.push(value as u8);
    };
    put((number << 3 | 2) as usize);
    put(content.len());
    into.extend_from_slice(content);
}

/// Refuses files that import each other publicly in circles, or over so many ways that following them does not end.
fn find_circles(files: &[File]) -> Result<(), SchemaError> {
    let by_name: HashMap<&str, usize> =
        files.iter().enumerate().map(|(i, file)| (file.name.as_str(), i)).collect();
    let mut ways = vec![Ways::Unknown; files.len()];
    let total = (0..files.len()).try_fold(0_usize, |total, file| {
        let of_file = count_ways(file, files, &by_name, &mut ways)?;
        let imports = files[file].imports.len() + 1;
        Some(total.saturating_add(of_file.saturating_mul(imports)))
            .filter(|total| *total <= MAX_WAYS * MAX_PARTS)
    });
    total
        .map(drop)
        .ok_or_else(|| SchemaError::unsound("its files import each other publicly in circles or too often"))
}

#[derive(Clone, Copy)]
enum Ways {
    Unknown,
    Open,
    Known(usize),
}

/// Number of ways that public imports lead from a file; `None` if one leads back, or there are too many.
fn count_ways(
    file: usize,
    files: &[File],
    by_name: &HashMap<&str, usize>,
    ways: &mut [Ways],
) -> Option<usize> {
    match ways[file] {
        Ways::Known(count) => return Some(count),
        Ways::Open => return None,
        Ways::Unknown => ways[file] = Ways::Open,
    }
    let mut count = 1_usize;
    for &public in &files[file].public {
        let import = files[file].imports.get(public).and_then(|name| by_name.get(name.as_str()));
        if let Some(&import) = import {
            count = count.saturating_add(count_ways(import, files, by_name, ways)?);
        }
    }
    if count > MAX_WAYS {
        return None;
    }
    ways[file] = Ways::Known(count);
    Some(count)
}

#[cfg(test)]
mod tests;
