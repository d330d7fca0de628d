//! What can go wrong with a channel.

use thiserror::Error;

/// A channel that failed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ChannelError {
    /// The channel could not be set up.
    #[error("channel {channel}: {operation} failed: {reason}")]
    Setup {
        /// Name of the channel.
        channel: String,
        /// What was tried.
        operation: &'static str,
        /// What the transport says.
        reason: String,
    },
    /// A message reached fewer readers than the rack's wiring has.
    #[error(
        "channel {channel}: a message reached {reached} of {readers} readers: a reader is gone or its queue is full"
    )]
    Undelivered {
        /// Name of the channel.
        channel: String,
        /// Readers reached.
        reached: usize,
        /// Readers expected.
        readers: usize,
    },
    /// Sending or receiving failed.
    #[error("channel {channel}: {operation} failed: {reason}")]
    Transport {
        /// Name of the channel.
        channel: String,
        /// What was tried.
        operation: &'static str,
        /// What the transport says.
        reason: String,
    },
    /// Messages are missing.
    #[error("channel {channel}: expected message {expected}, got {found}")]
    Lost {
        /// Name of the channel.
        channel: String,
        /// Sequence number expected.
        expected: u32,
        /// Sequence number found.
        found: u32,
    },
    /// A page of shared words is unusable.
    #[error("{path}: {reason}")]
    Page {
        /// The page's file.
        path: String,
        /// What the operating system says.
        reason: String,
    },
}
