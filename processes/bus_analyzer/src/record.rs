//! The record: an MCAP file of the ROS 2 profile, CDR messages, `ros2msg` schemas, lz4 chunks of 256 KiB.
//!
//! Attachment and metadata come first and every channel is announced in a small chunk of its own, so a
//! file cut short anywhere behind them can be read up to its last whole chunk. The first write that
//! fails ends the record; what was written by then stays.

use crate::schema;
use crate::topics::{TOPICS, Topic};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, WriteOptions, Writer};
use messages::Ns;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Bytes of a chunk before compression.
pub const CHUNK_BYTES: u64 = 256 * 1024;
/// Name of the attachment that holds the resolved scenario.
pub const SCENARIO_ATTACHMENT: &str = "scenario.toml";
/// Name of the metadata record.
pub const METADATA: &str = "vmerack";

/// Quality of service of a latched topic, as ROS 2 bags of every version write it: keep last 1, reliable, transient local.
const LATCHED_QOS: &str = "\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
";

/// Why and when a record ended before its run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the record ends at {at} ns of simulated time: {reason}")]
pub struct Lost {
    /// Simulated time of the first message that is missing, ns. Up to one chunk before it is missing too.
    pub at: Ns,
    /// What the operating system said.
    pub reason: String,
    /// Its number for it; 0 = none.
    pub errno: i32,
}

/// An open record.
pub struct Record {
    writer: Writer<NoSeek<BufWriter<File>>>,
    channels: [u16; TOPICS.len()],
}

/// How records are written; also by [`crate::recover()`].
pub(crate) fn options() -> WriteOptions {
    WriteOptions::new()
        .profile("ros2")
        .library(concat!("vmerack ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
}

/// A file for [`options`]; nothing is written yet.
pub(crate) fn sink(path: &Path) -> std::io::Result<NoSeek<BufWriter<File>>> {
    Ok(NoSeek::new(BufWriter::with_capacity(
        64 * 1024,
        File::create(path)?,
    )))
}

/// Copies what a record says beside its messages; indexes are made anew.
pub(crate) fn describe<W: Write + std::io::Seek>(
    writer: &mut Writer<W>,
    record: mcap::records::Record<'_>,
) -> mcap::McapResult<()> {
    use mcap::records::Record;
    match record {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
        }
        Record::Channel(channel) => {
            let mcap::records::Channel { id, schema_id, topic, message_encoding, metadata } = channel;
            writer.add_channel_with_id(id, schema_id, &topic, &message_encoding, &metadata)?;
        }
        Record::Attachment { header, data, .. } => writer.attach(&Attachment {
            log_time: header.log_time,
            create_time: header.create_time,
            name: header.name,
            media_type: header.media_type,
            data,
        })?,
        Record::Metadata(metadata) => writer.write_metadata(&metadata)?,
        _ => {}
    }
    Ok(())
}

impl Record {
    /// Creates the file with the scenario attached and all channels announced.
    pub fn create(
        path: &Path,
        resolved_toml: &str,
        metadata: BTreeMap<String, String>,
    ) -> mcap::McapResult<Record> {
        let mut writer = options().create(sink(path)?)?;
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: SCENARIO_ATTACHMENT.into(),
            media_type: "application/toml".into(),
            data: Cow::Borrowed(resolved_toml.as_bytes()),
        })?;
        writer.write_metadata(&Metadata {
            name: METADATA.into(),
            metadata,
        })?;
        let mut channels = [0; TOPICS.len()];
        for topic in TOPICS {
            // a test holds that every topic has a schema
            let definition = schema::definition(topic.type_name()).unwrap_or_default();
            let schema = writer.add_schema(topic.type_name(), "ros2msg", definition.as_bytes())?;
            let qos = if topic.is_latched() { LATCHED_QOS } else { "" };
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
            channels[topic as usize] =
                writer.add_channel(schema, topic.name(), "cdr", &metadata)?;
        }
        writer.flush()?;
        Ok(Record { writer, channels })
    }

    /// Appends a message. Simulated time is both its producer's and the recorder's: the file of a run
    /// is the same every time.
    pub fn write(
        &mut self,
        topic: Topic,
        t: Ns,
        sequence: u32,
        cdr: &[u8],
    ) -> mcap::McapResult<()> {
        let channel_id = self.channels[topic as usize];
        self.writer.write_to_known_channel(
            &MessageHeader {
                channel_id,
                sequence,
                log_time: t,
                publish_time: t,
            },
            cdr,
        )
    }

    /// Writes the last chunk and the summary.
    pub fn finish(mut self) -> mcap::McapResult<()> {
        self.writer.finish()?;
        // the writer's own end leaves the last bytes in the buffer, where an error would go unseen
        Ok(self.writer.into_inner().flush()?)
    }
}
