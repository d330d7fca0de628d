//! Where the tip is, how it moves with the joints, and how that changes: pose, geometric Jacobian, J̇q̇.

use crate::lanes::{Column, PAIRS, Pair, lane, pairs_of, sum_from_base};
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

/// Joint frames and, as the eighth, the tip frame in base axes at one posture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames {
    /// Axes x, y, z, turned with the joint; z is the joint axis.
    pub r: [[Column; 3]; DOF + 1],
    /// Origins (m).
    pub o: [Column; DOF + 1],
}

impl Frames {
    #[inline(always)]
    pub fn new(model: &ArmModel, q: &JointVector) -> Frames {
        let chain = &model.chain;
        let angles = pairs_of(&(q + chain.offset), 0.0).map(sin_cos);
        let turns: [(f64, f64); DOF] = std::array::from_fn(|i| {
            let (sin, cos) = angles[i % PAIRS];
            (sin.to_array()[i / PAIRS], cos.to_array()[i / PAIRS])
        });
        let base = &chain.base;
        let mut before: [Column; 3] = [base.x.into(), base.y.into(), base.z.into()];
        let mut at: Column = chain.p[0].into();
        let mut frames = Frames { r: [before; DOF + 1], o: [at; DOF + 1] };
        for i in 0..DOF {
            let (s, c) = turns[i];
            let r = [before[0].combined(c, before[1], s), before[1].combined(c, before[0], -s), before[2]];
            (frames.r[i], frames.o[i]) = (r, at);
            if i + 1 < DOF {
                let (c, s) = chain.twist[i + 1];
                at = at.displaced(&r, chain.p[i + 1]);
                before = [r[0], r[1].combined(c, r[2], s), r[2].combined(c, r[1], -s)];
            }
        }
        let (last, tip) = (frames.r[DOF - 1], &chain.tip_r);
        frames.o[DOF] = at.displaced(&last, chain.tip_p);
        frames.r[DOF] = [tip.x, tip.y, tip.z].map(|column| Column::default().displaced(&last, column));
        frames
    }

    #[inline(always)]
    pub fn pose(&self) -> Pose {
        let [x, y, z] = self.r[DOF].map(V3::from);
        Pose { p: V3::from(self.o[DOF]).into(), r: M3 { x, y, z }.into() }
    }
}

/// Joint axes about the tip: column i of the Jacobian is (`s`, z). The tip's lane is there for company, with its own z
/// and no lever.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Screws {
    /// Joint frames' axes.
    pub r: [M3<Pair>; PAIRS],
    /// Joint origins from the tip (m).
    pub d: [V3<Pair>; PAIRS],
    /// Velocity of the tip per joint speed (m/rad).
    pub s: [V3<Pair>; PAIRS],
}

impl Screws {
    #[inline(always)]
    pub fn new(frames: &Frames) -> Screws {
        let tip = Column::pair(frames.o[DOF], frames.o[DOF]);
        let mut screws = Screws::default();
        for k in 0..PAIRS {
            let axis = |a: usize| Column::pair(frames.r[k][a], frames.r[k + PAIRS][a]);
            let (x, y, z) = (axis(0), axis(1), axis(2));
            let d = Column::pair(frames.o[k], frames.o[k + PAIRS]) - tip;
            screws.r[k] = M3 { x, y, z };
            screws.d[k] = d;
            screws.s[k] = d.cross(z);
        }
        screws
    }

    #[inline(always)]
    pub fn jacobian(&self) -> Jacobian {
        let mut j = Jacobian::zeros();
        for i in 0..DOF {
            let (s, z) = (lane(&self.s, i), lane(&self.r, i).z);
            j.column_mut(i).copy_from_slice(&[s.x, s.y, s.z, z.x, z.y, z.z]);
        }
        j
    }
}

/// How the bodies move at these joint speeds: velocity, angular velocity and the accelerations that come without joint
/// acceleration, each of the body's material at the tip's place. Link i's are in lane i, the tip's are link 7's.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    pub v: [V3<Pair>; PAIRS],
    pub w: [V3<Pair>; PAIRS],
    /// Spatial, that is of the motion passing through the tip's place; material's is `a` + `w` × `v`.
    pub a: [V3<Pair>; PAIRS],
    pub dw: [V3<Pair>; PAIRS],
}

impl Motion {
    #[inline(always)]
    pub fn new(screws: &Screws, qd: &JointVector) -> Motion {
        let qd = pairs_of(qd, 0.0);
        let mut motion = Motion::default();
        for k in 0..PAIRS {
            motion.v[k] = screws.s[k] * qd[k];
            motion.w[k] = screws.r[k].z * qd[k];
        }
        sum_from_base(&mut motion.v);
        sum_from_base(&mut motion.w);
        for k in 0..PAIRS {
            let (s, z) = (screws.s[k] * qd[k], screws.r[k].z * qd[k]);
            let (v, w) = (motion.v[k], motion.w[k]);
            motion.a[k] = w.cross(s) + v.cross(z);
            motion.dw[k] = w.cross(z);
        }
        sum_from_base(&mut motion.a);
        sum_from_base(&mut motion.dw);
        motion
    }

    /// Twist of the tip and its J̇q̇.
    #[inline(always)]
    pub fn tip(&self) -> (Spatial, Spatial) {
        let (v, w) = (lane(&self.v, DOF), lane(&self.w, DOF));
        let (a, dw) = (lane(&self.a, DOF), lane(&self.dw, DOF));
        (spatial(v, w), spatial(a + w.cross(v), dw))
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
        None => Frames::new(model, q).pose(),
    }
}

/// Origins of the joints, base first, and of the tip, in the base frame (m): the arm as a picture shows it.
pub fn joint_origins(model: &ArmModel, q: &JointVector) -> [nalgebra::Vector3<f64>; DOF + 1] {
    let frames = Frames::new(model, q);
    frames.o.map(|o| V3::from(o).into())
}

/// Geometric Jacobian: twist of the tip = J q̇.
pub fn jacobian(model: &ArmModel, q: &JointVector) -> Jacobian {
    match &model.slide {
        Some(slide) => slide.jacobian(),
        None => Screws::new(&Frames::new(model, q)).jacobian(),
    }
}

/// J̇q̇: acceleration of the tip = J q̈ + J̇q̇ (m/s², rad/s²), for `qd` in rad/s.
pub fn jdot_qd(model: &ArmModel, q: &JointVector, qd: &JointVector) -> Spatial {
    match model.slide {
        Some(_) => Spatial::zeros(),
        None => Motion::new(&Screws::new(&Frames::new(model, q)), qd).tip().1,
    }
}

/// Pose, Jacobian, J̇q̇ and twist in one pass.
pub fn tip_motion(model: &ArmModel, q: &JointVector, qd: &JointVector) -> TipMotion {
    match &model.slide {
        Some(slide) => slide.tip_motion(q, qd),
        None => {
            let frames = Frames::new(model, q);
            let screws = Screws::new(&frames);
            tip_motion_of(frames.pose(), &screws, &Motion::new(&screws, qd))
        }
    }
}

#[inline(always)]
pub(crate) fn tip_motion_of(pose: Pose, screws: &Screws, motion: &Motion) -> TipMotion {
    let (twist, jdot_qd) = motion.tip();
    TipMotion { pose, jacobian: screws.jacobian(), jdot_qd, twist }
}
