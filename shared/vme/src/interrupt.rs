//! Interrupters and the IACK daisy chain.
//!
//! An interrupter drives IRQ1*–IRQ7*; the handler of that level acknowledges with an IACK cycle, in
//! which the chain stops at the interrupter nearest to slot 1. ROAK interrupters let go of the line
//! in that cycle, RORA ones when the handler writes their register. A request raised while the one
//! before is still pending is not seen twice: it is counted as merged.

use crate::Ns;
use crate::program::Width;
use crate::timer::Ticks;
use serde::{Deserialize, Serialize};

/// An interrupter of a card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interrupter {
    /// Name, for example `force-sample-ready`.
    pub name: String,
    /// Card that it sits on: a slave, a processor or an adaptor.
    pub card: String,
    /// IRQ1* to IRQ7*, 7 served first.
    pub level: u8,
    /// Status/ID (vector) that it answers with in the IACK cycle.
    pub status_id: u8,
    /// When it lets go of the line.
    #[serde(default)]
    pub release: IrqRelease,
    /// DS* to DTACK* of the IACK cycle.
    #[serde(default = "default_answer_ns")]
    pub answer_ns: Ns,
    /// Where its events come from; without it, from `Op::Raise` or a location monitor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ticks: Option<Ticks>,
    /// Wired on the card to its own processor: no IRQ* line, no IACK cycle.
    #[serde(default)]
    pub local: bool,
}

fn default_answer_ns() -> Ns {
    350
}

/// When an interrupter lets go of its IRQ* line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum IrqRelease {
    /// Release on acknowledge.
    #[default]
    #[serde(rename = "ROAK")]
    Roak,
    /// Release on register access: the handler writes this register.
    #[serde(rename = "RORA")]
    Rora {
        /// Address modifier of the register.
        am: u8,
        /// Address of the register.
        addr: u32,
        /// Width of the register.
        width: Width,
    },
}

/// The request line of one interrupter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    /// Drives its IRQ* line (or, where it is polled, its status bit).
    pub pending: bool,
    /// Since when.
    pub since: Ns,
    /// Events seen so far; the number of the next one.
    pub events: u32,
    /// Event that the request stands for.
    pub event: u32,
    /// Next tick of its own source.
    pub tick: u64,
    /// Events in a row that got lost on the way.
    pub missed: u32,
}

impl Line {
    /// An event; true where it was not hidden behind a pending one.
    pub fn raise(&mut self, now: Ns) -> bool {
        let seen = !self.pending;
        self.event = self.events;
        self.events = self.events.wrapping_add(1);
        if seen {
            self.pending = true;
            self.since = now;
        }
        seen
    }
}

/// The IACK daisy chain: the interrupter that answers at `level`, by nearness to slot 1.
pub fn acknowledged(level: u8, requests: impl Iterator<Item = (usize, u8, u8)>) -> Option<usize> {
    requests.filter(|&(_, l, _)| l == level).min_by_key(|&(_, _, slot)| slot).map(|(index, _, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_iack_chain_stops_at_the_slot_nearest_to_slot_1() {
        let requests = [(0, 5, 9), (1, 5, 4), (2, 6, 12), (3, 5, 7)];
        assert_eq!(acknowledged(5, requests.into_iter()), Some(1));
        assert_eq!(acknowledged(6, requests.into_iter()), Some(2));
        assert_eq!(acknowledged(7, requests.into_iter()), None);
    }

    #[test]
    fn a_request_behind_a_pending_one_is_not_seen_twice() {
        let mut line = Line::default();
        assert!(line.raise(10));
        assert!(!line.raise(20));
        assert_eq!((line.since, line.events, line.event), (10, 2, 1));
    }
}
