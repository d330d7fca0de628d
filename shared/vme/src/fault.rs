//! Faults of bus and processors, known to the timing plane from the start.
//!
//! Each fault holds in [`Fault::from_ns`, `until_ns`). The instant at which one begins is a stop
//! ([`crate::Stop::Fault`]), so that the chassis can record it, or signal the process it concerns.

use crate::Ns;

/// Rounds in which a drifting clock is inverted.
const INVERSIONS: u32 = 40;

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
    /// Reads of this slave window take place twice: the master misses the first one's end.
    RepeatedRead(u16),
    /// Writes of this task take place twice.
    RepeatedWrite(u16),
    /// The clock behind this timer gains: its ticks come early, or late where it loses.
    Drift {
        /// The timer.
        timer: Timer,
        /// Parts per billion, above −10⁹.
        gain_ppb: i64,
    },
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

/// What ticks by a clock of its card.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timer {
    /// That releases this task.
    Task(u16),
    /// That makes the events of this interrupter.
    Interrupter(u16),
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

    /// When the clock behind a timer shows `shown`.
    pub fn instant(&self, timer: Timer, shown: Ns) -> Ns {
        let drifts = self.faults.iter().filter_map(|fault| match fault.kind {
            FaultKind::Drift { timer: drifting, gain_ppb } if drifting == timer => Some((fault, gain_ppb)),
            _ => None,
        });
        let gained = |t: Ns| {
            let of = |(fault, ppb): (&Fault, i64)| {
                let held = t.min(fault.until_ns).saturating_sub(fault.from_ns);
                i128::from(held) * i128::from(ppb) / 1_000_000_000
            };
            drifts.clone().map(of).sum::<i128>() as i64
        };
        // the gain is a small part of the time: this settles within a few rounds
        let mut t = shown;
        for _ in 0..INVERSIONS {
            let next = shown.saturating_add_signed(-gained(t));
            if next == t {
                break;
            }
            t = next;
        }
        t
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
    fn a_drifting_clock_shows_an_instant_early_or_late_and_keeps_what_it_has_gained() {
        let timer = Timer::Interrupter(3);
        let drift = |gain_ppb| Fault { from_ns: 1_000, until_ns: 11_000, kind: FaultKind::Drift { timer, gain_ppb } };
        for gain_ppb in [100_000_000, -100_000_000, 20_000_000] {
            let plan = FaultPlan { faults: vec![drift(gain_ppb)] };
            let gain = gain_ppb as f64 * 1e-9;
            for shown in [0, 999, 1_000, 5_000, 9_000, 20_000, 1_000_000] {
                let t = plan.instant(timer, shown) as f64;
                let shows = t + (t.min(11_000.0) - 1_000.0).max(0.0) * gain;
                assert!((shows - shown as f64).abs() <= 1.2, "{gain}: {shown} at {t}");
                assert_eq!(plan.instant(Timer::Task(3), shown), shown);
            }
            let late = 1 << 60;
            assert_eq!(plan.instant(timer, late) as i64 - late as i64, -gain_ppb / 100_000, "kept");
        }
    }

    #[test]
    fn slow_factors_multiply() {
        let slow = |task, percent| Fault { from_ns: 0, until_ns: 100, kind: FaultKind::Slow { task, percent } };
        let plan = FaultPlan { faults: vec![slow(1, 200), slow(1, 150), slow(2, 900)] };
        assert_eq!(plan.stretched(5, 1, 1000), 3000);
    }
}
