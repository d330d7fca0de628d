//! Zero-copy channels between the boards of a run: iceoryx2 between processes, plain copies inside one.
//!
//! * [`Domain`]: one iceoryx2 domain per run, with its own prefix and folder; two runs never meet.
//! * [`Exchange`]: the mail of one process's boards, over [`board::routes`].
//! * [`Port`], [`Sender`]: one typed channel.
//! * [`Tampering`]: what a fault plan does to messages; [`Receiver`]: what finds it.
//! * [`wall_ns`]: the clock of all measuring.
//! * [`baseline`]: what the machine's own means take, for comparison.
//! * [`Bell`]: wakes a process up; a word in shared memory and a futex.
//!
//! Every failure is a [`ChannelError`] that names the channel; nothing here waits without a limit.

#![warn(missing_docs)]

pub mod baseline;
mod bell;
mod clock;
mod domain;
mod error;
mod exchange;
mod frame;
mod page;
mod pod;
mod port;
mod receiver;
mod tamper;
mod tampered;

pub use bell::{Bell, Bells};
pub use clock::{sleep_until, wall_ns};
pub use domain::{Domain, remove_leftovers};
pub use error::ChannelError;
pub use exchange::{Exchange, Inboxes};
pub use frame::Frame;
pub use port::{Port, Sender};
pub use receiver::Receiver;
pub use tamper::{Tamper, TamperKind, Tampering};
