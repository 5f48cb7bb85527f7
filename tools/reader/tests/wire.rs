//! Messages taken apart: what the general decoder of `prost-reflect` says, for everything a message can hold.

use percuss_reader::wire::{COUNT, Layout, List, UNKNOWN, Values};
use prost_reflect::{DescriptorPool, DynamicMessage, ReflectMessage, Value, prost::Message};

use crate::forge;

fn layout(name: &str) -> Layout {
    Layout::of(&forge::pool(&forge::file()).get_message_by_name(name).expect("the message"))
}

fn decode(layout: &Layout, bytes: &[u8]) -> Option<Values> {
    let mut values = layout.values();
    layout.decode(bytes, &mut values).ok().map(|()| values)
}

fn list<'a>(layout: &Layout, values: &'a Values, path: &str) -> &'a List {
    &values.lists[layout.find(path).unwrap_or_else(|| panic!("no leaf {path}"))]
}

#[test]
fn every_message_of_a_recording_as_the_general_decoder_has_it() {
    for channel in forge::forge(60, 1).channels {
        let layout = layout(&format!("lab.{}", channel.message));
        for (_, message) in &channel.messages {
            let values = decode(&layout, &message.encode_to_vec()).expect("a message");
            for field in message.descriptor().fields() {
                let Some(leaf) = layout.find(field.name()) else { continue };
                let expected = match message.get_field(&field).into_owned() {
                    Value::List(list) => list,
                    // a message inside its own type is kept as bytes
                    Value::Message(_) => continue,
                    single => vec![single],
                };
                let found: Vec<Value> = match &values.lists[leaf] {
                    List::Double(list) => list.iter().map(|&x| Value::F64(x)).collect(),
                    List::Float(list) => list.iter().map(|&x| Value::F32(x)).collect(),
                    List::Int(list) => list.iter().map(|&x| Value::I64(x)).collect(),
                    List::UInt(list) if matches!(expected[0], Value::U32(_)) => {
                        list.iter().map(|&x| Value::U32(x as u32)).collect()
                    }
                    List::UInt(list) => list.iter().map(|&x| Value::U64(x)).collect(),
                    List::Bool(list) => list.iter().map(|&x| Value::Bool(x)).collect(),
                    List::Enum(list) => list.iter().map(|&x| Value::EnumNumber(x)).collect(),
                    List::Text(list) => list.iter().map(|x| Value::String(x.clone())).collect(),
                    List::Bytes(list) => list.iter().map(|x| Value::Bytes(x.clone().into())).collect(),
                };
                assert_eq!(found, expected, "{}", field.full_name());
            }
        }
    }
}

#[test]
fn absent_numbers_are_zero_and_absent_messages_are_nothing() {
    let layout = layout("lab.Note");
    let values = decode(&layout, &[]).expect("a message");
    assert_eq!(*list(&layout, &values, "time"), List::Double(vec![0.0]));
    assert_eq!(*list(&layout, &values, "text"), List::Text(vec![String::new()]));
    assert!(list(&layout, &values, "place.x").is_empty());
    assert_eq!(*list(&layout, &values, &format!("parts.{COUNT}")), List::UInt(vec![0]));
    // a message that is there but empty holds zeros
    let values = decode(&layout, &[0x2a, 0]).expect("a message");
    assert_eq!(*list(&layout, &values, "place.x"), List::Double(vec![0.0]));
}

#[test]
fn lists_inside_lists_keep_their_lengths() {
    let layout = layout("lab.Note");
    // parts: {tags [1, 2]}, {}, {tags [3]}
    let bytes = [&[0x32, 4, 0x12, 2, 1, 2][..], &[0x32, 0], &[0x32, 3, 0x12, 1, 3]].concat();
    let values = decode(&layout, &bytes).expect("a message");
    assert_eq!(*list(&layout, &values, "parts.tags"), List::Int(vec![1, 2, 3]));
    assert_eq!(*list(&layout, &values, &format!("parts.tags.{COUNT}")), List::UInt(vec![2, 0, 1]));
    assert_eq!(*list(&layout, &values, &format!("parts.{COUNT}")), List::UInt(vec![3]));
    assert_eq!(*list(&layout, &values, "parts.x"), List::Double(vec![0.0; 3]));
}

#[test]
fn an_element_is_named_at_the_part_that_repeats() {
    let layout = layout("lab.Note");
    let name = |path: &str| layout.leaves[layout.find(path).expect("a leaf")].element(3);
    assert_eq!(name("parts.x"), "parts[3].x");
    assert_eq!(name("place.tags"), "place.tags[3]");
    assert_eq!(name("sizes.value"), "sizes[3].value");
    let moving = percuss_reader::wire::Leaf {
        first_list: 0,
        path: "moving.base.x".into(),
        ..layout.leaves[layout.find("parts.x").expect("a leaf")].clone()
    };
    assert_eq!(moving.element(2), "moving[2].base.x");
    assert_eq!(name("time"), "time");
}

#[test]
fn repeated_parts_of_single_fields_are_merged_and_the_last_number_wins() {
    let layout = layout("lab.Note");
    // step 1, step 2, place {x: 1}, place {tags: [5]}
    let x = [&[0x09][..], &1f64.to_le_bytes()].concat();
    let bytes = [&[0x08, 1, 0x08, 2][..], &[0x2a, 9], &x, &[0x2a, 3, 0x12, 1, 5]].concat();
    let values = decode(&layout, &bytes).expect("a message");
    assert_eq!(*list(&layout, &values, "step"), List::UInt(vec![2]));
    assert_eq!(*list(&layout, &values, "place.x"), List::Double(vec![1.0]));
    assert_eq!(*list(&layout, &values, "place.tags"), List::Int(vec![5]));
}

#[test]
fn numbers_of_lists_may_be_single_or_packed() {
    let layout = layout("lab.Profile");
    let number = |x: f64| [&[0x29][..], &x.to_le_bytes()].concat();
    let packed = [&[0x2a, 16][..], &2f64.to_le_bytes(), &3f64.to_le_bytes()].concat();
    let values = decode(&layout, &[number(1.0), packed, number(4.0)].concat()).expect("a message");
    assert_eq!(*list(&layout, &values, "p"), List::Double(vec![1.0, 2.0, 3.0, 4.0]));
}

#[test]
fn an_integer_of_32_bits_is_what_the_lowest_bits_are() {
    let numbers = "Numbers f1:uint32 f2:int32 f3:sint32 f4:=Kind f5:uint64 f6:int64 f7:bool";
    let file = forge::types("lab", numbers, ("Kind", ["CALM", "LOUD"]));
    let layout = Layout::of(&forge::pool(&file).get_message_by_name("lab.Numbers").expect("the message"));
    // 2^32 + 2^31 + 1 as a varint
    let long = [0x81, 0x80, 0x80, 0x80, 0x18];
    let bytes: Vec<u8> = (1..=7).flat_map(|number| [vec![number << 3], long.to_vec()].concat()).collect();
    let values = decode(&layout, &bytes).expect("a message");
    let whole = (1_u64 << 32) + (1 << 31) + 1;
    let expected = [
        List::UInt(vec![(1 << 31) + 1]),
        List::Int(vec![i64::from(i32::MIN) + 1]),
        List::Int(vec![-(1 << 30) - 1]),
        List::Enum(vec![i32::MIN + 1]),
        List::UInt(vec![whole]),
        List::Int(vec![whole as i64]),
        List::Bool(vec![true]),
    ];
    for (i, expected) in expected.iter().enumerate() {
        assert_eq!(list(&layout, &values, &format!("f{}", i + 1)), expected);
    }
    let general = DynamicMessage::decode(layout.descriptor().clone(), &bytes[..]).expect("a message");
    assert_eq!(general.get_field_by_name("f1").expect("a field").as_u32(), Some((1 << 31) + 1));
    assert_eq!(general.get_field_by_name("f3").expect("a field").as_i32(), Some(-(1 << 30) - 1));
}

#[test]
fn what_the_schema_does_not_know_is_kept() {
    let layout = layout("lab.Profile");
    // field 100: varint 7; field 101: a group that holds field 1
    let unknown = [&[0xa0, 0x06, 7][..], &[0xab, 0x06, 0x08, 1, 0xac, 0x06]].concat();
    let values = decode(&layout, &unknown).expect("a message");
    let kept = vec![vec![0xa0, 0x06, 7], vec![0xab, 0x06, 0x08, 1, 0xac, 0x06]];
    assert_eq!(*list(&layout, &values, UNKNOWN), List::Bytes(kept));
}

#[test]
fn mismatches_are_refused() {
    let layout = layout("lab.Note");
    for (what, bytes) in [
        ("a cut-off number", &[0x11, 1, 2][..]),
        ("a text that goes beyond the end", &[0x1a, 9, b'a']),
        ("a text that is none", &[0x1a, 1, 0xff]),
        ("a number as a text", &[0x12, 1, 0]),
        ("a number of eleven bytes", &[0x08, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1]),
        ("a group that does not end", &[0x7b, 0x08, 1]),
        ("an end without a group", &[0x7c]),
        ("a wire type that there is not", &[0x0e]),
    ] {
        assert!(decode(&layout, bytes).is_none(), "{what}");
        let general = DynamicMessage::decode(layout.descriptor().clone(), bytes);
        assert!(general.is_err(), "{what}: the general decoder refuses it too");
    }
}

#[test]
fn a_number_can_be_had_without_the_rest() {
    let layout = layout("lab.Profile");
    let mut recording = forge::forge(3, 1);
    let bytes = recording.channel("/profile").messages[2].1.encode_to_vec();
    let peek = |path: &str, bytes: &[u8]| layout.peek(layout.find(path).expect("a leaf"), bytes);
    assert_eq!((peek("step", &bytes), peek("time", &bytes)), (Some(2.0), Some(0.02)));
    assert_eq!((peek("time", &[]), peek("time", &[0x11])), (Some(0.0), None));
}

#[test]
fn random_bytes_and_the_general_decoder_agree_on_what_fits() {
    let pool: DescriptorPool = forge::pool(&forge::file());
    let mut dice = forge::Dice(5);
    let (mut fitting, rounds) = (0, 20_000);
    let mut start = forge::forge(31, 1).channel("/note").messages[0].1.clone();
    // the general decoder does not look at the wire type of maps
    start.clear_field_by_name("sizes");
    let start = start.encode_to_vec();
    let descriptor = pool.get_message_by_name("lab.Note").expect("the message");
    let layout = Layout::of(&descriptor);
    for _ in 0..rounds {
        let mut bytes = start.clone();
        for _ in 0..1 + dice.below(3) {
            let at = dice.below(bytes.len());
            bytes[at] = dice.roll() as u8;
        }
        let general = DynamicMessage::decode(descriptor.clone(), bytes.as_slice()).is_ok();
        let ours = decode(&layout, &bytes).is_some();
        // a message inside its own type is not looked into here, so more may fit
        assert!(ours || !general, "{bytes:02x?}");
        fitting += u32::from(ours);
    }
    assert!((rounds / 10..rounds).contains(&fitting), "{fitting} of {rounds} fit");
}
