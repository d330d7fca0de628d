//! From `[[fault]]` to instants: when each fault holds, and what the timing plane has to know of it.
//!
//! Every fault has a random stream of its own, so another one beside it does not move it.

use crate::error::Problem;
use crate::hardware::nanoseconds;
use crate::model::{Fault, FaultKind, Scenario};
use crate::schedule::Schedule;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use messages::BoardId;
use vme::Ns;

/// Streams of faults begin here; boards use the lower ones.
const STREAM: u64 = 1 << 32;
/// A fault that begins more often is refused.
const MAX_OCCURRENCES: usize = 100_000;

/// One time that a fault holds: in `[from, until)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Occurrence {
    /// Number of the fault in the scenario.
    pub fault: usize,
    /// From this instant …
    pub from: Ns,
    /// … up to, but not at, this one; [`Ns::MAX`] = to the end.
    pub until: Ns,
}

/// The force sensor as a fault's target.
const FORCE_SENSOR: &str = "force_sensor";
/// The joints as targets, counted from the base.
const JOINT_NAMES: [&str; messages::JOINTS] = ["joint-1", "joint-2", "joint-3", "joint-4", "joint-5", "joint-6", "joint-7"];
/// Boards whose messages travel over the bus.
const SENDERS: [BoardId; 5] = [
    BoardId::DaIo,
    BoardId::ForceSensorIf,
    BoardId::EncoderIf,
    BoardId::ControlComputer,
    BoardId::Workstation,
];
/// Boards whose clock shows: the control computer's, and those of the cards that stamp what it reads.
const CLOCKS: [BoardId; 4] = [BoardId::DaIo, BoardId::ForceSensorIf, BoardId::EncoderIf, BoardId::ControlComputer];
/// Boards that may crash: all but the arm, which is physics.
const COMPUTERS: [BoardId; 6] = [
    BoardId::DaIo,
    BoardId::ForceSensorIf,
    BoardId::EncoderIf,
    BoardId::ControlComputer,
    BoardId::Workstation,
    BoardId::BusAnalyzer,
];

/// Where a fault acts, and so who carries it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// Bridges, cable and samples of the force sensor.
    ForceSensor,
    /// Encoder of a joint, from 0.
    Encoder(usize),
    /// D/A channel of a joint.
    Converter(usize),
    /// Amplifier and brake of a joint.
    Drive(usize),
    /// Messages that this board sends over the bus.
    Messages(BoardId),
    /// This board: its process, clock or program.
    Board(BoardId),
    /// The supply of all boards.
    Power,
    /// Bus and processors.
    Timing(vme::FaultKind),
}

/// The clock of a board gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockDrift {
    /// Whose.
    pub board: BoardId,
    /// From then on, ns.
    pub from: Ns,
    /// Until then.
    pub until: Ns,
    /// Part of one.
    pub gain: f64,
}

impl Scenario {
    /// When each fault holds, in the order of the faults, then of time.
    pub fn occurrences(&self) -> Vec<Occurrence> {
        let of = |(fault, stated): (usize, &Fault)| occurrences(fault, stated, self.seed, self.duration_ns());
        self.faults.iter().enumerate().flat_map(of).collect()
    }

    /// The faults that the timing plane has to know: first those of bus and processors, so many, then what messages that
    /// come twice, clocks that drift and boards that are down do to them.
    pub fn fault_plan(&self) -> (vme::FaultPlan, usize) {
        let (mut planned, mut caused) = (Vec::new(), Vec::new());
        for Occurrence { fault, from, until } in self.occurrences() {
            let holds = |kind| vme::Fault { from_ns: from, until_ns: until, kind };
            match self.fault_site(fault) {
                Ok(Site::Timing(kind)) => planned.push(holds(kind)),
                Ok(Site::Messages(board)) if self.faults[fault].kind == FaultKind::Duplicate => {
                    caused.extend(self.repeated_accesses(board).into_iter().map(holds));
                }
                Ok(Site::Board(board)) if self.faults[fault].kind == FaultKind::ClockDrift => {
                    let gain_ppb = (self.faults[fault].amount * 1e3).round() as i64;
                    let drift = |timer| holds(vme::FaultKind::Drift { timer, gain_ppb });
                    caused.extend(self.timers(board).into_iter().map(drift));
                }
                // a target that does not exist has been refused
                _ => {}
            }
        }
        let first = planned.len();
        planned.extend(caused);
        planned.extend(self.outage_faults());
        (vme::FaultPlan { faults: planned }, first)
    }

    /// When the boards' own clocks are off simulated time.
    pub fn clock_drifts(&self) -> Vec<ClockDrift> {
        let drift = |Occurrence { fault, from, until }: Occurrence| {
            let stated = &self.faults[fault];
            match self.fault_site(fault) {
                Ok(Site::Board(board)) if stated.kind == FaultKind::ClockDrift => {
                    Some(ClockDrift { board, from, until, gain: stated.amount * 1e-6 })
                }
                _ => None,
            }
        };
        self.occurrences().into_iter().filter_map(drift).collect()
    }

    /// The accesses that carry this board's messages over the bus, twice each: reads of its slaves, writes of its tasks.
    fn repeated_accesses(&self, board: BoardId) -> Vec<vme::FaultKind> {
        let own = |name: &String| *name == board.name();
        let slaves = self.rack.slaves.iter().enumerate().filter(|(_, slave)| own(&slave.board));
        let tasks = self.rack.tasks.iter().enumerate().filter(|(_, task)| own(&task.board));
        let reads = slaves.map(|(slave, _)| vme::FaultKind::RepeatedRead(slave as u16));
        reads.chain(tasks.map(|(task, _)| vme::FaultKind::RepeatedWrite(task as u16))).collect()
    }

    /// What ticks by this board's clock: the timers of its tasks, and the events of its cards.
    fn timers(&self, board: BoardId) -> Vec<vme::Timer> {
        let rack = &self.rack;
        let is_own = |card: &str| rack.slaves.iter().any(|slave| slave.card() == card && slave.board == board.name());
        let tasks = rack.tasks.iter().enumerate().filter(|(_, task)| task.board == board.name());
        let interrupters = rack.interrupters.iter().enumerate().filter(|(_, interrupter)| is_own(&interrupter.card));
        let of_tasks = tasks.map(|(task, _)| vme::Timer::Task(task as u16));
        of_tasks.chain(interrupters.map(|(i, _)| vme::Timer::Interrupter(i as u16))).collect()
    }

    /// Where a fault acts. The problem names what its kind befalls.
    pub fn fault_site(&self, fault: usize) -> Result<Site, Problem> {
        use FaultKind::*;
        let Fault { target, kind, amount, .. } = &self.faults[fault];
        let rack = &self.rack;
        let unknown = |what: &str, names: &[&str]| {
            let expected = format!("is `{target}`, expected {what} for `{}`: {}", kind.name(), names.join(", "));
            Problem::new(format!("fault.{fault}.target"), expected)
        };
        let find = |what: &str, names: Vec<&str>| {
            names.iter().position(|name| name == target).map(|i| i as u16).ok_or_else(|| unknown(what, &names))
        };
        let only = |name: &str, site: Site| {
            find("this name", vec![name])?;
            Ok(site)
        };
        let joint = || find("a joint", JOINT_NAMES.to_vec()).map(usize::from);
        let board = |boards: &[BoardId]| {
            find("a board", boards.iter().map(|board| board.name()).collect()).map(|i| boards[usize::from(i)])
        };
        let task = || find("a task of the rack", rack.tasks.iter().map(|task| task.name.as_str()).collect());
        let timing = |kind| Ok(Site::Timing(kind));
        match kind {
            Delay | WireBreak if target == FORCE_SENSOR => Ok(Site::ForceSensor),
            Bias | Drift | Stuck | Noise | Spike | Saturation | Dropout => only(FORCE_SENSOR, Site::ForceSensor),
            WireBreak | LostCounts | QuadratureError | Wrap | IndexLoss => Ok(Site::Encoder(joint()?)),
            DaStuck | DaOffset => Ok(Site::Converter(joint()?)),
            AmplifierTrip | BrakeSlip | BrakeStuck => Ok(Site::Drive(joint()?)),
            Delay | Jitter | Drop | Duplicate | Reorder | BitFlip => Ok(Site::Messages(board(&SENDERS)?)),
            Crash | Hang => Ok(Site::Board(board(&COMPUTERS)?)),
            ClockDrift => Ok(Site::Board(board(&CLOCKS)?)),
            Gone | StaleCommand | WrongCommand => only("workstation", Site::Board(BoardId::Workstation)),
            PowerFail => only("power", Site::Power),
            NoSlave => {
                let names = rack.slaves.iter().map(|slave| slave.name.as_str()).collect();
                timing(vme::FaultKind::NoSlave(find("a slave of the rack", names)?))
            }
            Starvation => {
                let plane = vme::Timing::new(rack.clone()).map_err(|error| Problem::new("rack", error.to_string()))?;
                let names = (0..).map_while(|i| plane.master_name(i)).collect();
                timing(vme::FaultKind::Starvation(find("a master of the rack", names)?))
            }
            StuckBus => only("bus", Site::Timing(vme::FaultKind::StuckBus)),
            LostInterrupt => {
                let names = rack.interrupters.iter().map(|interrupter| interrupter.name.as_str()).collect();
                timing(vme::FaultKind::LostInterrupt(find("an interrupter of the rack", names)?))
            }
            CableOut => {
                let names = rack.adaptors.iter().map(|adaptor| adaptor.name.as_str()).collect();
                timing(vme::FaultKind::CableOut(find("an adaptor of the rack", names)?))
            }
            Slow => timing(vme::FaultKind::Slow { task: task()?, percent: (amount * 100.0).round() as u32 }),
            Overrun => timing(vme::FaultKind::Overrun { task: task()?, more_ns: nanoseconds(amount * 1e-3) }),
        }
    }
}

/// Refuses faults that make no sense, each with its key.
pub(crate) fn check(scenario: &Scenario) -> Result<(), Problem> {
    if scenario.faults.len() > Schedule::MOST {
        let many = format!("has {} elements, expected at most {}", scenario.faults.len(), Schedule::MOST);
        return Err(Problem::new("fault", many));
    }
    for (i, fault) in scenario.faults.iter().enumerate() {
        let refuse = |key: &str, message: String| Err(Problem::new(format!("fault.{i}.{key}"), message));
        let time = |key: &str, value: Option<f64>, least: f64| match value {
            Some(value) if !(least..=1e6).contains(&value) => {
                refuse(key, format!("is {value}, expected {least} to 1 000 000 s"))
            }
            _ => Ok(()),
        };
        time("start_s", Some(fault.start_s), 0.0)?;
        time("duration_s", fault.duration_s, 1e-6)?;
        time("every_s", fault.every_s, 1e-3)?;
        time("mean_time_between_s", fault.mean_time_between_s, 1e-3)?;
        if !(0.0..=1.0).contains(&fault.probability) {
            return refuse("probability", format!("is {}, expected 0 to 1", fault.probability));
        }
        if fault.every_s.is_some() && fault.mean_time_between_s.is_some() {
            return refuse("every_s", "stands beside mean_time_between_s; state one of them".into());
        }
        if (fault.every_s.is_some() || fault.mean_time_between_s.is_some()) && fault.duration_s.is_none() {
            return refuse("duration_s", "is missing; a fault that comes again must end first".into());
        }
        if let (Some(every), Some(duration)) = (fault.every_s, fault.duration_s)
            && duration >= every
        {
            return refuse("duration_s", format!("is {duration}, expected less than every_s = {every}"));
        }
        if let Some(axis) = fault.axes.iter().find(|axis| **axis > 5) {
            return refuse("axes", format!("has {axis}, expected 0 to 5 (force x y z, moment x y z)"));
        }
        let least = match fault.kind {
            FaultKind::Noise => Some(0.0),
            FaultKind::Slow => Some(0.01),
            FaultKind::Delay | FaultKind::Jitter | FaultKind::Overrun | FaultKind::BrakeSlip => Some(0.0),
            FaultKind::LostCounts | FaultKind::QuadratureError | FaultKind::Wrap | FaultKind::BitFlip => Some(1.0),
            _ => None,
        };
        if let Some(least) = least.filter(|least| !(*least..=1e4).contains(&fault.amount)) {
            return refuse("amount", format!("is {}, expected {least} to 10 000", fault.amount));
        }
        let range = match (fault.kind, scenario.fault_site(i)?) {
            (FaultKind::Delay | FaultKind::Jitter, Site::Messages(_)) => Some((1e-3, 1e4)),
            (FaultKind::Drop, _) => Some((0.0, 1.0)),
            (FaultKind::BitFlip, _) => Some((1.0, 32.0)),
            (FaultKind::ClockDrift, _) => Some((-1e5, 1e5)),
            _ => None,
        };
        if let Some((least, most)) = range.filter(|(least, most)| !(*least..=*most).contains(&fault.amount)) {
            return refuse("amount", format!("is {}, expected {least} to {most}", fault.amount));
        }
        if occurrences(i, fault, scenario.seed, scenario.duration_ns()).len() >= MAX_OCCURRENCES {
            return refuse("every_s", format!("makes {MAX_OCCURRENCES} occurrences or more"));
        }
    }
    Ok(())
}

fn occurrences(fault: usize, stated: &Fault, seed: u64, end: Ns) -> Vec<Occurrence> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(STREAM + fault as u64);
    // uniform in (0, 1]
    let mut uniform = || ((rng.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64;
    let mut found = Vec::new();
    let mut from = nanoseconds(stated.start_s);
    while from < end && found.len() < MAX_OCCURRENCES {
        let until = stated.duration_s.map_or(Ns::MAX, |duration| from + nanoseconds(duration));
        if uniform() <= stated.probability {
            found.push(Occurrence { fault, from, until });
        }
        from = match (stated.every_s, stated.mean_time_between_s) {
            (Some(every), _) => from + nanoseconds(every),
            (None, Some(mean)) => until + nanoseconds(-mean * libm::log(uniform())),
            (None, None) => break,
        };
    }
    found
}
