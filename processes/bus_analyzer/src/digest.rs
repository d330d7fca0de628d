//! The digest: SHA-256 over all messages of channels outside `/wall/`, here of messages as they come.
//!
//! Messages are ordered by (simulated time, channel name, sequence). Each goes into the hash as
//! `name(channel) name(schema) u64(simulated time, ns) u32(sequence) data`, integers little-endian, where
//! a name and the CDR bytes (encapsulation header included) are preceded by their length as `u32`.
//! Simulated time is the producer's (`publish_time`). Attachments, metadata, seed, compression and the
//! order in the file do not count. The digest of no message is that of the empty string.

use crate::topics::Topic;
use messages::Ns;
use sha2::{Digest as _, Sha256};

/// Digest of messages as they come. All messages of a window's time must come before the step after
/// the next begins; within that they come in any order.
#[derive(Clone, Debug, Default)]
pub struct Digest {
    hash: Sha256,
    pending: Vec<Message>,
    /// CDR bytes of `pending`, one after the other.
    bytes: Vec<u8>,
    /// Everything before has been hashed.
    hashed_until: Ns,
    disordered: bool,
}

#[derive(Clone, Copy, Debug)]
struct Message {
    t: Ns,
    topic: Topic,
    sequence: u32,
    start: usize,
    end: usize,
}

impl Digest {
    /// Adds a message.
    pub fn push(&mut self, topic: Topic, t: Ns, sequence: u32, cdr: &[u8]) {
        self.disordered |= t < self.hashed_until;
        let start = self.bytes.len();
        self.bytes.extend_from_slice(cdr);
        self.pending.push(Message {
            t,
            topic,
            sequence,
            start,
            end: self.bytes.len(),
        });
    }

    /// No message before `t` will come any more.
    pub fn advance(&mut self, t: Ns) {
        self.pending
            .sort_unstable_by_key(|message| (message.t, message.topic, message.sequence));
        let ready = self.pending.partition_point(|message| message.t < t);
        for message in self.pending.drain(..ready) {
            hash_message(&mut self.hash, &message, &self.bytes);
        }
        // the rest moves to the front of the same memory
        let first = self
            .pending
            .iter()
            .map(|message| message.start)
            .min()
            .unwrap_or(self.bytes.len());
        self.bytes.drain(..first);
        for message in &mut self.pending {
            message.start -= first;
            message.end -= first;
        }
        self.hashed_until = t;
    }

    /// The digest of everything pushed, in hexadecimal; `None` where a message came too late to be
    /// put in order.
    pub fn finish(&self) -> Option<String> {
        let mut last = self.clone();
        last.advance(Ns::MAX);
        (!last.disordered).then(|| hexadecimal(last.hash))
    }
}

fn hash_message(hash: &mut Sha256, message: &Message, bytes: &[u8]) {
    let cdr = &bytes[message.start..message.end];
    add(
        hash,
        message.topic.name(),
        message.topic.type_name(),
        message.t,
        message.sequence,
        cdr,
    );
}

/// Adds a message to the hash.
pub(crate) fn add(hash: &mut Sha256, channel: &str, schema: &str, t: Ns, sequence: u32, cdr: &[u8]) {
    for name in [channel, schema] {
        hash.update((name.len() as u32).to_le_bytes());
        hash.update(name);
    }
    hash.update(t.to_le_bytes());
    hash.update(sequence.to_le_bytes());
    hash.update((cdr.len() as u32).to_le_bytes());
    hash.update(cdr);
}

/// The hash in words.
pub(crate) fn hexadecimal(hash: Sha256) -> String {
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}
