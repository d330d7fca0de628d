//! Solves the symmetric 7×7 systems of redundancy resolution by Cholesky's factorisation without roots, A = L D Lᵀ.
//!
//! A direction that nothing weighs (a pivot of the order of rounding) is left at zero instead of being blown up: with
//! W_v = 0 the arm's self-motion is such a direction, and a joint that moves nothing is another.

use arm::{DOF, JointVector};

/// Pivots below this part of the largest diagonal entry count as zero.
const SINGULAR: f64 = 1e-13;

/// A joint's row, filled up to pairs.
pub type Row = [f64; DOF + 1];

/// Factors of A.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky {
    /// Columns of L; what stands above its diagonal means nothing.
    l: [Row; DOF],
    /// Reciprocals of D.
    inverse: [f64; DOF],
}

impl Cholesky {
    /// Factorises the symmetric positive semidefinite matrix whose upper triangle is `a[row][column]`; what stands before the
    /// diagonal, and in the last column, means nothing.
    pub fn new(mut a: [Row; DOF]) -> Cholesky {
        let mut largest = 0.0f64;
        for (i, row) in a.iter().enumerate() {
            largest = largest.max(row[i]);
        }
        let least = SINGULAR * largest;
        // one by one, so that the compiler knows every index
        let inverse = [
            eliminate::<0>(&mut a, least),
            eliminate::<1>(&mut a, least),
            eliminate::<2>(&mut a, least),
            eliminate::<3>(&mut a, least),
            eliminate::<4>(&mut a, least),
            eliminate::<5>(&mut a, least),
            eliminate::<6>(&mut a, least),
        ];
        Cholesky { l: a, inverse }
    }

    /// x of A x = b.
    pub fn solve(&self, b: &JointVector) -> JointVector {
        let mut x = b.data.0[0];
        for (k, l) in self.l.iter().enumerate() {
            for i in k + 1..DOF {
                x[i] -= l[i] * x[k];
            }
        }
        for k in (0..DOF).rev() {
            x[k] *= self.inverse[k];
            // the newest unknown last: only that one is waited for
            for i in (k + 1..DOF).rev() {
                x[k] -= self.l[k][i] * x[i];
            }
        }
        JointVector::from(x)
    }
}

/// Divides row `K` by its pivot, unless that is not above `least`, and takes unknown `K` out of the rows after it. Gives the
/// pivot's reciprocal.
#[inline(always)]
fn eliminate<const K: usize>(a: &mut [Row; DOF], least: f64) -> f64 {
    let row = a[K];
    let inverse = if row[K] > least { 1.0 / row[K] } else { 0.0 };
    let divided = row.map(|entry| entry * inverse);
    a[K] = divided;
    for i in K + 1..DOF {
        for c in i & !1..row.len() {
            a[i][c] -= divided[i] * row[c];
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_with_a_known_vector_gives_the_vector_back() {
        // A = B Bᵀ + 1 with B of small integers
        let b = |i: usize, j: usize| ((i * 5 + j * 3) % 7) as f64 - 3.0;
        let mut a = [Row::default(); DOF];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = (0..DOF).map(|k| b(i, k) * b(j, k)).sum::<f64>() + f64::from(u8::from(i == j));
            }
        }
        let x = JointVector::from([1.0, -2.0, 3.0, 0.5, 0.0, -1.0, 2.0]);
        let rhs = JointVector::from_fn(|i, _| (0..DOF).map(|j| a[i][j] * x[j]).sum());
        assert!((Cholesky::new(a).solve(&rhs) - x).amax() < 1e-11);
    }

    #[test]
    fn what_nothing_weighs_stays_at_zero() {
        let mut a = [Row::default(); DOF];
        a[0][0] = 4.0;
        let x = Cholesky::new(a).solve(&JointVector::from([2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 5.0]));
        assert_eq!(x, JointVector::from([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
}
