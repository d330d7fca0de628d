//! Bells: one counter per process in a page of shared memory, and a futex to sleep on.
//!
//! A waiter first yields the processor a few times, since the ringer usually runs on it next, then blocks. On a
//! machine with busy hogs a yield lasts a whole time slice: when one took over [`YIELD_LIMIT`], the next
//! [`BLOCK_AT_ONCE`] waits block at once. That is the outcome of `windows`, the benchmark of lock step (table in the
//! README); the environment variable `VMERACK_BELL` (`yield`, `block`, `spin`) chooses another way of waiting for it.

use crate::ChannelError;
use crate::page::Page;
use rustix::thread::futex;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A longer yield means that somebody else had the processor: boards keep it for less, a busy loop for milliseconds.
const YIELD_LIMIT: Duration = Duration::from_micros(500);
/// Waits that block at once after such a yield.
const BLOCK_AT_ONCE: u32 = 10_000;
/// Yields before blocking.
const YIELDS: u32 = 20;
/// Where the number of the turn lies, in the first bell's words.
const TURN_WORD: usize = 2;
/// Words from one bell to the next: a cache line pair each.
const STRIDE: usize = 32;

/// The page of all bells of a run.
#[derive(Clone)]
pub struct Bells {
    page: Page,
}

/// How a process waits before it sleeps.
#[derive(Clone, Copy, Debug)]
enum Waiting {
    /// Gives the processor away a few times.
    Yield,
    /// Not at all.
    Block,
    /// Keeps the processor for a while.
    Spin,
}

impl Waiting {
    fn chosen() -> Waiting {
        match std::env::var("VMERACK_BELL").as_deref() {
            Ok("block") => Waiting::Block,
            Ok("spin") => Waiting::Spin,
            _ => Waiting::Yield,
        }
    }
}

/// One process's bell, as its owner holds it.
pub struct Bell {
    bells: Bells,
    index: usize,
    heard: u32,
    block_at_once: u32,
    waiting: Waiting,
}

impl Bells {
    /// Maps the page at `path` with room for `count` bells, creating it where it does not exist.
    pub fn open(path: &Path, count: usize) -> Result<Bells, ChannelError> {
        Ok(Bells { page: Page::open(path, count * STRIDE)? })
    }

    fn word(&self, index: usize, word: usize) -> &AtomicU32 {
        self.page.word(index * STRIDE + word)
    }

    /// Number of the turn that is to be taken now.
    pub fn turn(&self) -> u32 {
        self.word(0, TURN_WORD).load(Ordering::SeqCst)
    }

    /// Hands it on; seen by everybody who hears a later ring.
    pub fn set_turn(&self, turn: u32) {
        self.word(0, TURN_WORD).store(turn, Ordering::SeqCst);
    }

    /// Puts 32-bit words where bells from `first` on would be; there must be room.
    pub(crate) fn put(&self, first: usize, words: &[u32]) {
        words.iter().enumerate().for_each(|(i, word)| self.word(first, i).store(*word, Ordering::Relaxed));
    }

    /// Takes them from there.
    pub(crate) fn get(&self, first: usize, words: &mut [u32]) {
        words.iter_mut().enumerate().for_each(|(i, word)| *word = self.word(first, i).load(Ordering::Relaxed));
    }

    /// Rings the bell of process `index`.
    pub fn ring(&self, index: usize) {
        let counter = self.word(index, 0);
        counter.fetch_add(1, Ordering::SeqCst);
        if self.word(index, 1).load(Ordering::SeqCst) != 0 {
            // a failed wake only means that nobody sleeps
            let _ = futex::wake(counter, futex::Flags::empty(), i32::MAX as u32);
        }
    }

    /// The bell of process `index`, for its owner.
    pub fn bell(&self, index: usize) -> Bell {
        Bell { bells: self.clone(), index, heard: 0, block_at_once: 0, waiting: Waiting::chosen() }
    }
}

impl Bell {
    /// Waits until the bell has rung since the last wait, at most `limit`. How often it has.
    pub fn wait(&mut self, limit: Duration) -> u32 {
        let rung = self.rung();
        if rung > 0 {
            return rung;
        }
        let rung = match self.waiting {
            Waiting::Block => 0,
            Waiting::Spin => self.spin(),
            Waiting::Yield if self.block_at_once > 0 => {
                self.block_at_once -= 1;
                0
            }
            Waiting::Yield => self.yield_a_few_times(),
        };
        if rung > 0 { rung } else { self.block(limit) }
    }

    fn yield_a_few_times(&mut self) -> u32 {
        for _ in 0..YIELDS {
            let before = Instant::now();
            std::thread::yield_now();
            // also where it has rung meanwhile: the ringer may be on another processor
            let somebody_else = before.elapsed() > YIELD_LIMIT;
            if somebody_else {
                self.block_at_once = BLOCK_AT_ONCE;
            }
            let rung = self.rung();
            if rung > 0 || somebody_else {
                return rung;
            }
        }
        0
    }

    fn spin(&mut self) -> u32 {
        let since = Instant::now();
        while since.elapsed() < YIELD_LIMIT {
            let rung = self.rung();
            if rung > 0 {
                return rung;
            }
            std::hint::spin_loop();
        }
        0
    }

    /// Waits as [`Bell::wait`] does, but blocks at once.
    pub(crate) fn block(&mut self, limit: Duration) -> u32 {
        let (counter, sleeping) = (self.bells.word(self.index, 0), self.bells.word(self.index, 1));
        let timeout =
            rustix::thread::futex::Timespec { tv_sec: limit.as_secs() as _, tv_nsec: limit.subsec_nanos().into() };
        sleeping.store(1, Ordering::SeqCst);
        // returns at once where the counter has moved; a spurious end is the caller's next wait
        let _ = futex::wait(counter, futex::Flags::empty(), self.heard, Some(&timeout));
        sleeping.store(0, Ordering::SeqCst);
        self.rung()
    }

    /// How often the bell has rung since it was last asked.
    pub fn rung(&mut self) -> u32 {
        let count = self.bells.word(self.index, 0).load(Ordering::SeqCst);
        let rung = count.wrapping_sub(self.heard);
        self.heard = count;
        rung
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_before_the_wait_is_heard_and_a_silent_bell_times_out() {
        let folder = tempfile::tempdir().expect("folder");
        let bells = Bells::open(&folder.path().join("bells"), 2).expect("page");
        let mut bell = bells.bell(1);
        bells.ring(1);
        bells.ring(1);
        assert_eq!(bell.wait(Duration::ZERO), 2);
        assert_eq!(bell.wait(Duration::from_millis(1)), 0);
        bells.ring(0);
        assert_eq!(bell.wait(Duration::from_millis(1)), 0);
    }

    #[test]
    fn a_ring_from_another_mapping_wakes_a_sleeper() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("bells");
        let mut bell = Bells::open(&path, 2).expect("page").bell(0);
        let other = Bells::open(&path, 2).expect("page");
        let ringer = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            other.ring(0);
        });
        // a long limit: the test's own watchdog, not a promise
        assert_eq!(bell.wait(Duration::from_secs(30)), 1);
        ringer.join().expect("ringer");
    }
}
