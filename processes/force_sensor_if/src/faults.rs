//! Faults of the sensor, its cable and its samples, as the scenario plans them.
//!
//! A fault of the bridges acts on the wrench before it is converted, one of the cable on the samples. Without faults a
//! sample passes unchanged.

use crate::gauges::Normal;
use crate::{AXES, Counts, SAMPLE_NS};
use scenario::{FaultKind, Progress, Scenario, Schedule, Site, nanoseconds};
use std::collections::VecDeque;
use vme::Ns;

/// Random streams of the added noise begin here.
const STREAM: u64 = 1 << 33;

/// The faults of this sensor.
#[derive(Clone, Debug)]
pub struct Faults {
    schedule: Schedule,
    progress: Progress,
    /// By place in the schedule.
    states: Vec<State>,
    full_scale_counts: f64,
    /// The samples of the longest delay planned, the newest last.
    past: VecDeque<Counts>,
    kept: usize,
}

/// What a fault needs to remember.
#[derive(Clone, Debug)]
struct State {
    noise: Normal,
    /// When it began.
    since: Ns,
    /// The sample that a stuck sensor repeats.
    stuck_at: Option<Counts>,
    /// A spike has had its sample.
    spent: bool,
}

impl Faults {
    /// The faults that the scenario plans for the force sensor.
    pub fn new(scenario: &Scenario) -> Faults {
        let schedule = Schedule::new(scenario, |site| site == Site::ForceSensor);
        let of = |number: usize| State {
            noise: Normal::new(scenario.seed, STREAM + number as u64),
            since: 0,
            stuck_at: None,
            spent: false,
        };
        let delays = schedule.entries().iter().filter(|entry| entry.fault.kind == FaultKind::Delay);
        let kept = delays.map(|entry| samples(entry.fault.amount)).max().unwrap_or(0) as usize;
        Faults {
            states: schedule.entries().iter().map(|entry| of(entry.number)).collect(),
            schedule,
            progress: Progress::default(),
            full_scale_counts: scenario.force_sensor_if.full_scale_counts,
            past: VecDeque::with_capacity(kept + 1),
            kept,
        }
    }

    /// Lets the faults begin and end that do so up to `t`; `begins` is told the scenario's number of each that begins,
    /// and when.
    pub fn advance(&mut self, t: Ns, mut begins: impl FnMut(usize, Ns)) {
        let Self { schedule, states, progress, .. } = self;
        schedule.advance(progress, t, |place, from| {
            let state = &mut states[place];
            (state.since, state.stuck_at, state.spent) = (from, None, false);
            begins(schedule.entries()[place].number, from);
        });
    }

    /// What the bridges feel at `t` (N, Nm).
    pub fn felt(&mut self, t: Ns, mut wrench: [f64; AXES]) -> [f64; AXES] {
        for (place, entry) in self.schedule.holding(&self.progress) {
            let (state, amount) = (&mut self.states[place], entry.fault.amount);
            for axis in entry.fault.axes.iter().map(|axis| usize::from(*axis)) {
                wrench[axis] += match entry.fault.kind {
                    FaultKind::Bias => amount,
                    FaultKind::Drift => amount * (t - state.since) as f64 * 1e-9,
                    FaultKind::Noise => amount * state.noise.draw(),
                    FaultKind::Spike if !state.spent => amount,
                    _ => 0.0,
                };
            }
            state.spent = true;
        }
        wrench
    }

    /// What the receiver gets of a sample.
    pub fn sent(&mut self, mut sample: Counts) -> Counts {
        for (place, entry) in self.schedule.holding(&self.progress) {
            let stuck = *self.states[place].stuck_at.get_or_insert(sample);
            for axis in entry.fault.axes.iter().map(|axis| usize::from(*axis)) {
                sample[axis] = match entry.fault.kind {
                    FaultKind::Stuck => stuck[axis],
                    FaultKind::Saturation => self.full_scale_counts.copysign(sample[axis]),
                    FaultKind::WireBreak => 0.0,
                    _ => sample[axis],
                };
            }
        }
        sample
    }

    /// The sample that comes when `newest` has been taken, and how many samples old it is; without a delay that is itself.
    pub fn delayed(&mut self, newest: Counts) -> (Counts, u64) {
        if self.kept == 0 {
            return (newest, 0);
        }
        if self.past.len() > self.kept {
            self.past.pop_front();
        }
        self.past.push_back(newest);
        let delays = self.schedule.holding(&self.progress).filter(|(_, entry)| entry.fault.kind == FaultKind::Delay);
        let delay = delays.map(|(_, entry)| samples(entry.fault.amount)).max().unwrap_or(0);
        let age = (delay as usize).min(self.past.len() - 1);
        (self.past[self.past.len() - 1 - age], age as u64)
    }

    /// Whether samples do not come at all.
    pub fn dropped(&self) -> bool {
        self.holds(FaultKind::Dropout)
    }

    /// Whether the cable is open.
    pub fn open(&self) -> bool {
        self.holds(FaultKind::WireBreak)
    }

    fn holds(&self, kind: FaultKind) -> bool {
        self.schedule.holding(&self.progress).any(|(_, entry)| entry.fault.kind == kind)
    }
}

/// Samples in a delay of so many milliseconds.
fn samples(ms: f64) -> u64 {
    nanoseconds(ms * 1e-3) / SAMPLE_NS
}
