//! Faults of the sensor, its cable and its samples, as the scenario plans them.
//!
//! A fault of the bridges acts on the wrench before it is converted, one of the cable on the samples. Without faults a
//! sample passes unchanged.

use crate::gauges::Normal;
use crate::{AXES, Counts};
use scenario::{Fault, FaultKind, Occurrence, Scenario, Site};
use vme::Ns;

/// Random streams of the added noise begin here.
const STREAM: u64 = 1 << 33;

/// The faults of this sensor.
#[derive(Clone, Debug)]
pub struct Faults {
    faults: Vec<Planned>,
    /// In the order of their begin; the first is the next to begin.
    to_begin: Vec<Occurrence>,
    begun: usize,
    full_scale_counts: f64,
}

/// One fault and when it holds next.
#[derive(Clone, Debug)]
struct Planned {
    stated: Fault,
    noise: Normal,
    holds: Option<Occurrence>,
    /// The sample that a stuck sensor repeats.
    stuck_at: Option<Counts>,
    /// A spike has had its sample.
    spent: bool,
}

impl Faults {
    /// The faults that the scenario plans for the force sensor.
    pub fn new(scenario: &Scenario) -> Faults {
        let mut to_begin = scenario.occurrences();
        to_begin.retain(|occurrence| scenario.fault_site(occurrence.fault) == Ok(Site::ForceSensor));
        to_begin.sort_by_key(|occurrence| (occurrence.from, occurrence.fault));
        let planned = |(i, fault): (usize, &Fault)| Planned {
            stated: fault.clone(),
            noise: Normal::new(scenario.seed, STREAM + i as u64),
            holds: None,
            stuck_at: None,
            spent: false,
        };
        Faults {
            faults: scenario.faults.iter().enumerate().map(planned).collect(),
            to_begin,
            begun: 0,
            full_scale_counts: scenario.force_sensor_if.full_scale_counts,
        }
    }

    /// Lets the faults begin and end that do so up to `t`; `begins` is told the number of each that begins, and when.
    pub fn advance(&mut self, t: Ns, mut begins: impl FnMut(usize, Ns)) {
        while let Some(next) = self.to_begin.get(self.begun).filter(|next| next.from <= t) {
            let fault = &mut self.faults[next.fault];
            (fault.holds, fault.stuck_at, fault.spent) = (Some(*next), None, false);
            begins(next.fault, next.from);
            self.begun += 1;
        }
        for fault in &mut self.faults {
            fault.holds = fault.holds.filter(|holds| t < holds.until);
        }
    }

    /// What the bridges feel at `t` (N, Nm).
    pub fn felt(&mut self, t: Ns, mut wrench: [f64; AXES]) -> [f64; AXES] {
        for fault in &mut self.faults {
            let Some(holds) = fault.holds else { continue };
            let amount = fault.stated.amount;
            for axis in fault.stated.axes.iter().map(|axis| usize::from(*axis)) {
                wrench[axis] += match fault.stated.kind {
                    FaultKind::Bias => amount,
                    FaultKind::Drift => amount * (t - holds.from) as f64 * 1e-9,
                    FaultKind::Noise => amount * fault.noise.draw(),
                    FaultKind::Spike if !fault.spent => amount,
                    _ => 0.0,
                };
            }
            fault.spent = true;
        }
        wrench
    }

    /// What the receiver gets of a sample.
    pub fn sent(&mut self, mut sample: Counts) -> Counts {
        for fault in self.faults.iter_mut().filter(|fault| fault.holds.is_some()) {
            let stuck = *fault.stuck_at.get_or_insert(sample);
            for axis in fault.stated.axes.iter().map(|axis| usize::from(*axis)) {
                sample[axis] = match fault.stated.kind {
                    FaultKind::Stuck => stuck[axis],
                    FaultKind::Saturation => self.full_scale_counts.copysign(sample[axis]),
                    FaultKind::WireBreak => 0.0,
                    _ => sample[axis],
                };
            }
        }
        sample
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
        self.faults.iter().any(|fault| fault.holds.is_some() && fault.stated.kind == kind)
    }
}
