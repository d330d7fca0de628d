//! The ideal impedance along one axis, beside which runs are drawn.
//!
//! M(ẍ − S ẍ_d) + B(ẋ − S ẋ_d) + K S (x − x_d) = (1 − S) F_d − f_e with a unilateral spring surface
//! f_e = k_e p (1 + 1.5 c ṗ), p the penetration, at the scenario's gap: what the arm would do if it were nothing but
//! the impedance commanded. Fourth-order Runge–Kutta in steps far below every time constant.

use crate::series::Series;
use scenario::{Path, ResolvedSegment, Scenario};

/// Time between two stored samples, s.
const SAMPLE_S: f64 = 1e-3;
/// Longest integration step, s.
const STEP_S: f64 = 50e-6;

/// Position and force of the ideal impedance.
#[derive(Clone, Debug, Default)]
pub struct Ideal {
    /// Position along the axis, m.
    pub position: Series,
    /// Force on the environment, N.
    pub force: Series,
}

/// Where the axis meets a surface.
#[derive(Clone, Copy, Debug)]
struct Wall {
    position: f64,
    /// Cosine between the axis and the inward normal.
    cosine: f64,
    stiffness: f64,
    damping: f64,
}

impl Wall {
    /// Force along the axis.
    fn force(&self, x: f64, v: f64) -> f64 {
        let depth = (x - self.position) * self.cosine;
        if depth <= 0.0 {
            return 0.0;
        }
        let speed = v * self.cosine;
        (self.stiffness * depth * (1.0 + 1.5 * self.damping * speed)).max(0.0) * self.cosine
    }
}

/// The first surface ahead of the start along the axis.
fn wall(scenario: &Scenario, axis: usize) -> Option<Wall> {
    let start = scenario.arm.start_position_m;
    let walls = scenario.surfaces.iter().filter_map(|surface| {
        let normal = surface.normal();
        let cosine = -normal[axis];
        // a surface seen from the side is none for this axis
        (cosine > 0.1).then(|| {
            let to_plane: f64 = (0..3).map(|i| normal[i] * (surface.position_m[i] - start[i])).sum();
            Wall {
                position: start[axis] - to_plane / cosine,
                cosine,
                stiffness: surface.stiffness_n_per_m,
                damping: surface.hunt_crossley_s_per_m,
            }
        })
    });
    walls.min_by(|a, b| a.position.total_cmp(&b.position))
}

/// The response over `segments` up to `until` s. `desired` is X_d along the axis, as it was commanded.
pub fn ideal(scenario: &Scenario, segments: &[ResolvedSegment], axis: usize, desired: &Series, until: f64) -> Ideal {
    let wall = wall(scenario, axis);
    let mut response = Ideal::default();
    let mut x = scenario.arm.start_position_m[axis];
    let mut v = 0.0;
    for segment in segments.iter().filter(|segment| segment.start_s < until) {
        let (mass, damping, stiffness) = (segment.mass[axis], segment.damping[axis], segment.stiffness[axis]);
        let impedance = segment.selection[axis] != 0;
        // X_d stands still, or moves as recorded; on a force axis it does not count
        let moving = impedance && matches!(segment.path, Path::PointToPoint | Path::Line);
        let desired_at = |t: f64| match () {
            () if !impedance => 0.0,
            () if moving => desired.at(t).unwrap_or(segment.position_m[axis]),
            () => segment.position_m[axis],
        };
        let (spring, push) = if impedance { (stiffness, 0.0) } else { (0.0, segment.force[axis]) };
        // y = x − S x_d: its equation needs no derivative of x_d
        let acceleration = |t: f64, y: f64, u: f64| {
            let contact = wall.map_or(0.0, |wall| wall.force(y + desired_at(t), u));
            (push - damping * u - spring * y - contact) / mass
        };
        let end = segment.end_s.min(until);
        let samples = ((end - segment.start_s) / SAMPLE_S).round().max(1.0) as usize;
        let between = (end - segment.start_s) / samples as f64;
        let total_stiffness = spring + wall.map_or(0.0, |wall| wall.stiffness);
        let fastest = (mass / total_stiffness.max(1e-9)).sqrt().min(mass / damping.max(1e-9));
        let steps = (between / STEP_S.min(0.05 * fastest)).ceil().clamp(1.0, 10_000.0) as usize;
        let h = between / steps as f64;
        let mut y = x - desired_at(segment.start_s);
        for sample in 0..=samples {
            let t0 = segment.start_s + sample as f64 * between;
            x = y + desired_at(t0);
            response.position.push(t0, x);
            response.force.push(t0, wall.map_or(0.0, |wall| wall.force(x, v)));
            if sample == samples {
                break;
            }
            for step in 0..steps {
                let t = t0 + step as f64 * h;
                let (k1y, k1v) = (v, acceleration(t, y, v));
                let (k2y, k2v) = (v + 0.5 * h * k1v, acceleration(t + 0.5 * h, y + 0.5 * h * k1y, v + 0.5 * h * k1v));
                let (k3y, k3v) = (v + 0.5 * h * k2v, acceleration(t + 0.5 * h, y + 0.5 * h * k2y, v + 0.5 * h * k2v));
                let (k4y, k4v) = (v + h * k3v, acceleration(t + h, y + h * k3y, v + h * k3v));
                y += h / 6.0 * (k1y + 2.0 * k2y + 2.0 * k3y + k4y);
                v += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v);
            }
        }
        if moving {
            v += (desired_at(end) - desired_at(end - SAMPLE_S)) / SAMPLE_S;
        }
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table_5_3() -> Scenario {
        scenario::load("table-5-3", &[]).unwrap().scenario().unwrap()
    }

    fn response(scenario: &Scenario) -> Ideal {
        ideal(scenario, &scenario.resolved_segments(), 2, &Series::default(), scenario.duration())
    }

    /// Figures of Table 5-3 that were found by an independent computation: first peak at a gap of 5 mm, peak after the
    /// step to 80 N, dip after the step to 40 N.
    #[test]
    fn the_peaks_of_table_5_3_are_74_8_and_83_3_n_and_the_dip_33_5_n() {
        let force = response(&table_5_3()).force;
        let greatest = |from, until| force.greatest(from, until, |_, y| Some(y)).unwrap();
        assert!((greatest(1.0, 4.0) - 74.8).abs() < 0.1, "{}", greatest(1.0, 4.0));
        assert!((greatest(4.0, 7.0) - 83.3).abs() < 0.1, "{}", greatest(4.0, 7.0));
        let dip = -force.greatest(7.0, 10.0, |_, y| Some(-y)).unwrap();
        assert!((dip - 33.5).abs() < 0.1, "{dip}");
        assert!((force.at(13.0).unwrap()).abs() < 0.1);
    }

    #[test]
    fn in_contact_it_is_the_closed_form_of_a_damped_oscillator() {
        let scenario = table_5_3();
        let force = response(&scenario).force;
        // from the steady 60 N the step to 80 N: ω = √(k_e/M) = 10 1/s, ζ = B/(2√(M k_e)) = 0.5
        let (omega, zeta): (f64, f64) = (10.0, 0.5);
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        for i in 0..200 {
            let t = 0.01 * f64::from(i);
            let decay = libm::exp(-zeta * omega * t);
            let step = 1.0 - decay * (libm::cos(damped * t) + zeta * omega / damped * libm::sin(damped * t));
            let expected = 60.0 + 20.0 * step;
            let actual = force.at(4.0 + t).unwrap();
            assert!((actual - expected).abs() < 2e-3, "{t} s: {actual} N, expected {expected} N");
        }
    }

    #[test]
    fn a_position_step_follows_the_critically_damped_closed_form() {
        let mut scenario = table_5_3();
        scenario.surfaces.clear();
        scenario.segments.truncate(1);
        let segment = &mut scenario.segments[0];
        segment.until_s = 2.0;
        segment.path = Path::Step;
        segment.position_m = Some([0.0, 0.0, 0.13]);
        segment.mass_kg = Some([1.0; 3]);
        segment.damping_ns_per_m = Some([20.0; 3]);
        segment.stiffness_n_per_m = Some([100.0; 3]);
        let position = response(&scenario).position;
        for i in 0..100 {
            let t = 0.02 * f64::from(i);
            let expected = 0.13 * (1.0 - (1.0 + 10.0 * t) * libm::exp(-10.0 * t));
            assert!((position.at(t).unwrap() - expected).abs() < 1e-8, "{t} s");
        }
    }

    #[test]
    fn a_moving_desired_position_is_followed_exactly_in_free_space() {
        let mut scenario = table_5_3();
        scenario.surfaces.clear();
        scenario.segments.truncate(1);
        scenario.segments[0].path = Path::PointToPoint;
        let ramp = Series { t: vec![0.0, 1.0], y: vec![0.0, 0.02] };
        let segments = scenario.resolved_segments();
        let position = ideal(&scenario, &segments, 2, &ramp, 1.0).position;
        assert!((position.at(0.5).unwrap() - 0.01).abs() < 1e-12);
    }
}
