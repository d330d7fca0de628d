//! What a run leaves in memory for its report.

use crate::accounting::BusAccount;
use crate::latency::LatencyRow;
use messages::{ControlProbe, Event, PlantProbe};
use serde::Serialize;

/// Probes and events of one run, in the order of time.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// True states of the arm.
    pub plant: Vec<PlantProbe>,
    /// Internals of the control jobs.
    pub control: Vec<ControlProbe>,
    /// What happened.
    pub events: Vec<Event>,
    /// Account of bus and processors, where the host made one.
    pub bus: Option<BusAccount>,
    /// What was measured in real time; empty in simulated time.
    pub measured: Vec<LatencyRow>,
}

impl Trace {
    /// Makes room for so many windows more.
    pub fn reserve(&mut self, windows: usize) {
        self.plant.reserve(windows);
        self.control.reserve(windows);
    }

    /// Adds what was heard in one window.
    pub fn window(&mut self, plant: &[PlantProbe], control: &[ControlProbe], events: &[Event]) {
        self.plant.extend_from_slice(plant);
        self.control.extend_from_slice(control);
        self.events.extend_from_slice(events);
    }
}

/// How a run came to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "how")]
pub enum Ended {
    /// Its simulated time was up.
    Completed,
    /// The plant's simulation left its domain.
    Diverged {
        /// Simulated time, s.
        at_s: f64,
    },
    /// Something else ended it.
    Stopped {
        /// Simulated time, s.
        at_s: f64,
        /// What.
        reason: String,
    },
}

/// Nanoseconds as seconds.
pub(crate) fn seconds(t: vme::Ns) -> f64 {
    t as f64 * 1e-9
}
