//! Forward dynamics by the articulated-body algorithm: the accelerations that torques and a tip wrench cause.
//!
//! Written for the difference to the motion without joint acceleration: the outward pass of Newton–Euler gives what each
//! link asks for at q̈ = 0 (gravity and velocity products included), then only the additional acceleration is propagated.

use crate::kinematics::Frames;
use crate::model::ArmModel;
use crate::rnea::link_wrenches;
use crate::small::{M3, Sym3, V3, v3};
use crate::{DOF, JointVector, Spatial};

/// Articulated inertia about a joint's origin: force = `a`·acceleration + `b`·angular acceleration,
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
        None => aba_in(model, &Frames::new(model, q), qd, tau, armature, f_tip),
    }
}

#[inline(always)]
pub(crate) fn aba_in(
    model: &ArmModel,
    frames: &Frames,
    qd: &JointVector,
    tau: &JointVector,
    armature: &JointVector,
    f_tip: &Spatial,
) -> JointVector {
    let wrenches = link_wrenches(model, frames, qd, &JointVector::zeros());
    let mut rows = [Row::default(); DOF];
    let mut art = Articulated::default();
    let f_ext = v3(f_tip[0], f_tip[1], f_tip[2]);
    let (mut f, mut n) = (-f_ext, -v3(f_tip[3], f_tip[4], f_tip[5]));
    for i in (0..DOF).rev() {
        let next = if i + 1 < DOF {
            frames.o[i + 1]
        } else {
            frames.tip
        };
        let d = next - frames.o[i];
        n += d.cross(f);
        let (r, body) = (&frames.r[i], &model.joints[i].body);
        if i + 1 < DOF {
            art = art.shifted(d);
        }
        art = art.plus_body(body.m, *r * body.h, body.i.rotated(*r));
        f += wrenches[i].f;
        n += wrenches[i].n;

        let z = r.z;
        let uf = art.b * z;
        let un = art.d * z;
        let inv = 1.0 / (z.dot(un) + armature[i]);
        let u = tau[i] - z.dot(n);
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
    for i in 0..DOF {
        if i > 0 {
            a += dw.cross(frames.o[i] - frames.o[i - 1]);
        }
        let row = &rows[i];
        qdd[i] = (row.u - row.uf.dot(a) - row.un.dot(dw)) * row.inv;
        dw += frames.r[i].z * qdd[i];
    }
    qdd
}

impl Articulated {
    /// About a point `d` further in: the present reference point lies at `d` from the new one.
    #[inline(always)]
    fn shifted(&self, d: V3) -> Articulated {
        // acceleration at the old point = a + dω × d, moment at the new = n + d × f;
        // with X = [d]ₓ: b' = b − a X, d' = d − bᵀ X + X b − X a X = d + X b' + (X b)ᵀ
        let a = self.a;
        let ax = a_times_skew(a, d);
        let b = M3 {
            x: self.b.x - ax.x,
            y: self.b.y - ax.y,
            z: self.b.z - ax.z,
        };
        let xb_new = skew_times(d, b);
        let xb = skew_times(d, self.b);
        Articulated {
            a,
            b,
            d: Sym3 {
                xx: self.d.xx + xb_new.x.x + xb.x.x,
                xy: self.d.xy + xb_new.y.x + xb.x.y,
                xz: self.d.xz + xb_new.z.x + xb.x.z,
                yy: self.d.yy + xb_new.y.y + xb.y.y,
                yz: self.d.yz + xb_new.z.y + xb.y.z,
                zz: self.d.zz + xb_new.z.z + xb.z.z,
            },
        }
    }

    /// With a rigid body of mass `m`, first moment `h` and tensor `i` about the same point.
    #[inline(always)]
    fn plus_body(mut self, m: f64, h: V3, i: Sym3) -> Articulated {
        self.a.xx += m;
        self.a.yy += m;
        self.a.zz += m;
        // force = m a − h × dω
        self.b.x += v3(0.0, -h.z, h.y);
        self.b.y += v3(h.z, 0.0, -h.x);
        self.b.z += v3(-h.y, h.x, 0.0);
        self.d = self.d + i;
        self
    }
}

/// `a [d]ₓ`.
#[inline(always)]
fn a_times_skew(a: Sym3, d: V3) -> M3 {
    let (x, y, z) = (
        v3(a.xx, a.xy, a.xz),
        v3(a.xy, a.yy, a.yz),
        v3(a.xz, a.yz, a.zz),
    );
    M3 {
        x: y * d.z - z * d.y,
        y: z * d.x - x * d.z,
        z: x * d.y - y * d.x,
    }
}

/// `[d]ₓ b`.
#[inline(always)]
fn skew_times(d: V3, b: M3) -> M3 {
    M3 {
        x: d.cross(b.x),
        y: d.cross(b.y),
        z: d.cross(b.z),
    }
}
