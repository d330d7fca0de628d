//! From crashes and hangs among the faults to outages: which boards are down together, and from when to when.
//!
//! The boards of one process go down together; those placed in the chassis, which is never signalled, one by one. A board
//! is up again `boot_ms` after its fault has ended, as a new process. A fault that begins while its board is down does
//! nothing.

use crate::error::Problem;
use crate::faults::Site;
use crate::hardware::nanoseconds;
use crate::model::{FaultKind, Process, Restart, Scenario};
use messages::BoardId;
use vme::Ns;

/// Boards that are down together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outage {
    /// Number of the fault in the scenario.
    pub fault: usize,
    /// They crash or hang at this instant …
    pub from: Ns,
    /// … and are up again at this one; [`Ns::MAX`] = never.
    pub until: Ns,
    /// They hang: a stopped process, not a killed one.
    pub hang: bool,
    /// The boards, in the order of their numbers.
    pub boards: Vec<BoardId>,
}

/// Boards that the run can go on without.
const DISPENSABLE: [BoardId; 2] = [BoardId::Workstation, BoardId::BusAnalyzer];

impl Process {
    /// Its boards.
    pub fn board_ids(&self) -> impl Iterator<Item = BoardId> {
        self.boards.iter().filter_map(|board| BoardId::from_name(board))
    }

    /// Whether control goes on without it.
    pub fn is_dispensable(&self) -> bool {
        self.board_ids().all(|board| DISPENSABLE.contains(&board))
    }

    /// What happens when it dies unplanned: as stated, or once for a process that control does without.
    pub fn restart(&self) -> Restart {
        self.restart.unwrap_or(if self.is_dispensable() { Restart::Once } else { Restart::Never })
    }
}

impl Scenario {
    /// All outages, in the order of time.
    pub fn outages(&self) -> Vec<Outage> {
        let outage = |occurrence: crate::Occurrence| {
            let kind = self.faults[occurrence.fault].kind;
            let Ok(Site::Board(board)) = self.fault_site(occurrence.fault) else { return None };
            let (process, together) = self.down_with(board);
            let boot = nanoseconds(process.map_or(0.0, |process| process.boot_ms) * 1e-3);
            matches!(kind, FaultKind::Crash | FaultKind::Hang).then(|| Outage {
                fault: occurrence.fault,
                from: occurrence.from,
                until: occurrence.until.saturating_add(boot),
                hang: kind == FaultKind::Hang,
                boards: together,
            })
        };
        let mut outages: Vec<Outage> = self.occurrences().into_iter().filter_map(outage).collect();
        outages.sort_by_key(|outage| (outage.from, outage.fault));
        let mut kept: Vec<Outage> = Vec::with_capacity(outages.len());
        for outage in outages {
            let is_down = |other: &Outage| other.boards == outage.boards && outage.from <= other.until;
            if !kept.iter().any(is_down) {
                kept.push(outage);
            }
        }
        kept
    }

    /// The process of a board, and the boards that go down with it.
    fn down_with(&self, board: BoardId) -> (Option<&Process>, Vec<BoardId>) {
        let process = self.processes.iter().find(|process| process.board_ids().any(|other| other == board));
        let mut together: Vec<BoardId> = match process {
            Some(process) if process.name != BoardId::Chassis.name() => process.board_ids().collect(),
            _ => vec![board],
        };
        together.sort_unstable_by_key(|board| *board as u8);
        (process, together)
    }

    /// What the timing plane has to know of the outages: tasks that stop, slaves that do not answer.
    pub(crate) fn outage_faults(&self) -> Vec<vme::Fault> {
        let mut faults = Vec::new();
        for outage in self.outages() {
            let mut add = |kind| faults.push(vme::Fault { from_ns: outage.from, until_ns: outage.until, kind });
            let is_down = |name: &str| outage.boards.iter().any(|board| board.name() == name);
            for (task, _) in self.rack.tasks.iter().enumerate().filter(|(_, task)| is_down(&task.board)) {
                add(vme::FaultKind::Halt(task as u16));
            }
            for (slave, _) in self.rack.slaves.iter().enumerate().filter(|(_, slave)| is_down(&slave.board)) {
                add(vme::FaultKind::NoSlave(slave as u16));
            }
        }
        faults
    }
}

/// Refuses what cannot crash, or cannot start again, with its key.
pub(crate) fn check(scenario: &Scenario) -> Result<(), Problem> {
    for (i, process) in scenario.processes.iter().enumerate() {
        // the drives' lines have come to rest by then
        if !(100.0..=1e6).contains(&process.boot_ms) {
            let message = format!("is {}, expected 100 to 1 000 000 ms", process.boot_ms);
            return Err(Problem::new(format!("process.{i}.boot_ms"), message));
        }
        if process.restart() != Restart::Never && !process.is_dispensable() {
            let message = "expected `never`: the run ends with a process of any board but workstation and bus_analyzer";
            return Err(Problem::new(format!("process.{i}.restart"), message));
        }
    }
    for (i, fault) in scenario.faults.iter().enumerate() {
        if let (FaultKind::Crash | FaultKind::Hang, Ok(Site::Board(board))) = (fault.kind, scenario.fault_site(i))
            && scenario.down_with(board).1.contains(&BoardId::HwSim)
        {
            let message = format!("is `{}`, which shares a process with hw_sim; the arm cannot crash", fault.target);
            return Err(Problem::new(format!("fault.{i}.target"), message));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;

    fn scenario(overrides: &[&str]) -> Result<Scenario, String> {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let document = load("table-5-3", &overrides).map_err(|error| error.to_string())?;
        document.scenario().map_err(|error| error.to_string())
    }

    const TOGETHER: &str = "process=[{ name='io', boards=['da_io', 'encoder_if'], boot_ms=100.0 }, \
        { name='rest', boards=['hw_sim', 'force_sensor_if', 'control_computer', 'workstation', 'bus_analyzer'] }]";

    #[test]
    fn the_boards_of_a_process_go_down_together_and_are_up_after_their_boot() {
        let crash = "fault=[{ target='encoder_if', kind='crash', start_s=1.0, duration_s=0.5 }]";
        let outages = scenario(&[TOGETHER, crash]).unwrap().outages();
        let boards = vec![BoardId::DaIo, BoardId::EncoderIf];
        let expected =
            Outage { fault: 0, from: 1_000_000_000, until: 1_600_000_000, hang: false, boards: boards.clone() };
        assert_eq!(outages.len(), 1);
        assert!(outages[0].boards.iter().all(|board| boards.contains(board)) && outages[0].boards.len() == 2);
        assert_eq!(Outage { boards, ..outages[0].clone() }, expected);
    }

    #[test]
    fn a_fault_of_a_board_that_is_down_does_nothing_and_one_without_end_lasts_for_good() {
        let faults = "fault=[{ target='workstation', kind='hang', start_s=1.0 }, \
            { target='workstation', kind='crash', start_s=2.0, duration_s=0.1 }]";
        let outages = scenario(&[faults]).unwrap().outages();
        assert_eq!(
            outages.iter().map(|outage| (outage.fault, outage.until, outage.hang)).collect::<Vec<_>>(),
            [(0, Ns::MAX, true)]
        );
    }

    #[test]
    fn the_timing_plane_halts_the_tasks_and_silences_the_slaves_of_a_board_that_is_down() {
        let crash = "fault=[{ target='control_computer', kind='crash', start_s=1.0 }]";
        let scenario = scenario(&[crash]).unwrap();
        let kinds: Vec<vme::FaultKind> = scenario.outage_faults().iter().map(|fault| fault.kind).collect();
        let task = scenario.task_of("control_computer").unwrap();
        let ram = scenario.rack.slaves.iter().position(|slave| slave.name == "cpu-1-dpram").unwrap();
        assert!(kinds.contains(&vme::FaultKind::Halt(task)));
        assert!(kinds.contains(&vme::FaultKind::NoSlave(ram as u16)));
    }

    #[test]
    fn the_arm_cannot_crash_and_control_boards_are_not_started_again_unplanned() {
        let refused = |overrides: &[&str], key: &str| {
            let message = scenario(overrides).unwrap_err();
            assert!(message.contains(key), "{message}");
        };
        refused(&["fault=[{ target='hw_sim', kind='crash', start_s=1.0 }]"], "fault.0.target");
        refused(&[TOGETHER, "fault=[{ target='workstation', kind='crash', start_s=1.0 }]"], "fault.0.target");
        refused(&[&TOGETHER.replace("boot_ms=100.0", "restart='always'")], "process.0.restart");
        refused(&[&TOGETHER.replace("100.0", "1.0")], "process.0.boot_ms");
    }
}
