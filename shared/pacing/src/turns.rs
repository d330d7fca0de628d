//! Turns: within a window the boards act one after the other, and each hands the turn on to the next by its number in
//! shared memory and a bell. The chassis is not between: it may have granted the turns of some windows ahead.
//!
//! A board that has something to say beside its mail (an early return, a new program) keeps the turn and replies. What was
//! granted behind it is then void, since it was planned without that.

use crate::boards::Boards;
use crate::host::Answer;
use crate::serve::CHASSIS_BELL;
use crate::{Context, RunError};
use board::BoardId;
use channels::Bells;
use messages::{BOARDS, Grant, flags};

/// Windows that may be under way where the chassis need not act in them.
const LOOKAHEAD: usize = 16;

/// The turns of a run.
pub(crate) struct Turns {
    /// Number of the turn to be taken now, where no process needs to know it.
    due: u32,
    /// Number of the next turn to be given.
    next: u32,
    /// Windows that may be under way now: fewer behind one in which a board had something to say.
    pub ahead: usize,
    /// The most that there may be.
    pub most: usize,
}

impl Turns {
    /// The turns of a run whose boards are here where `place` says `None`.
    pub fn new(place: &[Option<usize>; BOARDS.len()], context: &Context) -> Turns {
        let away = |board: &BoardId| {
            matches!(board, BoardId::Chassis | BoardId::BusAnalyzer) || place[*board as usize].is_some()
        };
        // what the chassis does between two windows needs the window's end: outages, and what is measured
        let apart = BOARDS.iter().all(away) && context.scenario.outages().is_empty() && !context.measure;
        Turns { due: 0, next: 0, ahead: 1, most: if apart { LOOKAHEAD } else { 1 } }
    }

    /// A window has passed in which nobody had anything to say.
    pub fn look_further(&mut self) {
        self.ahead = (2 * self.ahead).min(self.most);
    }

    /// Whether the chassis wants to hear of the end of the window with this number.
    pub fn tells(&self, window: u64) -> bool {
        (window + 1).is_multiple_of((self.ahead as u64 / 2).max(1))
    }
}

/// A board hands on the turn that it has taken.
pub(crate) fn hand_on(bells: &Bells, taken: &Grant) {
    bells.set_turn(taken.turn.wrapping_add(1));
    bells.ring(taken.next as usize);
    if taken.flags & flags::TELL != 0 && taken.next as usize != CHASSIS_BELL {
        bells.ring(CHASSIS_BELL);
    }
}

impl Boards<'_> {
    fn due(&self) -> u32 {
        self.bells.as_ref().map_or(self.turns.due, |(bells, _)| bells.turn())
    }

    fn bell_of(&self, grant: Option<&Grant>) -> usize {
        let remote = grant.and_then(|grant| self.place[grant.board as usize]);
        remote.map_or(CHASSIS_BELL, |remote| self.remotes[remote].bell)
    }

    /// Gives the boards of a window, or of what is left of it, their turns, behind those given before. `tell`: the chassis
    /// wants to hear of their end.
    pub fn give_turns(&mut self, grants: &mut [Grant], tell: bool) -> Result<(), RunError> {
        for i in 0..grants.len() {
            // the next window begins with the same board
            let after = grants.get(i + 1).or(grants.first().filter(|_| self.turns.ahead > 1));
            let next = self.bell_of(after) as u32;
            let last = if tell && i + 1 == grants.len() { flags::TELL } else { 0 };
            let grant = &mut grants[i];
            (grant.next, grant.turn) = (next, self.turns.next);
            grant.flags |= flags::TURN | last;
            self.turns.next = self.turns.next.wrapping_add(1);
            self.put_grant(&grants[i])?;
        }
        // the board before may have handed it on already
        if let Some(first) = grants.first().filter(|first| first.turn == self.due())
            && let Some(remote) = self.place[first.board as usize]
        {
            self.ring(remote);
        }
        Ok(())
    }

    /// Sees these turns through: the boards here act, those in other processes are waited for. Stops at one that has
    /// something to say: its place among the turns, and its answer.
    pub fn see_through(&mut self, grants: &[Grant]) -> Result<Option<(usize, Answer)>, RunError> {
        let Some(first) = grants.first() else { return Ok(None) };
        loop {
            let taken = self.due().wrapping_sub(first.turn) as usize;
            let Some(grant) = grants.get(taken) else { return Ok(None) };
            let board = grant.board as usize;
            let Some(remote) = self.place[board] else {
                let answer = self.host.step(grant, &self.transfers[board])?;
                if answer != Answer::default() {
                    return Ok(Some((taken, answer)));
                }
                match &self.bells {
                    Some((bells, _)) => hand_on(bells, grant),
                    None => self.turns.due = grant.turn.wrapping_add(1),
                }
                continue;
            };
            match self.collect(remote, grant)? {
                Some(answer) => return Ok(Some((taken, answer))),
                None if self.due() != grant.turn => {}
                // it has died, and the run goes on without it
                None => return Ok(Some((taken, Answer::default()))),
            }
        }
    }

    /// Turns that have been given and not taken are void; nobody is acting.
    pub fn void_turns(&mut self) {
        self.turns.ahead = 1;
        match &self.bells {
            Some((bells, _)) => bells.set_turn(self.turns.next),
            None => self.turns.due = self.turns.next,
        }
    }
}
