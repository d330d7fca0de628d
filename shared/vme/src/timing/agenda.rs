//! When each source has its next event, and which of all events comes next.
//!
//! Bus, processors and arbiter change with every transfer and are looked at every time; of the others
//! (ticks, arrivals, time-outs) the earliest one is remembered until it changes.

use super::wiring::Wiring;
use crate::Ns;
use std::ops::Range;

#[derive(Debug)]
pub(super) struct Agenda {
    due: Vec<Ns>,
    /// Sources that change all the time.
    busy: [Range<usize>; 2],
    /// The first of the others, if `known`.
    quiet: (Ns, usize),
    known: bool,
}

impl Agenda {
    /// Nothing is due.
    pub fn new(wiring: &Wiring) -> Agenda {
        let busy = [Wiring::BUS..wiring.interrupter(0), wiring.dispatch(0)..wiring.sources.len()];
        Agenda { due: vec![Ns::MAX; wiring.sources.len()], busy, quiet: (Ns::MAX, 0), known: false }
    }

    /// The source has its next event at this instant; [`Ns::MAX`] for never.
    pub fn set(&mut self, source: usize, at: Ns) {
        self.due[source] = at;
        if self.busy.iter().any(|busy| busy.contains(&source)) {
            return;
        }
        if (at, source) < self.quiet {
            self.quiet = (at, source);
        } else if source == self.quiet.1 {
            self.known = false;
        }
    }

    /// The next event: the earliest, and of several at one instant the first in the order of sources.
    pub fn next(&mut self) -> (Ns, usize) {
        if !self.known {
            let all = self.due.iter().enumerate();
            let quiet = all.filter(|(source, _)| !self.busy.iter().any(|busy| busy.contains(source)));
            self.quiet = quiet.map(|(source, &at)| (at, source)).min().unwrap_or((Ns::MAX, 0));
            self.known = true;
        }
        let mut next = self.quiet;
        for busy in &self.busy {
            for (source, &at) in (busy.start..).zip(&self.due[busy.clone()]) {
                if (at, source) < next {
                    next = (at, source);
                }
            }
        }
        next
    }
}

impl Clone for Agenda {
    fn clone(&self) -> Self {
        Agenda { due: self.due.clone(), busy: self.busy.clone(), ..*self }
    }
    fn clone_from(&mut self, from: &Self) {
        self.due.clone_from(&from.due);
        self.busy.clone_from(&from.busy);
        (self.quiet, self.known) = (from.quiet, from.known);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_event_is_the_least_of_all_whatever_changed_before() {
        let n = 12;
        let mut agenda = Agenda { due: vec![Ns::MAX; n], busy: [1..3, 9..12], quiet: (Ns::MAX, 0), known: false };
        let mut state = 1u64;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let at = if state >> 63 == 0 { Ns::MAX } else { (state >> 40) % 16 };
            agenda.set((state >> 33) as usize % n, at);
            let due = agenda.due.clone();
            let least = due.iter().enumerate().map(|(source, &at)| (at, source)).min();
            assert_eq!(Some(agenda.next()), least);
        }
    }
}
