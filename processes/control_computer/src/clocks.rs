//! Clocks that drift apart: the board's own against the stamps of the cards that it reads.
//!
//! A card's stamp is younger than the job that reads it by the rest of the job's reads, and by what the bus makes them wait;
//! the least such lag in [`WINDOW`] jobs is free of waiting. Where it moves, a clock drifts: the board's own if all cards
//! say so, else the card's. The clock is then set anew by what it is off.

use scenario::nanoseconds;
use vme::Ns;

/// Jobs over which the least lag is taken.
const WINDOW: u32 = 10;
/// A stamp that is further off is no clock's, ns: one hour.
const FAR: Ns = 3_600_000_000_000;
/// Cards that stamp: encoders, force sensor, D/A and parallel I/O.
pub const CARDS: usize = 3;

/// The comparison.
#[derive(Clone, Debug)]
pub struct Clocks {
    max_error: i64,
    /// What the own clock is ahead, as far as is known.
    own: i64,
    jobs: u32,
    /// When the first window began.
    begin: Option<Ns>,
    cards: [Card; CARDS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Card {
    /// Lag when its clock was set.
    reference: Option<i64>,
    /// Least lag of the window.
    least: Option<i64>,
    /// What its clock is behind, as far as is known.
    behind: i64,
}

impl Clocks {
    /// Nothing compared yet.
    pub fn new(limits: &scenario::Safety) -> Clocks {
        let max_error = nanoseconds(limits.max_clock_error_us * 1e-6) as i64;
        Clocks { max_error, own: 0, jobs: 0, begin: None, cards: Default::default() }
    }

    /// The own clock's time, set by what it is known to be off.
    pub fn corrected(&self, clock: Ns) -> Ns {
        clock.saturating_add_signed(-self.own)
    }

    /// What the cards' clocks are behind, as far as is known, ns.
    pub fn behind(&self) -> [i64; CARDS] {
        self.cards.map(|card| card.behind)
    }

    /// A job at `now` of the corrected clock has read values with these stamps; none where a card did not answer. At the end
    /// of a window in which a clock was found wrong and set: its drift since it was right, parts per million.
    pub fn compare(&mut self, now: Ns, stamps: [Option<Ns>; CARDS]) -> Option<f64> {
        for (card, stamp) in self.cards.iter_mut().zip(stamps) {
            if let Some(stamp) = stamp.filter(|stamp| now.abs_diff(*stamp) < FAR) {
                let lag = now.wrapping_sub(stamp) as i64 - card.behind;
                card.least = Some(card.least.map_or(lag, |least| least.min(lag)));
            }
        }
        let begin = *self.begin.get_or_insert(now);
        self.jobs += 1;
        if self.jobs < WINDOW {
            return None;
        }
        self.jobs = 0;
        let moved = self.cards.each_mut().map(|card| {
            let least = card.least.take()?;
            Some(least - *card.reference.get_or_insert(least))
        });
        let off = |moved: &Option<i64>| moved.filter(|moved| moved.abs() > self.max_error);
        let first = moved.iter().find_map(off)?;
        if moved.iter().flatten().all(|moved| moved.abs() > self.max_error && moved.signum() == first.signum()) {
            self.own += first;
        } else {
            for (card, moved) in self.cards.iter_mut().zip(&moved) {
                card.behind += off(moved).unwrap_or(0);
            }
        }
        self.begin = Some(now);
        Some(first as f64 * 1e6 / now.saturating_sub(begin).max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_that_no_clock_has_are_not_compared() {
        let mut clocks = Clocks::new(&scenario::Safety::default());
        for job in 0..200 {
            let now = 5_000_000 * job;
            let stamps = [Some(u64::MAX), Some(1 << 63), Some((1 << 63) - 1 + job)];
            assert_eq!(clocks.compare(now, stamps), None);
            assert_eq!(clocks.corrected(now), now);
        }
    }

    /// Jobs of 5 ms for 4 s; the own clock and the cards' gain so many ppm from 1 s on. When a clock is found wrong, and its
    /// drift; and how far the own clock is off at the end.
    fn run(own_ppm: f64, cards_ppm: [f64; CARDS]) -> (Vec<(f64, f64)>, i64) {
        let mut clocks = Clocks::new(&scenario::Safety::default());
        let show = |t: Ns, ppm: f64| t + (t.saturating_sub(1_000_000_000) as f64 * ppm * 1e-6) as Ns;
        let mut found = Vec::new();
        let mut off = 0;
        for job in 0..800 {
            let t = 5_000_000 * job + 150_000;
            // the bus makes a job wait now and then
            let wait = if job % 3 == 0 { 90_000 } else { 0 };
            let now = clocks.corrected(show(t + wait, own_ppm));
            off = now as i64 - (t + wait) as i64;
            let mut late = 10_000;
            let stamps = cards_ppm.map(|ppm| {
                late -= 1_000;
                Some(show(t - late, ppm))
            });
            if let Some(ppm) = clocks.compare(now, stamps) {
                found.push((t as f64 * 1e-9, ppm));
            }
        }
        (found, off)
    }

    #[test]
    fn clocks_that_agree_are_left_alone_however_the_bus_waits() {
        assert_eq!(run(0.0, [0.0; CARDS]), (vec![], 0));
    }

    #[test]
    fn the_own_clock_is_set_again_and_again_so_that_it_stays_near() {
        let (found, off) = run(500.0, [0.0; CARDS]);
        // 200 µs at 500 ppm take 0.4 s; a whole window behind that ends within 0.1 s
        assert!(found[0].0 > 1.4 && found[0].0 < 1.5, "{found:?}");
        // the first stretch holds the sound second
        assert!(found[1..].iter().all(|(_, ppm)| (400.0..600.0).contains(ppm)), "{found:?}");
        assert!(off.abs() < 400_000, "{off}");
    }

    #[test]
    fn a_cards_clock_is_told_from_the_own_one() {
        let (found, off) = run(0.0, [0.0, 1000.0, 0.0]);
        assert!(found.len() > 5 && found[1..].iter().all(|(_, ppm)| *ppm < -800.0), "{found:?}");
        assert_eq!(off, 0);
    }
}
