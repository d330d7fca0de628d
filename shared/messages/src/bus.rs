//! What bus transfers carry, and the record of their times.

use bytemuck::{Pod, Zeroable};
use vme::{Access, Direction, Status, Transfer, Width};

/// One register content, moved by the transfer (`task`, `job`, `index`).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct BusWord {
    /// Instant at which the register was sampled (read) or changes (write, 0 = as the bus decides), ns.
    pub t: u64,
    /// Byte address on the bus.
    pub addr: u32,
    /// Register content, as many low bits as the cycle is wide.
    pub value: u32,
    /// Activation number of the task.
    pub job: u32,
    /// Index of the task.
    pub task: u16,
    /// Index of the access in the job.
    pub index: u16,
}

/// A [`Transfer`] as plain old data.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct TransferRecord {
    /// Bus requested, ns.
    pub requested: u64,
    /// Bus granted, ns.
    pub granted: u64,
    /// Register sampled or changed, ns.
    pub data_at: u64,
    /// Bus free again, ns.
    pub done: u64,
    /// Byte address of the first cycle.
    pub addr: u32,
    /// Number of cycles.
    pub n: u32,
    /// Activation number of the task.
    pub job: u32,
    /// Index of the task.
    pub task: u16,
    /// Index of the access in the job.
    pub index: u16,
    /// Index of the slave window, `u16::MAX` where none answered.
    pub slave: u16,
    /// Address modifier.
    pub am: u8,
    /// 0 = D8, 1 = D16, 2 = D32.
    pub width: u8,
    /// 0 = read, 1 = write.
    pub dir: u8,
    /// 0 = ok, 1 = BERR*, 2 = access timeout.
    pub status: u8,
    /// Zero.
    pub reserved: [u8; 2],
}

/// No transfer to a card that answers register by register has more cycles.
const MOST_CYCLES: u32 = 1 << 12;

impl From<&Transfer> for TransferRecord {
    fn from(transfer: &Transfer) -> Self {
        TransferRecord {
            requested: transfer.requested,
            granted: transfer.granted,
            data_at: transfer.data_at,
            done: transfer.done,
            addr: transfer.access.addr,
            n: transfer.access.n,
            job: transfer.job,
            task: transfer.task,
            index: transfer.index,
            slave: transfer.slave.unwrap_or(u16::MAX),
            am: transfer.access.am,
            width: match transfer.access.width {
                Width::D8 => 0,
                Width::D16 => 1,
                Width::D32 => 2,
            },
            dir: match transfer.access.dir {
                Direction::Read => 0,
                Direction::Write => 1,
            },
            status: match transfer.status {
                Status::Ok => 0,
                Status::BusError => 1,
                Status::AccessTimeout => 2,
            },
            reserved: [0; 2],
        }
    }
}

impl TransferRecord {
    /// True for a read by the master.
    pub fn is_read(&self) -> bool {
        self.dir == 0
    }

    /// True where a slave answered.
    pub fn is_ok(&self) -> bool {
        self.status == 0
    }

    /// Byte address of each cycle. A transfer that claims more cycles than any card has registers, or goes beyond the end
    /// of the address space, is noise: it ends there.
    pub fn cycles(&self) -> impl Iterator<Item = u32> + use<> {
        let (addr, bytes) = (self.addr, self.access().width.bytes());
        (0..self.n.min(MOST_CYCLES)).map_while(move |cycle| addr.checked_add(cycle * bytes))
    }

    /// The access that was asked for.
    pub fn access(&self) -> Access {
        Access {
            am: self.am,
            addr: self.addr,
            width: match self.width {
                0 => Width::D8,
                1 => Width::D16,
                _ => Width::D32,
            },
            dir: if self.is_read() { Direction::Read } else { Direction::Write },
            n: self.n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vme::program::Origin;

    #[test]
    fn a_transfer_keeps_its_access_as_plain_old_data() {
        let access = Access { am: 0x3D, addr: 0x1234, width: Width::D16, dir: Direction::Write, n: 3 };
        let transfer = Transfer {
            task: 1,
            job: 2,
            index: 3,
            access,
            slave: None,
            requested: 4,
            granted: 5,
            data_at: 6,
            done: 7,
            status: Status::BusError,
            origin: Origin::Program,
            master: 0,
            held_ns: 0,
            posted: false,
            attempt: 0,
        };
        let record = TransferRecord::from(&transfer);
        assert_eq!(record.access(), access);
        assert!(!record.is_ok());
        assert_eq!((record.requested, record.granted, record.data_at, record.done), (4, 5, 6, 7));
        assert_eq!(record.cycles().collect::<Vec<_>>(), [0x1234, 0x1236, 0x1238]);
    }

    #[test]
    fn a_transfer_of_absurd_length_ends_with_the_address_space_or_the_largest_card() {
        let absurd = |addr| TransferRecord { addr, n: u32::MAX, width: 2, ..bytemuck::Zeroable::zeroed() };
        assert_eq!(absurd(u32::MAX - 7).cycles().collect::<Vec<_>>(), [u32::MAX - 7, u32::MAX - 3]);
        assert_eq!(absurd(0).cycles().count(), MOST_CYCLES as usize);
    }
}
