//! The bus program: which registers a job reads and writes, in which order.

use messages::JOINTS;
use messages::registers::{da, encoder, parallel};
use scenario::Scenario;
use vme::{Access, Direction, Op, Program, Width};

/// Addresses of the registers used, in the order of the accesses.
pub struct Registers {
    /// Count and velocity of each joint in turn.
    pub reads: Vec<u32>,
    /// Amplifiers on, seven codes, heartbeat, brakes released.
    pub writes: Vec<u32>,
    am: u8,
}

impl Registers {
    /// Of this scenario's rack. The message names the card that is missing.
    pub fn new(scenario: &Scenario) -> Result<Registers, String> {
        let base = |card: String| scenario.card_base(&card).ok_or(format!("the rack has no card `{card}`"));
        let am = scenario.rack.slaves.iter().find(|slave| slave.name == "parallel-io").map_or(0x3D, |slave| slave.am);
        let io = base("parallel-io".into())?;
        let (mut reads, mut writes) = (Vec::new(), vec![io + parallel::ENABLE]);
        for joint in 0..JOINTS {
            let channel = joint % encoder::CHANNELS_PER_CARD;
            let card = base(format!("encoder-{}", joint / encoder::CHANNELS_PER_CARD + 1))?
                + encoder::CHANNEL * channel as u32;
            reads.extend([card + encoder::COUNT, card + encoder::VELOCITY]);
            let card = base(format!("da-{}", joint / da::CHANNELS_PER_CARD + 1))?;
            writes.push(card + da::code((joint % da::CHANNELS_PER_CARD) as u32));
        }
        writes.extend([io + parallel::WATCHDOG, io + parallel::BRAKE]);
        Ok(Registers { reads, writes, am })
    }

    fn access(&self, addr: u32, dir: Direction) -> Op {
        Op::Access(Access { am: self.am, addr, width: Width::D32, dir, n: 1 })
    }

    /// A job up to its decision.
    pub fn until_decision(&self) -> Program {
        let reads = self.reads.iter().map(|addr| self.access(*addr, Direction::Read));
        std::iter::once(Op::Exec(100_000)).chain(reads).chain([Op::Decide]).collect()
    }

    /// A job from its decision on, after 300 µs of computation.
    pub fn after_decision(&self) -> Program {
        let writes = self.writes.iter().map(|addr| self.access(*addr, Direction::Write));
        std::iter::once(Op::Exec(300_000)).chain(writes).collect()
    }
}
