//! Tasks in the timing plane: releases, overruns, and the record of each job.

use super::{Sink, Stop, Timing};
use crate::Ns;
use crate::fault::{FaultKind, Timer};
use crate::program::{Op, Program};
use crate::rack::{Overrun, Release};

/// Releases of an [`Overrun::Late`] task that may wait; more are lost.
const BACKLOG: usize = 64;

/// When the parts of one job took place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JobRecord {
    /// Index of the task.
    pub task: u16,
    /// Activation number: count of timer periods, or number of the event that released it.
    pub job: u32,
    /// Released: timer tick, end of the interrupt's latency, or the look that found the event.
    pub release: Ns,
    /// First operation taken up.
    pub start: Ns,
    /// First access asked for.
    pub first_request: Option<Ns>,
    /// Data of its last access that it waited for.
    pub last_data: Option<Ns>,
    /// Decision point.
    pub decide: Option<Ns>,
    /// Last operation done.
    pub end: Ns,
    /// Time on the processor, stalls not counted.
    pub execution_ns: Ns,
    /// The part of it before the first access was asked for.
    pub entry_ns: Ns,
    /// Time for which its accesses stalled the processor.
    pub stalled_ns: Ns,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// Waits for its release.
    Idle,
    /// Looks for its event; `looked`: the next thing to do is to wait.
    Polling { looked: bool, event: Option<u32> },
    /// Carries out a job.
    Active,
    /// Waits for [`Timing::resume`].
    Deciding,
    /// Its board is gone.
    Halted,
}

#[derive(Debug)]
pub(super) struct Task {
    program: Program,
    /// Program from the next job on.
    staged: Program,
    has_staged: bool,
    /// What follows the decision of the running job.
    rest: Program,
    decided: bool,
    pub state: State,
    pub job: u32,
    pub index: u16,
    pub attempt: u8,
    pub pc: usize,
    /// Execution time left of the operation taken up (and of the context switch).
    pub remaining: Ns,
    /// Added once to the next execution time.
    pub overrun: Ns,
    pub started: bool,
    pub record: JobRecord,
    /// Next timer tick.
    pub tick: u64,
    backlog: Vec<(u32, Ns)>,
    pub skipped: u32,
}

impl Task {
    pub fn new(task: u16, release: &Release) -> Task {
        Task {
            program: Program::new(),
            staged: Program::new(),
            has_staged: false,
            rest: Program::new(),
            decided: false,
            state: rest_state(release),
            job: 0,
            index: 0,
            attempt: 0,
            pc: 0,
            remaining: 0,
            overrun: 0,
            started: false,
            record: JobRecord { task, ..JobRecord::default() },
            tick: 0,
            backlog: Vec::new(),
            skipped: 0,
        }
    }

    pub fn runnable(&self) -> bool {
        matches!(self.state, State::Active | State::Deciding | State::Polling { .. })
    }

    /// The operation at hand.
    pub fn operation(&self) -> Option<Op> {
        if self.decided { self.rest.get(self.pc).copied() } else { self.program.get(self.pc).copied() }
    }
}

/// What a task does between two jobs.
fn rest_state(release: &Release) -> State {
    match release {
        Release::Poll(_) => State::Polling { looked: false, event: None },
        Release::Timer | Release::Interrupt(_) => State::Idle,
    }
}

impl Clone for Task {
    fn clone(&self) -> Self {
        Task {
            program: self.program.clone(),
            staged: self.staged.clone(),
            rest: self.rest.clone(),
            backlog: self.backlog.clone(),
            ..*self
        }
    }
    // keeps the programs' memory: the chassis copies the timing plane every window
    fn clone_from(&mut self, from: &Self) {
        let (mut program, mut staged) = (std::mem::take(&mut self.program), std::mem::take(&mut self.staged));
        let (mut rest, mut backlog) = (std::mem::take(&mut self.rest), std::mem::take(&mut self.backlog));
        program.clone_from(&from.program);
        staged.clone_from(&from.staged);
        rest.clone_from(&from.rest);
        backlog.clone_from(&from.backlog);
        *self = Task { program, staged, rest, backlog, ..*from };
    }
}

impl Timing {
    /// What the task does in each job from its next release on.
    pub fn set_program(&mut self, task: u16, program: &[Op]) {
        let task = &mut self.tasks[task as usize];
        task.staged.clear();
        task.staged.extend_from_slice(program);
        task.has_staged = true;
    }

    /// How the job that stands at its decision point goes on, from this instant. A task that does not
    /// stand at one (it was halted meanwhile) stays as it is.
    pub fn resume(&mut self, task: u16, rest: &[Op]) {
        let state = &mut self.tasks[task as usize];
        debug_assert!(matches!(state.state, State::Deciding | State::Halted), "task {task} is not at a decision");
        if state.state != State::Deciding {
            return;
        }
        state.rest.clear();
        state.rest.extend_from_slice(rest);
        state.pc = 0;
        state.decided = true;
        state.state = State::Active;
        self.reschedule(self.wiring.processor_of_task[task as usize]);
    }

    /// Stops the task where it is, for good: its card has tripped.
    pub fn halt(&mut self, task: u16) {
        self.tasks[task as usize].state = State::Halted;
        self.reschedule(self.wiring.processor_of_task[task as usize]);
    }

    /// The task's timer ticks.
    pub(super) fn tick(&mut self, t: u16) -> Option<Stop> {
        let due = self.wiring.task(t);
        let task = &mut self.tasks[t as usize];
        let job = task.tick as u32;
        task.tick += 1;
        let next = self.wiring.ticks[t as usize].at(task.tick);
        self.agenda.set(due, self.faults.instant(Timer::Task(t), next));
        self.release_task(t, job)
    }

    /// Releases a job, or follows the task's policy where the one before still runs.
    pub(super) fn release_task(&mut self, t: u16, job: u32) -> Option<Stop> {
        let task = &mut self.tasks[t as usize];
        match task.state {
            State::Idle => {
                self.start(t, job, self.now);
                self.reschedule(self.wiring.processor_of_task[t as usize]);
                return None;
            }
            State::Halted => return None,
            State::Polling { .. } | State::Active | State::Deciding => {}
        }
        match self.wiring.rack.tasks[t as usize].overrun.unwrap_or_default() {
            Overrun::Late if task.backlog.len() < BACKLOG => task.backlog.push((job, self.now)),
            Overrun::Trip => {
                task.skipped += 1;
                return Some(Stop::Overrun { task: t, job });
            }
            Overrun::Skip | Overrun::Late => task.skipped += 1,
        }
        None
    }

    /// The job begins to compete for the processor.
    pub(super) fn start(&mut self, t: u16, job: u32, release: Ns) {
        let task = &mut self.tasks[t as usize];
        if task.has_staged {
            std::mem::swap(&mut task.program, &mut task.staged);
            task.has_staged = false;
        }
        task.state = State::Active;
        (task.job, task.index, task.attempt, task.pc) = (job, 0, 0, 0);
        (task.decided, task.started) = (false, false);
        task.record = JobRecord { task: t, job, release, ..JobRecord::default() };
    }

    /// The job has no operation left.
    pub(super) fn finish(&mut self, t: u16, sink: &mut impl Sink) {
        let task = &mut self.tasks[t as usize];
        task.record.end = self.now;
        sink.job(&task.record);
        task.state = rest_state(&self.wiring.rack.tasks[t as usize].release);
        if !task.backlog.is_empty() {
            let (job, release) = task.backlog.remove(0);
            self.start(t, job, release);
        }
    }

    /// Faults that begin or end now take effect; the first that begins is a stop.
    pub(super) fn fault_event(&mut self) -> Option<Stop> {
        let mut stop = None;
        let (at, i, begins) = self.fault_times[self.next_fault];
        self.next_fault += 1;
        self.agenda.set(super::Wiring::FAULT, self.fault_times.get(self.next_fault).map_or(Ns::MAX, |f| f.0));
        debug_assert_eq!(at, self.now);
        let kind = self.faults.faults[i as usize].kind;
        if begins {
            stop = Some(Stop::Fault { fault: i });
            match kind {
                FaultKind::Halt(t) => self.tasks[t as usize].state = State::Halted,
                FaultKind::Overrun { task, more_ns } => self.tasks[task as usize].overrun += more_ns,
                FaultKind::Starvation(m) => self.arbiter.withdraw(self.masters[m as usize].place),
                _ => {}
            }
        } else if self.faults.holds(self.now, kind).is_none() {
            match kind {
                FaultKind::Halt(t) => self.restart(t),
                FaultKind::Starvation(m) => {
                    let waits = !self.masters[m as usize].queue.is_empty();
                    if waits && self.bus.owner != Some(m) {
                        self.arbiter.request(self.masters[m as usize].place);
                    }
                }
                _ => {}
            }
        }
        if let FaultKind::Halt(t) = kind {
            self.reschedule(self.wiring.processor_of_task[t as usize]);
        }
        self.wake_arbiter();
        stop
    }

    /// A halted task takes up its releases again, from rest.
    pub fn restart(&mut self, t: u16) {
        let task = &mut self.tasks[t as usize];
        task.state = rest_state(&self.wiring.rack.tasks[t as usize].release);
        task.backlog.clear();
        task.remaining = 0;
        self.reschedule(self.wiring.processor_of_task[t as usize]);
    }
}
