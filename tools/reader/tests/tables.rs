//! Tables that the reader writes, read back and drawn: the same numbers from every format, and no harm from damaged ones.

use std::{
    fs,
    io::{self, Read},
    sync::Arc,
};

use parquet::{
    data_type::{DoubleType, Int32Type},
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::parser::parse_message_type,
};
use percuss_reader::{recording::Limits, tabular::read};
use percuss_table::{Cell, CellType, Heading, Sink, csv::Csv, parquet::Parquet};
use tempfile::TempDir;

use crate::{
    desk::Desk,
    forge::{Dice, forge, plain},
    is_full,
    watchdog::watch::{MEMORY, complaints, watch},
};

/// A table of every type of cell, with gaps, in two groups of rows.
fn write(sink: &mut dyn Sink, rows: usize) {
    let column = |name: &str, unit: Option<&str>, kind| Heading {
        name: name.into(),
        unit: unit.map(str::to_owned),
        kind,
    };
    let headings = [
        column("double", Some("kN"), CellType::Double),
        column("float", None, CellType::Float),
        column("int", Some("s"), CellType::Int),
        column("uint", None, CellType::UInt),
        column("bool", None, CellType::Bool),
        column("text", None, CellType::Text),
    ];
    sink.begin(&headings).expect("a beginning");
    for i in 0..rows {
        let cells = [
            Cell::Double((i as f64).sqrt()),
            Cell::Float(i as f32 / 3.0),
            Cell::Int(7 - i as i64 % 5),
            Cell::UInt(u64::MAX - i as u64),
            Cell::Bool(i % 3 == 0),
            Cell::Text(format!("name {}", i % 4)),
        ];
        let is_gap = |column: usize| (i + column) % 7 == 3;
        let cells: Vec<Cell> = cells
            .into_iter()
            .enumerate()
            .map(|(j, cell)| if is_gap(j) { Cell::Empty } else { cell })
            .collect();
        sink.row(&cells).expect("a row");
        if i == rows / 2 {
            sink.group().expect("a group");
        }
    }
    sink.end().expect("an end");
}

fn parquet(rows: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut Parquet::new(&mut bytes, "test 1", 1 << 24), rows);
    bytes
}

#[test]
fn cells_of_every_type_are_read_back() {
    let desk = Desk::new(&[("t.parquet", parquet(1000))]);
    let mut csv = Vec::new();
    write(&mut Csv::new(&mut csv), 1000);
    desk.put("t.csv", csv);
    let names = ["text", "uint", "double", "int", "bool", "float"];
    let [parquet, csv] = ["t.parquet", "t.csv"]
        .map(|name| read(&desk.path(name), Some(&names), Limits::default()).expect("a table"));
    assert_eq!(parquet.headings, csv.headings);
    let units: Vec<Option<&str>> = parquet.headings.iter().map(|heading| heading.unit.as_deref()).collect();
    assert_eq!(units, [None, None, Some("kN"), Some("s"), None, None]);
    let kinds: [fn(&Cell) -> bool; 6] = [
        |cell| matches!(cell, Cell::Text(_)),
        |cell| matches!(cell, Cell::UInt(_)),
        |cell| matches!(cell, Cell::Double(_)),
        |cell| matches!(cell, Cell::Int(_)),
        |cell| matches!(cell, Cell::Bool(_)),
        |cell| matches!(cell, Cell::Float(_)),
    ];
    for ((typed, plain), is_kind) in parquet.columns.iter().zip(&csv.columns).zip(kinds) {
        assert_eq!((typed.len(), plain.len()), (1000, 1000));
        assert!(typed.iter().all(|cell| *cell == Cell::Empty || is_kind(cell)));
        let text = |cells: &[Cell]| cells.iter().map(Cell::to_string).collect::<Vec<_>>();
        assert_eq!(text(typed), text(plain));
    }
}

#[test]
fn columns_of_parquet_are_not_passed_over() {
    // a list in place of `y`, and 32 bits without a sign
    let schema =
        "message m { required double time; required int32 x (INTEGER(32, false)); repeated double y; }";
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    let properties = WriterProperties::builder().set_dictionary_enabled(false).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("time");
    column.typed::<DoubleType>().write_batch(&[0.0], None, None).expect("a row");
    column.close().expect("an end");
    let mut column = group.next_column().expect("a column").expect("x");
    column.typed::<Int32Type>().write_batch(&[-1], None, None).expect("a row");
    column.close().expect("an end");
    let mut column = group.next_column().expect("a column").expect("y");
    column.typed::<DoubleType>().write_batch(&[999.0], Some(&[1]), Some(&[0])).expect("a row");
    column.close().expect("an end");
    group.close().expect("an end");
    let desk = Desk::new(&[("t.parquet", writer.into_inner().expect("an end"))]);
    desk.put("blank.jsonl", "\n\n{\"time\":0}\n");
    let error = desk.error(2, &["diff", "t.parquet", "blank.jsonl"]);
    assert!(error.contains("`t.parquet`: its column `y` has lists or objects"), "{error}");
    let table = read(&desk.path("t.parquet"), Some(&["x"]), Limits::default()).expect("a table");
    assert_eq!(table.columns, [[Cell::UInt(u64::from(u32::MAX))]]);
    let table = read(&desk.path("blank.jsonl"), None, Limits::default()).expect("a table");
    assert_eq!((table.headings[0].name.as_str(), table.columns[0].len()), ("time", 1));
}

/// Reads a table of any bytes; an error is as good as a table.
fn meet(folder: &TempDir, bytes: &[u8]) -> bool {
    let path = folder.path().join("t");
    fs::write(&path, bytes).expect("a file");
    // little memory: others in this process have theirs measured
    read(&path, None, Limits { memory: 16 << 20 }).is_ok()
}

#[test]
fn damaged_tables_are_errors() {
    let desk = Desk::new(&[("a.mcap", forge(40, 3).write(plain())), ("t.parquet", parquet(60))]);
    desk.text(0, &["trace", "a.mcap", "--topic", "/scalar", "--field", "force", "-o", "t.npz"]);
    desk.text(0, &["trace", "a.mcap", "--topic", "/scalar", "-o", "t.jsonl"]);
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["t.parquet", "t.npz", "t.jsonl"] {
        let whole = desk.bytes(name);
        assert!(meet(&folder, &whole), "{name}");
        let mut dice = Dice(7);
        for place in (0..whole.len()).step_by(if is_full() { 1 } else { 7 }) {
            let mut bytes = whole.clone();
            bytes[place] ^= 1 << dice.below(8);
            meet(&folder, &bytes);
            for _ in 0..dice.below(4) {
                let other = dice.below(bytes.len());
                bytes[other] = dice.roll() as u8;
            }
            meet(&folder, &bytes);
        }
        if name != "t.jsonl" {
            assert!(
                (0..whole.len()).step_by(37).all(|length| !meet(&folder, &whole[..length]) || length == 0),
                "{name}"
            );
        }
    }
}

/// A page of a text that is compressed well \[bytes\].
fn page_of_zeros(length: u64) -> Vec<u8> {
    let compressed = zstd::encode_all(io::repeat(0).take(length), 1).expect("zstd");
    let number = |number: u64| {
        (0..5).map(move |i| ((2 * number) >> (7 * i)) as u8 & 0x7f | if i < 4 { 0x80 } else { 0 })
    };
    let mut page = vec![0x15, 0, 0x15];
    page.extend(number(length));
    page.push(0x15);
    page.extend(number(compressed.len() as u64));
    // one plain value, with levels
    page.extend([0x2c, 0x15, 2, 0x15, 0, 0x15, 6, 0x15, 6, 0, 0]);
    [page, compressed].concat()
}

#[test]
fn a_small_file_takes_no_more_memory_than_there_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut dice = Dice(5);
    let noise: String = (0..400_000).map(|_| char::from(32 + dice.below(95) as u8)).collect();
    let mut bytes = Vec::new();
    let mut sink = Parquet::new(&mut bytes, "test 1", 1 << 24);
    sink.begin(&["x", "y"].map(|name| Heading {
        name: name.into(),
        kind: CellType::Text,
        ..Heading::default()
    }))
    .expect("a beginning");
    sink.row(&[Cell::Text(noise), Cell::Empty]).expect("a row");
    sink.end().expect("an end");
    drop(sink);
    // the first page has zeros instead
    let page = page_of_zeros(1 << 30);
    bytes[4..4 + page.len()].copy_from_slice(&page);
    fs::write(folder.path().join("page.parquet"), &bytes).expect("a file");
    // a description of a million keys without values
    let description = [&[0x59, 0xfc, 0x80, 0x80, 0x40][..], &[0x18, 0, 0].repeat(1 << 20)].concat();
    let length = (description.len() as u32).to_le_bytes();
    let end = [b"PAR1", &description[..], &length, b"PAR1"].concat();
    fs::write(folder.path().join("end.parquet"), end).expect("a file");
    fs::write(folder.path().join("deep.json"), "{\"x\":".repeat(1 << 16)).expect("a file");
    fs::write(folder.path().join("wide.json"), format!("{{\"x\":[{}0]}}", "0,".repeat(4 << 20)))
        .expect("a file");
    for (name, reason) in [
        ("page.parquet", "--max-memory"),
        ("end.parquet", "--max-memory"),
        ("deep.json", "row 1"),
        ("wide.json", "--max-memory"),
    ] {
        let ending = watch(folder.path(), &["plot", name, "--x", "x", "--y", "y"]);
        assert_eq!(complaints(&ending, MEMORY), [""; 0], "{name}: {}", ending.stderr);
        assert_eq!(ending.status, Some(1));
        assert!(ending.stderr.contains(name) && ending.stderr.contains(reason), "{name}: {}", ending.stderr);
    }
}

#[test]
fn a_description_that_claims_to_be_endless_ends() {
    // fifty lists of 2³¹ − 1 elements of no length
    let lists = [0xf9, 0xf2, 0xff, 0xff, 0xff, 0xff, 0x07].repeat(50);
    let length = lists.len() as u32 + 1;
    let bytes = [b"PAR1".as_slice(), &lists, &[0], &length.to_le_bytes(), b"PAR1"].concat();
    let (desk, start) = (Desk::new(&[("x.parquet", bytes)]), std::time::Instant::now());
    let error = desk.error(1, &["plot", "x.parquet", "--x", "a", "--y", "b"]);
    assert!(error.contains("cannot read `x.parquet` as Parquet"), "{error}");
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}
