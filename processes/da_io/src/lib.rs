//! D/A cards and parallel I/O card: from register writes to amplifier inputs, amplifier enables and brakes.
//!
//! | file | subject |
//! |---|---|
//! | `board` | windows, bus transfers, the order of events |
//! | `cards` | registers, outputs, safety logic at one instant |
//! | `watchdog` | heartbeat supervision |
//! | `converter` | codes and volts |

mod board;
mod cards;
mod converter;
mod watchdog;

pub use board::DaIo;
