//! Hostile values: times, axes, JSON, texts, metadata of percuss, images.

use super::{
    Case,
    records::{many, timed},
    types::{lab, lab_channel, typed_channel},
};
use crate::raw::{
    Counts, attachment, block, channel, channel_of, compressed, double, first_offset, indexed, map,
    message_at, metadata, metadata_index, record, statistics, text, whole, whole_number,
};

pub const CASES: &[Case] = &[
    ("messages that all have one time", || of_times(20_000, |_| 0)),
    ("times that go backwards", || of_times(5000, |i| u64::from(10_000 - i) * 1_000_000)),
    ("times at the end of time", || of_times(50, |i| u64::MAX - u64::from(i))),
    ("times 2^63 ns apart", || of_times(9, |i| u64::from(i % 2) << 63 | u64::from(i))),
    ("times from start to end", || of_times(50, |i| if i == 49 { u64::MAX } else { u64::from(i) })),
    ("fields of time that are no times", || {
        let times = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e308, -1e308, 0.0, -0.0, 5e-324];
        let one =
            |i: u32| message_at(1 + (i % 2) as u16, i.into(), &scalar(times[i as usize % 8], f64::from(i)));
        of_two(many(800, one))
    }),
    ("fields of time all equal", || {
        let one = |i: u32| message_at(1 + (i % 2) as u16, i.into(), &scalar(1.0, f64::from(i)));
        of_two(many(40_000, one))
    }),
    ("depths that are not sound", || {
        let sound = vec![0.0, 1.0, 1.0, 2.0];
        let (unsound, unsorted) = (vec![0.0, f64::NAN, 1.0, 2.0], vec![0.0, 2.0, 1.0, 3.0]);
        let all = [sound, unsound, unsorted, vec![0.0; 3], vec![0.0; 5], vec![1e308; 4]];
        of_depths(&[&all.map(|depths| (depths, 4))[..], &[(vec![0.0; 4], 4000)]].concat())
    }),
    ("depths that all stand twice", || {
        let depths = |step: f64| (0..100_000).map(|i| f64::from(i / 2) * step).collect();
        of_depths(&[(depths(1.0), 100_000), (depths(1.5), 100_000), (vec![0.0; 1000], 1000)])
    }),
    ("values that are no numbers", || {
        let values = [f64::NAN, f64::INFINITY, -f64::INFINITY, f64::MAX, f64::MIN, 5e-324, -0.0];
        let one = |i: u32| message_at(1, u64::from(i) << 20, &scalar(f64::from(i), values[i as usize % 7]));
        of_lab("Scalar", "/drag", &[], many(700, one))
    }),
    ("axes that are no axes", || {
        let steps = [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-320, 1e308, -0.0];
        let one = |i: u32| {
            let (start, step) = (steps[i as usize / 7], steps[i as usize % 7]);
            let data = [double(3, start), double(4, step), block(5, &[0x3f; 8 * 20])].concat();
            message_at(1, u64::from(i) << 24, &data)
        };
        let axis = [("axis.p", "r0,dr"), ("unit.p", "Pa"), ("symmetry.p", "even")];
        of_lab("Profile", "/interface/stress", &axis, many(49, one))
    }),
    ("matrices of 10^12 values that are four", || {
        of_sizes(&[(1_000_000, 1_000_000, 4), (u32::MAX, u32::MAX, 1), (0, 0, 4)])
    }),
    ("matrices that are wide and high in turn", || of_sizes(&[(1, 200_000, 200_000), (200_000, 1, 200_000)])),
    ("matrices whose elements have no size", || {
        let odd = [1e-300, 1e300, f64::NAN, f64::INFINITY, 0.0];
        let one = |dr: &f64| odd.map(|dz| slice([*dr, dz], [2, 2], 4)).concat();
        of_slices(odd.iter().flat_map(one).collect())
    }),
    ("matrices of one row", || of_sizes(&[(400_000, 1, 400_000), (3, 2, 6)])),
    ("axes of a million points", || {
        of_axes(&[("axis.p", &("0,".repeat(300_000) + "0")), ("axis.r0", &";,".repeat(100_000))])
    }),
    ("axes of two million points", || of_axes(&[("axis.p", &("0,".repeat(2_000_000) + "0"))])),
    ("axes that name each other", || {
        of_axes(&[("axis.p", "p,p,p;p,p,p"), ("axis.r0", "axis.r0"), ("axis.", ",;,"), ("axis.dr", "p,dr")])
    }),
    ("JSON nested 10 000 deep", || {
        of_json("", &[&"[".repeat(10_000), &"{\"a\":".repeat(10_000), &nested(120), &nested(127)])
    }),
    ("JSON of very many keys", || {
        let keys: Vec<String> = (0..200_000).map(|i| format!("\"k{i}\":{i}")).collect();
        of_json("", &[&format!("{{{}}}", keys.join(",")), "{\"k1\":2}"])
    }),
    ("JSON of different keys in every message", || {
        let messages: Vec<String> = (0..150).map(|i| format!("{{{}}}", keys(i * 300, 300))).collect();
        of_json("", &messages.iter().map(String::as_str).collect::<Vec<_>>())
    }),
    ("JSON of keys that are all signs", || {
        let signs = [".", "[", "]", "@", ",", ";"];
        let sign = |i: usize, k: u32| signs[i / 6_usize.pow(k) % 6];
        let key = |i: usize| format!("\"{}\":1", (0..6).map(|k| sign(i, k)).collect::<String>());
        of_json("", &[&format!("{{{}}}", (0..9000).map(key).collect::<Vec<_>>().join(","))])
    }),
    ("JSON of numbers that are too large", || {
        let digits = "9".repeat(100_000);
        let numbers = [&digits, "1e999999999", "-1e-999999999", "18446744073709551616"];
        of_json("", &numbers.map(|number| format!("{{\"a\":{number}}}")).each_ref().map(String::as_str))
    }),
    ("JSON with keys twice", || {
        of_json("", &["{\"a\":1,\"a\":2}", "{\"a\":{\"b\":1,\"b\":[]}}", "{\"a\":1}"])
    }),
    ("JSON of one long text", || of_json("", &[&format!("{{\"a\":\"{}\"}}", "\\u0000".repeat(1_000_000))])),
    ("JSON of lists of lists", || {
        of_json("", &[&format!("{{\"a\":[{}[]]}}", "[[]],".repeat(200_000)), "{\"a\":[[[1]]]}"])
    }),
    ("JSON of half a million nulls", || {
        of_json("", &["{\"a\":[1]}", &format!("{{\"a\":[{}1]}}", "null,".repeat(500_000))])
    }),
    ("JSON that is none", || {
        of_json("not JSON", &["", "nul", "\u{0}", "{\"a\":NaN}", "{} {}", "\"\\ud800\""])
    }),
    ("a JSON schema nested 100 000 deep", || {
        of_json(&format!("{}{{}}{}", "{\"items\":".repeat(100_000), "}".repeat(100_000)), &["{\"a\":1}"])
    }),
    ("a JSON schema in circles", || {
        let inner = r##""a":{"$ref":"#/$defs/A"},"b":{"$ref":"#/$defs/A"},"c":{"$ref":"#"}"##;
        let schema = format!(
            "{{\"type\":\"object\",\"properties\":{{{inner}}},\"$defs\":{{\"A\":{{\"type\":\"object\",\"properties\":{{{inner}}}}}}}}}"
        );
        of_json(&schema, &["{\"a\":{}}"])
    }),
    ("a JSON schema that doubles", || {
        let level = |i: usize| {
            format!("\"L{i}\":{{\"allOf\":[{{\"$ref\":\"#/L{0}\"}},{{\"$ref\":\"#/L{0}\"}}]}}", i + 1)
        };
        let levels: Vec<String> = (0..40).map(level).collect();
        of_json(&format!("{{\"$ref\":\"#/L0\",{}}}", levels.join(",")), &["{}"])
    }),
    ("a JSON schema of very many references", || {
        let uses = |i: usize| format!("\"k{i}\":{{\"$ref\":\"#/d/k{}\"}}", 2999 - i);
        let defined = |i: usize| format!("\"k{i}\":{{\"type\":\"number\"}}");
        let list = |one: &dyn Fn(usize) -> String| (0..3000).map(one).collect::<Vec<_>>().join(",");
        of_json(
            &format!("{{\"properties\":{{{}}},\"d\":{{{}}}}}", list(&uses), list(&defined)),
            &["{\"k1\":1}"],
        )
    }),
    ("a JSON schema of a large part used again and again", || {
        let part: Vec<String> = (0..3000).map(|i| format!("\"x{i}\":0")).collect();
        let uses: Vec<String> = (0..2500).map(|i| format!("\"k{i}\":{{\"$ref\":\"#/d\"}}")).collect();
        of_json(
            &format!("{{\"properties\":{{{}}},\"d\":{{{}}}}}", uses.join(","), part.join(",")),
            &["{\"k1\":1}"],
        )
    }),
    ("units that command a terminal", || {
        let wicked = "\u{1b}[2J\u{9b}1m\u{202e}\r\u{7}";
        let entries = map(&[("unit.force", wicked), ("meaning.force", wicked), ("unit.time", wicked)]);
        let message = message_at(1, 0, &scalar(0.0, 1.0));
        let definitions = lab_channel("Scalar", wicked, &entries);
        whole(&[definitions, metadata(wicked, &[(wicked, wicked)]), message], &[])
    }),
    ("units of 70 000 letters", || {
        let long = "x".repeat(70_000);
        let entries = [("unit.force", &*long), ("unit.time", &long), (&format!("unit.{long}"), "")];
        of_lab("Scalar", &long, &entries, message_at(1, 0, &scalar(0.0, 1.0)))
    }),
    ("scales of percuss that are none", || {
        of_percuss(
            &[
                ("scale.length_m", "NaN"),
                ("scale.time_s", "0"),
                ("scale.force_n", "1e308"),
                ("scale.stress_pa", "-1"),
                ("scale.energy_j", "1e-320"),
                ("playback_rate", "1e-308"),
                ("dt", "0"),
                ("steps", "18446744073709551616"),
            ],
            b"title = 1",
        )
    }),
    ("a playback rate of nothing", || of_percuss(&[("playback_rate", "0"), ("scale.time_s", "inf")], b"")),
    ("a playback rate without end", || of_percuss(&[("playback_rate", "inf"), ("title", "\u{1b}[2J")], b"")),
    ("very many records of percuss", || {
        let one = |i: u32| metadata("percuss.run", &[("title", &format!("{i}")), ("format_version", "2.0")]);
        whole(&[many(10_000, one)], &[])
    }),
    ("a record of percuss that the index lists again and again", || {
        let run = metadata("percuss.run", &[("title", &"t".repeat(60_000))]);
        let index = many(2000, |_| metadata_index(first_offset(), run.len() as u64, "percuss.run"));
        whole(&[run], &[index, statistics(&Counts { metadata: 2000, ..Counts::default() })].concat())
    }),
    ("a page that is to be left", || {
        of_percuss(
            &[
                ("title", "</title></script><script>alert(1)</script>"),
                ("</script><script>alert(1)</script>", "<!--<script>"),
            ],
            b"title = \"</script><script>alert(1)</script>\"",
        )
    }),
    ("a case of long keys", || {
        let keys: String = (0..40_000).map(|i| format!("k{i}=1\n")).collect();
        of_percuss(&[], format!("[{}]\n{keys}", "k".repeat(400_000)).as_bytes())
    }),
    ("a case nested without end", || of_percuss(&[], format!("a = {}", "[".repeat(500_000)).as_bytes())),
    ("a case of dots", || of_percuss(&[], format!("{}a = 1", "a.".repeat(300_000)).as_bytes())),
    ("a case of very many tables", || {
        of_percuss(&[], (0..60_000).map(|i| format!("[a.b{i}]\n")).collect::<String>().as_bytes())
    }),
    ("a case of very many values", || of_percuss(&[], format!("a = [{}1]", "1,".repeat(500_000)).as_bytes())),
    ("very many events", || {
        let one =
            |i: u32| message_at(1, u64::from(i) << 16, &block(3, "warning: \u{1b}[2J".repeat(50).as_bytes()));
        let run = metadata("percuss.run", &[("format_version", "2.0")]);
        whole(&[run, lab_channel("Note", "/event", &[]), compressed(&[many(20_000, one)])], &[])
    }),
    ("compressed images that are none", || {
        let data = [&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], &[0xff; 8], &[16, 6, 0, 0, 0]].concat();
        let image = [block(2, &data), block(3, b"png")].concat();
        let jpeg = [block(2, &[0xff, 0xd8, 0xff, 0xc0, 0, 17, 8, 0xff, 0xff, 0xff, 0xff]), block(3, b"jpeg")]
            .concat();
        let camera = typed_channel("Image stamp:double data:bytes format:string", "/camera", &[]);
        whole(&[camera, message_at(1, 0, &image), message_at(1, 1, &jpeg)], &[])
    }),
];

fn scalar(time: f64, force: f64) -> Vec<u8> {
    [double(2, time), double(3, force)].concat()
}

/// Messages of a type of the tests.
fn of_lab(name: &str, topic: &str, metadata: &[(&str, &str)], messages: Vec<u8>) -> Vec<u8> {
    whole(&[lab_channel(name, topic, &map(metadata)), compressed(&[messages])], &[])
}

/// Numbers of two topics.
fn of_two(messages: Vec<u8>) -> Vec<u8> {
    whole(&[lab_channel("Scalar", "/a", &[]), channel(2, 1, "/b", &[]), compressed(&[messages])], &[])
}

/// Messages of three topics, with an index.
///
/// * `time`: of a message by its number \[ns\]
fn of_times(count: u32, time: impl Fn(u32) -> u64) -> Vec<u8> {
    let definitions =
        [vec![lab(1, "Place")], (1..=3).map(|id| channel(id, 1, &format!("/{id}"), &[])).collect()].concat();
    let content =
        many(count, |i| (1..=3).flat_map(|id| message_at(id, time(i), &double(1, f64::from(i)))).collect());
    let span = (0..count).map(&time).fold((u64::MAX, 0), |(low, high), at| (low.min(at), high.max(at)));
    indexed(&definitions, &[(content, span)], |_, counts| {
        counts.messages = 3 * u64::from(count);
        counts.of_channels = (1..=3).map(|id| (id, count.into())).collect();
    })
}

/// A matrix by its steps and numbers of columns and rows, with so many values.
fn slice([dr, dz]: [f64; 2], [nr, nz]: [u32; 2], length: usize) -> Vec<u8> {
    let steps = [double(4, dr), double(7, dz), whole_number(5, nr.into()), whole_number(8, nz.into())];
    message_at(1, 0, &[steps.concat(), block(9, &1_f32.to_le_bytes().repeat(length))].concat())
}

/// Matrices of one column with these depths and values for so many rows, and profiles of as many.
fn of_depths(messages: &[(Vec<f64>, u32)]) -> Vec<u8> {
    let types = "Depths r0:double dr:double z0:double dz:double nr:uint32 nz:uint32 values:[float] \
                 line:[double] z:[double]";
    let axes = map(&[("axis.values", "z0,dz,nz,z;r0,dr,nr"), ("axis.line", "z0,dz,z")]);
    let layers = [("layers", "1000000000"), ("layer.1.top", "nan"), ("layer.1.bottom", "1e999")];
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let message = |(i, (depths, rows)): (u64, &(Vec<f64>, u32))| {
        let steps = [double(2, 0.1), double(4, 0.1), whole_number(5, 1), whole_number(6, u64::from(*rows))];
        let values = block(7, &1_f32.to_le_bytes().repeat(*rows as usize));
        let line = block(8, &2_f64.to_le_bytes().repeat(*rows as usize));
        message_at(1, i << 20, &[steps.concat(), values, line, block(9, &bytes(depths))].concat())
    };
    let messages = (0..).zip(messages).flat_map(message).collect();
    let definitions = typed_channel(types, "/field/stress", &axes);
    whole(&[metadata("percuss.run", &layers), definitions, compressed(&[messages])], &[])
}

fn of_slices(messages: Vec<u8>) -> Vec<u8> {
    let axis = map(&[("axis.values", "z0,dz,nz;r0,dr,nr")]);
    let run = metadata("percuss.run", &[("format_version", "2.0")]);
    whole(&[run, lab_channel("Slice", "/field/stress", &axis), compressed(&[messages])], &[])
}

/// Matrices by their numbers of rows, of columns and of values.
fn of_sizes(slices: &[(u32, u32, usize)]) -> Vec<u8> {
    of_slices(slices.iter().flat_map(|&(nz, nr, length)| slice([0.1, 0.1], [nr, nz], length)).collect())
}

/// A profile of 20 elements whose channel says this of its axes.
fn of_axes(axes: &[(&str, &str)]) -> Vec<u8> {
    of_lab("Profile", "/a", axes, message_at(1, 0, &block(5, &[0; 160])))
}

fn nested(depth: usize) -> String {
    format!("{}1{}", "{\"a\":".repeat(depth), "}".repeat(depth))
}

fn keys(from: usize, count: usize) -> String {
    (from..from + count).map(|i| format!("\"k{i}\":[{i}]")).collect::<Vec<_>>().join(",")
}

fn of_json(schema: &str, messages: &[&str]) -> Vec<u8> {
    let schema = [&[1, 0][..], &text(b"J"), &text(b"jsonschema"), &text(schema.as_bytes())].concat();
    let messages = (0..).zip(messages).flat_map(|(i, json)| message_at(1, i, json.as_bytes())).collect();
    let channel = channel_of(1, 1, "/json", "json", &[]);
    whole(&[record(0x03, &schema), channel, compressed(&[messages])], &[])
}

/// A recording of percuss with a drag, and with its case.
fn of_percuss(run: &[(&str, &str)], case: &[u8]) -> Vec<u8> {
    let drag = many(200, |i| message_at(1, u64::from(i) << 20, &scalar(f64::from(i), 1.0)));
    let records = [
        metadata("percuss.run", &[&[("format_version", "2.0")], run].concat()),
        metadata("percuss.status", run),
        metadata("percuss.validity", &[("largest_strain", "NaN"), ("largest_strain.r", "1e999")]),
        metadata("percuss.summary", &[("peak_force", "NaN"), ("impulse", "1e999"), ("t_ext", "\n")]),
        attachment("case.resolved.toml", case),
        attachment("case.toml", case),
        lab_channel("Scalar", "/drag", &map(&[("unit.force", "πR²γc_p²"), ("unit.time", "R/c_p")])),
        timed((0, 199 << 20), &drag),
    ];
    whole(&records, &[])
}
