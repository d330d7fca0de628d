//! An MCAP file read record by record. Whatever lengths it claims, memory stays within a few times the longest record.

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use std::fs::{File, metadata};
use std::io::{self, Cursor, Read};
use std::path::Path;

/// No record of ours is longer; a length beyond it is damage.
const LONGEST_RECORD: usize = 64 << 20;
/// An opcode that means nothing.
const UNREAD: u8 = 0xFF;
/// Bytes read at once: a claimed length costs nothing until its bytes have come.
const PIECE: usize = 64 << 10;

/// Opens a record. A device or pipe is none: it may never end.
pub fn open(path: &Path) -> io::Result<File> {
    match metadata(path)?.is_file() {
        true => File::open(path),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")),
    }
}

/// A record as it stands in the file.
pub struct Raw {
    opcode: u8,
    body: Vec<u8>,
}

impl Raw {
    /// Bytes in the file.
    pub fn len(&self) -> u64 {
        1 + 8 + self.body.len() as u64
    }

    /// Whether it holds other records.
    pub fn is_chunk(&self) -> bool {
        self.opcode == op::CHUNK
    }

    /// What it says; an index, which nothing here goes by, is not looked into.
    pub fn parse(&self) -> McapResult<Record<'_>> {
        let opcode = match self.opcode {
            op::MESSAGE_INDEX | op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX | op::STATISTICS => UNREAD,
            opcode => opcode,
        };
        mcap::parse_record(opcode, &self.body)
    }

    /// The records in it, where it is a chunk; the last one is an error where its CRC is wrong.
    pub fn records(&self) -> Records<impl Read> {
        let mut head = [0; 1 + 8];
        head[0] = self.opcode;
        head[1..].copy_from_slice(&(self.body.len() as u64).to_le_bytes());
        let options = LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true);
        Records::new(Cursor::new(head).chain(&self.body[..]), options.with_validate_chunk_crcs(true))
    }
}

/// The records of a stream in their order.
pub struct Records<R> {
    input: R,
    reader: LinearReader,
}

impl<R: Read> Records<R> {
    /// Those of a file, with whole chunks among them. One that `may_be_cut` may lack its end.
    pub fn of_file(input: R, may_be_cut: bool) -> Records<R> {
        Records::new(input, LinearReaderOptions::default().with_emit_chunks(true).with_skip_end_magic(may_be_cut))
    }

    fn new(input: R, options: LinearReaderOptions) -> Records<R> {
        let reader = LinearReader::new_with_options(options.with_record_length_limit(LONGEST_RECORD));
        Records { input, reader }
    }
}

/// Shows `look` every record of a whole file, those in chunks one by one; `damaged` makes its error of what is wrong with the file.
pub fn each_record<E>(
    file: &File,
    damaged: impl Fn(McapError) -> E,
    mut look: impl FnMut(Record<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut look = |raw: McapResult<Raw>| look(raw.map_err(&damaged)?.parse().map_err(&damaged)?);
    for raw in Records::of_file(file, false) {
        match raw {
            // a chunk holds no chunk
            Ok(chunk) if chunk.is_chunk() => chunk.records().try_for_each(&mut look)?,
            raw => look(raw)?,
        }
    }
    Ok(())
}

impl<R: Read> Iterator for Records<R> {
    type Item = McapResult<Raw>;

    fn next(&mut self) -> Option<McapResult<Raw>> {
        loop {
            match self.reader.next_event()? {
                Ok(LinearReadEvent::ReadRequest(need)) => match self.input.read(self.reader.insert(need.min(PIECE))) {
                    Ok(read) => self.reader.notify_read(read),
                    Err(error) => return Some(Err(error.into())),
                },
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let raw = Raw { opcode, body: data.to_vec() };
                    return Some(if raw.is_sound() { Ok(raw) } else { Err(McapError::UnexpectedEoc) });
                }
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

impl Raw {
    /// Whether the lengths in it are those of what is there; their reader makes room, or counts on it, first.
    fn is_sound(&self) -> bool {
        // bytes before its strings, how many they are, whether a map of strings follows, bytes that must follow
        let (before, strings, map, behind) = match self.opcode {
            op::HEADER => (0, 2, false, 0),
            op::SCHEMA => (2, 2, false, 4),
            op::CHANNEL => (4, 2, true, 0),
            op::CHUNK => (28, 1, false, 8),
            op::ATTACHMENT => (16, 2, false, 12),
            op::METADATA => (0, 1, true, 0),
            _ => return true,
        };
        let mut rest = self.body.get(before..);
        for _ in 0..strings {
            rest = rest.and_then(after_string);
        }
        if map {
            rest = rest.and_then(after_map);
        }
        rest.is_some_and(|rest| rest.len() >= behind) && (!self.is_chunk() || self.is_filled())
    }

    /// Whether its records fill a chunk that is not compressed.
    fn is_filled(&self) -> bool {
        let Ok(Record::Chunk { header, data }) = self.parse() else { return false };
        let mut rest = Some(&data[..]).filter(|_| header.compression.is_empty());
        while let Some([_opcode, record @ ..]) = rest {
            rest = record.split_first_chunk().and_then(|(length, content)| after(content, u64::from_le_bytes(*length)));
            if rest.is_none() {
                return false;
            }
        }
        true
    }
}

/// What follows this many bytes.
fn after(bytes: &[u8], length: u64) -> Option<&[u8]> {
    bytes.get(usize::try_from(length).ok()?..)
}

/// What follows a string.
fn after_string(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    after(rest, u32::from_le_bytes(*length).into())
}

/// What follows a map of strings.
fn after_map(bytes: &[u8]) -> Option<&[u8]> {
    let (length, mut rest) = bytes.split_first_chunk()?;
    let end = rest.len().checked_sub(u32::from_le_bytes(*length) as usize)?;
    while rest.len() > end {
        rest = after_string(rest)?;
    }
    Some(rest)
}
