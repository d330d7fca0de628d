//! What the chassis keeps account of: who used the bus, and where the time from sensor to actuator went. Simulated times.

use bytemuck::{Pod, Zeroable};

/// Buckets of a histogram.
pub const BUCKETS: usize = 16;
/// The first bucket holds times up to this one, each following one up to twice as much, the last one all that are longer.
pub const FIRST_BUCKET_NS: u64 = 128;

/// Use of the bus by one master since the start.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct MasterUse {
    /// Counted up to this instant, ns.
    pub t: u64,
    /// Time for which it kept the bus from others, ns.
    pub held_ns: u64,
    /// Longest time from request to grant, ns.
    pub wait_max_ns: u64,
    /// Longest time from grant to the free bus, ns.
    pub service_max_ns: u64,
    /// Number of the master: processor cards first, then adaptors, then generators of traffic.
    pub master: u32,
    /// Transfers that ended, however.
    pub transfers: u32,
    /// Of these in BERR*.
    pub bus_errors: u32,
    /// Of these given up by the access timer.
    pub access_timeouts: u32,
    /// Histogram of the times from request to grant.
    pub wait: [u32; BUCKETS],
    /// Histogram of the times from grant to the free bus.
    pub service: [u32; BUCKETS],
}

/// Parts of the way from sensor to actuator: filter, card, arbitration, transfer, wait for task, execution, write.
pub const PARTS: usize = 7;

/// Where the time from what the force sensor felt to the last D/A's change went, for one job of the control computer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct SensorPath {
    /// The last D/A changes, ns.
    pub t: u64,
    /// The value was felt, ns.
    pub felt: u64,
    /// Time of each part, ns; together `t` − `felt`.
    pub parts: [u64; PARTS],
    /// Activation number of the task that wrote the D/A.
    pub job: u32,
    /// Zero.
    pub reserved: u32,
}
