//! Files that people write: cases, profiles, tables and requests of sweeps. They are read whole, within a bound.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

use percuss_output::kind_name;

/// Longest file that is read \[bytes\].
pub const LONGEST: u64 = 16 << 20;

/// Why a file is not read. The text goes on after the name of the file.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The system refuses.
    #[error(transparent)]
    System(#[from] io::Error),
    /// It is a folder, a pipe, a device.
    #[error("is {0}, no file")]
    NoFile(&'static str),
    /// It is longer than anything that people write.
    #[error("is longer than {} MiB, which no file of this kind is", LONGEST >> 20)]
    TooLong,
    /// It is a recording.
    #[error("is a recording (MCAP), no text")]
    Recording,
    /// It is not text.
    #[error("is no text: byte 0x{byte:02x} in line {line} is not valid UTF-8; save it as UTF-8 text")]
    NotText {
        /// Number of the line, from 1 on.
        line: usize,
        /// The byte.
        byte: u8,
    },
}

/// The text of a file.
///
/// # Errors
///
/// It cannot be read, or is no text of a length that people write. What is no file is refused before it is opened: opening a pipe
/// waits for a writer.
pub fn read_text(path: &Path) -> Result<String, InputError> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(InputError::NoFile(kind_name(metadata.file_type())));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if bytes.starts_with(mcap::MAGIC) {
        return Err(InputError::Recording);
    }
    if bytes.len() as u64 > LONGEST {
        return Err(InputError::TooLong);
    }
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = bytes[..place].iter().filter(|&&byte| byte == b'\n').count() + 1;
        InputError::NotText { line, byte: bytes.get(place).copied().unwrap_or_default() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_person_writes_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        let refusal = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("room");
            read_text(&path).expect_err("it is refused").to_string()
        };
        assert!(refusal(b"a\nb\xff").contains("byte 0xff in line 2"));
        assert!(refusal(&[mcap::MAGIC, &[0xff]].concat()).contains("is a recording"));
        assert!(read_text(folder.path()).expect_err("a folder").to_string().contains("is a folder"));
        assert!(matches!(read_text(&folder.path().join("none")), Err(InputError::System(_))));
        let file = File::create(&path).expect("a file");
        file.set_len(LONGEST).expect("room");
        assert_eq!(read_text(&path).expect("it is short enough").len() as u64, LONGEST);
        file.set_len(LONGEST + 1).expect("room");
        assert!(matches!(read_text(&path), Err(InputError::TooLong)));
        // of any length, for nothing of it is kept
        file.set_len(1 << 50).or_else(|_| file.set_len(1 << 40)).expect("room");
        assert!(read_text(&path).expect_err("too long").to_string().contains("16 MiB"));
    }
}
