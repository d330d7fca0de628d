//! The force-sensor receiver card (JR3 class): strain-gauge bridges in, dual-ported RAM on the bus out.
//!
//! [`ForceSensorIf`] is the board. It samples the wires at 8 kHz ([`gauges`]), passes the samples through six
//! cascaded low-passes ([`filter`]) and shows all seven results, their sample counters, warnings and errors as
//! registers ([`registers`]). A scenario that asks for a pure delay gets it in the place of filter 0 ([`delay`]).
//!
//! The age of a value that was read is known from its counter: filter n publishes at multiples of 125 µs · 4ⁿ
//! (n from 0), and its counter is the number of that multiple, modulo 2¹⁶. A scenario that no card can be built
//! from is refused by [`ForceSensorIf::new`]; a running card cannot fail.

mod board;
pub mod delay;
mod faults;
pub mod filter;
pub mod gauges;
pub mod registers;

pub use board::ForceSensorIf;

/// Time between two samples of the sensor: 8 kHz.
pub const SAMPLE_NS: vme::Ns = 125_000;

/// Fx, Fy, Fz, Mx, My, Mz.
pub const AXES: usize = 6;

/// One value per axis, in counts.
pub type Counts = [f64; AXES];
