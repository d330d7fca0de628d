//! A user's controller in the place of the rack's `control_computer`: it holds the arm where it is at the start, each
//! joint on its own (PD on the motor side plus the arm's weight).
//!
//! Shows all that a master on the bus has to do: state its program once, take the words read, decide, post the words to
//! write. Values that do not come (BERR*) stay as they were.

mod hold;
mod registers;

pub use hold::Hold;
