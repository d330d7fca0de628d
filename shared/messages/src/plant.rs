//! Wires between the cards and the arm, and the arm's true state for the record.

use crate::JOINTS;
use bytemuck::{Pod, Zeroable};

/// What the D/A and parallel I/O cards drive from `t` on.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AmplifierCommand {
    /// From this instant, ns.
    pub t: u64,
    /// Analog outputs, V, one per joint.
    pub volts: [f64; JOINTS],
    /// Bit i: amplifier of joint i enabled.
    pub enabled: u32,
    /// Bit i: brake of joint i released (a brake without power is engaged).
    pub brake_released: u32,
}

/// Signals of the arm at one plant step.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PlantSample {
    /// Instant, ns.
    pub t: u64,
    /// Strain-gauge bridge: force (N) and moment (Nm) that the flange exerts on the tool side, about the sensor
    /// origin, in sensor axes. It contains the tool's weight and inertia as well as the contact.
    pub wrench: [f64; 6],
    /// Motor shaft angles θ, rad (motor side of the gear).
    pub theta: [f64; JOINTS],
    /// Motor shaft speeds, rad/s.
    pub theta_dot: [f64; JOINTS],
    /// Bits of [`drive_status`].
    pub status: u32,
    /// Zero.
    pub reserved: u32,
}

/// Bits of [`PlantSample::status`].
pub mod drive_status {
    /// Bits 0–6: amplifier of joint i tripped.
    pub const AMPLIFIER_TRIPPED: u32 = 0x7F;
    /// Bits 8–14: joint i beyond its limit switch.
    pub const LIMIT_SWITCH: u32 = 0x7F << 8;
    /// Bits 16–22: brake of joint i is engaged, as the brake's own contact says.
    pub const BRAKE_ENGAGED: u32 = 0x7F << 16;
    /// Emergency-stop chain open.
    pub const EMERGENCY_STOP: u32 = 1 << 24;
    /// A D/A output is not what was written to it, as the card reads it back.
    pub const DA_FAULT: u32 = 1 << 25;
    /// ACFAIL*: the supply is about to go.
    pub const POWER_FAIL: u32 = 1 << 26;
    /// The simulation left its domain (NaN, runaway joint): the run ends.
    pub const DIVERGED: u32 = 1 << 31;
}

/// The arm's true state at the end of a window.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PlantProbe {
    /// Instant, ns.
    pub t: u64,
    /// Link-side joint angles, rad.
    pub q: [f64; JOINTS],
    /// Link-side joint speeds, rad/s.
    pub qd: [f64; JOINTS],
    /// Motor angles divided by the gear ratio, rad.
    pub theta: [f64; JOINTS],
    /// Motor speeds divided by the gear ratio, rad/s.
    pub theta_dot: [f64; JOINTS],
    /// Motor torques at the output side (after saturation), Nm.
    pub motor_torque: [f64; JOINTS],
    /// Torques through the flexible transmissions, Nm.
    pub spring_torque: [f64; JOINTS],
    /// Friction torques at the output side, Nm.
    pub friction_torque: [f64; JOINTS],
    /// Tool point in the task frame, m.
    pub position: [f64; 3],
    /// Tool orientation in the task frame, unit quaternion (w, x, y, z), w ≥ 0.
    pub orientation: [f64; 4],
    /// Contact wrench that the tool exerts on the environment, in task axes about the tool point, N and Nm.
    pub contact: [f64; 6],
    /// Greatest penetration of the surface, m (negative: gap to the surface).
    pub penetration: f64,
    /// Kinetic and potential energy of arm, motors and springs, J.
    pub energy: f64,
    /// Bits of [`drive_status`].
    pub status: u32,
    /// Zero.
    pub reserved: u32,
}
