//! The VMEbus (IEEE 1014) in simulated time: who may use the bus when, how long each transfer
//! takes, and when each processor task runs. Nothing here knows what a value means: the *timing
//! plane* is resolved ahead of the data it carries.
//!
//! * [`program`]: what a master does, as a list of operations.
//! * [`rack`]: the description of bus, boards, processors and tasks; [`check`] refuses a bad one.
//! * [`timing`]: resolves programs into transfers with exact times, up to the next decision point.
//! * [`arbiter`], [`requester`], [`cycle`], [`interrupt`], [`adaptor`], [`processor`], [`traffic`],
//!   [`fault`]: the parts it is made of, under the standard's names.
//! * [`analysis`]: bounds that no observed time may exceed; [`accounting`]: what was observed.
//! * [`queueing`]: the arbiter alone, under random load.

#![warn(missing_docs)]

pub mod accounting;
pub mod adaptor;
pub mod analysis;
pub mod arbiter;
pub mod check;
pub mod cycle;
pub mod fault;
pub mod interrupt;
pub mod processor;
pub mod program;
pub mod queueing;
pub mod rack;
pub mod requester;
pub mod timer;
pub mod timing;
pub mod traffic;

pub use check::RackError;
pub use fault::{Fault, FaultKind, FaultPlan, Timer};
pub use program::{Access, Direction, Op, Origin, Program, Status, Transfer, Width};
pub use timing::{JobRecord, Log, Sink, Stop, Timing};

/// Simulated time or duration in integer nanoseconds.
pub type Ns = u64;

/// One second.
pub const SECOND: Ns = 1_000_000_000;
/// One millisecond.
pub const MILLISECOND: Ns = 1_000_000;
/// One microsecond.
pub const MICROSECOND: Ns = 1_000;
