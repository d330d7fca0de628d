//! The exact bounds against the delay differential equations themselves, integrated in time: 1 %
//! below the bound the oscillation dies out, 1 % above it grows.

use stability::Bound;

/// Steps of the integration in one delay.
const STEPS_PER_DELAY: usize = 50;

/// ẍ(t) = −late_damping·ẋ(t−τ) − stiffness·x(t−τ) − damping·ẋ(t), per unit mass.
#[derive(Clone, Copy)]
struct DelayEquation {
    late_damping: f64,
    damping: f64,
    stiffness: f64,
    delay: f64,
}

impl DelayEquation {
    /// Ratio of the largest |x| in the last quarter to that in the second quarter of `duration`, from
    /// rest at x = 1; classical Runge–Kutta, the past at half steps by cubic Hermite interpolation.
    fn growth(self, duration: f64) -> f64 {
        let h = self.delay / STEPS_PER_DELAY as f64;
        let steps = (duration / h) as usize;
        let mut past = vec![[1.0, 0.0, 0.0]; STEPS_PER_DELAY + 1];
        let mut largest = [0.0_f64; 4];
        for i in 0..steps {
            let [x, v, _] = *past.last().unwrap();
            let (p0, p1) = (past[i], past[i + 1]);
            let middle = [
                (p0[0] + p1[0]) / 2.0 + h / 8.0 * (p0[1] - p1[1]),
                (p0[1] + p1[1]) / 2.0 + h / 8.0 * (p0[2] - p1[2]),
            ];
            let a = |v: f64, late: [f64; 2]| {
                -self.late_damping * late[1] - self.stiffness * late[0] - self.damping * v
            };
            let start = [p0[0], p0[1]];
            let (v1, a1) = (v, a(v, start));
            let (v2, a2) = (v + h / 2.0 * a1, a(v + h / 2.0 * a1, middle));
            let (v3, a3) = (v + h / 2.0 * a2, a(v + h / 2.0 * a2, middle));
            let (v4, a4) = (v + h * a3, a(v + h * a3, [p1[0], p1[1]]));
            let x = x + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            let v = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            past.push([x, v, a(v, [p1[0], p1[1]])]);
            let quarter = 4 * i / steps;
            largest[quarter] = largest[quarter].max(x.abs());
        }
        largest[3] / largest[1]
    }
}

const ZETAS: [f64; 4] = [0.5, std::f64::consts::FRAC_1_SQRT_2, 1.0, 1.4];

#[test]
fn with_both_terms_delayed_the_equation_turns_unstable_within_one_percent_of_the_exact_bound() {
    let delay = 0.128;
    for zeta in ZETAS {
        let bound = Bound::Exact.omega_n_max(zeta, delay);
        let growth = |omega_n: f64| {
            let equation = DelayEquation {
                late_damping: 2.0 * zeta * omega_n,
                damping: 0.0,
                stiffness: omega_n * omega_n,
                delay,
            };
            equation.growth(600.0 / omega_n)
        };
        assert!(growth(0.99 * bound) < 0.9, "{zeta}");
        assert!(growth(1.01 * bound) > 1.1, "{zeta}");
    }
}

#[test]
fn zeta_1_at_a_0_45_diverges_although_it_is_inside_the_published_region() {
    let delay = 0.128;
    let omega_n = 2.0 * 0.45 / delay;
    assert!(omega_n < Bound::Published.omega_n_max(1.0, delay));
    let equation = DelayEquation {
        late_damping: 2.0 * omega_n,
        damping: 0.0,
        stiffness: omega_n * omega_n,
        delay,
    };
    assert!(equation.growth(20.0) > 1e3);
}

#[test]
fn with_only_the_force_delayed_it_turns_unstable_within_one_percent_of_the_largest_stiffness() {
    for (mass, damping) in [
        (1600.0, 8000.0),
        (400.0, 4000.0),
        (5.7, 477.0),
        (100.0, 1000.0),
    ] {
        let delay = 0.128;
        let bound = Bound::ForceDelayOnly.stiffness_max(mass, damping, delay);
        let growth = |stiffness: f64| {
            let equation = DelayEquation {
                late_damping: 0.0,
                damping: damping / mass,
                stiffness: stiffness / mass,
                delay,
            };
            equation.growth(100.0)
        };
        assert!(growth(0.99 * bound) < 0.9, "{mass} {damping}");
        assert!(growth(1.01 * bound) > 1.1, "{mass} {damping}");
    }
}
