//! The links' masses about the tip: what Newton–Euler, composite and articulated bodies start from.
//!
//! All links are referred to one point, the tip, in base axes. So bodies that move together are merged by addition, a
//! wrench passes from link to link unchanged, and the joint axes are the columns of the Jacobian.

use crate::kinematics::{Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3};

/// Masses (kg), first moments (kg m) and second moments (kg m²) of the links about the tip, base axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bodies {
    pub mass: [Pair; PAIRS],
    pub first: [V3<Pair>; PAIRS],
    pub second: [Sym3<Pair>; PAIRS],
}

/// Forces (N) and moments about the tip (Nm).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrenches {
    pub f: [V3<Pair>; PAIRS],
    pub n: [V3<Pair>; PAIRS],
}

impl Bodies {
    #[inline(always)]
    pub fn new(model: &ArmModel, screws: &Screws) -> Bodies {
        let chain = &model.chain;
        let mut bodies = Bodies { mass: chain.mass, ..Bodies::default() };
        for k in 0..PAIRS {
            let (m, d, r) = (chain.mass[k], screws.d[k], screws.r[k]);
            let turned = r * chain.first[k];
            let by_distance = d * m;
            bodies.first[k] = turned + by_distance;
            bodies.second[k] = chain.second[k].rotated(r) + Sym3::outer_sum(d, turned + by_distance * Pair::splat(0.5));
        }
        bodies
    }

    /// What each link on its own needs to move like this, gravity included.
    #[inline(always)]
    pub fn wrenches(&self, gravity: V3, motion: &Motion) -> Wrenches {
        let up = V3::pair(-gravity, -gravity);
        let mut out = Wrenches::default();
        for k in 0..PAIRS {
            let w = motion.w[k];
            let a = motion.a[k] + w.cross(motion.v[k]) + up;
            let spin = spin_matrix(w, motion.dw[k]);
            let (h, i) = (self.first[k], self.second[k]);
            out.f[k] = a * self.mass[k] + spin * h;
            // moment of spin·x dm over x: the antisymmetric part of spin·second moments
            let of = |row: V3<Pair>, x: Pair, y: Pair, z: Pair| row.x * x + row.y * y + row.z * z;
            let (rx, ry, rz) = rows(spin);
            let n = V3 {
                x: of(rz, i.xy, i.yy, i.yz) - of(ry, i.xz, i.yz, i.zz),
                y: of(rx, i.xz, i.yz, i.zz) - of(rz, i.xx, i.xy, i.xz),
                z: of(ry, i.xx, i.xy, i.xz) - of(rx, i.xy, i.yy, i.yz),
            };
            out.n[k] = n + h.cross(a);
        }
        out
    }
}

#[inline(always)]
fn rows(m: M3<Pair>) -> (V3<Pair>, V3<Pair>, V3<Pair>) {
    let row = |part: fn(V3<Pair>) -> Pair| V3 { x: part(m.x), y: part(m.y), z: part(m.z) };
    (row(|v| v.x), row(|v| v.y), row(|v| v.z))
}

/// `[ω̇]ₓ + [ω]ₓ²`: acceleration of a point of a body relative to its reference point, per offset.
#[inline(always)]
fn spin_matrix(w: V3<Pair>, dw: V3<Pair>) -> M3<Pair> {
    let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
    let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
    M3 {
        x: V3 { x: -(yy + zz), y: xy + dw.z, z: xz - dw.y },
        y: V3 { x: xy - dw.z, y: -(xx + zz), z: yz + dw.x },
        z: V3 { x: xz + dw.y, y: yz - dw.x, z: -(xx + yy) },
    }
}
