//! Hostile message types, and messages that unpack to far more than they are.

use prost_reflect::{
    prost::Message,
    prost_types::{
        DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto, FieldOptions,
        FileDescriptorProto, FileDescriptorSet, MessageOptions, OneofDescriptorProto, UninterpretedOption,
        field_descriptor_proto::{Label, Type},
        uninterpreted_option::NamePart,
    },
};

use super::{
    Case,
    records::{many, timed},
};
use crate::{
    forge::{self, file_of, type_of},
    raw::{
        block, channel, chunk, compressed, compressed_repeats, double, message, message_at, schema, whole,
        whole_number,
    },
};

pub const CASES: &[Case] = &[
    ("types that hold the next one twice", || of_types((0..32).map(|i| chain(i, 32, &["a", "b"])).collect())),
    ("types that hold the next one ten times", || {
        let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];
        of_types((0..32).map(|i| chain(i, 32, &names)).collect())
    }),
    ("two types that hold each other", || {
        let inner = |next: &str| (1..20).map(|n| of_type(&format!("f{n}"), n, next)).collect();
        of_types(vec![type_of("T0", inner(".U")), type_of("U", inner(".T0"))])
    }),
    ("a type of 10 000 fields", || {
        let types = vec![type_of("T0", (1..=10_000).map(number).collect())];
        of_types_with(types, &many(10_000, |i| double(i as usize + 1, 1.0)))
    }),
    ("a type of 60 000 fields", || of_types(vec![type_of("T0", (20_000..80_000).map(number).collect())])),
    ("types nested 10 000 deep", || {
        let nested = (0..10_000).fold(Vec::new(), |inner, _| [block(1, b"A"), block(3, &inner)].concat());
        of_schema("A", &in_file(&block(4, &nested)))
    }),
    ("an enumeration of 60 000 values", || {
        let mut file = forge::types("t", "T0 e:=E", ("E", ["A", "B"]));
        let value =
            |i| EnumValueDescriptorProto { name: Some(format!("V{i}")), number: Some(i), options: None };
        file.enum_type[0].value = (0..60_000).map(value).collect();
        of_schema_with("t.T0", &set(vec![file]), &whole_number(1, u64::MAX))
    }),
    ("names that are no text", || of_schema("A", &in_file(&block(4, &block(1, &[0xff, 0xfe, 0x80]))))),
    ("names that are no names", || {
        of_types(["T0", "", "a.b", "\u{1b}[2J"].map(|name| type_of(name, vec![number(1)])).into())
    }),
    ("imports that are not there", || {
        let mut file = file_of("t.proto", vec![type_of("T0", vec![of_type("x", 1, ".nowhere.X")])]);
        file.dependency = vec!["nowhere.proto".into(), "t.proto".into()];
        file.public_dependency = vec![-1, 7];
        of_schema("T0", &set(vec![file]))
    }),
    ("files that import each other", || of_imports(&[&[1], &[0]])),
    ("a file that imports itself", || of_imports(&[&[0]])),
    ("files that import the next one twice", || {
        of_imports(&(0..64_usize).map(|i| if i < 63 { vec![i + 1; 2] } else { vec![] }).collect::<Vec<_>>())
    }),
    ("editions", || of_syntax("editions")),
    ("a syntax without a name", || of_syntax("")),
    ("a syntax of the future", || of_syntax("proto9\u{1b}[2J")),
    ("groups and extensions", || {
        let mut file = file_of("t.proto", vec![type_of("T0", vec![typed("g", 1, Type::Group, Some(".T0"))])]);
        file.syntax = Some("proto2".into());
        file.extension = vec![FieldDescriptorProto { extendee: Some(".T0".into()), ..number(1) }];
        let message = [[0x0b].repeat(5000), [0x0c].repeat(5000)].concat();
        of_schema_with("T0", &set(vec![file]), &message)
    }),
    ("maps that are none", || of_entry(vec![of_type("key", 1, ".E"), of_type("value", 2, ".T0")])),
    ("a map without keys and values", || of_entry(vec![])),
    ("a map without values", || of_entry(vec![number(1)])),
    ("a map of numbers as keys", || of_entry(vec![number(1), number(2)])),
    ("options that mean something else", || {
        // found by fuzzing: the set brings its own `FieldOptions`, whose `ctype` is a text, which cannot be read back
        let own = forge::types("google.protobuf", "FieldOptions ctype:string", ("E", ["A", "B"]));
        let name = vec![NamePart { name_part: "ctype".into(), is_extension: false }];
        let string_value = Some(b"text".to_vec());
        let option = UninterpretedOption { name, string_value, ..Default::default() };
        let options = FieldOptions { uninterpreted_option: vec![option], ..Default::default() };
        let field = FieldDescriptorProto { options: Some(options), ..number(1) };
        of_schema("T0", &set(vec![own, file_of("t.proto", vec![type_of("T0", vec![field])])]))
    }),
    ("lists that cannot be packed", || {
        let options = Some(FieldOptions { packed: Some(true), ..Default::default() });
        let one =
            |name: &str, n, of| FieldDescriptorProto { options: options.clone(), ..typed(name, n, of, None) };
        let fields = vec![one("s", 1, Type::String), one("b", 2, Type::Bytes), one("d", 3, Type::Double)];
        of_types_with(vec![type_of("T0", fields)], &[block(1, &[0xff; 9]), block(3, &[0; 12])].concat())
    }),
    ("members of no oneof", || {
        let at = |n, index| FieldDescriptorProto { oneof_index: Some(index), ..number(n) };
        let mut of = type_of("T0", vec![at(1, -1), at(2, i32::MAX), at(3, 0)]);
        of.oneof_decl = vec![OneofDescriptorProto { name: None, options: None }];
        of_types(vec![of])
    }),
    ("oneofs of very many members", || {
        let member = |n| FieldDescriptorProto { oneof_index: Some(0), ..number(n) };
        let mut of = type_of("T0", (1..9000).map(member).collect());
        of.oneof_decl = vec![OneofDescriptorProto { name: Some("o".into()), options: None }];
        of_types_with(vec![of], &many(300, |i| double(i as usize % 2 * 7000 + 1, 1.0)))
    }),
    ("numbers of fields that cannot be", || {
        of_types(vec![type_of("T0", [0, -1, 19_000, i32::MAX, i32::MIN].map(number).to_vec())])
    }),
    ("names and numbers twice", || {
        of_types(vec![type_of("T0", vec![number(1), number(1)]), type_of("T0", vec![])])
    }),
    ("types and labels that are none", || {
        let odd = |n, label, of| FieldDescriptorProto { label, r#type: of, ..number(n) };
        let fields = vec![odd(1, Some(99), None), odd(2, None, Some(99)), odd(3, Some(0), Some(-1))];
        of_types(vec![type_of("T0", fields)])
    }),
    ("a type that is an enumeration", || {
        let mut file = file_of("t.proto", vec![type_of("T0", vec![of_type("x", 1, ".E")])]);
        let enumeration = EnumDescriptorProto { name: Some("E".into()), ..Default::default() };
        (file.enum_type, file.message_type[0].field[0].default_value) = (vec![enumeration], Some("x".into()));
        of_schema("T0", &set(vec![file]))
    }),
    ("descriptors of very many empty types", || of_schema("A", &in_file(&block(4, &[]).repeat(60_000)))),
    ("descriptors that unpack 400 times", || {
        of_schema("A", &in_file(&block(4, &[block(1, &[b'A'; 4000]), block(2, &[]).repeat(50_000)].concat())))
    }),
    ("descriptors of four million empty types", || of_schema("A", &in_file(&block(4, &[]).repeat(4 << 20)))),
    ("a package of very many parts", || of_schema("A", &in_file(&block(2, &b"a.".repeat(100_000))))),
    ("very many comments", || {
        let one = block(4, &block(1, b"A"));
        let comments = block(9, &block(1, &[block(1, &[4, 0]), block(3, b"x")].concat()).repeat(200_000));
        of_schema("A", &in_file(&[one, comments].concat()))
    }),
    ("very many places without a comment", || {
        // they mean nothing, and take no room
        let places = block(9, &block(1, &[]).repeat(4 << 20));
        of_schema("A", &in_file(&[block(4, &block(1, b"A")), places].concat()))
    }),
    ("a descriptor set that is none", || of_schema("A", &[0xff; 5000])),
    ("very many schemas with types", || {
        let types: Vec<_> =
            (0..200).map(|i| type_of(&format!("T{i}"), (1..40).map(number).collect())).collect();
        let data = set(vec![file_of("t.proto", types)]);
        let all = many(300, |i| {
            [schema(i as u16 + 1, "T0", &data), channel(i as u16, i as u16 + 1, "/a", &[])].concat()
        });
        whole(&[compressed(&[all])], &[])
    }),
    ("empty submessages", || of_note(&block(6, &[]).repeat(MANY))),
    ("entries of a map", || of_note(&block(8, &[]).repeat(MANY))),
    ("packed numbers of a byte", || of_note(&block(5, &block(2, &vec![0; 8 * MANY])))),
    ("fields that are not known", || of_note(&[0x78, 0].repeat(MANY))),
    ("parts that have to be merged", || of_note(&block(5, &[]).repeat(MANY))),
    ("submessages of a type inside itself", || of_note(&block(9, &block(9, &[]).repeat(MANY)))),
    ("parts to be merged, one in the other", || {
        of_note(&(0..1000).fold(vec![], |i, _| [block(9, &i), block(9, &[])].concat()))
    }),
    ("messages nested 10 000 deep", || of_note(&(0..10_000).fold(Vec::new(), |inner, _| block(9, &inner)))),
    ("messages that are broken", broken),
    ("very many empty messages of a wide type", || {
        let types = vec![type_of("T0", (1..=2000).map(number).collect())];
        let definitions = [schema(1, "T0", &set(vec![file_of("t.proto", types)])), channel(1, 1, "/a", &[])];
        whole(&[compressed(&[definitions.concat(), message(1, &[]).repeat(2000)])], &[])
    }),
    ("keys of maps of a megabyte", || {
        let chunk = |i: u8| compressed(&[size_at(i.into(), &vec![b'a' + i; 500_000])]);
        whole(&[lab_channel("Note", "/note", &[]), (0..26).flat_map(chunk).collect()], &[])
    }),
    ("very many keys of maps", || of_notes(many(20_000, |i| size_at(i.into(), format!("k{i}").as_bytes())))),
    ("lists in lists", || {
        let data = block(1, &block(1, &1_f64.to_le_bytes())).repeat(9000);
        let messages = many(60, |i| message_at(1, i.into(), &data));
        whole(&[compressed(&[typed_channel("T0 l:[U]\nU list:[double]", "/a", &[]), messages])], &[])
    }),
    ("maps of wide messages with long keys", || {
        let fields: String = (1..=1000).map(|n| format!(" f{n}:?double")).collect();
        let file = forge::types("t", &format!("T0 m:map<string,V>\nV{fields}"), ("E", ["A", "B"]));
        let key = |i: u32| block(1, &block(1, format!("{i:0>1000}").as_bytes()));
        of_schema_with("t.T0", &set(vec![file]), &many(900, key))
    }),
    ("very many wide topics", || {
        let definitions =
            [lab(1, "Profile"), many(200, |id| channel(id as u16, 1, &format!("/{id}"), &[]))].concat();
        let data = block(5, &vec![0; 8 * 9000]);
        whole(&[compressed(&[definitions, many(200, |id| message_at(id as u16, 0, &data))])], &[])
    }),
    ("texts of megabytes in two topics", || {
        let text = block(3, &vec![b'x'; 1_000_000]);
        let one = |i: u64| compressed(&[message_at(1 + (i % 2) as u16, i, &text)]);
        let definitions = [lab_channel("Note", "/a", &[]), channel(2, 1, "/b", &[])].concat();
        whole(&[definitions, (0..30).flat_map(one).collect()], &[])
    }),
    ("a list of half a million numbers", || {
        let numbers = message(1, &block(5, &vec![0; 8 * 450_000]));
        whole(&[lab_channel("Profile", "/a", &[]), compressed(&[numbers.clone(), numbers])], &[])
    }),
    ("messages as large as allowed", || {
        let one = message(1, &block(7, &vec![1; 15_000_000]));
        let chunk = chunk(one.len() as u64, b"zstd", &compressed_repeats(&one, 1));
        whole(&[lab_channel("Note", "/note", &[]), chunk.repeat(3)], &[])
    }),
];

const MANY: usize = 1 << 20;

/// The schema of a message of the tests.
pub fn lab(id: u16, name: &str) -> Vec<u8> {
    schema(id, &format!("lab.{name}"), &set(vec![forge::file()]))
}

fn broken() -> Vec<u8> {
    let long = |n: u8| [&[n << 3][..], &[0xff; 9], &[0x7f]].concat();
    let messages: Vec<Vec<u8>> = vec![
        vec![0xff; 11],
        long(1),
        vec![0x08],
        vec![0x1a, 0xff, 0xff, 0xff, 0xff, 0x0f],
        [&[0x1a][..], &[0xff; 9], &[0x01]].concat(),
        vec![0x1b; 100],
        vec![0x1c],
        vec![0x1d, 0, 0],
        vec![0x1e],
        vec![0x1f],
        vec![0x00, 0x00],
        double(3, 1.0),
        vec![0x2a, 0x02, 0x12, 0x7f],
        block(3, &[0xff, 0xfe]),
        block(8, &[0x0a, 0x05, b'a']),
        [&[0xf8, 0xff, 0xff, 0xff, 0xff, 0x01][..], &[0]].concat(),
    ];
    of_notes(messages.iter().flat_map(|data| message(1, data)).collect())
}

/// The same with a channel of it.
pub fn lab_channel(name: &str, topic: &str, metadata: &[u8]) -> Vec<u8> {
    [lab(1, name), channel(1, 1, topic, metadata)].concat()
}

/// The schema of the first of some types, and a channel of it.
pub fn typed_channel(types: &str, topic: &str, metadata: &[u8]) -> Vec<u8> {
    let (name, _) = types.split_once(' ').expect("a field");
    let file = forge::types("t", types, ("E", ["A", "B"]));
    [schema(1, &format!("t.{name}"), &set(vec![file])), channel(1, 1, topic, metadata)].concat()
}

fn set(file: Vec<FileDescriptorProto>) -> Vec<u8> {
    FileDescriptorSet { file }.encode_to_vec()
}

/// A file of a descriptor set with some content.
fn in_file(content: &[u8]) -> Vec<u8> {
    block(1, &[&block(1, b"a")[..], &block(12, b"proto3"), content].concat())
}

fn of_syntax(syntax: &str) -> Vec<u8> {
    let mut file = file_of("e.proto", vec![type_of("A", vec![number(1)])]);
    file.syntax = Some(syntax.into());
    of_schema("A", &set(vec![file]))
}

/// Files by the numbers of those that they import publicly.
fn of_imports(imports: &[impl AsRef<[usize]>]) -> Vec<u8> {
    let name = |i: usize| format!("{i}.proto");
    let file = |(i, imports): (usize, &[usize])| FileDescriptorProto {
        dependency: imports.iter().copied().map(name).collect(),
        public_dependency: (0..).take(imports.len()).collect(),
        ..file_of(&name(i), vec![type_of(&format!("T{i}"), vec![])])
    };
    of_schema("T0", &set(imports.iter().map(AsRef::as_ref).enumerate().map(file).collect()))
}

/// A map whose entry has these fields.
fn of_entry(fields: Vec<FieldDescriptorProto>) -> Vec<u8> {
    let options = Some(MessageOptions { map_entry: Some(true), ..Default::default() });
    let entry = DescriptorProto { options, ..type_of("E", fields) };
    let map = FieldDescriptorProto { label: Some(Label::Repeated.into()), ..of_type("m", 1, ".E") };
    of_types_with(vec![type_of("T0", vec![map]), entry], &block(1, &block(2, &[])).repeat(1000))
}

fn typed(name: &str, number: i32, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    forge::field(name, number, Label::Optional, kind, type_name)
}

fn number(number: i32) -> FieldDescriptorProto {
    typed(&format!("f{}", number.unsigned_abs()), number, Type::Double, None)
}

fn of_type(name: &str, number: i32, type_name: &str) -> FieldDescriptorProto {
    typed(name, number, Type::Message, Some(type_name))
}

/// A type that holds the next one in every field; the last holds nothing.
fn chain(i: usize, length: usize, fields: &[&str]) -> DescriptorProto {
    let next = format!(".T{}", i + 1);
    let fields = fields.iter().zip(1..).filter(|_| i + 1 < length);
    type_of(&format!("T{i}"), fields.map(|(name, n)| of_type(name, n, &next)).collect())
}

fn of_types(types: Vec<DescriptorProto>) -> Vec<u8> {
    of_types_with(types, &[])
}

fn of_types_with(types: Vec<DescriptorProto>, data: &[u8]) -> Vec<u8> {
    of_schema_with("T0", &set(vec![file_of("t.proto", types)]), data)
}

fn of_schema(name: &str, data: &[u8]) -> Vec<u8> {
    of_schema_with(name, data, &[])
}

/// A schema, a channel and two messages of it.
fn of_schema_with(name: &str, data: &[u8], content: &[u8]) -> Vec<u8> {
    let messages = [message_at(1, 0, content), message_at(1, 1_000_000_000, content)].concat();
    let records = [schema(1, name, data), channel(1, 1, "/a", &[]), messages].concat();
    whole(&[timed((0, 1_000_000_000), &records)], &[])
}

/// Messages `Note` of the other tests, in a chunk.
fn of_notes(messages: Vec<u8>) -> Vec<u8> {
    whole(&[lab_channel("Note", "/note", &[]), compressed(&[messages])], &[])
}

fn of_note(data: &[u8]) -> Vec<u8> {
    of_notes(message(1, data))
}

/// A note with one of its sizes.
fn size_at(time: u64, key: &[u8]) -> Vec<u8> {
    message_at(1, time, &block(8, &[block(1, key), double(2, 1.0)].concat()))
}
