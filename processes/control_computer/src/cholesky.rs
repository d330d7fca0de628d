//! Solves the symmetric 7×7 systems of redundancy resolution by Cholesky's factorisation, written out for that size.
//!
//! A direction that nothing weighs (a pivot of the order of rounding) is left at zero instead of being blown up: with
//! W_v = 0 the arm's self-motion is such a direction, and a joint that moves nothing is another.

use arm::{DOF, JointVector};

/// Pivots below this part of the largest diagonal entry count as zero.
const SINGULAR: f64 = 1e-13;

/// A = L Lᵀ, with the reciprocals of the pivots on the diagonal.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky {
    l: [[f64; DOF]; DOF],
}

impl Cholesky {
    /// Factorises the symmetric positive semidefinite matrix whose lower triangle is `a[row][column]`.
    pub fn new(mut a: [[f64; DOF]; DOF]) -> Cholesky {
        let mut largest = 0.0f64;
        for (i, row) in a.iter().enumerate() {
            largest = largest.max(row[i]);
        }
        for j in 0..DOF {
            let row = a[j];
            let pivot = row[..j].iter().fold(row[j], |sum, entry| sum - entry * entry);
            let inv = if pivot > SINGULAR * largest { 1.0 / pivot.sqrt() } else { 0.0 };
            a[j][j] = inv;
            for below in &mut a[j + 1..] {
                let mut sum = below[j];
                for k in 0..j {
                    sum -= below[k] * row[k];
                }
                below[j] = sum * inv;
            }
        }
        Cholesky { l: a }
    }

    /// x of A x = b.
    pub fn solve(&self, b: &JointVector) -> JointVector {
        let l = &self.l;
        let mut x = b.data.0[0];
        for i in 0..DOF {
            for k in 0..i {
                x[i] -= l[i][k] * x[k];
            }
            x[i] *= l[i][i];
        }
        for i in (0..DOF).rev() {
            x[i] *= l[i][i];
            for k in 0..i {
                x[k] -= l[i][k] * x[i];
            }
        }
        JointVector::from(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_with_a_known_vector_gives_the_vector_back() {
        // A = B Bᵀ + 1 with B of small integers
        let b = |i: usize, j: usize| ((i * 5 + j * 3) % 7) as f64 - 3.0;
        let mut a = [[0.0; DOF]; DOF];
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
        let mut a = [[0.0; DOF]; DOF];
        a[0][0] = 4.0;
        let x = Cholesky::new(a).solve(&JointVector::from([2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 5.0]));
        assert_eq!(x, JointVector::from([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
}
