//! The parts of a record whose recorder was started again, made one record.
//!
//! Scenario, metadata and channels are the first part's: all parts say the same of them. Sequence numbers go on from part
//! to part, so that the digest has an order. What nobody recorded between two parts is returned.

use crate::{reading, record};
use mcap::records::Record;
use mcap::McapError;
use messages::Ns;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Why parts cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// A part cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A part is damaged, or the whole cannot be written.
    #[error("{}: {source}", path.display())]
    Mcap {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: McapError,
    },
}

/// What the joined record covers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Joined {
    /// Between two parts: last instant of the one and first of the next, ns.
    pub gaps: Vec<(Ns, Ns)>,
    /// Simulated time of the last message, ns.
    pub last: Ns,
}

/// Writes the whole parts, in the order of time, to `output` as one record.
pub fn join(parts: &[PathBuf], output: &Path) -> Result<Joined, JoinError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| JoinError::Mcap { path: path.clone(), source }
    };
    let sink = record::sink(output).map_err(|source| failed(output)(source.into()))?;
    let mut writer = record::options().create(sink).map_err(failed(output))?;
    let mut joined = Joined::default();
    // the next message's number on each channel
    let mut next: BTreeMap<u16, u32> = BTreeMap::new();
    for (i, part) in parts.iter().enumerate() {
        let file = reading::open(part).map_err(|source| JoinError::Read { path: part.clone(), source })?;
        let before = next.clone();
        let mut begins = i > 0;
        reading::each_record(&file, failed(part), |record| {
            match record {
                Record::Message { mut header, data } => {
                    let t = header.publish_time;
                    header.sequence =
                        header.sequence.wrapping_add(before.get(&header.channel_id).copied().unwrap_or(0));
                    next.insert(header.channel_id, header.sequence.wrapping_add(1));
                    if std::mem::take(&mut begins) {
                        joined.gaps.push((joined.last, t));
                    }
                    joined.last = joined.last.max(t);
                    writer.write_to_known_channel(&header, &data)
                }
                other if i == 0 => record::describe(&mut writer, other),
                _ => Ok(()),
            }
            .map_err(failed(output))
        })?;
    }
    writer.finish().map_err(failed(output))?;
    writer.into_inner().flush().map_err(|source| failed(output)(source.into()))?;
    Ok(joined)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Record;
    use crate::topics::Topic;

    /// A part with messages at these times (ns), numbered from 0.
    fn part(path: &Path, times: &[Ns]) {
        let mut record = Record::create(path, "seed = 1", BTreeMap::new()).expect("part");
        for (sequence, t) in (0..).zip(times) {
            record.write(Topic::Wrench, *t, sequence, &t.to_le_bytes()).expect("message");
        }
        record.finish().expect("end");
    }

    #[test]
    fn the_whole_has_all_messages_in_order_one_scenario_and_says_what_lies_between_the_parts() {
        let folder = tempfile::tempdir().expect("folder");
        let file = |name: &str| folder.path().join(name);
        let parts = [file("a.mcap"), file("b.mcap"), file("c.mcap")];
        part(&parts[0], &[1, 2, 3]);
        part(&parts[1], &[7, 8]);
        part(&parts[2], &[20]);
        let joined = join(&parts, &file("whole.mcap")).expect("join");
        assert_eq!(joined, Joined { gaps: vec![(3, 7), (8, 20)], last: 20 });
        let bytes = std::fs::read(file("whole.mcap")).expect("whole");
        let stream = mcap::MessageStream::new(&bytes).expect("record");
        let seen: Vec<(u64, u32)> =
            stream.map(|message| message.expect("message")).map(|m| (m.publish_time, m.sequence)).collect();
        assert_eq!(seen, [(1, 0), (2, 1), (3, 2), (7, 3), (8, 4), (20, 5)]);
        let summary = mcap::Summary::read(&bytes).expect("readable").expect("summary");
        assert_eq!((summary.attachment_indexes.len(), summary.metadata_indexes.len()), (1, 1));
        assert!(crate::digest_file(&file("whole.mcap")).is_ok());
    }

    #[test]
    fn a_part_that_is_cut_short_is_refused_with_its_name() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("cut.mcap");
        part(&path, &[1, 2]);
        let bytes = std::fs::read(&path).expect("part");
        std::fs::write(&path, &bytes[..40]).expect("cut");
        let message = join(&[path], &folder.path().join("whole.mcap")).expect_err("cut").to_string();
        assert!(message.contains("cut.mcap"), "{message}");
    }
}
