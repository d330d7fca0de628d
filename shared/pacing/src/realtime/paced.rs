//! The boards of one process on the wall clock: each grant is carried out when its window has passed.
//!
//! A window that ends at simulated time D is due at D on the wall clock plus a stage of the signal path, so that what a
//! board needs has normally arrived. What has not is missing, and counted when it comes. A process that is late carries on
//! at once and skips nothing.

use super::writes::Writes;
use crate::RunError;
use crate::host::{Answer, Host};
use board::BoardId;
use messages::{BOARDS, Grant, Span, SpanKind, TransferRecord, flags};
use scenario::Scenario;
use std::collections::VecDeque;
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
#[derive(Default)]
struct Pace {
    stepped_to: Ns,
    writes: Writes,
}

impl Paced {
    /// Simulated time 0 is when the wall clock shows `zero`.
    pub fn new(zero: u64, scenario: &Scenario) -> Paced {
        Paced {
            zero,
            stage_ns: stage_ns(scenario),
            queue: VecDeque::with_capacity(128),
            spare: Vec::new(),
            boards: Default::default(),
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

    /// Forgets the grants of boards that are gone.
    pub fn forget(&mut self, boards: &[BoardId]) {
        self.queue.retain(|waiting| boards.iter().all(|board| *board as u32 != waiting.grant.board));
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
        host.time(grant.flags & flags::UNMEASURED == 0);
        let mail = host.fetch(board, grant.until, pace.stepped_to)?;
        // answers to an earlier job that come with those of the next must not count as the newest
        mail.words.sort_unstable_by_key(|word| (word.job, word.task, word.index));
        let newest = mail.words.last().map_or(0, |word| word.job);
        let overwritten = mail.words.iter().filter(|word| word.t != 0 && word.job < newest).count() as u32;
        pace.writes.sort_out(&grant, &transfers, mail);
        let mut answer = host.act(&grant, &pace.writes.ready)?;
        // the plant stops where its signals change at once; here it goes on by itself
        while let Some(early) = answer.early.take().filter(|early| (grant.from + 1..grant.until).contains(early)) {
            grant.from = early;
            answer = host.act(&grant, &[])?;
        }
        // what the arm does in a window reaches da_io in the next one, in lock step too
        pace.stepped_to = if board == BoardId::DaIo { grant.from } else { grant.until };
        let (begin, end) = host.last_step();
        if let Some(spans) = host.spans() {
            spans.push(Span {
                t: grant.until,
                due,
                begin,
                end,
                window: grant.window,
                late: (begin.saturating_sub(due) > self.stage_ns).into(),
                overwritten,
                delayed: pace.writes.late,
                ..Span::new(SpanKind::Step, board)
            });
        }
        self.spare.push(transfers);
        Ok(Some((grant, answer)))
    }
}
