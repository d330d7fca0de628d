//! Each bound against the number of characteristic roots in the right half-plane, counted by the argument
//! principle: none 1 % below the bound, two 1 % above. The count knows nothing of the closed
//! forms: it follows the curve D(jω) of the characteristic function itself (Mikhailov).

use std::f64::consts::PI;

use stability::cascade::Filter;
use stability::{Bound, Impedance, margins};

type Complex = (f64, f64);

fn times(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn plus(a: Complex, b: Complex) -> Complex {
    (a.0 + b.0, a.1 + b.1)
}

fn scaled(factor: f64, a: Complex) -> Complex {
    (factor * a.0, factor * a.1)
}

/// e^{−jφ}.
fn lag(phi: f64) -> Complex {
    (phi.cos(), -phi.sin())
}

/// Roots with a positive real part of a characteristic function of the given order (retarded type,
/// real coefficients): order/2 less the turns of D(jω) over ω = 0 … ∞, in half turns.
fn unstable_roots(order: u32, scale: f64, d: impl Fn(f64) -> Complex) -> i64 {
    let (mut omega, mut turned, mut last) = (0.0, 0.0, d(0.0));
    while omega < 1e4 * scale {
        omega += 2e-4 * (scale + omega);
        let next = d(omega);
        let step = times(next, (last.0, -last.1));
        let angle = step.1.atan2(step.0);
        assert!(
            angle.abs() < 1.5,
            "the curve is followed too coarsely at {omega}"
        );
        turned += angle;
        last = next;
    }
    let roots = f64::from(order) / 2.0 - turned / PI;
    assert!((roots - roots.round()).abs() < 0.05, "{roots} roots");
    roots.round() as i64
}

/// (6.2.7): s² + (2ζω_n s + ω_n²) e^{−τs}.
fn both_delayed(zeta: f64, omega_n: f64, delay: f64) -> impl Fn(f64) -> Complex {
    move |w| {
        let feedback = times(
            (omega_n * omega_n, 2.0 * zeta * omega_n * w),
            lag(delay * w),
        );
        plus((-w * w, 0.0), feedback)
    }
}

/// (6.2.8): T s³ + (1 − 2ζω_n T) s² + (2ζω_n − Tω_n²) s + ω_n².
fn pade(zeta: f64, omega_n: f64, t: f64) -> impl Fn(f64) -> Complex {
    let beta = 2.0 * zeta * omega_n;
    let k = omega_n * omega_n;
    move |w| {
        (
            k - (1.0 - beta * t) * w * w,
            (beta - t * k) * w - t * w * w * w,
        )
    }
}

/// m s² + b s + k e^{−τs}.
fn force_delayed(m: f64, b: f64, k: f64, delay: f64) -> impl Fn(f64) -> Complex {
    move |w| plus((-m * w * w, b * w), scaled(k, lag(delay * w)))
}

const ZETAS: [f64; 8] = [
    0.1,
    0.3,
    0.5,
    std::f64::consts::FRAC_1_SQRT_2,
    1.0,
    1.4,
    2.0,
    4.0,
];
const SETS: [(f64, f64); 4] = [
    (1600.0, 8000.0),
    (400.0, 4000.0),
    (5.7, 477.0),
    (100.0, 1000.0),
];

#[test]
fn two_roots_cross_at_the_exact_bound() {
    let delay = 0.01;
    for zeta in ZETAS {
        let bound = Bound::Exact.omega_n_max(zeta, delay);
        let roots = |w| unstable_roots(2, w, both_delayed(zeta, w, delay));
        assert_eq!((roots(0.99 * bound), roots(1.01 * bound)), (0, 2), "{zeta}");
    }
}

#[test]
fn two_roots_of_the_pade_form_cross_at_the_full_routh_bound() {
    let delay = 0.01;
    for zeta in ZETAS {
        let bound = Bound::Pade.omega_n_max(zeta, delay);
        let roots = |w| unstable_roots(3, w, pade(zeta, w, delay / 2.0));
        assert_eq!((roots(0.99 * bound), roots(1.01 * bound)), (0, 2), "{zeta}");
    }
}

#[test]
fn the_published_bound_admits_points_that_are_unstable_even_in_its_own_approximation() {
    let delay = 0.01;
    let inside = 0.99 * Bound::Published.omega_n_max(1.0, delay);
    assert_eq!(unstable_roots(3, inside, pade(1.0, inside, delay / 2.0)), 2);
    // ζ = 1, a = 0.45: inside the published region, unstable in truth.
    let omega_n = 2.0 * 0.45 / delay;
    assert!(omega_n < Bound::Published.omega_n_max(1.0, delay));
    assert_eq!(
        unstable_roots(2, omega_n, both_delayed(1.0, omega_n, delay)),
        2
    );
}

#[test]
fn two_roots_cross_at_the_force_delay_bound_in_both_of_its_forms() {
    let delay = 0.01;
    for zeta in ZETAS {
        let bound = Bound::ForceDelayOnly.omega_n_max(zeta, delay);
        let roots = |w| unstable_roots(2, w, force_delayed(1.0, 2.0 * zeta * w, w * w, delay));
        assert_eq!((roots(0.99 * bound), roots(1.01 * bound)), (0, 2), "{zeta}");
    }
    for (m, b) in SETS {
        for delay in [0.128, 0.032, 0.008, 0.002] {
            let bound = Bound::ForceDelayOnly.stiffness_max(m, b, delay);
            let roots = |k: f64| unstable_roots(2, (k / m).sqrt(), force_delayed(m, b, k, delay));
            assert_eq!(
                (roots(0.99 * bound), roots(1.01 * bound)),
                (0, 2),
                "{m} {b} {delay}"
            );
        }
    }
}

#[test]
fn two_roots_cross_at_the_largest_stiffness_of_a_mass_and_damping_with_both_terms_delayed() {
    for (m, b) in SETS {
        for delay in [0.032, 0.008, 0.002] {
            let bound = Bound::Exact.stiffness_max(m, b, delay);
            if bound == 0.0 {
                continue;
            }
            let roots = |k: f64| {
                let (omega_n, zeta) = ((k / m).sqrt(), b / (2.0 * (k * m).sqrt()));
                unstable_roots(2, omega_n, both_delayed(zeta, omega_n, delay))
            };
            assert_eq!(
                (roots(0.99 * bound), roots(1.01 * bound)),
                (0, 2),
                "{m} {b} {delay}"
            );
        }
    }
    // Where no stiffness is stable, even a soft one is not: b τ/m = 477/5.7 · 0.128 > π/2.
    assert_eq!(Bound::Exact.stiffness_max(5.7, 477.0, 0.128), 0.0);
    let (omega_n, zeta) = (1.0, 477.0 / 5.7 / 2.0);
    assert!(unstable_roots(2, omega_n, both_delayed(zeta, omega_n, 0.128)) > 0);
}

#[test]
fn two_roots_cross_at_the_largest_stiffness_behind_the_filter_cascade() {
    let filter = Filter::number(4).unwrap();
    let hold = 0.0025;
    for (m, b) in SETS {
        let bound = filter.contact_stiffness_max(m, b, hold);
        let roots = |k: f64| {
            unstable_roots(2, (k / m).sqrt(), |w| {
                let response = scaled(filter.gain(w), lag((filter.delay() + hold) * w));
                plus((-m * w * w, b * w), scaled(k, response))
            })
        };
        assert_eq!(
            (roots(0.99 * bound), roots(1.01 * bound)),
            (0, 2),
            "{m} {b}"
        );
    }
}

#[test]
fn gain_and_phase_margins_end_where_roots_cross() {
    let delay = 0.02;
    for zeta in [0.5, 1.0, 1.4] {
        let impedance = Impedance::with_response(1000.0, 6.0, zeta);
        let (m, b, k) = (impedance.mass, impedance.damping, impedance.stiffness);
        let both = margins::both_terms_delayed(&impedance, delay);
        let force = margins::force_delayed(&impedance, delay);
        // The gain g and the phase φ put into the feedback, as complex factors of it.
        let with_both = |g: f64, phi: f64| {
            move |w: f64| {
                let feedback = scaled(g, times((k, b * w), lag(delay * w + phi)));
                plus((-m * w * w, 0.0), feedback)
            }
        };
        let with_force = |g: f64, phi: f64| {
            move |w: f64| plus((-m * w * w, b * w), scaled(g * k, lag(delay * w + phi)))
        };
        let roots_both = |g: f64| unstable_roots(2, 6.0, with_both(g, 0.0));
        let roots_force = |g: f64| unstable_roots(2, 6.0, with_force(g, 0.0));
        assert_eq!(
            (roots_both(0.99 * both.gain), roots_both(1.01 * both.gain)),
            (0, 2)
        );
        assert_eq!(
            (
                roots_force(0.99 * force.gain),
                roots_force(1.01 * force.gain)
            ),
            (0, 2)
        );
        // A phase lag has no real characteristic function: look at the root on the axis itself.
        let (re, im) = with_both(1.0, both.phase)(both.crossover);
        assert!(re.hypot(im) < 1e-9 * k);
        let (re, im) = with_force(1.0, force.phase)(force.crossover);
        assert!(re.hypot(im) < 1e-9 * k);
    }
}
