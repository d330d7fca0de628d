//! The workstation as a board of the rack: one console task that polls and commands.
//!
//! Each job reads the state block, decides, and writes a command block for every segment that starts within two polls
//! and a margin. A state block that did not come (the bus or the link failed) leaves everything as it is until the next.
//! What becomes of a stop of the arm, its [`Operator`] says.

use crate::commands;
use crate::operator::{Act, Operator};
use crate::sender::{Poll, Sender};
use board::{Board, Inputs, Outputs, Told};
use messages::registers::mailbox;
use messages::{BoardId, Command, Detector, Event, EventKind, Severity, Telemetry, TransferRecord};
use scenario::{FaultKind, Progress, Scenario, Schedule, Site, nanoseconds};
use vme::{Access, Direction, MILLISECOND, Ns, Op, Program, Width};

/// How much earlier than two polls ahead a command is sent.
const MARGIN: Ns = 50 * MILLISECOND;

/// The workstation.
pub struct Workstation {
    task: u16,
    /// Time between two polls.
    period: Ns,
    /// Address modifier and base of the control computer's dual-ported RAM.
    mailbox: (u8, u32),
    sender: Sender,
    operator: Operator,
    schedule: Schedule,
    progress: Progress,
    /// Started again, and has not seen how far the task is.
    rejoins: bool,
    /// Its program has ended.
    gone: bool,
    told: Told,
    /// The last access did not get through the adaptor.
    cut_off: bool,
    /// The state block of this job.
    block: Option<Telemetry>,
    /// Blocks that the last job wrote.
    written: usize,
}

impl Workstation {
    /// The workstation of the scenario's rack. The message says what it lacks.
    pub fn new(scenario: &Scenario) -> Result<Workstation, String> {
        let task = scenario
            .task_of("workstation")
            .ok_or("the rack has no task of the board `workstation`")?;
        let ram = (scenario
            .rack
            .slaves
            .iter()
            .find(|slave| slave.name == "cpu-1-dpram"))
        .ok_or("the rack has no slave `cpu-1-dpram`")?;
        let period = scenario.rack.tasks[usize::from(task)].period_ns;
        Ok(Workstation {
            task,
            mailbox: (ram.am, ram.base),
            sender: Sender::new(commands::of(scenario), 2 * period + MARGIN),
            operator: Operator::new(scenario.safety.acknowledge_s.map(nanoseconds)),
            period,
            schedule: Schedule::new(scenario, |site| site == Site::Board(BoardId::Workstation)),
            progress: Progress::default(),
            rejoins: false,
            gone: false,
            told: Told::default(),
            cut_off: false,
            block: None,
            written: 0,
        })
    }

    /// Moves one block of the mailbox, a longword a cycle.
    fn block(&self, dir: Direction, offset: u32, bytes: usize) -> Op {
        let (am, base) = self.mailbox;
        Op::Access(Access {
            am,
            addr: base + offset,
            width: Width::D32,
            dir,
            n: bytes as u32 / 4,
        })
    }

    /// Faults that have begun or ended by `now`. Returns the command that is sent once too often.
    fn go_wrong(&mut self, now: Ns, out: &mut Outputs) -> Option<Command> {
        let Self { schedule, progress, sender, .. } = self;
        let mut stale = None;
        schedule.advance(progress, now, |place, _| {
            let entry = &schedule.entries()[place];
            match entry.fault.kind {
                FaultKind::StaleCommand => stale = sender.newest_sent(),
                FaultKind::WrongCommand => sender.interpose(now, entry.fault.amount),
                FaultKind::Gone => {}
                // whoever takes the console down tells of it
                _ => return,
            }
            out.mail.events.push(Event::injected(now, entry.number));
        });
        let gone = schedule.holding(progress).any(|(_, entry)| entry.fault.kind == FaultKind::Gone);
        if gone != self.gone {
            self.gone = gone;
            out.programs.push((self.task, if gone { vec![Op::Decide] } else { self.program() }));
        }
        stale
    }

    /// A console job up to its decision.
    fn program(&self) -> Program {
        vec![self.block(Direction::Read, mailbox::TELEMETRY, size_of::<Telemetry>()), Op::Decide]
    }

    /// An own access has failed. Where nothing on the other side has answered, the adaptor's link status says why.
    fn failed(&mut self, transfer: &TransferRecord, out: &mut Outputs) {
        if transfer.slave == u16::MAX && transfer.task == self.task && !std::mem::replace(&mut self.cut_off, true) {
            let address = transfer.addr.into();
            let event = Event::new(transfer.data_at, EventKind::Detected, Severity::Warn, address, 0.0);
            out.mail.events.push(event.because(Some(Detector::LinkStatus)));
        }
    }

    /// What to send, by what the state block says.
    fn poll(&mut self, now: Ns, block: Option<&Telemetry>) -> Poll {
        let accepted = block.map(|block| block.epoch);
        if let Some(block) = block.filter(|_| std::mem::take(&mut self.rejoins)) {
            self.rejoin(now, block);
        }
        match (self.operator.look(now, block), accepted) {
            (Act::Acknowledge, Some(accepted)) => self.sender.acknowledge(accepted),
            // the first command is written before then
            (Act::GoOn(segment), Some(accepted)) => self.sender.go_on_with(segment, now + self.period, accepted),
            (Act::Wait, _) => return Poll::default(),
            _ => {}
        }
        self.sender.poll(now, accepted)
    }

    /// Goes on behind the last segment that the control computer knows, whoever sent it and whenever it starts. Where it has
    /// lost them in a stop that is over, the task goes on with the segment that was interrupted.
    fn rejoin(&mut self, now: Ns, block: &Telemetry) {
        if block.last != u32::MAX {
            self.sender.go_on_behind(block.last, block.last_start, block.epoch);
        } else if block.segment != u32::MAX && !block.is_stopped() {
            self.sender.go_on_with(block.segment, now + self.period, block.epoch);
        }
    }

    fn decide(&mut self, now: Ns, out: &mut Outputs) {
        let stale = self.go_wrong(now, out);
        let block = self.block.take();
        let poll = if self.gone { Poll::default() } else { self.poll(now, block.as_ref()) };
        let (first, end) = poll.send;
        out.mail.commands.extend_from_slice(&self.sender.commands()[first..end]);
        out.mail.commands.extend(stale);
        let blocks = out.mail.commands.len();
        if blocks != self.written {
            self.written = blocks;
            let write = self.block(Direction::Write, mailbox::COMMAND, size_of::<Command>());
            out.rest = Some(vec![write; self.written]);
        }
        if let Some(epoch) = poll.given_up {
            out.mail.events.push(Event::new(
                now,
                EventKind::MessageLost,
                Severity::Error,
                epoch.into(),
                0.0,
            ));
        }
    }
}

impl Board for Workstation {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if inputs.boot {
            if inputs.until > 0 {
                // started again in a running rack: what has begun before has been told of
                self.schedule.advance(&mut self.progress, inputs.until - 1, |_, _| {});
                self.rejoins = true;
            }
            out.programs.push((self.task, self.program()));
        }
        self.told.tell(inputs.until, &inputs.defects, &mut out.mail.events);
        for transfer in &inputs.transfers {
            self.failed(transfer, out);
        }
        if let Some(telemetry) = inputs.mail.telemetry.last() {
            self.block = Some(*telemetry);
            self.cut_off = false;
        }
        if inputs
            .decision
            .is_some_and(|decision| decision.task == self.task)
        {
            self.decide(inputs.until, out);
        }
    }
}
