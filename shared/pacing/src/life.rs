//! Boards that go down and come up again: planned crashes and hangs, and processes that die although nobody planned it.
//!
//! A planned outage begins and ends between two windows: its boards are idle, and the timing plane knows of it. Where they
//! live in a process of their own, that gets the real signal, which is confirmed before simulated time goes on; in the
//! chassis the boards are dropped as a killed process drops them, with nothing flushed. They come up as new ones.
//!
//! A process that dies unplanned goes down at the end of the last completed window. One that control does without is started
//! again as its scenario says; any other ends the run.

use crate::RunError;
use crate::boards::Boards;
use crate::error::at;
use crate::lines::Lines;
use board::{BoardId, Mail, Ns, Op};
use messages::{Event, EventKind, Severity, flags};
use scenario::{Outage, Restart, Scenario};
use std::collections::VecDeque;
use vme::Timing;

/// What is down, and what goes down or comes up when.
pub(crate) struct Life {
    /// Planned outages to come, in the order of time.
    outages: VecDeque<Outage>,
    /// Boards that come up again, when, and whether their outage was planned.
    returns: Vec<(Ns, Vec<BoardId>, bool)>,
    /// A bit for each board that is down.
    down: u32,
    /// Processes that have died unplanned since the last window, and how.
    died: Vec<(String, String)>,
    /// What was lost so far, in words.
    pub losses: Vec<String>,
    /// Restarts of processes that died unplanned.
    restarted: Vec<String>,
    /// What the drives see of da_io while it is down.
    pub lines: Lines,
    /// What the chassis has to send with the next window.
    pub mail: Mail,
}

impl Life {
    pub fn new(scenario: &Scenario) -> Life {
        Life {
            outages: scenario.outages().into(),
            returns: Vec::new(),
            down: 0,
            died: Vec::new(),
            losses: Vec::new(),
            restarted: Vec::new(),
            lines: Lines::new(scenario),
            mail: Mail::default(),
        }
    }

    /// How the process died since the last window, if it did.
    pub fn died(&self, process: &str) -> Option<&str> {
        self.died.iter().find(|(name, _)| name == process).map(|(_, how)| how.as_str())
    }

    pub fn is_down(&self, board: BoardId) -> bool {
        self.down >> board as u32 & 1 == 1
    }

    /// An event for each board that was lost at `now` although nobody planned it.
    fn tell_lost(&mut self, now: Ns, boards: impl Iterator<Item = BoardId>) {
        let lost = |board| Event::new(now, EventKind::BoardLost, Severity::Error, f64::from(board as u8), 0.0);
        self.mail.events.extend(boards.map(lost));
    }

    /// Whether a process has died since the last window.
    pub fn has_lost(&self) -> bool {
        !self.died.is_empty()
    }

    /// When a window has to end because boards go down or come up.
    pub fn next_change(&self) -> Ns {
        let returns = self.returns.iter().map(|(at, ..)| *at).min().unwrap_or(Ns::MAX);
        self.outages.front().map_or(Ns::MAX, |outage| outage.from).min(returns)
    }
}

fn mask(boards: &[BoardId]) -> u32 {
    boards.iter().fold(0, |mask, board| mask | 1 << *board as u32)
}

impl Boards<'_> {
    /// A process has ended or does not answer. True where the run goes on without it until the window's end.
    pub fn outlives(&mut self, process: &str, how: &str) -> bool {
        let Some(stated) = self.context.scenario.processes.iter().find(|stated| stated.name == process) else {
            return false;
        };
        let boards: Vec<BoardId> = stated.board_ids().collect();
        let again = match stated.restart() {
            Restart::Never => false,
            Restart::Once => !self.life.restarted.iter().any(|name| name == process),
            Restart::Always => true,
        };
        if !again {
            return false;
        }
        if !self.life.died.iter().any(|(name, _)| name == process) {
            self.life.died.push((process.to_owned(), how.to_owned()));
            self.power.remove(process);
            self.mark_down(&boards);
        }
        true
    }

    /// In real time nobody waits for a new process: the run goes on without those that have died. True where there are any.
    pub fn go_on_without(&mut self) -> bool {
        let died = std::mem::take(&mut self.life.died);
        for (process, how) in &died {
            let when = at(self.reached);
            self.life.losses.push(format!("process `{process}` {how}, {when}; the run went on without it"));
            let stated = self.context.scenario.processes.iter().filter(|stated| stated.name == *process);
            self.life.tell_lost(self.reached, stated.flat_map(scenario::Process::board_ids));
        }
        !died.is_empty()
    }

    /// Carries out what is due at `now`, between two windows. `rest` holds the rest of each task's jobs.
    pub fn change_lives(&mut self, now: Ns, timing: &mut Timing, rest: &mut [Vec<Op>]) -> Result<(), RunError> {
        for (process, how) in std::mem::take(&mut self.life.died) {
            self.lost(now, &process, &how, timing);
        }
        while let Some(i) = self.life.returns.iter().position(|(at, ..)| *at <= now) {
            let (_, boards, planned) = self.life.returns.remove(i);
            self.come_up(now, &boards, timing, rest)?;
            if !planned {
                self.tasks_of(&boards).into_iter().for_each(|task| timing.restart(task));
            }
        }
        while self.life.outages.front().is_some_and(|outage| outage.from <= now) {
            if let Some(outage) = self.life.outages.pop_front() {
                self.go_down(now, &outage)?;
            }
        }
        Ok(())
    }

    fn go_down(&mut self, now: Ns, outage: &Outage) -> Result<(), RunError> {
        if outage.boards.iter().any(|board| self.life.is_down(*board)) {
            return Ok(());
        }
        if outage.boards.contains(&BoardId::BusAnalyzer) {
            self.settle_recorder()?;
        }
        match self.place[outage.boards[0] as usize] {
            Some(remote) => {
                let process = self.remotes[remote].process.clone();
                self.power.take_down(&process, outage.hang).map_err(|reason| RunError::Signal {
                    process,
                    signal: if outage.hang { "SIGSTOP" } else { "SIGKILL" },
                    reason,
                    when: at(now),
                })?;
            }
            None => self.host.drop_boards(&outage.boards),
        }
        self.mark_down(&outage.boards);
        if outage.boards.contains(&BoardId::DaIo) {
            let mail = &mut self.life.mail;
            self.life.lines.da_io_is_gone(now, outage.hang, &mut mail.amplifier, &mut mail.events);
        }
        let event = Event::injected(now, outage.fault);
        self.life.mail.events.push(event);
        if outage.until != Ns::MAX {
            self.life.returns.push((outage.until, outage.boards.clone(), true));
        }
        Ok(())
    }

    /// The boards of a process that died unplanned are down from `now` on.
    fn lost(&mut self, now: Ns, process: &str, how: &str, timing: &mut Timing) {
        let Some(stated) = self.context.scenario.processes.iter().find(|stated| stated.name == process) else { return };
        let boards: Vec<BoardId> = stated.board_ids().collect();
        let up = now + scenario::nanoseconds(stated.boot_ms * 1e-3);
        self.life.losses.push(format!("process `{process}` {how}, {}; it is started again", at(now)));
        self.life.restarted.push(process.to_owned());
        self.tasks_of(&boards).into_iter().for_each(|task| timing.halt(task));
        self.life.tell_lost(now, boards.iter().copied());
        self.life.returns.push((up, boards, false));
    }

    fn come_up(
        &mut self,
        now: Ns,
        boards: &[BoardId],
        timing: &mut Timing,
        rest: &mut [Vec<Op>],
    ) -> Result<(), RunError> {
        if boards.contains(&BoardId::BusAnalyzer) {
            self.parts += 1;
            self.context.record = self.first_record.as_ref().map(|record| crate::part_of(record, self.parts));
        }
        match self.place[boards[0] as usize] {
            Some(remote) => self.start_again(remote, boards)?,
            None => self.host.build(boards, &self.context, self.factory)?,
        }
        self.life.down &= !mask(boards);
        self.show_down();
        for task in self.tasks_of(boards) {
            rest[usize::from(task)].clear();
        }
        for board in boards {
            self.transfers[*board as usize].clear();
            let answer = self.ask(&self.grant_of(*board, now, now, flags::BOOT))?;
            for (task, program) in answer.programs {
                self.note_program(timing.rack(), *board, task, &program)?;
                timing.set_program(task, &program);
            }
            let event = Event::new(now, EventKind::BoardUp, Severity::Ok, f64::from(*board as u8), 0.0);
            self.life.mail.events.push(event);
        }
        Ok(())
    }

    fn start_again(&mut self, remote: usize, boards: &[BoardId]) -> Result<(), RunError> {
        let process = self.remotes[remote].process.clone();
        // one that hangs is powered off first
        self.power.remove(&process);
        if let Some(domain) = &self.domain {
            domain.clean_dead(mask(boards));
        }
        while self.remotes[remote].reply(self.reached)?.is_some() {}
        let Some(folder) = &self.folder else { return Ok(()) };
        folder.write_context(&self.context)?;
        let pid = self.power.spawn(&process, &self.commands[remote], &folder.path)?;
        if let Some(processor) = &self.processor_kept {
            processor.keep(pid, boards.contains(&BoardId::BusAnalyzer));
        }
        self.wait_until_ready(remote)
    }

    fn mark_down(&mut self, boards: &[BoardId]) {
        self.life.down |= mask(boards);
        if boards.contains(&BoardId::BusAnalyzer) {
            self.forget_recorder();
        }
        self.show_down();
    }

    fn show_down(&self) {
        if let Some(domain) = &self.domain {
            domain.set_down(self.life.down);
        }
    }

    fn tasks_of(&self, boards: &[BoardId]) -> Vec<u16> {
        (0..).zip(&self.of_task).filter(|(_, board)| boards.contains(board)).map(|(task, _)| task).collect()
    }
}
