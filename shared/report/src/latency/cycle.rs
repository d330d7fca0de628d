//! One cycle of the control task: from the arm's sample to the torque that answers it, each part from the stamps of the
//! boards that cause it.

use messages::Span;
use serde::Serialize;

/// Parts of the way, in their order.
pub const PARTS: [&str; 3] = ["arm to force sensor", "force sensor to decision", "decision to D/A"];
/// The whole of it.
pub const WHOLE: &str = "arm to D/A";

/// On which clock stamps are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Simulated time.
    Simulated,
    /// CLOCK_MONOTONIC.
    Wall,
}

/// A cycle that has its torque.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cycle {
    /// Job of the control task, counted from 0.
    pub job: u64,
    /// Simulated time of its decision, s.
    pub decided_s: f64,
    /// Time of each of [`PARTS`], ns.
    pub parts_ns: [u64; 3],
    /// From the arm's stamp and the D/A's stamp alone, ns.
    pub whole_ns: u64,
    /// What happened in it.
    pub notes: Vec<String>,
}

/// A cycle under way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stamps {
    pub read: Option<Span>,
    pub decision: Option<Span>,
    pub output: Option<Span>,
}

impl Stamps {
    /// The cycle; `None` where it was decided without its reading, or never answered.
    pub fn cycle(&self, clock: Clock) -> Option<Cycle> {
        let (read, decision, output) = (self.read?, self.decision?, self.output?);
        let stamps = match clock {
            Clock::Simulated => [read.origin, read.t, decision.t, output.t],
            Clock::Wall => [read.begin, read.end, decision.end, output.end],
        };
        let mut parts_ns = [0; 3];
        for (part, pair) in parts_ns.iter_mut().zip(stamps.windows(2)) {
            *part = pair[1].checked_sub(pair[0])?;
        }
        let [sampled, .., answered] = stamps;
        let (job, decided_s) = (decision.number, decision.t as f64 * 1e-9);
        Some(Cycle { job, decided_s, parts_ns, whole_ns: answered - sampled, notes: Vec::new() })
    }

    /// Age of the force value when it is used.
    pub fn age(&self, clock: Clock) -> Option<u64> {
        let (read, decision) = (self.read?, self.decision?);
        match clock {
            Clock::Simulated => decision.t.checked_sub(read.origin),
            Clock::Wall => decision.begin.checked_sub(read.begin),
        }
    }
}
