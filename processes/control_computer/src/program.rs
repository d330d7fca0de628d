//! What the control tasks ask of the bus: their reads before the decision, their writes after it.
//!
//! A job reads every encoder, the force sensor and the drives' status one after the other, decides, computes, and writes
//! the D/A converters and the output watchdog. The first job also switches the amplifiers on and releases the brakes; one
//! that leaves STO acknowledges the I/O card's own stop before that; a job in STO does the opposite. One list per kind of job gives both the accesses and the words written, so the
//! two cannot differ.
//!
//! Where two cards share the pipeline, the first reads encoders, force sensor and the second card's state word, and writes
//! the hand-over block; the second reads encoders and drives' status, and writes what one card alone would.

use crate::handover;
use messages::registers::{da, encoder, force, mailbox, parallel};
use messages::{BusWord, JOINTS};
use scenario::{ForceFilter, Scenario};
use vme::{Access, Direction, Op, Program, Width};

/// Reads of a job: index of the first count, each followed by its velocity.
pub const COUNTS: usize = 0;
/// Index of the first force word.
pub const FORCES: usize = 2 * JOINTS;
/// Index of the force sample counter.
pub const COUNTER: usize = FORCES + 6;
/// Index of the force sensor's error word.
pub const ERRORS: usize = COUNTER + 1;
/// Index of the drives' status.
pub const STATUS: usize = ERRORS + 1;
/// Index of the first encoder card's status.
pub const CARDS: usize = STATUS + 1;
/// Encoder cards.
const ENCODER_CARDS: usize = JOINTS.div_ceil(encoder::CHANNELS_PER_CARD);
/// Sensor registers in all.
pub const READS: usize = CARDS + ENCODER_CARDS;
/// Processor time from the decision to the first write where nothing has to be computed (STO).
const STOP_EXECUTION_NS: u64 = 20_000;

/// What of the pipeline a card runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Whole,
    /// Trajectory, AHIC, ERC and RR: the first of two cards.
    Law,
    /// Inverse dynamics, safety and D/A: the second.
    Torque,
}

/// What a job does after its decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Torques, with amplifiers switched on and brakes released.
    Start,
    /// The same after a stop, which is acknowledged first.
    Resume,
    /// Torques.
    Run,
    /// Amplifiers off, brakes on, no torque.
    Stop,
}

/// One write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Write {
    Enable(u32),
    Brake(u32),
    Code(usize),
    Heartbeat,
    Acknowledge,
}

const ALL: u32 = (1 << JOINTS) - 1;
const CODES: [Write; JOINTS] = {
    let mut codes = [Write::Heartbeat; JOINTS];
    let mut i = 0;
    while i < JOINTS {
        codes[i] = Write::Code(i);
        i += 1;
    }
    codes
};
const fn around_codes<const N: usize>(mut list: [Write; N], first: usize) -> [Write; N] {
    let mut i = 0;
    while i < JOINTS {
        list[first + i] = CODES[i];
        i += 1;
    }
    list
}
/// Torque before the brakes let go.
const START: [Write; JOINTS + 3] = {
    let mut list = around_codes([Write::Heartbeat; JOINTS + 3], 1);
    list[0] = Write::Enable(ALL);
    list[JOINTS + 2] = Write::Brake(ALL);
    list
};
const RESUME: [Write; JOINTS + 4] = {
    let mut list = [Write::Acknowledge; JOINTS + 4];
    let mut i = 0;
    while i < START.len() {
        list[i + 1] = START[i];
        i += 1;
    }
    list
};
const RUN: [Write; JOINTS + 1] = around_codes([Write::Heartbeat; JOINTS + 1], 0);
/// What takes the energy out comes first.
const STOP: [Write; JOINTS + 3] = {
    let mut list = around_codes([Write::Heartbeat; JOINTS + 3], 2);
    list[0] = Write::Enable(0);
    list[1] = Write::Brake(0);
    list
};

impl Rest {
    fn writes(self) -> &'static [Write] {
        match self {
            Rest::Start => &START,
            Rest::Resume => &RESUME,
            Rest::Run => &RUN,
            Rest::Stop => &STOP,
        }
    }
}

/// Addresses of every register that a control task uses, and its processor times.
#[derive(Clone, Debug)]
pub struct BusProgram {
    /// Sensor registers by number, in the order of the accesses.
    sensors: Vec<usize>,
    reads: Vec<Access>,
    codes: [Access; JOINTS],
    enable: Access,
    brake: Access,
    heartbeat: Access,
    acknowledge: Access,
    entry_ns: u64,
    execution_ns: u64,
    /// First address of the telemetry block in this board's dual-ported RAM.
    pub telemetry: u32,
    /// First address of the command block.
    pub command: u32,
    /// The hand-over block and the state word in the second card's RAM, where there is one.
    pub second: Option<[Access; 2]>,
}

impl BusProgram {
    /// Of this part of the pipeline in the scenario's rack. The message names the card that is missing.
    pub fn new(scenario: &Scenario, part: Part) -> Result<BusProgram, String> {
        let register = |card: &str, offset: u32, width: Width, dir: Direction| {
            let slave = scenario
                .rack
                .slaves
                .iter()
                .find(|slave| slave.name == card)
                .ok_or_else(|| format!("the rack has no card `{card}`"))?;
            Ok::<Access, String>(Access { am: slave.am, addr: slave.base + offset, width, dir, n: 1 })
        };
        let (read, write) = (Direction::Read, Direction::Write);
        // an idealised receiver of more than 16 bits has words, and strides, of twice the size
        let (word, stride) = if is_wide(scenario) { (Width::D32, 2) } else { (Width::D16, 1) };
        let filter = match scenario.force_sensor_if.filter {
            ForceFilter::Cascade(n) => u32::from(n),
            ForceFilter::DelayMs(_) => 0,
        };
        let force_word = |offset: u32| register("force-sensor", stride * offset, word, Direction::Read);
        let status = register("parallel-io", parallel::INPUT, Width::D32, read)?;
        let mut registers = [status; READS];
        let mut codes = [status; JOINTS];
        for (joint, code) in codes.iter_mut().enumerate() {
            let card = format!("encoder-{}", joint / encoder::CHANNELS_PER_CARD + 1);
            let channel = encoder::CHANNEL * (joint % encoder::CHANNELS_PER_CARD) as u32;
            let at = COUNTS + 2 * joint;
            registers[at] = register(&card, channel + encoder::COUNT, Width::D32, read)?;
            registers[at + 1] = register(&card, channel + encoder::VELOCITY, Width::D32, read)?;
            let card = format!("da-{}", joint / da::CHANNELS_PER_CARD + 1);
            let channel = (joint % da::CHANNELS_PER_CARD) as u32;
            *code = register(&card, da::code(channel), Width::D32, write)?;
        }
        for axis in 0..6 {
            registers[FORCES + axis] = force_word(force::filter(filter) + 2 * axis as u32)?;
        }
        for card in 0..ENCODER_CARDS {
            let name = format!("encoder-{}", card + 1);
            registers[CARDS + card] = register(&name, encoder::CARD_STATUS, Width::D32, read)?;
        }
        registers[COUNTER] = force_word(force::counter(filter))?;
        registers[ERRORS] = force_word(force::ERRORS)?;
        let second = match scenario.second_control_task() {
            Some(task) => {
                let card = &scenario.rack.tasks[usize::from(task)].processor;
                let ram = scenario.rack.slaves.iter().find(|slave| slave.card() == card && slave.adaptor.is_none());
                let ram =
                    &ram.ok_or_else(|| format!("processor card `{card}` has no dual-ported RAM on the bus"))?.name;
                let block = register(ram, mailbox::HANDOVER, Width::D32, write)?;
                let block = Access { n: handover::LONGWORDS, ..block };
                Some([block, register(ram, mailbox::STATE, Width::D32, read)?])
            }
            None => None,
        };
        let sensors: Vec<usize> = match part {
            Part::Whole => (0..READS).collect(),
            Part::Law => (0..STATUS).chain(CARDS..READS).collect(),
            Part::Torque => (0..FORCES).chain([STATUS]).collect(),
        };
        let mut reads: Vec<Access> = sensors.iter().map(|&register| registers[register]).collect();
        let controller = &scenario.controller;
        let (mut entry_us, mut execution_us) = (controller.entry_us, controller.execution_us);
        match (part, second) {
            (Part::Law, Some([_, state])) => reads.push(state),
            (Part::Torque, _) => {
                (entry_us, execution_us) = (controller.second_card.entry_us, controller.second_card.execution_us);
            }
            _ => {}
        }
        let ram = register("cpu-1-dpram", 0, Width::D32, read)?.addr;
        Ok(BusProgram {
            sensors,
            reads,
            codes,
            enable: register("parallel-io", parallel::ENABLE, Width::D32, write)?,
            brake: register("parallel-io", parallel::BRAKE, Width::D32, write)?,
            heartbeat: register("parallel-io", parallel::WATCHDOG, Width::D32, write)?,
            acknowledge: register("parallel-io", parallel::WATCHDOG_STATUS, Width::D32, write)?,
            entry_ns: scenario::nanoseconds(entry_us * 1e-6),
            execution_ns: scenario::nanoseconds(execution_us * 1e-6),
            telemetry: ram + mailbox::TELEMETRY,
            command: ram + mailbox::COMMAND,
            second,
        })
    }

    /// A job up to its decision.
    pub fn until_decision(&self) -> Program {
        let mut program = vec![Op::Exec(self.entry_ns)];
        program.extend(self.reads.iter().copied().map(Op::Access));
        program.push(Op::Decide);
        program
    }

    /// A job from its decision on.
    pub fn after_decision(&self, rest: Rest) -> Program {
        let mut program = vec![Op::Exec(self.execution_ns(rest))];
        let accesses = rest.writes().iter().map(|&write| self.access(write));
        program.extend(accesses.map(Op::Access));
        program
    }

    /// A job of the first of two cards from its decision on.
    pub fn hand_over(&self) -> Program {
        let block = self.second.map(|[block, _]| Op::Access(block));
        [Op::Exec(self.execution_ns)].into_iter().chain(block).collect()
    }

    /// Sensor registers that the task reads, by number, in the order of its accesses.
    pub fn sensors(&self) -> &[usize] {
        &self.sensors
    }

    /// Processor time from the decision to the first write, ns.
    pub fn execution_ns(&self, rest: Rest) -> u64 {
        match rest {
            Rest::Stop => STOP_EXECUTION_NS,
            Rest::Start | Rest::Resume | Rest::Run => self.execution_ns,
        }
    }

    /// The words that the job's writes carry.
    pub fn words(&self, rest: Rest, task: u16, job: u32, codes: &[u32; JOINTS], out: &mut Vec<BusWord>) {
        for (i, &write) in rest.writes().iter().enumerate() {
            out.push(BusWord {
                t: 0,
                addr: self.access(write).addr,
                value: match write {
                    Write::Enable(bits) | Write::Brake(bits) => bits,
                    Write::Code(joint) => codes[joint],
                    Write::Heartbeat => job,
                    Write::Acknowledge => parallel::ACKNOWLEDGE,
                },
                job,
                task,
                index: (self.reads.len() + i) as u16,
            });
        }
    }

    fn access(&self, write: Write) -> Access {
        match write {
            Write::Enable(_) => self.enable,
            Write::Brake(_) => self.brake,
            Write::Code(joint) => self.codes[joint],
            Write::Heartbeat => self.heartbeat,
            Write::Acknowledge => self.acknowledge,
        }
    }
}

/// Whether the force sensor's words have 32 bits.
pub fn is_wide(scenario: &Scenario) -> bool {
    scenario.force_sensor_if.full_scale_counts > 32768.0
}
