//! Inverse dynamics by recursive Newton–Euler: the joint torques that a motion needs.
//!
//! Gravity enters as an upward acceleration of the base. All vectors are in base axes; accelerations and moments are
//! taken at the joint origins, where the links' inertias are given.

use crate::kinematics::Frames;
use crate::model::ArmModel;
use crate::small::{M3, V3};
use crate::{DOF, JointVector};

/// Joint torques (Nm) for angles, speeds and accelerations (rad, rad/s, rad/s²): M(q) q̈ + C(q, q̇) q̇ + g(q).
pub fn rnea(model: &ArmModel, q: &JointVector, qd: &JointVector, qdd: &JointVector) -> JointVector {
    match &model.slide {
        Some(slide) => slide.rnea(model.gravity, qdd),
        None => rnea_in(model, &Frames::new(model, q), qd, qdd),
    }
}

/// C(q, q̇) q̇ + g(q) (Nm).
pub fn bias(model: &ArmModel, q: &JointVector, qd: &JointVector) -> JointVector {
    rnea(model, q, qd, &JointVector::zeros())
}

/// g(q): the torques that hold the arm still (Nm).
pub fn gravity_torque(model: &ArmModel, q: &JointVector) -> JointVector {
    bias(model, q, &JointVector::zeros())
}

#[inline(always)]
pub(crate) fn rnea_in(
    model: &ArmModel,
    frames: &Frames,
    qd: &JointVector,
    qdd: &JointVector,
) -> JointVector {
    let wrenches = link_wrenches(model, frames, qd, qdd);
    let mut tau = JointVector::zeros();
    let (mut f, mut n) = (V3::ZERO, V3::ZERO);
    for i in (0..DOF).rev() {
        if i + 1 < DOF {
            n += (frames.o[i + 1] - frames.o[i]).cross(f);
        }
        f += wrenches[i].f;
        n += wrenches[i].n;
        tau[i] = frames.r[i].z.dot(n);
    }
    tau
}

/// Force (N) and moment about the joint origin (Nm) that a link's motion asks for, in base axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrench {
    pub f: V3,
    pub n: V3,
}

/// The outward pass: what each link on its own needs to move so, gravity included.
#[inline(always)]
pub(crate) fn link_wrenches(
    model: &ArmModel,
    frames: &Frames,
    qd: &JointVector,
    qdd: &JointVector,
) -> [Wrench; DOF] {
    let mut out = [Wrench::default(); DOF];
    let (mut w, mut dw, mut a) = (V3::ZERO, V3::ZERO, -model.gravity);
    let mut spin = M3::default();
    for i in 0..DOF {
        if i > 0 {
            a += spin * (frames.o[i] - frames.o[i - 1]);
        }
        let r = &frames.r[i];
        let zd = r.z * qd[i];
        dw += r.z * qdd[i] + w.cross(zd);
        w += zd;
        spin = spin_matrix(w, dw);
        let body = &model.joints[i].body;
        let h = *r * body.h;
        let (wb, dwb) = (r.tr_mul(w), r.tr_mul(dw));
        out[i].f = a * body.m + spin * h;
        out[i].n = *r * (body.i * dwb + wb.cross(body.i * wb)) + h.cross(a);
    }
    out
}

/// `[ω̇]ₓ + [ω]ₓ²`: acceleration of a point of a body relative to its reference point, per offset.
#[inline(always)]
fn spin_matrix(w: V3, dw: V3) -> M3 {
    let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
    let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
    M3 {
        x: V3 {
            x: -(yy + zz),
            y: xy + dw.z,
            z: xz - dw.y,
        },
        y: V3 {
            x: xy - dw.z,
            y: -(xx + zz),
            z: yz + dw.x,
        },
        z: V3 {
            x: xz + dw.y,
            y: yz - dw.x,
            z: -(xx + yy),
        },
    }
}
