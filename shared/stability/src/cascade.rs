//! Filters 1 to 6 of the JR3 receiver as the loop sees them: delay and frequency response of the
//! cascade of [`fir`](crate::fir) stages, for the bounds behind a force filter.
//!
//! Filter k is the output of k equal stages. Stage i takes in 8000/4^(i−1) samples a second, cuts
//! off at 1/16 of that and passes on every fourth sample. All stages have linear phase, so the
//! cascade is a pure delay and a real gain. Left out: aliasing between the stages (each
//! attenuates what would alias by 39 dB or more) and the hold of the published value, which adds
//! half of [`publication_period`](Filter::publication_period) on average, as the book's 1/f_c
//! (6.2.13) leaves it out too.

use core::f64::consts::PI;

use crate::bound::{Bound, force_crossover};
use crate::fir;

/// Sample rate of the sensor data, at the input of the first stage, in Hz.
pub const INPUT_RATE_HZ: f64 = 8000.0;

/// Number of filters; filter 0, the unfiltered data, is not counted.
pub const FILTERS: usize = 6;

/// Cut-offs are recognised within this relative error: 7.81 Hz is the filter of 7.8125 Hz.
const CUTOFF_TOLERANCE: f64 = 0.01;

/// One filter of the receiver, a cascade of 1 to [`FILTERS`] stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Filter {
    stages: usize,
}

impl Filter {
    /// Filter `number` of the receiver, 1 to [`FILTERS`]; `None` for any other number.
    pub fn number(number: usize) -> Option<Self> {
        (1..=FILTERS)
            .contains(&number)
            .then_some(Self { stages: number })
    }

    /// The filter whose cut-off is within 1 % of `cutoff_hz`; `None` if there is none.
    pub fn with_cutoff(cutoff_hz: f64) -> Option<Self> {
        (1..=FILTERS)
            .map(|stages| Self { stages })
            .find(|filter| (cutoff_hz / filter.cutoff() - 1.0).abs() <= CUTOFF_TOLERANCE)
    }

    /// The filter's number, 1 to [`FILTERS`].
    pub fn stages(self) -> usize {
        self.stages
    }

    /// Cut-off of the last stage, in Hz: 500, 125, 31.25, 7.8125, 1.953125, 0.48828125.
    pub fn cutoff(self) -> f64 {
        fir::CUTOFF_OVER_INPUT_RATE * stage_input_rate(self.stages)
    }

    /// Delay in s, the same at every frequency: 12 samples of each stage's input rate.
    pub fn delay(self) -> f64 {
        (1..=self.stages)
            .map(|stage| fir::DELAY_SAMPLES as f64 / stage_input_rate(stage))
            .sum()
    }

    /// Time between two published values, in s.
    pub fn publication_period(self) -> f64 {
        fir::DECIMATION as f64 / stage_input_rate(self.stages)
    }

    /// Gain at `omega` rad/s, the [`delay`](Self::delay) taken out: 1 at DC; negative in side lobes.
    pub fn gain(self, omega: f64) -> f64 {
        let taps = fir::lowpass_taps();
        (1..=self.stages)
            .map(|stage| fir::amplitude(&taps, omega / (2.0 * PI) / stage_input_rate(stage)))
            .product()
    }

    /// Largest stable contact stiffness in N/m of m s² + b s + k_e H(s) with H this filter followed
    /// by `further_delay` s (half a sampling period, say); m in kg, b in Ns/m, both positive.
    ///
    /// The phase is that of a pure delay, so the crossover is where
    /// [`Bound::ForceDelayOnly`](crate::Bound::ForceDelayOnly) has it, and the stiffness there is
    /// larger by 1/|H|. Later phase crossovers need more stiffness, for |H| ≤ 1.003 everywhere.
    pub fn contact_stiffness_max(self, mass: f64, damping: f64, further_delay: f64) -> f64 {
        let delay = self.delay() + further_delay;
        let omega = force_crossover(damping / mass * delay) / delay;
        Bound::ForceDelayOnly.stiffness_max(mass, damping, delay) / self.gain(omega)
    }
}

/// Samples a second at the input of `stage`, counted from 1.
fn stage_input_rate(stage: usize) -> f64 {
    (1..stage).fold(INPUT_RATE_HZ, |rate, _| rate / fir::DECIMATION as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filter_4() -> Filter {
        Filter::number(4).unwrap()
    }

    #[test]
    fn the_cut_offs_are_a_quarter_of_each_other_from_500_hz_down() {
        let cutoffs: Vec<f64> = (1..=FILTERS)
            .map(|n| Filter::number(n).unwrap().cutoff())
            .collect();
        assert_eq!(cutoffs, [500.0, 125.0, 31.25, 7.8125, 1.953125, 0.48828125]);
        assert!(Filter::number(0).is_none() && Filter::number(7).is_none());
    }

    #[test]
    fn filter_4_delays_by_127_5_ms_and_is_published_at_31_25_hz() {
        for cutoff in [7.8125, 7.81] {
            let filter = Filter::with_cutoff(cutoff).unwrap();
            assert_eq!(filter.stages(), 4);
            assert!((filter.delay() - 0.1275).abs() < 1e-15);
            assert_eq!(filter.publication_period(), 1.0 / 31.25);
        }
        // The delay the book takes, 1/f_c, is within 2 % of it.
        assert!((filter_4().delay() / 0.128 - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_cut_off_that_no_filter_has_is_not_recognised() {
        for cutoff in [0.0, -7.8, 10.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Filter::with_cutoff(cutoff), None, "{cutoff}");
        }
    }

    #[test]
    fn the_delay_is_the_centre_of_gravity_of_the_impulse_response() {
        // The cascade without its decimation, each stage's taps spread over the input samples.
        let taps = fir::lowpass_taps();
        let mut response = vec![1.0];
        for stage in 0..4 {
            let spread = fir::DECIMATION.pow(stage);
            let mut next = vec![0.0; response.len() + (fir::TAPS - 1) * spread];
            for (i, r) in response.iter().enumerate() {
                for (k, tap) in taps.iter().enumerate() {
                    next[i + k * spread] += r * tap;
                }
            }
            response = next;
        }
        let moment: f64 = response
            .iter()
            .zip(0_u32..)
            .map(|(r, i)| r * f64::from(i))
            .sum();
        let delay = moment / response.iter().sum::<f64>() / INPUT_RATE_HZ;
        assert!((delay - filter_4().delay()).abs() < 1e-12, "{delay}");

        // And its transfer function is the product that `gain` states.
        for omega in [1.0, 11.3, 30.0, 80.0] {
            let re: f64 = response
                .iter()
                .zip(0_u32..)
                .map(|(r, i)| r * (omega * (f64::from(i) / INPUT_RATE_HZ - delay)).cos())
                .sum();
            assert!((re - filter_4().gain(omega)).abs() < 1e-12, "{omega}: {re}");
        }
    }

    #[test]
    fn the_gain_never_exceeds_one_by_more_than_the_pass_band_ripple() {
        for i in 0..50_000 {
            let omega = f64::from(i) * 0.5; // up to 4 kHz
            assert!(filter_4().gain(omega).abs() < 1.003, "{omega}");
        }
    }

    #[test]
    fn the_largest_stiffness_behind_filter_4_is_what_is_quoted_for_it() {
        // Quoted: 5.57 and 9.18 kN/m; the taps of the real receiver are not known.
        let stiffness = |m, b| filter_4().contact_stiffness_max(m, b, 0.0);
        assert!((stiffness(5.7, 477.0) - 5582.0).abs() < 1.0);
        assert!((stiffness(100.0, 1000.0) - 9231.0).abs() < 1.0);
        assert!((stiffness(5.7, 477.0) / 5570.0 - 1.0).abs() < 0.003);
        assert!((stiffness(100.0, 1000.0) / 9180.0 - 1.0).abs() < 0.006);
    }

    #[test]
    fn the_pure_delay_is_a_little_stricter_than_the_cascade() {
        for (m, b) in [
            (1600.0, 8000.0),
            (400.0, 4000.0),
            (5.7, 477.0),
            (100.0, 1000.0),
        ] {
            let pure = Bound::ForceDelayOnly.stiffness_max(m, b, filter_4().delay());
            let cascade = filter_4().contact_stiffness_max(m, b, 0.0);
            assert!(pure < cascade && cascade < 1.04 * pure, "{m} {b}");
        }
    }

    #[test]
    fn table_5_3_behind_filter_4_is_unstable() {
        assert!(filter_4().contact_stiffness_max(100.0, 1000.0, 0.0) < 10_000.0);
    }
}
