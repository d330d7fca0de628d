//! What the workstation tells the control computer.

use bytemuck::{Pod, Zeroable};

/// What a [`Command`] asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum CommandKind {
    /// Append a segment to the queue.
    Segment = 1,
    /// Decelerate and hold (SS2).
    Hold = 2,
    /// Acknowledge a latched stop.
    Acknowledge = 3,
}

/// How the desired pose X_d moves in a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum PathKind {
    /// X_d stays where it is.
    Hold = 0,
    /// X_d goes to the target with a quintic time law (zero speed and acceleration at both ends).
    PointToPoint = 1,
    /// X_d goes along the line at constant speed with quintic blends.
    Line = 2,
    /// X_d jumps to the target.
    Step = 3,
}

/// One command block. All poses and wrenches are in the task frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Command {
    /// Number of the command, from 1, rising by 1: a repeated or stale one is seen by it.
    pub epoch: u32,
    /// A [`CommandKind`] by number.
    pub kind: u32,
    /// Index of the segment.
    pub segment: u32,
    /// A [`PathKind`] by number.
    pub path: u32,
    /// Simulated time at which the segment starts, ns.
    pub start: u64,
    /// Simulated time at which the segment ends, ns.
    pub end: u64,
    /// Time from `start` in which the path is run, ns.
    pub move_time: u64,
    /// Target position of the tool point, m.
    pub position: [f64; 3],
    /// Target orientation of the tool, unit quaternion (w, x, y, z).
    pub orientation: [f64; 4],
    /// Diagonal of S: 1 = impedance axis, 0 = force axis.
    pub selection: [f64; 6],
    /// Diagonal of M_d, kg and kg m².
    pub mass: [f64; 6],
    /// Diagonal of B_d, Ns/m and Nms/rad.
    pub damping: [f64; 6],
    /// Diagonal of K_d, N/m and Nm/rad.
    pub stiffness: [f64; 6],
    /// Desired wrench F_d, N and Nm: what the tool exerts on the environment.
    pub force: [f64; 6],
}
