//! Description of the rack: bus timing, slave windows, processors and their tasks.
//!
//! Times are modelled figures of 1990s boards (confidence A read in a manual, B derived, C estimate);
//! all of it is configuration.

use crate::Ns;
use crate::program::Width;
use serde::{Deserialize, Serialize};

/// The whole rack as the timing plane sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rack {
    /// Bus and arbiter.
    #[serde(default)]
    pub bus: Bus,
    /// Slave windows, any order.
    #[serde(default)]
    pub slaves: Vec<Slave>,
    /// Tasks, any order; a task's index is its identity.
    #[serde(default)]
    pub tasks: Vec<Task>,
}

/// Timing of the data transfer bus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bus {
    /// BR* to BBSY* when the requester does not own the bus yet (100–500 ns, C).
    pub arbitration_ns: Ns,
    /// Address set-up to DS* (A).
    pub address_ns: Ns,
    /// DTACK* to the end of the cycle (C).
    pub handshake_ns: Ns,
    /// Additional stall of the processor after a read (0.3–1 µs, A).
    pub read_stall_ns: Ns,
    /// DS* to BERR* where no slave answers (8, 64 or 256 µs settings, A).
    pub bus_timer_ns: Ns,
}

impl Default for Bus {
    fn default() -> Self {
        Bus { arbitration_ns: 300, address_ns: 35, handshake_ns: 100, read_stall_ns: 300, bus_timer_ns: 64_000 }
    }
}

/// One address window of a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slave {
    /// Card name, for example `encoder-2`.
    pub name: String,
    /// Board object that answers, for example `encoder_if`.
    pub board: String,
    /// Slot of the card, 1 to 21.
    pub slot: u8,
    /// Address modifier that it answers to.
    pub am: u8,
    /// First byte address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Widest cycle.
    pub width: Width,
    /// DS* to DTACK* of a read.
    pub read_ns: Ns,
    /// DS* to DTACK* of a write.
    pub write_ns: Ns,
}

/// One periodic task of a processor card. Its program comes from the board that runs it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name, for example `control`.
    pub name: String,
    /// Board object that decides, for example `control_computer`.
    pub board: String,
    /// Processor card that it runs on.
    pub processor: String,
    /// Time between releases.
    pub period_ns: Ns,
    /// First release.
    #[serde(default)]
    pub offset_ns: Ns,
}
