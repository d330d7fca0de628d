//! Forward dynamics by the articulated-body algorithm: the accelerations that torques and a tip wrench cause.
//!
//! Written for the difference to the motion without joint acceleration: Newton–Euler gives what each link asks for at
//! q̈ = 0 (gravity and velocity products included), then only the additional acceleration is propagated. All about the
//! tip, so an articulated inertia passes from link to link unchanged.

use crate::bodies::{bodies, wrenches};
use crate::kinematics::{Motion, Screw, Screws, frames, screws};
use crate::lanes::{Lanes, PAIRS, lane};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3, v3};
use crate::{DOF, JointVector, Spatial};

/// Articulated inertia about the tip: force = `a`·acceleration + `b`·angular acceleration,
/// moment = `b`ᵀ·acceleration + `d`·angular acceleration.
#[derive(Clone, Copy, Debug, Default)]
struct Articulated {
    a: Sym3,
    b: M3,
    d: Sym3,
}

/// What the inward pass leaves for the outward one.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// Force and moment per unit acceleration of this joint.
    uf: V3,
    un: V3,
    /// Reciprocal of the inertia felt at the joint, armature included.
    inv: f64,
    /// Torque left to accelerate the joint.
    u: f64,
}

/// Joint accelerations (rad/s²) for torques `tau` (Nm). `armature` (kg m²) is added to the mass matrix' diagonal (rotor
/// inertia seen at the output; zero for none); `f_tip` is the wrench that acts ON the tip (N, Nm; base axes, at the tip).
pub fn aba(
    model: &ArmModel,
    q: &JointVector,
    qd: &JointVector,
    tau: &JointVector,
    armature: &JointVector,
    f_tip: &Spatial,
) -> JointVector {
    match &model.slide {
        Some(slide) => slide.aba(model.gravity, tau, armature, f_tip),
        None => {
            let screws = screws(&frames(model, q));
            let motion = Motion::new(&screws, qd);
            aba_in(model, &screws, &motion, tau, armature, f_tip)
        }
    }
}

#[inline(always)]
pub(crate) fn aba_in(
    model: &ArmModel,
    screws: &Screws,
    motion: &Motion,
    tau: &JointVector,
    armature: &JointVector,
    f_tip: &Spatial,
) -> JointVector {
    let bodies = bodies(model, screws);
    let needed = wrenches(&bodies, model.gravity, motion);
    let axis = |i: usize| {
        let Screw { s, r, .. } = screws[i % PAIRS];
        if i < PAIRS { (s.low(), r.z.low()) } else { (s.high(), r.z.high()) }
    };
    let mut rows = [Row::default(); DOF];
    let mut art = Articulated::default();
    let mut f = -v3(f_tip[0], f_tip[1], f_tip[2]);
    let mut n = -v3(f_tip[3], f_tip[4], f_tip[5]);
    for i in (0..DOF).rev() {
        let ((s, z), body, wrench) = (axis(i), lane(&bodies, i), lane(&needed, i));
        art.add_body(body.first, body.second.complement());
        f += wrench.f;
        n += wrench.n;

        let uf = art.a * s + art.b * z;
        let un = v3(art.b.x.dot(s), art.b.y.dot(s), art.b.z.dot(s)) + art.d * z;
        let inv = 1.0 / (s.dot(uf) + z.dot(un) + armature[i]);
        let u = tau[i] - s.dot(f) - z.dot(n);
        rows[i] = Row { uf, un, inv, u };
        art.a = art.a.minus_outer(uf, inv);
        art.d = art.d.minus_outer(un, inv);
        let w = un * inv;
        art.b.x -= uf * w.x;
        art.b.y -= uf * w.y;
        art.b.z -= uf * w.z;
        f += uf * (u * inv);
        n += un * (u * inv);
    }

    let mut qdd = JointVector::zeros();
    let (mut a, mut dw) = (V3::ZERO, V3::ZERO);
    for (i, row) in rows.iter().enumerate() {
        qdd[i] = (row.u - row.uf.dot(a) - row.un.dot(dw)) * row.inv;
        let (s, z) = axis(i);
        a += s * qdd[i];
        dw += z * qdd[i];
    }
    qdd
}

impl Articulated {
    /// With a rigid body of first moment `h` and inertia tensor `i`; base parameters have no mass.
    #[inline(always)]
    fn add_body(&mut self, h: V3, i: Sym3) {
        // force = −h × dω
        self.b.x += v3(0.0, -h.z, h.y);
        self.b.y += v3(h.z, 0.0, -h.x);
        self.b.z += v3(-h.y, h.x, 0.0);
        self.d = self.d + i;
    }
}
