//! A pure delay in the place of filter 0, for comparison with theory: no real receiver has one.
//!
//! The value shown at t is the one of t − d exactly: 8 kHz samples are interpolated linearly, so the delay is not
//! rounded to 125 µs. What was before the first sample is taken to be like it.

use crate::{AXES, Counts, SAMPLE_NS};
use vme::Ns;

/// The samples of the last d.
#[derive(Clone, Debug)]
pub struct DelayLine {
    delay: Ns,
    /// Sample k at k modulo the length.
    samples: Vec<Counts>,
    newest: Option<u64>,
}

impl DelayLine {
    /// A line of that delay.
    pub fn new(delay: Ns) -> DelayLine {
        let length = delay.div_ceil(SAMPLE_NS) + 2;
        DelayLine {
            delay,
            samples: vec![[0.0; AXES]; length as usize],
            newest: None,
        }
    }

    /// Takes in 8 kHz sample number `k`.
    pub fn push(&mut self, k: u64, sample: Counts) {
        if self.newest.is_none() {
            self.samples.fill(sample);
        }
        *self.slot(k) = sample;
        self.newest = Some(k);
    }

    /// Number of the newest sample whose time is at or before t − d; 0 before the first.
    pub fn counter(&self, t: Ns) -> u64 {
        t.saturating_sub(self.delay) / SAMPLE_NS
    }

    /// The value of t − d. `now` is the value at `t`: a delay below the sampling time reaches past the newest sample.
    pub fn value(&self, t: Ns, now: Counts) -> Counts {
        let past = t.saturating_sub(self.delay);
        let k = past / SAMPLE_NS;
        let since = past - k * SAMPLE_NS;
        let from = self.samples[self.index(k)];
        if since == 0 {
            return from;
        }
        let (to, span) = if self.newest.is_some_and(|newest| k < newest) {
            (self.samples[self.index(k + 1)], SAMPLE_NS)
        } else {
            (now, t - k * SAMPLE_NS)
        };
        let share = since as f64 / span as f64;
        core::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]))
    }

    fn index(&self, k: u64) -> usize {
        (k % self.samples.len() as u64) as usize
    }

    fn slot(&mut self, k: u64) -> &mut Counts {
        let index = self.index(k);
        &mut self.samples[index]
    }
}
