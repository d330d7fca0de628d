//! The one-axis test arm: a mass on a frictionless slide along its base's z, moved by joint 1. Joints 2 to 7 turn unit inertias
//! and move nothing. Its dynamics are closed forms, so that a control law can be held against the ideal response.

use crate::kinematics::{Pose, TipMotion, spatial};
use crate::small::{M3, V3, v3};
use crate::{Jacobian, JointMatrix, JointVector, Spatial};

/// The mass that joint 1 moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slide {
    /// Mass (kg).
    pub mass: f64,
    /// Axes of the slide in the base it is seen from, and its origin (m).
    pub r: M3,
    pub p: V3,
}

impl Slide {
    pub fn pose(&self, q: &JointVector) -> Pose {
        Pose { p: (self.p + self.r.z * q[0]).into(), r: self.r.into() }
    }

    pub fn jacobian(&self) -> Jacobian {
        let mut j = Jacobian::zeros();
        j.set_column(0, &spatial(self.r.z, V3::ZERO));
        j
    }

    pub fn tip_motion(&self, q: &JointVector, qd: &JointVector) -> TipMotion {
        TipMotion {
            pose: self.pose(q),
            jacobian: self.jacobian(),
            jdot_qd: Spatial::zeros(),
            twist: spatial(self.r.z * qd[0], V3::ZERO),
        }
    }

    pub fn rnea(&self, gravity: V3, qdd: &JointVector) -> JointVector {
        let mut tau = *qdd;
        tau[0] = self.mass * (qdd[0] - gravity.dot(self.r.z));
        tau
    }

    pub fn crba(&self) -> JointMatrix {
        let mut m = JointMatrix::identity();
        m[(0, 0)] = self.mass;
        m
    }

    pub fn aba(&self, gravity: V3, tau: &JointVector, armature: &JointVector, f_tip: &Spatial) -> JointVector {
        let mut qdd = tau.zip_map(armature, |t, a| t / (1.0 + a));
        let force = v3(f_tip[0], f_tip[1], f_tip[2]) + gravity * self.mass;
        qdd[0] = (tau[0] + force.dot(self.r.z)) / (self.mass + armature[0]);
        qdd
    }

    pub fn potential_energy(&self, gravity: V3, q: &JointVector) -> f64 {
        -self.mass * gravity.dot(self.p + self.r.z * q[0])
    }
}

#[cfg(test)]
mod tests {
    use crate::{ArmModel, JointVector, Spatial, aba, crba, rnea, tip_motion};

    #[test]
    fn the_slide_is_a_point_mass_along_base_z() {
        let model = ArmModel::slide(4.0);
        let q = JointVector::from([0.3, 1.0, 2.0, 0.0, 0.0, 0.0, -1.0]);
        let qd = JointVector::repeat(0.5);
        let tip = tip_motion(&model, &q, &qd);
        assert_eq!(tip.pose.p.as_slice(), [0.0, 0.0, 0.3]);
        assert_eq!(tip.twist, tip.jacobian * qd);
        let f = Spatial::new(1.0, 2.0, -8.0, 0.0, 0.0, 0.0);
        let tau = JointVector::from([20.0, 1.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
        let qdd = aba(&model, &q, &qd, &tau, &JointVector::zeros(), &f);
        assert_eq!(qdd, JointVector::from([3.0, 1.0, 0.0, 0.0, 0.0, 0.0, -2.0]));
        assert_eq!(rnea(&model, &q, &qd, &qdd) - tip.jacobian.tr_mul(&f), tau);
        assert_eq!(crba(&model, &q) * qdd, rnea(&model, &q, &qd, &qdd));
    }
}
