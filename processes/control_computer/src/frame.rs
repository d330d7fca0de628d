//! The task frame C, and differences of poses in it.
//!
//! C is fixed in the world, its z points into the surface. The whole law works in its axes, linear part first, moments
//! about the tool point; the arm's model takes C for its base. Pure geometry: nothing here fails.

use arm::{Pose, Spatial, TipMotion, rotation};
use nalgebra::{Matrix3, Vector3};

/// Pose, twist and acceleration of one thing (X, X_d or Xᵗ), in C.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position (m) and axes.
    pub pose: Pose,
    /// Linear and angular velocity (m/s, rad/s).
    pub twist: Spatial,
    /// Linear and angular acceleration (m/s², rad/s²).
    pub acceleration: Spatial,
}

impl Motion {
    /// At rest in a pose.
    pub fn at_rest(pose: Pose) -> Motion {
        Motion { pose, twist: Spatial::zeros(), acceleration: Spatial::zeros() }
    }
}

/// `a − b` of two poses: difference of the positions, and the rotation vector that takes the axes of `b` to those of `a`
/// (quaternion logarithm, so that it does not vanish at half a turn). For small angles it is −e(R_a, R_b) of the book's
/// ½ Σ nᵢ × n_dᵢ, which rotates `a` *towards* `b`: the printed laws hold for it with the signs of their linear rows.
pub fn difference(a: &Pose, b: &Pose) -> Spatial {
    spatial(a.p - b.p, rotation::log(&(a.r * b.r.transpose())))
}

/// Linear and angular part as one.
pub fn spatial(linear: Vector3<f64>, angular: Vector3<f64>) -> Spatial {
    Spatial::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Linear part.
pub fn linear(s: &Spatial) -> Vector3<f64> {
    Vector3::new(s[0], s[1], s[2])
}

/// Angular part.
pub fn angular(s: &Spatial) -> Vector3<f64> {
    Vector3::new(s[3], s[4], s[5])
}

/// Unit quaternion (w, x, y, z) with w ≥ 0, as messages carry orientations.
pub fn quaternion_wxyz(r: &Matrix3<f64>) -> [f64; 4] {
    let q = rotation::quaternion(r);
    let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
    [sign * q[3], sign * q[0], sign * q[1], sign * q[2]]
}

/// Rotation matrix of a quaternion (w, x, y, z) of length about 1.
pub fn rotation_of_wxyz(q: [f64; 4]) -> Matrix3<f64> {
    let n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    let [w, x, y, z] = q.map(|component| component / n);
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// The tool's kinematics in C, X, Ẋ = J q̇, J and J̇q̇: those of an arm seen from C.
pub type TaskKinematics = TipMotion;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_of_poses_is_the_motion_from_the_second_to_the_first() {
        let b = Pose { p: Vector3::new(1.0, 2.0, 3.0), r: rotation::from_rpy(0.4, -0.3, 1.0) };
        let v = Vector3::new(0.2, -0.1, 0.3);
        let a = Pose { p: b.p + Vector3::new(0.0, 0.0, 0.5), r: rotation::exp(&v) * b.r };
        let d = difference(&a, &b);
        assert!((d - spatial(Vector3::new(0.0, 0.0, 0.5), v)).amax() < 1e-14);
        let towards = rotation::orientation_error(&a.r, &b.r);
        assert!(angular(&d).dot(&towards) < 0.0, "e(R_a, R_b) points the other way");
    }

    #[test]
    fn quaternions_of_messages_lead_back_to_the_rotation() {
        for rpy in [[0.1, 0.2, 0.3], [3.1, 0.0, -1.3], [0.0, 3.0, 0.0], [-2.0, 1.0, 3.0]] {
            let r = rotation::from_rpy(rpy[0], rpy[1], rpy[2]);
            let q = quaternion_wxyz(&r);
            assert!(q[0] >= 0.0);
            assert!((rotation_of_wxyz(q) - r).amax() < 1e-14);
        }
    }
}
