//! Lock step: simulated time in windows, each from one decision point to the next.
//!
//! A window: the timing plane runs ahead to the next decision point D; da_io changes its outputs at the exact times of the
//! writes made to it; the arm integrates to D with them (and may stop early: then the timing plane goes back and runs to
//! that instant); force sensor and encoders answer the reads made to them at *their* times; the board that decides at D is
//! stepped with the values read. The recorder gets the same grants one way, with credit.

use crate::boards::{Boards, program_transfers};
use crate::error::at;
use crate::host::Factory;
use crate::{Context, RunError};
use board::{BoardId, Mail, Ns, Op};
use messages::{BOARDS, Event, EventKind, Grant, Severity, Span, TransferRecord, flags};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use vme::{Log, Stop, Timing};

/// Longest window: bounds what a board has to keep.
const MAX_WINDOW: Ns = 10 * vme::MILLISECOND;
/// The boards on the wires, in the order in which signals pass them.
const WIRES: [BoardId; 4] = [BoardId::DaIo, BoardId::HwSim, BoardId::ForceSensorIf, BoardId::EncoderIf];
/// Those that act when the arm has cut a window short; the arm itself has.
const WIRES_AGAIN: [BoardId; 3] = [BoardId::DaIo, BoardId::ForceSensorIf, BoardId::EncoderIf];

/// Whether the run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Next window.
    Continue,
    /// The run has come to its end.
    Stop,
}

/// Sees every window of a run, in order.
pub trait Observer {
    /// What happened on the bus and the processors in a window; what the chassis itself has to say of it goes to the record.
    fn account(&mut self, _until: Ns, _log: &Log, _record: &mut Mail) {}
    /// Probes and events of the window's boards, and what happened on the bus and the processors in it.
    fn window(&mut self, until: Ns, mail: &Mail, log: &Log) -> Flow;

    /// What has been measured since the last call, and how many messages of measurements were lost; only called where
    /// [`Context::measure`] asks for it.
    fn measured(&mut self, _spans: &[Span], _lost: u32) {}
}

/// A rack in lock step.
pub struct Lockstep<'f> {
    timing: Timing,
    ahead: Timing,
    boards: Boards<'f>,
    /// Rest of the jobs of each task, as its board last said.
    rest: Vec<Vec<Op>>,
    log: Log,
    /// Grants of the last round.
    turns: Vec<Grant>,
    own_mail: Mail,
}

impl<'f> Lockstep<'f> {
    /// Powers the rack up: starts the processes of the scenario (none if all its boards are in the chassis) and waits until
    /// each is ready. `programs` finds the built-in program of a process.
    pub fn power_up(
        context: Context,
        factory: Factory<'f>,
        programs: &dyn Fn(&scenario::Process) -> Vec<String>,
        interrupted: &'static AtomicBool,
    ) -> Result<Lockstep<'f>, RunError> {
        let (boards, timing) = Boards::power_up(context, factory, programs, interrupted)?;
        Ok(Lockstep {
            ahead: timing.clone(),
            rest: vec![Vec::new(); timing.rack().tasks.len()],
            timing,
            boards,
            log: Log::default(),
            turns: Vec::with_capacity(BOARDS.len()),
            own_mail: Mail::default(),
        })
    }

    /// Process numbers of the run.
    pub fn pids(&self) -> impl Iterator<Item = (&str, u32)> {
        self.boards.power.pids()
    }

    /// Folder of the run, where it has one.
    pub fn folder(&self) -> Option<&Path> {
        self.boards.folder.as_ref().map(|folder| folder.path.as_path())
    }

    /// What was lost on the way although the run went on, in words.
    pub fn losses(&self) -> &[String] {
        &self.boards.life.losses
    }

    /// Simulated time reached.
    pub fn now(&self) -> Ns {
        self.timing.now()
    }

    /// Bus and processors as they stand.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// The longest job of each task that its board has asked for so far.
    pub fn programs(&self) -> Vec<Vec<Op>> {
        self.boards.programs()
    }

    /// Runs to `end`, or until the observer stops the run.
    pub fn run(&mut self, end: Ns, observer: &mut dyn Observer) -> Result<(), RunError> {
        while self.timing.now() < end {
            if self.boards.window.is_multiple_of(1024) {
                self.boards.watch()?;
            }
            self.boards.change_lives(self.timing.now(), &mut self.timing, &mut self.rest)?;
            let flow = self.step(end, observer)?;
            let until = self.timing.now();
            let mail = self.boards.host.read()?;
            if let Some(probe) = mail.plant_probe.last() {
                self.boards.life.lines.probe(probe);
            }
            let flow = match observer.window(until, mail, &self.log) {
                Flow::Stop => Flow::Stop,
                Flow::Continue => flow,
            };
            mail.clear();
            self.boards.show_spans(observer)?;
            if flow == Flow::Stop {
                break;
            }
        }
        Ok(())
    }

    /// Ends the run: the recorder closes its file, the processes leave. Returns what the boards still had to say.
    pub fn finish(mut self) -> Result<(), RunError> {
        let now = self.timing.now();
        self.boards.wake_recorder();
        for board in BOARDS[1..].iter().filter(|board| !self.boards.life.is_down(**board)).collect::<Vec<_>>() {
            let grant = self.boards.grant_of(*board, now, now, flags::FINISH);
            self.boards.ask(&grant)?;
        }
        self.boards.power.shut_down();
        Ok(())
    }

    /// One window.
    fn step(&mut self, end: Ns, observer: &mut dyn Observer) -> Result<Flow, RunError> {
        let from = self.timing.now();
        let limit = end.min(from + MAX_WINDOW).min(self.boards.life.next_change());
        // what has to be there when the boards act
        self.own_mail.clear();
        self.own_mail.amplifier.append(&mut self.boards.life.mail.amplifier);
        if !self.own_mail.amplifier.is_empty() {
            self.boards.host.send(&self.own_mail)?;
        }
        let mut stop = self.look_ahead(limit);
        let mut until = self.ahead.now();

        self.plan_turns(&WIRES, from, until, stop);
        self.boards.take_turns(&self.turns)?;
        if self.boards.answers.len() < self.turns.len()
            && let Some((BoardId::HwSim, early)) = self.cut()
        {
            if early <= from {
                return Err(RunError::BadAnswer {
                    board: BoardId::HwSim.name(),
                    what: format!("an early return at {early} ns, outside ({from}, {until}] ns"),
                    when: at(from),
                });
            }
            stop = self.look_ahead(early);
            until = early;
            self.plan_turns(&WIRES_AGAIN, from, until, stop);
            let da_io = self.turns.iter_mut().filter(|turn| turn.board == BoardId::DaIo as u32);
            da_io.for_each(|turn| turn.flags |= flags::RERUN);
            self.boards.take_turns(&self.turns)?;
        }
        for i in 0..self.turns.len() {
            self.answered(i)?;
        }
        self.own_mail.clear();
        self.own_mail.events.append(&mut self.boards.life.mail.events);
        let written = &self.boards.transfers[BoardId::DaIo as usize];
        self.boards.life.lines.transfers(written);
        self.boards.injections.tell(until, &mut self.own_mail.events);
        if let Stop::Overrun { task, job } = stop {
            self.ahead.halt(task);
            let event = Event::new(until, EventKind::OverrunTrip, Severity::Error, job.into(), task.into());
            self.own_mail.events.push(event);
        }
        observer.account(until, &self.log, &mut self.own_mail);
        self.record(from, until)?;
        std::mem::swap(&mut self.timing, &mut self.ahead);
        self.boards.reached = until;
        self.boards.window += 1;
        Ok(Flow::Continue)
    }

    /// Runs a copy of the timing plane to the next decision point or `limit`, and sorts the transfers by the board they are made to.
    fn look_ahead(&mut self, limit: Ns) -> Stop {
        self.ahead.clone_from(&self.timing);
        self.log.clear();
        let mut stop = self.ahead.advance(limit, &mut self.log);
        // boards that are down have been told of, and this window began there
        while let Stop::Fault { fault } = stop
            && usize::from(fault) >= self.boards.timing_faults
        {
            stop = self.ahead.advance(limit, &mut self.log);
        }
        self.boards.sort_transfers(&self.log);
        stop
    }

    /// The recorder gets the window's transfers and a grant.
    fn record(&mut self, from: Ns, until: Ns) -> Result<(), RunError> {
        self.own_mail.transfers.extend(program_transfers(&self.log).map(TransferRecord::from));
        self.boards.host.send(&self.own_mail)?;
        let grant = self.boards.grant_of(BoardId::BusAnalyzer, from, until, 0);
        self.boards.grant_recorder(&grant)
    }

    /// Who has a turn in a window: the boards on the wires, then the masters that decide or were written to.
    fn plan_turns(&mut self, wires: &[BoardId], from: Ns, until: Ns, stop: Stop) {
        self.turns.clear();
        let up = |board: &&BoardId| !self.boards.life.is_down(**board);
        self.turns.extend(wires.iter().filter(up).map(|board| self.boards.grant_of(*board, from, until, 0)));
        for board in [BoardId::ControlComputer, BoardId::Workstation].iter().filter(up).copied() {
            let mut grant = self.boards.grant_of(board, from, until, 0);
            if let Stop::Decision { task, job } = stop
                && self.boards.of_task[usize::from(task)] == board
            {
                grant.flags = flags::DECIDE;
                (grant.task, grant.job) = (task.into(), job);
            } else if self.boards.transfers[board as usize].is_empty() {
                continue;
            }
            self.turns.push(grant);
        }
    }

    /// The board that cut the last round short, and to when.
    fn cut(&self) -> Option<(BoardId, Ns)> {
        let last = self.boards.answers.len().checked_sub(1)?;
        Some((BOARDS[self.turns[last].board as usize], self.boards.answers[last].early?))
    }

    /// Takes in what a board answered in its turn.
    fn answered(&mut self, turn: usize) -> Result<(), RunError> {
        let grant = self.turns[turn];
        let board = BOARDS[grant.board as usize];
        let answer = self.boards.answers.get_mut(turn).map(std::mem::take).unwrap_or_default();
        if let Some(early) = answer.early
            && board != BoardId::HwSim
        {
            return Err(RunError::BadAnswer {
                board: board.name(),
                what: format!("an early return at {early} ns; only hw_sim may cut a window"),
                when: at(self.timing.now()),
            });
        }
        if grant.flags & flags::DECIDE != 0 {
            let task = grant.task as u16;
            if let Some(rest) = answer.rest {
                self.boards.note_rest(task, &rest);
                self.rest[usize::from(task)] = rest;
            }
            self.ahead.resume(task, &self.rest[usize::from(task)]);
        }
        for (task, program) in answer.programs {
            self.boards.note_program(board, task, &program)?;
            self.ahead.set_program(task, &program);
        }
        Ok(())
    }
}
