//! The timing plane in real time: windows are told to the boards before all decisions are known.
//!
//! A decision that is not known when its window has to be told counts as the last one of its task did. When the answer
//! comes, everything after it is worked out anew: what has been told stays, what was not told yet is told with the next
//! window, late.

use board::{Ns, Op};
use std::collections::VecDeque;
use vme::{Log, Origin, RackError, Stop, Timing, Transfer};

/// Decisions that may be open; older ones are taken to have been made as the last ones.
const MAX_OPEN: usize = 16;

/// A window to tell.
pub(crate) struct Draft {
    pub from: Ns,
    pub until: Ns,
    /// Task and job that decide at its end.
    pub decision: Option<(u16, u32)>,
    /// What has not been told before of bus and processors.
    pub log: Log,
    /// Tasks tripped by an overrun: when, task and job.
    pub trips: Vec<(Ns, u16, u32)>,
}

struct Open {
    window: u64,
    task: u16,
    job: u32,
    rest: Option<Vec<Op>>,
}

/// Windows told and decisions open.
pub(crate) struct Plan {
    /// Every decision before here is known.
    settled: Timing,
    ahead: Timing,
    open: VecDeque<Open>,
    /// What the jobs of each task did last.
    rest: Vec<Vec<Op>>,
    told_to: Ns,
    /// Transfers told, and when their data moved.
    told: Vec<(Key, Ns)>,
    /// Jobs told, and when they ended.
    told_jobs: Vec<((u16, u32), Ns)>,
}

/// What makes a transfer the same in another draft: origin, task, job, index and attempt; beside the programs', whose jobs
/// are not counted, the instant.
type Key = (Origin, u16, u32, u16, u8, Ns);

fn key(transfer: &Transfer) -> Key {
    let at = if transfer.origin == Origin::Program { 0 } else { transfer.data_at };
    (transfer.origin, transfer.task, transfer.job, transfer.index, transfer.attempt, at)
}

impl Plan {
    pub fn new(timing: Timing) -> Plan {
        let tasks = timing.rack().tasks.len();
        Plan {
            ahead: timing.clone(),
            settled: timing,
            open: VecDeque::new(),
            rest: vec![Vec::new(); tasks],
            told_to: 0,
            told: Vec::new(),
            told_jobs: Vec::new(),
        }
    }

    /// Bus and processors as far as all decisions are known.
    pub fn timing(&self) -> &Timing {
        &self.settled
    }

    /// Windows are told up to here.
    pub fn told_to(&self) -> Ns {
        self.told_to
    }

    /// Every decision so far is known.
    pub fn is_settled(&self) -> bool {
        self.open.is_empty()
    }

    /// The next window, up to the next decision or `limit`, as far as is known now; an error where time stands still.
    pub fn draft(&mut self, limit: Ns) -> Result<Draft, RackError> {
        self.ahead.clone_from(&self.settled);
        let (mut log, mut trips) = (Log::default(), Vec::new());
        let decision = loop {
            match self.ahead.advance(limit, &mut log) {
                Stop::Limit => break None,
                Stop::Decision { task, job } => {
                    let Some(open) = self.open.iter().find(|open| (open.task, open.job) == (task, job)) else {
                        break Some((task, job));
                    };
                    self.ahead.resume(task, open.rest.as_ref().unwrap_or(&self.rest[usize::from(task)]));
                }
                Stop::Overrun { task, job } => {
                    self.ahead.halt(task);
                    trips.push((self.ahead.now(), task, job));
                }
                // the begin of a fault: the windows need not stop there
                Stop::Fault { .. } => {}
                Stop::Endless { task } => return Err(self.ahead.endless(task)),
            }
        };
        log.transfers.retain(|transfer| !self.told.iter().any(|(told, _)| *told == key(transfer)));
        log.jobs.retain(|job| !self.told_jobs.iter().any(|(told, _)| *told == (job.task, job.job)));
        trips.retain(|(at, ..)| *at >= self.told_to);
        Ok(Draft { from: self.told_to, until: self.ahead.now().max(self.told_to), decision, log, trips })
    }

    /// The last draft has been told, as that window.
    pub fn tell(&mut self, window: u64, draft: &Draft) {
        self.told_to = draft.until;
        self.told.extend(draft.log.transfers.iter().map(|transfer| (key(transfer), transfer.data_at)));
        self.told_jobs.extend(draft.log.jobs.iter().map(|job| ((job.task, job.job), job.end)));
        match draft.decision {
            Some((task, job)) => self.open.push_back(Open { window, task, job, rest: None }),
            None if self.open.is_empty() => {
                self.settled.clone_from(&self.ahead);
                self.forget();
            }
            None => {}
        }
        if self.open.len() > MAX_OPEN
            && let Some(oldest) = self.open.front_mut()
        {
            oldest.rest = Some(self.rest[usize::from(oldest.task)].clone());
            self.settle();
        }
    }

    /// A task's board has decided in that window; `None` = as the last job did.
    pub fn decided(&mut self, window: u64, task: u16, rest: Option<Vec<Op>>) {
        if let Some(rest) = rest {
            self.rest[usize::from(task)] = rest;
        }
        if let Some(open) = self.open.iter_mut().find(|open| open.window == window) {
            open.rest = Some(self.rest[usize::from(task)].clone());
            self.settle();
        }
    }

    /// The board of a task is gone: what it has not answered counts as what its last job did.
    pub fn give_up(&mut self, task: u16) {
        for open in self.open.iter_mut().filter(|open| open.task == task && open.rest.is_none()) {
            open.rest = Some(self.rest[usize::from(task)].clone());
        }
        self.settle();
    }

    /// A task stops where it is, although the timing plane did not know that it would.
    pub fn halt(&mut self, task: u16) {
        self.settled.halt(task);
        self.open.retain(|open| open.task != task);
        self.settle();
    }

    /// A halted task takes up its releases again.
    pub fn restart(&mut self, task: u16) {
        self.settled.restart(task);
    }

    /// The jobs of a new board's task do nothing until it says otherwise.
    pub fn forget_rest(&mut self, task: u16) {
        self.rest[usize::from(task)].clear();
    }

    /// A task's program changes from its next release on.
    pub fn set_program(&mut self, task: u16, program: &[Op]) {
        self.settled.set_program(task, program);
    }

    /// The task that decides in that window, while that is open.
    pub fn task_of(&self, window: u64) -> Option<u16> {
        self.open.iter().find(|open| open.window == window).map(|open| open.task)
    }

    fn settle(&mut self) {
        let mut done = Log::default();
        while self.open.front().is_some_and(|first| first.rest.is_some()) {
            match self.settled.advance(self.told_to + 1, &mut done) {
                Stop::Decision { task, job } => {
                    let at = self.open.iter().position(|open| (open.task, open.job) == (task, job));
                    let known = at.and_then(|at| self.open.remove(at)).and_then(|open| open.rest);
                    self.settled.resume(task, known.as_ref().unwrap_or(&self.rest[usize::from(task)]));
                }
                // an earlier decision that came out differently has moved this one away; the next draft ends the run
                Stop::Limit | Stop::Endless { .. } => {
                    self.open.pop_front();
                }
                Stop::Overrun { task, .. } => self.settled.halt(task),
                Stop::Fault { .. } => {}
            }
        }
        self.forget();
    }

    fn forget(&mut self) {
        let now = self.settled.now();
        self.told.retain(|(_, at)| *at >= now);
        self.told_jobs.retain(|(_, end)| *end >= now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vme::rack::Rack;
    use vme::{Access, Direction, MILLISECOND, Width};

    fn write() -> Op {
        Op::Access(Access { am: 0x3D, addr: 0x300000, width: Width::D32, dir: Direction::Write, n: 1 })
    }

    fn plan() -> Plan {
        let rack: Rack =
            scenario::load("table-5-3", &[]).and_then(|document| document.scenario()).expect("scenario").rack;
        let mut timing = Timing::new(rack).expect("rack");
        timing.set_program(0, &[Op::Exec(10_000), Op::Decide]);
        timing.set_program(1, &[]);
        Plan::new(timing)
    }

    fn tell(plan: &mut Plan, window: u64) -> Draft {
        let mut draft = plan.draft(plan.told_to() + 10 * MILLISECOND).expect("time goes on");
        plan.tell(window, &draft);
        // the rack's interrupters have transfers of their own
        draft.log.transfers.retain(|transfer| transfer.origin == Origin::Program);
        draft
    }

    #[test]
    fn an_answer_in_time_gives_the_windows_of_lock_step() {
        let mut plan = plan();
        assert_eq!(tell(&mut plan, 0).decision, Some((0, 0)));
        plan.decided(0, 0, Some(vec![Op::Exec(MILLISECOND), write()]));
        assert!(plan.is_settled());
        let second = tell(&mut plan, 1);
        assert_eq!((second.decision, second.log.transfers.len()), (Some((0, 1)), 1));
        assert!(second.log.transfers[0].data_at > second.from);
    }

    #[test]
    fn a_write_decided_after_its_window_was_told_is_told_once_with_the_next() {
        let mut plan = plan();
        let first = tell(&mut plan, 0);
        assert!(tell(&mut plan, 1).log.transfers.is_empty());
        plan.decided(0, 0, Some(vec![Op::Exec(MILLISECOND), write()]));
        let third = tell(&mut plan, 2);
        assert_eq!(third.log.transfers.iter().filter(|transfer| transfer.job == 0).count(), 1);
        assert!(third.log.transfers[0].data_at < third.from && third.log.transfers[0].data_at > first.until);
        plan.decided(1, 0, None);
        plan.decided(2, 0, None);
        assert!(tell(&mut plan, 3).log.transfers.iter().all(|transfer| transfer.job != 0));
    }

    #[test]
    fn what_a_board_that_is_gone_has_not_answered_counts_as_its_last_job_and_its_task_stops() {
        let mut plan = plan();
        tell(&mut plan, 0);
        plan.decided(0, 0, Some(vec![Op::Exec(MILLISECOND), write()]));
        assert!(tell(&mut plan, 1).decision.is_some() && !plan.is_settled());
        plan.give_up(0);
        assert!(plan.is_settled());
        plan.halt(0);
        assert_eq!(tell(&mut plan, 2).decision, None);
        plan.restart(0);
        let decides = (3..6).any(|window| tell(&mut plan, window).decision.is_some());
        assert!(decides, "it takes up its releases again");
    }

    #[test]
    fn decisions_that_are_never_answered_do_not_pile_up() {
        let mut plan = plan();
        for window in 0..100 {
            let draft = tell(&mut plan, window);
            assert_eq!(draft.decision, Some((0, window as u32)));
            assert!(plan.open.len() <= MAX_OPEN);
        }
    }
}
