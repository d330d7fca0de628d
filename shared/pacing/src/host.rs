//! The boards of one process and their mail.

use crate::holdback::take_before;
use crate::{Context, RunError};
use board::{Board, BoardId, Decision, Inputs, Mail, Ns, Op, Outputs};
use channels::{Exchange, Inboxes};
use messages::{Grant, TransferRecord, flags};

/// Builds the board of that role.
pub type Factory<'a> = &'a dyn Fn(BoardId, &Context) -> Result<Box<dyn Board>, String>;

/// What a board answered to a grant, mail aside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// The plant stopped here.
    pub early: Option<Ns>,
    /// New rest of the job at its decision point.
    pub rest: Option<Vec<Op>>,
    /// New program of a task.
    pub program: Option<(u16, Vec<Op>)>,
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
    inboxes: Box<Inboxes>,
    inputs: Inputs,
    outputs: Outputs,
}

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
        Ok(Host { boards, exchange, inboxes: Box::default(), inputs: Inputs::default(), outputs: Outputs::default() })
    }

    /// Takes in the mail of the board that the grant names and steps it.
    pub fn step(&mut self, grant: &Grant, transfers: &[TransferRecord]) -> Result<Answer, RunError> {
        if let Some(id) = BoardId::from_number(grant.board as u8) {
            self.fetch(id, 0)?;
        }
        self.act(grant, transfers)
    }

    /// Takes in the mail of a board that has acted up to `stepped_to`.
    pub(crate) fn fetch(&mut self, board: BoardId, stepped_to: Ns) -> Result<&mut Mail, RunError> {
        self.exchange.fetch(board, stepped_to, &mut self.inboxes)?;
        Ok(&mut self.inboxes[board as usize])
    }

    /// The channels of this process.
    pub(crate) fn exchange(&mut self) -> &mut Exchange {
        &mut self.exchange
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
        if id == BoardId::BusAnalyzer && !inputs.finish {
            take_before(grant.until, inbox, &mut inputs.mail);
        } else {
            std::mem::swap(&mut inputs.mail, inbox);
        }
        self.outputs.clear();
        if let Some((_, board)) = self.boards.iter_mut().find(|(known, _)| *known == id) {
            board.step(grant.until, &self.inputs, &mut self.outputs);
        }
        self.inputs.mail.clear();
        self.exchange.deliver(id, &self.outputs.mail, &mut self.inboxes)?;
        Ok(Answer { early: self.outputs.early, rest: self.outputs.rest.take(), program: self.outputs.program.take() })
    }

    /// Sends mail in the chassis' own name.
    pub fn send(&mut self, mail: &Mail) -> Result<(), RunError> {
        Ok(self.exchange.deliver(BoardId::Chassis, mail, &mut self.inboxes)?)
    }

    /// Takes in the mail for the chassis itself.
    pub fn read(&mut self) -> Result<&mut Mail, RunError> {
        self.exchange.fetch(BoardId::Chassis, 0, &mut self.inboxes)?;
        Ok(&mut self.inboxes[BoardId::Chassis as usize])
    }

    /// The boards that live here.
    pub fn boards(&self) -> impl Iterator<Item = BoardId> {
        self.boards.iter().map(|(id, _)| *id)
    }
}
