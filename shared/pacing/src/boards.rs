//! The boards of a run, wherever they live, in the chassis or in a process of their own: power-up, grants and answers.
//!
//! Whoever is asked answers, or the run ends with a [`RunError`] that names the process, within a bounded wall time.

use crate::affinity::OneProcessor;
use crate::error::at;
use crate::faults::{Injections, tampering};
use crate::host::{Answer, Factory, Host};
use crate::life::Life;
use crate::remote::{MAX_OPS, READY, Remote};
use crate::serve::{CHASSIS_BELL, process_of};
use crate::turns::Turns;
use crate::{Context, Observer, Power, RunError, RunFolder};
use board::{BoardId, Ns, Op};
use channels::{Bell, Bells, Domain, Exchange};
use messages::{BOARDS, Grant, NOBODY, Span, TransferRecord, flags};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use vme::rack::Rack;
use vme::{Log, Origin, Status, Timing, Transfer};

/// How often a wait looks whether everybody still lives.
pub(crate) const WATCH_PERIOD: Duration = Duration::from_millis(50);
/// No answer for this long and no sign of life: stalled.
pub(crate) const STALL: Duration = Duration::from_secs(5);
/// Windows that the recorder may lag; then time waits.
const RECORDER_CREDIT: u32 = 64;
/// Windows for which the recorder is woken at once: a wake-up on another processor costs more than a window's record.
const RECORDER_BATCH: u32 = 16;
/// Processor time that no single answer takes.
const SPIN_S: u64 = 5;
/// Processes get this long to report ready.
const READY_LIMIT: Duration = Duration::from_secs(30);

/// All boards but the chassis' own.
pub(crate) struct Boards<'f> {
    pub host: Host,
    pub remotes: Vec<Remote>,
    /// Index in `remotes` of each board's process; `None` = here.
    pub place: [Option<usize>; BOARDS.len()],
    pub power: Power,
    pub bells: Option<(Bells, Bell)>,
    /// What is down, and when it changes.
    pub life: Life,
    /// What the processes were told; a recorder that is started again is told another file.
    pub context: Context,
    /// The file of the first recorder.
    pub first_record: Option<PathBuf>,
    /// Files of the record so far.
    pub parts: u32,
    pub factory: Factory<'f>,
    /// Program and arguments of each of `remotes`.
    pub commands: Vec<Vec<String>>,
    pub domain: Option<Domain>,
    /// Boards of the rack's tasks and slaves.
    pub of_task: Vec<BoardId>,
    of_slave: Vec<BoardId>,
    /// Transfers made to each board in the window.
    pub transfers: [Vec<TransferRecord>; BOARDS.len()],
    /// The faults that the chassis tells of.
    pub injections: Injections,
    /// Planned faults of bus and processors; behind them in the timing plane is what other faults do to it.
    pub timing_faults: usize,
    /// Number of the window to be granted next.
    pub window: u64,
    /// Simulated time reached.
    pub reached: Ns,
    /// What has been measured and not been shown to the observer, where anything is.
    pub spans: Option<Vec<Span>>,
    /// Grants that the recorder has not answered yet, and those of them that it has not been woken for.
    pub recorder_owes: u32,
    recorder_sleeps: u32,
    /// Windows for which it is woken at once.
    recorder_batch: u32,
    /// Who acts when.
    pub turns: Turns,
    /// Program and longest rest of each task that its board has asked for so far.
    longest: Vec<[Vec<Op>; 2]>,
    interrupted: &'static AtomicBool,
    /// Lock step's processor.
    pub processor_kept: Option<OneProcessor>,
    // last: it removes the folder once nobody uses it
    pub folder: Option<RunFolder>,
}

impl<'f> Boards<'f> {
    /// Starts the processes of the scenario (none if all its boards are in the chassis), waits until each is ready, and
    /// lets every board show its initial state. `programs` finds the built-in program of a process.
    pub fn power_up(
        mut context: Context,
        factory: Factory<'f>,
        programs: &dyn Fn(&scenario::Process) -> Vec<String>,
        interrupted: &'static AtomicBool,
    ) -> Result<(Boards<'f>, Timing), RunError> {
        let scenario = context.scenario.clone();
        let (fault_plan, timing_faults) = scenario.fault_plan();
        let mut timing = Timing::with_faults(scenario.rack.clone(), fault_plan)?;
        let place = BOARDS.map(|board| if context.in_process { 0 } else { process_of(&scenario, board) });
        let away: Vec<usize> = (0..scenario.processes.len()).filter(|i| place.contains(&(i + 1))).collect();
        let here: Vec<BoardId> = BOARDS.into_iter().filter(|board| place[*board as usize] == 0).collect();
        // removed last, where the start fails
        let mut folder = None;
        let mut power = Power::default();
        let (mut remotes, mut commands) = (Vec::new(), Vec::new());
        let (mut domain, mut bells) = (None, None);
        if !away.is_empty() {
            let run_folder = RunFolder::create()?;
            context.prefix = run_folder.prefix.clone();
            run_folder.write_context(&context)?;
            let joined = Domain::join(&run_folder.path, &run_folder.prefix, "chassis")?;
            let page = Bells::open(&run_folder.path.join("bells"), scenario.processes.len() + 1)?;
            for i in &away {
                remotes.push(Remote::open(&joined, &scenario.processes[*i].name, i + 1, context.measure)?);
            }
            bells = Some((page.clone(), page.bell(CHASSIS_BELL)));
            domain = Some(joined);
            folder = Some(run_folder);
        }
        let exchange =
            Exchange::open(&here, domain.as_ref(), |board| place[board as usize], &tampering(&scenario))?;
        let mut host = Host::new(&here, exchange, &context, factory)?;
        if context.measure {
            host.measure();
        }
        let processor = folder.as_ref().and_then(|_| OneProcessor::stay());
        if let Some(folder) = &folder {
            for i in &away {
                let process = &scenario.processes[*i];
                let command = programs(process);
                let pid = power.spawn(&process.name, &command, &folder.path)?;
                commands.push(command);
                let records = process.boards.iter().any(|board| board == BoardId::BusAnalyzer.name());
                if let Some(processor) = &processor {
                    processor.keep(pid, records);
                }
            }
        }
        let board_named = |name: &str| BoardId::from_name(name).unwrap_or(BoardId::Chassis);
        let recorder = place[BoardId::BusAnalyzer as usize];
        let alone = place.iter().filter(|process| **process == recorder).count() == 1;
        let spans = context.measure.then(Vec::new);
        let place = place.map(|process| away.iter().position(|i| i + 1 == process));
        let turns = Turns::new(&place, &context);
        let mut boards = Boards {
            host,
            remotes,
            place,
            power,
            bells,
            life: Life::new(&scenario),
            first_record: context.record.clone(),
            parts: 1,
            context,
            factory,
            commands,
            domain,
            of_task: scenario.rack.tasks.iter().map(|task| board_named(&task.board)).collect(),
            of_slave: scenario.rack.slaves.iter().map(|slave| board_named(&slave.board)).collect(),
            transfers: Default::default(),
            injections: Injections::new(&scenario),
            timing_faults,
            window: 0,
            reached: 0,
            spans,
            recorder_owes: 0,
            recorder_sleeps: 0,
            // in a process with others, its grants must not stand in theirs' way
            recorder_batch: if alone { RECORDER_BATCH } else { 1 },
            turns,
            longest: vec![[const { Vec::new() }; 2]; scenario.rack.tasks.len()],
            interrupted,
            processor_kept: processor,
            folder,
        };
        for remote in 0..boards.remotes.len() {
            boards.wait_until_ready(remote)?;
        }
        for board in &BOARDS[1..] {
            let answer = boards.ask(&boards.grant_of(*board, 0, 0, flags::BOOT))?;
            for (task, program) in answer.programs {
                boards.note_program(timing.rack(), *board, task, &program)?;
                timing.set_program(task, &program);
            }
        }
        Ok((boards, timing))
    }

    /// Shows the observer what has been measured.
    pub fn show_spans(&mut self, observer: &mut dyn Observer) -> Result<(), RunError> {
        let Some(spans) = &mut self.spans else { return Ok(()) };
        spans.extend(self.host.spans().into_iter().flat_map(|spans| spans.drain(..)));
        let mut lost = 0;
        for remote in &mut self.remotes {
            lost += remote.spans(spans)?;
        }
        if !spans.is_empty() || lost > 0 {
            observer.measured(spans, lost);
            spans.clear();
        }
        Ok(())
    }

    /// The longest job of each task that its board has asked for so far.
    pub fn programs(&self) -> Vec<Vec<Op>> {
        self.longest.iter().map(|job| job.concat()).collect()
    }

    /// Waits until a process that has been started says that it is ready.
    pub fn wait_until_ready(&mut self, remote: usize) -> Result<(), RunError> {
        let (when, mut waited) = (at(self.reached), Duration::ZERO);
        loop {
            match self.remotes[remote].reply(self.reached)? {
                Some((_, READY, _)) => return Ok(()),
                Some(_) => {
                    return Err(RunError::BadAnswer {
                        board: "unknown",
                        what: format!("process `{}` answered before it was asked", self.remotes[remote].process),
                        when,
                    });
                }
                None => {}
            }
            if !self.listen()? {
                waited += WATCH_PERIOD;
            }
            let process = &self.remotes[remote].process;
            if let Some(how) = self.life.died(process) {
                return Err(RunError::Died { process: process.clone(), how: how.to_owned(), when });
            }
            // whoever opens a channel with it waits for it too
            if waited > STALL
                && let Some(process) = self.power.stopped()
            {
                let (process, waited_s) = (process.to_owned(), waited.as_secs_f64());
                return Err(RunError::Stalled { process, how: "stopped by a signal".into(), waited_s, when });
            }
            if waited > READY_LIMIT {
                return Err(RunError::Stalled {
                    process: self.remotes[remote].process.clone(),
                    how: "it did not report ready".into(),
                    waited_s: waited.as_secs_f64(),
                    when,
                });
            }
        }
    }

    /// Waits for the chassis' bell; false where it has not rung for [`WATCH_PERIOD`].
    fn listen(&mut self) -> Result<bool, RunError> {
        let Some((_, bell)) = &mut self.bells else { return Ok(true) };
        if bell.wait(WATCH_PERIOD) > 0 {
            return Ok(true);
        }
        self.watch()?;
        Ok(false)
    }

    /// An error where a process has ended or the user wants to stop.
    pub fn watch(&mut self) -> Result<(), RunError> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(RunError::Interrupted { when: at(self.reached) });
        }
        match self.power.ended() {
            Some((process, how)) if !self.outlives(&process, &how) => {
                Err(RunError::Died { process, how, when: at(self.reached) })
            }
            _ => Ok(()),
        }
    }

    /// Remembers the program of a task; an error where the task is not that board's, or the rack cannot carry it out.
    pub fn note_program(&mut self, rack: &Rack, board: BoardId, task: u16, program: &[Op]) -> Result<(), RunError> {
        if self.of_task.get(usize::from(task)) != Some(&board) {
            return Err(RunError::BadAnswer {
                board: board.name(),
                what: format!("a program for task {task}, which is not its own"),
                when: at(self.reached),
            });
        }
        self.longest[usize::from(task)][0] = program.to_vec();
        self.check_job(rack, task, &[])
    }

    /// Remembers the longest rest that a task's board has asked for; an error where the rack cannot carry it out.
    pub fn note_rest(&mut self, rack: &Rack, task: u16, rest: &[Op]) -> Result<(), RunError> {
        if self.longest[usize::from(task)][1] == rest {
            return Ok(());
        }
        self.check_job(rack, task, rest)?;
        let longest = &mut self.longest[usize::from(task)][1];
        if demand(rest) > demand(longest) {
            longest.clear();
            longest.extend_from_slice(rest);
        }
        Ok(())
    }

    /// Whether the rack can carry out a job of the task's program and this rest.
    fn check_job(&self, rack: &Rack, task: u16, rest: &[Op]) -> Result<(), RunError> {
        let [program, _] = &self.longest[usize::from(task)];
        if rest.len() > MAX_OPS || program.len() > MAX_OPS || rest.contains(&Op::Decide) {
            return Err(RunError::BadAnswer {
                board: self.of_task[usize::from(task)].name(),
                what: format!("a program of more than {MAX_OPS} operations, or one that decides twice"),
                when: at(self.reached),
            });
        }
        Ok(rack.check_program(usize::from(task), &[program.as_slice(), rest].concat())?)
    }

    /// Sorts the transfers of a window by the board that they are made to; those that failed go to the one that asked, too.
    pub fn sort_transfers(&mut self, log: &Log) {
        self.transfers.iter_mut().for_each(Vec::clear);
        for transfer in program_transfers(log) {
            let to = transfer.slave.map(|slave| self.of_slave[usize::from(slave)]);
            let asked = self.of_task[usize::from(transfer.task)];
            if let Some(to) = to {
                self.transfers[to as usize].push(transfer.into());
            }
            if transfer.status != Status::Ok && to != Some(asked) {
                self.transfers[asked as usize].push(transfer.into());
            }
        }
    }

    /// A grant of the current window.
    pub fn grant_of(&self, board: BoardId, from: Ns, until: Ns, flags: u32) -> Grant {
        let (board, next) = (board as u32, CHASSIS_BELL as u32);
        Grant { window: self.window, from, until, board, flags, task: 0, job: 0, next, turn: 0 }
    }

    /// Grants and waits for the answer.
    pub fn ask(&mut self, grant: &Grant) -> Result<Answer, RunError> {
        let board = BOARDS[grant.board as usize];
        match self.place[board as usize] {
            None => {
                let transfers = &self.transfers[board as usize];
                self.host.step(grant, transfers)
            }
            Some(remote) => {
                self.send_grant(remote, grant)?;
                Ok(self.collect(remote, grant)?.unwrap_or_default())
            }
        }
    }

    /// Grants the recorder the window and does not wait for it; it is woken for some windows at a time, and may lag by
    /// [`RECORDER_CREDIT`].
    pub fn grant_recorder(&mut self, grant: &Grant) -> Result<(), RunError> {
        if self.life.is_down(BoardId::BusAnalyzer) {
            return Ok(());
        }
        let board = BoardId::BusAnalyzer as usize;
        let Some(remote) = self.place[board] else {
            self.host.step(grant, &[])?;
            return Ok(());
        };
        self.recorder_owes += 1;
        self.recorder_sleeps += 1;
        let wake = self.recorder_sleeps >= self.recorder_batch;
        // no other answer is worth waking the chassis
        self.put_grant(&Grant { next: if wake { grant.next } else { NOBODY }, ..*grant })?;
        if wake {
            self.wake_recorder();
        }
        while self.remotes[remote].reply(self.reached)?.is_some() {
            self.recorder_owes -= 1;
        }
        self.await_recorder(RECORDER_CREDIT - 1)
    }

    /// Waits until the recorder has acted on all that it was granted.
    pub fn settle_recorder(&mut self) -> Result<(), RunError> {
        self.wake_recorder();
        self.await_recorder(0)
    }

    /// Waits until the recorder owes so many answers at most, or has died and the run goes on without it.
    fn await_recorder(&mut self, most: u32) -> Result<(), RunError> {
        let Some(remote) = self.place[BoardId::BusAnalyzer as usize] else { return Ok(()) };
        while self.recorder_owes > most && self.await_reply_or(remote, &|_| false)?.is_some() {
            self.recorder_owes -= 1;
        }
        Ok(())
    }

    /// The recorder is down: it owes nothing any more.
    pub fn forget_recorder(&mut self) {
        (self.recorder_owes, self.recorder_sleeps) = (0, 0);
    }

    /// Gives the recorder the turns for the grants that it has.
    pub fn wake_recorder(&mut self) {
        if let (Some((bells, _)), Some(remote)) = (&self.bells, self.place[BoardId::BusAnalyzer as usize])
            && self.recorder_sleeps > 0
        {
            bells.ring(self.remotes[remote].bell);
            self.recorder_sleeps = 0;
        }
    }

    /// Grants a board in another process its transfers of the window, and the turn.
    pub fn send_grant(&mut self, remote: usize, grant: &Grant) -> Result<(), RunError> {
        self.put_grant(grant)?;
        self.ring(remote);
        Ok(())
    }

    /// Gives a process its turn.
    pub fn ring(&self, remote: usize) {
        if let Some((bells, _)) = &self.bells {
            bells.ring(self.remotes[remote].bell);
        }
    }

    /// Grants a board in another process its transfers of the window.
    pub fn put_grant(&mut self, grant: &Grant) -> Result<(), RunError> {
        let Some(remote) = self.place[grant.board as usize] else { return Ok(()) };
        let sent = self.remotes[remote].grant(grant, &self.transfers[grant.board as usize]);
        if sent.is_err() {
            if grant.flags & flags::TURN != 0 && self.power.ended().is_some() {
                // found out when its turn comes: the windows before that one are whole
                return Ok(());
            }
            // a process that has just died is the better explanation
            self.watch()?;
            if self.life.is_down(BOARDS[grant.board as usize]) {
                return Ok(());
            }
        }
        Ok(sent?)
    }

    /// The answer to a grant; none where the board has handed its turn on, or has died and the run goes on without it.
    pub fn collect(&mut self, remote: usize, grant: &Grant) -> Result<Option<Answer>, RunError> {
        let board = BOARDS[grant.board as usize];
        let handed_on = |bells: &Bells| grant.flags & flags::TURN != 0 && bells.turn() != grant.turn;
        loop {
            let Some((who, window, answer)) = self.await_reply_or(remote, &handed_on)? else { return Ok(None) };
            if who == BoardId::BusAnalyzer && self.recorder_owes > 0 {
                self.recorder_owes -= 1;
                continue;
            }
            if who == board && window == grant.window {
                return Ok(Some(answer));
            }
            return Err(RunError::BadAnswer {
                board: who.name(),
                what: format!("window {window} where `{}` was asked for window {}", board.name(), grant.window),
                when: at(self.reached),
            });
        }
    }

    /// The next answer of a process; one that the run could do without must live up to here, too.
    pub fn await_reply(&mut self, remote: usize) -> Result<(BoardId, u64, Answer), RunError> {
        let reply = self.await_reply_or(remote, &|_| false)?;
        let process = &self.remotes[remote].process;
        reply.ok_or_else(|| RunError::Died {
            process: process.clone(),
            how: self.life.died(process).unwrap_or("has ended").to_owned(),
            when: at(self.reached),
        })
    }

    /// The next answer of a process; none once `handed_on` says that it has handed its turn on, or it has died and the run
    /// goes on without it.
    fn await_reply_or(
        &mut self,
        remote: usize,
        handed_on: &dyn Fn(&Bells) -> bool,
    ) -> Result<Option<(BoardId, u64, Answer)>, RunError> {
        // wall time and processor time of the board at first; periods waited and processor time since it was last seen at
        // work. Time for which the chassis itself was stopped is no time that it waited
        let (mut first, mut waiting): (Option<(Instant, u64)>, Option<(u32, u64)>) = (None, None);
        let mut amiss = Ok(());
        loop {
            let Some((bells, bell)) = &mut self.bells else { return Ok(None) };
            if handed_on(bells) {
                return Ok(None);
            }
            if let Some(reply) = self.remotes[remote].reply(self.reached)? {
                return Ok(Some(reply));
            }
            // counts only where the board has not gone on before it happened
            amiss?;
            if BOARDS.iter().any(|board| self.place[*board as usize] == Some(remote) && self.life.is_down(*board)) {
                return Ok(None);
            }
            if bell.wait(WATCH_PERIOD) > 0 {
                amiss = Ok(());
                continue;
            }
            amiss = self.watch();
            if amiss.is_err() {
                continue;
            }
            let name = &self.remotes[remote].process;
            let used = self.power.used(name);
            let (asked, used_at_first) = *first.get_or_insert((Instant::now(), used));
            let (periods, used_before) = waiting.get_or_insert((0, used));
            *periods += 1;
            let how = if used.saturating_sub(used_at_first) > SPIN_S * rustix::param::clock_ticks_per_second() {
                Some(format!("it has used {SPIN_S} s of processor time"))
            } else if WATCH_PERIOD * *periods > STALL {
                self.power.idle(name, *used_before).map(str::to_owned)
            } else {
                continue;
            };
            let Some(how) = how else {
                // starved, not stalled
                waiting = None;
                continue;
            };
            let name = name.clone();
            if self.outlives(&name, &format!("was stalled ({how})")) {
                return Ok(None);
            }
            return Err(RunError::Stalled {
                process: name,
                how,
                waited_s: asked.elapsed().as_secs_f64(),
                when: at(self.reached),
            });
        }
    }
}

/// Processor time, then accesses: which of two programs asks for more.
fn demand(program: &[Op]) -> (Ns, usize) {
    let execution = program.iter().map(|op| if let Op::Exec(ns) = op { *ns } else { 0 });
    (execution.fold(0, Ns::saturating_add), program.iter().filter(|op| matches!(op, Op::Access(_))).count())
}

/// The transfers that the data plane carries out.
fn program_transfers(log: &Log) -> impl Iterator<Item = &Transfer> {
    log.transfers.iter().filter(|transfer| transfer.origin == Origin::Program)
}

/// The transfers that go to the record: those of programs, each time that they took place.
pub(crate) fn recorded_transfers(log: &Log) -> impl Iterator<Item = &Transfer> {
    log.transfers.iter().filter(|transfer| matches!(transfer.origin, Origin::Program | Origin::Repeat))
}
