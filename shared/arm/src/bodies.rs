//! The links' moments of mass about the tip: what Newton–Euler, composite and articulated bodies start from.
//!
//! All links are referred to one point, the tip, in base axes. So bodies that move together are merged by addition, a
//! wrench passes from link to link unchanged, and the joint axes are the columns of the Jacobian.

use crate::kinematics::{Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3};

/// First moment (kg m) and second moments (kg m²) of a link, or of several together, about the tip, base axes. Base
/// parameters (`chain`): no link has a mass, its part of the first moments does not depend on the point of reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Body<T = f64> {
    pub first: V3<T>,
    pub second: Sym3<T>,
}

/// The links' moments.
pub(crate) type Bodies = [Body<Pair>; PAIRS];

/// Force (N) and moment about the tip (Nm) on the base parameters: only the components along the joints are physical.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrench<T = f64> {
    pub f: V3<T>,
    pub n: V3<T>,
}

#[inline(always)]
pub(crate) fn bodies(model: &ArmModel, screws: &Screws) -> Bodies {
    let links = &model.chain.links;
    std::array::from_fn(|k| {
        let (h, i) = (links[k].first, links[k].second);
        let (d, M3 { x, y, z }) = (screws[k].d, screws[k].r);
        Body {
            first: x * h.x + y * h.y,
            // R i Rᵀ + d (R h)ᵀ + (R h) dᵀ, ordered by the axes; i.zz and h.z are nothing
            second: Sym3::outer_sums((x, x * i.xx + y * i.xy + z * i.xz + d * h.x), (y, y * i.yy + z * i.yz + d * h.y)),
        }
    })
}

/// What each link on its own needs to move like this, gravity included.
#[inline(always)]
pub(crate) fn wrenches(bodies: &Bodies, gravity: V3, motion: &Motion) -> [Wrench<Pair>; PAIRS] {
    let up = V3::pair(-gravity, -gravity);
    std::array::from_fn(|k| {
        let (h, i) = (bodies[k].first, bodies[k].second);
        let spin = spin_matrix(motion.w[k], motion.dw[k]);
        // moment of spin·x dm over x: the antisymmetric part of spin·second moments
        let of = |row: V3<Pair>, x: Pair, y: Pair, z: Pair| row.x * x + row.y * y + row.z * z;
        let (rx, ry, rz) = rows(spin);
        let n = V3 {
            x: of(rz, i.xy, i.yy, i.yz) - of(ry, i.xz, i.yz, i.zz),
            y: of(rx, i.xz, i.yz, i.zz) - of(rz, i.xx, i.xy, i.xz),
            z: of(ry, i.xx, i.xy, i.xz) - of(rx, i.xy, i.yy, i.yz),
        };
        Wrench { f: spin * h, n: n + h.cross(motion.a[k] + up) }
    })
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
