//! Where the tip is, how it moves with the joints, and how that changes: pose, geometric Jacobian, J̇q̇.

use crate::model::ArmModel;
use crate::small::{M3, V3};
use crate::{DOF, Jacobian, JointVector, Spatial};
use nalgebra::{Matrix3, Vector3};

/// Position and orientation of the tip in the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Tip origin in base axes (m).
    pub p: Vector3<f64>,
    /// Tip axes as columns, in base axes.
    pub r: Matrix3<f64>,
}

/// All of the tip's first- and second-order kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipMotion {
    /// Pose of the tip.
    pub pose: Pose,
    /// Geometric Jacobian.
    pub jacobian: Jacobian,
    /// J̇q̇: acceleration of the tip when the joints do not accelerate (m/s², rad/s²).
    pub jdot_qd: Spatial,
    /// J q̇: linear and angular velocity of the tip (m/s, rad/s).
    pub twist: Spatial,
}

/// Joint frames and tip frame in base axes at one posture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames {
    /// Axes of joint frame i, turned with the joint; `r[i].z` is the joint axis.
    pub r: [M3; DOF],
    /// Origins of the joint frames (m).
    pub o: [V3; DOF],
    pub tip_r: M3,
    pub tip: V3,
}

impl Frames {
    #[inline(always)]
    pub fn new(model: &ArmModel, q: &JointVector) -> Frames {
        let mut r = [M3::IDENTITY; DOF];
        let mut o = [V3::ZERO; DOF];
        let (mut rp, mut op) = (M3::IDENTITY, V3::ZERO);
        for i in 0..DOF {
            let joint = &model.joints[i];
            let (s, c) = libm::sincos(q[i]);
            let t = if i == 0 { joint.r } else { rp * joint.r };
            op = if i == 0 { joint.p } else { op + rp * joint.p };
            rp = M3 {
                x: t.x * c + t.y * s,
                y: t.y * c + t.x * -s,
                z: t.z,
            };
            r[i] = rp;
            o[i] = op;
        }
        Frames {
            r,
            o,
            tip_r: rp * model.tip_r,
            tip: op + rp * model.tip_p,
        }
    }

    #[inline(always)]
    pub fn pose(&self) -> Pose {
        Pose {
            p: self.tip.into(),
            r: self.tip_r.into(),
        }
    }

    #[inline(always)]
    pub fn jacobian(&self) -> Jacobian {
        let mut j = Jacobian::zeros();
        for i in 0..DOF {
            let z = self.r[i].z;
            let v = z.cross(self.tip - self.o[i]);
            j.column_mut(i)
                .copy_from_slice(&[v.x, v.y, v.z, z.x, z.y, z.z]);
        }
        j
    }

    /// Twist of the tip and its J̇q̇, by propagating velocities and velocity-product accelerations outwards.
    #[inline(always)]
    pub fn twist_and_jdot_qd(&self, qd: &JointVector) -> (Spatial, Spatial) {
        let (mut w, mut dw, mut v, mut a) = (V3::ZERO, V3::ZERO, V3::ZERO, V3::ZERO);
        for i in 0..DOF {
            let zd = self.r[i].z * qd[i];
            dw += w.cross(zd);
            w += zd;
            let next = if i + 1 < DOF { self.o[i + 1] } else { self.tip };
            let d = next - self.o[i];
            let wd = w.cross(d);
            v += wd;
            a += dw.cross(d) + w.cross(wd);
        }
        (spatial(v, w), spatial(a, dw))
    }
}

#[inline(always)]
pub(crate) fn spatial(linear: V3, angular: V3) -> Spatial {
    Spatial::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// Forward kinematics: pose of the tip for joint angles `q` (rad).
pub fn forward_kinematics(model: &ArmModel, q: &JointVector) -> Pose {
    match &model.slide {
        Some(slide) => slide.pose(q),
        None => Frames::new(model, q).pose(),
    }
}

/// Origins of the joints, base first, and of the tip, in the base frame (m): the arm as a picture shows it.
pub fn joint_origins(model: &ArmModel, q: &JointVector) -> [nalgebra::Vector3<f64>; DOF + 1] {
    let frames = Frames::new(model, q);
    std::array::from_fn(|i| frames.o.get(i).copied().unwrap_or(frames.tip).into())
}

/// Geometric Jacobian: twist of the tip = J q̇.
pub fn jacobian(model: &ArmModel, q: &JointVector) -> Jacobian {
    match &model.slide {
        Some(slide) => slide.jacobian(),
        None => Frames::new(model, q).jacobian(),
    }
}

/// J̇q̇: acceleration of the tip = J q̈ + J̇q̇ (m/s², rad/s²), for `qd` in rad/s.
pub fn jdot_qd(model: &ArmModel, q: &JointVector, qd: &JointVector) -> Spatial {
    match model.slide {
        Some(_) => Spatial::zeros(),
        None => Frames::new(model, q).twist_and_jdot_qd(qd).1,
    }
}

/// Pose, Jacobian, J̇q̇ and twist in one pass.
pub fn tip_motion(model: &ArmModel, q: &JointVector, qd: &JointVector) -> TipMotion {
    match &model.slide {
        Some(slide) => slide.tip_motion(q, qd),
        None => tip_motion_of(&Frames::new(model, q), qd),
    }
}

#[inline(always)]
pub(crate) fn tip_motion_of(frames: &Frames, qd: &JointVector) -> TipMotion {
    let (twist, jdot_qd) = frames.twist_and_jdot_qd(qd);
    TipMotion {
        pose: frames.pose(),
        jacobian: frames.jacobian(),
        jdot_qd,
        twist,
    }
}
