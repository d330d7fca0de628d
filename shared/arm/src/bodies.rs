//! The links' moments of mass about the tip: what Newton–Euler, composite and articulated bodies start from.
//!
//! All links are referred to one point, the tip, in base axes. So bodies that move together are merged by addition, a
//! wrench passes from link to link unchanged, and the joint axes are the columns of the Jacobian.

use crate::kinematics::{Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3};

/// First moments (kg m) and second moments (kg m²) of the links about the tip, base axes. Base parameters (`chain`): no
/// link has a mass, its part of the first moments does not depend on the point of reference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bodies {
    pub first: [V3<Pair>; PAIRS],
    pub second: [Sym3<Pair>; PAIRS],
}

/// Forces (N) and moments about the tip (Nm) on the base parameters: only their components along the joints are physical.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrenches {
    pub f: [V3<Pair>; PAIRS],
    pub n: [V3<Pair>; PAIRS],
}

impl Bodies {
    #[inline(always)]
    pub fn new(model: &ArmModel, screws: &Screws) -> Bodies {
        let chain = &model.chain;
        let half = Pair::splat(0.5);
        let first = std::array::from_fn(|k| screws.r[k].x * chain.first[k].x + screws.r[k].y * chain.first[k].y);
        let second = std::array::from_fn(|k| {
            let (h, i, d, M3 { x, y, z }) = (chain.first[k], chain.second[k], screws.d[k], screws.r[k]);
            // R i Rᵀ + d (R h)ᵀ + (R h) dᵀ, ordered by the axes; i.zz and h.z are nothing
            Sym3::outer_sum(x, x * (i.xx * half) + y * i.xy + z * i.xz + d * h.x)
                + Sym3::outer_sum(y, y * (i.yy * half) + z * i.yz + d * h.y)
        });
        Bodies { first, second }
    }

    /// What each link on its own needs to move like this, gravity included.
    #[inline(always)]
    pub fn wrenches(&self, gravity: V3, motion: &Motion) -> Wrenches {
        let up = V3::pair(-gravity, -gravity);
        let spin: [M3<Pair>; PAIRS] = std::array::from_fn(|k| spin_matrix(motion.w[k], motion.dw[k]));
        let f = std::array::from_fn(|k| spin[k] * self.first[k]);
        let n = std::array::from_fn(|k| {
            let a = motion.a[k] + motion.w[k].cross(motion.v[k]) + up;
            let (h, i) = (self.first[k], self.second[k]);
            // moment of spin·x dm over x: the antisymmetric part of spin·second moments
            let of = |row: V3<Pair>, x: Pair, y: Pair, z: Pair| row.x * x + row.y * y + row.z * z;
            let (rx, ry, rz) = rows(spin[k]);
            let n = V3 {
                x: of(rz, i.xy, i.yy, i.yz) - of(ry, i.xz, i.yz, i.zz),
                y: of(rx, i.xz, i.yz, i.zz) - of(rz, i.xx, i.xy, i.xz),
                z: of(ry, i.xx, i.xy, i.xz) - of(rx, i.xy, i.yy, i.yz),
            };
            n + h.cross(a)
        });
        Wrenches { f, n }
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
