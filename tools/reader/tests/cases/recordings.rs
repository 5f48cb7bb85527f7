//! Files of the tables: `NAME = HOW`, with lines below it.
//!
//! * `text`: the lines themselves; `text N`: the first, and the second N times with sums of `i`
//! * `forge STEPS SEED`: a recording of `forge::forge`, changed line by line
//! * `lab`: a recording of protobuf messages of the package `lab`, 10 ms from one to the next
//! * `foreign COMPRESSION`: one of protobuf (package `guest`) or JSON messages by another program, in the order of the lines, from
//!   2023-11-14T22:13:20Z on every 0.1 s
//! * `FILE`: the same as another one of the three above, changed line by line
//! * `run CASE SETTING…`: a simulation of a built-in case
//! * `si FILE [WRONG]`: its twin in SI units; the scale WRONG is off by 1e-6, or all are missing if it is `bare`
//! * `cut FILE N`, `cut FILE A/B`: without the last N bytes, or the first A of B parts
//! * `spoil FILE TEXT N`: with another bit N bytes behind a text
//! * `blank FILE A B`: with zeros from A to B per cent
//! * `hex`: the bytes of the lines
//! * `copy FILE`, `folder`, `link TARGET`, `pipe`, `socket`
//!
//! The lines of recordings are
//!
//! * `type NAME FIELD:TYPE…`, first of all
//! * `/TOPIC TYPE [at NANOSECONDS] [* COUNT] CONTENT`: messages, with sums as `sums::filled` has them; TYPE is `json` or the name of
//!   a JSON schema for messages in JSON; CONTENT is JSON or, behind `wire`, what stands in the bytes, as in `1=5 2=0.5 3"text" 4{1=2}`
//! * `schema NAME TEXT`: of JSON messages, or behind `wire` a descriptor of protobuf messages
//! * `meta TOPIC KEY=VALUE…`, `record NAME KEY=VALUE…`, `attach NAME TEXT`: metadata of a channel and of the file, attachments
//! * `set TOPIC[MESSAGE] FIELD[ELEMENT] = SUM`: of one message or all, one element or all, `FIELD[N*]` for a list of N elements; the
//!   sum knows the old value `x`, the number of the message `k`, of the element `j`, and the time `t`; or a text in quotes
//! * `only TOPIC…`, `topic OLD NEW`, `double OLD NEW`, `keep TOPIC COUNT`, `remove TOPIC[MESSAGE]`: what channels there are
//! * `times /TOPIC COUNT TIME X`: a channel of numbers x that knows no time but its log time, sums of `k`
//! * `later NANOSECONDS`, `delay TOPIC[MESSAGE] NANOSECONDS`: all times, or log times of one topic
//! * `field TYPE OLD NEW`: another name, none for `-`; `field TYPE + NAME:TYPE NUMBER` for one more
//! * `value ENUM OLD NEW`: another name of a value
//! * `write OPTION…`: how the file is written

use std::{
    collections::HashMap,
    fs,
    os::unix::{fs::symlink, net::UnixListener},
    process::Command,
};

use mcap::{Compression, WriteOptions};
use prost_reflect::{
    DynamicMessage, Kind, Value,
    prost_types::field_descriptor_proto::{Label, Type},
};

use super::{sums, words};
use crate::{
    desk::Desk,
    forge::{self, Channel, Forged},
    raw::{self, Foreign},
};

/// Makes files in the folder of an entry.
pub struct Maker<'a> {
    desk: &'a Desk,
    /// Recordings that others may be based on.
    forged: HashMap<String, (Forged, WriteOptions)>,
}

/// A name and what stands in brackets behind it.
fn indexed(text: &str) -> (&str, Option<&str>) {
    text.strip_suffix(']')
        .and_then(|text| text.split_once('['))
        .map_or((text, None), |(name, index)| (name, Some(index)))
}

fn number<T: std::str::FromStr>(text: &str) -> T {
    text.parse().unwrap_or_else(|_| panic!("`{text}` is no number"))
}

/// Entries `KEY=VALUE`.
fn entries(words: &[String]) -> impl Iterator<Item = (String, String)> {
    words
        .iter()
        .map(|word| word.split_once('=').expect("KEY=VALUE"))
        .map(|(key, value)| (key.into(), value.into()))
}

/// What stands in the bytes of a protobuf message.
fn wire(text: &mut &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    loop {
        *text = text.trim_start();
        let Some(end) = text.find(['=', '"', '{']).filter(|_| !text.starts_with('}')) else {
            *text = text.strip_prefix('}').unwrap_or(text);
            return bytes;
        };
        let field = number(&text[..end]);
        let sign = text.as_bytes()[end];
        *text = &text[end + 1..];
        bytes.extend(match sign {
            b'{' => raw::block(field, &wire(text)),
            b'"' => {
                let is_end = |&(i, _): &(usize, &str)| !text[..i].ends_with('\\');
                let (end, _) = text.match_indices('"').find(is_end).expect("a text ends");
                let content = text[..end].replace("\\\"", "\"");
                *text = &text[end + 1..];
                raw::block(field, content.as_bytes())
            }
            _ => {
                let end = text.find([' ', '}']).unwrap_or(text.len());
                let (value, rest) = text.split_at(end);
                *text = rest;
                let is_whole = value.parse::<i128>().is_ok();
                if is_whole {
                    raw::whole_number(field, number::<i128>(value) as u64)
                } else {
                    raw::double(field, number(value))
                }
            }
        });
    }
}

/// A line of messages: topic, type, log time, number, content.
fn messages(line: &str) -> (&str, &str, Option<&str>, u64, &str) {
    let (topic, rest) = line.split_once(' ').expect("a type");
    let (kind, mut rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let (mut at, mut count) = (None, 1);
    if let Some(more) = rest.strip_prefix("at ") {
        let (time, more) = more.split_once(' ').expect("a content");
        (at, rest) = (Some(time), more);
    }
    if let Some(more) = rest.strip_prefix("* ") {
        let (times, more) = more.split_once(' ').expect("a content");
        (count, rest) = (number(times), more);
    }
    (topic, kind, at, count, rest)
}

/// A whole number, or a sum of the number of a message.
fn nanoseconds(text: &str, i: u64) -> u64 {
    text.parse().unwrap_or_else(|_| sums::value(text, &|name| (name == "i").then_some(i as f64)) as u64)
}

/// A number as a value of a type.
fn value_of(kind: &Kind, x: f64) -> Value {
    match kind {
        Kind::Double => Value::F64(x),
        Kind::Float => Value::F32(x as f32),
        Kind::Int32 | Kind::Sint32 | Kind::Sfixed32 => Value::I32(x as i32),
        Kind::Int64 | Kind::Sint64 | Kind::Sfixed64 => Value::I64(x as i64),
        Kind::Uint32 | Kind::Fixed32 => Value::U32(x as u32),
        Kind::Uint64 | Kind::Fixed64 => Value::U64(x as u64),
        Kind::Bool => Value::Bool(x != 0.0),
        Kind::Enum(_) => Value::EnumNumber(x as i32),
        other => panic!("{other:?} is no number"),
    }
}

fn number_of(value: &Value) -> f64 {
    match value {
        Value::Bool(flag) => f64::from(*flag),
        Value::F32(x) => f64::from(*x),
        Value::I32(x) => f64::from(*x),
        Value::U32(x) => f64::from(*x),
        value => {
            let whole = || value.as_i64().map(|x| x as f64).or(value.as_u64().map(|x| x as f64));
            value.as_f64().or_else(whole).unwrap_or(0.0)
        }
    }
}

/// Sets a field of message `k`.
fn set(message: &mut DynamicMessage, k: usize, field: &str, sum: &str) {
    let (name, index) = indexed(field);
    let descriptor = {
        use prost_reflect::ReflectMessage;
        message.descriptor().get_field_by_name(name).expect("a field")
    };
    let t = message.get_field_by_name("time").map_or(0.0, |time| number_of(&time));
    let old = message.get_field(&descriptor).into_owned();
    let value = |j: usize, x: f64| {
        match descriptor.kind() {
            Kind::String => return Value::String(sum.trim_matches('"').into()),
            Kind::Message(kind) => {
                let content = serde_json::from_str(sum).expect("JSON");
                return Value::Message(forge::message(kind.parent_pool(), kind.name(), &content));
            }
            _ => {}
        }
        let names = |name: &str| match name {
            "x" => Some(x),
            "k" => Some(k as f64),
            "j" => Some(j as f64),
            "t" => Some(t),
            _ => None,
        };
        value_of(&descriptor.kind(), sums::value(sum, &names))
    };
    let new = match (old, index) {
        (Value::List(_), Some(count)) if count.ends_with('*') => {
            let count = sums::value(&count[..count.len() - 1], &|name| (name == "k").then_some(k as f64));
            Value::List((0..count as usize).map(|j| value(j, 0.0)).collect())
        }
        (Value::List(old), index) => {
            let index = index.map(number::<usize>);
            let is_chosen = |j: usize| index.is_none_or(|index| index == j);
            let element =
                |(j, old): (usize, Value)| if is_chosen(j) { value(j, number_of(&old)) } else { old };
            Value::List(old.into_iter().enumerate().map(element).collect())
        }
        (old, _) => value(0, number_of(&old)),
    };
    message.set_field(&descriptor, new);
}

/// Changes a recording as a line says.
pub fn change(recording: &mut Forged, line: &str) {
    if line.starts_with('/') {
        return add(recording, line);
    }
    let words = words(line);
    let word = |i: usize| words[i].as_str();
    let (name, index) = indexed(word(1));
    let chosen = |k: usize| index.is_none_or(|index| number::<usize>(index) == k);
    match word(0) {
        "set" => {
            let (place, sum) = line.split_once(" = ").expect("a sum");
            let field = place.rsplit(' ').next().unwrap_or_default();
            let messages = recording.channel(name).messages.iter_mut().enumerate();
            messages.filter(|(k, _)| chosen(*k)).for_each(|(k, (_, message))| set(message, k, field, sum));
        }
        "meta" => recording.channel(name).metadata.extend(entries(&words[2..])),
        "record" => {
            if !recording.metadata.iter().any(|(known, _)| known == name) {
                recording.metadata.push((name.into(), forge::text_map(&[])));
            }
            let record = recording.metadata.iter_mut().find(|(known, _)| known == name).expect("the record");
            record.1.extend(entries(&words[2..]));
        }
        "attach" => {
            recording.attachments.retain(|(known, _)| known != name);
            recording.attachments.push((name.into(), word(2).replace("\\n", "\n").into_bytes()));
        }
        "only" => recording.channels.retain(|channel| words[1..].contains(&channel.topic)),
        "topic" => recording.channel(name).topic = word(2).into(),
        "double" => {
            let channel = Channel { topic: word(2).into(), ..recording.channel(name).clone() };
            recording.channels.push(channel);
        }
        "keep" => recording.channel(name).messages.truncate(number(word(2))),
        "remove" => drop(recording.channel(name).messages.remove(number(index.expect("a message")))),
        "times" => {
            let sum = |sum: &str, k: u64| sums::value(sum, &|name| (name == "k").then_some(k as f64));
            let message = |k| (sum(word(3), k) as u64, sum(word(4), k));
            recording.channels.push(forge::by_log_time(name, (0..number(word(2))).map(message)));
        }
        "later" => *recording = recording.clone().later(number(word(1))),
        "delay" => {
            let messages = recording.channel(name).messages.iter_mut().enumerate();
            messages.filter(|(k, _)| chosen(*k)).for_each(|(_, (at, _))| *at += number::<u64>(word(2)));
        }
        "field" => {
            let types = &mut recording.file.message_type;
            let fields =
                &mut types.iter_mut().find(|message| message.name() == name).expect("the type").field;
            match (word(2), word(3)) {
                ("+", field) => {
                    let (field, kind) = field.split_once(':').expect("a type");
                    let kind = Type::from_str_name(&format!("TYPE_{}", kind.to_uppercase())).expect("a type");
                    fields.push(forge::field(field, number(word(4)), Label::Optional, kind, None));
                }
                (old, "-") => fields.retain(|field| field.name() != old),
                (old, new) => {
                    let field = fields.iter_mut().find(|field| field.name() == old);
                    field.expect("the field").name = Some(new.into());
                }
            }
        }
        "value" => {
            let mut values = recording.file.enum_type.iter_mut().flat_map(|kind| &mut kind.value);
            values.find(|value| value.name() == word(2)).expect("the value").name = Some(word(3).into());
        }
        _ => panic!("no such change: {line}"),
    }
}

/// How a recording is written, with one more option.
fn option(options: &WriteOptions, word: &str) -> WriteOptions {
    let old = options.clone();
    match word {
        "zstd" => old.compression(Some(Compression::Zstd)),
        "unchunked" => old.use_chunks(false),
        "unchecked" => old.calculate_chunk_crcs(false).calculate_data_section_crc(false),
        "checked" => old.calculate_chunk_crcs(true),
        "checked-whole" => old.calculate_data_section_crc(true),
        size => old.chunk_size(Some(number(size))),
    }
}

/// Adds messages to a recording of the package `lab`.
fn add(recording: &mut Forged, line: &str) {
    let (topic, kind, at, count, content) = messages(line);
    let pool = forge::pool(&recording.file);
    if !recording.channels.iter().any(|channel| channel.topic == topic) {
        recording.channels.push(Channel::new(topic, kind.trim_matches('-'), &[], Vec::new()));
    }
    let channel = recording.channel(topic);
    for _ in (0..count).filter(|_| !content.is_empty()) {
        let i = channel.messages.len() as u64;
        let at = at.map_or(i * forge::STEP_NS, |at| nanoseconds(at, i));
        let content: serde_json::Value = serde_json::from_str(&sums::filled(content, i)).expect("JSON");
        channel.messages.push((at, forge::message(&pool, kind, &content)));
    }
}

/// A recording of another program.
fn foreign(compression: Option<&str>, body: &[String]) -> Vec<u8> {
    let rest =
        |sign: &'static str| body.iter().filter_map(move |line| line.strip_prefix(sign)).map(str::to_owned);
    let pool = raw::types(&rest("type ").collect::<Vec<_>>().join("\n"));
    let schema = |line: String| {
        let (name, text) = line.split_once(' ').expect("a schema");
        match text.strip_prefix("wire ") {
            Some(mut text) => (name.to_owned(), "protobuf", wire(&mut text)),
            None => (name.to_owned(), "jsonschema", text.as_bytes().to_vec()),
        }
    };
    let schemas: Vec<raw::Schema> = rest("schema ").map(schema).collect();
    let mut channels: Vec<Foreign> = Vec::new();
    for line in body.iter().filter(|line| line.starts_with('/')) {
        let (topic, kind, at, count, content) = messages(line);
        let place = channels.iter().position(|channel| channel.topic == topic && channel.kind == kind);
        let place = place.unwrap_or_else(|| {
            channels.push(Foreign::new(topic, kind, &pool, &schemas));
            channels.len() - 1
        });
        let channel = &mut channels[place];
        for _ in (0..count).filter(|_| !content.is_empty()) {
            let i = channel.messages.len() as u64;
            let at = at.map_or(raw::START + i * raw::STEP, |at| nanoseconds(at, i));
            let content = sums::filled(content, i);
            let bytes = match content.strip_prefix("wire") {
                Some(mut text) => wire(&mut text),
                None => channel.encoded(&pool, &content),
            };
            channel.messages.push((at, bytes));
        }
    }
    let compression = match compression {
        Some("zstd") => Some(Compression::Zstd),
        Some("lz4") => Some(Compression::Lz4),
        _ => None,
    };
    raw::foreign(&channels, compression)
}

impl<'a> Maker<'a> {
    pub fn new(desk: &'a Desk) -> Self {
        Self { desk, forged: HashMap::new() }
    }

    /// Makes the file of a line and those below it; nothing for a comment.
    pub fn make(&mut self, line: &str, body: &[String]) {
        if line.starts_with('#') {
            return;
        }
        let (name, how) = line.split_once(" = ").unwrap_or_else(|| panic!("no file, no command: {line}"));
        let how = words(how);
        let how: Vec<&str> = how.iter().map(String::as_str).collect();
        let path = self.desk.path(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).expect("a folder");
        }
        let bytes = match how[..] {
            ["text"] => body.iter().map(|line| format!("{line}\n")).collect::<String>().into_bytes(),
            ["text", count] => {
                let (head, line) = (format!("{}\n", body[0]), format!("{}\n", body[1]));
                let lines: String = (0..number(count)).map(|i| sums::filled(&line, i)).collect();
                (head + &lines).into_bytes()
            }
            ["foreign"] => foreign(None, body),
            ["foreign", compression] => foreign(Some(compression), body),
            ["run", case, ref settings @ ..] => return forge::record(case, settings, &path),
            ["si", of] => forge::in_si(&self.desk.bytes(of), |_, scale| Some(scale)),
            ["si", of, "bare"] => forge::in_si(&self.desk.bytes(of), |_, _| None),
            ["si", of, wrong] => forge::in_si(&self.desk.bytes(of), |key, scale| {
                Some(if key == wrong { scale * (1.0 + 1e-6) } else { scale })
            }),
            ["cut", of, part] => {
                let bytes = self.desk.bytes(of);
                let length = match part.split_once('/') {
                    Some((a, b)) => bytes.len() * number::<usize>(a) / number::<usize>(b),
                    None => bytes.len() - number::<usize>(part),
                };
                bytes[..length].to_vec()
            }
            // another bit so many bytes behind a text
            ["spoil", of, text, offset] => {
                let mut bytes = self.desk.bytes(of);
                let place =
                    bytes.windows(text.len()).position(|part| part == text.as_bytes()).expect("the text");
                bytes[place + number::<usize>(offset)] ^= 1;
                bytes
            }
            ["blank", of, from, to] => {
                let mut bytes = self.desk.bytes(of);
                let place = |percent: &str| bytes.len() * number::<usize>(percent) / 100;
                let (from, to) = (place(from), place(to));
                bytes[from..to].fill(0);
                bytes
            }
            ["hex"] => {
                let byte = |word: &str| u8::from_str_radix(word, 16).expect("a byte");
                body.iter().flat_map(|line| line.split(' ')).map(byte).collect()
            }
            ["copy", of] => self.desk.bytes(of),
            ["folder"] => return fs::create_dir_all(path).expect("a folder"),
            ["link", to] => return symlink(self.desk.path(to), path).expect("a link"),
            ["socket"] => return drop(UnixListener::bind(path).expect("a socket")),
            ["pipe"] => {
                let made = Command::new("mkfifo").arg(path).status().expect("mkfifo");
                return assert!(made.success(), "a pipe");
            }
            _ => {
                let (mut recording, mut options) = match how[..] {
                    ["forge", steps, seed] => (forge::forge(number(steps), number(seed)), forge::plain()),
                    ["lab"] => {
                        let types = body.iter().filter_map(|line| line.strip_prefix("type "));
                        let types = types.collect::<Vec<_>>().join("\n");
                        (Forged::new(forge::types("lab", &types, ("Kind", ["CALM", "LOUD"]))), forge::plain())
                    }
                    [other] => {
                        self.forged.get(other).unwrap_or_else(|| panic!("no recording `{other}`")).clone()
                    }
                    _ => panic!("no way to make a file: {line}"),
                };
                for line in body.iter().filter(|line| !line.starts_with("type ")) {
                    match line.strip_prefix("write ") {
                        Some(words) => words.split(' ').for_each(|word| options = option(&options, word)),
                        None => change(&mut recording, line),
                    }
                }
                let bytes = recording.write(options.clone());
                self.forged.insert(name.into(), (recording, options));
                bytes
            }
        };
        self.desk.put(name, bytes);
    }
}
