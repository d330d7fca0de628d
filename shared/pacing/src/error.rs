//! Why a run could not go on.

use channels::ChannelError;
use thiserror::Error;

/// A run that ended before its time.
#[derive(Debug, Error)]
pub enum RunError {
    /// A process ended.
    #[error("process `{process}` {how}, {when}")]
    Died {
        /// Its name.
        process: String,
        /// Exit code or signal, in words.
        how: String,
        /// Simulated time, in words.
        when: String,
    },
    /// A process neither answers nor uses processor time.
    #[error("process `{process}` is stalled ({how}): no answer for {waited_s:.1} s of wall time, {when}")]
    Stalled {
        /// Its name.
        process: String,
        /// What the operating system says.
        how: String,
        /// Wall time waited.
        waited_s: f64,
        /// Simulated time, in words.
        when: String,
    },
    /// A board answered something that it must not.
    #[error("board `{board}` answered badly: {what}, {when}")]
    BadAnswer {
        /// Its name.
        board: &'static str,
        /// What was wrong.
        what: String,
        /// Simulated time, in words.
        when: String,
    },
    /// A board could not be built.
    #[error("board `{board}`: {reason}")]
    Board {
        /// Its name.
        board: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A process did not do what a signal makes it do.
    #[error("process `{process}` after {signal}: {reason}, {when}")]
    Signal {
        /// Its name.
        process: String,
        /// The signal.
        signal: &'static str,
        /// What the operating system says.
        reason: String,
        /// Simulated time, in words.
        when: String,
    },
    /// A process could not be started.
    #[error("cannot start process `{process}` ({program}): {reason}")]
    Spawn {
        /// Its name.
        process: String,
        /// Program tried.
        program: String,
        /// What the operating system says.
        reason: String,
    },
    /// A channel failed.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The rack description is inconsistent.
    #[error("rack: {0}")]
    Rack(#[from] vme::RackError),
    /// A file of the run folder failed.
    #[error("{path}: {reason}")]
    Folder {
        /// Its path.
        path: String,
        /// What the operating system says.
        reason: String,
    },
    /// The scenario is strict, and the machine refuses what real time needs.
    #[error("real time without {what}: refused, since --strict (realtime.strict) asks for all of it")]
    Refused {
        /// What, each with its remedy.
        what: String,
    },
    /// The user interrupted the run.
    #[error("interrupted, {when}")]
    Interrupted {
        /// Simulated time, in words.
        when: String,
    },
}

/// Simulated time in words.
pub(crate) fn at(t: vme::Ns) -> String {
    format!("at simulated time {:.6} s", t as f64 * 1e-9)
}
