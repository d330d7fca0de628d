//! What the receiver of a message finds wrong with it.

use crate::{BoardId, Detector};

/// A finding of a receiver, as it reaches the board that the message was for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defect {
    /// Who sent the message.
    pub from: BoardId,
    /// What is wrong with it.
    pub kind: DefectKind,
    /// How much, in the unit that the kind states.
    pub figure: f64,
}

/// What may be wrong with a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefectKind {
    /// Its CRC-32 is wrong, and it has been discarded; its number as it came.
    Corrupted,
    /// Messages before it are missing; how many.
    Gap,
    /// It has come before, and has been discarded; its number.
    Repeated,
    /// Later ones have come before it, and it has been discarded; its number.
    Overtaken,
    /// It was too long on its way; how long, ms.
    Late,
}

impl Defect {
    /// The check that has found it.
    pub fn detector(&self) -> Detector {
        match self.kind {
            DefectKind::Corrupted => Detector::Checksum,
            DefectKind::Gap | DefectKind::Repeated | DefectKind::Overtaken => Detector::Sequence,
            DefectKind::Late => Detector::MessageAge,
        }
    }
}
