//! Lock step: simulated time in windows, each from one decision point to the next.
//!
//! A window: the timing plane runs ahead to the next decision point D; da_io changes its outputs at the exact times of the
//! writes made to it; the arm integrates to D with them (and may stop early: then the timing plane goes back and runs to
//! that instant); force sensor and encoders answer the reads made to them at *their* times; the board that decides at D is
//! stepped with the values read. The recorder gets the same grants one way, with credit.

use crate::affinity::OneProcessor;
use crate::error::at;
use crate::host::{Answer, Factory, Host};
use crate::remote::{READY, Remote};
use crate::serve::{CHASSIS_BELL, process_of};
use crate::{Context, Power, RunError, RunFolder};
use board::{BoardId, Mail, Ns, Op};
use channels::{Bell, Bells, Domain, Exchange};
use messages::{BOARDS, Event, EventKind, Grant, Severity, TransferRecord, flags};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use vme::{Log, Origin, Stop, Timing};

/// Longest window: bounds what a board has to keep.
const MAX_WINDOW: Ns = 10 * vme::MILLISECOND;
/// Windows that the recorder may lag; then time waits.
const RECORDER_CREDIT: u32 = 64;
/// How often a wait looks whether everybody still lives.
const WATCH_PERIOD: Duration = Duration::from_millis(50);
/// No answer for this long and no sign of life: stalled.
pub(crate) const STALL: Duration = Duration::from_secs(5);
/// Processor time that no single answer takes.
const SPIN_S: u64 = 5;
/// Processes get this long to report ready.
const READY_LIMIT: Duration = Duration::from_secs(30);

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
    /// Probes and events of the window's boards, and what happened on the bus and the processors in it.
    fn window(&mut self, until: Ns, mail: &Mail, log: &Log) -> Flow;
}

/// A rack in lock step.
pub struct Lockstep {
    pub(crate) timing: Timing,
    ahead: Timing,
    pub(crate) host: Host,
    pub(crate) remotes: Vec<Remote>,
    /// Index in `remotes` of each board's process; `None` = here.
    pub(crate) place: [Option<usize>; BOARDS.len()],
    pub(crate) power: Power,
    pub(crate) bells: Option<(Bells, Bell)>,
    /// Rest of the jobs of each task, as its board last said.
    rest: Vec<Vec<Op>>,
    /// Program and longest rest of each task that its board has asked for so far.
    longest: Vec<[Vec<Op>; 2]>,
    pub(crate) board_of_task: Vec<BoardId>,
    pub(crate) board_of_slave: Vec<BoardId>,
    log: Log,
    pub(crate) to_board: [Vec<TransferRecord>; BOARDS.len()],
    own_mail: Mail,
    pub(crate) window: u64,
    recorder_owes: u32,
    interrupted: &'static AtomicBool,
    pub(crate) processor_kept: Option<OneProcessor>,
    // last: it removes the folder once nobody uses it
    _folder: Option<RunFolder>,
}

impl Lockstep {
    /// Powers the rack up: starts the processes of the scenario (none if all its boards are in the chassis) and waits until
    /// each is ready. `programs` finds the built-in program of a process.
    pub fn power_up(
        mut context: Context,
        factory: Factory<'_>,
        programs: &dyn Fn(&scenario::Process) -> Vec<String>,
        interrupted: &'static AtomicBool,
    ) -> Result<Lockstep, RunError> {
        let scenario = context.scenario.clone();
        let timing = Timing::new(scenario.rack.clone())?;
        let place = BOARDS.map(|board| process_of(&scenario, board));
        let away: Vec<usize> = (0..scenario.processes.len()).filter(|i| place.contains(&(i + 1))).collect();
        let here: Vec<BoardId> = BOARDS.into_iter().filter(|board| place[*board as usize] == 0).collect();
        let mut power = Power::default();
        let mut remotes = Vec::new();
        let (mut folder, mut domain, mut bells) = (None, None, None);
        if !away.is_empty() {
            let run_folder = RunFolder::create()?;
            context.prefix = run_folder.prefix.clone();
            run_folder.write_context(&context)?;
            let joined = Domain::join(&run_folder.path, &run_folder.prefix, "chassis")?;
            let page = Bells::open(&run_folder.path.join("bells"), scenario.processes.len() + 1)?;
            for i in &away {
                remotes.push(Remote::open(&joined, &scenario.processes[*i].name, i + 1)?);
            }
            bells = Some((page.clone(), page.bell(CHASSIS_BELL)));
            domain = Some(joined);
            folder = Some(run_folder);
        }
        let exchange = Exchange::open(&here, domain.as_ref(), |board| place[board as usize])?;
        let host = Host::new(&here, exchange, &context, factory)?;
        let processor = folder.as_ref().and_then(|_| OneProcessor::stay());
        if let Some(folder) = &folder {
            for i in &away {
                let process = &scenario.processes[*i];
                let pid = power.spawn(&process.name, &programs(process), &folder.path)?;
                let records = process.boards.iter().any(|board| board == BoardId::BusAnalyzer.name());
                if let Some(processor) = processor.as_ref().filter(|_| records) {
                    processor.release(pid);
                }
            }
        }
        let board_named = |name: &str| BoardId::from_name(name).unwrap_or(BoardId::Chassis);
        let mut rack = Lockstep {
            ahead: timing.clone(),
            timing,
            host,
            remotes,
            place: place.map(|process| away.iter().position(|i| i + 1 == process)),
            power,
            bells,
            rest: vec![Vec::new(); scenario.rack.tasks.len()],
            longest: vec![[const { Vec::new() }; 2]; scenario.rack.tasks.len()],
            board_of_task: scenario.rack.tasks.iter().map(|task| board_named(&task.board)).collect(),
            board_of_slave: scenario.rack.slaves.iter().map(|slave| board_named(&slave.board)).collect(),
            log: Log::default(),
            to_board: Default::default(),
            own_mail: Mail::default(),
            window: 0,
            recorder_owes: 0,
            interrupted,
            processor_kept: processor,
            _folder: folder,
        };
        rack.wait_until_ready()?;
        rack.boot()?;
        Ok(rack)
    }

    /// Process numbers of the run.
    pub fn pids(&self) -> impl Iterator<Item = (&str, u32)> {
        self.power.pids()
    }

    /// Folder of the run, where it has one.
    pub fn folder(&self) -> Option<&Path> {
        self._folder.as_ref().map(|folder| folder.path.as_path())
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
        self.longest.iter().map(|job| job.concat()).collect()
    }

    fn wait_until_ready(&mut self) -> Result<(), RunError> {
        let start = Instant::now();
        for i in 0..self.remotes.len() {
            loop {
                match self.remotes[i].reply(0)? {
                    Some((_, READY, _)) => break,
                    Some(_) => {
                        return Err(RunError::BadAnswer {
                            board: "unknown",
                            what: format!("process `{}` answered before it was asked", self.remotes[i].process),
                            when: at(0),
                        });
                    }
                    None => {}
                }
                self.listen()?;
                if start.elapsed() > READY_LIMIT {
                    return Err(RunError::Stalled {
                        process: self.remotes[i].process.clone(),
                        how: "it did not report ready".into(),
                        waited_s: start.elapsed().as_secs_f64(),
                        when: at(0),
                    });
                }
            }
        }
        Ok(())
    }

    /// Waits a little for the chassis' bell; an error where a process has ended or the user wants to stop.
    fn listen(&mut self) -> Result<(), RunError> {
        let Some((_, bell)) = &mut self.bells else { return Ok(()) };
        if !bell.wait(WATCH_PERIOD) {
            self.watch()?;
        }
        Ok(())
    }

    pub(crate) fn watch(&mut self) -> Result<(), RunError> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(RunError::Interrupted { when: at(self.timing.now()) });
        }
        match self.power.ended() {
            Some((process, how)) => Err(RunError::Died { process, how, when: at(self.timing.now()) }),
            None => Ok(()),
        }
    }

    fn boot(&mut self) -> Result<(), RunError> {
        for board in &BOARDS[1..] {
            let grant = self.grant_of(*board, 0, 0, flags::BOOT);
            let answer = self.ask(&grant)?;
            if let Some((task, program)) = answer.program {
                self.set_program(*board, task, &program)?;
            }
        }
        Ok(())
    }

    pub(crate) fn set_program(&mut self, board: BoardId, task: u16, program: &[Op]) -> Result<(), RunError> {
        if self.board_of_task.get(usize::from(task)) != Some(&board) {
            return Err(RunError::BadAnswer {
                board: board.name(),
                what: format!("a program for task {task}, which is not its own"),
                when: at(self.timing.now()),
            });
        }
        self.timing.set_program(task, program);
        self.longest[usize::from(task)][0] = program.to_vec();
        Ok(())
    }

    /// Remembers the longest rest that a task's board has asked for.
    pub(crate) fn note_rest(&mut self, task: u16, rest: &[Op]) {
        let longest = &mut self.longest[usize::from(task)][1];
        if demand(rest) > demand(longest) {
            longest.clear();
            longest.extend_from_slice(rest);
        }
    }

    /// Runs to `end`, or until the observer stops the run.
    pub fn run(&mut self, end: Ns, observer: &mut dyn Observer) -> Result<(), RunError> {
        while self.timing.now() < end {
            if self.window.is_multiple_of(1024) {
                self.watch()?;
            }
            let flow = self.step(end)?;
            let until = self.timing.now();
            let mail = self.host.read()?;
            let flow = match observer.window(until, mail, &self.log) {
                Flow::Stop => Flow::Stop,
                Flow::Continue => flow,
            };
            mail.clear();
            if flow == Flow::Stop {
                break;
            }
        }
        Ok(())
    }

    /// Ends the run: the recorder closes its file, the processes leave. Returns what the boards still had to say.
    pub fn finish(mut self) -> Result<(), RunError> {
        let now = self.timing.now();
        for board in &BOARDS[1..] {
            let grant = self.grant_of(*board, now, now, flags::FINISH);
            self.ask(&grant)?;
        }
        self.power.shut_down();
        Ok(())
    }

    /// One window.
    fn step(&mut self, end: Ns) -> Result<Flow, RunError> {
        let from = self.timing.now();
        let limit = end.min(from + MAX_WINDOW);
        let mut stop = self.look_ahead(limit);
        let mut until = self.ahead.now();

        let answer = self.visit(BoardId::DaIo, from, until, 0)?;
        self.expect_no_early(BoardId::DaIo, &answer)?;
        let answer = self.visit(BoardId::HwSim, from, until, 0)?;
        if let Some(early) = answer.early.filter(|early| *early < until) {
            if early <= from {
                return Err(RunError::BadAnswer {
                    board: BoardId::HwSim.name(),
                    what: format!("an early return at {early} ns, outside ({from}, {until}] ns"),
                    when: at(from),
                });
            }
            stop = self.look_ahead(early);
            until = early;
            self.visit(BoardId::DaIo, from, until, flags::RERUN)?;
        }
        self.grant(BoardId::ForceSensorIf, from, until, 0)?;
        self.grant(BoardId::EncoderIf, from, until, 0)?;
        self.collect(BoardId::ForceSensorIf)?;
        self.collect(BoardId::EncoderIf)?;

        let decision = match stop {
            Stop::Decision { task, job } => Some((task, job)),
            _ => None,
        };
        for board in [BoardId::ControlComputer, BoardId::Workstation] {
            let decides = decision.filter(|(task, _)| self.board_of_task[usize::from(*task)] == board);
            if decides.is_none() && self.to_board[board as usize].is_empty() {
                continue;
            }
            let mut grant = self.grant_of(board, from, until, 0);
            if let Some((task, job)) = decides {
                grant.flags = flags::DECIDE;
                (grant.task, grant.job) = (task.into(), job);
            }
            let answer = self.ask(&grant)?;
            self.expect_no_early(board, &answer)?;
            if let Some((task, _)) = decides {
                if let Some(rest) = answer.rest {
                    self.note_rest(task, &rest);
                    self.rest[usize::from(task)] = rest;
                }
                self.ahead.resume(task, &self.rest[usize::from(task)]);
            }
            if let Some((task, program)) = answer.program {
                self.set_program(board, task, &program)?;
                self.ahead.set_program(task, &program);
            }
        }
        self.own_mail.clear();
        if let Stop::Overrun { task, job } = stop {
            self.ahead.halt(task);
            let event = Event::new(until, EventKind::OverrunTrip, Severity::Error, job.into(), task.into());
            self.own_mail.events.push(event);
        }
        self.record(from, until)?;
        std::mem::swap(&mut self.timing, &mut self.ahead);
        self.window += 1;
        Ok(Flow::Continue)
    }

    /// Runs a copy of the timing plane to the next decision point or `limit`, and sorts the transfers by the board they are made to.
    fn look_ahead(&mut self, limit: Ns) -> Stop {
        self.ahead.clone_from(&self.timing);
        self.log.clear();
        let stop = self.ahead.advance(limit, &mut self.log);
        self.to_board.iter_mut().for_each(Vec::clear);
        for transfer in self.log.transfers.iter().filter(|transfer| transfer.origin == Origin::Program) {
            if let Some(slave) = transfer.slave {
                self.to_board[self.board_of_slave[usize::from(slave)] as usize].push(transfer.into());
            }
        }
        stop
    }

    pub(crate) fn grant_of(&self, board: BoardId, from: Ns, until: Ns, flags: u32) -> Grant {
        Grant { window: self.window, from, until, board: board as u32, flags, task: 0, job: 0 }
    }

    /// The recorder gets the window's transfers and a grant, and is not waited for.
    fn record(&mut self, from: Ns, until: Ns) -> Result<(), RunError> {
        let programs = self.log.transfers.iter().filter(|transfer| transfer.origin == Origin::Program);
        self.own_mail.transfers.extend(programs.map(TransferRecord::from));
        self.host.send(&self.own_mail)?;
        let recorder = BoardId::BusAnalyzer;
        let Some(remote) = self.place[recorder as usize] else {
            let grant = self.grant_of(recorder, from, until, 0);
            self.host.step(&grant, &[])?;
            return Ok(());
        };
        self.grant(recorder, from, until, 0)?;
        self.recorder_owes += 1;
        while self.remotes[remote].reply(until)?.is_some() {
            self.recorder_owes -= 1;
        }
        while self.recorder_owes >= RECORDER_CREDIT {
            self.await_reply(remote, until)?;
            self.recorder_owes -= 1;
        }
        Ok(())
    }

    fn visit(&mut self, board: BoardId, from: Ns, until: Ns, flags: u32) -> Result<Answer, RunError> {
        let grant = self.grant_of(board, from, until, flags);
        self.ask(&grant)
    }

    fn expect_no_early(&self, board: BoardId, answer: &Answer) -> Result<(), RunError> {
        match answer.early {
            None => Ok(()),
            Some(early) => Err(RunError::BadAnswer {
                board: board.name(),
                what: format!("an early return at {early} ns; only hw_sim may cut a window"),
                when: at(self.timing.now()),
            }),
        }
    }

    /// Grants and waits for the answer.
    fn ask(&mut self, grant: &Grant) -> Result<Answer, RunError> {
        let board = BOARDS[grant.board as usize];
        match self.place[board as usize] {
            None => {
                let transfers = &self.to_board[board as usize];
                self.host.step(grant, transfers)
            }
            Some(remote) => {
                self.send_grant(remote, grant)?;
                self.collect_from(remote, board)
            }
        }
    }

    /// Grants without waiting; boards in the chassis act at once.
    fn grant(&mut self, board: BoardId, from: Ns, until: Ns, flags: u32) -> Result<(), RunError> {
        let grant = self.grant_of(board, from, until, flags);
        match self.place[board as usize] {
            None => self.host.step(&grant, &self.to_board[board as usize]).map(|_| ()),
            Some(remote) => self.send_grant(remote, &grant),
        }
    }

    fn collect(&mut self, board: BoardId) -> Result<(), RunError> {
        match self.place[board as usize] {
            None => Ok(()),
            Some(remote) => {
                let answer = self.collect_from(remote, board)?;
                self.expect_no_early(board, &answer)
            }
        }
    }

    pub(crate) fn send_grant(&mut self, remote: usize, grant: &Grant) -> Result<(), RunError> {
        let sent = self.remotes[remote].grant(grant, &self.to_board[grant.board as usize]);
        if sent.is_err() {
            // a process that has just died is the better explanation
            self.watch()?;
        }
        sent?;
        if let Some((bells, _)) = &self.bells {
            bells.ring(self.remotes[remote].bell);
        }
        Ok(())
    }

    fn collect_from(&mut self, remote: usize, board: BoardId) -> Result<Answer, RunError> {
        loop {
            let (who, window, answer) = self.await_reply(remote, self.timing.now())?;
            if who == BoardId::BusAnalyzer && self.recorder_owes > 0 {
                self.recorder_owes -= 1;
                continue;
            }
            if who == board && window == self.window {
                return Ok(answer);
            }
            return Err(RunError::BadAnswer {
                board: who.name(),
                what: format!("window {window} where `{}` was asked for window {}", board.name(), self.window),
                when: at(self.timing.now()),
            });
        }
    }

    fn await_reply(&mut self, remote: usize, now: Ns) -> Result<(BoardId, u64, Answer), RunError> {
        // wall time and processor time of the board, at first and since it was last seen at work
        let (mut first, mut waiting): (Option<(Instant, u64)>, Option<(Instant, u64)>) = (None, None);
        loop {
            if let Some(reply) = self.remotes[remote].reply(now)? {
                return Ok(reply);
            }
            let Some((_, bell)) = &mut self.bells else { continue };
            if bell.wait(WATCH_PERIOD) {
                continue;
            }
            self.watch()?;
            let name = &self.remotes[remote].process;
            let used = self.power.used(name);
            let (asked, used_at_first) = *first.get_or_insert((Instant::now(), used));
            let (since, used_before) = *waiting.get_or_insert((Instant::now(), used));
            let how = if used.saturating_sub(used_at_first) > SPIN_S * rustix::param::clock_ticks_per_second() {
                Some(format!("it has used {SPIN_S} s of processor time"))
            } else if since.elapsed() > STALL {
                self.power.idle(name, used_before).map(str::to_owned)
            } else {
                continue;
            };
            let Some(how) = how else {
                // starved, not stalled
                waiting = None;
                continue;
            };
            return Err(RunError::Stalled {
                process: name.clone(),
                how,
                waited_s: asked.elapsed().as_secs_f64(),
                when: at(now),
            });
        }
    }
}

/// Processor time, then accesses: which of two programs asks for more.
fn demand(program: &[Op]) -> (Ns, usize) {
    let execution = program.iter().map(|op| if let Op::Exec(ns) = op { *ns } else { 0 });
    (execution.sum(), program.iter().filter(|op| matches!(op, Op::Access(_))).count())
}
