//! Description of the rack: bus timing, slave windows, masters, interrupters, adaptors and tasks.
//!
//! Times are modelled figures of 1990s boards (confidence A read in a manual, B derived, C estimate);
//! all of it is configuration, and what is left out behaves like the nominal rack. Whether a
//! description makes sense is checked in [`crate::check`].

use crate::Ns;
use crate::adaptor::Adaptor;
use crate::arbiter::Mode;
use crate::cycle;
use crate::interrupt::Interrupter;
use crate::processor::Processor;
use crate::program::{Access, Width};
use crate::traffic::Traffic;
use serde::{Deserialize, Serialize};

/// The whole rack as the timing plane sees it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rack {
    /// Bus and arbiter.
    pub bus: Bus,
    /// Slave windows, any order.
    pub slaves: Vec<Slave>,
    /// Processor cards. A card that a task names and that is not described here gets every default
    /// and the lowest free slot.
    pub processors: Vec<Processor>,
    /// Tasks, any order; a task's index is its identity.
    pub tasks: Vec<Task>,
    /// Interrupters, any order.
    pub interrupters: Vec<Interrupter>,
    /// Adaptors to other buses.
    pub adaptors: Vec<Adaptor>,
    /// Background traffic.
    pub traffic: Vec<Traffic>,
}

/// Arbiter, timers and the timing of the data transfer bus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bus {
    /// How the arbiter in slot 1 chooses among the levels.
    pub arbiter: Mode,
    /// BR* to BBSY* when the requester does not own the bus yet (100–500 ns, C).
    pub arbitration_ns: Ns,
    /// Additional time of a grant or acknowledge for each slot that the daisy chain passes (20–40 ns, C).
    pub chain_ns: Ns,
    /// Address set-up to DS* (A).
    pub address_ns: Ns,
    /// DTACK* to the end of the cycle (C).
    pub handshake_ns: Ns,
    /// Additional stall of the processor after a read (0.3–1 µs, A).
    pub read_stall_ns: Ns,
    /// DS* to BERR* where no slave answers (8, 64 or 256 µs settings, A).
    pub bus_timer_ns: Ns,
    /// BR* to giving up where the bus is not granted (64 µs–1 ms, A).
    pub access_timer_ns: Ns,
    /// Each access of a program takes this long, whatever its slave and whoever else is on the bus: a bus that is not
    /// modelled, to compare with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub constant_ns: Option<Ns>,
}

impl Default for Bus {
    fn default() -> Self {
        Bus {
            arbiter: Mode::Pri,
            arbitration_ns: 300,
            chain_ns: 30,
            address_ns: 35,
            handshake_ns: 100,
            read_stall_ns: 300,
            bus_timer_ns: 64_000,
            access_timer_ns: 1_000_000,
            constant_ns: None,
        }
    }
}

/// One address window of a board.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slave {
    /// Card name, for example `encoder-2`.
    pub name: String,
    /// Card that carries the window where it is none of its own: a processor card's dual-ported RAM, an adaptor's window.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub card: Option<String>,
    /// Board object that answers, for example `encoder_if`.
    pub board: String,
    /// Slot of the card, 1 to 21.
    pub slot: u8,
    /// Address modifier that it answers to; the block modifier of the same space reaches it too.
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
    /// Mailbox or location monitor: a write or an address-only cycle here raises this interrupter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub monitor: Option<String>,
    /// The window leads through this adaptor to another bus, and answers only while its link is up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptor: Option<String>,
    /// Where the window lies on that other bus; default: at the same address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remote_base: Option<u32>,
}

impl Slave {
    /// Name of the card in the slot.
    pub fn card(&self) -> &str {
        self.card.as_deref().unwrap_or(&self.name)
    }

    /// Whether the window holds the first byte of the access.
    pub fn answers(&self, access: &Access) -> bool {
        cycle::single(self.am) == cycle::single(access.am)
            && access.addr >= self.base
            && access.addr - self.base < self.size
    }
}

/// One task of a processor card. Its program comes from the board that runs it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name, for example `control`.
    pub name: String,
    /// Board object that decides, for example `control_computer`.
    pub board: String,
    /// Processor card that it runs on.
    pub processor: String,
    /// Time between releases; where an event releases the task, the shortest time between two.
    pub period_ns: Ns,
    /// First release by the timer.
    #[serde(default)]
    pub offset_ns: Ns,
    /// Higher preempts lower; equal priorities run in the order of the list.
    #[serde(default)]
    pub priority: u8,
    /// What releases a job.
    #[serde(default)]
    pub release: Release,
    /// What happens to a release while the job before still runs; `skip` where it is not stated. A task that states it may
    /// have jobs that need more than its period even alone on the bus; any other is refused then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overrun: Option<Overrun>,
    /// How often an access that ended in BERR* is tried again at once.
    #[serde(default)]
    pub retries: u8,
}

/// What releases the jobs of a task.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Release {
    /// The processor card's own timer, every `period_ns`.
    #[default]
    Timer,
    /// The interrupt of the interrupter of this name.
    Interrupt(String),
    /// The task reads a status register over the bus until the event has come.
    Poll(Poll),
}

/// A polling loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poll {
    /// Interrupter whose event is waited for; it raises no interrupt then.
    pub interrupter: String,
    /// Address modifier of the status register.
    pub am: u8,
    /// Address of the status register.
    pub addr: u32,
    /// Width of the status register.
    pub width: Width,
    /// Time that the processor spends between two looks.
    pub interval_ns: Ns,
}

/// What happens to a release that finds the job before still running.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Overrun {
    /// The release is lost.
    #[default]
    Skip,
    /// The job starts as soon as the one before has ended.
    Late,
    /// The release is lost and [`crate::Stop::Overrun`] tells the chassis, which stops the task for good: its
    /// heartbeat stands still, and the output watchdog takes the torque away.
    Trip,
}
