//! What a board's end of a channel checks: CRC-32, sequence number and age of every message.
//!
//! A corrupted message is discarded, so its number is missing when the next one comes. One that comes again or after a
//! later one is discarded too: a channel's content never goes back in time.

use crate::frame::Frame;
use board::BoardId;
use messages::{Defect, DefectKind, Ns};

/// Numbers before the newest one of which is known whether they have come.
const WINDOW: u32 = 64;

/// The checks of one channel at one board.
#[derive(Clone, Debug)]
pub struct Receiver {
    from: BoardId,
    max_age: Ns,
    /// Number expected next, where it is known.
    expected: Option<u32>,
    /// Bit i: number `expected` − 1 − i has come.
    came: u64,
}

impl Receiver {
    /// The end of a channel from that board, on which a message takes `max_age` at most; without a number expected `first`,
    /// the first that comes is right.
    pub fn new(from: BoardId, max_age: Ns, first: Option<u32>) -> Receiver {
        Receiver { from, max_age, expected: first, came: 0 }
    }

    /// Whatever number comes next is right.
    pub fn renew(&mut self) {
        self.expected = None;
    }

    /// Whether a message that was so long on its way is to be used; `found` hears what is wrong.
    pub fn check(&mut self, frame: &Frame, on_its_way: Ns, mut found: impl FnMut(Defect)) -> bool {
        let from = self.from;
        let seq = frame.header.seq;
        let mut tell = |kind, figure| found(Defect { from, kind, figure });
        if !frame.is_sound() {
            tell(DefectKind::Corrupted, seq.into());
            return false;
        }
        let expected = self.expected.unwrap_or(seq);
        let ahead = seq.wrapping_sub(expected) as i32;
        if ahead < 0 {
            let back = expected.wrapping_sub(1).wrapping_sub(seq);
            let again = back < WINDOW && self.came >> back & 1 == 1;
            tell(if again { DefectKind::Repeated } else { DefectKind::Overtaken }, seq.into());
            if back < WINDOW {
                self.came |= 1 << back;
            }
            return false;
        }
        if ahead > 0 {
            tell(DefectKind::Gap, ahead.into());
        }
        self.came = self.came.checked_shl(ahead as u32 + 1).unwrap_or(0) | 1;
        self.expected = Some(seq.wrapping_add(1));
        if on_its_way > self.max_age {
            tell(DefectKind::Late, on_its_way as f64 * 1e-6);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{BusWord, Header};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn receiver() -> Receiver {
        Receiver::new(BoardId::EncoderIf, 1000, Some(0))
    }

    fn frame(seq: u32, words: u32) -> Frame {
        let word = |i: u32| BusWord {
            t: 5_000_000 * u64::from(seq) + 131_000,
            addr: 0x20_0000 + 4 * i,
            value: seq.wrapping_mul(2_654_435_761).wrapping_add(i),
            job: seq,
            task: 0,
            index: i as u16,
        };
        let elements: Vec<BusWord> = (0..words).map(word).collect();
        Frame::sealed(Header { t: 5_000_000 * u64::from(seq), seq, crc: 0, wall_ns: 0 }, &elements)
    }

    /// Whether it is used, and what is found.
    fn check(receiver: &mut Receiver, seq: u32, on_its_way: Ns) -> (bool, Vec<(DefectKind, f64)>) {
        let mut found = Vec::new();
        let used = receiver.check(&frame(seq, 1), on_its_way, |defect| found.push((defect.kind, defect.figure)));
        (used, found)
    }

    #[test]
    fn gaps_repetitions_overtaken_and_late_messages_are_told_apart() {
        use DefectKind::*;
        let mut receiver = receiver();
        assert_eq!(check(&mut receiver, 0, 1000), (true, vec![]));
        assert_eq!(check(&mut receiver, 1, 0), (true, vec![]));
        assert_eq!(check(&mut receiver, 1, 0), (false, vec![(Repeated, 1.0)]));
        assert_eq!(check(&mut receiver, 4, 0), (true, vec![(Gap, 2.0)]));
        assert_eq!(check(&mut receiver, 3, 0), (false, vec![(Overtaken, 3.0)]));
        assert_eq!(check(&mut receiver, 3, 0), (false, vec![(Repeated, 3.0)]));
        assert_eq!(check(&mut receiver, 5, 2_000_000), (true, vec![(Late, 2.0)]));
        assert_eq!(check(&mut receiver, 200, 0), (true, vec![(Gap, 194.0)]));
        assert_eq!(check(&mut receiver, 199, 0), (false, vec![(Overtaken, 199.0)]));
        assert_eq!(check(&mut receiver, 6, 0), (false, vec![(Overtaken, 6.0)]));
    }

    #[test]
    fn a_receiver_that_starts_again_takes_the_first_number_that_comes() {
        let mut receiver = receiver();
        assert_eq!(check(&mut receiver, 0, 0), (true, vec![]));
        receiver.renew();
        assert_eq!(check(&mut receiver, 9, 0), (true, vec![]));
        assert_eq!(check(&mut receiver, 11, 0), (true, vec![(DefectKind::Gap, 1.0)]));
    }

    #[test]
    fn sequence_numbers_go_on_beyond_their_wrap() {
        let mut receiver = Receiver { expected: Some(u32::MAX), came: !0, ..receiver() };
        for seq in [u32::MAX, 0, 1] {
            assert_eq!(check(&mut receiver, seq, 0), (true, vec![]));
        }
        assert_eq!(check(&mut receiver, u32::MAX, 0), (false, vec![(DefectKind::Repeated, u32::MAX.into())]));
    }

    #[test]
    fn a_million_single_double_and_burst_errors_of_messages_are_all_found_and_none_is_used() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        // one reading, a card's two joints, a job's force words, the longest message
        let mut messages: Vec<Frame> = [1, 4, 8, 64].into_iter().map(|words| frame(words, words)).collect();
        let mut receiver = receiver();
        let (mut found, mut used) = (0, 0);
        for draw in 0..1_000_000_u32 {
            let frame = &mut messages[(draw / 3 % 4) as usize];
            let bits = frame.bits();
            let mut below = |n: usize| (rng.next_u64() % n as u64) as usize;
            let mut flips = [0; 32];
            let flipped = match draw % 3 {
                0 => {
                    flips[0] = below(bits);
                    1
                }
                1 => {
                    flips[0] = below(bits);
                    flips[1] = (flips[0] + 1 + below(bits - 1)) % bits;
                    2
                }
                _ => {
                    // both ends of a burst are wrong, what lies between may be
                    let length = 2 + below(31);
                    let start = below(bits - length + 1);
                    let pattern = below(1 << 32) | 1 | 1 << (length - 1);
                    let mut n = 0;
                    for i in (0..length).filter(|i| pattern >> i & 1 == 1) {
                        flips[n] = start + i;
                        n += 1;
                    }
                    n
                }
            };
            flips[..flipped].iter().for_each(|bit| frame.flip(*bit));
            used += u32::from(receiver.check(frame, 0, |defect| {
                found += u32::from(defect.kind == DefectKind::Corrupted);
            }));
            flips[..flipped].iter().for_each(|bit| frame.flip(*bit));
        }
        assert_eq!((found, used), (1_000_000, 0));
        // none of that has moved the number expected
        assert_eq!(check(&mut receiver, 0, 0), (true, vec![]));
    }
}
