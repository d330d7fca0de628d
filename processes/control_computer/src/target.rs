//! The target trajectory (Xᵗ, Ẋᵗ): integrated online from Ẍᵗ, and kept within reach of the tool.
//!
//! Integration: Ẍᵗ is held over the period, as the inner loop holds it, so Xᵗ ← Xᵗ + Ẋᵗ T + ½ Ẍᵗ T², Ẋᵗ ← Ẋᵗ + Ẍᵗ T and
//! Rᵗ ← exp(ω̄ T) Rᵗ with the mean ω̄ are exact for it: a tool that follows without error stays on Xᵗ. (Semi-implicit
//! Euler would move Xᵗ by ½ Ẍᵗ T² more and the error reference controller would chase the difference.)
//!
//! Xᵗ is an unbounded integrator of force: whatever keeps the tool from following lets Xᵗ − X grow. [`Target::limit`] holds
//! it at a limit (anti-windup), and while torques saturate it may not grow at all. Xᵗ is never reset at a change of
//! segment: that would throw away what has been wound up against friction.

use crate::frame::{angular, difference, linear, spatial};
use arm::{Pose, Spatial, rotation};
use nalgebra::Matrix3;

/// Xᵗ and Ẋᵗ in the task frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Xᵗ.
    pub pose: Pose,
    /// Ẋᵗ (m/s, rad/s).
    pub twist: Spatial,
}

/// Largest |Xᵗ − X|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Along each translation axis (m).
    pub linear: [f64; 3],
    /// Rotation between the two (rad).
    pub angular: f64,
}

impl Target {
    /// At rest in a pose.
    pub fn at_rest(pose: Pose) -> Target {
        Target { pose, twist: Spatial::zeros() }
    }

    /// Carries the target over a period of `dt` seconds at constant Ẍᵗ.
    pub fn advance(&mut self, xt_ddot: &Spatial, dt: f64) {
        let mean = self.twist + xt_ddot * (0.5 * dt);
        self.pose.p += linear(&mean) * dt;
        self.pose.r = orthonormal(rotation::exp(&(angular(&mean) * dt)) * self.pose.r);
        self.twist += xt_ddot * dt;
    }

    /// Holds Xᵗ − X within `bounds` of a tool at `x` moving with `x_dot`, and takes away the part of Ẋᵗ − Ẋ that leads
    /// out of them. Returns Xᵗ − X, and which axes were at their limit: bits 0–2 the translations, bit 3 the rotation.
    pub fn limit(&mut self, x: &Pose, x_dot: &Spatial, bounds: &Bounds) -> (Spatial, u32) {
        let mut acted = 0;
        let mut error = difference(&self.pose, x);
        for (i, &bound) in bounds.linear.iter().enumerate() {
            if error[i].abs() > bound {
                acted |= 1 << i;
                error[i] = bound.copysign(error[i]);
                self.pose.p[i] = x.p[i] + error[i];
                if (self.twist[i] - x_dot[i]) * error[i] > 0.0 {
                    self.twist[i] = x_dot[i];
                }
            }
        }
        let turn = angular(&error);
        let angle = turn.norm();
        if angle > bounds.angular {
            acted |= 8;
            let axis = turn / angle;
            let held = axis * bounds.angular;
            self.pose.r = rotation::exp(&held) * x.r;
            error.fixed_rows_mut::<3>(3).copy_from(&held);
            let outward = axis.dot(&(angular(&self.twist) - angular(x_dot))).max(0.0);
            self.twist -= spatial(nalgebra::Vector3::zeros(), axis * outward);
        }
        (error, acted)
    }
}

impl Bounds {
    /// These bounds, and no further out than Xᵗ − X is now: for a tool that cannot follow.
    pub fn no_further_than(&self, target: &Pose, x: &Pose) -> Bounds {
        let error = difference(target, x);
        Bounds {
            linear: std::array::from_fn(|i| self.linear[i].min(error[i].abs())),
            angular: self.angular.min(angular(&error).norm()),
        }
    }
}

/// Takes the rounding of many products off a rotation matrix (one step of Newton's iteration).
fn orthonormal(r: Matrix3<f64>) -> Matrix3<f64> {
    r * 1.5 - r * (r.transpose() * r) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ahic::{Impedance, target_acceleration};
    use crate::frame::Motion;
    use nalgebra::Vector3;

    fn origin() -> Pose {
        Pose { p: Vector3::zeros(), r: Matrix3::identity() }
    }

    fn impedance(mass: f64, damping: f64, stiffness: f64) -> Impedance {
        Impedance {
            selection: Spatial::repeat(1.0),
            mass: Spatial::repeat(mass),
            damping: Spatial::repeat(damping),
            stiffness: Spatial::repeat(stiffness),
            force: Spatial::zeros(),
        }
    }

    /// x(t) of m ẍ + b ẋ + k x = 0 from x₀ at rest, underdamped.
    fn ideal(mass: f64, damping: f64, stiffness: f64, x0: f64, t: f64) -> f64 {
        let (a, w) = (damping / (2.0 * mass), (stiffness / mass).sqrt());
        let wd = (w * w - a * a).sqrt();
        x0 * libm::exp(-a * t) * (libm::cos(wd * t) + a / wd * libm::sin(wd * t))
    }

    /// Greatest deviation of Xᵗ from the ideal over 5 s, position step of 130 mm (Figure 6.3) and the same in rotation.
    fn deviation(dt: f64) -> (f64, f64) {
        let (m, b, k, x0) = (112.0, 700.0, 1100.0, 0.13);
        let law = impedance(m, b, k);
        let xd = Motion::at_rest(origin());
        let start = Pose { p: Vector3::new(0.0, 0.0, x0), r: rotation::exp(&Vector3::new(x0, 0.0, 0.0)) };
        let mut target = Target::at_rest(start);
        let mut worst = (0.0f64, 0.0f64);
        for step in 0..(5.0 / dt) as u32 {
            let x = ideal(m, b, k, x0, f64::from(step) * dt);
            let error = difference(&target.pose, &xd.pose);
            worst = (worst.0.max((error[2] - x).abs()), worst.1.max((error[3] - x).abs()));
            let xt_ddot = target_acceleration(&law, &xd, &target.pose, &target.twist, &Spatial::zeros());
            target.advance(&xt_ddot, dt);
        }
        worst
    }

    #[test]
    fn the_target_is_within_1_mm_of_the_ideal_mass_spring_dashpot_and_converges_to_it() {
        let (coarse, fine) = (deviation(5e-3), deviation(5e-4));
        assert!(coarse.0 < 1e-3 && coarse.1 < 1e-3, "{coarse:?}");
        assert!(fine.0 < 1e-4 && fine.1 < 1e-4, "{fine:?}");
    }

    #[test]
    fn under_constant_acceleration_the_integration_is_exact() {
        let mut target = Target::at_rest(origin());
        let a = Spatial::new(1.0, -2.0, 0.5, 0.3, 0.0, 0.0);
        for _ in 0..200 {
            target.advance(&a, 5e-3);
        }
        assert!((linear(&target.twist) - Vector3::new(1.0, -2.0, 0.5)).amax() < 1e-12);
        assert!((target.pose.p - Vector3::new(0.5, -1.0, 0.25)).amax() < 1e-12);
        assert!((target.pose.r - rotation::exp(&Vector3::new(0.15, 0.0, 0.0))).amax() < 1e-12);
    }

    #[test]
    fn the_limit_stops_the_target_and_lets_it_come_back() {
        let bounds = Bounds { linear: [0.1; 3], angular: 0.2 };
        let mut target = Target {
            pose: Pose { p: Vector3::new(0.3, -0.05, -0.3), r: rotation::exp(&Vector3::new(0.0, 0.0, 0.5)) },
            twist: Spatial::new(1.0, 1.0, 1.0, 0.3, 0.0, 0.7),
        };
        let (error, acted) = target.limit(&origin(), &Spatial::zeros(), &bounds);
        assert_eq!(acted, 0b1101);
        assert!((error - difference(&target.pose, &origin())).amax() < 1e-12, "{error}");
        assert!((target.pose.p - Vector3::new(0.1, -0.05, -0.1)).amax() < 1e-15);
        // outward motion is taken away; y was free and z already comes back
        let left = Spatial::new(0.0, 1.0, 1.0, 0.3, 0.0, 0.0);
        assert!((target.twist - left).amax() < 1e-12, "{}", target.twist);
        let back = rotation::log(&target.pose.r);
        assert!((back - Vector3::new(0.0, 0.0, 0.2)).amax() < 1e-12);
        assert_eq!(
            target.limit(&target.pose.clone(), &Spatial::zeros(), &Bounds { linear: [0.0; 3], angular: 1e-9 }).1,
            0
        );
    }
}
