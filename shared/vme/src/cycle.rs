//! Data transfer bus: how long the cycles of an access take, and how they end.
//!
//! A single cycle is address set-up, the slave's answer (DS* to DTACK*) and the end of the handshake.
//! A block transfer sets the address up once per 256-byte block, which no block crosses. A cycle that
//! no slave can answer (no window, too wide, misaligned) ends in BERR* when the bus timer expires.

use crate::Ns;
use crate::program::{Access, Direction, READ_MODIFY_WRITE, Status, Width};
use crate::rack::{Bus, Slave};

/// A block transfer must not cross this boundary.
pub const BLOCK_BYTES: u32 = 256;

/// What the lines AM0–AM5 carry.
const fn lines(am: u8) -> u8 {
    am & !READ_MODIFY_WRITE
}

/// Whether this address modifier asks for a block transfer.
pub const fn is_block(am: u8) -> bool {
    matches!(lines(am), 0x3B | 0x3F | 0x0B | 0x0F)
}

/// The single-cycle modifier of the address space and privilege of `am`.
pub const fn single(am: u8) -> u8 {
    match lines(am) {
        0x3B => 0x39,
        0x3F => 0x3D,
        0x0B => 0x09,
        0x0F => 0x0D,
        am => am,
    }
}

/// Address bits of the space that `am` selects; `None` for a modifier that is not modelled.
pub const fn address_bits(am: u8) -> Option<u32> {
    match lines(am) {
        0x29 | 0x2D => Some(16),
        0x39 | 0x3A | 0x3B | 0x3D | 0x3E | 0x3F => Some(24),
        0x09 | 0x0A | 0x0B | 0x0D | 0x0E | 0x0F => Some(32),
        _ => None,
    }
}

/// Why the bus cannot carry an access as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misfit {
    /// No window of this address modifier holds all its bytes.
    NoSlave,
    /// The slave is narrower than the cycle, and the master does not split.
    TooWide,
    /// The address is no multiple of the width, and the master does not split.
    Misaligned,
}

/// An access as a row of equal cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Slave whose window the first cycle meets.
    pub slave: Option<u16>,
    /// Cycles that the slave answers, after splitting.
    pub good: u32,
    /// Whether a cycle follows that nobody answers.
    pub fails: bool,
    /// Bytes of one cycle.
    pub bytes: u32,
    /// DS* to DTACK* of one cycle.
    pub answer_ns: Ns,
    /// The address is set up once per block.
    pub block: bool,
}

/// Plans an access to the window `slave` (the one that holds `access.addr`, if any). `splits`: the
/// master breaks wide and misaligned cycles into ones that the slave takes.
pub fn plan(bus: &Bus, access: &Access, slave: Option<(u16, &Slave)>, splits: bool) -> Plan {
    let cycles = access.n.max(1);
    let bytes = access.width.bytes();
    let block = is_block(access.am);
    if access.is_address_only() {
        // nobody has to answer: no DS*, no DTACK*
        let slave = slave.map(|(index, _)| index);
        return Plan { slave, good: cycles, fails: false, bytes, answer_ns: 0, block: false };
    }
    let Some((index, window)) = slave else {
        return Plan { slave: None, good: 0, fails: true, bytes, answer_ns: 0, block };
    };
    let (bytes, cycles) = match fit(access, window) {
        Some(Misfit::TooWide | Misfit::Misaligned) if !splits => {
            return Plan { slave: Some(index), good: 0, fails: true, bytes, answer_ns: 0, block };
        }
        Some(Misfit::TooWide | Misfit::Misaligned) => {
            let narrow = split_width(access.addr, window.width.min(access.width)).bytes();
            (narrow, cycles.saturating_mul(bytes / narrow))
        }
        _ => (bytes, cycles),
    };
    let room = (window.size - (access.addr - window.base)) / bytes;
    let answer_ns = match access.dir {
        _ if access.reads_and_modifies() => window.read_ns + bus.handshake_ns + window.write_ns,
        Direction::Write => window.write_ns,
        Direction::Read => window.read_ns,
    };
    Plan { slave: Some(index), good: cycles.min(room), fails: cycles > room, bytes, answer_ns, block }
}

/// The first rule that an access to this window breaks; `None` where it fits.
pub fn fit(access: &Access, window: &Slave) -> Option<Misfit> {
    let bytes = access.width.bytes();
    let end = u64::from(access.addr) + u64::from(access.n.max(1)) * u64::from(bytes);
    if access.is_address_only() {
        None
    } else if access.width > window.width {
        Some(Misfit::TooWide)
    } else if !access.addr.is_multiple_of(bytes) {
        Some(Misfit::Misaligned)
    } else if access.addr < window.base || end > u64::from(window.base) + u64::from(window.size) {
        Some(Misfit::NoSlave)
    } else {
        None
    }
}

/// Widest cycle from `addr` that is aligned and no wider than `width`.
fn split_width(addr: u32, width: Width) -> Width {
    [Width::D32, Width::D16]
        .into_iter()
        .find(|&candidate| candidate <= width && addr.is_multiple_of(candidate.bytes()))
        .unwrap_or(Width::D8)
}

/// One burst: the part of an access that cannot be interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Burst {
    /// Cycles in it, the failing one not counted.
    pub cycles: u32,
    /// From the grant to its last data (or BERR*).
    pub data_ns: Ns,
    /// From the grant to the free bus.
    pub done_ns: Ns,
    /// No burst follows.
    pub last: bool,
    /// How it ended.
    pub status: Status,
}

impl Plan {
    /// The burst after `cycles_done` cycles. `pace_ns` is the least time from cycle to cycle.
    pub fn burst(&self, bus: &Bus, addr: u32, cycles_done: u32, pace_ns: Ns) -> Burst {
        let left = self.good - cycles_done;
        let cycles = if self.block {
            let at = (addr % BLOCK_BYTES + (cycles_done % BLOCK_BYTES) * self.bytes) % BLOCK_BYTES;
            ((BLOCK_BYTES - at) / self.bytes).max(1).min(left)
        } else {
            left.min(1)
        };
        if cycles == 0 {
            let data_ns = bus.address_ns + bus.bus_timer_ns;
            let done_ns = data_ns + bus.handshake_ns;
            return Burst { cycles: 0, data_ns, done_ns, last: true, status: Status::BusError };
        }
        let first = bus.address_ns + self.answer_ns;
        let data_ns = first + Ns::from(cycles - 1) * (bus.handshake_ns + self.answer_ns).max(pace_ns);
        let last = cycles == left && !self.fails;
        // single cycles behind a slow link keep the bus until the link takes the next one
        let done_ns = (data_ns + bus.handshake_ns).max(if self.block || last { 0 } else { pace_ns });
        Burst { cycles, data_ns, done_ns, last, status: Status::Ok }
    }

    /// All bursts of the access, in order.
    pub fn bursts<'a>(&'a self, bus: &'a Bus, addr: u32, pace_ns: Ns) -> impl Iterator<Item = Burst> + 'a {
        let mut next = Some(0);
        std::iter::from_fn(move || {
            let done = next?;
            let burst = self.burst(bus, addr, done, pace_ns);
            next = (!burst.last).then_some(done + burst.cycles);
            Some(burst)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ram() -> Slave {
        Slave {
            name: "ram".into(),
            am: 0x39,
            base: 0x1000,
            size: 0x1000,
            width: Width::D16,
            read_ns: 200,
            write_ns: 150,
            ..Slave::default()
        }
    }

    fn access(am: u8, addr: u32, width: Width, dir: Direction, n: u32) -> Access {
        Access { am, addr, width, dir, n }
    }

    #[test]
    fn a_single_cycle_is_address_plus_answer_plus_handshake() {
        let (bus, ram) = (Bus::default(), ram());
        let read = access(0x39, 0x1000, Width::D16, Direction::Read, 1);
        let burst = plan(&bus, &read, Some((0, &ram)), false).burst(&bus, read.addr, 0, 0);
        assert_eq!((burst.data_ns, burst.done_ns, burst.last), (235, 335, true));
    }

    #[test]
    fn read_modify_write_holds_the_bus_for_both_halves() {
        let (bus, ram) = (Bus::default(), ram());
        let rmw = access(0x39 | READ_MODIFY_WRITE, 0x1000, Width::D16, Direction::Write, 1);
        let burst = plan(&bus, &rmw, Some((0, &ram)), false).burst(&bus, rmw.addr, 0, 0);
        assert_eq!(burst.data_ns, 35 + 200 + 100 + 150);
    }

    #[test]
    fn a_block_transfer_is_cut_at_every_256_bytes() {
        let (bus, ram) = (Bus::default(), ram());
        // 16 bytes before the boundary, then 256, then 8
        let block = access(0x3B, 0x10F0, Width::D16, Direction::Read, (16 + 256 + 8) / 2);
        let plan = plan(&bus, &block, Some((0, &ram)), false);
        let cycles: Vec<u32> = plan.bursts(&bus, block.addr, 0).map(|burst| burst.cycles).collect();
        assert_eq!(cycles, [8, 128, 4]);
        // within a block the address is set up once: 35 + n·(200 + 100)
        assert_eq!(plan.burst(&bus, block.addr, 8, 0).done_ns, 35 + 128 * 300);
        // a slower link sets the pace
        assert_eq!(plan.burst(&bus, block.addr, 8, 400).data_ns, 235 + 127 * 400);
    }

    #[test]
    fn a_miss_ends_in_berr_when_the_bus_timer_expires() {
        let bus = Bus::default();
        let read = access(0x39, 0x9000, Width::D16, Direction::Read, 1);
        let burst = plan(&bus, &read, None, false).burst(&bus, read.addr, 0, 0);
        assert_eq!((burst.status, burst.data_ns), (Status::BusError, 35 + 64_000));
    }

    #[test]
    fn a_block_that_leaves_the_window_fails_at_its_edge() {
        let (bus, ram) = (Bus::default(), ram());
        let read = access(0x39, 0x1FFC, Width::D16, Direction::Read, 5);
        let plan = plan(&bus, &read, Some((0, &ram)), false);
        assert_eq!((plan.good, plan.fails), (2, true));
        assert_eq!(plan.burst(&bus, read.addr, 2, 0).status, Status::BusError);
    }

    #[test]
    fn a_longword_to_a_word_slave_is_split_where_the_master_can_and_fails_where_not() {
        let (bus, ram) = (Bus::default(), ram());
        let wide = access(0x39, 0x1000, Width::D32, Direction::Write, 1);
        assert_eq!(plan(&bus, &wide, Some((0, &ram)), true).good, 2);
        assert_eq!(plan(&bus, &wide, Some((0, &ram)), false).good, 0);
        let odd = access(0x39, 0x1001, Width::D16, Direction::Write, 1);
        let split = plan(&bus, &odd, Some((0, &ram)), true);
        assert_eq!((split.good, split.bytes), (2, 1));
        assert_eq!(fit(&odd, &ram), Some(Misfit::Misaligned));
        assert_eq!(fit(&wide, &ram), Some(Misfit::TooWide));
    }

    #[test]
    fn an_address_only_cycle_needs_no_slave() {
        let bus = Bus::default();
        let ado = access(0x39, 0x9000, Width::D8, Direction::Write, 0);
        let burst = plan(&bus, &ado, None, false).burst(&bus, ado.addr, 0, 0);
        assert_eq!((burst.status, burst.done_ns), (Status::Ok, 135));
    }
}
