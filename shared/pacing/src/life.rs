//! Boards that go down and come up again: planned crashes and hangs, and processes that die although nobody planned it.
//!
//! In lock step a planned outage begins and ends between two windows: its boards are idle, and the timing plane knows of it. Where they
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

/// Boards that come up again together.
pub(crate) struct Return {
    /// When, at the earliest.
    pub at: Ns,
    pub boards: Vec<BoardId>,
    /// Their outage was planned.
    pub planned: bool,
}

/// What is down, and what goes down or comes up when.
pub(crate) struct Life {
    /// Planned outages to come, in the order of time.
    outages: VecDeque<Outage>,
    pub returns: Vec<Return>,
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

    /// When the next planned outage begins.
    pub fn next_outage(&self) -> Ns {
        self.outages.front().map_or(Ns::MAX, |outage| outage.from)
    }

    /// When a window has to end because boards go down or come up.
    pub fn next_change(&self) -> Ns {
        self.returns.iter().map(|again| again.at).min().unwrap_or(Ns::MAX).min(self.next_outage())
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

    /// Carries out what is due at `now`, between two windows. `rest` holds the rest of each task's jobs.
    pub fn change_lives(&mut self, now: Ns, timing: &mut Timing, rest: &mut [Vec<Op>]) -> Result<(), RunError> {
        for boards in self.lost(now) {
            self.tasks_of(&boards).into_iter().for_each(|task| timing.halt(task));
        }
        while let Some(i) = self.life.returns.iter().position(|again| again.at <= now) {
            let Return { boards, planned, .. } = self.life.returns.remove(i);
            self.come_up(now, &boards, timing, rest)?;
            if !planned {
                self.tasks_of(&boards).into_iter().for_each(|task| timing.restart(task));
            }
        }
        while let Some(outage) = self.outage_due(now) {
            if outage.boards.contains(&BoardId::BusAnalyzer) {
                self.settle_recorder()?;
            }
            self.go_down(now, &outage)?;
        }
        Ok(())
    }

    /// The next planned outage that begins by `now`, of boards that are not down already.
    pub fn outage_due(&mut self, now: Ns) -> Option<Outage> {
        while self.life.outages.front().is_some_and(|outage| outage.from <= now) {
            let outage = self.life.outages.pop_front()?;
            if !outage.boards.iter().any(|board| self.life.is_down(*board)) {
                return Some(outage);
            }
        }
        None
    }

    /// Takes the boards of an outage down at `now`.
    pub fn go_down(&mut self, now: Ns, outage: &Outage) -> Result<(), RunError> {
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
            self.life.returns.push(Return { at: outage.until, boards: outage.boards.clone(), planned: true });
        }
        Ok(())
    }

    /// The boards of each process that has died unplanned since the last call: they are down from `now` on, and come up again.
    pub fn lost(&mut self, now: Ns) -> Vec<Vec<BoardId>> {
        let mut lost = Vec::new();
        for (process, how) in std::mem::take(&mut self.life.died) {
            let boards = self.context.scenario.processes.iter().find(|stated| stated.name == process);
            let boards: Vec<BoardId> = boards.into_iter().flat_map(scenario::Process::board_ids).collect();
            self.life.losses.push(format!("process `{process}` {how}, {}; it is started again", at(now)));
            self.life.restarted.push(process);
            self.life.tell_lost(now, boards.iter().copied());
            self.life.returns.push(Return {
                at: now + self.boot_time(&boards),
                boards: boards.clone(),
                planned: false,
            });
            lost.push(boards);
        }
        lost
    }

    /// Time that the process of these boards takes to boot.
    pub fn boot_time(&self, boards: &[BoardId]) -> Ns {
        let processes = &self.context.scenario.processes;
        let process = processes.iter().find(|process| process.board_ids().any(|board| boards.contains(&board)));
        process.map_or(0, |process| scenario::nanoseconds(process.boot_ms * 1e-3))
    }

    fn come_up(
        &mut self,
        now: Ns,
        boards: &[BoardId],
        timing: &mut Timing,
        rest: &mut [Vec<Op>],
    ) -> Result<(), RunError> {
        self.start_again(boards)?;
        if let Some(remote) = self.place[boards[0] as usize] {
            self.wait_until_ready(remote)?;
        }
        self.mark_up(now, boards);
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
        }
        Ok(())
    }

    /// Builds boards that are down anew, or starts a process that does.
    pub fn start_again(&mut self, boards: &[BoardId]) -> Result<(), RunError> {
        if boards.contains(&BoardId::BusAnalyzer) {
            self.parts += 1;
            self.context.record = self.first_record.as_ref().map(|record| crate::part_of(record, self.parts));
        }
        let Some(remote) = self.place[boards[0] as usize] else {
            return self.host.build(boards, &self.context, self.factory);
        };
        let process = self.remotes[remote].process.clone();
        // one that hangs is powered off first
        self.power.remove(&process);
        if let Some(domain) = &self.domain {
            domain.clean_dead(mask(boards));
        }
        self.remotes[remote].renew(self.reached)?;
        let Some(folder) = &self.folder else { return Ok(()) };
        folder.write_context(&self.context)?;
        let pid = self.power.spawn(&process, &self.commands[remote], &folder.path)?;
        if let Some(processor) = &self.processor_kept {
            processor.keep(pid, boards.contains(&BoardId::BusAnalyzer));
        }
        Ok(())
    }

    /// Boards are up again at `now`.
    pub fn mark_up(&mut self, now: Ns, boards: &[BoardId]) {
        self.life.down &= !mask(boards);
        self.show_down();
        let up = |board: &BoardId| Event::new(now, EventKind::BoardUp, Severity::Ok, f64::from(*board as u8), 0.0);
        self.life.mail.events.extend(boards.iter().map(up));
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

    pub fn tasks_of(&self, boards: &[BoardId]) -> Vec<u16> {
        (0..).zip(&self.of_task).filter(|(_, board)| boards.contains(board)).map(|(task, _)| task).collect()
    }
}
