//! Mass, first moment and inertia tensor of one rigid body, and whether such a body can exist.
//!
//! Kept at the origin of the body's joint frame (not at the centre of mass): so the algorithms need no shift per call,
//! and bodies that move together are merged by addition.

use crate::small::{M3, Sym3, V3};
use nalgebra::{Matrix3, Vector3};

/// Inertia of a body about the origin of the frame it is given in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Inertia {
    /// Mass (kg).
    pub m: f64,
    /// First moment m·c (kg m).
    pub h: V3,
    /// Tensor about the frame's origin (kg m²).
    pub i: Sym3,
}

impl Inertia {
    /// From the usual data: mass (kg), centre of mass (m), tensor about the centre of mass (kg m²), all in one frame.
    pub fn at_com(m: f64, com: V3, tensor: Sym3) -> Inertia {
        Inertia { m, h: com * m, i: tensor + Sym3::shift(com, com * (0.5 * m)) }
    }

    /// Centre of mass; the origin for a massless body.
    pub fn com(&self) -> V3 {
        if self.m == 0.0 { V3::ZERO } else { self.h * (1.0 / self.m) }
    }

    /// Tensor about the centre of mass.
    pub fn about_com(&self) -> Sym3 {
        self.i + Sym3::shift(self.com(), self.h * 0.5) * -1.0
    }

    /// The same body seen from a frame in which its present frame has axes `r` and origin `p`.
    pub fn moved(&self, r: M3, p: V3) -> Inertia {
        Inertia::at_com(self.m, r * self.com() + p, self.about_com().rotated(r))
    }

    /// The same body seen from a frame in which its present frame has axes `r` and the same origin.
    pub fn turned(&self, r: M3) -> Inertia {
        Inertia { m: self.m, h: r * self.h, i: self.i.rotated(r) }
    }

    /// Two bodies in one frame, moving together.
    pub fn plus(&self, b: &Inertia) -> Inertia {
        Inertia { m: self.m + b.m, h: self.h + b.h, i: self.i + b.i }
    }
}

/// Whether a tensor about the centre of mass (kg m²) belongs to a distribution of positive mass: every principal moment
/// at most the sum of the other two, which is ½ tr(I)·1 − I (the second moments of the mass) positive semi-definite.
/// Rounding in printed data is forgiven up to 1e-6 of the trace.
pub(crate) fn is_physical(tensor: &Matrix3<f64>) -> bool {
    let half = 0.5 * tensor.trace();
    let slack = 2e-6 * half;
    let s = Matrix3::identity() * (half + slack) - tensor;
    half >= 0.0 && s.iter().all(|v| v.is_finite()) && (half == 0.0 && tensor.amax() == 0.0 || s.cholesky().is_some())
}

impl From<Sym3> for Matrix3<f64> {
    fn from(s: Sym3) -> Matrix3<f64> {
        Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz)
    }
}

impl From<Matrix3<f64>> for Sym3 {
    fn from(m: Matrix3<f64>) -> Sym3 {
        Sym3 { xx: m.m11, xy: m.m12, xz: m.m13, yy: m.m22, yz: m.m23, zz: m.m33 }
    }
}

/// A body's data as a person reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyInertia {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the link's frame (m).
    pub com: Vector3<f64>,
    /// Inertia tensor about the centre of mass, axes of the link's frame (kg m²).
    pub tensor: Matrix3<f64>,
}

impl From<&Inertia> for BodyInertia {
    fn from(b: &Inertia) -> BodyInertia {
        BodyInertia { mass: b.m, com: b.com().into(), tensor: b.about_com().into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::v3;

    #[test]
    fn a_moved_body_keeps_its_mass_and_its_tensor_about_the_centre_of_mass() {
        let r = M3 { x: v3(0.36, -0.8, 0.48), y: v3(0.48, 0.6, 0.64), z: v3(-0.8, 0.0, 0.6) };
        let tensor = Sym3 { xx: 0.2, xy: 0.01, xz: -0.02, yy: 0.3, yz: 0.015, zz: 0.25 };
        let body = Inertia::at_com(3.0, v3(0.1, 0.2, -0.3), tensor);
        let p = v3(1.0, -2.0, 0.5);
        let back = body.moved(r, p).moved(r.transpose(), -(r.transpose() * p));
        let difference: Matrix3<f64> = (back.about_com() + tensor * -1.0).into();
        assert!(difference.amax() < 1e-14);
        assert!((back.com() + v3(-0.1, -0.2, 0.3)).dot(v3(1.0, 1.0, 1.0)).abs() < 1e-14);
    }

    #[test]
    fn the_parallel_axis_theorem_holds_for_a_point_mass() {
        let body = Inertia::at_com(2.0, v3(0.0, 3.0, 0.0), Sym3::default());
        assert_eq!((body.i.xx, body.i.yy, body.i.zz), (18.0, 0.0, 18.0));
    }

    #[test]
    fn a_tensor_that_breaks_the_triangle_inequality_is_no_body() {
        assert!(is_physical(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0))));
        assert!(is_physical(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 2.0))), "a flat plate");
        assert!(is_physical(&Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0))), "a thin rod");
        assert!(is_physical(&Matrix3::zeros()), "a point");
        assert!(!is_physical(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 2.1))));
        assert!(!is_physical(&Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0))));
        assert!(!is_physical(&Matrix3::new(1.0, 0.9, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0, 0.1)), "hidden by the axes");
        assert!(!is_physical(&Matrix3::from_element(f64::NAN)));
    }
}
