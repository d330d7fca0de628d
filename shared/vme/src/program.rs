//! Bus programs: what a task asks of its processor and of the bus, and what the bus made of it.

use crate::Ns;

/// Data width of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Width {
    /// Byte.
    D8,
    /// Word.
    #[default]
    D16,
    /// Longword.
    D32,
}

impl Width {
    /// Bytes moved by one cycle.
    pub const fn bytes(self) -> u32 {
        match self {
            Width::D8 => 1,
            Width::D16 => 2,
            Width::D32 => 4,
        }
    }
}

/// Direction of a transfer, seen from the master.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// The master reads a slave's register.
    #[default]
    Read,
    /// The master writes a slave's register.
    Write,
}

/// One transfer that a program asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Address modifier, for example `0x3D` (A24 supervisory data). A block modifier
    /// (`0x3B`, `0x3F`, `0x0B`, `0x0F`) makes a block transfer (BLT) of the `n` cycles;
    /// [`READ_MODIFY_WRITE`] added to it a read-modify-write.
    pub am: u8,
    /// Byte address of the first cycle.
    pub addr: u32,
    /// Data width of each cycle.
    pub width: Width,
    /// Read or write; a read-modify-write is a write that reads first.
    pub dir: Direction,
    /// Number of cycles: 1 for a single cycle, more for a block transfer or a run of single cycles,
    /// 0 for an address-only cycle (AS* without DS*, noticed by location monitors alone).
    pub n: u32,
}

/// Added to the six bits of an address modifier: the cycle reads and writes under one AS*, and nobody
/// comes between. No AM line carries it.
pub const READ_MODIFY_WRITE: u8 = 0x80;

impl Access {
    /// Whether it reads and writes in one cycle.
    pub const fn reads_and_modifies(&self) -> bool {
        self.am & READ_MODIFY_WRITE != 0
    }

    /// Whether it moves no data.
    pub const fn is_address_only(&self) -> bool {
        self.n == 0
    }

    /// Whether the master waits for a slave's data.
    pub const fn awaits_data(&self) -> bool {
        !self.is_address_only() && (matches!(self.dir, Direction::Read) || self.reads_and_modifies())
    }
}

/// One operation of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// Uses the processor for this long.
    Exec(Ns),
    /// Transfers over the bus; the processor is stalled meanwhile.
    Access(Access),
    /// Raises the interrupt request of this level (the processor card's own interrupter).
    Raise(u8),
    /// The data read so far are complete: the board decides what the rest of the job does.
    Decide,
}

/// What a task does in one job (activation).
pub type Program = Vec<Op>;

/// How a transfer ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// DTACK*: the slave answered.
    Ok,
    /// BERR*: no slave answered before the bus timer, or an adaptor's link refused.
    BusError,
    /// The bus was not granted before the access timer.
    AccessTimeout,
}

/// Why a transfer took place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// An access of a task's program.
    Program,
    /// An access of a task's program once more ([`crate::FaultKind::RepeatedRead`]); it moves the same data.
    Repeat,
    /// A task looks whether its event has come ([`crate::rack::Release::Poll`]).
    Poll,
    /// Interrupt acknowledge cycle of a handler.
    Iack,
    /// A handler's write that makes a RORA interrupter release its request.
    InterruptRelease,
    /// Background traffic; `task` counts [`crate::rack::Rack::traffic`].
    Traffic,
}

/// One transfer as the bus carried it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// Index of the task that asked, in [`crate::rack::Rack::tasks`] (see [`Origin`] for others).
    pub task: u16,
    /// Activation number of the task, from 0.
    pub job: u32,
    /// Index of this access among the accesses of the job, from 0, before and after the decision.
    /// A retry after BERR* carries the same index.
    pub index: u16,
    /// What was asked for.
    pub access: Access,
    /// Index of the slave in [`crate::rack::Rack::slaves`]; `None` where no window matches.
    pub slave: Option<u16>,
    /// Bus requested.
    pub requested: Ns,
    /// Bus granted.
    pub granted: Ns,
    /// A read: the instant at which the slave's register is sampled. A write: the instant at which it
    /// changes. An error: the instant of BERR*.
    pub data_at: Ns,
    /// The bus is free again.
    pub done: Ns,
    /// How it ended.
    pub status: Status,
    /// Why it took place.
    pub origin: Origin,
    /// Master on the bus, as [`crate::Timing::master_name`] counts.
    pub master: u16,
    /// Time that the bus was kept from others for it: arbitration and cycles.
    pub held_ns: Ns,
    /// The processor went on before the cycle ran; an error reached it late, as an interrupt.
    pub posted: bool,
    /// 0 at first, one more for each retry after BERR*.
    pub attempt: u8,
}
