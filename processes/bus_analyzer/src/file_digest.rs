//! The digest of a record in a file, within bounded memory: it is read twice, so that only messages that are out of order
//! have to be held.

use crate::digest::{add, hexadecimal};
use crate::reading;
use crate::topics::WALL;
use mcap::records::{MessageHeader, Record};
use mcap::{McapError, McapResult};
use messages::Ns;
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Messages in a block; of each it is known how early those behind its begin are.
const BLOCK: usize = 4096;
/// Bytes of messages that may wait for earlier ones; in a record as it is written some hundred do.
const MOST_WAITING: usize = 256 << 20;
/// What a message that waits takes beside its content, bytes.
const OVERHEAD: usize = 128;

/// Why a file has no digest.
#[derive(Debug, thiserror::Error)]
pub enum DigestError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// It is no whole MCAP file.
    #[error("{}: not a whole MCAP file: {source} (a truncated record is made whole by `vmerack log recover`)", path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        source: McapError,
    },
    /// Its messages are in no order at all.
    #[error("{}: its messages are too far out of order: more than {MOST_WAITING} bytes of them wait for earlier ones", path.display())]
    Disordered {
        /// Which file.
        path: PathBuf,
    },
}

/// Digest of a record, in hexadecimal.
pub fn digest_file(path: &Path) -> Result<String, DigestError> {
    let failed = |error| match error {
        McapError::Io(source) => DigestError::Read { path: path.to_owned(), source },
        source => DigestError::Damaged { path: path.to_owned(), source },
    };
    let mut file = reading::open(path).map_err(|error| failed(error.into()))?;
    let mut begins: Vec<Ns> = Vec::new();
    each_message(&mut file, |i, key, _| match begins.last_mut().filter(|_| i % BLOCK != 0) {
        Some(begin) => *begin = key.t.min(*begin),
        None => begins.push(key.t),
    })
    .map_err(failed)?;
    for i in (1..begins.len()).rev() {
        begins[i - 1] = begins[i - 1].min(begins[i]);
    }

    let mut hash = Sha256::new();
    let mut waiting = Waiting::default();
    each_message(&mut file, |i, key, data| {
        if i % BLOCK == 0
            && let Some(begin) = begins.get(i / BLOCK)
        {
            waiting.take_before(*begin, &mut hash);
        }
        waiting.push(key, i, data);
    })
    .map_err(failed)?;
    if waiting.is_too_long {
        return Err(DigestError::Disordered { path: path.to_owned() });
    }
    waiting.take_all(&mut hash);
    Ok(hexadecimal(hash))
}

/// What messages are ordered by, and the schema's name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    t: Ns,
    channel: Rc<str>,
    sequence: u32,
    schema: Rc<str>,
}

/// Messages that have come before earlier ones, by their key and place in the file.
#[derive(Default)]
struct Waiting {
    messages: BTreeMap<(Key, usize), Vec<u8>>,
    bytes: usize,
    /// There were more than memory is there for; they are forgotten.
    is_too_long: bool,
}

impl Waiting {
    fn push(&mut self, key: Key, place: usize, data: &[u8]) {
        self.bytes += data.len() + OVERHEAD;
        self.is_too_long |= self.bytes > MOST_WAITING;
        if self.is_too_long {
            self.messages.clear();
        } else {
            self.messages.insert((key, place), data.to_vec());
        }
    }

    fn take_before(&mut self, t: Ns, hash: &mut Sha256) {
        while let Some(first) = self.messages.first_entry().filter(|first| first.key().0.t < t) {
            let ((key, _), data) = first.remove_entry();
            self.bytes -= data.len() + OVERHEAD;
            add(hash, &key.channel, &key.schema, key.t, key.sequence, &data);
        }
    }

    fn take_all(self, hash: &mut Sha256) {
        for ((key, _), data) in self.messages {
            add(hash, &key.channel, &key.schema, key.t, key.sequence, &data);
        }
    }
}

/// Calls `take` with every message of channels outside `/wall/`, numbered from 0.
fn each_message(file: &mut File, mut take: impl FnMut(usize, Key, &[u8])) -> McapResult<()> {
    file.rewind()?;
    let (mut known, mut number) = (Known::default(), 0);
    reading::each_record(file, |error| error, |record| {
        match record {
            Record::Schema { header, .. } => known.schema(header.id, header.name)?,
            Record::Channel(channel) => known.channel(channel.id, channel.topic, channel.schema_id)?,
            Record::Message { header, data } => {
                let (channel, schema) = known.of_message(&header)?;
                if !channel.starts_with(WALL) {
                    take(number, Key { t: header.publish_time, channel, sequence: header.sequence, schema }, &data);
                    number += 1;
                }
            }
            _ => {}
        }
        Ok(())
    })
}

/// Names by number, as far as they have been announced.
#[derive(Default)]
struct Known {
    schemas: BTreeMap<u16, Rc<str>>,
    channels: BTreeMap<u16, (Rc<str>, u16)>,
}

impl Known {
    fn schema(&mut self, id: u16, name: String) -> McapResult<()> {
        let known = self.schemas.entry(id).or_insert_with(|| name.as_str().into());
        match **known == *name {
            true => Ok(()),
            false => Err(McapError::ConflictingSchemas(name)),
        }
    }

    fn channel(&mut self, id: u16, topic: String, schema: u16) -> McapResult<()> {
        let (known, of_schema) = self.channels.entry(id).or_insert_with(|| (topic.as_str().into(), schema));
        match **known == *topic && *of_schema == schema {
            true => Ok(()),
            false => Err(McapError::ConflictingChannels(topic)),
        }
    }

    /// Names of channel and schema.
    fn of_message(&self, header: &MessageHeader) -> McapResult<(Rc<str>, Rc<str>)> {
        let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
        let (channel, schema) = self.channels.get(&header.channel_id).ok_or(unknown)?;
        let schema = match self.schemas.get(schema) {
            Some(name) => Rc::clone(name),
            None if *schema == 0 => "".into(),
            None => return Err(McapError::UnknownSchema(channel.to_string(), *schema)),
        };
        Ok((Rc::clone(channel), schema))
    }
}
