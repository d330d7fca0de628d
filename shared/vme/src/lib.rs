//! The VMEbus (IEEE 1014) in simulated time: who may use the bus when, how long each transfer
//! takes, and when each processor task runs. Nothing here knows what a value means: the *timing
//! plane* is resolved ahead of the data it carries.
//!
//! * [`program`]: what a master does, as a list of operations.
//! * [`rack`]: the description of bus, boards, processors and tasks.
//! * [`timing`]: resolves programs into transfers with exact times, up to the next decision point.

#![warn(missing_docs)]

pub mod program;
pub mod rack;
pub mod timing;

pub use program::{Access, Direction, Op, Program, Status, Transfer, Width};
pub use timing::{Stop, Timing};

/// Simulated time or duration in integer nanoseconds.
pub type Ns = u64;

/// One second.
pub const SECOND: Ns = 1_000_000_000;
/// One millisecond.
pub const MILLISECOND: Ns = 1_000_000;
/// One microsecond.
pub const MICROSECOND: Ns = 1_000;
