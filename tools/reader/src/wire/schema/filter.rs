//! Copies what the reader uses of a descriptor set, counting what it takes in memory.

use prost_reflect::prost::encode_length_delimiter;

use super::SchemaError;
use crate::wire::{cursor::Wire, leaf::DecodeError};

/// Deepest nesting of messages, as in other readers of protobuf.
const MAX_DEPTH: usize = 100;

/// Most messages, fields, enumerations and values of a set, and most imports: some lists are searched once for each.
const MAX_ELEMENTS: usize = 1 << 16;

/// Longest name with all names it stands in, and longest name of a file \[bytes\].
const MAX_NAME: usize = 1 << 12;

/// Most parts of the name of a package.
const MAX_PARTS: usize = 64;

/// Memory of a text, besides its bytes, in all forms in which a set is kept \[bytes\].
const TEXT: usize = 160;

/// Forms in which the texts of a set are kept: as they are parsed, twice as they are resolved, and as they are handed out.
const COPIES: usize = 4;

/// A message type of `descriptor.proto`, as far as the reader uses it.
struct Element {
    /// Memory that one of it takes besides its texts \[bytes\]; 0 for what is no element.
    memory: usize,
    /// True if field 1 is its name, which stands in those of all that is in it.
    has_name: bool,
    fields: &'static [(u32, Part)],
}

/// What becomes of a field.
#[derive(Clone, Copy)]
enum Part {
    Number,
    Text,
    Inner(&'static Element),
    /// Options, of which one, a truth value, is kept.
    Options(u32),
    /// A name that is looked up.
    Import,
    /// A span of the source with its comments.
    Location,
}

use Part::{Import, Inner, Location, Number, Options, Text};

const fn element(memory: usize, fields: &'static [(u32, Part)]) -> Element {
    Element { memory, has_name: true, fields }
}

static SET: Element = Element { memory: 0, has_name: false, fields: &[(1, Inner(&FILE))] };
static FILE: Element = Element {
    memory: 4096,
    has_name: false,
    fields: &[
        (1, Text),
        (2, Text),
        (3, Import),
        (4, Inner(&MESSAGE)),
        (5, Inner(&ENUMERATION)),
        (7, Inner(&FIELD)),
        (9, Inner(&SOURCE)),
        (10, Number),
        (12, Text),
    ],
};
static MESSAGE: Element = element(
    3072,
    &[
        (1, Text),
        (2, Inner(&FIELD)),
        (3, Inner(&MESSAGE)),
        (4, Inner(&ENUMERATION)),
        (5, Inner(&RANGE)),
        (6, Inner(&FIELD)),
        (7, Options(7)),
        (8, Inner(&ONEOF)),
    ],
);
static FIELD: Element = element(
    2048,
    &[
        (1, Text),
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
static ENUMERATION: Element = element(2048, &[(1, Text), (2, Inner(&VALUE)), (3, Options(2))]);
static VALUE: Element = element(1024, &[(1, Text), (2, Number)]);
static ONEOF: Element = element(1024, &[(1, Text)]);
static RANGE: Element = Element { memory: 512, has_name: false, fields: &[(1, Number), (2, Number)] };
static SOURCE: Element = Element { memory: 0, has_name: false, fields: &[(1, Location)] };

/// What surrounds a message.
#[derive(Clone, Copy)]
struct Scope {
    /// Length of the names it is in.
    name: usize,
    /// Length of the name of its file.
    file: usize,
    depth: usize,
}

pub(super) struct Filter {
    room: usize,
    left: usize,
    pub(super) elements: usize,
    pub(super) comments: usize,
}

impl Filter {
    /// * `room`: memory that the set may take \[bytes\]
    pub(super) fn new(room: usize) -> Self {
        Self { room, left: room, elements: 0, comments: 0 }
    }

    /// Memory that the set takes \[bytes\].
    pub(super) fn spent(&self) -> usize {
        self.room - self.left
    }

    /// Copies what is used of a descriptor set.
    pub(super) fn set(&mut self, bytes: &[u8]) -> Result<Vec<u8>, SchemaError> {
        let mut copy = Vec::new();
        self.message(&SET, bytes, Scope { name: 0, file: 0, depth: 0 }, &mut copy)?;
        Ok(copy)
    }

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

    fn message(
        &mut self,
        element: &Element,
        bytes: &[u8],
        scope: Scope,
        into: &mut Vec<u8>,
    ) -> Result<(), SchemaError> {
        let scope = self.enter(element, bytes, scope)?;
        let mut wire = Wire { bytes };
        while !wire.bytes.is_empty() {
            let start = wire.bytes;
            let (number, wire_type) = wire.key()?;
            let part = element.fields.iter().find(|(known, _)| *known == number).map(|(_, part)| *part);
            let content = if wire_type == 2 { Some(wire.block()?) } else { None };
            if content.is_none() {
                wire.skip(number, wire_type, 0)?;
            }
            let whole = &start[..start.len() - wire.bytes.len()];
            match (part, content) {
                (None, _) => {}
                (Some(Number), None) => into.extend_from_slice(whole),
                (Some(part), Some(content)) => self.field(part, (number, content, whole), scope, into)?,
                // no descriptor: the parser reports it, and takes no memory for it
                (Some(_), None) => return Err(DecodeError::SchemaMismatch.into()),
            }
        }
        Ok(())
    }

    /// Counts a message, and returns what surrounds its fields.
    fn enter(&mut self, element: &Element, bytes: &[u8], scope: Scope) -> Result<Scope, SchemaError> {
        if scope.depth > MAX_DEPTH {
            return Err(SchemaError::unsound(format!("its messages are nested deeper than {MAX_DEPTH}")));
        }
        let mut scope = Scope { depth: scope.depth + 1, ..scope };
        if std::ptr::eq(element, &FILE) {
            let texts = [last_text(bytes, 1)?, last_text(bytes, 2)?, last_text(bytes, 12)?];
            let [name, package, syntax] = texts.map(Option::unwrap_or_default);
            check_name(name.len().max(syntax.len()))?;
            self.package(package)?;
            (scope.name, scope.file) = (package.len(), name.len());
        }
        if element.has_name {
            scope.name += 1 + last_text(bytes, 1)?.map_or(0, <[u8]>::len);
            check_name(scope.name)?;
        }
        if element.memory > 0 {
            self.count()?;
            // its whole name stands in several lists, the name of its file in what is reported of it
            self.spend(element.memory + COPIES * scope.name + 2 * scope.file)?;
        }
        Ok(scope)
    }

    /// Copies what is used of a field that has a length.
    ///
    /// * `field`: its number, its content, and both as they stand on the wire
    fn field(
        &mut self,
        part: Part,
        (number, content, whole): (u32, &[u8], &[u8]),
        scope: Scope,
        into: &mut Vec<u8>,
    ) -> Result<(), SchemaError> {
        match part {
            // numbers of imports, each of which may be one byte
            Number => self.spend(8 * content.len())?,
            Text => self.text(content.len())?,
            Import => {
                check_name(content.len())?;
                self.count()?;
                self.text(content.len())?;
            }
            Inner(inner) => {
                let mut copy = Vec::new();
                self.message(inner, content, scope, &mut copy)?;
                put_block(number, &copy, into);
                return Ok(());
            }
            Options(kept) => {
                if last_number(content, kept)?.is_some_and(|value| value != 0) {
                    put_block(number, &[(kept << 3) as u8, 1], into);
                }
                return Ok(());
            }
            Location => return self.location(number, content, into),
        }
        into.extend_from_slice(whole);
        Ok(())
    }

    /// Spends what the name of a package takes: every part of it is a name.
    fn package(&mut self, package: &[u8]) -> Result<(), SchemaError> {
        let parts = package.iter().filter(|byte| **byte == b'.').count();
        if package.len() > MAX_NAME || parts > MAX_PARTS {
            return Err(SchemaError::unsound(format!(
                "the name of a package has more than {MAX_NAME} bytes or {MAX_PARTS} parts"
            )));
        }
        self.spend(COPIES * (parts + 1) * (TEXT + package.len()))
    }

    /// Copies a span of the source, if there is a comment before it.
    fn location(&mut self, number: u32, bytes: &[u8], into: &mut Vec<u8>) -> Result<(), SchemaError> {
        const PATH: u32 = 1;
        const COMMENT: u32 = 3;
        /// A span and its lists.
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

/// * `length`: of a name \[bytes\]
fn check_name(length: usize) -> Result<(), SchemaError> {
    if length > MAX_NAME {
        return Err(SchemaError::unsound(format!("a name in it is longer than {MAX_NAME} bytes")));
    }
    Ok(())
}

fn last_text(bytes: &[u8], wanted: u32) -> Result<Option<&[u8]>, DecodeError> {
    last(bytes, (wanted, 2))?.map(|mut wire| wire.block()).transpose()
}

fn last_number(bytes: &[u8], wanted: u32) -> Result<Option<u64>, DecodeError> {
    last(bytes, (wanted, 0))?.map(|mut wire| wire.varint()).transpose()
}

/// The message from the value of its last field of a number and wire type on.
fn last(bytes: &[u8], wanted: (u32, u8)) -> Result<Option<Wire<'_>>, DecodeError> {
    let (mut wire, mut last) = (Wire { bytes }, None);
    while !wire.bytes.is_empty() {
        let (number, wire_type) = wire.key()?;
        if (number, wire_type) == wanted {
            last = Some(Wire { bytes: wire.bytes });
        }
        wire.skip(number, wire_type, 0)?;
    }
    Ok(last)
}

/// Writes a field of a number below 16 that has a length.
pub(super) fn put_block(number: u32, content: &[u8], into: &mut Vec<u8>) {
    into.push((number << 3 | 2) as u8);
    encode_length_delimiter(content.len(), into).expect("a list grows");
    into.extend_from_slice(content);
}
