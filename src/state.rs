//! The state of a computation as a stream of bytes, restored bit for bit.
//!
//! Stateful types write their state in some order and read it in the same one: small records with [`StateWriter::put`], arrays with
//! [`StateWriter::numbers`], straight from where they are and back, so that no copy of a large field is made. The stream knows
//! neither files nor what it carries; [`crate::checkpoint`] is the file around it.
//!
//! A reader trusts nothing: arrays must have the length that the case gives them, records stay below [`LONGEST_RECORD`].

use std::io::{self, Read, Write};

use serde::{Serialize, de::DeserializeOwned};

/// Largest record \[bytes\].
pub const LONGEST_RECORD: usize = 1 << 26;

/// Numbers that are converted at a time.
const PIECE: usize = 4096;

/// Why a state cannot be restored.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// The stream cannot be read, or has ended too soon.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// A record cannot be decoded.
    #[error("a record cannot be decoded: {0}")]
    Record(#[from] postcard::Error),
    /// A record is longer than any that is written.
    #[error("a record has {found} bytes, {LONGEST_RECORD} at most are allowed")]
    TooLong {
        /// Its length.
        found: usize,
    },
    /// An array has another length than in this case.
    #[error("{found} numbers where this case has {expected}")]
    Length {
        /// Numbers in the stream.
        found: u64,
        /// Numbers of the case.
        expected: usize,
    },
    /// A value that no run of this case has.
    #[error("{name} = {value} is not possible in this case")]
    Impossible {
        /// Name of the value.
        name: &'static str,
        /// The value as a text.
        value: String,
    },
}

impl StateError {
    /// An error unless a value is possible.
    ///
    /// # Errors
    ///
    /// It is not.
    pub fn unless(is_possible: bool, name: &'static str, value: impl ToString) -> Result<(), Self> {
        if is_possible { Ok(()) } else { Err(Self::Impossible { name, value: value.to_string() }) }
    }
}

/// A computation whose state can be written; writing changes nothing.
pub trait SaveState {
    /// Writes the state.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()>;
}

/// Writes a state.
pub struct StateWriter<'a> {
    out: &'a mut dyn Write,
    bytes: Vec<u8>,
}

impl<'a> StateWriter<'a> {
    /// A writer into `out`.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, bytes: Vec::new() }
    }

    /// Writes a small record.
    ///
    /// # Errors
    ///
    /// Of this and the method below: the stream cannot be written.
    ///
    /// # Panics
    ///
    /// If it is longer than [`LONGEST_RECORD`].
    pub fn put(&mut self, record: &impl Serialize) -> io::Result<()> {
        let bytes = postcard::to_stdvec(record).map_err(io::Error::other)?;
        assert!(bytes.len() <= LONGEST_RECORD, "a record of {} bytes", bytes.len());
        self.out.write_all(&(bytes.len() as u32).to_le_bytes())?;
        self.out.write_all(&bytes)
    }

    /// Writes an array.
    pub fn numbers(&mut self, numbers: &[f64]) -> io::Result<()> {
        self.out.write_all(&(numbers.len() as u64).to_le_bytes())?;
        for piece in numbers.chunks(PIECE) {
            self.bytes.clear();
            self.bytes.extend(piece.iter().flat_map(|number| number.to_le_bytes()));
            self.out.write_all(&self.bytes)?;
        }
        Ok(())
    }
}

/// Reads a state.
pub struct StateReader<'a> {
    from: &'a mut dyn Read,
    bytes: Vec<u8>,
}

impl<'a> StateReader<'a> {
    /// A reader of `from`.
    pub fn new(from: &'a mut dyn Read) -> Self {
        Self { from, bytes: Vec::new() }
    }

    /// Reads a small record.
    ///
    /// # Errors
    ///
    /// Of this and the methods below: the stream cannot be read, or is not what is expected.
    pub fn get<T: DeserializeOwned>(&mut self) -> Result<T, StateError> {
        let mut length = [0; 4];
        self.from.read_exact(&mut length)?;
        let length = u32::from_le_bytes(length) as usize;
        if length > LONGEST_RECORD {
            return Err(StateError::TooLong { found: length });
        }
        self.bytes.clear();
        // memory for what there is, not for what the length claims
        if (&mut *self.from).take(length as u64).read_to_end(&mut self.bytes)? < length {
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
        Ok(postcard::from_bytes(&self.bytes)?)
    }

    /// Reads an array of as many numbers as `numbers` has.
    pub fn numbers(&mut self, numbers: &mut [f64]) -> Result<(), StateError> {
        let mut length = [0; 8];
        self.from.read_exact(&mut length)?;
        let found = u64::from_le_bytes(length);
        if found != numbers.len() as u64 {
            return Err(StateError::Length { found, expected: numbers.len() });
        }
        for piece in numbers.chunks_mut(PIECE) {
            self.bytes.resize(size_of_val(piece), 0);
            self.from.read_exact(&mut self.bytes)?;
            for (number, bytes) in piece.iter_mut().zip(self.bytes.chunks_exact(size_of::<f64>())) {
                *number = f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
            }
        }
        Ok(())
    }

    /// Makes sure that nothing follows.
    pub fn end(&mut self) -> Result<(), StateError> {
        let found = self.from.read(&mut [0])?;
        StateError::unless(found == 0, "end of the state", "further bytes")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_returns() {
        let odd = f64::from_bits(0x7ff8_0000_dead_beef);
        let numbers: Vec<f64> =
            (0..3 * PIECE + 7).map(|i| (i as f64).sin()).chain([-0.0, f64::INFINITY, 5e-324, odd]).collect();
        let mut bytes = Vec::new();
        let mut writer = StateWriter::new(&mut bytes);
        writer.put(&(7u64, f64::INFINITY, Some(-0.0f64), vec![true, false])).expect("memory");
        writer.numbers(&numbers).expect("memory");
        let mut stream = &bytes[..];
        let mut reader = StateReader::new(&mut stream);
        let (step, mass, lost, flags): (u64, f64, Option<f64>, Vec<bool>) = reader.get().expect("a record");
        assert_eq!((step, mass, lost.map(f64::to_bits)), (7, f64::INFINITY, Some((-0.0f64).to_bits())));
        assert_eq!(flags, [true, false]);
        let mut found = vec![0.0; numbers.len()];
        reader.numbers(&mut found).expect("as many numbers");
        assert!(numbers.iter().zip(&found).all(|(a, b)| a.to_bits() == b.to_bits()));
        reader.end().expect("nothing follows");
    }

    #[test]
    fn forged_lengths_take_no_memory() {
        let mut stream: &[u8] = &[0xff, 0xff, 0xff, 0xff, 0];
        let error = StateReader::new(&mut stream).get::<u64>().expect_err("too long");
        assert!(matches!(error, StateError::TooLong { found: 0xffff_ffff }), "{error}");
        // a list that claims more entries than the record has bytes
        let mut stream: &[u8] = &[6, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0f];
        let error = StateReader::new(&mut stream).get::<Vec<f64>>().expect_err("no entries");
        assert!(matches!(error, StateError::Record(_)), "{error}");
        let mut stream: &[u8] = &[0xff; 8];
        let error = StateReader::new(&mut stream).numbers(&mut [0.0; 3]).expect_err("another length");
        assert!(matches!(error, StateError::Length { expected: 3, .. }), "{error}");
    }
}
