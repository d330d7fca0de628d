//! Three-vectors, 3×3 matrices and symmetric 3×3 matrices with nothing but plain multiplications and additions, of numbers
//! or of pairs of numbers (`lanes`).
//!
//! The inner loops of the arm's algorithms use these instead of nalgebra: every operation is written out, so the
//! compiler keeps it in registers, and the order of the additions is the same on every machine. Nothing here fails.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// What a component may be: a number, or one for each of two joints ([`crate::Pair`]), so that what is the same for all
/// joints is written once and computed two at a time.
pub trait Real:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// The same number for both joints.
    fn of(x: f64) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Cut to ±`limit`, which is not negative; what is no number stays so.
    fn within(self, limit: Self) -> Self;
    /// Sine and cosine of an angle (rad), to the last bit or two.
    fn sin_cos(self) -> (Self, Self);
    /// e⁻ˣ of what is not negative, to the last bit of 1.
    fn exp_minus(self) -> Self;
}

/// A 3-vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct V3<T = f64> {
    pub x: T,
    pub y: T,
    pub z: T,
}

/// A 3×3 matrix by columns; of a rotation, the axes of the rotated frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct M3<T = f64> {
    pub x: V3<T>,
    pub y: V3<T>,
    pub z: V3<T>,
}

/// A symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sym3<T = f64> {
    pub xx: T,
    pub xy: T,
    pub xz: T,
    pub yy: T,
    pub yz: T,
    pub zz: T,
}

pub(crate) const fn v3<T>(x: T, y: T, z: T) -> V3<T> {
    V3 { x, y, z }
}

impl V3 {
    pub const ZERO: V3 = v3(0.0, 0.0, 0.0);
}

impl<T: Real> V3<T> {
    #[inline(always)]
    pub fn dot(self, b: V3<T>) -> T {
        self.x * b.x + self.y * b.y + self.z * b.z
    }

    #[inline(always)]
    pub fn cross(self, b: V3<T>) -> V3<T> {
        v3(self.y * b.z - self.z * b.y, self.z * b.x - self.x * b.z, self.x * b.y - self.y * b.x)
    }
}

impl M3 {
    pub const IDENTITY: M3 = M3 { x: v3(1.0, 0.0, 0.0), y: v3(0.0, 1.0, 0.0), z: v3(0.0, 0.0, 1.0) };

    pub fn transpose(self) -> M3 {
        M3 {
            x: v3(self.x.x, self.y.x, self.z.x),
            y: v3(self.x.y, self.y.y, self.z.y),
            z: v3(self.x.z, self.y.z, self.z.z),
        }
    }
}

impl<T: Real> Sym3<T> {
    /// `R self Rᵀ`: the same tensor, its components given along the axes that `R` maps to.
    #[inline(always)]
    pub fn rotated(self, r: M3<T>) -> Sym3<T> {
        // column by column, so that few numbers live at a time
        let part = |t: V3<T>, r: V3<T>| Sym3 {
            xx: t.x * r.x,
            xy: t.x * r.y,
            xz: t.x * r.z,
            yy: t.y * r.y,
            yz: t.y * r.z,
            zz: t.z * r.z,
        };
        part(r.x * self.xx + r.y * self.xy + r.z * self.xz, r.x)
            + part(r.x * self.xy + r.y * self.yy + r.z * self.yz, r.y)
            + part(r.x * self.xz + r.y * self.yz + r.z * self.zz, r.z)
    }

    /// `a bᵀ + b aᵀ`: how second moments of a body with first moment `b` grow when its reference point moves by −`a`.
    #[inline(always)]
    pub fn outer_sum(a: V3<T>, b: V3<T>) -> Sym3<T> {
        let (x, y, z) = (a.x * b.x, a.y * b.y, a.z * b.z);
        Sym3 {
            xx: x + x,
            yy: y + y,
            zz: z + z,
            xy: a.x * b.y + a.y * b.x,
            xz: a.x * b.z + a.z * b.x,
            yz: a.y * b.z + a.z * b.y,
        }
    }

    /// `a bᵀ + b aᵀ` of two pairs (a, b), added.
    #[inline(always)]
    pub fn outer_sums((a, b): (V3<T>, V3<T>), (c, d): (V3<T>, V3<T>)) -> Sym3<T> {
        let (x, y, z) = (a.x * b.x + c.x * d.x, a.y * b.y + c.y * d.y, a.z * b.z + c.z * d.z);
        Sym3 {
            xx: x + x,
            yy: y + y,
            zz: z + z,
            xy: (a.x * b.y + a.y * b.x) + (c.x * d.y + c.y * d.x),
            xz: (a.x * b.z + a.z * b.x) + (c.x * d.z + c.z * d.x),
            yz: (a.y * b.z + a.z * b.y) + (c.y * d.z + c.z * d.y),
        }
    }

    /// `(tr(self)·1 − self) v`: angular momentum of these second moments at angular velocity `v`.
    #[inline(always)]
    pub fn momentum(self, v: V3<T>) -> V3<T> {
        v3(
            (self.yy + self.zz) * v.x - (self.xy * v.y + self.xz * v.z),
            (self.xx + self.zz) * v.y - (self.xy * v.x + self.yz * v.z),
            (self.xx + self.yy) * v.z - (self.xz * v.x + self.yz * v.y),
        )
    }

    #[inline(always)]
    pub fn trace(self) -> T {
        self.xx + self.yy + self.zz
    }

    /// `self − v vᵀ s`.
    #[inline(always)]
    pub fn minus_outer(self, v: V3<T>, s: T) -> Sym3<T> {
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

impl Sym3 {
    /// `−([a]ₓ[b]ₓ + [b]ₓ[a]ₓ)`: how the inertia tensor of a body with first moment `b` grows when its reference point moves.
    pub fn shift(a: V3, b: V3) -> Sym3 {
        Sym3::outer_sum(a, b).complement()
    }

    pub fn with_halved_diagonal(self) -> Sym3 {
        Sym3 { xx: 0.5 * self.xx, yy: 0.5 * self.yy, zz: 0.5 * self.zz, ..self }
    }

    /// `tr(self)·1 − self`: the inertia tensor of these second moments.
    #[inline(always)]
    pub fn complement(self) -> Sym3 {
        Sym3 {
            xx: self.yy + self.zz,
            yy: self.xx + self.zz,
            zz: self.xx + self.yy,
            xy: -self.xy,
            xz: -self.xz,
            yz: -self.yz,
        }
    }

    /// `½ tr(self)·1 − self`: the second moments of this inertia tensor.
    pub fn second_moments(self) -> Sym3 {
        let half = 0.5 * self.trace();
        Sym3 { xx: half - self.xx, yy: half - self.yy, zz: half - self.zz, xy: -self.xy, xz: -self.xz, yz: -self.yz }
    }
}

impl<T: Real> Mul<V3<T>> for Sym3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn mul(self, v: V3<T>) -> V3<T> {
        v3(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl<T: Real> Mul<T> for Sym3<T> {
    type Output = Sym3<T>;
    #[inline(always)]
    fn mul(self, s: T) -> Sym3<T> {
        Sym3 { xx: self.xx * s, xy: self.xy * s, xz: self.xz * s, yy: self.yy * s, yz: self.yz * s, zz: self.zz * s }
    }
}

impl<T: Real> Add for Sym3<T> {
    type Output = Sym3<T>;
    #[inline(always)]
    fn add(self, b: Sym3<T>) -> Sym3<T> {
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

impl<T: Real> Mul<V3<T>> for M3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn mul(self, v: V3<T>) -> V3<T> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

impl<T: Real> Mul for M3<T> {
    type Output = M3<T>;
    #[inline(always)]
    fn mul(self, b: M3<T>) -> M3<T> {
        M3 { x: self * b.x, y: self * b.y, z: self * b.z }
    }
}

impl<T: Real> Mul<T> for V3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn mul(self, s: T) -> V3<T> {
        v3(self.x * s, self.y * s, self.z * s)
    }
}

impl<T: Real> Add for V3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn add(self, b: V3<T>) -> V3<T> {
        v3(self.x + b.x, self.y + b.y, self.z + b.z)
    }
}

impl<T: Real> Sub for V3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn sub(self, b: V3<T>) -> V3<T> {
        v3(self.x - b.x, self.y - b.y, self.z - b.z)
    }
}

impl<T: Real> Neg for V3<T> {
    type Output = V3<T>;
    #[inline(always)]
    fn neg(self) -> V3<T> {
        v3(-self.x, -self.y, -self.z)
    }
}

impl<T: Real> AddAssign for V3<T> {
    #[inline(always)]
    fn add_assign(&mut self, b: V3<T>) {
        *self = *self + b;
    }
}

impl<T: Real> SubAssign for V3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, b: V3<T>) {
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
        M3 { x: v3(m.m11, m.m21, m.m31), y: v3(m.m12, m.m22, m.m32), z: v3(m.m13, m.m23, m.m33) }
    }
}

impl From<M3> for Matrix3<f64> {
    fn from(m: M3) -> Matrix3<f64> {
        Matrix3::new(m.x.x, m.y.x, m.z.x, m.x.y, m.y.y, m.z.y, m.x.z, m.y.z, m.z.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotating_and_shifting_a_tensor_equal_the_matrix_products_they_stand_for() {
        let r = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
        let s = Sym3 { xx: 1.0, xy: 0.2, xz: -0.3, yy: 2.0, yz: 0.4, zz: 3.0 };
        let full = |s: Sym3| Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz);
        assert!((full(s.rotated(r.into())) - r * full(s) * r.transpose()).amax() < 1e-15);

        let v = Vector3::new(0.5, -1.5, 2.0);
        let momentum: Vector3<f64> = s.momentum(v.into()).into();
        assert!((momentum - (v * s.trace() - full(s) * v)).amax() < 1e-15);

        let (a, b) = (Vector3::new(0.3, -0.7, 1.1), Vector3::new(-2.0, 0.4, 0.9));
        let sums = full(Sym3::outer_sums((a.into(), b.into()), (b.into(), v.into())));
        assert!(
            (sums - (a * b.transpose() + b * a.transpose() + b * v.transpose() + v * b.transpose())).amax() < 1e-14
        );
        let (ax, bx) = (a.cross_matrix(), b.cross_matrix());
        assert!((full(Sym3::shift(a.into(), b.into())) + ax * bx + bx * ax).amax() < 1e-15);
    }
}
