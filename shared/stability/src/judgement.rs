//! What theory says of one impedance under one delay: every [`Bound`] with its verdict, and the
//! margins of both loops. The whole of `vmerack design`'s answer for an axis, without its words.
//!
//! Arguments are positive and finite; others give a judgement without meaning, never a panic.

use crate::bound::Bound;
use crate::impedance::Impedance;
use crate::margins::{self, Margins};

/// One bound applied to an impedance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundJudgement {
    /// Which bound.
    pub bound: Bound,
    /// Largest ω_n in rad/s at the impedance's damping ratio.
    pub omega_n_max: f64,
    /// Largest stiffness in N/m at the impedance's mass and damping.
    pub stiffness_max: f64,
    /// Whether this bound calls the impedance stable.
    pub stable: bool,
}

/// How safe an impedance is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Below the exact bound, so stable whichever signals are delayed.
    Safe,
    /// Stable if only the force is delayed, unstable if the damping term is delayed too.
    SafeIfOnlyForceIsDelayed,
    /// Unstable in both.
    Unstable,
}

/// Everything said of one impedance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// The impedance judged.
    pub impedance: Impedance,
    /// In the order of [`Bound::ALL`].
    pub bounds: [BoundJudgement; 4],
    /// Margins with both terms delayed.
    pub both_terms_delayed: Margins,
    /// Margins with only the force delayed.
    pub force_delayed: Margins,
    /// What it comes to.
    pub verdict: Verdict,
}

/// Judges `impedance` under the whole loop `delay` τ = 2T_s in s.
pub fn judge(impedance: &Impedance, delay: f64) -> Judgement {
    let (omega_n, zeta) = (impedance.natural_frequency(), impedance.damping_ratio());
    let bounds = Bound::ALL.map(|bound| {
        let omega_n_max = bound.omega_n_max(zeta, delay);
        BoundJudgement {
            bound,
            omega_n_max,
            stiffness_max: bound.stiffness_max(impedance.mass, impedance.damping, delay),
            stable: omega_n < omega_n_max,
        }
    });
    let stable = |bound: Bound| omega_n < bound.omega_n_max(zeta, delay);
    let verdict = if stable(Bound::Exact) {
        Verdict::Safe
    } else if stable(Bound::ForceDelayOnly) {
        Verdict::SafeIfOnlyForceIsDelayed
    } else {
        Verdict::Unstable
    };
    Judgement {
        impedance: *impedance,
        bounds,
        both_terms_delayed: margins::both_terms_delayed(impedance, delay),
        force_delayed: margins::force_delayed(impedance, delay),
        verdict,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(mass: f64, damping: f64, stiffness: f64, delay: f64) -> Verdict {
        let impedance = Impedance {
            mass,
            damping,
            stiffness,
        };
        judge(&impedance, delay).verdict
    }

    #[test]
    fn the_books_first_choice_is_safe_and_its_last_only_on_a_soft_contact() {
        assert_eq!(verdict(1600.0, 8000.0, 10_000.0, 0.128), Verdict::Safe);
        // k_e ≈ 1.8 kN/m is what the experiment met; 10 kN/m what the design assumed.
        assert_eq!(
            verdict(5.7, 477.0, 1_800.0, 0.128),
            Verdict::SafeIfOnlyForceIsDelayed
        );
        assert_eq!(verdict(5.7, 477.0, 10_000.0, 0.128), Verdict::Unstable);
    }

    #[test]
    fn each_bound_decides_the_same_by_natural_frequency_and_by_stiffness() {
        for stiffness in [100.0, 1_800.0, 5_000.0, 10_000.0, 80_000.0] {
            for (mass, damping) in [(1600.0, 8000.0), (400.0, 4000.0), (100.0, 1000.0)] {
                let impedance = Impedance {
                    mass,
                    damping,
                    stiffness,
                };
                for judged in judge(&impedance, 0.128).bounds {
                    let by_stiffness = stiffness < judged.stiffness_max;
                    assert_eq!(judged.stable, by_stiffness, "{impedance:?} {judged:?}");
                }
            }
        }
    }
}
