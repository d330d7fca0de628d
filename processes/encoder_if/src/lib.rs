//! Four encoder cards, two channels each: shaft angles in, counts and speeds on the bus out.
//!
//! [`EncoderIf`] is the board. It keeps what the shafts did lately ([`history`]) and works out a register when it
//! is read, for the exact instant of the access: count, width and wrap and the index latch ([`counter`]), the speed from
//! the times of the encoder's edges ([`velocity`]). A scenario that no card can be built from is refused by
//! [`EncoderIf::new`]; a running card cannot fail.

mod board;
pub mod counter;
mod faults;
pub mod history;
pub mod velocity;

pub use board::EncoderIf;
