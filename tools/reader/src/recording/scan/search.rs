//! Where reading can continue after damage.

use std::io::{self, Read};

use mcap::records::op;

use super::{Outer, PREFIX, Part, Scan};

impl Scan {
    /// Finds where reading can go on: at the next chunk that is sound, or at the summary.
    pub(super) fn resynchronise(&mut self, offset: u64, reason: String) -> io::Result<Outer> {
        self.crc = None;
        let indexed = self.index.chunks.range(offset + 1..).next().map(|(&offset, _)| offset);
        let summary = Some(self.index.start).filter(|&start| start > offset);
        let next = match indexed.or(summary) {
            Some(next) => Some(next),
            None => self.search(offset + 1)?,
        };
        match next.filter(|&next| next < self.length) {
            Some(next) => {
                self.seek(next)?;
                self.damage(offset, next - offset, reason);
            }
            None => {
                self.part = Part::Over;
                self.damage(offset, self.length - offset, reason);
            }
        }
        Ok(Outer::Again)
    }

    /// Looks for a chunk from an offset on.
    fn search(&mut self, from: u64) -> io::Result<Option<u64>> {
        const WINDOW: u64 = 1 << 20;
        /// Bytes of a record's prefix and a chunk's header, with the longest name of a compression.
        const HEAD: u64 = PREFIX + 8 + 8 + 8 + 4 + 4 + 4 + 8;
        let mut start = from;
        while start + HEAD <= self.length {
            self.seek(start)?;
            let size = (WINDOW + HEAD).min(self.length - start);
            let mut window = vec![0; size as usize];
            self.source.read_exact(&mut window)?;
            let heads = window.windows(HEAD as usize).enumerate();
            for (i, head) in heads.filter(|(_, head)| head[0] == op::CHUNK) {
                let offset = start + i as u64;
                if self.is_chunk(head, offset) {
                    return Ok(Some(offset));
                }
            }
            start += WINDOW;
        }
        Ok(None)
    }

    /// True if these bytes look like the beginning of a chunk record.
    fn is_chunk(&self, head: &[u8], offset: u64) -> bool {
        let u64_at =
            |at: usize| head.get(at..at + 8).and_then(|b| Some(u64::from_le_bytes(b.try_into().ok()?)));
        let length = u64_at(1).unwrap_or(u64::MAX);
        let fits = length <= self.limits.record() as u64 && offset + PREFIX + length <= self.length;
        let times = u64_at(9).zip(u64_at(17)).is_some_and(|(first, last)| first <= last);
        let uncompressed = u64_at(25).is_some_and(|size| size <= self.limits.record() as u64);
        let name = match head.get(37..41) {
            Some([0, 0, 0, 0]) => Some(0),
            Some([3, 0, 0, 0]) => Some(3).filter(|_| head[41..44] == *b"lz4"),
            Some([4, 0, 0, 0]) => Some(4).filter(|_| head[41..45] == *b"zstd"),
            _ => None,
        };
        let compressed =
            name.and_then(|name| u64_at(41 + name).map(|size| size.saturating_add(40 + name as u64)));
        fits && times && uncompressed && compressed == Some(length)
    }
}
