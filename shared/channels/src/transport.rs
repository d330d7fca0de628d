//! What the wall clock says about the messages of a channel: how long from sending to reading, and how many came late.
//!
//! Used in real time only. Every process measures on CLOCK_MONOTONIC, which all of one machine share.

use hdrhistogram::Histogram;
use messages::{Header, Ns};
use rustix::time::{ClockId, clock_gettime};

/// Longest wall time that is told apart, ns; longer ones count as this.
const LONGEST_NS: u64 = 100_000_000_000;

/// CLOCK_MONOTONIC, ns.
pub fn wall_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// An empty histogram of wall times, ns, of three digits. Recording into it allocates nothing.
pub fn histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("bounds and digits are valid constants")
}

/// The messages of a channel, at the reader.
#[derive(Clone, Debug)]
pub struct Transport {
    /// Name of the channel.
    pub channel: String,
    /// Messages that belong to a time up to which their reader had acted before they came.
    pub late: u64,
    /// Wall time from sending to reading, ns. A board reads when it acts, so this is not less than it sleeps meanwhile.
    pub latency: Histogram<u64>,
}

impl Transport {
    pub(crate) fn new(service: &str) -> Transport {
        Transport { channel: service.to_owned(), late: 0, latency: histogram() }
    }

    pub(crate) fn arrived(&mut self, header: &Header, stepped_to: Ns) {
        if header.wall_ns != 0 {
            self.latency.saturating_record(wall_ns().saturating_sub(header.wall_ns).max(1));
        }
        // time 0: content whose time only the bus decides
        if header.t != 0 && header.t <= stepped_to {
            self.late += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_for_a_time_that_its_reader_has_passed_counts_as_late() {
        let mut transport = Transport::new("hw_sim/plant");
        for (t, stepped_to) in [(10, 9), (10, 10), (10, 11), (0, 11)] {
            transport.arrived(&Header { t, seq: 0, crc: 0, wall_ns: wall_ns() }, stepped_to);
        }
        assert_eq!((transport.late, transport.latency.len()), (2, 4));
    }

    #[test]
    fn a_message_without_a_wall_clock_stamp_is_not_measured() {
        let mut transport = Transport::new("hw_sim/plant");
        transport.arrived(&Header { t: 1, seq: 0, crc: 0, wall_ns: 0 }, 0);
        assert_eq!((transport.late, transport.latency.len()), (0, 0));
    }
}
