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

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use stability::cascade::Filter;

    #[test]
    fn a_sine_leaves_every_filter_as_its_transfer_function_says() {
        for n in 1..=FILTERS {
            let filter = Filter::number(n).unwrap();
            let published = DECIMATION.pow(n as u32) as u64;
            // up to the cut-off, over it, and near the Nyquist frequency of the output
            for share in [0.05, 0.5, 1.0, 1.5, 1.9] {
                let omega = TAU * filter.cutoff() * share;
                let sine = |t: f64| (omega * t).sin();
                let mut cascade = Cascade::settled([0.0; AXES]);
                let mut worst = 0.0_f64;
                // the start has left the filter after twice its delay
                for k in 0..60 * published {
                    let t = k as f64 / 8000.0;
                    cascade.push(k, [sine(t); AXES]);
                    if k.is_multiple_of(published) && t > 2.0 * filter.delay() + 0.01 {
                        let expected = filter.gain(omega) * sine(t - filter.delay());
                        worst = worst.max((cascade.output(n)[5] - expected).abs());
                    }
                }
                assert!(worst < 1e-9, "filter {n}, {share} of the cut-off: {worst}");
            }
        }
    }

    #[test]
    fn a_step_response_ends_at_exactly_the_length_of_the_taps() {
        // 24 input samples of each stage, then nothing of the past is left
        let mut cascade = Cascade::settled([0.0; AXES]);
        let end = 24 * (1 + 4 + 16 + 64);
        for k in 1..=end {
            cascade.push(k, [1.0, -2.0, 0.0, 0.5, 1e-3, 1e3]);
        }
        cascade.push(end + 1, [1.0, -2.0, 0.0, 0.5, 1e-3, 1e3]);
        for k in end + 2..=end + 256 {
            cascade.push(k, [1.0, -2.0, 0.0, 0.5, 1e-3, 1e3]);
        }
        for (value, expected) in cascade
            .output(4)
            .iter()
            .zip([1.0, -2.0, 0.0, 0.5, 1e-3, 1e3])
        {
            assert!(
                (value - expected).abs() <= 1e-14 * expected.abs(),
                "{value}"
            );
        }
    }

    #[test]
    fn a_settled_cascade_shows_the_constant_behind_every_filter() {
        let mut cascade = Cascade::settled([3.0; AXES]);
        for k in 0..=4096 {
            cascade.push(k, [3.0; AXES]);
        }
        for n in 1..=FILTERS {
            assert!(
                cascade
                    .output(n)
                    .iter()
                    .all(|value| (value - 3.0).abs() < 1e-14),
                "filter {n}"
            );
        }
    }
}
