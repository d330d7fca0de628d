//! Gain, phase and delay margin of an impedance whose feedback arrives late by a delay τ, the loop
//! broken at the delayed signal.
//!
//! Two loops: both terms delayed, L = e^{−τs}(bs + k)/(ms²), broken at the whole feedback (6.2.7); and only the
//! force delayed, L = k e^{−τs}/(s(ms + b)), broken at the force signal. Each has one gain crossover,
//! so a negative phase margin, a negative delay margin and a gain margin below 1 all say the same:
//! unstable. Arguments are positive and finite; others give NaN, never a panic.

use core::f64::consts::FRAC_PI_2;

use crate::bound::{Bound, bisect, gain_crossover};
use crate::impedance::Impedance;

/// How far a loop is from oscillating for ever.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Factor on the loop gain at the stability limit (no unit); below 1 if unstable, 0 if no
    /// smaller gain is stable either.
    pub gain: f64,
    /// Phase margin in rad, at the gain crossover.
    pub phase: f64,
    /// Delay in s that may be added until the limit.
    pub delay: f64,
    /// Gain crossover in rad/s.
    pub crossover: f64,
}

/// Margins of (6.2.7), both terms delayed by `delay` s.
pub fn both_terms_delayed(impedance: &Impedance, delay: f64) -> Margins {
    let omega_n = impedance.natural_frequency();
    let zeta = impedance.damping_ratio();
    let x = gain_crossover(zeta);
    let phase = libm::atan(2.0 * zeta * x) - delay * omega_n * x;
    // Phase crossover: atan(bω/k) = τω, besides ω = 0 only if b/k > τ.
    let lead = impedance.damping / impedance.stiffness;
    let gain = if lead > delay {
        let theta = bisect(0.0, FRAC_PI_2, |theta| {
            delay * libm::sin(theta) < lead * theta * libm::cos(theta)
        });
        let omega = theta / delay;
        // 1/|L| there, |jbω + k| being k/cos θ.
        impedance.mass * omega * omega * libm::cos(theta) / impedance.stiffness
    } else {
        0.0
    };
    Margins::new(gain, phase, omega_n * x)
}

/// Margins of m s² + b s + k e^{−τs} with τ = `delay` s: the damping term is not delayed.
pub fn force_delayed(impedance: &Impedance, delay: f64) -> Margins {
    let Impedance {
        mass,
        damping,
        stiffness,
    } = *impedance;
    let crossover = impedance.natural_frequency() / gain_crossover(impedance.damping_ratio());
    let phase = libm::atan2(damping, mass * crossover) - delay * crossover;
    let gain = Bound::ForceDelayOnly.stiffness_max(mass, damping, delay) / stiffness;
    Margins::new(gain, phase, crossover)
}

impl Margins {
    fn new(gain: f64, phase: f64, crossover: f64) -> Self {
        Self {
            gain,
            phase,
            delay: phase / crossover,
            crossover,
        }
    }

    /// Whether the loop is stable.
    pub fn stable(&self) -> bool {
        self.phase > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cases() -> impl Iterator<Item = (Impedance, f64)> {
        let sets = [
            (1600.0, 8000.0, 10_000.0),
            (400.0, 4000.0, 1_800.0),
            (5.7, 477.0, 1_800.0),
            (100.0, 1000.0, 10_000.0),
        ];
        sets.into_iter().flat_map(|(mass, damping, stiffness)| {
            [0.002, 0.032, 0.128].map(|delay| {
                let impedance = Impedance {
                    mass,
                    damping,
                    stiffness,
                };
                (impedance, delay)
            })
        })
    }

    #[test]
    fn the_delay_margin_is_what_the_bound_leaves() {
        for (impedance, delay) in cases() {
            let (omega_n, zeta) = (impedance.natural_frequency(), impedance.damping_ratio());
            for (margins, bound) in [
                (both_terms_delayed(&impedance, delay), Bound::Exact),
                (force_delayed(&impedance, delay), Bound::ForceDelayOnly),
            ] {
                let left = bound.delay_max(omega_n, zeta) - delay;
                assert!((margins.delay - left).abs() < 1e-12 * left.abs().max(1.0));
            }
        }
    }

    #[test]
    fn all_margins_agree_with_the_bounds_on_which_side_of_the_limit_a_choice_is() {
        for (impedance, delay) in cases() {
            let (omega_n, zeta) = (impedance.natural_frequency(), impedance.damping_ratio());
            for (margins, bound) in [
                (both_terms_delayed(&impedance, delay), Bound::Exact),
                (force_delayed(&impedance, delay), Bound::ForceDelayOnly),
            ] {
                let stable = omega_n < bound.omega_n_max(zeta, delay);
                assert_eq!(margins.stable(), stable, "{impedance:?} {delay} {bound:?}");
                assert_eq!(
                    margins.gain > 1.0,
                    stable,
                    "{impedance:?} {delay} {bound:?}"
                );
                assert_eq!(
                    margins.delay > 0.0,
                    stable,
                    "{impedance:?} {delay} {bound:?}"
                );
            }
        }
    }

    #[test]
    fn a_gain_at_its_margin_leaves_no_phase() {
        for (impedance, delay) in cases() {
            let gain = both_terms_delayed(&impedance, delay).gain;
            if gain > 0.0 {
                let scaled = Impedance {
                    mass: impedance.mass / gain,
                    ..impedance
                };
                assert!(both_terms_delayed(&scaled, delay).phase.abs() < 1e-9);
            }
            let scaled = Impedance {
                stiffness: impedance.stiffness * force_delayed(&impedance, delay).gain,
                ..impedance
            };
            assert!(force_delayed(&scaled, delay).phase.abs() < 1e-9);
        }
    }

    #[test]
    fn without_delay_the_phase_margin_is_that_of_a_second_order_system() {
        // ζ = 0.5, force loop 1/(s(s+1)): crossover √((√5−1)/2), phase margin 51.8°.
        let impedance = Impedance {
            mass: 1.0,
            damping: 1.0,
            stiffness: 1.0,
        };
        let margins = force_delayed(&impedance, 1e-12);
        assert!((margins.phase.to_degrees() - 51.827).abs() < 1e-3);
        assert!((margins.crossover - ((5.0_f64.sqrt() - 1.0) / 2.0).sqrt()).abs() < 1e-12);
    }
}
