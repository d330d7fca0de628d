//! A plant that differs from the controller's model: calibration errors, wrong masses, a base that is not level.
//!
//! Errors are drawn from normal distributions with a seeded ChaCha8 stream; the same seed draws the same arm on every
//! machine. Whatever is drawn, the links stay bodies that can exist: masses and second moments of mass are scaled by
//! positive factors, never added to.

use crate::inertia::Inertia;
use crate::model::ArmModel;
use crate::rotation;
use crate::small::{M3, Sym3, V3, v3};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Deserialize;
use std::f64::consts::TAU;

/// Standard deviations of the differences between plant and model. All zero by default: no difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mismatch {
    /// Position of each joint's and the tip's frame, per axis (m).
    pub origin_m: f64,
    /// Orientation of the same, about each axis (rad).
    pub orientation_rad: f64,
    /// Logarithm of each link's mass factor: 0.05 is about 5 %.
    pub mass_ratio: f64,
    /// Logarithm of the factors of each link's second moments of mass, per axis of its frame.
    pub inertia_ratio: f64,
    /// Centre of mass of each link, per axis (m).
    pub com_m: f64,
    /// Direction of gravity, about each of the axes x and y of the base (rad).
    pub gravity_direction_rad: f64,
    /// Logarithm of the factor of gravity's magnitude.
    pub gravity_ratio: f64,
}

impl Mismatch {
    /// Names and values, for whoever checks them.
    pub fn entries(&self) -> [(&'static str, f64); 7] {
        [
            ("origin_m", self.origin_m),
            ("orientation_rad", self.orientation_rad),
            ("mass_ratio", self.mass_ratio),
            ("inertia_ratio", self.inertia_ratio),
            ("com_m", self.com_m),
            ("gravity_direction_rad", self.gravity_direction_rad),
            ("gravity_ratio", self.gravity_ratio),
        ]
    }
}

impl ArmModel {
    /// An arm drawn around this one.
    pub fn perturbed(&self, mismatch: &Mismatch, seed: u64) -> ArmModel {
        let mut draw = Normal { rng: ChaCha8Rng::seed_from_u64(seed) };
        let mut arm = self.clone();
        for joint in &mut arm.joints {
            joint.p += draw.vector(mismatch.origin_m);
            joint.r = draw.turn(mismatch.orientation_rad) * joint.r;
            joint.body = draw.body(&joint.body, mismatch);
        }
        arm.tip_p += draw.vector(mismatch.origin_m);
        arm.tip_r = draw.turn(mismatch.orientation_rad) * arm.tip_r;
        let tilt = mismatch.gravity_direction_rad;
        let tilt: M3 = rotation::exp(&Vector3::new(draw.normal() * tilt, draw.normal() * tilt, 0.0)).into();
        arm.gravity = tilt * arm.gravity * draw.factor(mismatch.gravity_ratio);
        if let Some(slide) = &mut arm.slide {
            slide.mass *= draw.factor(mismatch.mass_ratio);
        }
        arm.settled()
    }
}

struct Normal {
    rng: ChaCha8Rng,
}

impl Normal {
    /// Uniform in (0, 1].
    fn uniform(&mut self) -> f64 {
        ((self.rng.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal (Box–Muller).
    fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(TAU * v)
    }

    fn vector(&mut self, deviation: f64) -> V3 {
        v3(self.normal(), self.normal(), self.normal()) * deviation
    }

    fn turn(&mut self, deviation: f64) -> M3 {
        rotation::exp(&self.vector(deviation).into()).into()
    }

    fn factor(&mut self, deviation: f64) -> f64 {
        libm::exp(self.normal() * deviation)
    }

    fn body(&mut self, body: &Inertia, mismatch: &Mismatch) -> Inertia {
        let mass = self.factor(mismatch.mass_ratio);
        let com = body.com() + self.vector(mismatch.com_m);
        let half = 0.5 * mismatch.inertia_ratio;
        let stretch = [self.factor(half), self.factor(half), self.factor(half)];
        Inertia::at_com(body.m * mass, com, stretched(body.about_com(), stretch) * mass)
    }
}

/// The tensor of a body whose mass is spread by the factors `s` along the axes: its second moments ½ tr(I)·1 − I become
/// `diag(s)` times themselves times `diag(s)`.
fn stretched(tensor: Sym3, s: [f64; 3]) -> Sym3 {
    let i = tensor.second_moments();
    Sym3 {
        xx: i.xx * s[0] * s[0],
        yy: i.yy * s[1] * s[1],
        zz: i.zz * s[2] * s[2],
        xy: i.xy * s[0] * s[1],
        xz: i.xz * s[0] * s[2],
        yz: i.yz * s[1] * s[2],
    }
    .complement()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::is_physical;
    use crate::{JointVector, crba, forward_kinematics, gravity_torque};

    const MUCH: Mismatch = Mismatch {
        origin_m: 0.01,
        orientation_rad: 0.05,
        mass_ratio: 0.3,
        inertia_ratio: 0.5,
        com_m: 0.02,
        gravity_direction_rad: 0.05,
        gravity_ratio: 0.01,
    };

    #[test]
    fn no_mismatch_is_the_same_arm_up_to_rounding() {
        let model = ArmModel::rediestro();
        let same = model.perturbed(&Mismatch::default(), 7);
        let q = JointVector::repeat(0.4);
        assert!((gravity_torque(&same, &q) - gravity_torque(&model, &q)).amax() < 1e-12);
        assert_eq!(forward_kinematics(&same, &q), forward_kinematics(&model, &q));
    }

    #[test]
    fn one_seed_draws_one_arm_and_another_seed_another() {
        let model = ArmModel::rediestro();
        assert_eq!(model.perturbed(&MUCH, 1), model.perturbed(&MUCH, 1));
        assert_ne!(model.perturbed(&MUCH, 1), model.perturbed(&MUCH, 2));
    }

    #[test]
    fn however_much_is_drawn_the_links_stay_bodies_that_can_exist() {
        let model = ArmModel::rediestro();
        for seed in 0..200 {
            let arm = model.perturbed(&MUCH, seed);
            for i in 0..7 {
                let body = arm.link_inertia(i);
                assert!(body.mass > 0.0 && is_physical(&body.tensor), "seed {seed} link {i}");
            }
            assert!(crba(&arm, &JointVector::repeat(0.3)).cholesky().is_some(), "seed {seed}");
        }
    }

    #[test]
    fn drawn_errors_have_the_deviation_that_was_asked_for() {
        let model = ArmModel::rediestro();
        let only_mass = Mismatch { mass_ratio: 0.1, ..Mismatch::default() };
        let mut squares = 0.0;
        for seed in 0..300 {
            let ratio = model.perturbed(&only_mass, seed).link_masses().component_div(&model.link_masses());
            squares += ratio.map(|r| libm::log(r) * libm::log(r)).sum();
        }
        let deviation = (squares / 2100.0).sqrt();
        assert!((deviation - 0.1).abs() < 0.006, "{deviation}");
    }
}
