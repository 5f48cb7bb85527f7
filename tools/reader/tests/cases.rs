//! Commands and what they print, in tables: the text files of the folder `cases`.
//!
//! ```text
//! == NAME on BASE: what it is about
//! a.mcap = forge 60 1
//!   set /scalar[20] force = x + 1e-6
//! $ percuss-read info a.mcap | head 1
//! | a.mcap: complete
//! ```
//!
//! An entry is carried out line by line in a folder of its own, after the files of BASE, an entry before it, were made.
//! `FILE = …` makes a file (`recordings` describes the ways); lines below it that are indented belong to it. Below a command stand
//! its lines on standard output behind `|`, those on standard error behind `!`, and its exit status behind `=` if it is not 0. Words
//! between single quotes may hold spaces. The commands beside `percuss-read` are those of `said` and `seen`, what may follow `|` is in
//! `filtered`.
//!
//! `PERCUSS_BLESS=1 cargo test -p percuss-reader --test reader cases` writes what is said now, to be read before it is committed.

mod recordings;
mod sums;

use std::{
    env,
    fmt::Write,
    fs::{self, File},
    io::BufReader,
    path::{Path, PathBuf},
    process::Command,
};

use ndarray::ArrayD;
use ndarray_npy::{NpzReader, read_npy};

use crate::desk::Desk;
use recordings::Maker;
pub use recordings::change;

/// One test for each table.
macro_rules! tables {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            check(stringify!($name));
        })*

        const TABLES: &[&str] = &[$(stringify!($name)),*];
    };
}

tables! { diff elements export foreign folders layers parts plot summary tables trace units verify }

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases")
}

/// A line of an entry with what stands below it.
struct Step {
    line: String,
    /// Indented lines, that belong to a file.
    body: Vec<String>,
    /// What a command says.
    said: String,
}

struct Entry {
    head: String,
    steps: Vec<Step>,
}

impl Entry {
    fn parse(text: &str) -> Self {
        let mut lines = text.lines();
        let head = lines.next().unwrap_or_default().to_owned();
        let mut steps: Vec<Step> = Vec::new();
        for line in lines.filter(|line| !line.is_empty()) {
            match steps.last_mut() {
                Some(step) if line.starts_with("  ") => step.body.push(line[2..].to_owned()),
                Some(step) if line.starts_with(['|', '!', '=']) => step.said += &format!("{line}\n"),
                _ => steps.push(Step { line: line.to_owned(), body: Vec::new(), said: String::new() }),
            }
        }
        Self { head, steps }
    }

    fn name(&self) -> &str {
        self.head.split([' ', ':']).next().unwrap_or_default()
    }

    fn base(&self) -> Option<&str> {
        let (words, _) = self.head.split_once(':').unwrap_or((&self.head, ""));
        words.split_once(" on ").map(|(_, base)| base)
    }

    /// Makes the files that it is based on.
    fn prepare(&self, entries: &[Self], maker: &mut Maker) {
        if let Some(name) = self.base() {
            let base = entries.iter().find(|base| base.name() == name).expect("the base is in the table");
            base.prepare(entries, maker);
            base.make(maker);
        }
    }

    /// Makes its own files.
    fn make(&self, maker: &mut Maker) {
        let files = self.steps.iter().filter(|step| !step.line.starts_with("$ "));
        files.for_each(|step| maker.make(&step.line, &step.body));
    }

    /// The entry as the table has it if it says what it says now.
    fn now(&self, entries: &[Self]) -> Self {
        let desk = Desk::new(&[]);
        let mut maker = Maker::new(&desk);
        self.prepare(entries, &mut maker);
        let step = |Step { line, body, .. }: &Step| {
            let said = line.strip_prefix("$ ").map(|command| said(&desk, command));
            if said.is_none() {
                maker.make(line, body);
            }
            Step { line: line.clone(), body: body.clone(), said: said.unwrap_or_default() }
        };
        Self { head: self.head.clone(), steps: self.steps.iter().map(step).collect() }
    }

    fn text(&self) -> String {
        let mut text = format!("== {}\n", self.head);
        for Step { line, body, said } in &self.steps {
            let body: String = body.iter().map(|line| format!("  {line}\n")).collect();
            text += &format!("{line}\n{body}{said}");
        }
        text
    }
}

/// Words between spaces, or between single quotes.
pub fn words(line: &str) -> Vec<String> {
    let (mut words, mut is_quoted) = (vec![String::new()], false);
    for c in line.trim().chars() {
        match c {
            '\'' => is_quoted = !is_quoted,
            ' ' if !is_quoted => words.push(String::new()),
            c => words.last_mut().expect("a word").push(c),
        }
    }
    words
}

/// What a command prints, and its exit status, as it stands in a table.
fn said(desk: &Desk, line: &str) -> String {
    let mut parts = line.split(" | ");
    let command = words(parts.next().unwrap_or_default());
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    let (mut out, mut err, mut status) = (String::new(), String::new(), 0);
    match &command[..] {
        ["percuss-read", arguments @ ..] => (out, err, status) = ended(&mut desk.command(arguments), line),
        [set, "percuss-read", arguments @ ..] => {
            let (name, value) = set.split_once('=').expect("NAME=VALUE");
            (out, err, status) = ended(desk.command(arguments).env(name, value), line);
        }
        ["rm", name] => fs::remove_file(desk.path(name)).expect("a file to remove"),
        others => out = seen(desk, others),
    }
    for filter in parts {
        // of standard error instead
        match filter.strip_prefix("errors ") {
            Some(filter) => err = filtered(&err, filter),
            None => out = filtered(&out, filter),
        }
    }
    let mut text = String::new();
    for (sign, lines) in [('|', out), ('!', err)] {
        for line in lines.lines() {
            writeln!(text, "{}", format!("{sign} {}", masked(desk, line)).trim_end())
                .expect("a String grows");
        }
    }
    if status != 0 {
        writeln!(text, "= {status}").expect("a String grows");
    }
    text
}

/// Standard output, standard error and status of a program.
fn ended(program: &mut Command, line: &str) -> (String, String, i32) {
    let output = program.output().expect("the program starts");
    let [out, err] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("the program prints text"));
    (out, err, output.status.code().unwrap_or_else(|| panic!("{line}: {}", output.status)))
}

/// A line without what differs from day to day: folders, versions, numbers of errors, sizes of files that hold pages and pictures.
fn masked(desk: &Desk, line: &str) -> String {
    let line = line.replace(&*desk.path("").to_string_lossy(), "FOLDER/");
    let mut line = line.replace(concat!(" ", env!("CARGO_PKG_VERSION")), " VERSION");
    if let Some((start, number)) = line.split_once(" (os error ") {
        line = format!(
            "{start}{}",
            number.trim_start_matches(|c: char| c.is_ascii_digit()).replacen(')', "", 1)
        );
    }
    let words: Vec<&str> = line.split(' ').collect();
    let is_size = |i: usize| words.get(i + 1) == Some(&"MB") && words[i].parse::<f64>().is_ok();
    let words = words.iter().enumerate().map(|(i, word)| if is_size(i) { "SIZE" } else { word });
    words.collect::<Vec<_>>().join(" ")
}

/// What is seen of the files of a folder.
fn seen(desk: &Desk, command: &[&str]) -> String {
    let path = |name: &str| desk.path(name);
    let names = || {
        let mut names = Vec::new();
        list(&path(""), "", &mut names);
        names.sort();
        names
    };
    match command {
        // the text of a file
        ["show", name] => String::from_utf8_lossy(&desk.bytes(name)).into_owned(),
        // the arrays of a file; of those with three axes one slab
        ["arrays", name] => arrays(&path(name), 0),
        ["arrays", name, slab] => arrays(&path(name), slab.parse().expect("a number")),
        // the head and the arrays of a rectilinear grid
        ["grid", name] => grid(&desk.bytes(name)),
        // the first bytes of a file
        ["bytes", name] => {
            let bytes = desk.bytes(name);
            let shown: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            shown.join(" ")
        }
        // columns, rows and frames of a moving picture
        ["frames", name] => {
            let file = BufReader::new(File::open(path(name)).expect("a picture"));
            let mut picture = gif::DecodeOptions::new().read_info(file).expect("a GIF");
            let mut count = 0;
            while picture.next_frame_info().expect("a frame").is_some() {
                count += 1;
            }
            format!("{} x {}, {count} frames", picture.width(), picture.height())
        }
        ["larger", name, size] => (desk.bytes(name).len() > size.parse().expect("a size")).to_string(),
        ["same", a, b] => if desk.bytes(a) == desk.bytes(b) { "same" } else { "different" }.to_owned(),
        // the files whose names have this part
        ["ls", part] => {
            names().iter().filter(|name| name.contains(part)).map(|name| format!("{name}\n")).collect()
        }
        // the exit status of the comparison of every file of the folder with every file
        ["pairs", options @ ..] => {
            let status = |a: &str, b: &str| {
                let (text, said, status) = ended(&mut desk.command(&[&["diff", a, b], options].concat()), a);
                let is_right = match status {
                    0 => text.contains(": equal\n"),
                    1 => text.contains(": DIFFERENT\n"),
                    _ => text.contains(": NOT COMPARED\n") && said.contains("error: "),
                };
                assert!(is_right, "{a}, {b}, {options:?}: {status}\n{text}{said}");
                status.to_string()
            };
            let row = |a: &String| names().iter().map(|b| status(a, b)).collect::<Vec<_>>().join(" ");
            names().iter().map(|a| format!("{a}: {}\n", row(a))).collect()
        }
        _ => panic!("no such command: {command:?}"),
    }
}

/// All files of a folder by their names.
fn list(folder: &Path, before: &str, names: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry")) {
        let name = format!("{before}{}", entry.file_name().to_string_lossy());
        if entry.file_type().expect("a type").is_dir() {
            list(&entry.path(), &format!("{name}/"), names);
        } else {
            names.push(name);
        }
    }
}

/// A part of an output.
fn filtered(text: &str, filter: &str) -> String {
    let words = words(filter);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let lines: Vec<&str> = text.lines().collect();
    let number = |text: &str| text.parse::<usize>().expect("a number");
    match words[..] {
        ["head", count] => lines[..lines.len().min(number(count))].join("\n"),
        ["tail", count] => lines[lines.len().saturating_sub(number(count))..].join("\n"),
        // one line, from 1 on
        ["line", i] => lines[number(i) - 1].to_owned(),
        // their number
        ["lines"] => lines.len().to_string(),
        ["grep", part] => lines.into_iter().filter(|line| line.contains(part)).collect::<Vec<_>>().join("\n"),
        // how often a text is there
        ["count", part] => text.matches(part).count().to_string(),
        // the texts of arrays
        ["wide"] => {
            let chars: Vec<char> = text.chars().collect();
            let (mut words, mut word, mut i) = (Vec::new(), String::new(), 0);
            while i < chars.len() {
                if chars[i].is_ascii_graphic() && chars[i + 1..].starts_with(&['\0'; 3]) {
                    word.push(chars[i]);
                    i += 4;
                } else {
                    words.extend(Some(std::mem::take(&mut word)).filter(|word| !word.is_empty()));
                    i += 1;
                }
            }
            words.join("\n")
        }
        // texts of a picture, each once
        ["titles"] => {
            let titles =
                text.split("<title>").skip(1).filter_map(|rest| Some(rest.split_once("</title>")?.0));
            let mut titles: Vec<&str> = titles.collect();
            titles.sort_unstable();
            titles.dedup();
            titles.join("\n")
        }
        // a value of a document, or of the data in a page
        ["at", pointer] => {
            let data = text.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>"));
            let document: serde_json::Value =
                serde_json::from_str(data.map_or(text, |(data, _)| data)).expect("JSON");
            document.pointer(pointer).map_or("nothing".into(), ToString::to_string)
        }
        // numbers with a point, to so many digits
        ["digits", count] => rounded(text, number(count)),
        _ => panic!("no such filter: {filter}"),
    }
}

/// A text whose numbers with a point have so many digits.
fn rounded(text: &str, digits: usize) -> String {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | 'e' | '-');
    let mut result = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let end = rest[start..].find(|c| !is_number(c)).map_or(rest.len(), |length| start + length);
        let word = &rest[start..end];
        let short = word.parse::<f64>().ok().filter(|_| word.contains('.') && !word.ends_with('.'));
        let short = short.map(|number| format!("{number:.*e}", digits - 1).parse::<f64>().expect("a number"));
        result += &rest[..start];
        result += &short.map_or(word.to_owned(), |short| format!("{short:?}"));
        rest = &rest[end..];
    }
    result + rest
}

/// Names, types, shapes, first and last elements, and sums of the arrays of a file.
fn arrays(path: &Path, slab: usize) -> String {
    let shown = |kind: &str, shape: &[usize], mut elements: Vec<String>| {
        if let [_, rows, columns] = shape {
            elements = elements[slab * rows * columns..][..rows * columns].to_vec();
        }
        let sum: f64 = elements.iter().filter_map(|element| element.parse::<f64>().ok()).sum();
        let shown = match elements.len() {
            0..=9 => elements.join(" "),
            n => format!("{} … {}, sum {sum:?}", elements[..4].join(" "), elements[n - 4..].join(" ")),
        };
        format!("{kind} {shape:?}: {shown}")
    };
    // as the first of some types that can be read
    macro_rules! any {
        ($read:expr, $($kind:ident)*) => {{
            let mut text = None;
            $(if text.is_none() {
                let array: Option<ArrayD<$kind>> = $read.ok();
                let elements = |array: &ArrayD<$kind>| array.iter().map(|x| format!("{x:?}")).collect();
                text = array.map(|array| shown(stringify!($kind), array.shape(), elements(&array)));
            })*
            text.unwrap_or_else(|| "of another type".into())
        }};
    }
    if path.extension().is_some_and(|end| end == "npy") {
        return any!(read_npy(path), f64 f32 i64 u64 bool);
    }
    let mut archive = NpzReader::new(File::open(path).expect("a file")).expect("an archive");
    let mut names = archive.names().expect("names");
    names.sort();
    let line = |name: String| format!("{name}: {}\n", any!(archive.by_name(&name), f64 f32 i64 u64 bool));
    names.into_iter().map(line).collect()
}

/// The head of a rectilinear grid, and its arrays.
fn grid(bytes: &[u8]) -> String {
    let place = bytes.windows(3).position(|part| part == b">\n_").expect("the data") + 3;
    let head = String::from_utf8_lossy(&bytes[..place]).into_owned();
    let mut text = head.trim_end_matches('_').to_owned();
    for array in head.split("<DataArray ").skip(1) {
        let attribute = |name: &str| Some(array.split_once(&format!("{name}=\""))?.1.split_once('"')?.0);
        let Some(offset) = attribute("offset").and_then(|offset| offset.parse::<usize>().ok()) else {
            continue;
        };
        let word = |i: usize| bytes[place + offset + 8 * i..][..8].try_into().expect("eight bytes");
        let numbers = (1..=u64::from_le_bytes(word(0)) as usize / 8).map(|i| f64::from_le_bytes(word(i)));
        let numbers: Vec<String> = numbers.map(|number| number.to_string()).collect();
        writeln!(text, "{}: {}", attribute("Name").expect("a name"), numbers.join(" "))
            .expect("a String grows");
    }
    text
}

/// A folder with the files of an entry, for tests that look further into them.
pub fn desk(table: &str, name: &str) -> Desk {
    let entries = read(table).1;
    let entry = entries.iter().find(|entry| entry.name() == name).expect("the entry");
    let desk = Desk::new(&[]);
    let mut maker = Maker::new(&desk);
    entry.prepare(&entries, &mut maker);
    entry.make(&mut maker);
    desk
}

/// The comments above the entries of a table, and these.
fn read(table: &str) -> (String, Vec<Entry>) {
    let text = fs::read_to_string(folder().join(format!("{table}.txt"))).expect("a table");
    let text = format!("\n{text}");
    let mut parts = text.split("\n== ");
    let preface = parts.next().unwrap_or_default().trim_start().to_owned();
    (preface, parts.map(Entry::parse).collect())
}

/// Compares a table with what is said now.
fn check(table: &str) {
    let (preface, entries) = read(table);
    let now: Vec<Entry> = entries.iter().map(|entry| entry.now(&entries)).collect();
    if env::var_os("PERCUSS_BLESS").is_some() {
        let now: Vec<String> = now.iter().map(Entry::text).collect();
        let path = folder().join(format!("{table}.txt"));
        fs::write(path, preface + &now.join("\n")).expect("a table");
        return;
    }
    let mut differences = String::new();
    for (entry, now) in entries.iter().zip(&now) {
        for (step, now) in entry.steps.iter().zip(&now.steps).filter(|(step, now)| step.said != now.said) {
            let only = |text: &str, other: &str, sign| -> String {
                let own = text.lines().filter(|line| !other.lines().any(|other| other == *line));
                own.map(|line| format!("{sign} {line}\n")).collect()
            };
            let (less, more) = (only(&step.said, &now.said, '-'), only(&now.said, &step.said, '+'));
            let is_moved = less.is_empty() && more.is_empty();
            let order = if is_moved { "the same lines in another order or number\n" } else { "" };
            differences += &format!("\n== {}\n{}\n{less}{more}{order}", entry.name(), step.line);
        }
    }
    assert!(differences.is_empty(), "{table}.txt says otherwise:\n{differences}");
}

#[test]
fn every_table_is_checked_and_has_commands() {
    let files = fs::read_dir(folder()).expect("a folder").map(|entry| entry.expect("an entry").path());
    for path in files.filter(|path| path.extension().is_some_and(|end| end == "txt")) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        assert!(TABLES.contains(&name.as_str()), "{name}");
        for entry in read(&name).1 {
            let has_commands = entry.steps.iter().any(|step| step.line.starts_with("$ "));
            assert!(has_commands || entry.head.contains("base of others"), "{name}: {}", entry.head);
        }
    }
}
