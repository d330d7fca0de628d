//! The four stability bounds of an impedance whose feedback arrives late by a delay τ = 2T_s
//! (§6.2.1.1), each for a given damping ratio and for a given mass and damping.
//!
//! | bound | model | worth |
//! |---|---|---|
//! | `Published` | (6.2.9), signs of the coefficients of the Padé form | necessary, not sufficient |
//! | `Pade` | whole Routh criterion on the Padé form | optimistic |
//! | `Exact` | (6.2.7) with the true delay in both terms | safe in every case |
//! | `ForceDelayOnly` | m s² + b s + k_e e^{−τs}: the damping term is not late | safe for the modified AHIC, which damps with its own integrated velocity |
//!
//! At the same ζ they are ordered `Exact` < `Pade` < `Published` and `Exact` < `ForceDelayOnly`. The
//! delay is the whole one round the loop; a zero-order hold adds half its period, see
//! [`effective_delay`]. Arguments are positive and finite; others give a result without meaning
//! (NaN, 0 or infinite), never a panic or an endless loop. All bounds are the supremum: at the bound itself
//! the loop oscillates for ever.

use core::f64::consts::FRAC_PI_2;

/// A stability bound; the module's head tells them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bound {
    /// (6.2.9) as printed.
    Published,
    /// All of Routh's conditions on the characteristic equation (6.2.8).
    Pade,
    /// The true delay in (6.2.7).
    Exact,
    /// Only the force, and so only the stiffness term, is delayed.
    ForceDelayOnly,
}

impl Bound {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 4] = [
        Self::Published,
        Self::Pade,
        Self::Exact,
        Self::ForceDelayOnly,
    ];

    /// Its name in tables and JSON.
    pub fn key(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Pade => "pade",
            Self::Exact => "exact",
            Self::ForceDelayOnly => "force_delay_only",
        }
    }

    /// The largest a = ω_n T_s = ω_n τ/2 at damping ratio `zeta`.
    pub fn a_max(self, zeta: f64) -> f64 {
        let zeta2 = zeta * zeta;
        let x = gain_crossover(zeta);
        match self {
            // 1 − 2ζa > 0 and 2ζ − a > 0.
            Self::Published => (1.0 / (2.0 * zeta)).min(2.0 * zeta),
            // Those, and (1 − 2ζa)(2ζ − a) > a; [1 + 2ζ² − √(1+4ζ⁴)]/(2ζ) without the cancellation.
            Self::Pade => 2.0 * zeta / (1.0 + 2.0 * zeta2 + (1.0 + 4.0 * zeta2 * zeta2).sqrt()),
            Self::Exact => libm::atan(2.0 * zeta * x) / (2.0 * x),
            // Its gain crossover is at 1/x.
            Self::ForceDelayOnly => libm::atan(2.0 * zeta * x) * x / 2.0,
        }
    }

    /// The largest natural frequency in rad/s at damping ratio `zeta` under a `delay` of τ = 2T_s s.
    pub fn omega_n_max(self, zeta: f64, delay: f64) -> f64 {
        2.0 * self.a_max(zeta) / delay
    }

    /// The largest delay τ = 2T_s in s that natural frequency `omega_n` (rad/s) and `zeta` bear.
    pub fn delay_max(self, omega_n: f64, zeta: f64) -> f64 {
        2.0 * self.a_max(zeta) / omega_n
    }

    /// The largest stiffness in N/m that `mass` (kg) and `damping` (Ns/m) bear under `delay` (s): the
    /// largest safe contact stiffness of a force axis. Both ω_n and ζ move with it. 0 if none is
    /// stable, the damping alone being too large for the delay.
    pub fn stiffness_max(self, mass: f64, damping: f64, delay: f64) -> f64 {
        let beta_tau = damping / mass * delay;
        match self {
            // 2ζω_n T_s < 1, ω_n² T_s < 2ζω_n; with T_s = τ/2.
            Self::Published if beta_tau < 2.0 => 2.0 * damping / delay,
            Self::Pade if beta_tau < 2.0 => {
                2.0 * damping / delay * (2.0 - beta_tau) / (4.0 - beta_tau)
            }
            Self::Published | Self::Pade => 0.0,
            // At the bound s = jω: m ω² cos ωτ = k, m ω sin ωτ = b.
            Self::Exact if beta_tau < FRAC_PI_2 => {
                let theta = bisect(0.0, FRAC_PI_2, |theta| theta * libm::sin(theta) < beta_tau);
                let omega = theta / delay;
                mass * omega * omega * libm::cos(theta)
            }
            Self::Exact => 0.0,
            // At the bound: k sin ωτ = b ω, k cos ωτ = m ω².
            Self::ForceDelayOnly => {
                let theta = force_crossover(beta_tau);
                damping * theta / (delay * libm::sin(theta))
            }
        }
    }
}

/// The delay in s that a sampled loop behaves as having: `delay` and, for the zero-order hold of the
/// command, half of `period`. Good while the crossover is far below the sampling frequency.
pub fn effective_delay(delay: f64, period: f64) -> f64 {
    delay + period / 2.0
}

/// x = ω/ω_n where |(2ζω_n jω + ω_n²)/ω²| = 1.
pub(crate) fn gain_crossover(zeta: f64) -> f64 {
    let zeta2 = zeta * zeta;
    (2.0 * zeta2 + (4.0 * zeta2 * zeta2 + 1.0).sqrt()).sqrt()
}

/// θ = ωτ where the phase of e^{−τs}/(s(ms + b)) is −180°: θ tan θ = bτ/m.
pub(crate) fn force_crossover(beta_tau: f64) -> f64 {
    bisect(0.0, FRAC_PI_2, |theta| {
        theta * libm::sin(theta) < beta_tau * libm::cos(theta)
    })
}

/// Where `below` turns from true to false between `low` and `high`, to the last bit.
pub(crate) fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    // Halving 128 times ends at neighbouring numbers unless the root is under 2⁻⁷⁵ of the interval.
    for _ in 0..128 {
        let middle = low + (high - low) / 2.0;
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low + (high - low) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const ZETAS: [f64; 4] = [0.5, core::f64::consts::FRAC_1_SQRT_2, 1.0, 1.4];

    fn assert_row(bound: Bound, row: [f64; 4]) {
        for (zeta, a) in ZETAS.into_iter().zip(row) {
            assert!((bound.a_max(zeta) - a).abs() < 6e-5, "{bound:?} {zeta}");
        }
    }

    #[test]
    fn the_table_of_bounds_over_zeta_is_reproduced() {
        assert_row(Bound::Published, [1.0, ZETAS[1], 0.5, 0.3571]);
        assert_row(Bound::Pade, [0.3820, 0.4142, 0.3820, 0.3123]);
        assert_row(Bound::Exact, [0.3556, 0.3680, 0.3237, 0.2560]);
    }

    #[test]
    fn the_table_of_contact_stiffness_over_delay_is_reproduced() {
        let delays = [0.128, 0.032, 0.008, 0.002];
        let table = [
            ((1600.0, 8000.0), [68.3e3, 256e3, 1.0e6, 4.0e6]),
            ((400.0, 4000.0), [36.4e3, 131e3, 507e3, 2.0e6]),
            ((5.7, 477.0), [5.4e3, 18.9e3, 65e3, 245e3]),
            ((100.0, 1000.0), [9.1e3, 32.8e3, 127e3, 502e3]),
        ];
        for ((m, b), row) in table {
            for (delay, expected) in delays.into_iter().zip(row) {
                let k = Bound::ForceDelayOnly.stiffness_max(m, b, delay);
                assert!((k / expected - 1.0).abs() < 0.011, "{m} {b} {delay}: {k}");
            }
        }
    }

    #[test]
    fn figure_6_2_and_6_2_14_are_the_published_bound() {
        // Figure 6.2, T_s = 5 ms: 200 rad/s at ζ = 0.5, its peak; the axis ends at 400.
        assert!((Bound::Published.omega_n_max(0.5, 0.010) - 200.0).abs() < 1e-9);
        assert!((Bound::Published.omega_n_max(1.0, 0.010) - 100.0).abs() < 1e-9);
        // (6.2.14) puts T_s, not 2T_s, equal to the delay of 0.128 s.
        assert!((Bound::Published.omega_n_max(1.0, 2.0 * 0.128) - 3.9).abs() < 0.01);
    }

    #[test]
    fn the_pade_bound_is_optimistic_by_at_most_a_quarter_up_to_zeta_1_6() {
        for i in 1..=160 {
            let zeta = f64::from(i) / 100.0;
            let excess = Bound::Pade.a_max(zeta) / Bound::Exact.a_max(zeta);
            assert!(excess > 1.0 && excess < 1.25, "{zeta}: {excess}");
        }
    }

    #[test]
    fn the_exact_bound_is_the_strictest_at_every_damping_ratio() {
        for i in 1..=1000 {
            let zeta = f64::from(i) / 100.0;
            let a = |bound: Bound| bound.a_max(zeta);
            assert!(a(Bound::Exact) < a(Bound::Pade), "{zeta}");
            assert!(a(Bound::Pade) < a(Bound::Published), "{zeta}");
            assert!(a(Bound::Exact) < a(Bound::ForceDelayOnly), "{zeta}");
        }
    }

    #[test]
    fn fixed_damping_ratio_and_fixed_mass_and_damping_meet_at_the_same_bound() {
        for bound in Bound::ALL {
            for i in 1..=60 {
                let zeta = f64::from(i) / 20.0;
                let (delay, mass) = (0.128, 5.7);
                // At its first limit 2ζa = 1 the published bound does not depend on the stiffness.
                if bound == Bound::Published && zeta >= 0.5 {
                    continue;
                }
                let omega_n = bound.omega_n_max(zeta, delay);
                let damping = 2.0 * zeta * omega_n * mass;
                let k = bound.stiffness_max(mass, damping, delay);
                let expected = mass * omega_n * omega_n;
                assert!((k / expected - 1.0).abs() < 1e-9, "{bound:?} {zeta}");
            }
        }
    }

    #[test]
    fn more_damping_than_the_delay_bears_leaves_no_stable_stiffness() {
        let (mass, delay) = (1.0, 0.1);
        for bound in [Bound::Published, Bound::Pade, Bound::Exact] {
            assert_eq!(bound.stiffness_max(mass, 21.0, delay), 0.0, "{bound:?}");
        }
        assert!(Bound::ForceDelayOnly.stiffness_max(mass, 21.0, delay) > 0.0);
    }

    #[test]
    fn delay_and_natural_frequency_bounds_are_inverse() {
        for bound in Bound::ALL {
            let omega_n = bound.omega_n_max(0.7, 0.05);
            assert!((bound.delay_max(omega_n, 0.7) - 0.05).abs() < 1e-15);
        }
    }

    #[test]
    fn senseless_arguments_neither_panic_nor_hang() {
        for bound in Bound::ALL {
            for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
                let _ = bound.a_max(bad);
                let _ = bound.stiffness_max(bad, 1.0, 1.0);
                let _ = bound.stiffness_max(1.0, bad, 1.0);
                let _ = bound.stiffness_max(1.0, 1.0, bad);
            }
        }
    }
}
