//! e⁻ˣ of two numbers at once, without branches: the decay of the Stribeck curve.
//!
//! Reduction to the nearest power of two in two parts (as fdlibm does), then Taylor's series.

use crate::lanes::Pair;
use bytemuck::cast;
use wide::u64x2;

/// e to minus this is nothing beside 1.
const LARGEST: f64 = 40.0;
/// 1.5 · 2⁵²: adding it rounds to an integer, which then stands in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 = `HIGH` (33 bits) + `LOW`.
const HIGH: f64 = 6.931_471_803_691_238e-1;
const LOW: f64 = 1.908_214_929_270_587_7e-10;

/// e⁻ˣ for `x` ≥ 0 with an error of a last bit of 1; e⁻⁴⁰ for larger ones.
#[inline(always)]
pub(crate) fn exp_minus(x: Pair) -> Pair {
    let constant = Pair::splat;
    // where `x` is no number this gives `x`
    let x = constant(LARGEST).fast_min(x);
    let shifted = constant(ROUND) - x * constant(std::f64::consts::LOG2_E);
    let n = shifted - constant(ROUND);
    let r = -(x + n * constant(HIGH)) - n * constant(LOW);

    const SERIES: [f64; 14] = {
        let mut a = [1.0; 14];
        let mut k = 1;
        while k < 14 {
            a[k] = a[k - 1] / k as f64;
            k += 1;
        }
        a
    };
    let sum = SERIES[..13].iter().rev().fold(constant(SERIES[13]), |sum, a| sum * r + constant(*a));
    // n into the exponent
    let bits: u64x2 = cast(shifted);
    let power: Pair = cast((bits + u64x2::splat(1023)) << 52);
    sum * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Lanes;

    #[test]
    fn the_exponential_is_libms_to_the_last_bit_of_1() {
        for k in 0..100_000 {
            let x = f64::from(k) * 4e-4;
            let pair = exp_minus(Pair::pair(x, 0.37 * x));
            for (got, x) in [(pair.low(), x), (pair.high(), 0.37 * x)] {
                let error = (got - libm::exp(-x)).abs();
                assert!(error <= f64::EPSILON, "{x}: {error:e}");
            }
        }
    }

    #[test]
    fn far_out_it_is_nothing_beside_1_and_what_is_no_number_stays_so() {
        let pair = exp_minus(Pair::pair(1e300, f64::NAN));
        assert!((0.0..1e-17).contains(&pair.low()) && pair.high().is_nan());
        assert!(exp_minus(Pair::pair(f64::INFINITY, 0.0)).low() < 1e-17);
    }
}
