//! The `percuss-read` program on a recording of another writer.

use std::{collections::BTreeSet, fs, process::Output};

use clap::{CommandFactory, error::ErrorKind};
use mcap::WriteOptions;
use serde_json::json;

use crate::{
    desk::Desk,
    forge::{Channel, Forged, message, pool, text_map, types},
};

/// A recording of 20 samples on `/lab`, and an empty channel of another encoding.
fn recording(options: WriteOptions) -> Vec<u8> {
    let sample = "Sample time:double load:float strain:[double] x0:double dx:double";
    let file = types("lab", sample, ("Unused", ["NONE", "SOME"]));
    let pool = pool(&file);
    let sample = |k: u64| {
        let strain: Vec<u64> = (0..3).map(|i| k * 10 + i).collect();
        let (time, load) = (k as f64 * 0.1, k as f32 * 0.1);
        let content = json!({"time": time, "load": load, "strain": strain, "x0": 0.5, "dx": 1.0});
        (k * 1_000_000, message(&pool, "Sample", &content))
    };
    let channel = |topic: &str, message: &str, metadata, messages| Channel {
        topic: topic.into(),
        message: message.into(),
        metadata,
        messages,
    };
    let metadata = text_map(&[("unit.load", "N"), ("unit.time", "s"), ("axis.strain", "x0,dx")]);
    let channels = vec![
        channel("/lab", "Sample", metadata, (0..20).map(sample).collect()),
        channel("/other", "", text_map(&[]), Vec::new()),
    ];
    let metadata = vec![("notes".into(), text_map(&[("who", "me")]))];
    Forged { file, channels, attachments: Vec::new(), metadata }.write(options)
}

fn lab_of(bytes: impl AsRef<[u8]>) -> Desk {
    Desk::new(&[("a.mcap", bytes.as_ref().to_vec())])
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn verify_says_what_has_no_checksum() {
    let bare = || WriteOptions::new().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    let verify = |kind| lab_of(recording(kind)).text(0, &["verify", "a.mcap"]);
    let remark = "remark: 20 of 20 messages have no checksum";
    for kind in [bare(), bare().use_chunks(false)] {
        let text = verify(kind);
        assert!(text.contains(remark), "{text}");
    }
    // that of the whole data section, or of every chunk, is enough
    for kind in [bare().use_chunks(false).calculate_data_section_crc(true), bare().calculate_chunk_crcs(true)]
    {
        let text = verify(kind);
        assert!(!text.contains("remark"), "{text}");
    }
}

#[test]
fn fields_positions_and_times_are_chosen() {
    let lab = lab_of(recording(WriteOptions::new()));
    let trace =
        |arguments: &[&str]| lab.lines(&[&["trace", "a.mcap", "--topic", "/lab"], arguments].concat());
    let rows = trace(&["--at", "x=0.5,1.25", "--from", "0.45", "--to", "1.05", "--every", "3"]);
    assert_eq!(rows[0], "time [s],load [N],strain@x=0.5,strain@x=1.25");
    // the last one stays
    assert_eq!(rows[1..], ["0.5,0.5,50.0,50.75", "0.8,0.8,80.0,80.75", "1.0,1.0,100.0,100.75"]);
    let all = trace(&[]);
    assert_eq!(all[0], "time [s],load [N],strain[0],strain[1],strain[2]");
    assert_eq!((all.len(), all[4].as_str()), (21, "0.30000000000000004,0.3,30.0,31.0,32.0"));
    let plain = trace(&["--field", "load"]);
    assert_eq!(trace(&["--field", "load", "--every", "1000"])[1..], [plain[1].clone(), plain[20].clone()]);
    assert_eq!(trace(&["--field", "load", "--every", "19"])[1..], [plain[1].clone(), plain[20].clone()]);
    let cat = lab.lines(&["cat", "a.mcap", "--topic", "/lab", "--every", "1000"]);
    assert!(cat.len() == 2 && cat[1].contains("\"load\":1.9"), "{cat:?}");
    assert_eq!(trace(&["--field", "strain[2],load"])[2], "0.1,12.0,0.1");
    let json = trace(&["--format", "jsonl", "--field", "load"]);
    assert_eq!(json[1], "{\"time\":0.1,\"load\":0.1}");
}

#[test]
fn output_files_are_kept_unless_forced() {
    let lab = lab_of(recording(WriteOptions::new()));
    let trace = |arguments: &[&str]| lab.read(&[&["trace", "a.mcap", "--topic", "/lab"], arguments].concat());
    assert!(trace(&["-o", "out.jsonl"]).status.success());
    let text = fs::read_to_string(lab.path("out.jsonl")).expect("the output");
    assert!(text.starts_with("{\"time\":0.0,"), "the name of the output chooses the format");
    assert_eq!(trace(&["-o", "out.jsonl"]).status.code(), Some(1));
    assert!(trace(&["-o", "out.jsonl", "--force"]).status.success());
    let before = lab.bytes("a.mcap");
    assert_eq!(trace(&["-o", "a.mcap", "--force"]).status.code(), Some(2));
    assert_eq!(lab.bytes("a.mcap"), before);
    // a request that fails leaves no file
    assert_eq!(trace(&["--field", "nothing", "-o", "none.csv"]).status.code(), Some(2));
    assert!(!lab.path("none.csv").exists());
}

#[test]
fn info_tells_what_is_there() {
    let lab = lab_of(recording(WriteOptions::new()));
    let output = lab.read(&["info", "a.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["version"], 2);
    assert_eq!(json["complete"], true);
    assert_eq!(json["percuss"], false);
    assert_eq!(json["library"], "another program");
    assert_eq!(json["messages"], 20);
    assert_eq!(json["end_ns"], 19_000_000);
    let channels = json["channels"].as_array().expect("a list");
    assert_eq!(channels[0]["metadata"]["unit.load"], "N");
    assert_eq!(channels[1]["decodable"], false);
    assert_eq!(json["metadata"][0]["entries"]["who"], "me");
    let text = lab.lines(&["info", "a.mcap"]).join("\n");
    for part in ["complete", "/lab", "lab.Sample", "load [N]", "who = me"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn damage_is_found_and_what_comes_before_is_read() {
    let bytes = recording(WriteOptions::new().chunk_size(Some(256)).compression(None));
    let whole = lab_of(&bytes).lines(&["trace", "a.mcap", "--topic", "/lab"]);
    // cut off: rows of whole chunks are there, and the loss is reported
    let lab = lab_of(&bytes[..bytes.len() / 2]);
    let output = lab.read(&["trace", "a.mcap", "--topic", "/lab"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let rows: Vec<String> = String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
    assert!(rows.len() > 2 && rows.len() < whole.len());
    assert_eq!(rows[..], whole[..rows.len()]);
    assert!(stderr(&output).contains("middle of a record"), "{}", stderr(&output));
    assert_eq!(lab.read(&["info", "a.mcap"]).status.code(), Some(3));

    // one bit flipped in a message: nothing of its chunk comes out
    let text = b"lab.Sample";
    let after_schema =
        bytes.windows(text.len()).position(|window| window == text).expect("the schema") + 1000;
    let mut spoiled = bytes.clone();
    spoiled[after_schema] ^= 1;
    let output = lab_of(spoiled).read(&["trace", "a.mcap", "--topic", "/lab"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("CRC"), "{}", stderr(&output));
    let rows = String::from_utf8_lossy(&output.stdout).lines().count();
    assert!(rows < whole.len());
}

#[test]
fn files_that_are_no_recordings() {
    let lab = lab_of(b"not a recording at all");
    for verb in ["info", "trace"] {
        let output = lab.read(&[verb, "a.mcap"]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("not an MCAP file"), "{}", stderr(&output));
        assert_eq!(lab.read(&[verb, "nowhere.mcap"]).status.code(), Some(1));
    }
    // a length of 2^62 is refused, not allocated
    let mut forged = mcap::MAGIC.to_vec();
    forged.push(0x01);
    forged.extend((1u64 << 62).to_le_bytes());
    lab.put("forged.mcap", forged);
    let output = lab.read(&["info", "forged.mcap"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("middle of a record of 4611686018427387904 bytes"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn mismatches_are_usage_errors() {
    let lab = lab_of(recording(WriteOptions::new()));
    for (arguments, expected) in [
        (&["--topic", "/none"] as &[&str], "/lab"),
        (&["--topic", "/lab", "--field", "stress"], "strain"),
        (&["--topic", "/other"], "json"),
    ] {
        let output = lab.read(&[&["trace", "a.mcap"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

/// Both programs, whose commands have their full names.
fn programs() -> [clap::Command; 2] {
    let mut programs = [percuss::cli::Arguments::command(), percuss_reader::cli::Arguments::command()];
    programs.iter_mut().for_each(clap::Command::build);
    programs
}

/// Help of both programs at 80 columns: no line is longer, every verb has examples, and no line of them is broken.
#[test]
fn help_fits_80_columns() {
    let shown = |command: &clap::Command| {
        let mut command = command.clone().term_width(80);
        let texts = [command.render_help().to_string(), command.render_long_help().to_string()];
        for line in texts.iter().flat_map(|text| text.lines()) {
            assert!(line.chars().count() <= 80, "{line}\n{}", texts[1]);
        }
        texts
    };
    for program in programs() {
        shown(&program);
        for verb in program.get_subcommands() {
            let [_, shown] = shown(verb);
            if verb.get_name() == "help" {
                continue;
            }
            let all = verb.get_after_help().map(ToString::to_string).unwrap_or_default();
            let examples =
                all.split_once("Examples:\n").map(|(_, rest)| rest.split("\n\n").next().unwrap_or(rest));
            let examples = examples.unwrap_or_else(|| panic!("`{}` has no examples", verb.get_name()));
            for line in examples.lines() {
                assert!(shown.lines().any(|shown| shown == line), "{line}\n{shown}");
            }
        }
    }
}

/// What is wrong with a number is said in words of the command line, not in those of the programming language.
#[test]
fn refused_numbers_say_what_is_expected() {
    const FOREIGN: [&str; 12] = [
        "digit",
        "float",
        "literal",
        "parse",
        "integer",
        "target type",
        "..",
        "u16",
        "u32",
        "u64",
        "f64",
        "usize",
    ];
    let refusal = |program: &clap::Command, verb: &clap::Command, option: &str, value: &str| {
        let words = [program.get_name(), verb.get_name(), &format!("--{option}={value}")].map(str::to_owned);
        let error = program.clone().try_get_matches_from(words).err();
        error.filter(|error| error.kind() == ErrorKind::ValueValidation).map(|error| error.to_string())
    };
    let programs = programs();
    let mut refused = BTreeSet::new();
    for program in &programs {
        for verb in program.get_subcommands() {
            let options = verb.get_arguments().filter(|argument| argument.get_action().takes_values());
            for option in options.filter_map(clap::Arg::get_long) {
                // beyond the largest whole number, below 0, no whole number, no number
                for value in ["x", "", "-1", "1.5", "1e400", "99999999999999999999"] {
                    if let Some(text) = refusal(program, verb, option, value) {
                        let text = text.lines().next().unwrap_or_default().replace(value, "");
                        assert!(
                            !FOREIGN.iter().any(|word| text.contains(word)),
                            "{} {text}",
                            verb.get_name()
                        );
                        refused.insert(option);
                    }
                }
            }
        }
    }
    for option in ["threads", "every", "refine", "lhs", "seed", "max-memory", "abs", "ulp", "wait", "speed"] {
        assert!(refused.contains(option), "{option}: {refused:?}");
    }
    let run = programs[0].find_subcommand("run").expect("a verb");
    let text = refusal(&programs[0], run, "threads", "x").expect("a refusal");
    assert!(text.starts_with(
        "error: invalid value 'x' for '--threads <N>': a whole number from 1 to 1024 is expected\n"
    ));
}
