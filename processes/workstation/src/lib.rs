//! The supervisory workstation (a Sun behind its VME–VME adaptor): it reads the control computer's state block and
//! commands the scenario's segments one after the other.
//!
//! [`Workstation`] is the board; [`commands`] turns segments into command blocks; [`sender`] decides what is sent when,
//! and again; [`operator`] acknowledges a stop. A scenario without a console task or a mailbox is refused by [`Workstation::new`]; later, a command
//! that is never accepted is given up with an event.

mod board;
pub mod commands;
pub mod operator;
pub mod sender;

pub use board::Workstation;
