//! Boards that go down and come up again by the wall clock.
//!
//! A planned crash or hang begins when the wall clock shows its time: the process gets the real signal wherever it is in its
//! work. The process that takes its place is started when the fault ends, boots beside the others while they go on, and
//! takes part once its `boot_ms` are over and it is ready. Boards inside the chassis are dropped and built at those times.

use super::Realtime;
use crate::RunError;
use crate::boards::recorded_transfers;
use crate::life::Return;
use board::{BoardId, Mail, Ns};
use channels::wall_ns;
use messages::{Grant, TransferRecord, flags};
use std::time::Instant;

/// Window number of the answers of a process that comes up.
const COMES_UP: u64 = u64::MAX - 2;

/// A process that has been started again.
pub(super) struct Booting {
    again: Return,
    remote: usize,
    stage: Stage,
}

/// How far it has come.
#[derive(PartialEq, Eq)]
enum Stage {
    Starting,
    /// It waits for its first grant.
    Ready,
    /// It owes so many answers before it takes part.
    Answering(usize),
}

impl Realtime<'_> {
    /// When boards go down or come up next, simulated time.
    pub(super) fn next_change(&self) -> Ns {
        let starts = self.boards.life.returns.iter().map(|again| self.starts_at(again));
        let ready = self.booting.iter().filter(|booting| booting.stage == Stage::Ready).map(|booting| booting.again.at);
        starts.chain(ready).min().unwrap_or(Ns::MAX).min(self.boards.life.next_outage())
    }

    /// Carries out what is due. True where anything has changed.
    pub(super) fn change_lives(&mut self) -> Result<bool, RunError> {
        let now = wall_ns().saturating_sub(self.zero);
        let mut changed = false;
        for boards in self.boards.lost(now) {
            self.are_gone(&boards);
            self.boards.tasks_of(&boards).into_iter().for_each(|task| self.plan.halt(task));
            changed = true;
        }
        while let Some(outage) = self.boards.outage_due(now) {
            // a heartbeat that has been told but is yet to come will not be taken
            let told = self.told.iter().flat_map(|(_, draft)| recorded_transfers(&draft.log));
            let made: Vec<TransferRecord> =
                told.filter(|transfer| transfer.data_at <= outage.from).map(TransferRecord::from).collect();
            self.boards.life.lines.transfers(&made);
            self.boards.go_down(outage.from, &outage)?;
            let amplifier = std::mem::take(&mut self.boards.life.mail.amplifier);
            self.boards.host.send(&Mail { amplifier, ..Mail::default() })?;
            self.are_gone(&outage.boards);
            changed = true;
        }
        while let Some(i) = self.boards.life.returns.iter().position(|again| self.starts_at(again) <= now) {
            let again = self.boards.life.returns.remove(i);
            self.boards.start_again(&again.boards)?;
            match self.boards.place[again.boards[0] as usize] {
                Some(remote) => self.booting.push(Booting { again, remote, stage: Stage::Starting }),
                None => {
                    for board in &again.boards {
                        let answer = self.boards.ask(&self.first_grant(*board, now, flags::BOOT))?;
                        self.answered(*board, COMES_UP, answer)?;
                        self.boards.host.begins_anywhere(*board);
                    }
                    self.take_part(&again, now);
                }
            }
            changed = true;
        }
        for i in 0..self.booting.len() {
            if self.booting[i].stage == Stage::Ready && self.booting[i].again.at <= now {
                self.show_up(i, now)?;
            }
        }
        Ok(changed)
    }

    /// A process that boots has answered, with a window of this number.
    pub(super) fn boots(&mut self, remote: usize, window: u64) -> bool {
        let Some(i) = self.booting.iter().position(|booting| booting.remote == remote) else { return false };
        let stage = &mut self.booting[i].stage;
        match stage {
            Stage::Starting if window == crate::remote::READY => *stage = Stage::Ready,
            Stage::Answering(1) => {
                let booting = self.booting.remove(i);
                self.take_part(&booting.again, wall_ns().saturating_sub(self.zero));
            }
            Stage::Answering(owed) => *owed -= 1,
            Stage::Starting | Stage::Ready => {}
        }
        true
    }

    /// A process has as long to start as it takes to boot; boards in the chassis need no time.
    fn starts_at(&self, again: &Return) -> Ns {
        match self.boards.place[again.boards[0] as usize] {
            Some(_) => again.at.saturating_sub(self.boards.boot_time(&again.boards)),
            None => again.at,
        }
    }

    fn first_grant(&self, board: BoardId, now: Ns, flags: u32) -> Grant {
        Grant { window: COMES_UP, ..self.boards.grant_of(board, now, now, flags) }
    }

    /// The boards of a process show their initial state and get the wall clock.
    fn show_up(&mut self, i: usize, now: Ns) -> Result<(), RunError> {
        let Booting { again, remote, stage } = &mut self.booting[i];
        // each board's, and that rights have been asked for
        *stage = Stage::Answering(again.boards.len() + 1);
        let (boards, remote) = (again.boards.clone(), *remote);
        let mut grants: Vec<Grant> = boards.iter().map(|board| self.first_grant(*board, now, flags::BOOT)).collect();
        let prepare = self.first_grant(BoardId::Chassis, 0, flags::START);
        grants.extend([prepare, Grant { from: self.zero, ..prepare }]);
        for grant in &grants {
            self.boards.remotes[remote].grant(grant, &[])?;
            self.boards.ring(remote);
        }
        let debt = &mut self.debts[remote];
        (debt.grants, debt.since, debt.used) = (boards.len() as u32 + 1, Instant::now(), None);
        Ok(())
    }

    /// From now on the boards get their windows.
    fn take_part(&mut self, again: &Return, now: Ns) {
        self.boards.mark_up(now, &again.boards);
        for task in self.boards.tasks_of(&again.boards) {
            // what was told of it while nobody was there
            self.plan.give_up(task);
            self.plan.forget_rest(task);
            if !again.planned {
                self.plan.restart(task);
            }
        }
    }

    /// Nothing is expected of these boards any more.
    fn are_gone(&mut self, boards: &[BoardId]) {
        self.booting.retain(|booting| booting.again.boards != boards);
        self.local.forget(boards);
        if let Some(remote) = self.boards.place[boards[0] as usize] {
            self.debts[remote].grants = 0;
        }
        self.boards.tasks_of(boards).into_iter().for_each(|task| self.plan.give_up(task));
    }
}
