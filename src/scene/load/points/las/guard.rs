//! What the decompressor reads through: it makes room for the layers of a chunk before it looks whether the file is that long.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::check::Checked;

/// A file of chunks in layers, whose lengths are checked as they pass by; of other files all passes.
///
/// A chunk is a point as it is, a count, the lengths of all layers (four bytes each), and the layers. Chunks follow each
/// other, and the decompressor reads them from the first to the last once it has read the table of chunks.
pub(super) struct Guard {
    file: BufReader<File>,
    /// Where the first chunk begins.
    chunks_start: u64,
    file_bytes: u64,
    /// Bytes of a chunk before the lengths.
    head_bytes: u64,
    layers: Option<u64>,
    /// Whether the first chunk was begun.
    started: Arc<AtomicBool>,
    part: Part,
    /// Bytes that are left of it.
    left: u64,
    /// The length that is being read, and the sum of those before it.
    word: u32,
    sum: u64,
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    BeforeChunks,
    Head,
    Lengths,
    Layers,
}

impl Guard {
    pub(super) fn new(file: BufReader<File>, checked: &Checked, started: Arc<AtomicBool>) -> Self {
        Self {
            file,
            // The place of the table comes first.
            chunks_start: checked.start + 8,
            file_bytes: checked.file_bytes,
            head_bytes: checked.record_bytes + 4,
            layers: checked.layers,
            started,
            part: Part::BeforeChunks,
            left: u64::MAX,
            word: 0,
            sum: 0,
        }
    }

    /// Follows bytes that were read.
    fn pass(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let Some(layers) = self.layers else { return Ok(()) };
        while !bytes.is_empty() && self.part != Part::BeforeChunks {
            let step = usize::try_from(self.left).map_or(bytes.len(), |left| left.min(bytes.len()));
            let (now, rest) = bytes.split_at(step);
            if self.part == Part::Lengths {
                for (&byte, left) in now.iter().zip((1..=self.left).rev()) {
                    // Little endian: the first byte is the lowest.
                    self.word = self.word >> 8 | u32::from(byte) << 24;
                    if left % 4 == 1 {
                        self.sum += u64::from(self.word);
                    }
                }
                if self.sum > self.file_bytes {
                    let problem = "has a chunk that is longer than the file";
                    return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
                }
            }
            self.left -= step as u64;
            bytes = rest;
            // A part may be empty.
            while self.left == 0 {
                (self.part, self.left) = match self.part {
                    Part::Head => (Part::Lengths, 4 * layers),
                    Part::Lengths => (Part::Layers, std::mem::take(&mut self.sum)),
                    Part::Layers | Part::BeforeChunks => (Part::Head, self.head_bytes),
                };
            }
        }
        Ok(())
    }
}

impl Read for Guard {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(out)?;
        self.pass(&out[..count])?;
        Ok(count)
    }
}

impl Seek for Guard {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.layers.is_some() && to == SeekFrom::Start(self.chunks_start) {
            (self.part, self.left) = (Part::Head, self.head_bytes);
            self.started.store(true, Ordering::Relaxed);
        }
        self.file.seek(to)
    }
}
