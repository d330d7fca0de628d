//! Lock step: simulated time in windows, each from one decision point to the next.
//!
//! A window: the timing plane runs ahead to the next decision point D; da_io changes its outputs at the exact times of the
//! writes made to it; the arm integrates to D with them (and may stop early: then the timing plane goes back and runs to
//! that instant); force sensor and encoders answer the reads made to them at *their* times; the board that decides at D is
//! stepped with the values read. The recorder gets the same grants one way, with credit.

use crate::boards::{Boards, recorded_transfers};
use crate::error::at;
use crate::holdback::take_until;
use crate::host::{Answer, Factory};
use crate::{Context, RunError};
use board::{BoardId, Mail, Ns, Op};
use messages::{BOARDS, Event, EventKind, Grant, Severity, Span, TransferRecord, flags};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use vme::{Log, Stop, Timing};

/// Longest window: bounds what a board has to keep.
const MAX_WINDOW: Ns = 10 * vme::MILLISECOND;
/// Once in so many windows somebody looks whether all processes live and the user wants to stop, between two windows.
const WATCH_WINDOWS: u64 = 1024;
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

    /// Whether what is done in the window from `from` on is measured, in a run in real time that measures; not asked otherwise.
    fn measures(&mut self, _from: Ns) -> bool {
        true
    }

    /// What has been measured since the last call, and how many messages of measurements were lost; only called where
    /// [`Context::measure`] asks for it.
    fn measured(&mut self, _spans: &[Span], _lost: u32) {}
}

/// A window under way.
struct Window {
    number: u64,
    from: Ns,
    stop: Stop,
    /// What happened in it on the bus and the processors.
    log: Log,
    turns: Vec<Grant>,
    /// Bus and processors as they stand at its end, before the task that decides there goes on.
    timing: Timing,
}

impl Window {
    fn new(timing: &Timing) -> Window {
        let (log, turns) = (Log::default(), Vec::with_capacity(BOARDS.len()));
        Window { number: 0, from: 0, stop: Stop::Limit, log, turns, timing: timing.clone() }
    }

    fn until(&self) -> Ns {
        self.timing.now()
    }

    /// The task that decides at the window's end.
    fn decides(&self) -> Option<u16> {
        if let Stop::Decision { task, .. } = self.stop { Some(task) } else { None }
    }
}

/// A rack in lock step.
pub struct Lockstep<'f> {
    timing: Timing,
    boards: Boards<'f>,
    /// Rest of the jobs of each task, as its board last said.
    rest: Vec<Vec<Op>>,
    /// In the order of time.
    windows: VecDeque<Window>,
    /// Memory for others.
    spare: Vec<Window>,
    own_mail: Mail,
    /// What the chassis hears of a window.
    mail: Mail,
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
        if let Some(processor) = boards.processor_kept.as_ref().filter(|_| boards.turns.most > 1) {
            processor.leave();
        }
        Ok(Lockstep {
            rest: vec![Vec::new(); timing.rack().tasks.len()],
            timing,
            windows: VecDeque::with_capacity(boards.turns.most),
            spare: Vec::with_capacity(boards.turns.most),
            boards,
            own_mail: Mail::default(),
            mail: Mail::default(),
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
            if self.windows.is_empty() {
                if self.boards.window.is_multiple_of(WATCH_WINDOWS) {
                    self.boards.watch()?;
                }
                self.boards.change_lives(self.timing.now(), &mut self.timing, &mut self.rest)?;
            }
            self.open_windows(end)?;
            let Some(window) = self.windows.pop_front() else { break };
            let flow = self.close(window, observer)?;
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
        // the boards may be further than the last window that was closed
        let reached = self.windows.back().map_or(now, Window::until);
        while let Some(window) = self.windows.pop_front() {
            if self.boards.see_through(&window.turns)?.is_some() {
                self.boards.void_turns();
                self.windows.clear();
            }
        }
        self.boards.wake_recorder();
        for board in BOARDS[1..].iter().filter(|board| !self.boards.life.is_down(**board)).collect::<Vec<_>>() {
            let at = if *board == BoardId::BusAnalyzer { now } else { reached };
            let grant = self.boards.grant_of(*board, at, at, flags::FINISH);
            self.boards.ask(&grant)?;
        }
        self.boards.power.shut_down();
        Ok(())
    }

    /// Opens windows up to `end`, as many as may be under way.
    fn open_windows(&mut self, end: Ns) -> Result<(), RunError> {
        let end = end.min(self.boards.life.next_change());
        while self.windows.len() < self.boards.turns.ahead
            && self.windows.back().map_or(self.timing.now(), Window::until) < end
            && (self.windows.is_empty() || !self.boards.life.has_lost() && !self.boards.window.is_multiple_of(WATCH_WINDOWS))
        {
            self.open(end)?;
        }
        Ok(())
    }

    /// Opens the next window, up to `end` at most: the boards get their turns.
    fn open(&mut self, end: Ns) -> Result<(), RunError> {
        let mut window = self.spare.pop().unwrap_or_else(|| Window::new(&self.timing));
        window.timing.clone_from(self.windows.back().map_or(&self.timing, |before| &before.timing));
        if let Some(task) = self.windows.back().and_then(Window::decides) {
            window.timing.resume(task, &self.rest[usize::from(task)]);
        }
        (window.number, window.from) = (self.boards.window, window.timing.now());
        // what has to be there when the boards act
        self.own_mail.clear();
        self.own_mail.amplifier.append(&mut self.boards.life.mail.amplifier);
        if !self.own_mail.amplifier.is_empty() {
            self.boards.host.send(&self.own_mail)?;
        }
        let limit = end.min(window.from + MAX_WINDOW);
        self.look_ahead(&mut window, limit)?;
        self.plan_turns(&mut window, &WIRES);
        let tell = self.boards.turns.tells(window.number) || window.until() >= end;
        self.boards.give_turns(&mut window.turns, tell)?;
        self.boards.life.lines.transfers(&self.boards.transfers[BoardId::DaIo as usize]);
        self.boards.window += 1;
        self.windows.push_back(window);
        Ok(())
    }

    /// Runs the window's copy of the timing plane to the next decision point or `limit`, and sorts the transfers by the
    /// board they are made to.
    fn look_ahead(&mut self, window: &mut Window, limit: Ns) -> Result<(), RunError> {
        window.log.clear();
        window.stop = window.timing.advance(limit, &mut window.log);
        // boards that are down have been told of, and this window began there; messages and clocks are told of in any
        while let Stop::Fault { fault } = window.stop
            && usize::from(fault) >= self.boards.timing_faults
        {
            window.stop = window.timing.advance(limit, &mut window.log);
        }
        match window.stop {
            Stop::Overrun { task, .. } => window.timing.halt(task),
            Stop::Endless { task } => return Err(window.timing.endless(task).into()),
            _ => {}
        }
        self.boards.sort_transfers(&window.log);
        Ok(())
    }

    /// Who has a turn in a window: the boards on the wires, then the masters that decide or were written to.
    fn plan_turns(&mut self, window: &mut Window, wires: &[BoardId]) {
        let (from, until) = (window.from, window.until());
        let grant_of = |board| Grant { window: window.number, ..self.boards.grant_of(board, from, until, 0) };
        let up = |board: &&BoardId| !self.boards.life.is_down(**board);
        window.turns.clear();
        window.turns.extend(wires.iter().filter(up).map(|board| grant_of(*board)));
        for board in [BoardId::ControlComputer, BoardId::Workstation].iter().filter(up).copied() {
            let mut grant = grant_of(board);
            if let Stop::Decision { task, job } = window.stop
                && self.boards.of_task[usize::from(task)] == board
            {
                grant.flags = flags::DECIDE;
                (grant.task, grant.job) = (task.into(), job);
            } else if self.boards.transfers[board as usize].is_empty() {
                continue;
            }
            window.turns.push(grant);
        }
    }

    /// Sees a window through to its end: what happened in it goes to the record and to the observer.
    fn close(&mut self, mut window: Window, observer: &mut dyn Observer) -> Result<Flow, RunError> {
        let (mut taken, mut programs) = (0, Vec::new());
        self.boards.turns.look_further();
        while let Some((place, answer)) = self.boards.see_through(&window.turns[taken..])? {
            // the windows behind this one were opened without knowing of it
            self.boards.void_turns();
            self.spare.extend(self.windows.drain(..));
            self.boards.window = window.number + 1;
            taken += place;
            let board = BOARDS[window.turns[taken].board as usize];
            match answer.early {
                Some(early) if board != BoardId::HwSim => {
                    let what = format!("an early return at {early} ns; only hw_sim may cut a window");
                    return Err(RunError::BadAnswer { board: board.name(), what, when: at(window.from) });
                }
                Some(early) if answer.cuts(window.until()) => {
                    self.cut(&mut window, early)?;
                    taken = 0;
                }
                _ => {
                    self.take_in(&window, board, answer, &mut programs)?;
                    taken += 1;
                    self.boards.sort_transfers(&window.log);
                }
            }
            self.boards.give_turns(&mut window.turns[taken..], true)?;
        }
        if let Some(task) = window.decides() {
            window.timing.resume(task, &self.rest[usize::from(task)]);
        }
        for (task, program) in &programs {
            window.timing.set_program(*task, program);
        }
        let (from, until) = (window.from, window.until());
        self.own_mail.clear();
        self.own_mail.events.append(&mut self.boards.life.mail.events);
        self.boards.injections.tell(until, &mut self.own_mail.events);
        if let Stop::Overrun { task, job } = window.stop {
            let event = Event::new(until, EventKind::OverrunTrip, Severity::Error, job.into(), task.into());
            self.own_mail.events.push(event);
        }
        observer.account(until, &window.log, &mut self.own_mail);
        self.own_mail.transfers.extend(recorded_transfers(&window.log).map(TransferRecord::from));
        self.boards.host.send(&self.own_mail)?;
        let grant = self.boards.grant_of(BoardId::BusAnalyzer, from, until, 0);
        self.boards.grant_recorder(&Grant { window: window.number, ..grant })?;
        std::mem::swap(&mut self.timing, &mut window.timing);
        self.boards.reached = until;
        self.mail.clear();
        take_until(until, self.boards.host.read()?, &mut self.mail);
        if let Some(probe) = self.mail.plant_probe.last() {
            self.boards.life.lines.probe(probe);
        }
        let flow = observer.window(until, &self.mail, &window.log);
        self.spare.push(window);
        Ok(flow)
    }

    /// The arm has cut the window short: it is run again to that instant, by those that have acted before and by those
    /// that have not.
    fn cut(&mut self, window: &mut Window, early: Ns) -> Result<(), RunError> {
        if early <= window.from {
            let what = format!("an early return at {early} ns, outside ({}, {}] ns", window.from, window.until());
            return Err(RunError::BadAnswer { board: BoardId::HwSim.name(), what, when: at(window.from) });
        }
        window.timing.clone_from(&self.timing);
        self.look_ahead(window, early)?;
        self.plan_turns(window, &WIRES_AGAIN);
        let da_io = window.turns.iter_mut().filter(|turn| turn.board == BoardId::DaIo as u32);
        da_io.for_each(|turn| turn.flags |= flags::RERUN);
        Ok(())
    }

    /// Takes in what a board answered in its turn; new programs hold from the window's end on.
    fn take_in(
        &mut self,
        window: &Window,
        board: BoardId,
        answer: Answer,
        programs: &mut Vec<(u16, Vec<Op>)>,
    ) -> Result<(), RunError> {
        if let (Some(task), Some(rest)) = (window.decides(), answer.rest)
            && self.boards.of_task[usize::from(task)] == board
        {
            self.boards.note_rest(self.timing.rack(), task, &rest)?;
            self.rest[usize::from(task)] = rest;
        }
        for (task, program) in answer.programs {
            self.boards.note_program(self.timing.rack(), board, task, &program)?;
            programs.push((task, program));
        }
        Ok(())
    }
}
