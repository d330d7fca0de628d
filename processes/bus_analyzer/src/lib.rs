//! Bus analyzer: the card that sits in a slot and records, and the tools for its records.
//!
//! * [`BusAnalyzer`]: the board. It turns probes, events and transfers into ROS 2 messages ([`encode`] on
//!   [`cdr`], described by [`topics`] and [`schema`]) and hands them to a [`record`] and to a [`digest`].
//! * [`digest_file`]: the SHA-256 of all that a record says in simulated time.
//! * [`recover()`]: a truncated record made whole; [`join()`]: one record of several parts.
//!
//! A record that cannot be written any more is given up; the rack goes on and [`BusAnalyzer::lost`] says why.

mod board;
pub mod cdr;
pub mod digest;
pub mod encode;
mod file_digest;
pub mod join;
mod reading;
pub mod record;
pub mod recover;
pub mod robot;
pub mod schema;
pub mod topics;

pub use board::BusAnalyzer;
pub use file_digest::{DigestError, digest_file};
pub use join::{JoinError, Joined, join};
pub use record::Lost;
pub use recover::{RecoverError, Recovered, recover};
pub use topics::Topic;
