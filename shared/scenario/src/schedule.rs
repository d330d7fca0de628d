//! The faults that one board carries out, as time goes on.
//!
//! A [`Schedule`] never changes; a [`Progress`] says how far a board has come in it, and is cheap to copy, so a board that
//! goes back in time keeps one from then.

use crate::faults::Site;
use crate::model::{Fault, Scenario};
use vme::Ns;

/// The faults at some sites, and when each begins and ends.
#[derive(Clone, Debug)]
pub struct Schedule {
    entries: Vec<Entry>,
    /// In the order of time: instant, number of the entry, whether it begins. One that ends makes room first.
    changes: Vec<(Ns, usize, bool)>,
}

/// One fault.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its number in the scenario.
    pub number: usize,
    /// Where it acts.
    pub site: Site,
    /// What the scenario states.
    pub fault: Fault,
}

/// How far a board has come in its schedule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    next: usize,
    /// Bit i: entry i holds.
    holding: u64,
}

impl Schedule {
    /// Faults that a scenario may have.
    pub const MOST: usize = u64::BITS as usize;

    /// The scenario's faults at the sites that are `mine`.
    pub fn new(scenario: &Scenario, mine: impl Fn(Site) -> bool) -> Schedule {
        let mut entries = Vec::new();
        let mut place = vec![None; scenario.faults.len()];
        for (number, fault) in scenario.faults.iter().enumerate() {
            // a target that does not exist has been refused
            if let Ok(site) = scenario.fault_site(number)
                && mine(site)
            {
                place[number] = Some(entries.len());
                entries.push(Entry { number, site, fault: fault.clone() });
            }
        }
        let mut changes = Vec::new();
        for occurrence in scenario.occurrences() {
            if let Some(entry) = place[occurrence.fault] {
                changes.push((occurrence.from, entry, true));
                changes.push((occurrence.until, entry, false));
            }
        }
        changes.sort_by_key(|(t, entry, begins)| (*t, *begins, *entry));
        Schedule { entries, changes }
    }

    /// All faults, whether they hold or not.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// When the next one begins or ends; [`Ns::MAX`]: never.
    pub fn next_change(&self, progress: &Progress) -> Ns {
        self.changes.get(progress.next).map_or(Ns::MAX, |(t, ..)| *t)
    }

    /// Lets the faults begin and end that do so up to `t`; `begins` is told the place in [`Schedule::entries`] of each
    /// that begins, and when.
    pub fn advance(&self, progress: &mut Progress, t: Ns, mut begins: impl FnMut(usize, Ns)) {
        while let Some((at, entry, begun)) = self.changes.get(progress.next).filter(|(at, ..)| *at <= t) {
            progress.next += 1;
            if *begun {
                progress.holding |= 1 << entry;
                begins(*entry, *at);
            } else {
                progress.holding &= !(1 << entry);
            }
        }
    }

    /// The faults that hold, with their places in [`Schedule::entries`].
    pub fn holding(&self, progress: &Progress) -> impl Iterator<Item = (usize, &Entry)> {
        let holding = progress.holding;
        self.entries.iter().enumerate().filter(move |(i, _)| holding >> i & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FaultKind;

    #[test]
    fn a_fault_holds_from_its_begin_up_to_but_not_at_its_end_each_time() {
        let faults = "fault=[{ target='joint-2', kind='da-offset', start_s=1e-6, every_s=1e-3, duration_s=5e-4 }, \
                      { target='force_sensor', kind='bias', start_s=0.0 }]";
        let scenario = crate::load("table-5-3", &[faults.into()]).unwrap().scenario().unwrap();
        let schedule = Schedule::new(&scenario, |site| site == Site::Converter(1));
        assert_eq!(schedule.entries().len(), 1);
        assert_eq!(schedule.entries()[0].fault.kind, FaultKind::DaOffset);
        let mut progress = Progress::default();
        let mut begun = Vec::new();
        let mut held = Vec::new();
        for t in [999, 1_000, 500_999, 501_000, 1_000_999, 1_001_000] {
            schedule.advance(&mut progress, t, |entry, at| begun.push((entry, at)));
            held.push(schedule.holding(&progress).count());
        }
        assert_eq!(begun, [(0, 1_000), (0, 1_001_000)]);
        assert_eq!(held, [0, 1, 1, 0, 0, 1]);
        assert_eq!(schedule.next_change(&progress), 1_501_000);
    }
}
