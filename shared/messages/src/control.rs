//! Internals of one control job, for the record.

use crate::JOINTS;
use bytemuck::{Pod, Zeroable};

/// Everything that a control job knew and decided. Poses, twists, accelerations and wrenches are in
/// the task frame, linear part first; orientations are unit quaternions (w, x, y, z), w ≥ 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ControlProbe {
    /// Simulated time of the decision, ns.
    pub t: u64,
    /// Activation number of the control task.
    pub job: u32,
    /// Index of the segment in force, `u32::MAX` before the first.
    pub segment: u32,
    /// Safety state, see [`crate::Telemetry::state`].
    pub state: u32,
    /// Bits of [`limits`].
    pub limits: u32,
    /// Age of the force sample at the decision, ns: since its filter's output was published.
    pub force_age: u64,
    /// Age of the oldest encoder value at the decision, ns.
    pub encoder_age: u64,
    /// Motor-side joint angles θ/N, rad.
    pub q: [f64; JOINTS],
    /// Motor-side joint speeds, rad/s.
    pub qd: [f64; JOINTS],
    /// Commanded joint accelerations q̈ᵗ, rad/s².
    pub qdd: [f64; JOINTS],
    /// Torques sent to the D/A, after limits, Nm.
    pub torque: [f64; JOINTS],
    /// Tool position X, m.
    pub x: [f64; 3],
    /// Tool orientation.
    pub x_orientation: [f64; 4],
    /// Tool twist Ẋ, m/s and rad/s.
    pub x_dot: [f64; 6],
    /// Target position Xᵗ, m.
    pub xt: [f64; 3],
    /// Target orientation.
    pub xt_orientation: [f64; 4],
    /// Target twist Ẋᵗ.
    pub xt_dot: [f64; 6],
    /// Target acceleration Ẍᵗ, m/s² and rad/s².
    pub xt_ddot: [f64; 6],
    /// Desired position X_d, m.
    pub xd: [f64; 3],
    /// Desired orientation.
    pub xd_orientation: [f64; 4],
    /// Reference acceleration Ẍʳ.
    pub xr_ddot: [f64; 6],
    /// Wrench F_e of the tool on the environment, as measured and compensated, N and Nm.
    pub fe: [f64; 6],
    /// Desired wrench F_d.
    pub fd: [f64; 6],
}

/// Bits of [`ControlProbe::limits`]: which limit acted in this job.
pub mod limits {
    /// |Xᵗ − X| was held at its limit.
    pub const TARGET_ERROR: u32 = 1;
    /// At least one joint torque was saturated.
    pub const TORQUE: u32 = 2;
    /// The joint-limit task was active.
    pub const JOINT_LIMIT: u32 = 4;
}
