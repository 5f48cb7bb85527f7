//! Recordings of other programs: what `info`, `trace` and `plot` say of them without being asked for anything.

use mcap::Compression;
use prost_reflect::{
    DescriptorPool,
    prost_types::{
        DescriptorProto, EnumOptions, FieldDescriptorProto, FieldOptions, OneofDescriptorProto,
        descriptor_proto::ExtensionRange,
        field_descriptor_proto::{Label, Type},
    },
};
use serde_json::{Value, json};

use crate::{
    desk::Desk,
    forge,
    guests::{Guest, START, STEP, types, write},
    raw,
};

/// What the three verbs say: `info`, the first lines of `trace`, and `plot`.
fn shown(desk: &Desk) -> (String, Vec<String>, String) {
    let trace = desk.lines(&["trace", "a.mcap"]);
    (desk.text(0, &["info", "a.mcap"]), trace, desk.text(0, &["plot", "a.mcap"]))
}

fn desk(channels: &[Guest]) -> Desk {
    Desk::new(&[("a.mcap", write(channels, Some(Compression::Zstd)))])
}

/// Every part is there.
fn holds(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing from:\n{text}");
    }
}

/// No part is there.
fn lacks(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(!text.contains(part), "`{part}` is in:\n{text}");
    }
}

/// Seconds of a message since 1970, as those of a stamp.
fn stamp(i: u64) -> String {
    format!("2023-11-14T22:13:2{}.{}Z", i / 10, i % 10)
}

fn poses() -> Guest {
    let pool = types(
        "Point x:double y:double\n\
         Header stamp:google.protobuf.Timestamp seq:uint32 frame_id:string\n\
         PoseInFrame header:Header timestamp:google.protobuf.Timestamp position:Point",
    );
    let pose = |i: u64| {
        json!({
            "header": {"stamp": stamp(i), "seq": i, "frame_id": "map"},
            "timestamp": stamp(i),
            "position": {"x": 0.5 * i as f64, "y": -1.0},
        })
    };
    Guest::protobuf("/pose", &pool, "PoseInFrame", &(0..20).map(pose).collect::<Vec<_>>())
}

#[test]
fn poses_with_stamps_on_a_wall_clock() {
    let desk = desk(&[poses()]);
    let (info, trace, plot) = shown(&desk);
    holds(
        &info,
        &["/pose", "guest.PoseInFrame", "protobuf", "10 Hz", "2023-11-14T22:13:20.000000000Z", "1.9 s"],
    );
    assert_eq!(
        trace[0],
        "time [s],header.stamp.seconds,header.stamp.nanos,header.seq,header.frame_id,timestamp.seconds,\
         timestamp.nanos,position.x,position.y"
    );
    assert_eq!(trace[1], "0.0,1700000000,0,0,map,1700000000,0,0.0,-1.0");
    assert_eq!(trace[2], "0.1,1700000000,100000000,1,map,1700000000,100000000,0.5,-1.0");
    assert_eq!(trace.len(), 21);
    holds(&plot, &["time [s]", "position.x", "position.y"]);
    lacks(&plot, &["header", "stamp", "seq", "1.7"]);
}

#[test]
fn times_are_from_the_start_or_since_1970() {
    let desk = desk(&[poses()]);
    let first = |arguments: &[&str]| {
        let all = [&["trace", "a.mcap", "--field", "position.x"], arguments].concat();
        desk.lines(&all)[..2].join(" | ")
    };
    assert_eq!(first(&["--from", "0.5"]), "time [s],position.x | 0.5,2.5");
    assert_eq!(first(&["--epoch"]), "log_time [s],position.x | 1700000000.0,0.0");
    assert_eq!(first(&["--epoch", "--from", "1700000000.55"]), "log_time [s],position.x | 1700000000.6,3.0");
    assert_eq!(first(&["--time", "iso"]), "log_time,position.x | 2023-11-14T22:13:20.000000000Z,0.0");
    assert_eq!(
        first(&["--time", "ns", "--from", "0.3"]),
        "log_time [ns],position.x | 1700000000300000000,1.5"
    );
    assert_eq!(desk.lines(&["trace", "a.mcap", "--to", "0.35"]).len(), 5);
    holds(&desk.error(2, &["trace", "a.mcap", "--epoch", "--time", "iso"]), &["cannot be used with"]);
    holds(&desk.text(0, &["plot", "a.mcap", "--epoch"]), &["log_time [s]"]);
}

#[test]
fn inertial_units_with_covariances() {
    let pool = types(
        "Point x:double y:double\n\
         Imu timestamp:google.protobuf.Timestamp rate:Point covariance:[double]",
    );
    let message =
        |i: u64| json!({"timestamp": stamp(i), "rate": {"x": i, "y": 2}, "covariance": [1, 0, 0, i]});
    let messages: Vec<Value> = (0..5).map(message).collect();
    let desk = desk(&[Guest::protobuf("/imu", &pool, "Imu", &messages)]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["guest.Imu", "covariance[]", "rate.x"]);
    holds(
        &trace[0],
        &["time [s],", ",rate.x,rate.y,covariance[0],covariance[1],covariance[2],covariance[3]"],
    );
    assert_eq!(trace[2], "0.1,1700000000,100000000,1.0,2.0,1.0,0.0,0.0,1.0");
    holds(&plot, &["rate.x", "covariance[3]"]);
    lacks(&plot, &["timestamp"]);
}

#[test]
fn maps_are_spread_by_their_keys() {
    let pool = types(
        "Point x:double y:double\n\
         Control gains:map<string,double> axes:map<int32,Point> limits:map<bool,double>",
    );
    let message = |i: u64| {
        let mut gains = json!({"kp": 1.0, "joint.kd": i});
        if i == 1 {
            gains = json!({"ki": 3.0, "kp": 2.0});
        }
        json!({"gains": gains, "axes": {"-1": {"x": i, "y": 1}, "7": {"x": 9}}, "limits": {"true": 5}})
    };
    let messages: Vec<Value> = (0..3).map(message).collect();
    let desk = desk(&[Guest::protobuf("/control", &pool, "Control", &messages)]);
    let (_, trace, plot) = shown(&desk);
    assert_eq!(
        trace[0],
        "time [s],gains[joint.kd],gains[ki],gains[kp],axes[-1].x,axes[7].x,axes[-1].y,axes[7].y,limits[true]"
    );
    assert_eq!(trace[1], "0.0,0.0,,1.0,0.0,9.0,1.0,0.0,5.0");
    assert_eq!(trace[2], "0.1,,3.0,2.0,1.0,9.0,1.0,0.0,5.0");
    holds(&plot, &["gains[kp]", "axes[-1].x"]);
    lacks(&plot, &[".key", ".value"]);
    let chosen = "gains[joint.kd],gains[kp],axes[7].x,limits[true]";
    let chosen = desk.lines(&["trace", "a.mcap", "--field", chosen]);
    assert_eq!(chosen[0], "time [s],gains[joint.kd],gains[kp],axes[7].x,limits[true]");
    assert_eq!(chosen[3], "0.2,2.0,1.0,9.0,5.0");
    assert_eq!(
        desk.lines(&["trace", "a.mcap", "--field", "gains"])[0],
        "time [s],gains[joint.kd],gains[ki],gains[kp]"
    );
    holds(&desk.error(2, &["trace", "a.mcap", "--field", "axes[a].x"]), &["axes[a].x"]);
}

#[test]
fn names_of_numbers_and_truth_values() {
    let pool = types("State mode:=Mode ready:bool level:float");
    let messages = [json!({"mode": "RUN", "ready": true, "level": 0.5}), json!({"mode": 7}), json!({})];
    let desk = desk(&[Guest::protobuf("/state", &pool, "State", &messages)]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["mode, ready, level"]);
    assert_eq!(
        trace,
        ["time [s],mode,ready,level", "0.0,RUN,true,0.5", "0.1,7,false,0.0", "0.2,IDLE,false,0.0"]
    );
    holds(&plot, &["mode", "level"]);
    assert_eq!(
        desk.lines(&["trace", "a.mcap", "--format", "jsonl"])[0],
        r#"{"time":0.0,"mode":"RUN","ready":true,"level":0.5}"#
    );
}

#[test]
fn json_with_a_schema() {
    let schema = r##"{"title": "Pose", "type": "object", "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "pose": {"$ref": "#/$defs/pose"}, "ranges": {"type": "array", "items": {"type": "number"}},
        "count": {"type": "integer"}, "data": {"type": "string", "contentEncoding": "base64"}, "extra": {}},
        "$defs": {"pose": {"type": "object", "properties": {"z": {"type": "number"}, "x": {"type": "number"}}}}}"##;
    let message = |i: u64| {
        format!(
            r#"{{"count":{i},"timestamp":{{"sec":1700000000,"nsec":{i}}},"pose":{{"x":0.5,"z":"NaN"}},
                "ranges":[{i}.5,null],"data":"aGk=","extra":{{"deep":true}}}}"#
        )
    };
    let messages: Vec<String> = (0..3).map(message).collect();
    let desk = desk(&[Guest::json("/pose", Some(("lab.Pose", schema)), &messages)]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["lab.Pose", "json", "pose.x", "ranges[]"]);
    assert_eq!(
        trace[0],
        "time [s],timestamp.sec,timestamp.nsec,pose.z,pose.x,ranges[0],ranges[1],count,data,extra.deep"
    );
    assert_eq!(trace[2], "0.1,1700000000,1,NaN,0.5,1.5,NaN,1,aGk=,true");
    holds(&plot, &["pose.x", "ranges[0]", "count"]);
    lacks(&plot, &["timestamp", "data"]);
    holds(&desk.text(0, &["diff", "a.mcap", "a.mcap"]), &["equal"]);
    // on one line each, however they are laid out
    assert_eq!(desk.lines(&["cat", "a.mcap"]).len(), 3);
}

#[test]
fn json_without_a_schema() {
    let message = |i: u64| {
        json!({
            "joints": [{"name": "a", "angle": i}, {"name": "b"}],
            "stamp": {"sec": 1_700_000_000 + i, "nanosec": 0},
            "big": START + i,
            "either": if i == 0 { json!(1) } else { json!("one") },
            "matrix": [[1, 2], [3, i]],
            "missing": null,
        })
        .to_string()
    };
    let mut messages: Vec<String> = (0..4).map(message).collect();
    messages.push(r#"{"big": "a text", "joints": []}"#.into());
    let desk = Desk::new(&[("a.mcap", write(&[Guest::json("/robot", None, &messages[..4])], None))]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["/robot", "json"]);
    assert_eq!(
        trace[0],
        "time [s],big,either,joints[0].angle,joints[1].angle,joints[0].name,joints[1].name,matrix[0],matrix[1],\
         matrix[2],matrix[3],missing,stamp.nanosec,stamp.sec"
    );
    assert_eq!(trace[2], "0.1,1700000000000000001,one,1.0,,a,b,1.0,2.0,3.0,1.0,,0.0,1700000001.0");
    holds(&plot, &["joints[0].angle"]);
    lacks(&plot, &["stamp", "either"]);
    // a field that turns out to be a text among the first messages is one
    let desk = Desk::new(&[("a.mcap", write(&[Guest::json("/robot", None, &messages)], None))]);
    assert_eq!(desk.lines(&["trace", "a.mcap", "--field", "big"])[5], "0.4,a text");
}

#[test]
fn json_that_is_none_is_reported_and_costs_little() {
    let plain = |i: usize| format!(r#"{{"x":{i}}}"#);
    let mut messages: Vec<String> = (0..150).map(plain).collect();
    // neither is what the first messages are
    for bad in [
        r#"{"x":"text"}"#,
        r#"{"x":1,"x":2}"#,
        r#"{"x":1"#,
        "\u{1}",
        &format!("{{\"x\":{}1{}}}", "[".repeat(9_000), "]".repeat(9_000)),
    ] {
        messages.push((*bad).to_owned());
    }
    messages.push(r#"{"x":3,"more":[1]}"#.into());
    let bytes = write(&[Guest::json("/x", None, &messages)], Some(Compression::Zstd));
    let desk = Desk::new(&[("a.mcap", bytes)]);
    let (table, said) = desk.both(3, &["trace", "a.mcap"]);
    holds(&said, &["5 messages do not fit their schema"]);
    assert_eq!(table.lines().count(), 1 + 151);
    holds(&table, &["15.5,3.0"]);
}

#[test]
fn scans_over_angles() {
    let pool = types(
        "LaserScan timestamp:google.protobuf.Timestamp start_angle:double end_angle:double ranges:[double]",
    );
    let message =
        |i: u64| json!({"timestamp": stamp(i), "start_angle": -1, "end_angle": 1, "ranges": [i, 2, 3]});
    let messages: Vec<Value> = (0..4).map(message).collect();
    let desk = desk(&[Guest::protobuf("/scan", &pool, "LaserScan", &messages)]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["start_angle, end_angle, ranges[]"]);
    assert_eq!(trace[4], "0.3,1700000000,300000000,-1.0,1.0,3.0,2.0,3.0");
    holds(&plot, &["ranges[0]", "start_angle"]);
    // one scan over its elements, at a time from the start
    let scan = ["plot", "a.mcap", "--topic", "/scan", "--field", "ranges", "--at-time", "0.2"];
    holds(&desk.text(0, &scan), &["index"]);
    holds(&desk.error(2, &[&scan[..7], &["1700000000.2"]].concat()), &["1700000000.2"]);
}

#[test]
fn several_topics_out_of_order_under_lz4() {
    let pool = types(
        "Log text:string\n\
         Point x:double y:double",
    );
    let text = |i: u64| json!({"text": format!("line {i}")});
    let log = Guest::protobuf("/log", &pool, "Log", &(0..6).map(text).collect::<Vec<_>>());
    let point = |i: u64| json!({"x": i, "y": 10 * i});
    let mut points = Guest::protobuf("/b", &pool, "Point", &(0..6).map(point).collect::<Vec<_>>());
    points.messages.reverse();
    // the recording begins with the last that is written
    let mut early = Guest::json("/a", None, &[r#"{"v":1}"#.into()]);
    early.messages[0].0 = START - 2 * STEP;
    let desk = Desk::new(&[("a.mcap", write(&[log, points, early], Some(Compression::Lz4)))]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["lz4", "/log", "/b", "/a", "2023-11-14T22:13:19.800000000Z", "0.7 s"]);
    // texts say less than numbers: the first topic with numbers
    assert_eq!(trace[..2], ["time [s],x,y", "0.7,5.0,50.0"]);
    assert_eq!(trace[6], "0.2,0.0,0.0");
    holds(&plot, &["time [ms]", "x", "y"]);
    let both = desk.lines(&["trace", "a.mcap", "--topic", "/a,/b"]);
    assert_eq!(both[..3], ["time [s],/a.v,/b.x,/b.y", "0.0,1.0,,", "0.2,,0.0,0.0"]);
}

/// A camera with compressed images, the second of which is a JPEG.
fn camera() -> Guest {
    let pool =
        types("CompressedImage timestamp:google.protobuf.Timestamp frame_id:string data:bytes format:string");
    let messages = [
        json!({"timestamp": stamp(0), "data": "iVBORw0KGgo=", "format": "png"}),
        json!({"timestamp": stamp(1), "data": "/9j/4A==", "format": "jpeg"}),
        json!({"timestamp": stamp(2), "data": "/9j/4Q==", "format": "jpeg"}),
    ];
    Guest::protobuf("/camera", &pool, "CompressedImage", &messages)
}

#[test]
fn packed_images_come_out_as_they_are() {
    let desk = desk(&[camera()]);
    let (trace, said) = desk.both(0, &["trace", "a.mcap"]);
    assert!(
        trace.starts_with(
            "time [s],timestamp.seconds,timestamp.nanos,frame_id,format\n0.0,1700000000,0,,png\n"
        ),
        "{trace}"
    );
    holds(&said, &["`data` of `/camera` is bytes"]);
    holds(&desk.text(0, &["info", "a.mcap"]), &["guest.CompressedImage"]);
    holds(&desk.error(2, &["plot", "a.mcap"]), &["nothing to draw"]);
    let export = ["export", "a.mcap", "--topic", "/camera"];
    desk.text(0, &[&export[..], &["--at-time", "0.1", "-o", "one.jpg"]].concat());
    assert_eq!(desk.bytes("one.jpg"), [0xff, 0xd8, 0xff, 0xe0]);
    holds(
        &desk.error(2, &[&export[..], &["--at-time", "0", "-o", "one.webp"]].concat()),
        &["the image is a .png"],
    );
    let names = desk.lines(&[&export[..], &["-o", "all/"]].concat());
    let expected = ["00000000.png", "100000000.jpg", "200000000.jpg"];
    assert_eq!(names.len(), expected.len());
    for (name, end) in names.iter().zip(expected) {
        assert!(name.starts_with("all/17000000") && name.ends_with(end), "{name}");
    }
    assert_eq!(desk.bytes(&names[2]), [0xff, 0xd8, 0xff, 0xe1]);
    // nothing is overwritten
    desk.error(1, &[&export[..], &["-o", "all/"]].concat());
}

#[test]
fn cat_hides_nothing_of_a_message() {
    let own = |name: &str| format!("google.protobuf.{name}");
    let line = format!(
        "Odd any:{} at:{} lasts:{} value:{} mask:{} wrapped:{} sizes:map<string,double> by:map<int32,double> x:double",
        own("Any"),
        own("Timestamp"),
        own("Duration"),
        own("Value"),
        own("FieldMask"),
        own("DoubleValue"),
    );
    let pool = types(&format!("{line}\nPart y:double"));
    let shown = |fields: &[Vec<u8>]| {
        let mut guest = Guest::protobuf("/odd", &pool, "Odd", &[]);
        guest.messages = vec![(0, [fields.concat(), raw::double(9, 2.0)].concat())];
        let desk = Desk::new(&[("a.mcap", write(&[guest], None))]);
        let lines = desk.lines(&["cat", "a.mcap"]);
        assert_eq!(lines, desk.lines(&["cat", "a.mcap"]), "the same at every run");
        serde_json::from_str::<Value>(&lines[0]).expect("JSON")["message"].take()
    };
    let part = |number, fields: &[Vec<u8>]| raw::block(number, &fields.concat());
    let (text, whole) = (|number, text: &str| raw::block(number, text.as_bytes()), raw::whole_number);
    let minus = u64::MAX;
    for (field, bytes, expected) in [
        // what the mapping has no form for, field by field
        (
            "any",
            part(1, &[text(1, "a/not.There"), text(2, "\u{1}\u{2}")]),
            json!({"type_url": "a/not.There", "value": "AQI="}),
        ),
        ("any", part(1, &[]), json!({"type_url": "", "value": ""})),
        ("at", part(2, &[whole(1, 1_700_000_000_000)]), json!({"seconds": "1700000000000", "nanos": 0})),
        ("lasts", part(3, &[whole(1, 1), whole(2, minus)]), json!({"seconds": "1", "nanos": -1})),
        (
            "lasts",
            part(3, &[whole(1, 1_000_000_000_000_000)]),
            json!({"seconds": "1000000000000000", "nanos": 0}),
        ),
        ("value", part(4, &[raw::double(2, f64::NAN)]), json!("NaN")),
        ("mask", part(5, &[text(1, "A__b")]), json!({"paths": ["A__b"]})),
        ("wrapped", part(6, &[raw::double(1, f64::NAN)]), json!("NaN")),
        // and what it has one for
        (
            "any",
            part(1, &[text(1, "a/guest.Part"), raw::block(2, &raw::double(1, 3.0))]),
            json!({"@type": "a/guest.Part", "y": 3.0}),
        ),
        ("at", part(2, &[whole(1, 5)]), json!("1970-01-01T00:00:05Z")),
        ("lasts", part(3, &[whole(1, 1), whole(2, 500_000_000)]), json!("1.500s")),
        ("value", part(4, &[text(3, "text")]), json!("text")),
        ("wrapped", part(6, &[raw::double(1, 0.5)]), json!(0.5)),
    ] {
        let message = shown(&[bytes]);
        assert_eq!((&message[field], &message["x"]), (&expected, &json!(2.0)), "{message}");
    }
    let entry = |key: &str, value| part(7, &[text(1, key), raw::double(2, value)]);
    let message = shown(&[entry("b", 1.0), entry("", 2.0), entry("a", f64::INFINITY), entry("b", 3.0)]);
    assert_eq!(message["sizes"].to_string(), r#"{"":2.0,"a":"Infinity","b":3.0}"#);
    let entry = |key, value| part(8, &[whole(1, key), raw::double(2, value)]);
    let message = shown(&[entry(3, 1.0), entry(10, 2.0), entry(minus, 3.0)]);
    assert_eq!(message["by"], json!({"-1": 3.0, "3": 1.0, "10": 2.0}));
}

#[test]
fn channels_of_one_topic_have_columns_of_their_own() {
    let message = json!({ "x": 1.0 });
    let json = Guest::json("/same", None, &[message.to_string()]);
    let protobuf = Guest::protobuf("/same", &types("Curve x:double"), "Curve", &[message]);
    let desk = Desk::new(&[("a.mcap", write(&[json, protobuf], None))]);
    assert_eq!(desk.lines(&["trace", "a.mcap", "--topic", "/same"])[0], "time [s],/same#1.x,/same#2.x");
    desk.text(0, &["trace", "a.mcap", "--topic", "/same", "-o", "a.parquet"]);
}

#[test]
fn topics_that_are_not_in_the_order_of_time_are_joined_in_it() {
    let json = |topic: &str, times: &[u64]| {
        let mut guest = Guest::json(topic, None, &[]);
        let message = |&k: &u64| (k * 100_000_000, json!({ "v": k }).to_string().into_bytes());
        guest.messages = times.iter().map(message).collect();
        guest
    };
    let channels = [json("/imu", &[4, 2, 0, 5, 1, 3]), json("/ref", &[0, 1, 2, 3, 4, 5])];
    let desk = Desk::new(&[("a.mcap", write(&channels, None))]);
    for align in ["exact", "nearest", "linear"] {
        let lines =
            desk.lines(&["trace", "a.mcap", "--topic", "/ref,/imu", "--field", "v", "--align", align]);
        let rows: Vec<Vec<f64>> = lines[1..]
            .iter()
            .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        assert_eq!(rows.len(), 6, "{align}");
        for (k, row) in (0..).zip(&rows) {
            assert_eq!(row[1..], [f64::from(k), f64::from(k)], "{align}");
        }
    }
}

#[test]
fn fields_of_json_that_come_late_are_named() {
    let mut messages: Vec<String> = (0..300).map(|i| json!({ "x": i }).to_string()).collect();
    messages[250] = json!({ "x": 250, "late": 1, "more": "text" }).to_string();
    let desk = Desk::new(&[("a.mcap", write(&[Guest::json("/j", None, &messages)], None))]);
    let (text, said) = desk.both(0, &["trace", "a.mcap"]);
    assert_eq!(text.lines().count(), 301);
    assert!(said.contains("/j.late, /j.more; `cat` shows them"), "{said}");
}

#[test]
fn messages_that_are_no_json_are_not_sound() {
    let messages = [r#"{"x":1}"#, r#"{"x":NaN}"#, ""].map(str::to_owned);
    let desk = Desk::new(&[("a.mcap", write(&[Guest::json("/j", None, &messages)], None))]);
    let report = desk.json(3, &["verify", "a.mcap", "--json"]);
    assert_eq!((&report["sound"], &report["undecoded"]), (&json!(false), &json!(2)));
}

#[test]
fn schemas_of_proto2_are_text_that_compilers_take() {
    let group = forge::type_of("Part", vec![forge::field("a", 1, Label::Optional, Type::Int32, None)]);
    let mut fields = vec![
        forge::field("id", 1, Label::Required, Type::Int32, None),
        forge::field("s", 2, Label::Optional, Type::String, None),
        forge::field("part", 3, Label::Repeated, Type::Group, Some(".Rec.Part")),
        forge::field("packed", 4, Label::Repeated, Type::Int32, None),
        forge::field("mode", 5, Label::Optional, Type::Enum, Some(".Mode")),
    ];
    fields[1].default_value = Some("a \"text\"".into());
    fields[3].options = Some(FieldOptions { packed: Some(true), ..Default::default() });
    let one = |field: FieldDescriptorProto| FieldDescriptorProto { oneof_index: Some(0), ..field };
    fields.push(one(forge::field("left", 6, Label::Optional, Type::Int32, None)));
    fields.push(one(forge::field("right", 7, Label::Optional, Type::Double, None)));
    let message = DescriptorProto {
        nested_type: vec![group],
        oneof_decl: vec![OneofDescriptorProto { name: Some("side".into()), options: None }],
        extension_range: vec![ExtensionRange { start: Some(100), end: Some(201), options: None }],
        ..forge::type_of("Rec", fields)
    };
    let mut file = forge::types("", "", ("Mode", ["OFF", "ON"]));
    file.syntax = Some("proto2".into());
    file.package = None;
    file.message_type = vec![message];
    let modes = &mut file.enum_type[0];
    modes.value[1].number = Some(0);
    modes.options = Some(EnumOptions { allow_alias: Some(true), ..Default::default() });
    let mut pool = DescriptorPool::new();
    pool.add_file_descriptor_proto(file).expect("sound types");
    let set = pool.encode_to_vec();
    let records = [
        raw::schema(1, "Rec", &set),
        raw::channel(1, 1, "/rec", &raw::map(&[])),
        raw::message(1, &raw::whole_number(1, 7)),
    ];
    let desk = Desk::new(&[("a.mcap", raw::file(&records))]);
    let text = desk.text(0, &["schema", "a.mcap"]);
    let expected = "\
message Rec {
  required int32 id = 1;
  optional string s = 2 [default = \"a \\\"text\\\"\"];
  repeated group Part = 3 {
    optional int32 a = 1;
  }
  repeated int32 packed = 4 [packed = true];
  optional Mode mode = 5;
  oneof side {
    int32 left = 6;
    double right = 7;
  }
  extensions 100 to 200;
}

enum Mode {
  option allow_alias = true;
  OFF = 0;
  ON = 0;
}
";
    assert!(text.contains(expected), "{text}");
}
