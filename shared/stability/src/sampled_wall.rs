//! The sampled spring wall: a mass m with viscous damping b meets a virtual spring that is sampled every T,
//! held, and acts t_d after the sample. How stiff may the spring be?
//!
//! [`stiffness_rule`](SampledWall::stiffness_rule) is the rule K < (b + B)/(T/2 + t_d);
//! [`stiffness_max`](SampledWall::stiffness_max) the exact limit of the sampled loop;
//! [`passive_stiffness_max`](SampledWall::passive_stiffness_max) the limit below which the wall
//! can feed energy into no arm whatever (Colgate and Schenkel). m, b and T are positive, t_d is not
//! negative, all finite; others give a result without meaning, never a panic or an endless loop.

use core::f64::consts::PI;

use crate::bound::bisect;

/// The crossover is looked for over 34 decades, in steps of this ratio.
const SCAN_RATIO: f64 = 1.02;
/// Number of those steps.
const SCAN_STEPS: u32 = 4000;

/// A mass against a sampled wall, all but the stiffness that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledWall {
    /// m, in kg.
    pub mass: f64,
    /// b of the mechanism, in Ns/m.
    pub damping: f64,
    /// T between two samples, in s.
    pub period: f64,
    /// t_d from a sample to the start of the force that it causes, in s; any length.
    pub delay: f64,
}

impl SampledWall {
    /// The rule K < (b + B)/(T/2 + t_d), in N/m, for a wall with a damping B (`wall_damping`, Ns/m) of
    /// its own. Without it, a few parts in 1000 below the exact limit while bT/m ≪ 1.
    pub fn stiffness_rule(&self, wall_damping: f64) -> f64 {
        (self.damping + wall_damping) / (self.period / 2.0 + self.delay)
    }

    /// The wall without delay is passive for b > KT/2 + |B|: the K of that, in N/m; 0 if there is none.
    pub fn passive_stiffness_max(&self, wall_damping: f64) -> f64 {
        (2.0 * (self.damping - wall_damping.abs()) / self.period).max(0.0)
    }

    /// The exact largest stable K in N/m of a wall without damping: 1 + K G(z) has its first roots
    /// on the unit circle, at the lowest frequency where G is real and negative.
    pub fn stiffness_max(&self) -> f64 {
        let pulse = PulseTransfer::of(self);
        // The crossover of the loop with a pure delay, ω² = b/(m(T/2 + t_d)), and well below it.
        let delay = self.period / 2.0 + self.delay;
        let mut low = 0.1 * self.period * (self.damping / (self.mass * delay)).sqrt();
        low = low.min(0.1 * PI * self.period / delay);
        // The phase falls from −90° on, so the first sign change of Im(−1/G) is the one sought.
        for _ in 0..SCAN_STEPS {
            let high = (SCAN_RATIO * low).min(PI);
            if pulse.stiffness_at(high).1 >= 0.0 {
                let theta = bisect(low, high, |theta| pulse.stiffness_at(theta).1 < 0.0);
                return pulse.stiffness_at(theta).0;
            }
            low = high;
        }
        f64::NAN
    }
}

/// G(z) from the held force to the sampled position: z^−(d+1) (n₂z² + n₁z + n₀)/((z − 1)(z − p)).
struct PulseTransfer {
    /// 1 + whole periods of delay.
    delay_samples: f64,
    /// n₂, n₁, n₀.
    numerator: [f64; 3],
    /// 1 − p, with p = e^{−bT/m}.
    one_minus_pole: f64,
}

impl PulseTransfer {
    /// Step-invariant with a fractional delay εT: the previous force acts for εT, the new one after.
    fn of(wall: &SampledWall) -> Self {
        let SampledWall {
            mass,
            damping,
            period,
            delay,
        } = *wall;
        let whole = (delay / period).floor();
        let previous = delay - whole * period;
        let rate = damping / mass;
        // Fraction of the velocity lost in h, and position and velocity after h under 1 N from rest.
        let lost = |h: f64| -libm::expm1(-rate * h);
        let velocity = |h: f64| lost(h) / damping;
        let position = |h: f64| coasting_lag(rate, h) / damping;
        let rest = period - previous;
        // What the previous force has given by εT then coasts for the rest of the period.
        let x0 = position(rest);
        let v0 = velocity(rest);
        let x1 = position(previous) + velocity(previous) * lost(rest) / rate;
        let v1 = velocity(previous) * (1.0 - lost(rest));
        let one_minus_pole = lost(period);
        let pole = 1.0 - one_minus_pole;
        let coast = one_minus_pole / rate;
        Self {
            delay_samples: whole + 1.0,
            numerator: [x0, x1 - pole * x0 + coast * v0, coast * v1 - pole * x1],
            one_minus_pole,
        }
    }

    /// −1/G(e^{jθ}), real and imaginary part: where it is real it is the stiffness of the limit.
    fn stiffness_at(&self, theta: f64) -> (f64, f64) {
        let z = unit(theta);
        // z − 1 without cancellation at small θ.
        let z_minus_1 = (-2.0 * libm::sin(theta / 2.0) * libm::sin(theta / 2.0), z.1);
        let z_minus_pole = (z_minus_1.0 + self.one_minus_pole, z_minus_1.1);
        let [n2, n1, n0] = self.numerator;
        let z2 = unit(2.0 * theta);
        let n = (n2 * z2.0 + n1 * z.0 + n0, n2 * z2.1 + n1 * z.1);
        let top = product(
            product(z_minus_1, z_minus_pole),
            product(unit(self.delay_samples * theta), (n.0, -n.1)),
        );
        let square = n.0 * n.0 + n.1 * n.1;
        (-top.0 / square, -top.1 / square)
    }
}

/// h − (1 − e^{−rh})/r, without cancellation at small rh.
fn coasting_lag(rate: f64, h: f64) -> f64 {
    let x = rate * h;
    if x < 1e-3 {
        h * x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)))
    } else {
        h + libm::expm1(-x) / rate
    }
}

/// e^{jθ}.
fn unit(theta: f64) -> (f64, f64) {
    (libm::cos(theta), libm::sin(theta))
}

/// Complex product.
fn product(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(period: f64, delay: f64) -> SampledWall {
        SampledWall {
            mass: 5.0,
            damping: 20.0,
            period,
            delay,
        }
    }

    #[test]
    fn the_exact_limits_quoted_for_5_kg_and_20_ns_per_m_are_reproduced() {
        for (period, delay, quoted) in [
            (0.001, 0.0, 40_026.0),
            (0.005, 0.0, 8_027.0),
            (0.005, 0.005, 2_681.0),
        ] {
            let exact = wall(period, delay).stiffness_max();
            assert!((exact - quoted).abs() < 1.0, "{period} {delay}: {exact}");
        }
    }

    #[test]
    fn without_delay_the_limit_is_jurys_for_the_second_order_loop() {
        // z² − (1 + p)z + p + K(n₂z + n₁'): the constant term reaches 1.
        for period in [1e-4, 1e-3, 5e-3, 0.05, 0.2] {
            let (m, b) = (5.0_f64, 20.0_f64);
            let p: f64 = (-b * period / m).exp();
            let constant = m / (b * b) * (1.0 - p) - p * period / b;
            let jury = (1.0 - p) / constant;
            let exact = wall(period, 0.0).stiffness_max();
            assert!(
                (exact / jury - 1.0).abs() < 1e-6,
                "{period}: {exact} {jury}"
            );
        }
    }

    #[test]
    fn the_rule_is_within_one_percent_below_the_exact_limit_up_to_one_period_of_delay() {
        for period in [0.0005, 0.001, 0.002, 0.005] {
            for delay in [0.0, 0.3, 0.5, 1.0] {
                let wall = wall(period, delay * period);
                let ratio = wall.stiffness_max() / wall.stiffness_rule(0.0);
                assert!((1.0..1.01).contains(&ratio), "{period} {delay}: {ratio}");
            }
        }
    }

    #[test]
    fn a_simulated_wall_is_stable_one_percent_below_the_limit_and_not_one_percent_above() {
        for (period, delay) in [
            (0.001, 0.0),
            (0.005, 0.0),
            (0.005, 0.005),
            (0.005, 0.002),
            (0.002, 0.0071),
        ] {
            let wall = wall(period, delay);
            let limit = wall.stiffness_max();
            assert!(growth(&wall, 0.99 * limit) < 1.0, "{period} {delay}");
            assert!(growth(&wall, 1.01 * limit) > 1.0, "{period} {delay}");
        }
    }

    /// Ratio of the largest |x| in the second half of 200 s to that in the first: each piece of constant
    /// force is integrated exactly.
    fn growth(wall: &SampledWall, stiffness: f64) -> f64 {
        let rate = wall.damping / wall.mass;
        let advance = |(x, v): (f64, f64), force: f64, h: f64| {
            let lost = 1.0 - (-rate * h).exp();
            let steady = force / wall.damping;
            (
                x + steady * h + (v - steady) * lost / rate,
                v + (steady - v) * lost,
            )
        };
        let whole = (wall.delay / wall.period + 1e-9).floor();
        let previous = (wall.delay - whole * wall.period).max(0.0);
        let mut forces = vec![0.0; whole as usize + 2];
        let mut state = (1.0, 0.0);
        let samples = (200.0 / wall.period) as usize;
        let mut largest = [0.0_f64; 2];
        for i in 0..samples {
            forces.rotate_right(1);
            forces[0] = -stiffness * state.0;
            let n = forces.len();
            state = advance(state, forces[n - 1], previous);
            state = advance(state, forces[n - 2], wall.period - previous);
            let half = usize::from(i >= samples / 2);
            largest[half] = largest[half].max(state.0.abs());
        }
        largest[1] / largest[0]
    }

    #[test]
    fn passivity_asks_for_more_than_stability() {
        let wall = wall(0.001, 0.0);
        assert_eq!(wall.passive_stiffness_max(0.0), 40_000.0);
        assert_eq!(wall.passive_stiffness_max(-5.0), 30_000.0);
        assert_eq!(wall.passive_stiffness_max(25.0), 0.0);
        assert!(wall.passive_stiffness_max(5.0) < wall.stiffness_rule(5.0));
    }

    #[test]
    fn senseless_arguments_neither_panic_nor_hang() {
        for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            let good = wall(0.001, 0.0);
            let _ = SampledWall { mass: bad, ..good }.stiffness_max();
            let _ = SampledWall {
                damping: bad,
                ..good
            }
            .stiffness_max();
            let _ = SampledWall {
                period: bad,
                ..good
            }
            .stiffness_max();
            let _ = SampledWall { delay: bad, ..good }.stiffness_max();
        }
    }
}
