//! Faults of bus and processors, known to the timing plane from the start.
//!
//! Each fault holds in [`Fault::from_ns`, `until_ns`). The instant at which one begins is a stop
//! ([`crate::Stop::Fault`]), so that the chassis can record it, or signal the process it concerns.

use crate::Ns;

/// A fault and when it holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// From this instant …
    pub from_ns: Ns,
    /// … up to, but not at, this one; [`Ns::MAX`] for ever.
    pub until_ns: Ns,
    /// What is wrong.
    pub kind: FaultKind,
}

/// What is wrong. Indices count the lists of [`crate::rack::Rack`]; masters count as
/// [`crate::Timing::master_name`] does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// This slave window does not answer: BERR*.
    NoSlave(u16),
    /// The arbiter does not hear this master: access timer.
    Starvation(u16),
    /// The bus grants nobody: access timer for all.
    StuckBus,
    /// Events of this interrupter raise nothing; after two in a row the handler's card polls.
    LostInterrupt(u16),
    /// The cable of this adaptor is out.
    CableOut(u16),
    /// Transfers over the link of this adaptor fail its parity check: BERR*.
    Parity(u16),
    /// Execution times of this task are multiplied by `percent`/100.
    Slow {
        /// The task.
        task: u16,
        /// New execution time in percent of the nominal one.
        percent: u32,
    },
    /// The next operation of this task takes longer, once.
    Overrun {
        /// The task.
        task: u16,
        /// By so much, ns.
        more_ns: Ns,
    },
    /// This task stops where it is and gets no releases: its board crashed or hangs.
    Halt(u16),
}

/// All faults of a run, in any order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaultPlan {
    /// The faults.
    pub faults: Vec<Fault>,
}

impl FaultPlan {
    /// The end of the latest fault of this kind that holds at `now`, if any does.
    pub fn holds(&self, now: Ns, kind: FaultKind) -> Option<Ns> {
        self.faults.iter().filter(|f| f.kind == kind && f.from_ns <= now && now < f.until_ns).map(|f| f.until_ns).max()
    }

    /// Execution time of the task's operation at `now`.
    pub fn stretched(&self, now: Ns, task: u16, exec: Ns) -> Ns {
        self.faults.iter().filter(|f| f.from_ns <= now && now < f.until_ns).fold(exec, |exec, f| match f.kind {
            FaultKind::Slow { task: slow, percent } if slow == task => exec.saturating_mul(percent.into()) / 100,
            _ => exec,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_holds_from_its_begin_up_to_but_not_at_its_end() {
        let plan = FaultPlan { faults: vec![Fault { from_ns: 10, until_ns: 20, kind: FaultKind::StuckBus }] };
        let held = |now| plan.holds(now, FaultKind::StuckBus);
        assert_eq!((held(9), held(10), held(19), held(20)), (None, Some(20), Some(20), None));
        assert_eq!(plan.holds(15, FaultKind::NoSlave(0)), None);
    }

    #[test]
    fn slow_factors_multiply() {
        let slow = |task, percent| Fault { from_ns: 0, until_ns: 100, kind: FaultKind::Slow { task, percent } };
        let plan = FaultPlan { faults: vec![slow(1, 200), slow(1, 150), slow(2, 900)] };
        assert_eq!(plan.stretched(5, 1, 1000), 3000);
    }
}
