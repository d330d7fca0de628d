//! Sine and cosine of two angles at once, to the last bit or two, without branches.
//!
//! The `libm` crate reduces angles of any size, one at a time; joint angles are small. Reduction to the nearest multiple
//! of π/2 in two parts (Cody and Waite) and the polynomials of fdlibm's `k_sin` and `k_cos`, in one form for both lanes.
//! Beyond a million radians, and for what is no number, `libm` answers.

use crate::lanes::{Lanes, Pair};
use bytemuck::cast;
use wide::u64x2;

/// Largest angle that is reduced here: the products with the first part stay exact.
const LARGEST: f64 = 1e6;

/// 1.5 · 2⁵²: adding it rounds to an integer, which then stands in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// π/2 = `HIGH` (33 bits) + `LOW`.
const HIGH: f64 = f64::from_bits(0x3FF9_21FB_5440_0000);
const LOW: f64 = 6.077_100_506_506_192_25e-11;

/// Sines and cosines of `x` (rad).
#[inline(always)]
pub(crate) fn sin_cos(x: Pair) -> (Pair, Pair) {
    let [a, b] = x.to_array();
    if a.abs() < LARGEST && b.abs() < LARGEST {
        return reduced(x);
    }
    let ((sa, ca), (sb, cb)) = (libm::sincos(a), libm::sincos(b));
    (Pair::pair(sa, sb), Pair::pair(ca, cb))
}

#[inline(always)]
fn reduced(x: Pair) -> (Pair, Pair) {
    let constant = Pair::splat;
    let shifted = x * constant(std::f64::consts::FRAC_2_PI) + constant(ROUND);
    let turns = shifted - constant(ROUND);
    let r = x - turns * constant(HIGH) - turns * constant(LOW);
    let z = r * r;

    let s = [
        1.589_690_995_211_55e-10,
        -2.505_076_025_340_686_3e-8,
        2.755_731_370_707_006_8e-6,
        -1.984_126_982_985_795e-4,
        8.333_333_333_322_49e-3,
        -1.666_666_666_666_663_2e-1,
    ];
    let c = [
        -1.135_964_755_778_819_5e-11,
        2.087_572_321_298_175e-9,
        -2.755_731_435_139_066_3e-7,
        2.480_158_728_947_673e-5,
        -1.388_888_888_887_411e-3,
        4.166_666_666_666_66e-2,
    ];
    let series = |a: [f64; 6]| a[1..].iter().fold(constant(a[0]), |sum, a| sum * z + constant(*a));
    let sin = r + r * z * series(s);
    // 1 − z/2 rounds; what it loses is added back
    let half = z * constant(0.5);
    let near = constant(1.0) - half;
    let cos = near + ((constant(1.0) - near - half) + z * z * series(c));

    // quarter turns: odd ones swap, the second bit of n and of n + 1 is the sign
    let n: u64x2 = cast(shifted);
    let odd: Pair = cast(u64x2::splat(0) - (n & u64x2::splat(1)));
    let sign = |n: u64x2| -> Pair { cast((n << 62) & u64x2::splat(1 << 63)) };
    let (swapped_sin, swapped_cos) = (odd.bitselect(cos, sin), odd.bitselect(sin, cos));
    (swapped_sin ^ sign(n), swapped_cos ^ sign(n + u64x2::splat(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_within_a_last_bit_or_two_of_libms() {
        let mut worst = 0.0_f64;
        let mut check = |x: f64, y: f64| {
            let (s, c) = sin_cos(Pair::pair(x, y));
            for (x, s, c) in [(x, s.low(), c.low()), (y, s.high(), c.high())] {
                let (sin, cos) = libm::sincos(x);
                worst = worst.max((s - sin).abs()).max((c - cos).abs());
            }
        };
        for k in -40_000..40_000 {
            let x = f64::from(k) * 1.234_567e-3;
            check(x, 17.0 * x);
            check(f64::from(k) * std::f64::consts::FRAC_PI_4, f64::from(k) * 24.9);
        }
        assert!(worst <= 2.3e-16, "{worst:e}");
    }

    #[test]
    fn angles_too_large_or_no_numbers_are_left_to_libm() {
        let (s, c) = sin_cos(Pair::pair(1e9, f64::NAN));
        assert_eq!((s.low(), c.low()), libm::sincos(1e9));
        assert!(s.high().is_nan() && c.high().is_nan());
        let (s, c) = sin_cos(Pair::pair(f64::INFINITY, 0.0));
        assert!(s.low().is_nan() && c.low().is_nan());
        assert_eq!((s.high(), c.high()), (0.0, 1.0));
    }
}
