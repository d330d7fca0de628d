//! Latencies measured: by the wall clock where the rack runs in real time, in simulated time otherwise, never added.

mod cost;
mod cycle;
mod journal;
mod output;
mod row;

pub use cost::{Compared, CostRow, MeasuringCost, Stretch};
pub use cycle::{Clock, Cycle, PARTS, WHOLE};
pub use journal::{ChannelCount, Journal, Measurement};
pub(crate) use output::html;
pub use output::{LatencyCheck, LatencyReport, text};
pub use row::{LatencyRow, Recorder};
