//! What was measured of one act of a board: when on the wall clock, for which simulated time.

use bytemuck::{Pod, Zeroable};

/// One measured act. Wall times are CLOCK_MONOTONIC, ns, and never part of a record; in simulated time they are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Span {
    /// Simulated time of the act, ns.
    pub t: u64,
    /// When it was intended.
    pub due: u64,
    /// When it began; of a message: when it was sent; of a reading: when the arm's sample behind it was sent.
    pub begin: u64,
    /// When it ended; of a message: when it was read.
    pub end: u64,
    /// Of a message: its sequence number; of a reading, decision or output: the job of the control task.
    pub number: u64,
    /// Window in which the board acted.
    pub window: u64,
    /// Of a reading: simulated time of the arm's sample behind it.
    pub origin: u64,
    /// A [`SpanKind`] by number.
    pub kind: u32,
    /// A [`crate::BoardId`] by number: whose stamps these are.
    pub board: u32,
    /// Of a message: index of its route.
    pub channel: u32,
    /// Of a step: it began more than a stage late; of a message: it came after its modelled time.
    pub late: u32,
    /// Of a step: values that newer ones overwrote before they were used.
    pub overwritten: u32,
    /// Of a step: writes made later than their modelled time.
    pub delayed: u32,
}

/// What a [`Span`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum SpanKind {
    /// A board's step.
    Step = 0,
    /// A message on its way from one process to another.
    Hop = 1,
    /// A channel at the end of a run: how many messages were sent.
    Sent = 2,
    /// The force-sensor card answers a job's first reading.
    Read = 3,
    /// The control computer decides a job.
    Decision = 4,
    /// The last value that a job writes to the D/A cards takes effect.
    Output = 5,
}

impl SpanKind {
    /// The kind of that number.
    pub fn from_number(number: u32) -> Option<SpanKind> {
        use SpanKind::*;
        [Step, Hop, Sent, Read, Decision, Output].into_iter().find(|kind| *kind as u32 == number)
    }
}

impl Span {
    /// A span of that kind and board, all else 0.
    pub fn new(kind: SpanKind, board: crate::BoardId) -> Span {
        Span { kind: kind as u32, board: board as u32, ..Span::zeroed() }
    }
}
