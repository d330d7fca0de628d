//! The boards of one process and their mail.

use crate::acts::Acts;
use crate::faults::Clocks;
use crate::holdback::{take_before, take_until};
use crate::{Context, RunError};
use board::{Board, BoardId, Decision, Inputs, Mail, Ns, Op, Outputs};
use channels::{Exchange, Inboxes, wall_ns};
use messages::{BOARDS, Grant, Span, TransferRecord, flags};

/// Builds the board of that role.
pub type Factory<'a> = &'a dyn Fn(BoardId, &Context) -> Result<Box<dyn Board>, String>;

/// What a board answered to a grant, mail aside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// The plant stopped here.
    pub early: Option<Ns>,
    /// New rest of the job at its decision point.
    pub rest: Option<Vec<Op>>,
    /// New programs of tasks.
    pub programs: Vec<(u16, Vec<Op>)>,
}

impl Answer {
    /// Whether the board has cut a window that was to end at `until` short.
    pub(crate) fn cuts(&self, until: Ns) -> bool {
        self.early.is_some_and(|early| early < until)
    }
}

/// The boards of one process.
pub struct Host {
    boards: Vec<(BoardId, Box<dyn Board>)>,
    exchange: Exchange,
    clocks: Clocks,
    inboxes: Box<Inboxes>,
    inputs: Inputs,
    outputs: Outputs,
    /// What is measured, where anything is.
    acts: Option<Acts>,
    /// Whether on the wall clock, and now; then, when the last step began and ended there.
    timed: bool,
    began: u64,
    ended: u64,
    /// Last window of each board.
    windows: [(Ns, Ns); BOARDS.len()],
}

/// Longest window, and longest time between two of a board on the wires: bounds the work of a step.
const LONGEST: Ns = 1_000_000_000;
/// No run lasts until then (36 years): a board may add to a time without a look at its range.
const LATEST: Ns = 1 << 60;

impl Host {
    /// Builds the boards `here` with `factory`.
    pub fn new(
        here: &[BoardId],
        exchange: Exchange,
        context: &Context,
        factory: Factory<'_>,
    ) -> Result<Host, RunError> {
        let boards = here
            .iter()
            .filter(|id| **id != BoardId::Chassis)
            .map(|id| match factory(*id, context) {
                Ok(board) => Ok((*id, board)),
                Err(reason) => Err(RunError::Board { board: id.name(), reason }),
            })
            .collect::<Result<_, _>>()?;
        let (inputs, outputs) = Default::default();
        let clocks = Clocks::new(&context.scenario);
        let windows = [(0, 0); BOARDS.len()];
        Ok(Host { boards, exchange, clocks, inboxes: Box::default(), inputs, outputs, acts: None, timed: false, began: 0, ended: 0, windows })
    }

    /// Drops these boards as a killed process drops them: nothing is flushed, nothing said.
    pub(crate) fn drop_boards(&mut self, down: &[BoardId]) {
        let (gone, kept) = std::mem::take(&mut self.boards).into_iter().partition(|(id, _)| down.contains(id));
        self.boards = kept;
        std::mem::forget::<Vec<_>>(gone);
    }

    /// Builds boards that were dropped anew; mail that has come for them is lost.
    pub(crate) fn build(&mut self, up: &[BoardId], context: &Context, factory: Factory<'_>) -> Result<(), RunError> {
        for id in up {
            let board = factory(*id, context).map_err(|reason| RunError::Board { board: id.name(), reason })?;
            self.renew(*id)?;
            self.boards.push((*id, board));
        }
        Ok(())
    }

    /// Forgets the mail that has come for a board that starts again.
    pub(crate) fn renew(&mut self, board: BoardId) -> Result<(), RunError> {
        self.inboxes[board as usize].clear();
        self.begins_anywhere(board);
        Ok(self.exchange.renew(board)?)
    }

    /// Takes in the mail of the board that the grant names and steps it.
    pub fn step(&mut self, grant: &Grant, transfers: &[TransferRecord]) -> Result<Answer, RunError> {
        if let Some(id) = BoardId::from_number(grant.board as u8) {
            self.fetch(id, grant.until, 0)?;
        }
        self.act(grant, transfers)
    }

    /// Takes in the mail that a board that has acted up to `stepped_to` has at `now`.
    pub(crate) fn fetch(&mut self, board: BoardId, now: Ns, stepped_to: Ns) -> Result<&mut Mail, RunError> {
        self.began = self.clock();
        let mut acts = self.acts.as_mut().filter(|_| self.timed);
        let before = acts.as_ref().map_or(0, |acts| acts.spans.len());
        let hops = acts.as_mut().map(|acts| &mut acts.spans);
        self.exchange.fetch(board, stepped_to, &mut self.inboxes, hops)?;
        if let Some(acts) = acts {
            acts.came(before);
        }
        self.exchange.check(board, now, &mut self.inboxes, &mut self.inputs.defects);
        Ok(&mut self.inboxes[board as usize])
    }

    /// The boards keep time by themselves.
    pub(crate) fn run_free(&mut self) {
        self.inputs.free_running = true;
    }

    /// From now on what the boards do is measured in simulated time.
    pub(crate) fn measure(&mut self) {
        self.acts = Some(Acts::default());
    }

    /// The same on the wall clock, from now on or, not `timed`, from now on no more.
    pub(crate) fn time(&mut self, timed: bool) {
        if timed && !self.timed {
            // what there is belongs to a time before this
            self.measure();
        } else if !timed {
            self.acts = None;
        }
        self.timed = timed;
        self.exchange.stamp(timed);
    }

    /// What the wall clock shows, ns, where anything is timed; 0 otherwise.
    fn clock(&self) -> u64 {
        if self.timed { wall_ns() } else { 0 }
    }

    /// When the last step began, taking its mail in, and when it ended, on the wall clock, ns; 0 where it was not timed.
    pub(crate) fn last_step(&self) -> (u64, u64) {
        (self.began, self.ended)
    }

    /// What has been measured and not been taken, where anything is.
    pub(crate) fn spans(&mut self) -> Option<&mut Vec<Span>> {
        self.acts.as_mut().map(|acts| &mut acts.spans)
    }

    /// Measures how many messages this process has sent, a channel each.
    pub(crate) fn count_sent(&mut self) {
        if let Some(acts) = &mut self.acts {
            acts.spans.extend(self.exchange.sent());
        }
    }

    /// Steps the board that the grant names with the mail taken in.
    pub(crate) fn act(&mut self, grant: &Grant, transfers: &[TransferRecord]) -> Result<Answer, RunError> {
        let id = BoardId::from_number(grant.board as u8).filter(|id| self.boards.iter().any(|(known, _)| known == id));
        let Some(id) = id else {
            return Err(RunError::BadAnswer {
                board: "chassis",
                what: format!("a grant for board number {}, which is not here", grant.board),
                when: crate::error::at(grant.until),
            });
        };
        if !self.follows(id, grant) {
            let (from, until) = self.windows[id as usize];
            return Err(RunError::BadAnswer {
                board: "chassis",
                what: format!(
                    "a grant from {} to {} ns for `{}`, whose last window was {from} to {until} ns",
                    grant.from,
                    grant.until,
                    id.name()
                ),
                when: crate::error::at(until),
            });
        }
        let inputs = &mut self.inputs;
        inputs.from = grant.from;
        inputs.until = grant.until;
        inputs.boot = grant.flags & flags::BOOT != 0;
        inputs.rerun = grant.flags & flags::RERUN != 0;
        inputs.finish = grant.flags & flags::FINISH != 0;
        inputs.decision =
            (grant.flags & flags::DECIDE != 0).then_some(Decision { task: grant.task as u16, job: grant.job });
        inputs.transfers.clear();
        inputs.transfers.extend_from_slice(transfers);
        let inbox = &mut self.inboxes[id as usize];
        match id {
            BoardId::BusAnalyzer if inputs.finish => take_until(grant.until, inbox, &mut inputs.mail),
            BoardId::BusAnalyzer => take_before(grant.until, inbox, &mut inputs.mail),
            _ => std::mem::swap(&mut inputs.mail, inbox),
        }
        self.outputs.clear();
        if let Some((_, board)) = self.boards.iter_mut().find(|(known, _)| *known == id) {
            board.step(self.clocks.show(id, grant.until), &self.inputs, &mut self.outputs);
        }
        if !self.clocks.are_right() {
            // a card stamps by its own clock
            let stamped = self.outputs.mail.words.iter_mut().filter(|word| word.t != 0);
            stamped.for_each(|word| word.t = self.clocks.show(id, word.t));
        }
        self.exchange.deliver(id, grant.until, &self.outputs.mail, &mut self.inboxes)?;
        // an arm that stopped early stands there
        let stands = self.outputs.early.map_or(grant.until, |early| early.clamp(grant.from, grant.until));
        self.windows[id as usize] = (grant.from, stands);
        self.ended = self.clock();
        if let Some(acts) = &mut self.acts {
            acts.stepped(id, grant, &self.inputs, &self.outputs, self.began, self.ended);
        }
        self.inputs.mail.clear();
        self.inputs.defects.clear();
        Ok(Answer {
            early: self.outputs.early,
            rest: self.outputs.rest.take(),
            programs: std::mem::take(&mut self.outputs.programs),
        })
    }

    /// The board's next window begins where it will: it comes up while time goes on.
    pub(crate) fn begins_anywhere(&mut self, board: BoardId) {
        self.windows[board as usize] = (0, 0);
    }

    /// Whether a board can carry on with this window: time goes forwards, but for a window that `da_io` runs again, and
    /// no further at once than a board's work is bounded.
    fn follows(&self, board: BoardId, grant: &Grant) -> bool {
        let (from, until) = self.windows[board as usize];
        let again = board == BoardId::DaIo && grant.flags & flags::RERUN != 0;
        let earliest = if again { from } else { until };
        let on_the_wires =
            matches!(board, BoardId::DaIo | BoardId::HwSim | BoardId::ForceSensorIf | BoardId::EncoderIf);
        // a card that is powered up again begins at any time; the arm has been there from the start
        let first = until == 0 && board != BoardId::HwSim;
        grant.until <= LATEST
            && (earliest..=grant.until).contains(&grant.from)
            && grant.until - grant.from <= LONGEST
            && (first || !on_the_wires || grant.from - earliest <= LONGEST)
    }

    /// Sends mail in the chassis' own name.
    pub fn send(&mut self, mail: &Mail) -> Result<(), RunError> {
        Ok(self.exchange.deliver(BoardId::Chassis, 0, mail, &mut self.inboxes)?)
    }

    /// Takes in the mail for the chassis itself.
    pub fn read(&mut self) -> Result<&mut Mail, RunError> {
        self.exchange.fetch(BoardId::Chassis, 0, &mut self.inboxes, None)?;
        Ok(&mut self.inboxes[BoardId::Chassis as usize])
    }

    /// The boards that live here.
    pub fn boards(&self) -> impl Iterator<Item = BoardId> {
        self.boards.iter().map(|(id, _)| *id)
    }
}
