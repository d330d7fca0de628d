//! Rotations: exponential, logarithm, orientation error, roll-pitch-yaw. All angles in radians.
//!
//! The logarithm goes through the unit quaternion, so it stays accurate up to half a turn; at exactly half a turn, where
//! both signs of the axis are right, it picks one. Inputs are taken to be rotations; nothing is checked or repaired.

use nalgebra::{Matrix3, Vector3, Vector4};

/// Rotation vector (axis × angle, angle in [0, π]) of a rotation matrix.
pub fn log(r: &Matrix3<f64>) -> Vector3<f64> {
    let q = quaternion(r);
    // the rotation vector of the short way round
    let (w, v) = if q[3] < 0.0 { (-q[3], -q.xyz()) } else { (q[3], q.xyz()) };
    let s = v.norm();
    if s < 1e-8 {
        // 2 atan(s/w)/s to within s²/3
        return v * (2.0 / w);
    }
    v * (2.0 * libm::atan2(s, w) / s)
}

/// Rotation matrix of a rotation vector (Rodrigues).
pub fn exp(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = v.norm_squared();
    let angle = angle2.sqrt();
    let (a, b) = if angle < 1e-4 {
        (1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0)
    } else {
        let half = libm::sin(0.5 * angle);
        (libm::sin(angle) / angle, 2.0 * half * half / angle2)
    };
    let k = v.cross_matrix();
    Matrix3::identity() + k * a + k * k * b
}

/// ½ Σ nᵢ × n_dᵢ over the columns: sin(angle) times the axis of the rotation, in base axes, that takes `r` to `rd`.
pub fn orientation_error(r: &Matrix3<f64>, rd: &Matrix3<f64>) -> Vector3<f64> {
    let mut e = Vector3::zeros();
    for i in 0..3 {
        e += r.column(i).cross(&rd.column(i));
    }
    e * 0.5
}

/// Rz(yaw) Ry(pitch) Rx(roll): roll about the fixed x, then pitch about the fixed y, then yaw about the fixed z.
pub fn from_rpy(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
    Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    )
}

/// Roll, pitch, yaw of a rotation matrix, pitch in [−π/2, π/2]; where the pitch is ±π/2, roll is 0.
pub fn to_rpy(r: &Matrix3<f64>) -> (f64, f64, f64) {
    let cp = (r.m11 * r.m11 + r.m21 * r.m21).sqrt();
    let pitch = libm::atan2(-r.m31, cp);
    if cp < 1e-9 {
        return (0.0, pitch, libm::atan2(-r.m12, r.m22));
    }
    (libm::atan2(r.m32, r.m33), pitch, libm::atan2(r.m21, r.m11))
}

/// Unit quaternion (x, y, z, w) of a rotation matrix, from the largest of its components (Shepperd).
pub fn quaternion(r: &Matrix3<f64>) -> Vector4<f64> {
    let t = r.trace();
    let q = if t >= r.m11 && t >= r.m22 && t >= r.m33 {
        Vector4::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12, 1.0 + t)
    } else if r.m11 >= r.m22 && r.m11 >= r.m33 {
        Vector4::new(1.0 + 2.0 * r.m11 - t, r.m12 + r.m21, r.m13 + r.m31, r.m32 - r.m23)
    } else if r.m22 >= r.m33 {
        Vector4::new(r.m12 + r.m21, 1.0 + 2.0 * r.m22 - t, r.m23 + r.m32, r.m13 - r.m31)
    } else {
        Vector4::new(r.m13 + r.m31, r.m23 + r.m32, 1.0 + 2.0 * r.m33 - t, r.m21 - r.m12)
    };
    q / q.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn axis() -> impl Strategy<Value = Vector3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_map(|(x, y, z)| Vector3::new(x, y, z))
            .prop_filter("not zero", |v| v.norm() > 0.1)
            .prop_map(|v| v / v.norm())
    }

    proptest! {
        #[test]
        fn log_undoes_exp_up_to_just_below_half_a_turn(n in axis(), small in 0.0..1.0f64) {
            for angle in [PI * small, PI - 1e-7 * small - 1e-9, 1e-9 * small, 1e-4 * small] {
                let v = n * angle;
                let r = exp(&v);
                prop_assert!((r.transpose() * r - Matrix3::identity()).amax() < 1e-14);
                prop_assert!((log(&r) - v).amax() < 1e-14 * (1.0 + 30.0 * angle), "{angle} {}", (log(&r) - v).amax());
            }
        }

        #[test]
        fn at_half_a_turn_log_gives_the_axis_with_either_sign(n in axis()) {
            let v = log(&exp(&(n * PI)));
            prop_assert!((v - n * PI).amax().min((v + n * PI).amax()) < 1e-13);
        }

        #[test]
        fn orientation_error_is_sine_times_axis_of_the_rotation_still_to_go(n in axis(), m in axis(), a in -3.0..3.0f64) {
            let r = exp(&m);
            let rd = exp(&(n * a)) * r;
            prop_assert!((orientation_error(&r, &rd) - n * libm::sin(a)).amax() < 1e-14);
        }

        #[test]
        fn roll_pitch_yaw_come_back(roll in -3.1..3.1f64, pitch in -1.5..1.5f64, yaw in -3.1..3.1f64) {
            let (r, p, y) = to_rpy(&from_rpy(roll, pitch, yaw));
            prop_assert!((r - roll).abs().max((p - pitch).abs()).max((y - yaw).abs()) < 1e-13);
        }
    }

    #[test]
    fn roll_pitch_yaw_turn_about_fixed_axes_in_that_order() {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        let product = exp(&(z * 0.3)) * exp(&(y * -0.7)) * exp(&(x * 1.1));
        assert!((from_rpy(1.1, -0.7, 0.3) - product).amax() < 1e-15);
    }

    #[test]
    fn looking_straight_up_or_down_roll_pitch_yaw_still_describe_the_rotation() {
        for pitch in [PI / 2.0, -PI / 2.0] {
            let r = from_rpy(0.4, pitch, -1.2);
            let (roll, p, yaw) = to_rpy(&r);
            assert!((from_rpy(roll, p, yaw) - r).amax() < 1e-9);
        }
    }
}
