//! Fields of a message as they stand on the wire.

use super::leaf::DecodeError;
use crate::recording::Budget;

/// Spends memory of the message that is decoded.
pub(super) fn spend(budget: &mut Budget, bytes: usize) -> Result<(), DecodeError> {
    if budget.spend(bytes) { Ok(()) } else { Err(DecodeError::Memory) }
}

/// Bytes of a message that are still to be read.
pub(super) struct Wire<'a> {
    pub(super) bytes: &'a [u8],
}

impl<'a> Wire<'a> {
    /// Number and wire type of the next field.
    pub(super) fn key(&mut self) -> Result<(u32, u8), DecodeError> {
        let key = self.varint()?;
        Ok((u32::try_from(key >> 3).map_err(|_| DecodeError::SchemaMismatch)?, (key & 7) as u8))
    }

    pub(super) fn varint(&mut self) -> Result<u64, DecodeError> {
        let mut value = 0;
        for (i, &byte) in self.bytes.iter().enumerate().take(10) {
            value |= u64::from(byte & 0x7f) << (7 * i);
            if byte < 0x80 {
                // the tenth byte has room for one bit
                if i == 9 && byte > 1 {
                    return Err(DecodeError::SchemaMismatch);
                }
                self.bytes = &self.bytes[i + 1..];
                return Ok(value);
            }
        }
        Err(DecodeError::SchemaMismatch)
    }

    pub(super) fn fixed<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let (head, rest) = self.bytes.split_first_chunk::<N>().ok_or(DecodeError::SchemaMismatch)?;
        self.bytes = rest;
        Ok(*head)
    }

    pub(super) fn block(&mut self) -> Result<&'a [u8], DecodeError> {
        let length = usize::try_from(self.varint()?).map_err(|_| DecodeError::SchemaMismatch)?;
        let (block, rest) = self.bytes.split_at_checked(length).ok_or(DecodeError::SchemaMismatch)?;
        self.bytes = rest;
        Ok(block)
    }

    /// Skips a value whose key has been read.
    pub(super) fn skip(&mut self, number: u32, kind: u8, depth: usize) -> Result<(), DecodeError> {
        const MAX_GROUPS: usize = 100;
        match kind {
            0 => self.varint().map(drop),
            1 => self.fixed::<8>().map(drop),
            2 => self.block().map(drop),
            3 if depth < MAX_GROUPS => loop {
                match self.key()? {
                    (inner, 4) if inner == number => return Ok(()),
                    (inner, kind) => self.skip(inner, kind, depth + 1)?,
                }
            },
            5 => self.fixed::<4>().map(drop),
            _ => Err(DecodeError::SchemaMismatch),
        }
    }
}
