//! How noisy the force is: what no smooth contact force has, its second difference from job to job.

use arm::Spatial;

/// Jobs that an estimate reaches back.
const JOBS: f64 = 20.0;

/// Running estimate of a wrench's noise.
#[derive(Clone, Debug)]
pub struct ForceNoise {
    /// The two wrenches before, the newer first.
    before: [Spatial; 2],
    seen: u32,
    /// Variance, N² and (10 Nm)².
    variance: Spatial,
}

impl ForceNoise {
    /// Nothing seen.
    pub fn new() -> ForceNoise {
        ForceNoise { before: [Spatial::zeros(); 2], seen: 0, variance: Spatial::zeros() }
    }

    /// Takes in the next job's wrench (N, Nm).
    pub fn push(&mut self, wrench: &Spatial) {
        if self.seen >= 2 {
            let second = wrench - self.before[0] * 2.0 + self.before[1];
            for axis in 0..6 {
                let scaled = if axis < 3 { second[axis] } else { 10.0 * second[axis] };
                // white noise of variance σ² has second differences of variance 6 σ²
                self.variance[axis] += (scaled * scaled / 6.0 - self.variance[axis]) / JOBS;
            }
        }
        self.seen = self.seen.saturating_add(1);
        self.before = [*wrench, self.before[0]];
    }

    /// Standard deviation of the noisiest axis, N (of a moment: ten times its Nm).
    pub fn deviation_n(&self) -> f64 {
        self.variance.amax().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    #[test]
    fn white_noise_has_its_deviation_and_a_steady_rise_has_none() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut noise, mut mean, jobs) = (ForceNoise::new(), 0.0, 20_000);
        for _ in 0..jobs {
            // uniform over ±1: σ² = 1/3
            let draw = (rng.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
            noise.push(&Spatial::new(0.0, 0.0, draw, 0.0, 0.0, 0.0));
            mean += noise.deviation_n().powi(2) / f64::from(jobs);
        }
        assert!((mean - 1.0 / 3.0).abs() < 0.02, "{mean}");
        let mut ramp = ForceNoise::new();
        (0..100).for_each(|job| ramp.push(&Spatial::repeat(2.0 * f64::from(job))));
        assert!(ramp.deviation_n() < 1e-12);
    }
}
