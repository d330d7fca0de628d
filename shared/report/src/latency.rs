//! Latencies measured: by the wall clock where the rack runs in real time, in simulated time otherwise, never added.

mod cycle;
mod journal;
mod output;
mod row;

pub use cycle::{Clock, Cycle, PARTS, WHOLE};
pub use journal::{ChannelCount, Journal, Measurement};
pub(crate) use output::html;
pub use output::{LatencyCheck, LatencyReport, MeasuringCost, text};
pub use row::{LatencyRow, Recorder};
