//! The records of a file as they stand in it, chunks unopened.

use std::io::{self, Read, Seek, SeekFrom};

use mcap::{
    MAGIC,
    records::{Record, op},
    sans_io::linear_reader::{LinearReader, LinearReaderOptions},
};

use super::{CHECKSUMS_COUNT, LARGE, LeftOut, Open, Outer, PREFIX, Part, Scan, block, parse};

impl Scan {
    /// Reads the next record of the file into `body`; chunks are opened.
    pub(super) fn outer(&mut self) -> io::Result<Outer> {
        let offset = self.position;
        if self.skip.contains(&offset) {
            let chunk = &self.index.chunks[&offset];
            let end = offset.saturating_add(chunk.chunk_length).saturating_add(chunk.message_index_length);
            self.seek(end.min(self.length).max(offset + 1))?;
            return Ok(Outer::Again);
        }
        let mut prefix = [0; PREFIX as usize];
        if self.length.saturating_sub(offset) < PREFIX {
            return self.ends_early(offset, "the file ends where another record should begin");
        }
        self.source.read_exact(&mut prefix)?;
        let [opcode, length @ ..] = prefix;
        let length = u64::from_le_bytes(length);
        let end = (offset + PREFIX).saturating_add(length);
        if end > self.length && opcode != 0 && self.grows && !self.reaches_over_chunk(offset, end) {
            self.seek(offset)?;
            return self.ends_early(offset, "");
        }
        self.left_out = None;
        let is_large = length > self.limits.record() as u64 && end <= self.length;
        if opcode == op::ATTACHMENT && is_large && !self.reaches_over_chunk(offset, end) {
            return self.attachment_in_pieces(offset, &prefix, length);
        }
        if let Some(reason) = self.refusal(offset, opcode, length, end) {
            return self.resynchronise(offset, reason);
        }
        self.body.resize(length as usize, 0);
        self.source.read_exact(&mut self.body)?;
        self.position = end;
        self.check_crc(offset, opcode, &prefix);
        match opcode {
            // the summary has been read and was sound, else nothing could be skipped
            op::DATA_END if !self.skip.is_empty() => self.part = Part::Over,
            op::CHUNK => self.open_chunk(offset, &prefix),
            op::FOOTER => self.end_magic()?,
            _ => {}
        }
        Ok(Outer::Record { offset, opcode })
    }

    /// Adds a record to the checksum of its part of the file, and compares where the part ends.
    pub(super) fn check_crc(&mut self, offset: u64, opcode: u8, prefix: &[u8]) {
        let saved = match opcode {
            op::DATA_END | op::FOOTER => match parse(opcode, &self.body, self.limits.record()) {
                Ok(Record::DataEnd(end)) => Some(end.data_section_crc),
                Ok(Record::Footer(footer)) => Some(footer.summary_crc),
                _ => None,
            },
            _ => None,
        };
        // of a sound end of the data nothing is part of a checksum, of a sound footer all but the checksum itself
        let covered = match (opcode, saved) {
            (op::DATA_END, Some(_)) => None,
            (op::FOOTER, Some(_)) => Some(&self.body[..self.body.len().saturating_sub(4)]),
            _ => Some(&self.body[..]),
        };
        if let (Some(crc), Some(covered)) = (&mut self.crc, covered) {
            crc.update(prefix);
            crc.update(covered);
        }
        if let Some(saved) = saved {
            let calculated = self.crc.take().map(crc32fast::Hasher::finalize);
            let wrong = calculated.filter(|&calculated| CHECKSUMS_COUNT && saved != 0 && saved != calculated);
            if let Some(calculated) = wrong.filter(|_| !self.has_damage()) {
                let part = if opcode == op::DATA_END { "data section" } else { "summary" };
                let reason =
                    format!("CRC of the {part} failed: {saved:08x} is saved, {calculated:08x} found");
                self.damage(offset, 0, reason);
            }
        }
        if opcode == op::DATA_END && self.part == Part::Data {
            self.part = Part::Summary;
            self.crc = Some(crc32fast::Hasher::new());
        }
    }

    /// Reads an attachment that has no room: its header stays, its content is verified and left out.
    fn attachment_in_pieces(&mut self, offset: u64, prefix: &[u8], length: u64) -> io::Result<Outer> {
        /// Bytes that are read at once; the header has to be in the first of them.
        const PIECE: u64 = 1 << 16;
        const CRC: u64 = 4;
        self.body.resize(PIECE.min(length) as usize, 0);
        self.source.read_exact(&mut self.body)?;
        // two times, name, media type, and the length of the content
        let stated = self.body.get(8 + 8..).and_then(|mut rest| {
            block(&mut rest)?;
            block(&mut rest)?;
            let (content, rest) = rest.split_first_chunk()?;
            Some((self.body.len() - rest.len(), u64::from_le_bytes(*content)))
        });
        let fits = |(head, content): &(usize, u64)| content.checked_add(*head as u64 + CRC) == Some(length);
        let Some((head, content)) = stated.filter(fits) else {
            return self.resynchronise(offset, "the lengths inside an attachment are wrong".into());
        };
        self.source.seek(SeekFrom::Start(offset + PREFIX + head as u64))?;
        self.body.truncate(head);
        let header = std::mem::take(&mut self.body);
        let (mut own, mut of_content) = (crc32fast::Hasher::new(), crc32fast::Hasher::new());
        own.update(&header);
        let mut whole = self.crc.take();
        whole.iter_mut().for_each(|crc| [prefix, &header].into_iter().for_each(|part| crc.update(part)));
        let mut left = content;
        while left > 0 {
            self.body.resize(PIECE.min(left) as usize, 0);
            self.source.read_exact(&mut self.body)?;
            left -= self.body.len() as u64;
            [&mut own, &mut of_content].into_iter().chain(&mut whole).for_each(|crc| crc.update(&self.body));
        }
        let mut saved = [0; CRC as usize];
        self.source.read_exact(&mut saved)?;
        whole.iter_mut().for_each(|crc| crc.update(&saved));
        self.crc = whole;
        self.position = offset + PREFIX + length;
        let (saved, found) = (u32::from_le_bytes(saved), own.finalize());
        if CHECKSUMS_COUNT && saved != 0 && saved != found {
            let reason = format!("CRC of an attachment failed: {saved:08x} is saved, {found:08x} found");
            self.damage(offset, PREFIX + length, reason);
            return Ok(Outer::Again);
        }
        self.left_out = Some(LeftOut { size: content, crc: of_content.finalize() });
        // as if it were empty, without a checksum
        self.body = [&header[..head - 8], &[0; 8 + CRC as usize]].concat();
        Ok(Outer::Record { offset, opcode: op::ATTACHMENT })
    }

    /// True if a record reaches over the beginning of a chunk: its length is wrong.
    fn reaches_over_chunk(&self, offset: u64, end: u64) -> bool {
        self.index.chunks.range(offset + 1..end.max(offset + 1)).next().is_some()
    }

    fn refusal(&self, offset: u64, opcode: u8, length: u64, end: u64) -> Option<String> {
        let limit = self.limits.record();
        match () {
            () if opcode == 0 => Some("not a record: opcode 0".into()),
            () if self.reaches_over_chunk(offset, end) => {
                Some(format!("the length of a record, {length}, is wrong"))
            }
            () if end > self.length => {
                Some(format!("the file ends in the middle of a record of {length} bytes"))
            }
            () if length > limit as u64 => {
                Some(format!("a record of {length} bytes exceeds the limit of {limit} (--max-memory)"))
            }
            () => None,
        }
    }

    /// Ends a file without a footer, or continues where it has grown meanwhile.
    fn ends_early(&mut self, offset: u64, reason: &str) -> io::Result<Outer> {
        if self.grows {
            let known = self.length;
            self.length = self.source.seek(SeekFrom::End(0))?;
            self.seek(offset)?;
            return Ok(if self.length > known { Outer::Again } else { Outer::Pending });
        }
        self.part = Part::Over;
        self.damage(offset, self.length - offset.min(self.length), reason.into());
        Ok(Outer::Again)
    }

    pub(super) fn seek(&mut self, position: u64) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(position))?;
        self.position = position;
        Ok(())
    }

    fn end_magic(&mut self) -> io::Result<()> {
        let rest = self.length - self.position;
        let mut magic = [0; MAGIC.len()];
        let whole = rest >= magic.len() as u64;
        if whole {
            self.source.read_exact(&mut magic)?;
        }
        let was = std::mem::replace(&mut self.part, Part::Over);
        if !whole || magic != MAGIC {
            self.damage(self.position, rest, "the magic bytes at the end are missing".into());
        } else if rest > magic.len() as u64 {
            let position = self.position + magic.len() as u64;
            self.damage(position, rest - magic.len() as u64, "the file continues after its end".into());
        } else if was == Part::Data && !self.has_damage() {
            self.damage(self.position, 0, "the end of the data is not marked".into());
        }
        self.part = Part::Over;
        Ok(())
    }

    /// Feeds a chunk to the decompressor, which verifies it before anything comes out. One that claims to decompress to more than
    /// there is memory for is refused; one that lies is found out as it is decompressed.
    fn open_chunk(&mut self, offset: u64, prefix: &[u8]) {
        let limit = self.limits.record();
        let (claimed, overflows) = match parse(op::CHUNK, &self.body, limit) {
            Ok(Record::Chunk { header, data }) => {
                let claimed = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
                // the decompressor does not look where a record of a chunk that is not compressed ends
                let is_plain = header.compression.is_empty();
                (claimed, is_plain && has_checksum(&data, header.uncompressed_crc) && !is_tiled(&data))
            }
            _ => (0, false),
        };
        let is_large = self.body.len().max(claimed) > LARGE;
        let refusal = match (claimed > limit, overflows) {
            (true, _) => Some(format!(
                "a chunk that decompresses to {claimed} bytes exceeds the limit of {limit} (--max-memory)"
            )),
            (_, true) => Some("a record that is longer than its chunk".into()),
            _ => None,
        };
        if refusal.is_none() {
            self.feed(prefix);
        }
        self.open = Some(Open { offset, end: self.position, inside: 0, is_large, refusal });
    }

    /// Hands the record that has been read to the decompressor.
    fn feed(&mut self, prefix: &[u8]) {
        let limit = self.limits.record();
        let decompressor = self.decompressor.get_or_insert_with(|| {
            let options = LinearReaderOptions::default()
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                .with_prevalidate_chunk_crcs(CHECKSUMS_COUNT)
                .with_record_length_limit(limit);
            LinearReader::new_with_options(options)
        });
        for bytes in [prefix, &self.body] {
            decompressor.insert(bytes.len()).copy_from_slice(bytes);
            // no bytes would mean the end of the file
            if !bytes.is_empty() {
                decompressor.notify_read(bytes.len());
            }
        }
    }
}

/// True if a chunk has the checksum that it states, if any.
fn has_checksum(data: &[u8], stated: u32) -> bool {
    !CHECKSUMS_COUNT || stated == 0 || crc32fast::hash(data) == stated
}

/// True if the records of a chunk end where it ends.
fn is_tiled(mut data: &[u8]) -> bool {
    while let Some((prefix, rest)) = data.split_first_chunk::<9>() {
        let length = prefix[1..].try_into().map_or(u64::MAX, u64::from_le_bytes);
        match usize::try_from(length).ok().and_then(|length| rest.get(length..)) {
            Some(rest) => data = rest,
            None => return false,
        }
    }
    data.is_empty()
}
