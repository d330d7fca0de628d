//! Real time: the same windows as in lock step, but by the wall clock, peer to peer.
//!
//! The chassis runs the timing plane ahead and tells each board its windows before they are due; a board steps when its
//! window has passed on the wall clock, with what has arrived by then. Nobody waits for anybody: what comes late is used
//! when it comes, and counted. A window is told as soon as every decision that it depends on is known, and at the latest
//! [`LEAD`] stages before it is due, then with what its tasks did last. A process that ends or stalls is a [`RunError`]
//! within a bounded wall time.

mod lives;
mod paced;
mod plan;
mod rights;
mod stops;
mod writes;

pub(crate) use paced::Paced;
pub use rights::ask as ask_for_rights;

use crate::boards::{Boards, STALL, WATCH_PERIOD, recorded_transfers};
use crate::error::at;
use crate::host::{Answer, Factory};
use crate::{Context, Flow, Observer, RunError};
use board::{BoardId, Mail, Ns};
use channels::{sleep_until, wall_ns};
use messages::{BOARDS, Event, EventKind, Grant, Severity, TransferRecord, flags};
use lives::Booting;
use paced::{stage, stage_ns};
use plan::{Draft, Plan};
use stops::Stops;
use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use vme::{MILLISECOND, Op, Timing};

/// Stages before its end at which a window is told at the latest.
const LEAD: u64 = 4;
/// Windows are told at most this far ahead of the wall clock, and are at most this long.
const HORIZON: Ns = 10 * MILLISECOND;
/// Unanswered windows of a process after which no more are told until it catches up.
const CREDIT: u32 = 64;
/// No answer for this long in state T: stopped for good. Nobody may wait longer: channels to it would fill up.
const STOPPED: Duration = Duration::from_millis(100);
/// The observer gets what was measured this often: a look into a channel costs something, whether or not there is any.
const SHOW_PERIOD: u64 = 10 * MILLISECOND;
/// Wall time between the last preparation and simulated time 0.
const START_UP: u64 = 300 * MILLISECOND;

/// What a process has not answered yet.
struct Debt {
    grants: u32,
    /// When it last answered.
    since: Instant,
    /// Processor time that it had used soon after.
    used: Option<u64>,
}

/// A rack in real time.
pub struct Realtime<'f> {
    boards: Boards<'f>,
    plan: Plan,
    local: Paced,
    zero: u64,
    stage_ns: Ns,
    /// Windows told that have not been shown to the observer.
    told: VecDeque<(u64, Draft)>,
    /// Processes that have been started again and do not take part yet.
    booting: Vec<Booting>,
    debts: Vec<Debt>,
    stops: Stops,
    watched: Instant,
    /// Flag of grants that are not measured.
    unmeasured: u32,
    /// When the observer gets what was measured next, on the wall clock.
    show: u64,
    own_mail: Mail,
}

impl<'f> Realtime<'f> {
    /// Powers the rack up, as [`crate::Lockstep::power_up`] does.
    pub fn power_up(
        context: Context,
        factory: Factory<'f>,
        programs: &dyn Fn(&scenario::Process) -> Vec<String>,
        interrupted: &'static AtomicBool,
    ) -> Result<Realtime<'f>, RunError> {
        let scenario = context.scenario.clone();
        let (mut boards, timing) = Boards::power_up(context, factory, programs, interrupted)?;
        if let Some(processor) = boards.processor_kept.take() {
            // boards that run side by side want every processor
            boards.power.pids().for_each(|(_, pid)| processor.release(pid));
        }
        let own = scenario.processes.iter().find(|process| process.name == BoardId::Chassis.name());
        let refused = ask_for_rights(&scenario.realtime, own);
        if scenario.realtime.strict && !refused.is_empty() {
            return Err(RunError::Refused { what: refused.join("; ") });
        }
        for refused in refused {
            eprintln!("real time without {refused}; the run goes on");
        }
        // rights and locked memory take their time on a busy machine
        let prepare = Grant { flags: flags::START, ..boards.grant_of(BoardId::Chassis, 0, 0, 0) };
        for remote in 0..boards.remotes.len() {
            boards.remotes[remote].grant(&prepare, &[])?;
            boards.ring(remote);
        }
        for remote in 0..boards.remotes.len() {
            boards.await_reply(remote)?;
        }
        let stops = Stops::new().map_err(|error| RunError::Refused { what: format!("SIGCONT: {error}") })?;
        boards.host.run_free();
        let zero = wall_ns() + START_UP;
        let start = Grant { from: zero, flags: flags::START, ..boards.grant_of(BoardId::Chassis, 0, 0, 0) };
        for remote in 0..boards.remotes.len() {
            boards.remotes[remote].grant(&start, &[])?;
            boards.ring(remote);
        }
        let plan = Plan::new(timing);
        let debts = boards.remotes.iter().map(|_| Debt { grants: 0, since: Instant::now(), used: None }).collect();
        Ok(Realtime {
            plan,
            local: Paced::new(zero, &scenario),
            stage_ns: stage_ns(&scenario),
            boards,
            zero,
            told: VecDeque::new(),
            booting: Vec::new(),
            debts,
            stops,
            watched: Instant::now(),
            unmeasured: flags::UNMEASURED,
            show: 0,
            own_mail: Mail::default(),
        })
    }

    /// Folder of the run, where it has one.
    pub fn folder(&self) -> Option<&std::path::Path> {
        self.boards.folder.as_ref().map(|folder| folder.path.as_path())
    }

    /// When simulated time 0 is on the wall clock, CLOCK_MONOTONIC, ns.
    pub fn zero(&self) -> u64 {
        self.zero
    }

    /// Process numbers of the run.
    pub fn pids(&self) -> impl Iterator<Item = (&str, u32)> {
        self.boards.power.pids()
    }

    /// What was lost on the way although the run went on, in words.
    pub fn losses(&self) -> &[String] {
        &self.boards.life.losses
    }

    /// Simulated time reached.
    pub fn now(&self) -> Ns {
        self.boards.reached
    }

    /// Bus and processors as far as all decisions are known.
    pub fn timing(&self) -> &Timing {
        self.plan.timing()
    }

    /// The longest job of each task that its board has asked for so far.
    pub fn programs(&self) -> Vec<Vec<Op>> {
        self.boards.programs()
    }

    /// Runs to `end`, or until the observer stops the run.
    pub fn run(&mut self, end: Ns, observer: &mut dyn Observer) -> Result<(), RunError> {
        let mut draft: Option<Draft> = None;
        while self.boards.reached < end {
            if self.change_lives()? | self.take_answers()? {
                draft = None;
            }
            while self.local.due().is_some_and(|due| due <= wall_ns()) {
                self.step_here()?;
            }
            if self.close_windows(observer)? == Flow::Stop {
                break;
            }
            self.watch()?;
            let clock = wall_ns().saturating_sub(self.zero);
            let mut next = self.local.due().unwrap_or(u64::MAX);
            next = next.min(self.next_change().saturating_add(self.zero));
            next = next.min(self.told.front().map_or(u64::MAX, |(_, draft)| self.closing(draft.until)));
            if self.plan.told_to() < end && self.debts.iter().all(|debt| debt.grants < CREDIT) {
                let from = self.plan.told_to();
                if from > clock + HORIZON {
                    next = next.min(self.zero + from - HORIZON);
                } else {
                    let limit = end.min(from + HORIZON);
                    let window = match draft.take() {
                        Some(window) => window,
                        None => self.plan.draft(limit)?,
                    };
                    let latest = window.until.saturating_sub(LEAD * self.stage_ns);
                    if self.plan.is_settled() || latest <= clock {
                        self.tell(window, observer)?;
                        continue;
                    }
                    next = next.min(self.zero + latest);
                    draft = Some(window);
                }
            }
            self.rest_until(next);
        }
        Ok(())
    }

    /// Ends the run: the recorder closes its file, the processes leave; `observer` gets what was measured last.
    pub fn finish(mut self, observer: &mut dyn Observer) -> Result<(), RunError> {
        let now = self.boards.reached;
        for board in &BOARDS[1..] {
            let grant = Grant { window: self.boards.window, ..self.boards.grant_of(*board, now, now, flags::FINISH) };
            self.grant(&grant)?;
        }
        while self.local.due().is_some() || self.debts.iter().any(|debt| debt.grants > 0) {
            self.take_answers()?;
            self.step_here()?;
            self.boards.show_spans(observer)?;
            self.watch()?;
            self.rest_until(wall_ns() + MILLISECOND);
        }
        self.boards.host.count_sent();
        self.boards.show_spans(observer)?;
        self.boards.power.shut_down();
        Ok(())
    }

    /// When a window's results are there, on the wall clock.
    fn closing(&self, until: Ns) -> u64 {
        self.zero + until + stage(BoardId::Chassis) * self.stage_ns
    }

    fn rest_until(&mut self, due: u64) {
        let limit = Duration::from_nanos(due.saturating_sub(wall_ns())).min(WATCH_PERIOD);
        match &mut self.boards.bells {
            // an answer ends the rest early
            Some((_, bell)) if !self.boards.remotes.is_empty() => {
                bell.wait(limit);
            }
            _ => sleep_until(due, limit),
        }
    }

    /// Tells every board its part of a window; the recorder's comes when the window has passed.
    fn tell(&mut self, draft: Draft, observer: &mut dyn Observer) -> Result<(), RunError> {
        let measured = self.boards.spans.is_some() && observer.measures(draft.from);
        self.unmeasured = if measured { 0 } else { flags::UNMEASURED };
        self.boards.host.time(measured);
        self.plan.tell(self.boards.window, &draft);
        self.boards.sort_transfers(&draft.log);
        let Draft { from, until, decision, .. } = draft;
        for board in [BoardId::DaIo, BoardId::HwSim, BoardId::ForceSensorIf, BoardId::EncoderIf] {
            let grant = self.boards.grant_of(board, from, until, 0);
            self.grant(&grant)?;
        }
        for board in [BoardId::ControlComputer, BoardId::Workstation] {
            let mut grant = self.boards.grant_of(board, from, until, 0);
            if let Some((task, job)) = decision
                && self.boards.of_task[usize::from(task)] == board
            {
                grant.flags = flags::DECIDE;
                (grant.task, grant.job) = (task.into(), job);
            } else if self.boards.transfers[board as usize].is_empty() {
                continue;
            }
            self.grant(&grant)?;
        }
        self.told.push_back((self.boards.window, draft));
        self.boards.window += 1;
        Ok(())
    }

    fn grant(&mut self, grant: &Grant) -> Result<(), RunError> {
        let board = grant.board as usize;
        if self.boards.life.is_down(BOARDS[board]) {
            return Ok(());
        }
        let grant = Grant { flags: grant.flags | self.unmeasured, ..*grant };
        match self.boards.place[board] {
            None => self.local.push(grant, &self.boards.transfers[board]),
            Some(remote) => {
                self.boards.send_grant(remote, &grant)?;
                let debt = &mut self.debts[remote];
                if debt.grants == 0 {
                    (debt.since, debt.used) = (Instant::now(), None);
                }
                debt.grants += 1;
            }
        }
        Ok(())
    }

    /// True where a decision has become known.
    fn take_answers(&mut self) -> Result<bool, RunError> {
        let mut any = false;
        for remote in 0..self.boards.remotes.len() {
            while let Some((board, window, answer)) = self.boards.remotes[remote].reply(self.boards.reached)? {
                any |= self.boots(remote, window);
                let grants = self.debts[remote].grants.saturating_sub(1);
                self.debts[remote] = Debt { grants, since: Instant::now(), used: None };
                any |= self.answered(board, window, answer)?;
            }
        }
        Ok(any)
    }

    fn answered(&mut self, board: BoardId, window: u64, answer: Answer) -> Result<bool, RunError> {
        let task = self.plan.task_of(window).filter(|task| self.boards.of_task[usize::from(*task)] == board);
        if let Some(task) = task {
            if let Some(rest) = &answer.rest {
                self.boards.note_rest(self.plan.timing().rack(), task, rest)?;
            }
            self.plan.decided(window, task, answer.rest);
        }
        for (task, program) in answer.programs {
            self.boards.note_program(self.plan.timing().rack(), board, task, &program)?;
            self.plan.set_program(task, &program);
        }
        Ok(task.is_some())
    }

    fn step_here(&mut self) -> Result<(), RunError> {
        if let Some((grant, answer)) = self.local.step(&mut self.boards.host)? {
            self.answered(BOARDS[grant.board as usize], grant.window, answer)?;
        }
        Ok(())
    }

    /// Shows the observer the windows whose results are there, and lets the recorder have them.
    fn close_windows(&mut self, observer: &mut dyn Observer) -> Result<Flow, RunError> {
        while let Some((_, next)) = self.told.front()
            && self.closing(next.until) <= wall_ns()
        {
            let Some((window, Draft { from, until, log, trips, .. })) = self.told.pop_front() else { break };
            self.own_mail.clear();
            self.own_mail.events.append(&mut self.boards.life.mail.events);
            self.boards.injections.tell(until, &mut self.own_mail.events);
            self.own_mail.transfers.extend(recorded_transfers(&log).map(TransferRecord::from));
            self.boards.life.lines.transfers(&self.own_mail.transfers);
            self.own_mail.events.extend(trips.iter().map(|(at, task, job)| {
                let (job, task) = ((*job).into(), (*task).into());
                Event::new(*at, EventKind::OverrunTrip, Severity::Error, job, task)
            }));
            observer.account(until, &log, &mut self.own_mail);
            self.boards.host.send(&self.own_mail)?;
            self.boards.transfers[BoardId::BusAnalyzer as usize].clear();
            let grant = Grant { window, ..self.boards.grant_of(BoardId::BusAnalyzer, from, until, 0) };
            self.grant(&grant)?;
            let mail = self.boards.host.fetch(BoardId::Chassis, until, self.boards.reached)?;
            self.boards.reached = until;
            if let Some(probe) = mail.plant_probe.last() {
                self.boards.life.lines.probe(probe);
            }
            let flow = observer.window(until, mail, &log);
            mail.clear();
            let now = wall_ns();
            if self.unmeasured == 0 && self.show <= now {
                self.show = now + SHOW_PERIOD;
                self.boards.show_spans(observer)?;
            }
            if flow == Flow::Stop {
                return Ok(Flow::Stop);
            }
        }
        Ok(Flow::Continue)
    }

    fn watch(&mut self) -> Result<(), RunError> {
        if let Some(away) = self.stops.was_stopped().filter(|away| *away > STOPPED) {
            let (process, how) = (BoardId::Chassis.name().into(), "stopped by a signal".into());
            let (waited_s, when) = (away.as_secs_f64(), at(self.boards.reached));
            return Err(RunError::Stalled { process, how, waited_s, when });
        }
        if self.watched.elapsed() < WATCH_PERIOD {
            return Ok(());
        }
        self.watched = Instant::now();
        self.boards.watch()?;
        let mut stalled = None;
        let Boards { power, remotes, .. } = &self.boards;
        for (debt, remote) in self.debts.iter_mut().zip(remotes).filter(|(debt, _)| debt.grants > 0) {
            let used = *debt.used.get_or_insert_with(|| power.used(&remote.process));
            if debt.since.elapsed() > STOPPED && power.is_stopped(&remote.process) {
                stalled = Some((remote.process.clone(), "stopped by a signal", debt.since.elapsed().as_secs_f64()));
            }
            if debt.since.elapsed() > STALL {
                if let Some(how) = power.idle(&remote.process, used) {
                    stalled = Some((remote.process.clone(), how, debt.since.elapsed().as_secs_f64()));
                }
                // starved, not stalled
                (debt.since, debt.used) = (Instant::now(), None);
            }
        }
        if let Some((process, how, waited_s)) = stalled
            && !self.boards.outlives(&process, &format!("was stalled ({how})"))
        {
            return Err(RunError::Stalled { process, how: how.into(), waited_s, when: at(self.boards.reached) });
        }
        Ok(())
    }
}
