//! Filters 1 to 6: equal linear-phase low-passes in a row, each at a quarter of the rate of the one before.
//!
//! Stage n takes in every published value of stage n − 1 (stage 0 is the 8 kHz sample) and publishes at every fourth,
//! at the same instant. Its delay is 12 of its input samples at every frequency. The taps are those of
//! [`stability::fir`]. Nothing here can fail.

use crate::{AXES, Counts};
use stability::fir::{DECIMATION, DELAY_SAMPLES, TAPS, lowpass_taps};

/// Number of filters, filter 0 (the samples themselves) not counted.
pub const FILTERS: usize = stability::cascade::FILTERS;

/// Inputs remembered by a stage: the power of two above the number of taps.
const HISTORY: usize = TAPS.next_power_of_two();

/// The six filters.
#[derive(Clone, Debug)]
pub struct Cascade {
    /// The first half of the symmetric taps and the middle one.
    taps: [f64; DELAY_SAMPLES + 1],
    stages: [Stage; FILTERS],
}

#[derive(Clone, Copy, Debug)]
struct Stage {
    history: [Counts; HISTORY],
    newest: usize,
    output: Counts,
}

impl Cascade {
    /// Filters that have seen `counts` since long ago.
    pub fn settled(counts: Counts) -> Cascade {
        let taps = lowpass_taps();
        Cascade {
            taps: core::array::from_fn(|i| taps[i]),
            stages: [Stage {
                history: [counts; HISTORY],
                newest: 0,
                output: counts,
            }; FILTERS],
        }
    }

    /// Takes in 8 kHz sample number `k`.
    pub fn push(&mut self, mut k: u64, sample: Counts) {
        let mut value = sample;
        for stage in &mut self.stages {
            stage.push(value);
            if !k.is_multiple_of(DECIMATION as u64) {
                return;
            }
            k /= DECIMATION as u64;
            stage.output = stage.low_pass(&self.taps);
            value = stage.output;
        }
    }

    /// Newest published value of filter `n`, 1 to [`FILTERS`].
    pub fn output(&self, n: usize) -> &Counts {
        &self.stages[n - 1].output
    }
}

impl Stage {
    fn push(&mut self, value: Counts) {
        self.newest = (self.newest + 1) % HISTORY;
        self.history[self.newest] = value;
    }

    /// Σ h_j x_j, mirrored taps taken together.
    fn low_pass(&self, taps: &[f64; DELAY_SAMPLES + 1]) -> Counts {
        let past = |age: usize| &self.history[(self.newest + HISTORY - age) % HISTORY];
        let middle = past(DELAY_SAMPLES);
        let mut sum: Counts = core::array::from_fn(|axis| taps[DELAY_SAMPLES] * middle[axis]);
        for (j, tap) in taps[..DELAY_SAMPLES].iter().enumerate() {
            let (new, old) = (past(j), past(TAPS - 1 - j));
            for axis in 0..AXES {
                sum[axis] += tap * (new[axis] + old[axis]);
            }
        }
        sum
    }
}
