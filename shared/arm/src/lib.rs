//! The arm: model, kinematics, dynamics, drive data. It knows nothing of the rack.
//!
//! The model ([`ArmModel`]) is constant; the algorithms are free functions under the field's names ([`rnea`], [`crba`],
//! [`aba`], [`jacobian`], …) and take the joint vectors. All quantities are in SI units and in the axes of the base link
//! unless a name says otherwise. Nothing allocates, and nothing uses the system's mathematics library: the same inputs
//! give the same bits on every machine. The algorithms cannot fail; non-finite inputs give non-finite outputs.
//!
//! | file | subject |
//! |---|---|
//! | `model` | constant data of the arm; `urdf` reads it, `inertia` holds and checks one body's |
//! | `kinematics` | tip pose, Jacobian, J̇q̇ |
//! | `rnea`, `crba`, `aba` | inverse dynamics, mass matrix, forward dynamics |
//! | `state` | the same with one kinematics pass shared |
//! | `frozen` | the arm about one posture, for many short steps |
//! | `slide` | the one-axis test arm |
//! | `drives` | gears, friction, amplifiers, brakes: data |
//! | `mismatch` | a plant that differs from the controller's model |
//! | `products` | with a Jacobian |
//! | `lanes`, `sincos`, `exponential` | two joints at a time |
//! | `rotation` | logarithm, exponential, orientation error, roll-pitch-yaw |

mod aba;
mod bodies;
mod chain;
mod crba;
pub mod drives;
mod exponential;
mod frozen;
mod inertia;
mod kinematics;
mod lanes;
mod mismatch;
mod model;
mod products;
mod reach;
mod rnea;
pub mod rotation;
mod sincos;
mod slide;
mod small;
mod state;
mod urdf;

pub use aba::aba;
pub use crba::crba;
pub use frozen::FrozenArm;
pub use inertia::BodyInertia;
pub use kinematics::{Pose, TipMotion, forward_kinematics, jacobian, jdot_qd, joint_origins, tip_motion};
pub use mismatch::Mismatch;
pub use lanes::Pair;
pub use model::{ArmModel, Tool};
pub use products::{dot, transposed_times};
pub use rnea::{bias, gravity_torque, rnea};
pub use small::Real;
pub use state::ArmState;
pub use urdf::UrdfError;

use nalgebra::{SMatrix, SVector};

/// Number of joints.
pub const DOF: usize = 7;
/// One number per joint, joint 1 first.
pub type JointVector = SVector<f64, 7>;
/// Joint by joint, for example the mass matrix (kg m²).
pub type JointMatrix = SMatrix<f64, 7, 7>;
/// Geometric Jacobian: linear rows x, y, z (m/rad), then angular rows x, y, z; base axes, about the tip.
pub type Jacobian = SMatrix<f64, 6, 7>;
/// Twist, acceleration or wrench: linear x, y, z, then angular x, y, z; base axes, about the tip unless said otherwise.
pub type Spatial = SVector<f64, 6>;
/// Standard gravity used by default (m/s²), along −z of the base.
pub const STANDARD_GRAVITY: f64 = 9.81;
