//! The workstation as a board of the rack: one console task that polls and commands.
//!
//! Each job reads the state block, decides, and writes a command block for every segment that starts within two polls
//! and a margin. A state block that did not come (the bus or the link failed) leaves everything as it is until the next.

use crate::commands;
use crate::sender::Sender;
use board::{Board, Inputs, Outputs};
use messages::registers::mailbox;
use messages::{Command, Event, EventKind, Severity, Telemetry};
use scenario::Scenario;
use vme::{Access, Direction, MILLISECOND, Ns, Op, Width};

/// How much earlier than two polls ahead a command is sent.
const MARGIN: Ns = 50 * MILLISECOND;

/// The workstation.
pub struct Workstation {
    task: u16,
    /// Address modifier and base of the control computer's dual-ported RAM.
    mailbox: (u8, u32),
    sender: Sender,
    /// Epoch accepted last, as the state block of this job says.
    accepted: Option<u32>,
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
            accepted: None,
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

    fn decide(&mut self, now: Ns, out: &mut Outputs) {
        let poll = self.sender.poll(now, self.accepted.take());
        let (first, end) = poll.send;
        out.mail
            .commands
            .extend_from_slice(&self.sender.commands()[first..end]);
        if end - first != self.written {
            self.written = end - first;
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
            let read = self.block(Direction::Read, mailbox::TELEMETRY, size_of::<Telemetry>());
            out.programs.push((self.task, vec![read, Op::Decide]));
        }
        if let Some(telemetry) = inputs.mail.telemetry.last() {
            self.accepted = Some(telemetry.epoch);
        }
        if inputs
            .decision
            .is_some_and(|decision| decision.task == self.task)
        {
            self.decide(inputs.until, out);
        }
    }
}
