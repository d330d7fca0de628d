//! Faults of amplifiers and brakes, as the scenario plans them.

use crate::plant::Actuation;
use messages::Ns;
use scenario::{FaultKind, Progress, Scenario, Schedule, Site};

/// The faults of all drives.
#[derive(Clone, Debug)]
pub struct Faults {
    schedule: Schedule,
    progress: Progress,
}

impl Faults {
    /// The faults that the scenario plans for the drives.
    pub fn new(scenario: &Scenario) -> Faults {
        let schedule = Schedule::new(scenario, |site| matches!(site, Site::Drive(_)));
        Faults { schedule, progress: Progress::default() }
    }

    /// When a fault begins or ends next.
    pub fn next_change(&self) -> Ns {
        self.schedule.next_change(&self.progress)
    }

    /// Lets the faults begin and end that do so up to `t`; `begins` is told the scenario's number of each that begins,
    /// and when. True where any did.
    pub fn advance(&mut self, t: Ns, mut begins: impl FnMut(usize, Ns)) -> bool {
        let Self { schedule, progress } = self;
        let before = *progress;
        schedule.advance(progress, t, |place, from| begins(schedule.entries()[place].number, from));
        *progress != before
    }

    /// Amplifiers that have tripped, a bit each.
    pub fn tripped(&self) -> u32 {
        let trips = self.schedule.holding(&self.progress).filter(|(_, entry)| entry.fault.kind == FaultKind::AmplifierTrip);
        trips.fold(0, |bits, (_, entry)| if let Site::Drive(joint) = entry.site { bits | 1 << joint } else { bits })
    }

    /// What becomes of a command.
    pub fn spoil(&self, mut actuation: Actuation) -> Actuation {
        for (_, entry) in self.schedule.holding(&self.progress) {
            let Site::Drive(joint) = entry.site else { continue };
            match entry.fault.kind {
                FaultKind::AmplifierTrip => actuation.volts[joint] = 0.0,
                FaultKind::BrakeStuck => actuation.braked |= 1 << joint,
                FaultKind::BrakeSlip => actuation.brake_share[joint] = entry.fault.amount,
                _ => {}
            }
        }
        actuation
    }
}
