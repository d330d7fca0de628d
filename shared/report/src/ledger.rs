//! Modelled latency of bus transfers, per path: card and direction.

use hdrhistogram::Histogram;
use scenario::Scenario;
use serde::Serialize;
use vme::{Direction, Status, Transfer};

/// Longer ones count as this long.
const LONGEST_NS: u64 = 10 * vme::SECOND;

/// Counts the transfers of a run. Latency runs from the bus request to the end of the last cycle.
#[derive(Clone, Debug)]
pub struct Ledger {
    cards: Vec<String>,
    /// By card (one more for addresses where none answers) and direction.
    paths: Vec<[Option<Histogram<u64>>; 2]>,
    errors: u64,
}

/// Latency of one path, ns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathLatency {
    /// Path, for example `read encoder-1`.
    pub path: String,
    /// Transfers.
    pub n: u64,
    /// Least.
    pub min_ns: u64,
    /// Median.
    pub p50_ns: u64,
    /// 99 of 100 are at most this long.
    pub p99_ns: u64,
    /// Greatest.
    pub max_ns: u64,
}

impl Ledger {
    /// An empty ledger over the scenario's cards.
    pub fn new(scenario: &Scenario) -> Ledger {
        let mut cards: Vec<_> = scenario.rack.slaves.iter().map(|slave| slave.name.clone()).collect();
        cards.push("(no card)".into());
        let paths = vec![[None, None]; cards.len()];
        Ledger { cards, paths, errors: 0 }
    }

    /// Counts one transfer.
    pub fn push(&mut self, transfer: &Transfer) {
        let none = self.cards.len() - 1;
        let card = transfer.slave.map_or(none, |slave| usize::from(slave).min(none));
        let direction = usize::from(transfer.access.dir != Direction::Read);
        let histogram = self.paths[card][direction].get_or_insert_with(histogram);
        histogram.saturating_record(transfer.done.saturating_sub(transfer.requested).max(1));
        self.errors += u64::from(transfer.status != Status::Ok);
    }

    /// Transfers that ended in BERR* or time-out.
    pub fn errors(&self) -> u64 {
        self.errors
    }

    /// All paths that were used, cards in the order of the rack.
    pub fn paths(&self) -> Vec<PathLatency> {
        let mut rows = Vec::new();
        for (card, directions) in self.cards.iter().zip(&self.paths) {
            for (direction, histogram) in ["read", "write"].iter().zip(directions) {
                if let Some(histogram) = histogram {
                    rows.push(PathLatency::of(format!("{direction} {card}"), histogram));
                }
            }
        }
        rows
    }
}

impl PathLatency {
    /// The figures of a histogram in ns.
    pub fn of(path: String, histogram: &Histogram<u64>) -> PathLatency {
        PathLatency {
            path,
            n: histogram.len(),
            min_ns: histogram.min(),
            p50_ns: histogram.value_at_quantile(0.5),
            p99_ns: histogram.value_at_quantile(0.99),
            max_ns: histogram.max(),
        }
    }
}

/// Three significant digits, 1 ns to 10 s.
pub(crate) fn histogram() -> Histogram<u64> {
    // constant bounds that the crate accepts
    Histogram::new_with_bounds(1, LONGEST_NS, 3).unwrap_or_else(|error| unreachable!("{error}"))
}
