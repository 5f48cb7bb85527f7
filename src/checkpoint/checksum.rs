//! The checksum of a file, computed while it is read or written.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
};

use crc32fast::Hasher;

/// A stream whose checksum is computed while it is written.
pub struct Checked<W> {
    out: W,
    hasher: Hasher,
    size: u64,
}

impl<W> Checked<W> {
    /// Before the first byte.
    pub fn new(out: W) -> Self {
        Self { out, hasher: Hasher::new(), size: 0 }
    }

    /// The stream, the checksum of what was written, and its size \[bytes\].
    pub fn end(self) -> (W, u32, u64) {
        (self.out, self.hasher.finalize(), self.size)
    }
}

impl<W: Write> Write for Checked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.size += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// True if the first `content` bytes of a file have the checksum that follows them.
pub fn is_sound(file: &mut File, content: u64) -> io::Result<bool> {
    file.seek(SeekFrom::Start(0))?;
    let mut hasher = Hasher::new();
    let mut piece = vec![0; 1 << 16];
    let mut left = content;
    while left > 0 {
        let length = left.min(piece.len() as u64) as usize;
        file.read_exact(&mut piece[..length])?;
        hasher.update(&piece[..length]);
        left -= length as u64;
    }
    let mut checksum = [0; 4];
    file.read_exact(&mut checksum)?;
    Ok(hasher.finalize() == u32::from_le_bytes(checksum))
}
