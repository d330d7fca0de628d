//! A truncated or damaged record made whole: everything readable is written anew, with a summary.
//!
//! Chunks are taken whole or not at all (their CRC decides); a kill therefore loses the last chunk.
//! Attachments and metadata are carried over.

use crate::reading::{self, Raw, Records};
use crate::record::{self, METADATA};
use mcap::records::Record;
use mcap::{McapError, Writer};
use messages::Ns;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Why a record cannot be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The input cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The input is no MCAP file, not even the beginning of one.
    #[error("{}: not an MCAP file: {source}", path.display())]
    NoRecord {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: McapError,
    },
    /// The output cannot be written.
    #[error("{}: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: McapError,
    },
    /// Input and output are the same file.
    #[error("{}: the recovered record must be another file", path.display())]
    SameFile {
        /// Which file.
        path: PathBuf,
    },
}

/// What was recovered and what is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recovered {
    /// Messages written anew.
    pub messages: u64,
    /// Chunks that were damaged and left out.
    pub damaged_chunks: u64,
    /// The input has its closing part: it was not cut short.
    pub was_complete: bool,
    /// Bytes at the end of the input that belong to no whole record.
    pub bytes_lost: u64,
    /// Simulated time of the last message, ns.
    pub last: Ns,
    /// Simulated length of the run, ns, where the record's metadata says it.
    pub duration: Option<Ns>,
    /// Topics with messages missing in between, and how many (by their sequence numbers).
    pub gaps: BTreeMap<String, u64>,
}

impl Recovered {
    /// True where nothing is missing.
    pub fn is_complete(&self) -> bool {
        self.was_complete && self.damaged_chunks == 0 && self.gaps.is_empty()
    }
}

impl fmt::Display for Recovered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |ns: Ns| ns as f64 * 1e-9;
        write!(
            f,
            "{} messages recovered, up to {:.3} s",
            self.messages,
            seconds(self.last)
        )?;
        if let Some(duration) = self.duration {
            write!(f, " of {:.3} s", seconds(duration))?;
        }
        if self.is_complete() {
            return write!(f, "; nothing is missing");
        }
        if !self.was_complete {
            write!(
                f,
                "\nmissing: what was recorded after {:.3} s",
                seconds(self.last)
            )?;
            write!(f, " ({} bytes of an unfinished chunk)", self.bytes_lost)?;
        }
        if self.damaged_chunks > 0 {
            write!(f, "\nmissing: {} damaged chunks", self.damaged_chunks)?;
        }
        for (topic, missing) in &self.gaps {
            write!(f, "\nmissing: {missing} messages of {topic} in between")?;
        }
        Ok(())
    }
}

/// Writes all that can be read of `input` to `output`.
pub fn recover(input: &Path, output: &Path) -> Result<Recovered, RecoverError> {
    let unreadable = |source| RecoverError::Read {
        path: input.to_owned(),
        source,
    };
    let file = reading::open(input).map_err(unreadable)?;
    if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize())
        && from == to
    {
        return Err(RecoverError::SameFile {
            path: output.to_owned(),
        });
    }
    let size = file.metadata().map_err(unreadable)?.len();
    let unwritable = |source| RecoverError::Write {
        path: output.to_owned(),
        source,
    };

    let mut copy: Option<Copy> = None;
    let mut good = 0; // end of the last whole record
    for raw in Records::of_file(file, true) {
        let raw = match raw {
            Ok(raw) => raw,
            Err(McapError::Io(source)) => return Err(unreadable(source)),
            Err(source) if copy.is_none() => {
                return Err(RecoverError::NoRecord {
                    path: input.to_owned(),
                    source,
                });
            }
            Err(_) => break,
        };
        let Ok(record) = raw.parse() else { break };
        good += raw.len();
        match (record, &mut copy) {
            (Record::Header(_), None) => {
                copy = Some(Copy::new(output).map_err(unwritable)?);
                good += mcap::MAGIC.len() as u64;
            }
            (Record::DataEnd(_), Some(copy)) => {
                copy.recovered.was_complete = true;
                break;
            }
            (Record::Chunk { .. }, Some(copy)) => copy.take_chunk(&raw).map_err(unwritable)?,
            (record, Some(copy)) => copy.take(record).map_err(unwritable)?,
            (_, None) => break,
        }
    }
    let Some(mut copy) = copy else {
        return Err(RecoverError::NoRecord {
            path: input.to_owned(),
            source: McapError::UnexpectedEof,
        });
    };
    if !copy.recovered.was_complete {
        copy.recovered.bytes_lost = size.saturating_sub(good);
    }
    copy.finish().map_err(unwritable)
}

struct Copy {
    writer: Writer<mcap::write::NoSeek<io::BufWriter<File>>>,
    recovered: Recovered,
    /// Topic by channel number.
    topics: BTreeMap<u16, String>,
    next_sequence: BTreeMap<u16, u32>,
}

impl Copy {
    fn new(output: &Path) -> mcap::McapResult<Copy> {
        let writer = record::options().create(record::sink(output)?)?;
        Ok(Copy {
            writer,
            recovered: Recovered::default(),
            topics: BTreeMap::new(),
            next_sequence: BTreeMap::new(),
        })
    }

    /// All of a chunk, or nothing where it is damaged.
    fn take_chunk(&mut self, chunk: &Raw) -> mcap::McapResult<()> {
        let is_sound = |raw: mcap::McapResult<Raw>| raw.is_ok_and(|raw| raw.parse().is_ok());
        if !chunk.records().all(is_sound) {
            self.recovered.damaged_chunks += 1;
            return Ok(());
        }
        chunk.records().try_for_each(|record| self.take(record?.parse()?))
    }

    fn take(&mut self, record: Record) -> mcap::McapResult<()> {
        match record {
            Record::Message { header, data } if self.topics.contains_key(&header.channel_id) => {
                self.writer.write_to_known_channel(&header, &data)?;
                self.recovered.messages += 1;
                self.recovered.last = self.recovered.last.max(header.publish_time);
                let expected = self
                    .next_sequence
                    .insert(header.channel_id, header.sequence.wrapping_add(1))
                    .unwrap_or(0);
                if header.sequence > expected {
                    let topic = self.topics[&header.channel_id].clone();
                    *self.recovered.gaps.entry(topic).or_default() +=
                        u64::from(header.sequence - expected);
                }
            }
            other => {
                match &other {
                    Record::Channel(channel) => {
                        self.topics.insert(channel.id, channel.topic.clone());
                    }
                    Record::Metadata(metadata) if metadata.name == METADATA => {
                        let stated = metadata.metadata.get("duration_ns");
                        self.recovered.duration = stated.and_then(|ns| ns.parse().ok());
                    }
                    _ => {}
                }
                record::describe(&mut self.writer, other)?;
            }
        }
        Ok(())
    }

    fn finish(mut self) -> mcap::McapResult<Recovered> {
        self.writer.finish()?;
        self.writer.into_inner().flush()?;
        Ok(self.recovered)
    }
}
