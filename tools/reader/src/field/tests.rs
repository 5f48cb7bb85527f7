//! Columns of a small message: axes, positions, and what is refused.

use super::*;
use crate::{
    axis::between,
    channel::Channel,
    extent::{Extent, Reach},
    wire::{
        Layout,
        schema::tests::{field, file, message},
    },
};
use percuss_picture::Side;
use prost_reflect::prost_types::{
    FieldDescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};
use prost_reflect::{DescriptorPool, DynamicMessage, Value, prost::Message};
use std::collections::BTreeMap;

/// `message P { double time = 1; double r0 = 2; double dr = 3; repeated double p = 4; }`
fn channel(metadata: &[(&str, &str)]) -> Channel {
    let double = |name: &str, number| field(name, number, Type::Double, None);
    let array = FieldDescriptorProto { label: Some(Label::Repeated.into()), ..double("p", 4) };
    let message = message("P", vec![double("time", 1), double("r0", 2), double("dr", 3), array]);
    let file = file("p.proto", vec![message]);
    let pool = DescriptorPool::from_file_descriptor_set(FileDescriptorSet { file: vec![file] });
    Channel {
        topic: "/p".into(),
        schema: "P".into(),
        encoding: "protobuf".into(),
        metadata: metadata.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect::<BTreeMap<_, _>>(),
        layout: pool.expect("a sound schema").get_message_by_name("P").map(|p| Layout::of(&p).into()),
        origin: 0,
        count: 0,
        span: None,
    }
}

/// That of an array of so many elements, on an axis that nothing is known of.
fn array(length: usize) -> Extent {
    Extent { length, ..Extent::default() }
}

fn values(channel: &Channel, p: &[f64]) -> Values {
    let layout = channel.layout.as_ref().expect("a type");
    let mut message = DynamicMessage::new(layout.descriptor().clone());
    message.set_field_by_name("r0", Value::F64(0.05));
    message.set_field_by_name("dr", Value::F64(0.1));
    message.set_field_by_name("p", Value::List(p.iter().copied().map(Value::F64).collect()));
    let mut values = layout.values();
    layout.decode(&message.encode_to_vec(), &mut values).expect("a message");
    values
}

fn cells(channel: &Channel, at: &str, p: &[f64]) -> Vec<Cell> {
    let selection = Selection { at: vec![at.parse().expect("positions")], ..Selection::default() };
    let columns = columns(channel, &selection, &mut |_| array(9)).expect("a selection");
    columns.fields.iter().map(|column| column.cell(&values(channel, p), 0)).collect()
}

#[test]
fn uniform_axes_are_interpolated() {
    let even = channel(&[("axis.p", "r0,dr"), ("symmetry.p", "even")]);
    let plain = channel(&[("axis.p", "r0,dr")]);
    let p = [1.0, 2.0, 4.0];
    let near = |cell: &Cell, value: f64| (cell.number().expect("a number") - value).abs() < 1e-12;
    let got = cells(&even, "r=0,0.05,0.2,0.29,0.31", &p);
    assert!(near(&got[0], (9.0 * p[0] - p[1]) / 8.0));
    assert!(near(&got[1], 1.0) && near(&got[2], 3.0) && near(&got[3], 4.0));
    assert_eq!(got[4], Cell::Empty);
    assert!(near(&cells(&plain, "r=0", &p)[0], 1.0));
    assert_eq!(cells(&plain, "r=0", &[]), [Cell::Empty]);
    assert!(near(&cells(&plain, "r=0.08", &[7.0])[0], 7.0));
}

#[test]
fn listed_axes_are_interpolated_inside() {
    let listed = channel(&[("axis.p", "0,0.5,1")]);
    // r0 and dr are plain fields here and come first
    let got = cells(&listed, "r=0.5,0.75,1", &[1.0, 2.0, 4.0]);
    assert_eq!(got[2..], [Cell::Double(2.0), Cell::Double(3.0), Cell::Double(4.0)]);
    let outside = Selection { at: vec!["r=1.1".parse().expect("positions")], ..Selection::default() };
    let error = columns(&listed, &outside, &mut |_| Extent::default()).expect_err("outside");
    assert!(error.to_string().contains("from r=0 to r=1"), "{error}");
}

#[test]
fn columns_of_a_graded_mesh_reach_to_the_axis() {
    let (side, p) = (Side::Listed([0.05, 0.15, 0.3].into()), [1.0, 2.0, 4.0]);
    let at = |even, r| between(&side, even, (r, false), |i| p.get(i).copied());
    assert!((at(true, 0.0).expect("a value") - (9.0 * p[0] - p[1]) / 8.0).abs() < 1e-12);
    assert_eq!((at(false, 0.0), at(false, 0.05), at(true, 0.31)), (Some(1.0), Some(1.0), None));
    assert!((at(true, 0.2).expect("a value") - 8.0 / 3.0).abs() < 1e-12);
    assert_eq!(Reach::of(side.clone()).expect("positions").low, 0.0);
    // no column of a mesh
    assert_eq!(Reach::of(Side::Listed([0.1, 0.2].into())).expect("positions").low, 0.1);
}

#[test]
fn names_are_taken_apart() {
    for (name, place, field) in [
        ("force", "", "force"),
        ("fig5:force", "fig5:", "force"),
        ("/drag.force", "/drag.", "force"),
        ("out/fig5.mcap:/field/x.a.b@r=0.5", "out/fig5.mcap:/field/x.", "a.b@r=0.5"),
        ("a.b", "", "a.b"),
    ] {
        assert_eq!(place_and_field(name), (place, field));
    }
}

#[test]
fn refusals_are_explained() {
    let channel = channel(&[]);
    let select = |field: &str, at: Option<&str>| {
        let fields = if field.is_empty() { Vec::new() } else { vec![field.to_owned()] };
        let at = at.map(|at| at.parse().expect("positions")).into_iter().collect();
        let selected =
            columns(&channel, &Selection { fields, at, ..Selection::default() }, &mut |_| array(20_000));
        selected.expect_err("a refusal").to_string()
    };
    assert!(select("q", None).contains("time, r0, dr, p"));
    assert!(select("p[x]", None).contains("no field `p[x]`"));
    assert!(select("r0[1]", None).contains("not an array"));
    assert!(select("", Some("r=1")).contains("axis named `r`"));
    assert!(select("p", None).contains("more than 10000"));
}
