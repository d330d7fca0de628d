//! Three-vectors, 3×3 matrices and symmetric 3×3 matrices with nothing but plain multiplications and additions.
//!
//! The inner loops of the arm's algorithms use these instead of nalgebra: every operation is written out, so the
//! compiler keeps it in registers, and the order of the additions is the same on every machine. Nothing here fails.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A 3-vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct V3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// A 3×3 matrix by columns; of a rotation, the axes of the rotated frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct M3 {
    pub x: V3,
    pub y: V3,
    pub z: V3,
}

/// A symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sym3 {
    pub xx: f64,
    pub xy: f64,
    pub xz: f64,
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
}

pub(crate) const fn v3(x: f64, y: f64, z: f64) -> V3 {
    V3 { x, y, z }
}

impl V3 {
    pub const ZERO: V3 = v3(0.0, 0.0, 0.0);

    #[inline(always)]
    pub fn dot(self, b: V3) -> f64 {
        self.x * b.x + self.y * b.y + self.z * b.z
    }

    #[inline(always)]
    pub fn cross(self, b: V3) -> V3 {
        v3(
            self.y * b.z - self.z * b.y,
            self.z * b.x - self.x * b.z,
            self.x * b.y - self.y * b.x,
        )
    }
}

impl M3 {
    pub const IDENTITY: M3 = M3 {
        x: v3(1.0, 0.0, 0.0),
        y: v3(0.0, 1.0, 0.0),
        z: v3(0.0, 0.0, 1.0),
    };

    /// `selfᵀ v`.
    #[inline(always)]
    pub fn tr_mul(self, v: V3) -> V3 {
        v3(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    pub fn transpose(self) -> M3 {
        M3 {
            x: v3(self.x.x, self.y.x, self.z.x),
            y: v3(self.x.y, self.y.y, self.z.y),
            z: v3(self.x.z, self.y.z, self.z.z),
        }
    }
}

impl Sym3 {
    /// `R self Rᵀ`: the same tensor, its components given along the axes that `R` maps to.
    #[inline(always)]
    pub fn rotated(self, r: M3) -> Sym3 {
        let t = M3 {
            x: r.x * self.xx + r.y * self.xy + r.z * self.xz,
            y: r.x * self.xy + r.y * self.yy + r.z * self.yz,
            z: r.x * self.xz + r.y * self.yz + r.z * self.zz,
        };
        Sym3 {
            xx: t.x.x * r.x.x + t.y.x * r.y.x + t.z.x * r.z.x,
            xy: t.x.x * r.x.y + t.y.x * r.y.y + t.z.x * r.z.y,
            xz: t.x.x * r.x.z + t.y.x * r.y.z + t.z.x * r.z.z,
            yy: t.x.y * r.x.y + t.y.y * r.y.y + t.z.y * r.z.y,
            yz: t.x.y * r.x.z + t.y.y * r.y.z + t.z.y * r.z.z,
            zz: t.x.z * r.x.z + t.y.z * r.y.z + t.z.z * r.z.z,
        }
    }

    /// `−([a]ₓ[b]ₓ + [b]ₓ[a]ₓ)`: how the inertia tensor of a body with first moment `b` grows when its reference point moves.
    #[inline(always)]
    pub fn shift(a: V3, b: V3) -> Sym3 {
        let (x, y, z) = (2.0 * a.x * b.x, 2.0 * a.y * b.y, 2.0 * a.z * b.z);
        Sym3 {
            xx: y + z,
            yy: x + z,
            zz: x + y,
            xy: -(a.x * b.y + a.y * b.x),
            xz: -(a.x * b.z + a.z * b.x),
            yz: -(a.y * b.z + a.z * b.y),
        }
    }

    /// `self − v vᵀ s`.
    #[inline(always)]
    pub fn minus_outer(self, v: V3, s: f64) -> Sym3 {
        let w = v * s;
        Sym3 {
            xx: self.xx - v.x * w.x,
            xy: self.xy - v.x * w.y,
            xz: self.xz - v.x * w.z,
            yy: self.yy - v.y * w.y,
            yz: self.yz - v.y * w.z,
            zz: self.zz - v.z * w.z,
        }
    }
}

impl Mul<V3> for Sym3 {
    type Output = V3;
    #[inline(always)]
    fn mul(self, v: V3) -> V3 {
        v3(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl Mul<f64> for Sym3 {
    type Output = Sym3;
    #[inline(always)]
    fn mul(self, s: f64) -> Sym3 {
        Sym3 {
            xx: self.xx * s,
            xy: self.xy * s,
            xz: self.xz * s,
            yy: self.yy * s,
            yz: self.yz * s,
            zz: self.zz * s,
        }
    }
}

impl Add for Sym3 {
    type Output = Sym3;
    #[inline(always)]
    fn add(self, b: Sym3) -> Sym3 {
        Sym3 {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yy: self.yy + b.yy,
            yz: self.yz + b.yz,
            zz: self.zz + b.zz,
        }
    }
}

impl Mul<V3> for M3 {
    type Output = V3;
    #[inline(always)]
    fn mul(self, v: V3) -> V3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

impl Mul for M3 {
    type Output = M3;
    #[inline(always)]
    fn mul(self, b: M3) -> M3 {
        M3 {
            x: self * b.x,
            y: self * b.y,
            z: self * b.z,
        }
    }
}

impl Mul<f64> for V3 {
    type Output = V3;
    #[inline(always)]
    fn mul(self, s: f64) -> V3 {
        v3(self.x * s, self.y * s, self.z * s)
    }
}

impl Add for V3 {
    type Output = V3;
    #[inline(always)]
    fn add(self, b: V3) -> V3 {
        v3(self.x + b.x, self.y + b.y, self.z + b.z)
    }
}

impl Sub for V3 {
    type Output = V3;
    #[inline(always)]
    fn sub(self, b: V3) -> V3 {
        v3(self.x - b.x, self.y - b.y, self.z - b.z)
    }
}

impl Neg for V3 {
    type Output = V3;
    #[inline(always)]
    fn neg(self) -> V3 {
        v3(-self.x, -self.y, -self.z)
    }
}

impl AddAssign for V3 {
    #[inline(always)]
    fn add_assign(&mut self, b: V3) {
        *self = *self + b;
    }
}

impl SubAssign for V3 {
    #[inline(always)]
    fn sub_assign(&mut self, b: V3) {
        *self = *self - b;
    }
}

impl From<Vector3<f64>> for V3 {
    fn from(v: Vector3<f64>) -> V3 {
        v3(v.x, v.y, v.z)
    }
}

impl From<V3> for Vector3<f64> {
    fn from(v: V3) -> Vector3<f64> {
        Vector3::new(v.x, v.y, v.z)
    }
}

impl From<Matrix3<f64>> for M3 {
    fn from(m: Matrix3<f64>) -> M3 {
        M3 {
            x: v3(m.m11, m.m21, m.m31),
            y: v3(m.m12, m.m22, m.m32),
            z: v3(m.m13, m.m23, m.m33),
        }
    }
}

impl From<M3> for Matrix3<f64> {
    fn from(m: M3) -> Matrix3<f64> {
        Matrix3::new(
            m.x.x, m.y.x, m.z.x, m.x.y, m.y.y, m.z.y, m.x.z, m.y.z, m.z.z,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotating_and_shifting_a_tensor_equal_the_matrix_products_they_stand_for() {
        let r = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
        let s = Sym3 {
            xx: 1.0,
            xy: 0.2,
            xz: -0.3,
            yy: 2.0,
            yz: 0.4,
            zz: 3.0,
        };
        let full = |s: Sym3| Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz);
        assert!((full(s.rotated(r.into())) - r * full(s) * r.transpose()).amax() < 1e-15);

        let (a, b) = (Vector3::new(0.3, -0.7, 1.1), Vector3::new(-2.0, 0.4, 0.9));
        let (ax, bx) = (a.cross_matrix(), b.cross_matrix());
        assert!((full(Sym3::shift(a.into(), b.into())) + ax * bx + bx * ax).amax() < 1e-15);
    }
}
