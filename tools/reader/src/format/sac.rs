//! SAC, a trace of seismology: numbers evenly apart in time behind a header of 158 words (SAC manual, "SAC data file format", header version 6),
//! little-endian.

use std::io::{self, Write};

use percuss_table::{Cell, Heading, Sink};

use crate::convention::STEP;

/// Words of 4 bytes in the header: 70 numbers, 40 whole ones, and texts of 8 bytes.
const NUMBERS: usize = 70;
const WHOLE: usize = 40;
const TEXTS: usize = 192;
/// A number, a text that says nothing.
const UNDEFINED: i32 = -12345;
/// Version of the header.
const VERSION: i32 = 6;
/// A time series, and what it is of.
const TIME_SERIES: i32 = 1;
const UNKNOWN: i32 = 5;
const DISPLACEMENT: i32 = 6;
const VELOCITY: i32 = 7;
/// Displacements of SAC are in nm, velocities in nm/s.
const NANO: f64 = 1e9;
/// What distances of rows in time may differ, relative to their mean.
const EVEN: f64 = 1e-3;

/// Writes the first column after time and step; displacements in m as nm, velocities in m/s as nm/s, all others as they are.
pub struct Sac<W: Write> {
    output: W,
    /// Place of the values among the columns; the first is the time.
    column: usize,
    name: String,
    kind: i32,
    scale: f64,
    times: Vec<f64>,
    values: Vec<f32>,
    /// Most rows that are kept.
    most: usize,
}

fn refuse<T>(what: &str) -> io::Result<T> {
    Err(io::Error::new(io::ErrorKind::InvalidData, what.to_owned()))
}

impl<W: Write> Sac<W> {
    /// * `memory`: for the rows \[bytes\]
    pub fn new(output: W, memory: usize) -> Self {
        let most = memory / (2 * (size_of::<f64>() + size_of::<f32>()));
        let (column, name, kind, scale) = (1, String::new(), UNKNOWN, 1.0);
        Self { output, column, name, kind, scale, times: Vec::new(), values: Vec::new(), most }
    }

    /// The header of what was taken.
    fn header(&self) -> io::Result<Vec<u8>> {
        let (Some(first), Some(last)) = (self.times.first(), self.times.last()) else {
            return refuse("there are no rows");
        };
        let steps = self.times.len() - 1;
        let delta = (last - first) / steps.max(1) as f64;
        let is_even = |pair: &[f64]| (pair[1] - pair[0] - delta).abs() <= EVEN * delta;
        if !self.times.windows(2).all(is_even) {
            return refuse(
                "its messages are not evenly apart in time, as a .sac has them; trace it into a .csv",
            );
        }
        let mut numbers = [UNDEFINED as f32; NUMBERS];
        let (least, most) = self
            .values
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), x| (least.min(*x), most.max(*x)));
        let mean = self.values.iter().map(|x| f64::from(*x)).sum::<f64>() / self.values.len() as f64;
        for (place, x) in [(0, delta), (5, *first), (6, *last), (56, mean)] {
            numbers[place] = x as f32;
        }
        (numbers[1], numbers[2]) = (least, most);
        let mut whole = [UNDEFINED; WHOLE];
        let count = i32::try_from(self.values.len()).or_else(|_| refuse("it has too many rows"))?;
        // version, length, kind of file and of numbers; evenly apart, may be overwritten, no distances to be worked out
        for (place, x) in
            [(6, VERSION), (9, count), (15, TIME_SERIES), (16, self.kind), (35, 1), (37, 1), (38, 0)]
        {
            whole[place] = x;
        }
        let mut texts = UNDEFINED.to_string().into_bytes();
        texts.resize(8, b' ');
        let mut texts = texts.repeat(TEXTS / 8);
        // the first has 8 bytes, the second 16; that of the component is the 21st
        texts[..8].copy_from_slice(b"percuss ");
        texts[16..24].fill(b' ');
        let component = format!("{:8}", self.name.chars().filter(char::is_ascii).take(8).collect::<String>());
        texts[160..168].copy_from_slice(component.as_bytes());
        let numbers = numbers.iter().flat_map(|x| x.to_le_bytes());
        Ok(numbers.chain(whole.iter().flat_map(|x| x.to_le_bytes())).chain(texts).collect())
    }
}

impl<W: Write> Sink for Sac<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        let mut values = headings.iter().enumerate().skip(1).filter(|(_, heading)| heading.name != STEP);
        let Some((column, heading)) = values.next() else { return refuse("there are no values") };
        (self.kind, self.scale) = match heading.unit.as_deref() {
            Some("m") => (DISPLACEMENT, NANO),
            Some("m/s") => (VELOCITY, NANO),
            _ => (UNKNOWN, 1.0),
        };
        self.name.clone_from(&heading.name);
        self.column = column;
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        let [time, value] = [0, self.column].map(|column| cells.get(column).and_then(Cell::number));
        let (Some(time), Some(value)) = (time, value) else { return refuse("a row has no number") };
        if self.values.len() == self.most {
            return refuse("it is larger than --max-memory allows");
        }
        self.times.push(time);
        self.values.push((self.scale * value) as f32);
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        let header = self.header()?;
        self.output.write_all(&header)?;
        self.values.iter().try_for_each(|x| self.output.write_all(&x.to_le_bytes()))?;
        self.output.flush()
    }
}

#[cfg(test)]
mod tests {
    use percuss_table::CellType;

    use super::*;

    fn write(times: &[f64], unit: &str) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut sac = Sac::new(&mut bytes, 1 << 20);
        let heading = |name: &str, unit| Heading { name: name.into(), unit, kind: CellType::Double };
        let units = [("time", Some("s")), (STEP, None), ("value", Some(unit))];
        sac.begin(&units.map(|(name, unit)| heading(name, unit.map(str::to_owned))))?;
        for (k, time) in times.iter().enumerate() {
            sac.row(&[Cell::Double(*time), Cell::UInt(k as u64), Cell::Double(1e-9 * k as f64)])?;
        }
        sac.end()?;
        Ok(bytes)
    }

    #[test]
    fn words_of_the_header_stand_where_the_manual_has_them() {
        let bytes = write(&[0.0, 2e-8, 4e-8], "m").expect("a trace");
        let word = |place: usize| bytes[4 * place..][..4].try_into().expect("four bytes");
        let number = |place| f32::from_le_bytes(word(place));
        let whole = |place| i32::from_le_bytes(word(place));
        // DELTA, DEPMIN, DEPMAX, B, E, DEPMEN
        assert_eq!([0, 1, 2, 5, 6, 56].map(number), [2e-8, 0.0, 2.0, 0.0, 4e-8, 1.0]);
        // NVHDR, NPTS, IFTYPE, IDEP, LEVEN
        assert_eq!([76, 79, 85, 86, 105].map(whole), [6, 3, 1, 6, 1]);
        assert_eq!((number(10), whole(77)), (-12345.0, -12345));
        assert_eq!((&bytes[440..448], &bytes[600..608]), (&b"percuss "[..], &b"value   "[..]));
        assert_eq!([158, 159, 160].map(number), [0.0, 1.0, 2.0]);
        assert_eq!(bytes.len(), 4 * 161);
        let plain = write(&[0.0, 1.0, 2.0], "R").expect("a trace");
        assert_eq!((plain[4 * 86], &plain[4 * 160..]), (5, &(2e-9_f32).to_le_bytes()[..]));
    }

    #[test]
    fn times_that_are_not_evenly_apart_are_refused() {
        assert!(write(&[0.0, 1.0, 2.5], "m").is_err() && write(&[], "m").is_err());
    }
}
