//! The strain-gauge bridges and their converters: a wrench becomes counts, with offset, noise and saturation.
//!
//! Counts stay fractional here: the receiver computes with more bits than its output words have, and only a
//! register is rounded. The noise is white and Gaussian, one draw per axis and 8 kHz sample in the order of
//! the axes, from a random stream of its own; the same seed gives the same noise wherever windows are cut.

use crate::{AXES, Counts};
use core::f64::consts::TAU;
use messages::BoardId;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use scenario::Scenario;

/// Share of full scale from which an axis is near saturation.
const NEAR_SATURATION: f64 = 0.8;

/// Bridges and converters of the six axes.
#[derive(Clone, Debug)]
pub struct Gauges {
    full_scale_counts: f64,
    /// Counts per N, per Nm.
    sensitivity: [f64; AXES],
    /// Zero offsets at power-up, N and Nm.
    zero: [f64; AXES],
    noise: Option<Noise>,
}

impl Gauges {
    /// The sensor that the scenario describes.
    pub fn new(scenario: &Scenario) -> Gauges {
        let sensor = &scenario.force_sensor_if;
        let per_axis = |force: f64, moment: f64| [force, force, force, moment, moment, moment];
        let sensitivity = per_axis(sensor.full_scale_n, sensor.full_scale_nm)
            .map(|full_scale| sensor.full_scale_counts / full_scale);
        let [fx, fy, fz] = sensor.offset_n;
        let [mx, my, mz] = sensor.offset_nm;
        let noise = (sensor.noise_n > 0.0 || sensor.noise_nm > 0.0)
            .then(|| Noise::new(scenario.seed, per_axis(sensor.noise_n, sensor.noise_nm)));
        Gauges {
            full_scale_counts: sensor.full_scale_counts,
            sensitivity,
            zero: [fx, fy, fz, mx, my, mz],
            noise,
        }
    }

    /// Converts a wrench (N, Nm) without noise.
    pub fn quiet(&self, wrench: &[f64; AXES]) -> Counts {
        self.convert(wrench, &[0.0; AXES])
    }

    /// Converts the wrench of the next 8 kHz sample.
    pub fn sample(&mut self, wrench: &[f64; AXES]) -> Counts {
        match &mut self.noise {
            None => self.quiet(wrench),
            Some(noise) => {
                let noise = noise.draw();
                self.convert(wrench, &noise)
            }
        }
    }

    /// Bit i: axis i is at full scale.
    pub fn saturated(&self, counts: &Counts) -> u16 {
        beyond(counts, self.full_scale_counts)
    }

    /// Bit i: axis i is at 80 % of full scale or beyond.
    pub fn near_saturation(&self, counts: &Counts) -> u16 {
        beyond(counts, NEAR_SATURATION * self.full_scale_counts)
    }

    fn convert(&self, wrench: &[f64; AXES], noise: &[f64; AXES]) -> Counts {
        core::array::from_fn(|i| {
            let counts = self.sensitivity[i] * (wrench[i] + self.zero[i] + noise[i]);
            counts.clamp(-self.full_scale_counts, self.full_scale_counts)
        })
    }
}

fn beyond(counts: &Counts, limit: f64) -> u16 {
    counts
        .iter()
        .enumerate()
        .fold(0, |bits, (i, c)| bits | u16::from(c.abs() >= limit) << i)
}

/// Gaussian noise of one sample.
#[derive(Clone, Debug)]
struct Noise {
    /// Standard deviations, N and Nm.
    deviation: [f64; AXES],
    normal: Normal,
}

impl Noise {
    fn new(seed: u64, deviation: [f64; AXES]) -> Noise {
        Noise { deviation, normal: Normal::new(seed, BoardId::ForceSensorIf as u64) }
    }

    fn draw(&mut self) -> [f64; AXES] {
        let mut noise = self.deviation;
        for pair in noise.chunks_exact_mut(2) {
            let (a, b) = self.normal.pair();
            pair[0] *= a;
            pair[1] *= b;
        }
        noise
    }
}

/// Standard normal numbers from a random stream of their own.
#[derive(Clone, Debug)]
pub struct Normal(ChaCha8Rng);

impl Normal {
    /// That stream of the scenario's seed.
    pub fn new(seed: u64, stream: u64) -> Normal {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Normal(rng)
    }

    /// The next number.
    pub fn draw(&mut self) -> f64 {
        self.pair().0
    }

    /// Two independent ones (Box–Muller).
    fn pair(&mut self) -> (f64, f64) {
        let radius = (-2.0 * libm::log(self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(TAU * self.uniform());
        (radius * cos, radius * sin)
    }

    /// Uniform in (0, 1].
    fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_is_standard_normal() {
        let mut noise = Noise::new(7, [1.0; AXES]);
        let draws: Vec<f64> = (0..20_000).flat_map(|_| noise.draw()).collect();
        let n = draws.len() as f64;
        let moment = |power: i32| draws.iter().map(|x| x.powi(power)).sum::<f64>() / n;
        // five standard errors of the moments of N(0, 1): 0, 1, 0, 3
        assert!(moment(1).abs() < 5.0 / n.sqrt());
        assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!(moment(3).abs() < 5.0 * (15.0 / n).sqrt());
        assert!((moment(4) - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        let beyond = |limit: f64| draws.iter().filter(|x| x.abs() > limit).count() as f64 / n;
        assert!((beyond(1.959964) - 0.05).abs() < 5.0 * (0.05_f64 * 0.95 / n).sqrt());
    }

    #[test]
    fn axes_and_samples_are_independent() {
        let mut noise = Noise::new(3, [1.0; AXES]);
        let draws: Vec<[f64; AXES]> = (0..20_000).map(|_| noise.draw()).collect();
        let n = draws.len() as f64;
        for a in 0..AXES {
            for b in 0..AXES {
                let same = draws.iter().map(|x| x[a] * x[b]).sum::<f64>() / n;
                let next = draws.windows(2).map(|w| w[0][a] * w[1][b]).sum::<f64>() / n;
                assert!(a == b || same.abs() < 5.0 / n.sqrt(), "{a} {b}: {same}");
                assert!(next.abs() < 5.0 / n.sqrt(), "{a} {b}: {next}");
            }
        }
    }
}
