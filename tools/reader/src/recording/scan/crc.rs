//! Checksums of the data section and of the summary.

use mcap::records::{Record, op};

use super::{CHECKSUMS_COUNT, Part, Scan, parse};

impl Scan {
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
}
