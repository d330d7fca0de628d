//! One variant of a scenario, from power-up to the last window.

use crate::boards;
use board::{Mail, Ns};
use messages::drive_status;
use pacing::{Context, Flow, Lockstep, Observer, RunError};
use scenario::{Process, Scenario};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use vme::Transfer;

/// Set by Ctrl-C.
pub static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What a run needs to know beside its scenario.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Name of the variant.
    pub variant: String,
    /// Every board in the chassis.
    pub in_process: bool,
    /// Record to write; none = recording off.
    pub record: Option<PathBuf>,
}

/// How a run came to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// Simulated time reached, ns.
    pub reached: Ns,
    /// The simulation left its domain there.
    pub diverged: bool,
    /// Wall time from the start to the first window.
    pub start_up: Duration,
    /// Wall time of the windows.
    pub windows: Duration,
}

/// Runs the scenario; `watcher` sees every window.
pub fn run(scenario: &Scenario, setting: &Setting, watcher: &mut dyn Observer) -> Result<Finished, RunError> {
    let start = Instant::now();
    let mut scenario = scenario.clone();
    if setting.in_process {
        scenario.processes = vec![everything_in_the_chassis()];
    }
    let end = scenario.duration_ns();
    let context = Context { prefix: String::new(), variant: setting.variant.clone(), record: setting.record.clone(), scenario };
    let mut rack = Lockstep::power_up(context, &boards::build, &boards::program, &INTERRUPTED)?;
    let start_up = start.elapsed();
    let mut guard = DivergenceGuard { watcher, diverged: false };
    rack.run(end, &mut guard)?;
    let diverged = guard.diverged;
    let reached = rack.now();
    let windows = start.elapsed() - start_up;
    rack.finish()?;
    Ok(Finished { reached, diverged, start_up, windows })
}

/// The process list of a run inside this process.
pub fn everything_in_the_chassis() -> Process {
    let boards = messages::BOARDS[1..].iter().map(|board| board.name().to_owned()).collect();
    Process { name: messages::BOARDS[0].name().to_owned(), boards, command: Vec::new() }
}

/// Ends a run whose plant has left its domain.
struct DivergenceGuard<'a> {
    watcher: &'a mut dyn Observer,
    diverged: bool,
}

impl Observer for DivergenceGuard<'_> {
    fn window(&mut self, until: Ns, mail: &Mail, transfers: &[Transfer]) -> Flow {
        self.diverged |= mail.plant_probe.iter().any(|probe| probe.status & drive_status::DIVERGED != 0);
        match self.watcher.window(until, mail, transfers) {
            Flow::Continue if self.diverged => Flow::Stop,
            flow => flow,
        }
    }
}
