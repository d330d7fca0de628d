//! Inverse dynamics by recursive Newton–Euler: the joint torques that a motion needs.
//!
//! Gravity enters as an upward acceleration of the base. All vectors are in base axes and refer to the tip, so the
//! outward recursion is a sum from the base and the inward one a sum from the tip.

use crate::bodies::{Bodies, Wrench, bodies, wrenches};
use crate::kinematics::{Motion, Screw, Screws, frames, screws};
use crate::lanes::{Pair, from_base, from_tip, joints_of, pairs_of};
use crate::model::ArmModel;
use crate::JointVector;

/// Joint torques (Nm) for angles, speeds and accelerations (rad, rad/s, rad/s²): M(q) q̈ + C(q, q̇) q̇ + g(q).
pub fn rnea(model: &ArmModel, q: &JointVector, qd: &JointVector, qdd: &JointVector) -> JointVector {
    match &model.slide {
        Some(slide) => slide.rnea(model.gravity, qdd),
        None => {
            let screws = screws(&frames(model, q));
            let motion = Motion::new(&screws, qd).accelerated(&screws, qdd);
            rnea_in(model, &screws, &motion, &bodies(model, &screws))
        }
    }
}

/// C(q, q̇) q̇ + g(q) (Nm).
pub fn bias(model: &ArmModel, q: &JointVector, qd: &JointVector) -> JointVector {
    match &model.slide {
        Some(slide) => slide.rnea(model.gravity, &JointVector::zeros()),
        None => {
            let screws = screws(&frames(model, q));
            rnea_in(model, &screws, &Motion::new(&screws, qd), &bodies(model, &screws))
        }
    }
}

/// g(q): the torques that hold the arm still (Nm).
pub fn gravity_torque(model: &ArmModel, q: &JointVector) -> JointVector {
    bias(model, q, &JointVector::zeros())
}

#[inline(always)]
pub(crate) fn rnea_in(model: &ArmModel, screws: &Screws, motion: &Motion, bodies: &Bodies) -> JointVector {
    // what each joint carries of the links beyond it
    let carried = from_tip(&wrenches(bodies, model.gravity, motion));
    joints_of(&std::array::from_fn(|k| along(&screws[k], &carried[k])))
}

/// Component of a wrench along a joint: its torque.
#[inline(always)]
pub(crate) fn along(screw: &Screw, wrench: &Wrench<Pair>) -> Pair {
    screw.s.dot(wrench.f) + screw.r.z.dot(wrench.n)
}

impl Motion {
    /// The same speeds with joint accelerations.
    #[inline(always)]
    pub fn accelerated(&self, screws: &Screws, qdd: &JointVector) -> Motion {
        let qdd = pairs_of(qdd, 0.0);
        let a = from_base(&std::array::from_fn(|k| screws[k].s * qdd[k]));
        let dw = from_base(&std::array::from_fn(|k| screws[k].r.z * qdd[k]));
        Motion {
            a: std::array::from_fn(|k| self.a[k] + a[k]),
            dw: std::array::from_fn(|k| self.dw[k] + dw[k]),
            ..*self
        }
    }
}
