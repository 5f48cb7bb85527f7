//! Recordings of other programs: what `info`, `trace` and `plot` say of them without being asked for anything.

use mcap::Compression;
use serde_json::{Value, json};

use crate::{
    desk::Desk,
    guests::{Guest, START, STEP, types, write},
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
fn raw_images_come_out_as_png() {
    let pool = types(
        "RawImage timestamp:google.protobuf.Timestamp width:uint32 height:uint32 encoding:string step:uint32 data:bytes",
    );
    // two rows of a blue and a red pixel, the second the other way round, with a byte between them
    let image = json!({"timestamp": stamp(0), "width": 2, "height": 2, "encoding": "bgr8", "step": 7,
        "data": "/wAAAAD/AAAA//8AAA=="});
    let short = json!({"width": 2, "height": 2, "encoding": "rgb8", "step": 6, "data": "AAAA"});
    let desk = desk(&[Guest::protobuf("/raw", &pool, "RawImage", &[image, short])]);
    let (info, trace, plot) = shown(&desk);
    holds(&info, &["guest.RawImage", "width, height, encoding, step"]);
    assert_eq!(trace[1], "0.0,1700000000,0,2,2,bgr8,7");
    holds(&plot, &["width"]);
    let export = ["export", "a.mcap", "--topic", "/raw", "-o", "raw.png", "--at-time"];
    desk.text(0, &[&export[..], &["0"]].concat());
    let file = std::fs::File::open(desk.path("raw.png")).expect("an image");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a sound image");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small image")];
    reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!(pixels, [0, 0, 255, 255, 0, 0, 255, 0, 0, 0, 0, 255]);
    holds(
        &desk.error(1, &[&export[..6], &["--force", "--at-time", "0.1"]].concat()),
        &["2 by 2 pixels with 6 bytes a row"],
    );
}
