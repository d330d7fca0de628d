//! Two joints at a time: joint k (from 0) and joint k + 4 share a pair of lanes; the eighth lane is the tip's.
//!
//! A pair is two numbers in one machine register, so that what is the same for every joint costs half. The compiler's
//! target decides how a pair is computed, never the machine it runs on: the bits are those of plain arithmetic.

use crate::bodies::{Body, Wrench};
use crate::exponential::exp_minus;
use crate::sincos::sin_cos;
use crate::small::{M3, Real, Sym3, V3};
use crate::{DOF, JointVector};

/// Two numbers.
pub type Pair = wide::f64x2;

/// Pairs that hold seven joints and the tip.
pub(crate) const PAIRS: usize = 4;

impl Real for Pair {
    #[inline(always)]
    fn of(x: f64) -> Pair {
        Pair::splat(x)
    }
    #[inline(always)]
    fn abs(self) -> Pair {
        Pair::abs(self)
    }
    #[inline(always)]
    fn within(self, limit: Pair) -> Pair {
        // where a number is missing these give the second
        (-limit).fast_max(limit.fast_min(self))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Pair, Pair) {
        sin_cos(self)
    }
    #[inline(always)]
    fn exp_minus(self) -> Pair {
        exp_minus(self)
    }
}

/// By way of a pair: the same bits.
impl Real for f64 {
    fn of(x: f64) -> f64 {
        x
    }
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    fn within(self, limit: f64) -> f64 {
        Pair::of(self).within(Pair::of(limit)).low()
    }
    fn sin_cos(self) -> (f64, f64) {
        let (sin, cos) = sin_cos(Pair::of(self));
        (sin.low(), cos.low())
    }
    fn exp_minus(self) -> f64 {
        exp_minus(Pair::of(self)).low()
    }
}

/// One number per joint; `tip` in the lane of the tip.
#[inline(always)]
pub(crate) fn pairs_of(joints: &JointVector, tip: f64) -> [Pair; PAIRS] {
    std::array::from_fn(|k| Pair::new([joints[k], if k + PAIRS < DOF { joints[k + PAIRS] } else { tip }]))
}

/// The joints' numbers.
#[inline(always)]
pub(crate) fn joints_of(pairs: &[Pair; PAIRS]) -> JointVector {
    JointVector::from_fn(|i, _| pairs[i % PAIRS].to_array()[i / PAIRS])
}

/// A quantity made of pairs.
pub(crate) trait Lanes: Copy {
    /// The same quantity of one joint.
    type One;
    fn pair(low: Self::One, high: Self::One) -> Self;
    fn low(self) -> Self::One;
    fn high(self) -> Self::One;
    fn plus(self, b: Self) -> Self;
}

impl Lanes for Pair {
    type One = f64;
    #[inline(always)]
    fn pair(low: f64, high: f64) -> Pair {
        Pair::new([low, high])
    }
    #[inline(always)]
    fn low(self) -> f64 {
        self.to_array()[0]
    }
    #[inline(always)]
    fn high(self) -> f64 {
        self.to_array()[1]
    }
    #[inline(always)]
    fn plus(self, b: Pair) -> Pair {
        self + b
    }
}

/// Componentwise.
macro_rules! lanes_of_components {
    ($name:ident { $($part:ident: $of:ident),* }) => {
        impl Lanes for $name<Pair> {
            type One = $name;
            #[inline(always)]
            fn pair(low: $name, high: $name) -> Self {
                $name { $($part: Lanes::pair(low.$part, high.$part)),* }
            }
            #[inline(always)]
            fn low(self) -> $name {
                $name { $($part: self.$part.low()),* }
            }
            #[inline(always)]
            fn high(self) -> $name {
                $name { $($part: self.$part.high()),* }
            }
            #[inline(always)]
            fn plus(self, b: Self) -> Self {
                $name { $($part: self.$part.plus(b.$part)),* }
            }
        }
    };
}

lanes_of_components!(V3 { x: f64, y: f64, z: f64 });
lanes_of_components!(M3 { x: V3, y: V3, z: V3 });
lanes_of_components!(Body { first: V3, second: Sym3 });
lanes_of_components!(Wrench { f: V3, n: V3 });
lanes_of_components!(Sym3 { xx: f64, xy: f64, xz: f64, yy: f64, yz: f64, zz: f64 });

/// A 3-vector whose first two components share a register: for recursions from joint to joint.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Column {
    xy: Pair,
    z: f64,
}

impl Column {
    /// Components along one column of two vectors each: `self · a + b · c`.
    #[inline(always)]
    pub fn combined(self, a: f64, b: Column, c: f64) -> Column {
        Column { xy: self.xy * Pair::splat(a) + b.xy * Pair::splat(c), z: self.z * a + b.z * c }
    }

    /// `self + m v` for a matrix of columns `m`.
    #[inline(always)]
    pub fn displaced(self, m: &[Column; 3], v: V3) -> Column {
        let [x, y, z] = m;
        let pair = |c: &Column, v: f64| c.xy * Pair::splat(v);
        Column {
            xy: self.xy + (pair(x, v.x) + pair(y, v.y) + pair(z, v.z)),
            z: self.z + (x.z * v.x + y.z * v.y + z.z * v.z),
        }
    }

    /// Two vectors in the lanes of pairs.
    #[inline(always)]
    pub fn pair(low: Column, high: Column) -> V3<Pair> {
        let ([lx, ly], [hx, hy]) = (low.xy.to_array(), high.xy.to_array());
        V3 { x: Pair::new([lx, hx]), y: Pair::new([ly, hy]), z: Pair::new([low.z, high.z]) }
    }
}

impl From<V3> for Column {
    fn from(v: V3) -> Column {
        Column { xy: Pair::new([v.x, v.y]), z: v.z }
    }
}

impl From<Column> for V3 {
    #[inline(always)]
    fn from(c: Column) -> V3 {
        let [x, y] = c.xy.to_array();
        V3 { x, y, z: c.z }
    }
}

/// Pairs of eight single quantities, joint 1 first.
#[inline(always)]
pub(crate) fn paired<T: Lanes>(ones: &[T::One; 2 * PAIRS]) -> [T; PAIRS]
where
    T::One: Copy,
{
    std::array::from_fn(|k| T::pair(ones[k], ones[k + PAIRS]))
}

/// Quantity of lane `i`: 0 to 6 the joints, 7 the tip.
#[inline(always)]
pub(crate) fn lane<T: Lanes>(pairs: &[T; PAIRS], i: usize) -> T::One {
    if i < PAIRS { pairs[i].low() } else { pairs[i - PAIRS].high() }
}

/// Every joint's sum from joint 1 up to and with its own; the tip's is all.
#[inline(always)]
pub(crate) fn from_base<T: Lanes>(&[a, b, c, d]: &[T; PAIRS]) -> [T; PAIRS]
where
    T::One: Default,
{
    let b = a.plus(b);
    let c = b.plus(c);
    let d = c.plus(d);
    let carry = T::pair(T::One::default(), d.low());
    [a.plus(carry), b.plus(carry), c.plus(carry), d.plus(carry)]
}

/// Sum over all lanes.
#[inline(always)]
pub(crate) fn total(x: &[V3<Pair>; PAIRS]) -> V3 {
    let sum = (x[0] + x[1]) + (x[2] + x[3]);
    sum.low() + sum.high()
}

/// Every joint's sum from the tip down to and with its own.
#[inline(always)]
pub(crate) fn from_tip<T: Lanes>(&[a, b, c, d]: &[T; PAIRS]) -> [T; PAIRS]
where
    T::One: Default,
{
    let c = d.plus(c);
    let b = c.plus(b);
    let a = b.plus(a);
    let carry = T::pair(a.high(), T::One::default());
    [a.plus(carry), b.plus(carry), c.plus(carry), d.plus(carry)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_run_over_the_joints_in_order() {
        let ones: [f64; 8] = std::array::from_fn(|i| (1 << i) as f64);
        let pairs: [Pair; PAIRS] = paired(&ones);
        let (up, down) = (from_base(&pairs), from_tip(&pairs));
        for i in 0..8 {
            assert_eq!(lane(&pairs, i), ones[i]);
            assert_eq!(lane(&up, i), ones[..=i].iter().sum::<f64>());
            assert_eq!(lane(&down, i), ones[i..].iter().sum::<f64>());
        }
        let zero = Pair::default();
        assert_eq!(total(&pairs.map(|pair| V3 { x: pair, y: zero, z: pair })), V3 { x: 255.0, y: 0.0, z: 255.0 });
        let joints = JointVector::from_fn(|i, _| ones[i]);
        assert_eq!(pairs_of(&joints, 128.0), pairs);
        assert_eq!(joints_of(&pairs), joints);
    }
}
