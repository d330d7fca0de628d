//! The header of every message.

use bytemuck::{Pod, Zeroable};

/// What kind of payload a channel carries. A channel is one kind from one board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Kind {
    /// [`crate::AmplifierCommand`]: wire from D/A and parallel I/O to the drives.
    Amplifier = 0,
    /// [`crate::PlantSample`]: wires from strain gauges, encoders and drives.
    Plant = 1,
    /// [`crate::BusWord`]: register contents moved by bus transfers.
    Words = 2,
    /// [`crate::Command`]: block written by the workstation.
    Commands = 3,
    /// [`crate::Telemetry`]: block read by the workstation.
    Telemetry = 4,
    /// [`crate::PlantProbe`]: state of the arm at the end of a window, for the record.
    PlantProbe = 5,
    /// [`crate::ControlProbe`]: internals of a control job, for the record.
    ControlProbe = 6,
    /// [`crate::Event`]: something that a person wants to know.
    Events = 7,
    /// [`crate::TransferRecord`]: the bus transfers of a window.
    Transfers = 8,
    /// [`crate::MasterUse`]: use of the bus, for the record.
    Masters = 9,
    /// [`crate::SensorPath`]: ways from sensor to actuator, for the record.
    Paths = 10,
}

/// Header of a message: simulated time, order, integrity. `wall_ns` is the only wall-clock value and
/// is never part of a simulated-time record.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Header {
    /// Simulated time of the newest content, ns; of a sealed message, when it was sent.
    pub t: u64,
    /// Number of this message in its channel, from 0.
    pub seq: u32,
    /// CRC-32 over payload, time and number of a sealed message; 0 where no fault is planned, and on wires and probes.
    pub crc: u32,
    /// CLOCK_MONOTONIC at sending, ns: for the transport ledger.
    pub wall_ns: u64,
}
