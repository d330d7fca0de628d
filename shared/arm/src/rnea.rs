//! Inverse dynamics by recursive Newton–Euler: the joint torques that a motion needs.
//!
//! Gravity enters as an upward acceleration of the base. All vectors are in base axes and refer to the tip, so the
//! outward recursion is a sum from the base and the inward one a sum from the tip.

use crate::bodies::Bodies;
use crate::kinematics::{Frames, Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair, joints_of, pairs_of, sum_from_base, sum_from_tip};
use crate::model::ArmModel;
use crate::small::{V3, v3};
use crate::{JointVector, Spatial};

/// Joint torques (Nm) for angles, speeds and accelerations (rad, rad/s, rad/s²): M(q) q̈ + C(q, q̇) q̇ + g(q).
pub fn rnea(model: &ArmModel, q: &JointVector, qd: &JointVector, qdd: &JointVector) -> JointVector {
    match &model.slide {
        Some(slide) => slide.rnea(model.gravity, qdd),
        None => {
            let screws = Screws::new(&Frames::new(model, q));
            let motion = Motion::new(&screws, qd).accelerated(&screws, qdd);
            rnea_in(model, &screws, &motion)
        }
    }
}

/// C(q, q̇) q̇ + g(q) (Nm).
pub fn bias(model: &ArmModel, q: &JointVector, qd: &JointVector) -> JointVector {
    match &model.slide {
        Some(slide) => slide.rnea(model.gravity, &JointVector::zeros()),
        None => {
            let screws = Screws::new(&Frames::new(model, q));
            rnea_in(model, &screws, &Motion::new(&screws, qd))
        }
    }
}

/// g(q): the torques that hold the arm still (Nm).
pub fn gravity_torque(model: &ArmModel, q: &JointVector) -> JointVector {
    bias(model, q, &JointVector::zeros())
}

#[inline(always)]
pub(crate) fn rnea_in(model: &ArmModel, screws: &Screws, motion: &Motion) -> JointVector {
    let bodies = Bodies::new(model, screws);
    joints_of(&joint_torques(model, screws, motion, &bodies, &Spatial::zeros()))
}

/// The inward pass. `f_tip` acts ON the tip.
#[inline(always)]
pub(crate) fn joint_torques(
    model: &ArmModel,
    screws: &Screws,
    motion: &Motion,
    bodies: &Bodies,
    f_tip: &Spatial,
) -> [Pair; PAIRS] {
    let mut taken = bodies.wrenches(model.gravity, motion);
    // the tip itself is no body: its lane has what the surroundings take off link 7
    let at_tip = |k: usize| V3::pair(V3::ZERO, v3(-f_tip[k], -f_tip[k + 1], -f_tip[k + 2]));
    taken.f[PAIRS - 1] += at_tip(0);
    taken.n[PAIRS - 1] += at_tip(3);
    sum_from_tip(&mut taken.f);
    sum_from_tip(&mut taken.n);
    let mut tau = [Pair::default(); PAIRS];
    for k in 0..PAIRS {
        tau[k] = screws.s[k].dot(taken.f[k]) + screws.r[k].z.dot(taken.n[k]);
    }
    tau
}

impl Motion {
    /// The same speeds with joint accelerations.
    #[inline(always)]
    pub fn accelerated(&self, screws: &Screws, qdd: &JointVector) -> Motion {
        let qdd = pairs_of(qdd, 0.0);
        let mut added = Motion::default();
        for k in 0..PAIRS {
            added.a[k] = screws.s[k] * qdd[k];
            added.dw[k] = screws.r[k].z * qdd[k];
        }
        sum_from_base(&mut added.a);
        sum_from_base(&mut added.dw);
        for k in 0..PAIRS {
            added.a[k] += self.a[k];
            added.dw[k] += self.dw[k];
        }
        (added.v, added.w) = (self.v, self.w);
        added
    }
}
