//! The line between the chassis and one process: grants one way, replies the other.

use crate::RunError;
use crate::error::at;
use crate::host::Answer;
use board::BoardId;
use channels::{ChannelError, Domain, Port, Sender};
use messages::{Grant, Header, OpRecord, Reply, Span, TransferRecord, flags};
use vme::Ns;

/// Grants that may be under way: those of all boards for the windows ahead, void ones too, and the recorder's credit.
const BUFFER: usize = 256;
/// Transfers of a grant, operations of a reply: longer messages allocate once.
const LENGTH: usize = 64;
/// No board has a longer program.
pub(crate) const MAX_OPS: usize = 4096;

/// Spans in a message: it is worth sending with half of them; longer ones allocate once.
const SPANS: usize = 64;
/// Messages of measurements that the chassis may leave unread.
const TOLD: usize = 512;

fn wall_name(process: &str) -> String {
    format!("wall/{process}")
}

fn names(process: &str) -> (String, String) {
    (format!("grant/{process}"), format!("reply/{process}"))
}

/// The chassis' end.
pub(crate) struct Remote {
    /// Name of the process.
    pub process: String,
    /// Its bell.
    pub bell: usize,
    grants: Sender<TransferRecord, Grant>,
    replies: Port<OpRecord, Reply>,
    /// What the process measures, and the next message's number.
    measured: Option<(Port<Span, Header>, u32)>,
}

impl Remote {
    pub fn open(domain: &Domain, process: &str, bell: usize, measure: bool) -> Result<Remote, ChannelError> {
        let (grant, reply) = names(process);
        Ok(Remote {
            process: process.to_owned(),
            bell,
            grants: Sender::open(domain, &grant, 1, BUFFER, LENGTH)?,
            replies: Port::open(domain, &reply, 1, BUFFER)?,
            measured: match measure {
                true => Some((Port::open(domain, &wall_name(process), 1, TOLD)?, 0)),
                false => None,
            },
        })
    }

    /// Another process takes the place of the one that was there: what that one has said last is void.
    pub fn renew(&mut self, now: Ns) -> Result<(), RunError> {
        while self.reply(now)?.is_some() {}
        if let Some((port, next)) = &mut self.measured {
            while port.receive(|_, _| {})? {}
            *next = 0;
        }
        Ok(())
    }

    /// Takes what the process has measured; returns the number of messages that were lost.
    pub fn spans(&mut self, into: &mut Vec<Span>) -> Result<u32, ChannelError> {
        let Some((port, next)) = &mut self.measured else { return Ok(0) };
        let mut lost = 0;
        while port.receive(|header, spans| {
            lost += header.seq.wrapping_sub(*next);
            *next = header.seq.wrapping_add(1);
            into.extend(spans);
        })? {}
        Ok(lost)
    }

    pub fn grant(&self, grant: &Grant, transfers: &[TransferRecord]) -> Result<(), RunError> {
        Ok(self.grants.send(grant, transfers)?)
    }

    /// The next reply, if there is one.
    pub fn reply(&self, now: Ns) -> Result<Option<(BoardId, u64, Answer)>, RunError> {
        let mut taken = None;
        self.replies.receive(|reply, ops| {
            taken = Some((*reply, read(reply, ops)));
        })?;
        let Some((reply, answer)) = taken else { return Ok(None) };
        let bad = |what: &str| RunError::BadAnswer {
            board: BoardId::from_number(reply.board as u8).map_or("unknown", BoardId::name),
            what: format!("process `{}` sent {what}", self.process),
            when: at(now),
        };
        let board = BoardId::from_number(reply.board as u8).ok_or_else(|| bad("a board number that does not exist"))?;
        let answer =
            answer.ok_or_else(|| bad("a bus program with an operation that does not exist, or a far too long one"))?;
        Ok(Some((board, reply.window, answer)))
    }
}

/// The answer in a reply; `None` where its operations make no sense.
fn read<'a>(reply: &Reply, records: impl Iterator<Item = &'a OpRecord>) -> Option<Answer> {
    let mut answer = Answer::default();
    if reply.flags & flags::EARLY != 0 {
        answer.early = Some(reply.early);
    }
    if reply.flags & flags::NEW_REST != 0 {
        answer.rest = Some(Vec::new());
    }
    for (i, record) in records.enumerate() {
        if i == MAX_OPS {
            return None;
        }
        match record.task() {
            Some(task) => answer.programs.push((task, Vec::new())),
            None => answer.programs.last_mut().map(|(_, ops)| ops).or(answer.rest.as_mut())?.push(record.op()?),
        }
    }
    Some(answer)
}

/// The process' end.
pub(crate) struct Line {
    grants: Port<TransferRecord, Grant>,
    replies: Sender<OpRecord, Reply>,
    measured: Option<(Sender<Span, Header>, u32)>,
    ops: Vec<OpRecord>,
}

/// Window number of the reply that says "ready", before the first grant.
pub(crate) const READY: u64 = u64::MAX;

impl Line {
    pub fn open(domain: &Domain, process: &str, measure: bool) -> Result<Line, ChannelError> {
        let (grant, reply) = names(process);
        Ok(Line {
            grants: Port::open(domain, &grant, 1, BUFFER)?,
            replies: Sender::open(domain, &reply, 1, BUFFER, LENGTH)?,
            measured: match measure {
                true => Some((Sender::open(domain, &wall_name(process), 1, TOLD, SPANS)?, 0)),
                false => None,
            },
            ops: Vec::with_capacity(LENGTH),
        })
    }

    /// Tells the chassis what was measured, once it is worth a message or `at_once`.
    pub fn tell(&mut self, spans: &mut Vec<Span>, at_once: bool) {
        if let Some((sender, seq)) = &mut self.measured
            && (spans.len() >= SPANS / 2 || at_once && !spans.is_empty())
        {
            // a chassis that does not keep up counts what it has missed
            let _ = sender.send(&Header { t: 0, seq: *seq, crc: 0, wall_ns: 0 }, spans);
            *seq = seq.wrapping_add(1);
            spans.clear();
        }
    }

    pub fn grant(&self, transfers: &mut Vec<TransferRecord>) -> Result<Option<Grant>, ChannelError> {
        let mut grant = None;
        self.grants.receive(|header, payload| {
            grant = Some(*header);
            transfers.clear();
            transfers.extend(payload);
        })?;
        Ok(grant)
    }

    pub fn reply(&mut self, board: BoardId, window: u64, answer: &Answer) -> Result<(), ChannelError> {
        let mut reply = Reply { window, early: 0, board: board as u32, flags: 0 };
        self.ops.clear();
        if let Some(early) = answer.early {
            reply.early = early;
            reply.flags |= flags::EARLY;
        }
        if let Some(rest) = &answer.rest {
            reply.flags |= flags::NEW_REST;
            self.ops.extend(rest.iter().map(|op| OpRecord::from(*op)));
        }
        for (task, program) in &answer.programs {
            self.ops.push(OpRecord::of_task(*task));
            self.ops.extend(program.iter().map(|op| OpRecord::from(*op)));
        }
        self.replies.send(&reply, &self.ops)
    }
}
