//! Bus programs: what a task asks of its processor and of the bus, and what the bus made of it.

use crate::Ns;

/// Data width of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Width {
    /// Byte.
    D8,
    /// Word.
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The master reads a slave's register.
    Read,
    /// The master writes a slave's register.
    Write,
}

/// One transfer that a program asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Address modifier, for example `0x3D` (A24 supervisory data).
    pub am: u8,
    /// Byte address of the first cycle.
    pub addr: u32,
    /// Data width of each cycle.
    pub width: Width,
    /// Read or write.
    pub dir: Direction,
    /// Number of cycles: 1 for a single cycle, more for a block transfer (BLT).
    pub n: u32,
}

/// One operation of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// Uses the processor for this long.
    Exec(Ns),
    /// Transfers over the bus; the processor is stalled meanwhile.
    Access(Access),
    /// Raises the interrupt request of this level.
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
    /// BERR*: no slave answered before the bus timer.
    BusError,
    /// The bus was not granted before the access timer.
    AccessTimeout,
}

/// One transfer as the bus carried it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// Index of the task that asked, in [`crate::rack::Rack::tasks`].
    pub task: u16,
    /// Activation number of the task, from 0.
    pub job: u32,
    /// Index of this access among the accesses of the job, from 0, before and after the decision.
    pub index: u16,
    /// What was asked for.
    pub access: Access,
    /// Index of the slave in [`crate::rack::Rack::slaves`]; `None` where no window matches.
    pub slave: Option<u16>,
    /// Bus requested.
    pub requested: Ns,
    /// Bus granted.
    pub granted: Ns,
    /// A read: the instant at which the slave's register is sampled. A write: the instant at which it changes.
    pub data_at: Ns,
    /// The bus is free again.
    pub done: Ns,
    /// How it ended.
    pub status: Status,
}
