//! What the control task asks of the bus: its reads before the decision, its writes after it.
//!
//! A job reads every encoder, the force sensor and the drives' status one after the other, decides, computes, and writes
//! the D/A converters and the output watchdog. The first job after a stop also switches the amplifiers on and releases the
//! brakes; a job in STO does the opposite. One list per kind of job gives both the accesses and the words written, so the
//! two cannot differ.

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
/// Reads in a job.
pub const READS: usize = STATUS + 1;
/// Processor time from the decision to the first write where nothing has to be computed (STO).
const STOP_EXECUTION_NS: u64 = 20_000;

/// What a job does after its decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Torques, with amplifiers switched on and brakes released.
    Start,
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
            Rest::Run => &RUN,
            Rest::Stop => &STOP,
        }
    }
}

/// Addresses of every register that the control task uses, and its processor times.
#[derive(Clone, Debug)]
pub struct BusProgram {
    reads: [Access; READS],
    codes: [Access; JOINTS],
    enable: Access,
    brake: Access,
    heartbeat: Access,
    entry_ns: u64,
    execution_ns: u64,
    /// First address of the telemetry block in this board's dual-ported RAM.
    pub telemetry: u32,
    /// First address of the command block.
    pub command: u32,
}

impl BusProgram {
    /// Of this scenario's rack. The message names the card that is missing.
    pub fn new(scenario: &Scenario) -> Result<BusProgram, String> {
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
        let mut reads = [status; READS];
        let mut codes = [status; JOINTS];
        for (joint, code) in codes.iter_mut().enumerate() {
            let card = format!("encoder-{}", joint / encoder::CHANNELS_PER_CARD + 1);
            let channel = encoder::CHANNEL * (joint % encoder::CHANNELS_PER_CARD) as u32;
            let at = COUNTS + 2 * joint;
            reads[at] = register(&card, channel + encoder::COUNT, Width::D32, read)?;
            reads[at + 1] = register(&card, channel + encoder::VELOCITY, Width::D32, read)?;
            let card = format!("da-{}", joint / da::CHANNELS_PER_CARD + 1);
            let channel = (joint % da::CHANNELS_PER_CARD) as u32;
            *code = register(&card, da::code(channel), Width::D32, write)?;
        }
        for axis in 0..6 {
            reads[FORCES + axis] = force_word(force::filter(filter) + 2 * axis as u32)?;
        }
        reads[COUNTER] = force_word(force::counter(filter))?;
        reads[ERRORS] = force_word(force::ERRORS)?;
        let ram = register("cpu-1-dpram", 0, Width::D32, read)?.addr;
        Ok(BusProgram {
            reads,
            codes,
            enable: register("parallel-io", parallel::ENABLE, Width::D32, write)?,
            brake: register("parallel-io", parallel::BRAKE, Width::D32, write)?,
            heartbeat: register("parallel-io", parallel::WATCHDOG, Width::D32, write)?,
            entry_ns: scenario::nanoseconds(scenario.controller.entry_us * 1e-6),
            execution_ns: scenario::nanoseconds(scenario.controller.execution_us * 1e-6),
            telemetry: ram + mailbox::TELEMETRY,
            command: ram + mailbox::COMMAND,
        })
    }

    /// A job up to its decision.
    pub fn until_decision(&self) -> Program {
        let mut program = vec![Op::Exec(self.entry_ns)];
        program.extend(self.reads.map(Op::Access));
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

    /// Processor time from the decision to the first write, ns.
    pub fn execution_ns(&self, rest: Rest) -> u64 {
        match rest {
            Rest::Stop => STOP_EXECUTION_NS,
            Rest::Start | Rest::Run => self.execution_ns,
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
                },
                job,
                task,
                index: (READS + i) as u16,
            });
        }
    }

    /// Address of read `index`.
    pub fn read_address(&self, index: usize) -> u32 {
        self.reads[index].addr
    }

    fn access(&self, write: Write) -> Access {
        match write {
            Write::Enable(_) => self.enable,
            Write::Brake(_) => self.brake,
            Write::Code(joint) => self.codes[joint],
            Write::Heartbeat => self.heartbeat,
        }
    }
}

/// Whether the force sensor's words have 32 bits.
pub fn is_wide(scenario: &Scenario) -> bool {
    scenario.force_sensor_if.full_scale_counts > 32768.0
}
