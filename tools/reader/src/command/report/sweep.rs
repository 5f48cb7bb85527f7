//! The report of a sweep: its summary as a table and plots, with links to the recordings of the cases.

use std::{
    collections::HashMap,
    fs::{self, File},
    io::{BufRead, BufReader, Read},
    path::{Component, Path, PathBuf},
};

use percuss_table::{Cell, Heading};
use serde::Deserialize;
use serde_json::{Value, json};

use super::{SHARED, STYLE, VERSION, fill};
use crate::{
    command::view::number,
    convention::{CASE_NUMBER, MANIFEST, STATUS_COLUMN, SUMMARY, UNCERTAINTY, WARNINGS_COLUMN},
    failure::Failure,
    prefix::Prefixed,
    recording::Limits,
    tabular::{self, Table},
};

const PAGE: &str = include_str!("sweep.html");
const SWEEP_STYLE: &str = include_str!("sweep.css");
const SCRIPT: &str = include_str!("sweep.js");

/// Writes the report of a sweep.
///
/// * `folder`: the directory of the sweep
/// * `page`: where the page will be, which links lead from
pub fn sweep(folder: &Path, page: &Path, limits: Limits) -> Result<String, Failure> {
    let table = match tabular::read(&folder.join(SUMMARY), None, limits) {
        Err(Failure::Read { error, .. }) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Failure::Usage(format!(
                "`{}` is not the directory of a sweep: it has no summary.csv",
                folder.display()
            )));
        }
        table => table?,
    };
    let uncertainty = folder.join(UNCERTAINTY);
    let uncertainty =
        uncertainty.is_file().then(|| tabular::read(&uncertainty, None, limits)).transpose()?.map(|table| {
            let rows = table.columns.iter().map(|cells| cells.iter().map(text).collect::<Vec<_>>());
            rows.collect::<Vec<_>>()
        });
    let links = links(folder, &table, &entries(folder, limits)?, &way(page, folder));
    let data = json!({
        "version": VERSION,
        "title": name(folder),
        "status": STATUS_COLUMN,
        "case": CASE_NUMBER,
        "warnings": WARNINGS_COLUMN,
        "columns": table.headings.iter().zip(&table.columns).map(column).collect::<Vec<_>>(),
        "links": links,
        "uncertainty": uncertainty,
    });
    Ok(fill(
        PAGE,
        &data,
        &[("{style}", &[STYLE, SWEEP_STYLE].concat()), ("{shared}", SHARED), ("{script}", SCRIPT)],
    ))
}

/// Name of the directory, also of one that is given as `.`.
pub fn name(folder: &Path) -> String {
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.into());
    folder.file_name().unwrap_or("sweep".as_ref()).to_string_lossy().into_owned()
}

fn text(cell: &Cell) -> Value {
    match (cell, cell.number()) {
        (Cell::Empty, _) => Value::Null,
        (_, Some(value)) => number(value),
        (other, None) => other.to_string().into(),
    }
}

/// A column of the page, numbers in the unit in which they are best read; one of numbers alone can be drawn.
fn column((heading, cells): (&Heading, &Vec<Cell>)) -> Value {
    let numbers = || cells.iter().filter_map(Cell::number).filter(|number| number.is_finite());
    let is_numeric = cells.iter().all(|cell| *cell == Cell::Empty || cell.number().is_some());
    let largest = numbers().fold(0.0, |largest: f64, number| largest.max(number.abs()));
    let prefixed = heading.unit.as_deref().and_then(|unit| Prefixed::choose(unit, largest));
    let value = |cell: &Cell| match (cell, cell.number()) {
        (Cell::Empty, _) => Value::Null,
        (Cell::Int(number), _) if prefixed.is_none() => (*number).into(),
        (_, Some(value)) => number(prefixed.as_ref().map_or(value, |unit| unit.apply(value))),
        (other, None) => other.to_string().into(),
    };
    json!({
        "name": heading.name,
        "unit": prefixed.as_ref().map(|prefixed| &prefixed.unit).or(heading.unit.as_ref()),
        "numeric": is_numeric && numbers().next().is_some(),
        "values": cells.iter().map(value).collect::<Vec<_>>(),
    })
}

/// What the journal of a sweep says of a case.
#[derive(Deserialize)]
struct Entry {
    case: u64,
    state: Option<String>,
    file: Option<String>,
}

/// What the journal says last of every case, by number; a line that is none, like a torn one at its end, is passed.
fn entries(folder: &Path, limits: Limits) -> Result<HashMap<u64, Entry>, Failure> {
    let path = folder.join(MANIFEST);
    let Ok(journal) = File::open(&path) else { return Ok(HashMap::new()) };
    let error = |error| Failure::Read { path: path.clone(), error };
    let mut entries = HashMap::new();
    let mut room = limits.kept();
    let mut lines = BufReader::new(journal);
    let mut line = Vec::new();
    let longest = limits.values() as u64;
    while lines.by_ref().take(longest).read_until(b'\n', &mut line).map_err(error)? > 0 {
        if let Ok(entry) = serde_json::from_slice::<Entry>(&line) {
            let size = 2 * size_of::<(u64, Entry)>() + line.len();
            let refuse = || Failure::memory(&path, "the names of the recordings");
            room = room.checked_sub(size).ok_or_else(refuse)?;
            entries.insert(entry.case, entry);
        }
        line.clear();
    }
    Ok(entries)
}

/// The address of the recording of every row; none where there is none, where it is not below the folder, and where the journal
/// says another end of the case: a sweep that was changed has other cases under its numbers.
fn links(folder: &Path, table: &Table, entries: &HashMap<u64, Entry>, way: &str) -> Vec<Option<String>> {
    let cells = |name| {
        let place = table.headings.iter().position(|heading| heading.name == name);
        place.map_or(&[][..], |place| &table.columns[place])
    };
    let link = |(case, status): (&Cell, &Cell)| {
        let Cell::Int(case) = case else { return None };
        let Entry { state, file, .. } = entries.get(&u64::try_from(*case).ok()?)?;
        let file =
            file.as_deref().filter(|_| state.as_ref().is_none_or(|state| *state == status.to_string()))?;
        let is_below = Path::new(file).components().all(|part| matches!(part, Component::Normal(_)));
        (is_below && folder.join(file).is_file()).then(|| format!("{way}{}", address(file)))
    };
    cells(CASE_NUMBER).iter().zip(cells(STATUS_COLUMN)).map(link).collect()
}

/// The way from the folder of a page to another folder, as an address that names follow.
fn way(page: &Path, folder: &Path) -> String {
    let whole = |path: &Path| fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let parent = page.parent().filter(|parent| *parent != Path::new("")).unwrap_or(Path::new("."));
    let (from, to) = (whole(parent), whole(folder));
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n(PathBuf::from(".."), from.components().count() - common);
    let down = to.components().skip(common).map(|part| PathBuf::from(part.as_os_str()));
    up.chain(down).map(|part| address(&part.to_string_lossy()) + "/").collect()
}

/// A path as an address: what could be more than a name in it is written in hexadecimal digits.
fn address(path: &str) -> String {
    let part = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => char::from(byte).into(),
        _ => format!("%{byte:02X}"),
    };
    path.bytes().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_files_below_the_folder_and_nowhere_else() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("runs")).expect("a folder");
        let names = [
            "runs/1.mcap",
            "../2.mcap",
            "/etc/passwd",
            "javascript:alert(1)",
            "runs/\"5 %.mcap",
            "runs/6.mcap",
            "runs/7.mcap",
        ];
        for name in [names[0], names[3], names[4], names[5]] {
            fs::write(folder.path().join(name), "").expect("a file");
        }
        let table = Table {
            headings: [CASE_NUMBER, STATUS_COLUMN].map(|name| Heading::new(name, None)).into(),
            columns: vec![(1..=8).map(Cell::Int).collect(), vec![Cell::Text("completed".into()); 8]],
        };
        let entry = |(case, file): (u64, &str)| {
            let state = if case == 6 { "failed" } else { "completed" };
            (case, Entry { case, state: Some(state.into()), file: Some(file.into()) })
        };
        let found = links(folder.path(), &table, &(1..).zip(names).map(entry).collect(), "../s/");
        let found: Vec<&str> = found.iter().map(|link| link.as_deref().unwrap_or("none")).collect();
        let [first, address, odd] = ["runs/1.mcap", "javascript%3Aalert%281%29", "runs/%225%20%25.mcap"]
            .map(|name| format!("../s/{name}"));
        assert_eq!(found, [&first, "none", "none", &address, &odd, "none", "none", "none"]);
    }

    #[test]
    fn the_way_goes_up_and_down() {
        let folder = tempfile::tempdir().expect("a folder");
        let [sweep, pages] = ["a sweep", "pages"].map(|name| folder.path().join(name));
        for folder in [&sweep, &pages] {
            fs::create_dir(folder).expect("a folder");
        }
        assert_eq!(way(&pages.join("x.html"), &sweep), "../a%20sweep/");
        assert_eq!(way(&folder.path().join("x.html"), &sweep), "a%20sweep/");
        assert_eq!(way(&sweep.join("x.html"), &sweep), "");
    }
}
