//! What the workstation reads from the control computer's dual-ported RAM.

use bytemuck::{Pod, Zeroable};

/// State block of the control computer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Telemetry {
    /// Instant at which the content was sampled by the read, ns.
    pub t: u64,
    /// Instant at which the control computer wrote the content, ns.
    pub written: u64,
    /// Epoch of the last command accepted.
    pub epoch: u32,
    /// Index of the segment that began last, `u32::MAX` before the first; after a stop, the one that it interrupted.
    pub segment: u32,
    /// Safety state in the low byte (0 run, 1 degraded, 2 SS2 hold, 3 SS1 stop, 4 STO), and [`Telemetry::CLEAR`].
    pub state: u32,
    /// Heartbeat: activation number of the control task.
    pub heartbeat: u32,
    /// Index of the last segment that is known, in force or waiting; `u32::MAX` where none is, as after a stop.
    pub last: u32,
    /// Zero.
    pub reserved: u32,
    /// When that segment starts, ns.
    pub last_start: u64,
    /// Tool position in the task frame, m.
    pub position: [f64; 3],
    /// Measured wrench in the task frame, N and Nm.
    pub wrench: [f64; 6],
}

impl Telemetry {
    /// Bit of [`Telemetry::state`]: a hold or STO whose cause is gone, with the arm at rest. It can be acknowledged.
    pub const CLEAR: u32 = 0x100;

    /// Whether the arm is held or stopped, or being so.
    pub fn is_stopped(&self) -> bool {
        self.state & 0xFF >= 2
    }

    /// Whether an acknowledgement would end the stop.
    pub fn is_clear(&self) -> bool {
        self.state & Telemetry::CLEAR != 0
    }
}
