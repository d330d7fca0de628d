//! Scenarios: what a rack consists of, what it does and what is expected of it, as TOML files.
//!
//! [`load`] reads a built-in scenario or a file, applies overrides and checks it; everything that is
//! wrong is a [`ScenarioError`] that shows file, line, key and what was expected.

#![warn(missing_docs)]

pub mod builtin;
mod check;
mod error;
mod faults;
mod file;
mod hardware;
mod integrable;
mod load;
pub mod model;
mod outages;
mod overrides;
mod posture;
mod schedule;
mod source;

pub use check::warnings;
pub use faults::{ClockDrift, Occurrence, Site};
pub use error::{Problem, ScenarioError};
pub use file::read_text;
pub use load::{Document, load};
pub use model::*;
pub use integrable::Stiffness;
pub use hardware::{URDF_LIMIT, nanoseconds, rpy_deg};
pub use outages::Outage;
pub use schedule::{Entry, Progress, Schedule};
pub use source::Source;
pub use posture::{PostureError, inverse_kinematics};

/// Cards that the boards talk to by name; every rack has them.
pub const CARDS: [&str; 9] = [
    "cpu-1-dpram",
    "force-sensor",
    "encoder-1",
    "encoder-2",
    "encoder-3",
    "encoder-4",
    "da-1",
    "da-2",
    "parallel-io",
];
