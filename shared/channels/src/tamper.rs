//! What a fault plan does to messages between sender and receiver.
//!
//! Every reader has its own copy of each message and its own random streams, so what befalls a message depends on the seed,
//! its sender, its reader and its number alone: not on where boards are placed.

use crate::frame::Frame;
use board::BoardId;
use messages::Ns;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Random streams of faults of messages begin here.
const STREAM: u64 = 1 << 34;
/// Words of a stream that belong to one message: each bit to flip takes two.
const WORDS: u128 = 128;

/// The faults of messages of a run.
#[derive(Clone, Debug, Default)]
pub struct Tampering {
    /// Seed of all draws.
    pub seed: u64,
    /// How long a message may be on its way, ns.
    pub max_age: Ns,
    /// The faults.
    pub faults: Vec<Tamper>,
}

/// One fault of one board's messages over the bus.
#[derive(Clone, Debug)]
pub struct Tamper {
    /// Number of the fault: its random stream.
    pub number: usize,
    /// Whose messages it befalls.
    pub from: BoardId,
    /// What it does.
    pub kind: TamperKind,
    /// It holds in each of these, `[from, until)`.
    pub holds: Vec<(Ns, Ns)>,
}

/// What is done to a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TamperKind {
    /// It comes so much later, ns.
    Delay(Ns),
    /// It comes up to so much later, ns.
    Jitter(Ns),
    /// It gets lost with this probability.
    Drop(f64),
    /// It comes twice.
    Duplicate,
    /// Every second one comes after the one that follows it.
    Reorder,
    /// So many of its bits are flipped.
    BitFlip(u32),
}

/// The way of one channel's messages to one board.
#[derive(Debug)]
pub(crate) struct Way {
    faults: Vec<(Tamper, ChaCha8Rng)>,
    /// The message that the next one overtakes.
    overtaken: Option<Underway>,
    /// In the order in which they come.
    underway: Vec<Underway>,
}

/// A message on its way.
#[derive(Debug)]
pub(crate) struct Underway {
    pub frame: Frame,
    /// When it comes, ns.
    due: Ns,
    /// How long it was on its way, ns.
    pub took: Ns,
}

impl Tampering {
    /// Whether a fault is planned for messages of that board.
    pub(crate) fn touches(&self, from: BoardId) -> bool {
        self.faults.iter().any(|fault| fault.from == from)
    }

    /// The way from one board to another.
    pub(crate) fn way(&self, from: BoardId, to: BoardId) -> Way {
        let faults = self.faults.iter().filter(|fault| fault.from == from).map(|fault| {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(STREAM + ((fault.number as u64) << 8 | to as u64));
            (fault.clone(), rng)
        });
        Way { faults: faults.collect(), overtaken: None, underway: Vec::new() }
    }
}

impl Way {
    /// A message is sent, at the time in its header.
    pub fn send(&mut self, mut frame: Frame) {
        let (sent, seq) = (frame.header.t, frame.header.seq);
        let (mut late, mut lost, mut twice, mut swaps) = (None, false, false, false);
        for (fault, rng) in &mut self.faults {
            if !fault.holds.iter().any(|(from, until)| (*from..*until).contains(&sent)) {
                continue;
            }
            // so that no draw depends on how many messages the reader has seen
            rng.set_word_pos(u128::from(seq) * WORDS);
            // in (0, 1]
            let mut uniform = || ((rng.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64;
            match fault.kind {
                TamperKind::Delay(by) => *late.get_or_insert(0) += by,
                TamperKind::Jitter(by) => *late.get_or_insert(0) += (uniform() * by as f64) as Ns,
                TamperKind::Drop(probability) => lost |= uniform() <= probability,
                TamperKind::Duplicate => twice = true,
                TamperKind::Reorder => swaps = true,
                TamperKind::BitFlip(bits) => {
                    for _ in 0..bits {
                        let bit = rng.next_u64() % frame.bits() as u64;
                        frame.flip(bit as usize);
                    }
                }
            }
        }
        // what nothing delays keeps its order, even where a window is run again
        let before = self.underway.iter().filter(|other| other.took == 0).map(|other| other.due).max();
        let due = late.map_or(sent.max(before.unwrap_or(0)), |late| sent + late);
        let message = Underway { frame, due, took: late.unwrap_or(0) };
        if lost {
            return;
        }
        match self.overtaken.take() {
            None if swaps => self.overtaken = Some(message),
            overtaken => {
                if twice {
                    self.put(Underway { frame: message.frame.clone(), ..message });
                }
                self.put(message);
                if let Some(overtaken) = overtaken {
                    self.put(Underway { due: overtaken.due.max(due), ..overtaken });
                }
            }
        }
    }

    /// Everything on its way is lost.
    pub fn clear(&mut self) {
        self.overtaken = None;
        self.underway.clear();
    }

    fn put(&mut self, message: Underway) {
        let at = self.underway.partition_point(|other| other.due <= message.due);
        self.underway.insert(at, message);
    }

    /// The next message that has come by `now`; one that nothing delays is there at once.
    pub fn next(&mut self, now: Ns) -> Option<Underway> {
        let has_come = |message: &Underway| message.took == 0 || message.due <= now;
        self.underway.first().is_some_and(has_come).then(|| self.underway.remove(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;

    /// Numbers of the messages that come at each of the times at which one is sent, 10 ns apart, and 100 ns after the last.
    fn come(kinds: &[TamperKind], messages: u32) -> Vec<Vec<u32>> {
        let from = BoardId::EncoderIf;
        let faults = (0..).zip(kinds).map(|(number, kind)| Tamper { number, from, kind: *kind, holds: vec![(20, 60)] });
        let tampering = Tampering { seed: 1, max_age: 0, faults: faults.collect() };
        let mut way = tampering.way(from, BoardId::ControlComputer);
        let taken = |way: &mut Way, now| std::iter::from_fn(|| way.next(now)).map(|m| m.frame.header.seq).collect();
        let mut all: Vec<Vec<u32>> = Vec::new();
        for seq in 0..messages {
            let t = 10 * Ns::from(seq);
            way.send(Frame::sealed(Header { t, seq, crc: 0, wall_ns: 0 }, &[seq]));
            all.push(taken(&mut way, t));
        }
        all.push(taken(&mut way, 10 * Ns::from(messages) + 100));
        all
    }

    #[test]
    fn each_kind_does_what_it_says_while_it_holds() {
        let at = |times: &[&[u32]]| times.iter().map(|numbers| numbers.to_vec()).collect::<Vec<_>>();
        use TamperKind::*;
        assert_eq!(come(&[], 3), at(&[&[0], &[1], &[2], &[]]));
        assert_eq!(come(&[Drop(1.0)], 7), at(&[&[0], &[1], &[], &[], &[], &[], &[6], &[]]));
        assert_eq!(come(&[Duplicate], 4), at(&[&[0], &[1], &[2, 2], &[3, 3], &[]]));
        assert_eq!(come(&[Reorder], 7), at(&[&[0], &[1], &[], &[3, 2], &[], &[5, 4], &[6], &[]]));
        assert_eq!(come(&[Delay(15)], 7), at(&[&[0], &[1], &[], &[], &[2], &[3], &[4, 6], &[5]]));
    }

    #[test]
    fn jitter_stays_below_its_bound_and_losses_come_as_often_as_stated() {
        let from = BoardId::EncoderIf;
        let ways = |kind| {
            let tamper = Tamper { number: 0, from, kind, holds: vec![(0, Ns::MAX)] };
            Tampering { seed: 3, max_age: 0, faults: vec![tamper] }.way(from, BoardId::ControlComputer)
        };
        let frame = |seq| Frame::sealed(Header { t: 0, seq, crc: 0, wall_ns: 0 }, &[0u8; 0]);
        let (mut jitter, mut loss) = (ways(TamperKind::Jitter(1000)), ways(TamperKind::Drop(0.3)));
        for seq in 0..10_000 {
            jitter.send(frame(seq));
            loss.send(frame(seq));
        }
        let delays: Vec<Ns> = std::iter::from_fn(|| jitter.next(1000)).map(|message| message.took).collect();
        assert_eq!((delays.len(), delays.is_sorted()), (10_000, true));
        let mean = delays.iter().sum::<Ns>() as f64 / 1e4;
        // four standard deviations: 1000/√12/√10⁴ and √(0.3·0.7·10⁴)
        assert!((mean - 500.0).abs() < 12.0, "{mean}");
        let came = std::iter::from_fn(|| loss.next(0)).count();
        assert!(came.abs_diff(7000) < 184, "{came}");
    }

    #[test]
    fn flipped_bits_are_found_at_the_other_end() {
        let from = BoardId::EncoderIf;
        let tamper = Tamper { number: 0, from, kind: TamperKind::BitFlip(1), holds: vec![(0, Ns::MAX)] };
        let mut way = Tampering { seed: 3, max_age: 0, faults: vec![tamper] }.way(from, BoardId::ControlComputer);
        way.send(Frame::sealed(Header { t: 0, seq: 0, crc: 0, wall_ns: 0 }, &[1u64, 2]));
        assert!(!way.next(0).expect("message").frame.is_sound());
    }
}
