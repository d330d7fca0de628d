//! What the chassis tells a board to do, and what the board answers. No payload travels here.

use bytemuck::{Pod, Zeroable};
use vme::{Access, Direction, Op, Width};

/// Permission to carry on to `until`. The bus transfers made to the board follow as
/// [`crate::TransferRecord`]s.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Grant {
    /// Number of the window, from 0; a window that is run again keeps its number.
    pub window: u64,
    /// Start of the window, ns.
    pub from: u64,
    /// End of the window, ns.
    pub until: u64,
    /// A [`crate::BoardId`] by number.
    pub board: u32,
    /// Bits of [`flags`].
    pub flags: u32,
    /// Task that stands at its decision point at `until`, where [`flags::DECIDE`] is set.
    pub task: u32,
    /// Its activation number.
    pub job: u32,
    /// Bell to ring when the board has acted; [`NOBODY`] = none.
    pub next: u32,
    /// Number of the turn in which the board acts, where [`flags::TURN`] is set; void once a later one is due.
    pub turn: u32,
}

/// No bell is rung after the board has acted.
pub const NOBODY: u32 = u32::MAX;

/// Bits of [`Grant::flags`] and [`Reply::flags`].
pub mod flags {
    /// Grant: first step, at time 0; boards show their initial state and programs.
    pub const BOOT: u32 = 1;
    /// Grant: a task of this board decides at `until`.
    pub const DECIDE: u32 = 2;
    /// Grant: the plant cut the window short: go back to the state at `from` and step again.
    pub const RERUN: u32 = 4;
    /// Grant: the run ends here; write out what is pending.
    pub const FINISH: u32 = 8;
    /// Grant: real time. First with `from` 0: get ready, and answer; then simulated time 0 is when CLOCK_MONOTONIC shows
    /// `from` ns, not answered.
    pub const START: u32 = 128;
    /// Grant: to be acted on in its turn. A board that has nothing to say hands the turn on, and that is its answer; one
    /// that has, replies, and rings for the chassis.
    pub const TURN: u32 = 256;
    /// Grant: the chassis is rung, too.
    pub const TELL: u32 = 512;
    /// Grant: the window is not measured, in a run that otherwise is.
    pub const UNMEASURED: u32 = 1024;
    /// Reply: the operations that follow, up to the first [`super::OpRecord::of_task`], are the rest of the job; otherwise
    /// the last rest is used again.
    pub const NEW_REST: u32 = 16;
    /// Reply: the plant stopped early, at [`Reply::early`].
    pub const EARLY: u32 = 32;
}

/// A board's answer to a grant. Operations follow as [`OpRecord`]s: a new rest, then programs of tasks, each behind an
/// [`OpRecord::of_task`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Reply {
    /// Number of the window answered.
    pub window: u64,
    /// Where the plant stopped, ns, where [`flags::EARLY`] is set.
    pub early: u64,
    /// A [`crate::BoardId`] by number.
    pub board: u32,
    /// Bits of [`flags`].
    pub flags: u32,
}

/// An [`Op`] as plain old data.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct OpRecord {
    /// Duration of Exec, ns; interrupt level of Raise.
    pub ns: u64,
    /// Byte address of an access.
    pub addr: u32,
    /// Number of cycles of an access.
    pub n: u32,
    /// 0 = Exec, 1 = read, 2 = write, 3 = Raise, 4 = Decide, 5 = no operation: the ones that follow are of task `n`.
    pub kind: u32,
    /// Address modifier in the low byte, width (0 = D8, 1 = D16, 2 = D32) in the next.
    pub am_width: u32,
}

impl From<Op> for OpRecord {
    fn from(op: Op) -> OpRecord {
        let empty = OpRecord::zeroed();
        match op {
            Op::Exec(ns) => OpRecord { ns, ..empty },
            Op::Access(access) => OpRecord {
                addr: access.addr,
                n: access.n,
                kind: if access.dir == Direction::Read { 1 } else { 2 },
                am_width: u32::from(access.am)
                    | match access.width {
                        Width::D8 => 0,
                        Width::D16 => 1,
                        Width::D32 => 2,
                    } << 8,
                ..empty
            },
            Op::Raise(level) => OpRecord { ns: level.into(), kind: 3, ..empty },
            Op::Decide => OpRecord { kind: 4, ..empty },
        }
    }
}

impl OpRecord {
    const TASK: u32 = 5;

    /// The operations behind this record are the program of that task.
    pub fn of_task(task: u16) -> OpRecord {
        OpRecord { kind: OpRecord::TASK, n: task.into(), ..OpRecord::zeroed() }
    }

    /// The task whose program follows, where this record is no operation.
    pub fn task(&self) -> Option<u16> {
        (self.kind == OpRecord::TASK).then_some(self.n as u16)
    }

    /// The operation; `None` where a board sent something that is none.
    pub fn op(&self) -> Option<Op> {
        let access = |dir| {
            Some(Op::Access(Access {
                am: self.am_width as u8,
                addr: self.addr,
                width: match self.am_width >> 8 {
                    0 => Width::D8,
                    1 => Width::D16,
                    2 => Width::D32,
                    _ => return None,
                },
                dir,
                n: self.n,
            }))
        };
        match self.kind {
            0 => Some(Op::Exec(self.ns)),
            1 => access(Direction::Read),
            2 => access(Direction::Write),
            3 => Some(Op::Raise(self.ns as u8)),
            4 => Some(Op::Decide),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_survive_the_way_through_shared_memory() {
        let access = Access { am: 0x39, addr: 0xFFFF_0001, width: Width::D16, dir: Direction::Write, n: 64 };
        for op in [Op::Exec(5), Op::Access(access), Op::Raise(7), Op::Decide] {
            assert_eq!(OpRecord::from(op).op(), Some(op));
        }
        assert_eq!(OpRecord { kind: 9, ..OpRecord::zeroed() }.op(), None);
        let of_task = OpRecord::of_task(3);
        assert_eq!((of_task.task(), of_task.op()), (Some(3), None));
    }
}
