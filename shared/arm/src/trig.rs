//! Sine and cosine of the joint angles, all at once.
//!
//! The same bits on every machine (no system library), and without branches, so that the compiler works on several
//! joints side by side. Reduction by a three-part π/2 and the minimax polynomials of FreeBSD's msun (as in the `libm`
//! crate); error below 1 ulp for |q| ≤ 10⁶ rad. Larger or non-finite angles go to the `libm` crate.

use crate::{DOF, JointVector};

/// Sines and cosines of the joint angles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SinCos {
    pub sin: [f64; DOF],
    pub cos: [f64; DOF],
}

// π/2 = P1 + P2 + P3; P1 and P2 have 33 significant bits, so that n P1 and n P2 are exact for |n| < 2²⁰
const P1: f64 = f64::from_bits(0x3FF9_21FB_5440_0000);
const P2: f64 = f64::from_bits(0x3DD0_B461_1A60_0000);
const P3: f64 = f64::from_bits(0x3BA3_198A_2E03_7073);
// adding and subtracting 1.5·2⁵² rounds to the nearest integer
const ROUND: f64 = 6_755_399_441_055_744.0;

const S: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const C: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

pub(crate) fn sin_cos(q: &JointVector) -> SinCos {
    let mut out = SinCos {
        sin: [0.0; DOF],
        cos: [0.0; DOF],
    };
    for i in 0..DOF {
        let x = q[i];
        let shifted = x * std::f64::consts::FRAC_2_PI + ROUND;
        let n = shifted - ROUND;
        // remainder y0 + y1, |y0| ≤ π/4
        let t = x - n * P1;
        let w = n * P2;
        let r = t - w;
        let w = n * P3 - ((t - r) - w);
        let y0 = r - w;
        let y1 = (r - y0) - w;

        let z = y0 * y0;
        let zz = z * z;
        let v = z * y0;
        let poly = S[1] + z * (S[2] + z * S[3]) + z * zz * (S[4] + z * S[5]);
        let s = y0 - ((z * (0.5 * y1 - v * poly) - y1) - v * S[0]);

        let poly = z * (C[0] + z * (C[1] + z * C[2])) + zz * zz * (C[3] + z * (C[4] + z * C[5]));
        let half = 0.5 * z;
        let head = 1.0 - half;
        let c = head + (((1.0 - head) - half) + (z * poly - y0 * y1));

        // the low bits of `shifted` hold n modulo 4
        let quadrant = shifted.to_bits();
        let swap = (quadrant & 1).wrapping_neg();
        let (sb, cb) = (s.to_bits(), c.to_bits());
        let sin = (sb & !swap) | (cb & swap);
        let cos = (cb & !swap) | (sb & swap);
        out.sin[i] = f64::from_bits(sin ^ ((quadrant & 2) << 62));
        out.cos[i] = f64::from_bits(cos ^ ((quadrant.wrapping_add(1) & 2) << 62));
    }
    if !q.iter().all(|x| x.abs() <= 1e6) {
        for i in 0..DOF {
            (out.sin[i], out.cos[i]) = libm::sincos(q[i]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ulps(a: f64, b: f64) -> f64 {
        (a - b).abs() / (f64::EPSILON * b.abs().max(f64::MIN_POSITIVE))
    }

    #[test]
    fn sines_and_cosines_are_within_one_ulp_of_the_libm_crate() {
        let mut x = 1e-9;
        while x < 9e5 {
            for x in [x, -x] {
                let sc = sin_cos(&JointVector::repeat(x));
                assert!(
                    ulps(sc.sin[3], libm::sin(x)) <= 1.0,
                    "sin {x}: {} {}",
                    sc.sin[3],
                    libm::sin(x)
                );
                assert!(
                    ulps(sc.cos[3], libm::cos(x)) <= 1.0,
                    "cos {x}: {} {}",
                    sc.cos[3],
                    libm::cos(x)
                );
            }
            x *= 1.000_7;
        }
    }

    #[test]
    fn angles_near_multiples_of_a_right_angle_keep_their_relative_accuracy() {
        for k in -40..=40 {
            let x = f64::from(k) * std::f64::consts::FRAC_PI_2;
            let sc = sin_cos(&JointVector::repeat(x));
            assert!(
                ulps(sc.sin[0], libm::sin(x)) <= 1.0 && ulps(sc.cos[0], libm::cos(x)) <= 1.0,
                "{k}"
            );
        }
    }

    #[test]
    fn huge_and_non_finite_angles_do_what_the_libm_crate_does() {
        let q = JointVector::from([1e9, -3e12, 0.5, f64::NAN, f64::INFINITY, 1e300, -0.0]);
        let sc = sin_cos(&q);
        assert_eq!(sc.sin[0], libm::sin(1e9));
        assert_eq!(sc.cos[5], libm::cos(1e300));
        assert!(sc.sin[3].is_nan() && sc.cos[4].is_nan());
    }
}
