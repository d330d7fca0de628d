//! The algebra of a desired impedance m ẍ + b ẋ + k x = f (6.2.4): its natural frequency and damping
//! ratio, its response, and the impedance that has wanted ones (§6.2.1.2, §6.2.1.3).
//!
//! The same for both kinds of axis. On an impedance axis k is the desired stiffness; on a force
//! axis it is the overall stiffness of the contact, which is not chosen but met. Arguments are
//! positive and finite; others give a NaN or infinite result, never a panic.

use core::f64::consts::PI;

use crate::bound::bisect;

/// Mass in kg, damping in Ns/m and stiffness in N/m of one translational axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impedance {
    /// m, in kg.
    pub mass: f64,
    /// b, in Ns/m.
    pub damping: f64,
    /// k, in N/m.
    pub stiffness: f64,
}

impl Impedance {
    /// The impedance of the given stiffness with wanted natural frequency (rad/s) and damping ratio:
    /// m = k/ω_n² (6.2.11), b = 2ζk/ω_n (6.2.12).
    pub fn with_response(stiffness: f64, omega_n: f64, zeta: f64) -> Self {
        Self {
            mass: stiffness / (omega_n * omega_n),
            damping: 2.0 * zeta * stiffness / omega_n,
            stiffness,
        }
    }

    /// ω_n = √(k/m) in rad/s (6.2.6).
    pub fn natural_frequency(&self) -> f64 {
        (self.stiffness / self.mass).sqrt()
    }

    /// ζ = b/(2√(km)) (6.2.6).
    pub fn damping_ratio(&self) -> f64 {
        self.damping / (2.0 * (self.stiffness * self.mass).sqrt())
    }

    /// T_n = 2π/ω_n in s, what the book calls the response time.
    pub fn response_time(&self) -> f64 {
        response_time(self.natural_frequency())
    }

    /// Steady position error in m under a disturbance of `force` N: e_ss = −f_e/k (6.2.10).
    pub fn steady_error(&self, force: f64) -> f64 {
        -force / self.stiffness
    }

    /// Time in s until the step response first reaches 90 % of its final value, without delay.
    pub fn rise_time(&self) -> f64 {
        normalised_rise_time(self.damping_ratio()) / self.natural_frequency()
    }

    /// The impedance with the same stiffness and damping ratio whose response time is `ratio` times
    /// this one's: m₂ = m₁ (T₂/T₁)² (6.2.15) and b₂ = b₁ √(m₂/m₁) (6.2.16). The stiffness need not be known.
    pub fn rescaled(&self, ratio: f64) -> Self {
        Self {
            mass: self.mass * ratio * ratio,
            damping: self.damping * ratio,
            stiffness: self.stiffness,
        }
    }
}

/// The stiffness in N/m that keeps the steady error under a disturbance of `force` N at `error` m
/// (6.2.10), signs left aside.
pub fn stiffness_for_error(force: f64, error: f64) -> f64 {
    (force / error).abs()
}

/// T_n = 2π/ω_n in s for ω_n in rad/s; its own inverse, so it also gives ω_n for T_n.
pub fn response_time(omega_n: f64) -> f64 {
    2.0 * PI / omega_n
}

/// ω_n t at which the unit step response of s² + 2ζω_n s + ω_n² first reaches 0.9.
fn normalised_rise_time(zeta: f64) -> f64 {
    // Up to its first peak, or for ever if ζ ≥ 1, the response rises; it is slower than the
    // slower of its two modes alone, 2ζ ln 10, by less than 2ζ + 4.
    let end = if zeta < 1.0 {
        PI / (1.0 - zeta * zeta).sqrt()
    } else {
        8.0 * zeta + 8.0
    };
    bisect(0.0, end, |t| step_response(zeta, t) < 0.9)
}

/// Unit step response of s² + 2ζs + 1 at t.
fn step_response(zeta: f64, t: f64) -> f64 {
    let discriminant = zeta * zeta - 1.0;
    let decay = libm::exp(-zeta * t);
    // x = 1 − e^{−ζt}(c + ζ s), with c and s the (hyperbolic) cosine and sine over their frequency.
    if discriminant.abs() < 1e-9 {
        1.0 - decay * (1.0 + zeta * t)
    } else if discriminant < 0.0 {
        let omega_d = (-discriminant).sqrt();
        1.0 - decay * (libm::cos(omega_d * t) + zeta / omega_d * libm::sin(omega_d * t))
    } else {
        let root = discriminant.sqrt();
        // Written with the two modes, for cosh would overflow: slow = ζ − root without cancellation.
        let fast = zeta + root;
        let slow = 1.0 / fast;
        1.0 - (fast * libm::exp(-slow * t) - slow * libm::exp(-fast * t)) / (2.0 * root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn impedance(mass: f64, damping: f64, stiffness: f64) -> Impedance {
        Impedance {
            mass,
            damping,
            stiffness,
        }
    }

    #[test]
    fn figure_6_3_and_the_strawman_tasks_have_the_printed_responses() {
        let figure_6_3 = impedance(112.0, 700.0, 1100.0);
        assert!((figure_6_3.damping_ratio() - 0.997).abs() < 5e-4);
        assert!((figure_6_3.response_time() - 2.005).abs() < 5e-4);
        let cleaning = impedance(257.0, 1100.0, 1100.0);
        assert!((cleaning.damping_ratio() - 1.03).abs() < 5e-3);
        assert!((cleaning.response_time() - 3.03).abs() < 8e-3);
    }

    #[test]
    fn the_first_force_impedance_follows_from_omega_n_2_5_zeta_1_and_10_kn_per_m() {
        let first = Impedance::with_response(10_000.0, 2.5, 1.0);
        assert!((first.mass - 1600.0).abs() < 1e-9);
        assert!((first.damping - 8000.0).abs() < 1e-9);
        assert!((first.response_time() - 2.513).abs() < 5e-4);
    }

    #[test]
    fn halving_the_response_time_quarters_the_mass_and_halves_the_damping() {
        let second = impedance(1600.0, 8000.0, 10_000.0).rescaled(0.5);
        assert_eq!(second, impedance(400.0, 4000.0, 10_000.0));
        assert!((second.damping_ratio() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_wanted_response_is_the_one_the_impedance_has() {
        for zeta in [0.1, 0.7, 1.0, 1.4, 5.0] {
            for omega_n in [0.3, 2.5, 400.0] {
                let made = Impedance::with_response(1100.0, omega_n, zeta);
                assert!((made.natural_frequency() / omega_n - 1.0).abs() < 1e-14);
                assert!((made.damping_ratio() / zeta - 1.0).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_stiffness_for_an_error_gives_that_error() {
        let stiffness = stiffness_for_error(22.0, 0.02);
        assert!((stiffness - 1100.0).abs() < 1e-9);
        assert!((impedance(1.0, 1.0, stiffness).steady_error(22.0) + 0.02).abs() < 1e-15);
    }

    #[test]
    fn the_chosen_set_after_figure_6_6_is_critically_damped_at_10_kn_per_m() {
        assert!((impedance(5.7, 477.0, 10_000.0).damping_ratio() - 1.0).abs() < 2e-3);
    }

    #[test]
    fn figures_6_5_and_6_6_read_as_90_percent_rise_give_the_same_contact_stiffness() {
        let rise = |m, b| impedance(m, b, 1800.0).rise_time();
        assert!(
            (rise(1600.0, 8000.0) / 10.0 - 1.0).abs() < 0.03,
            "{}",
            rise(1600.0, 8000.0)
        );
        assert!(
            (rise(400.0, 4000.0) / 5.0 - 1.0).abs() < 0.03,
            "{}",
            rise(400.0, 4000.0)
        );
    }

    #[test]
    fn the_rise_time_is_that_of_the_integrated_step_response() {
        for zeta in [0.05, 0.5, 0.999_999, 1.0, 1.000_001, 1.4, 8.0, 50.0] {
            let rise = normalised_rise_time(zeta);
            // Classical Runge–Kutta of ẍ + 2ζẋ + x = 1 up to that time.
            let steps = 40_000;
            let h = rise / f64::from(steps);
            let (mut x, mut v) = (0.0, 0.0);
            let a = |x: f64, v: f64| 1.0 - 2.0 * zeta * v - x;
            for _ in 0..steps {
                let (x1, v1) = (v, a(x, v));
                let (x2, v2) = (v + h / 2.0 * v1, a(x + h / 2.0 * x1, v + h / 2.0 * v1));
                let (x3, v3) = (v + h / 2.0 * v2, a(x + h / 2.0 * x2, v + h / 2.0 * v2));
                let (x4, v4) = (v + h * v3, a(x + h * x3, v + h * v3));
                x += h / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
                v += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
                assert!(x < 0.9 + 1e-6, "{zeta}: earlier crossing");
            }
            assert!((x - 0.9).abs() < 1e-6, "{zeta}: {x}");
        }
    }
}
