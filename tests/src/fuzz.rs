//! Hostile input: many small draws, each under a watchdog and within a bound of memory.
//!
//! A test makes a few draws of a fixed seed, the same every time. With `FUZZ_SECONDS` set it goes on with further seeds for
//! that long (`scripts/soak.sh`); a draw that fails names its seed, and `FUZZ_SEED` runs that one alone.

use crate::Draw;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// No draw takes longer, on whatever machine.
const LIMIT: Duration = Duration::from_secs(30);
const LOOK: Duration = Duration::from_millis(20);

/// Carries out `case` for `draws` seeds, or for `FUZZ_SECONDS`.
pub fn fuzz(draws: u64, mut case: impl FnMut(&mut Draw)) {
    let number = |key: &str| std::env::var(key).ok().and_then(|text| text.parse::<u64>().ok());
    let seconds = number("FUZZ_SECONDS").map(Duration::from_secs);
    let only = number("FUZZ_SEED");
    let seeds = only.map_or(0..u64::MAX, |seed| seed..seed + 1);
    let (start, watched, mut drawn) = (Instant::now(), Watchdog::new(), 0);
    for seed in seeds {
        if only.is_none() && seed >= draws && seconds.is_none_or(|seconds| start.elapsed() > seconds) {
            break;
        }
        watched.seed.store(seed, Ordering::Relaxed);
        drawn += 1;
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| case(&mut Draw::new(seed)))) {
            eprintln!("FUZZ_SEED={seed} shows it again");
            resume_unwind(panic);
        }
    }
    let test = std::thread::current();
    println!("{}: {drawn} draws in {:.0?}", test.name().unwrap_or("fuzz"), start.elapsed());
}

/// Ends the process where one seed lasts too long.
struct Watchdog {
    seed: Arc<AtomicU64>,
    done: Arc<AtomicBool>,
}

impl Watchdog {
    fn new() -> Watchdog {
        let watchdog = Watchdog { seed: Arc::default(), done: Arc::default() };
        let (seed, done) = (Arc::clone(&watchdog.seed), Arc::clone(&watchdog.done));
        std::thread::spawn(move || {
            let mut last = (0, Instant::now());
            while !done.load(Ordering::Relaxed) {
                std::thread::sleep(LOOK);
                let now = seed.load(Ordering::Relaxed);
                if now != last.0 {
                    last = (now, Instant::now());
                } else if last.1.elapsed() > LIMIT {
                    eprintln!("hangs: FUZZ_SEED={now} shows it again");
                    std::process::abort();
                }
            }
        });
        watchdog
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
    }
}

/// Numbers at which arithmetic goes wrong, of instants near `now` and of doubles.
fn extreme(draw: &mut Draw, now: u64) -> u64 {
    let doubles = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324, -0.0, 1e18, -1e9, 1e-9, 1.0];
    let whole = [0, 1, now, now + 1, now.wrapping_sub(1), now + 1_000_000, 1 << 32, 1 << 63, u64::MAX, u64::MAX - 1];
    match draw.below(3) {
        0 => doubles[draw.below(doubles.len())].to_bits(),
        1 => whole[draw.below(whole.len())],
        _ => draw.next(),
    }
}

/// Spoils plain old data in its place: a bit, a word, or a pair of words, at `now` of simulated time.
pub fn spoil(draw: &mut Draw, bytes: &mut [u8], now: u64) {
    if bytes.is_empty() {
        return;
    }
    let small = [0, 1, 2, 3, 7, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0xFFFF, 0x1_0000];
    match draw.below(4) {
        0 => bytes[draw.below(bytes.len())] ^= 1 << draw.below(8),
        1 if bytes.len() >= 4 => {
            let at = 4 * draw.below(bytes.len() / 4);
            bytes[at..at + 4].copy_from_slice(&u32::to_ne_bytes(small[draw.below(small.len())]));
        }
        2 => {
            for word in bytes.chunks_mut(8) {
                let value = extreme(draw, now).to_ne_bytes();
                word.copy_from_slice(&value[..word.len()]);
            }
        }
        _ if bytes.len() >= 8 => {
            let at = 8 * draw.below(bytes.len() / 8);
            bytes[at..at + 8].copy_from_slice(&extreme(draw, now).to_ne_bytes());
        }
        _ => bytes[draw.below(bytes.len())] = draw.next() as u8,
    }
}

/// Spoils the bytes of a file: flips, cuts, repeats, joins with another of the corpus, or puts a word of it elsewhere.
pub fn spoil_file(draw: &mut Draw, bytes: &mut Vec<u8>, other: &[u8], words: &[&str]) {
    for _ in 0..=draw.below(4) {
        let at = draw.below(bytes.len() + 1);
        let end = at + draw.below((bytes.len() - at).min(200) + 1);
        match draw.below(8) {
            0 if at < bytes.len() => bytes[at] ^= 1 << draw.below(8),
            1 if at < bytes.len() => bytes[at] = draw.next() as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let piece = bytes[at..end].repeat(1 + draw.below(8));
                bytes.splice(at..at, piece);
            }
            5 => {
                let from = draw.below(other.len() + 1);
                let piece = &other[from..other.len().min(from + draw.below(400))];
                bytes.splice(at..end, piece.iter().copied());
            }
            6 if bytes.len() >= 8 => {
                let at = at.min(bytes.len() - 8);
                let value = extreme(draw, 0).to_le_bytes();
                bytes[at..at + 8].copy_from_slice(&value);
            }
            _ => {
                let word = words.get(draw.below(words.len().max(1))).copied().unwrap_or_default();
                bytes.splice(at..at + (end - at).min(8), word.bytes());
            }
        }
    }
}
