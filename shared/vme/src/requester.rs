//! The requester of a master: when it asks for the bus, when it leaves it, and what waits behind it.

use crate::Ns;
use crate::arbiter::Place;
use crate::cycle::Plan;
use crate::program::Transfer;
use serde::{Deserialize, Serialize};

/// When a requester that owns the bus lets go of BBSY*. A *burst* is what cannot be interrupted: one
/// single cycle, or a block transfer up to its 256-byte boundary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReleasePolicy {
    /// Release when done: after the whole access, however many bursts it has.
    #[serde(rename = "RWD")]
    WhenDone,
    /// Release on request: after the burst in which another BR* is seen; kept while nobody asks.
    #[default]
    #[serde(rename = "ROR")]
    OnRequest,
    /// Release on BCLR*: when done, or after the burst in which a higher level asks (PRI).
    #[serde(rename = "RBCLR")]
    OnBclr,
}

impl std::fmt::Display for ReleasePolicy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            ReleasePolicy::WhenDone => "RWD",
            ReleasePolicy::OnRequest => "ROR",
            ReleasePolicy::OnBclr => "release on BCLR*",
        })
    }
}

/// Who is told of the end of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Client {
    /// The stalled processor of this index.
    Processor(u16),
    /// The write buffer of this processor.
    WriteBuffer(u16),
    /// The traffic generator of this index.
    Traffic(u16),
}

/// A transfer that waits for the bus, or is on it.
#[derive(Clone, Copy, Debug)]
pub struct Pending {
    /// The transfer, its later times not known yet.
    pub transfer: Transfer,
    /// Who waits for it.
    pub client: Client,
    /// Its cycles, known once the first burst begins.
    pub plan: Plan,
    /// Cycles done in earlier bursts.
    pub cycles_done: u32,
    /// The first burst has begun.
    pub begun: bool,
    /// Shortest time from one cycle's end to the next (an adaptor's link is slower than the bus).
    pub pace_ns: Ns,
}

/// One master's requester: first come, first served among the master's own transfers.
#[derive(Debug)]
pub struct Requester {
    /// Level and slot.
    pub place: Place,
    /// When it leaves the bus.
    pub release: ReleasePolicy,
    /// Transfers, the first one asking for the bus or on it. As many as the master has clients at most.
    pub queue: Vec<Pending>,
}

impl Clone for Requester {
    fn clone(&self) -> Self {
        Requester { place: self.place, release: self.release, queue: self.queue.clone() }
    }
    // keeps the queue's memory: the chassis copies the timing plane every window
    fn clone_from(&mut self, from: &Self) {
        (self.place, self.release) = (from.place, from.release);
        self.queue.clone_from(&from.queue);
    }
}
