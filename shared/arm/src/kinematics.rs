//! Where the tip is, how it moves with the joints, and how that changes: pose, geometric Jacobian, J̇q̇.

use crate::lanes::{Column, Lanes, PAIRS, Pair, from_base, lane, pairs_of, total};
use crate::model::ArmModel;
use crate::sincos::sin_cos;
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

/// A joint's frame, or the tip's, in base axes at one posture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Axes x, y, z, turned with the joint; z is the joint axis.
    pub r: [Column; 3],
    /// Origin (m).
    pub o: Column,
}

/// The joints' frames and, as the eighth, the tip's.
pub(crate) type Frames = [Frame; DOF + 1];

#[inline(always)]
pub(crate) fn frames(model: &ArmModel, q: &JointVector) -> Frames {
    let chain = &model.chain;
    let q = pairs_of(q, 0.0);
    let (mut sin, mut cos) = ([0.0; DOF + 1], [0.0; DOF + 1]);
    for k in 0..PAIRS {
        let (s, c) = sin_cos(q[k] + chain.offset[k]);
        (sin[k], sin[k + PAIRS]) = (s.low(), s.high());
        (cos[k], cos[k + PAIRS]) = (c.low(), c.high());
    }
    let base = &chain.base;
    let (mut x, mut y, mut z): (Column, Column, Column) = (base.x.into(), base.y.into(), base.z.into());
    let mut o = Column::from(chain.p[0]);
    let mut frames = [Frame { r: [x, y, z], o }; DOF + 1];
    for i in 0..=DOF {
        (x, y) = (x.combined(cos[i], y, sin[i]), y.combined(cos[i], x, -sin[i]));
        frames[i] = Frame { r: [x, y, z], o };
        if i < DOF {
            o = o.displaced(&[x, y, z], chain.p[i + 1]);
            let (c, s) = chain.twist[i + 1];
            (y, z) = (y.combined(c, z, s), z.combined(c, y, -s));
        }
    }
    frames
}

impl Frame {
    #[inline(always)]
    pub fn pose(&self) -> Pose {
        let [x, y, z] = self.r.map(V3::from);
        Pose { p: V3::from(self.o).into(), r: M3 { x, y, z }.into() }
    }
}

/// A joint's axis about the tip: its column of the Jacobian is (`s`, z). The tip's own is there for company, with its z and
/// no lever.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screw {
    /// Joint frame's axes.
    pub r: M3<Pair>,
    /// Joint origin from the tip (m).
    pub d: V3<Pair>,
    /// Velocity of the tip per joint speed (m/rad).
    pub s: V3<Pair>,
}

/// The joints' axes.
pub(crate) type Screws = [Screw; PAIRS];

#[inline(always)]
pub(crate) fn screws(frames: &Frames) -> Screws {
    let tip = frames[DOF].o;
    let tip = Column::pair(tip, tip);
    std::array::from_fn(|k| {
        let (low, high) = (&frames[k], &frames[k + PAIRS]);
        let axis = |a: usize| Column::pair(low.r[a], high.r[a]);
        let (r, d) = (M3 { x: axis(0), y: axis(1), z: axis(2) }, Column::pair(low.o, high.o) - tip);
        Screw { r, d, s: d.cross(r.z) }
    })
}

#[inline(always)]
pub(crate) fn jacobian_of(screws: &Screws) -> Jacobian {
    let mut j = Jacobian::zeros();
    for (k, screw) in screws.iter().enumerate() {
        let (s, z) = (screw.s, screw.r.z);
        let mut set = |i: usize, s: V3, z: V3| j.column_mut(i).copy_from_slice(&[s.x, s.y, s.z, z.x, z.y, z.z]);
        set(k, s.low(), z.low());
        if k + PAIRS < DOF {
            set(k + PAIRS, s.high(), z.high());
        }
    }
    j
}

/// How the bodies move at these joint speeds: angular velocity, and what accelerates them without joint acceleration.
/// Link i's are in lane i, the tip's are link 7's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    pub w: [V3<Pair>; PAIRS],
    /// Of the body's material at the tip's place.
    pub a: [V3<Pair>; PAIRS],
    pub dw: [V3<Pair>; PAIRS],
    /// Velocity of the tip.
    pub v: V3,
}

impl Motion {
    #[inline(always)]
    pub fn new(screws: &Screws, qd: &JointVector) -> Motion {
        let qd = pairs_of(qd, 0.0);
        let s: [V3<Pair>; PAIRS] = std::array::from_fn(|k| screws[k].s * qd[k]);
        let z: [V3<Pair>; PAIRS] = std::array::from_fn(|k| screws[k].r.z * qd[k]);
        let w = from_base(&z);
        // half of Coriolis' 2 ω × s q̇ is felt before the joint, half behind it
        let a = from_base(&std::array::from_fn(|k| (w[k] + (w[k] - z[k])).cross(s[k])));
        let dw = from_base(&std::array::from_fn(|k| w[k].cross(z[k])));
        Motion { w, a, dw, v: total(&s) }
    }

    /// Twist of the tip and its J̇q̇.
    #[inline(always)]
    pub fn tip(&self) -> (Spatial, Spatial) {
        (spatial(self.v, lane(&self.w, DOF)), spatial(lane(&self.a, DOF), lane(&self.dw, DOF)))
    }
}

#[inline(always)]
pub(crate) fn spatial(linear: V3, angular: V3) -> Spatial {
    Spatial::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Forward kinematics: pose of the tip for joint angles `q` (rad).
pub fn forward_kinematics(model: &ArmModel, q: &JointVector) -> Pose {
    match &model.slide {
        Some(slide) => slide.pose(q),
        None => frames(model, q)[DOF].pose(),
    }
}

/// Origins of the joints, base first, and of the tip, in the base frame (m): the arm as a picture shows it.
pub fn joint_origins(model: &ArmModel, q: &JointVector) -> [nalgebra::Vector3<f64>; DOF + 1] {
    frames(model, q).map(|frame| V3::from(frame.o).into())
}

/// Geometric Jacobian: twist of the tip = J q̇.
pub fn jacobian(model: &ArmModel, q: &JointVector) -> Jacobian {
    match &model.slide {
        Some(slide) => slide.jacobian(),
        None => jacobian_of(&screws(&frames(model, q))),
    }
}

/// J̇q̇: acceleration of the tip = J q̈ + J̇q̇ (m/s², rad/s²), for `qd` in rad/s.
pub fn jdot_qd(model: &ArmModel, q: &JointVector, qd: &JointVector) -> Spatial {
    match model.slide {
        Some(_) => Spatial::zeros(),
        None => Motion::new(&screws(&frames(model, q)), qd).tip().1,
    }
}

/// Pose, Jacobian, J̇q̇ and twist in one pass.
pub fn tip_motion(model: &ArmModel, q: &JointVector, qd: &JointVector) -> TipMotion {
    match &model.slide {
        Some(slide) => slide.tip_motion(q, qd),
        None => {
            let frames = frames(model, q);
            let screws = screws(&frames);
            tip_motion_of(frames[DOF].pose(), &screws, &Motion::new(&screws, qd))
        }
    }
}

#[inline(always)]
pub(crate) fn tip_motion_of(pose: Pose, screws: &Screws, motion: &Motion) -> TipMotion {
    let (twist, jdot_qd) = motion.tip();
    TipMotion { pose, jacobian: jacobian_of(screws), jdot_qd, twist }
}
