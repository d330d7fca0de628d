//! The boards of one process on the wall clock: each grant is carried out when its window has passed.
//!
//! A window that ends at simulated time D is due at D on the wall clock plus a stage of the signal path, so that what a
//! board needs has normally arrived. What has not is missing, and counted when it comes. A process that is late carries on
//! at once and skips nothing.

use super::measured::Measured;
use super::writes::Writes;
use crate::RunError;
use crate::host::{Answer, Host};
use board::BoardId;
use channels::{histogram, wall_ns};
use hdrhistogram::Histogram;
use messages::{BOARDS, Grant, TransferRecord};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec};
use scenario::Scenario;
use std::collections::VecDeque;
use std::time::Duration;
use vme::Ns;

/// Stages of the signal path.
pub(crate) fn stage(board: BoardId) -> u64 {
    match board {
        BoardId::DaIo => 0,
        BoardId::HwSim => 1,
        BoardId::ForceSensorIf | BoardId::EncoderIf => 2,
        BoardId::ControlComputer => 3,
        BoardId::Workstation => 4,
        BoardId::BusAnalyzer | BoardId::Chassis => 5,
    }
}

/// Wall time between two stages.
pub(crate) fn stage_ns(scenario: &Scenario) -> Ns {
    let shortest = scenario.rack.tasks.iter().map(|task| task.period_ns).filter(|period| *period > 0).min();
    match scenario.realtime.stage_us {
        Some(us) => us * 1000,
        None => shortest.unwrap_or(10 * vme::MILLISECOND) / 10,
    }
}

/// Grants that wait for their time.
pub(crate) struct Paced {
    zero: u64,
    stage_ns: Ns,
    queue: VecDeque<Waiting>,
    spare: Vec<Vec<TransferRecord>>,
    boards: [Pace; BOARDS.len()],
}

struct Waiting {
    due: u64,
    grant: Grant,
    transfers: Vec<TransferRecord>,
}

/// How one board keeps time.
struct Pace {
    stepped_to: Ns,
    writes: Writes,
    /// From the intended to the actual start of a step, ns of wall time.
    wake_up: Histogram<u64>,
    /// Steps that began so late that the next stage did not wait for them.
    missed: u64,
    /// Duration of a step, ns of wall time.
    execution: Histogram<u64>,
}

impl Paced {
    /// Simulated time 0 is when the wall clock shows `zero`.
    pub fn new(zero: u64, scenario: &Scenario) -> Paced {
        let pace = |_| Pace {
            stepped_to: 0,
            writes: Writes::default(),
            wake_up: histogram(),
            missed: 0,
            execution: histogram(),
        };
        Paced {
            zero,
            stage_ns: stage_ns(scenario),
            queue: VecDeque::with_capacity(128),
            spare: Vec::new(),
            boards: BOARDS.map(pace),
        }
    }

    /// Takes a grant in.
    pub fn push(&mut self, grant: Grant, transfers: &[TransferRecord]) {
        let board = BoardId::from_number(grant.board as u8).unwrap_or(BoardId::Chassis);
        let due = self.zero + grant.until + stage(board) * self.stage_ns;
        let mut copy = self.spare.pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(transfers);
        let at = self.queue.partition_point(|waiting| waiting.due <= due);
        self.queue.insert(at, Waiting { due, grant, transfers: copy });
    }

    /// When the next step is due on the wall clock.
    pub fn due(&self) -> Option<u64> {
        self.queue.front().map(|waiting| waiting.due)
    }

    /// Carries the first grant out.
    pub fn step(&mut self, host: &mut Host) -> Result<Option<(Grant, Answer)>, RunError> {
        let Some(Waiting { due, mut grant, transfers }) = self.queue.pop_front() else { return Ok(None) };
        let board = BoardId::from_number(grant.board as u8).unwrap_or(BoardId::Chassis);
        let pace = &mut self.boards[board as usize];
        let began = wall_ns();
        let behind = began.saturating_sub(due);
        pace.wake_up.saturating_record(behind.max(1));
        pace.missed += u64::from(behind > self.stage_ns);
        let mail = host.fetch(board, pace.stepped_to)?;
        // answers to an earlier job that come with those of the next must not count as the newest
        mail.words.sort_unstable_by_key(|word| (word.job, word.task, word.index));
        pace.writes.sort_out(&grant, &transfers, mail);
        let mut answer = host.act(&grant, &pace.writes.ready)?;
        // the plant stops where its signals change at once; here it goes on by itself
        while let Some(early) = answer.early.take().filter(|early| (grant.from + 1..grant.until).contains(early)) {
            grant.from = early;
            answer = host.act(&grant, &[])?;
        }
        // what the arm does in a window reaches da_io in the next one, in lock step too
        pace.stepped_to = if board == BoardId::DaIo { grant.from } else { grant.until };
        pace.execution.saturating_record(wall_ns().saturating_sub(began).max(1));
        self.spare.push(transfers);
        Ok(Some((grant, answer)))
    }

    /// What has been measured here so far.
    pub fn measured(&self, host: &mut Host) -> Vec<Measured> {
        let mut rows = Vec::new();
        for (board, pace) in BOARDS.iter().zip(&self.boards).filter(|(_, pace)| !pace.wake_up.is_empty()) {
            let name = board.name();
            rows.push(Measured::of(format!("wake-up {name}"), pace.missed, &pace.wake_up));
            rows.push(Measured::of(format!("step {name}"), 0, &pace.execution));
            let late = &pace.writes.late;
            rows.push(Measured::of(format!("write to {name} after its time"), late.len(), late));
        }
        let transports = host.exchange().transports().filter(|transport| !transport.latency.is_empty());
        rows.extend(
            transports.map(|one| Measured::of(format!("sent to read {}", one.channel), one.late, &one.latency)),
        );
        rows
    }
}

/// Sleeps until the wall clock shows `due`, or for `limit` if that ends first.
pub(crate) fn sleep_until(due: u64, limit: Duration) {
    let at = due.min(wall_ns() + limit.as_nanos() as u64);
    let at = Timespec { tv_sec: (at / 1_000_000_000) as _, tv_nsec: (at % 1_000_000_000) as _ };
    // a signal ends it early: the caller looks at the clock again
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &at);
}
