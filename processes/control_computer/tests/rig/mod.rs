//! Cards of the simplest kind around a [`ControlComputer`]: the arm stands still, every read is answered as told, and
//! what the job writes is looked at.

#![allow(dead_code)] // each test file uses its part

use board::{Board, Inputs, Outputs};
use control_computer::ControlComputer;
use messages::registers::{force, parallel};
use messages::{BusWord, Command, CommandKind, Event, EventKind, PathKind, TransferRecord};
use scenario::Scenario;
use vme::{Access, Direction, Ns, Op, Program};

pub const PERIOD: Ns = 5_000_000;
/// Instant of the decision after the release.
pub const DECISION: Ns = 180_000;

pub fn table_5_3() -> Scenario {
    scenario::load("table-5-3", &[]).unwrap().scenario().unwrap()
}

pub struct Rig {
    pub scenario: Scenario,
    pub board: ControlComputer,
    pub reads: Vec<Access>,
    /// Task of the second card and its reads, where there is one.
    pub second: Option<(u16, Vec<Access>)>,
    pub inputs: Inputs,
    pub out: Outputs,
    pub job: u32,
    /// Rest of the jobs, as given last.
    pub rest: Program,
    /// Content of the parallel input register.
    pub status: u32,
    /// Reads that end in BERR*.
    pub failing: Vec<u32>,
    counts: [i32; 7],
}

impl Rig {
    pub fn new(scenario: Scenario) -> Rig {
        let mut board = ControlComputer::new(&scenario).unwrap();
        let drives = scenario.drives().unwrap().each(|drive| drive.counts_per_rad());
        let posture = scenario.initial_posture().unwrap();
        let mut inputs = Inputs { boot: true, ..Inputs::default() };
        let mut out = Outputs::default();
        board.step(0, &inputs, &mut out);
        inputs.boot = false;
        let second = (out.programs.len() == 2).then(|| out.programs.pop().unwrap());
        let (task, program) = out.programs.pop().unwrap();
        assert_eq!(Some(task), scenario.task_of("control_computer"));
        let accesses = |program: &Program| -> Vec<Access> {
            program.iter().filter_map(|op| if let Op::Access(access) = op { Some(*access) } else { None }).collect()
        };
        let reads = accesses(&program);
        assert_eq!(program.last(), Some(&Op::Decide));
        Rig {
            counts: std::array::from_fn(|i| (posture[i] * drives[i]).floor() as i32),
            scenario,
            board,
            reads,
            second: second.map(|(task, program)| (task, accesses(&program))),
            inputs,
            out,
            job: 0,
            rest: Program::new(),
            status: 0,
            failing: Vec::new(),
        }
    }

    fn task(&self) -> u16 {
        self.scenario.task_of("control_computer").unwrap()
    }

    fn content(&self, addr: u32) -> u32 {
        let base = |card: &str| self.scenario.card_base(card).unwrap();
        if addr == base("parallel-io") + parallel::INPUT {
            return self.status;
        }
        if addr == base("force-sensor") + force::counter(0) {
            return (self.now() / 125_000) as u16 as u32;
        }
        for joint in 0..7 {
            let card = base(&format!("encoder-{}", joint / 2 + 1));
            if addr == card + 0x10 * (joint as u32 % 2) {
                return self.counts[joint] as u32;
            }
        }
        0
    }

    /// Instant of the next decision.
    pub fn now(&self) -> Ns {
        Ns::from(self.job) * PERIOD + DECISION
    }

    /// Runs one job; what it gave is in `out`.
    pub fn run(&mut self) {
        self.answer();
        self.step();
        self.finish();
    }

    /// The cards' answers to the job's reads.
    pub fn answer(&mut self) {
        let reads = std::mem::take(&mut self.reads);
        self.answer_to(self.task(), &reads, self.job, self.now());
        self.reads = reads;
    }

    /// The cards' answers to these reads of a job that decides at `now`.
    fn answer_to(&mut self, task: u16, reads: &[Access], job: u32, now: Ns) {
        self.out.clear();
        for (index, access) in (0..).zip(reads) {
            let addr = access.addr;
            // the control computer's own RAM is no card of the rig
            let own = Some(addr & !0xFFFF) == self.scenario.card_base("cpu-2-dpram");
            if self.failing.contains(&addr) {
                let record = TransferRecord { data_at: now - 1000, addr, n: 1, job, task, index, ..bytemuck_zeroed() };
                self.inputs.transfers.push(TransferRecord { width: 2, status: 1, ..record });
            } else if !own {
                let word = BusWord { t: now - 1000, addr, value: self.content(addr), job, task, index };
                self.inputs.mail.words.push(word);
            }
        }
        self.inputs.from = self.inputs.until;
        self.inputs.until = now;
        self.inputs.decision = Some(board::Decision { task, job });
    }

    /// Runs a job of the second card that decides at `now`; what it gave is in `out`.
    pub fn run_second(&mut self, job: u32, now: Ns) {
        let (task, reads) = self.second.clone().unwrap();
        self.answer_to(task, &reads, job, now);
        self.step();
        self.inputs.decision = None;
        self.inputs.mail.clear();
        self.inputs.transfers.clear();
    }

    /// The board's step alone.
    pub fn step(&mut self) {
        self.board.step(self.inputs.until, &self.inputs, &mut self.out);
    }

    /// Takes over what the job gave.
    pub fn finish(&mut self) {
        self.inputs.decision = None;
        self.inputs.mail.clear();
        self.inputs.transfers.clear();
        if let Some(rest) = self.out.rest.take() {
            self.rest = rest;
        }
        self.job += 1;
    }

    /// What the last job wrote, with the accesses that carry it.
    pub fn writes(&self) -> Vec<(u32, u32)> {
        let accesses: Vec<Access> =
            self.rest.iter().filter_map(|op| if let Op::Access(access) = op { Some(*access) } else { None }).collect();
        let words = &self.out.mail.words;
        assert_eq!(words.len(), accesses.len());
        for (i, (word, access)) in words.iter().zip(&accesses).enumerate() {
            assert_eq!((word.addr, word.job), (access.addr, self.job - 1));
            assert_eq!(usize::from(word.index), self.reads.len() + i);
            assert_eq!(access.dir, Direction::Write);
        }
        words.iter().map(|word| (word.addr, word.value)).collect()
    }

    pub fn written(&self, addr: u32) -> Option<u32> {
        self.writes().iter().find(|(a, _)| *a == addr).map(|(_, value)| *value)
    }

    pub fn address(&self, card: &str, offset: u32) -> u32 {
        self.scenario.card_base(card).unwrap() + offset
    }

    pub fn events(&self, kind: EventKind) -> Vec<Event> {
        let events = self.out.mail.events.iter();
        events.filter(|event| event.kind == kind as u32).copied().collect()
    }

    /// A transfer to the board's dual-ported RAM in the coming window.
    pub fn transfer(&mut self, offset: u32, n: u32, dir: u8, status: u8, data_at: Ns) {
        self.inputs.transfers.push(TransferRecord {
            data_at,
            addr: self.address("cpu-1-dpram", offset),
            n,
            width: 2,
            dir,
            status,
            am: 0x3D,
            task: 1,
            ..bytemuck_zeroed()
        });
    }

    /// The workstation posts a command and its write is carried out in the coming window.
    pub fn command(&mut self, command: Command, status: u8) {
        self.inputs.mail.commands.push(command);
        let n = size_of::<Command>() as u32 / 4;
        self.transfer(messages::registers::mailbox::COMMAND, n, 1, status, self.now() - 50_000);
    }
}

fn bytemuck_zeroed() -> TransferRecord {
    bytemuck::Zeroable::zeroed()
}

/// A sound command of this epoch and kind.
pub fn command(epoch: u32, kind: CommandKind) -> Command {
    Command {
        epoch,
        kind: kind as u32,
        segment: epoch - 1,
        path: PathKind::Hold as u32,
        start: 0,
        end: 1_000_000_000,
        move_time: 1_000_000_000,
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        selection: [1.0; 6],
        mass: [100.0; 6],
        damping: [1000.0; 6],
        stiffness: [500.0; 6],
        force: [0.0; 6],
    }
}
