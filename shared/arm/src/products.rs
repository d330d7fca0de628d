//! Products with a Jacobian and with other columns, a joint each. The order of the additions is such that the processor can
//! do several at the same time.

use crate::{DOF, Jacobian, JointVector, Spatial};

/// Jᵀ F.
#[inline]
pub fn transposed_times(jacobian: &Jacobian, f: &Spatial) -> JointVector {
    let f = f.data.0[0];
    JointVector::from(jacobian.data.0.map(|column| dot(&column, &f)))
}

/// Scalar product.
#[inline(always)]
pub fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

/// Sum of the columns times these factors.
#[inline(always)]
pub(crate) fn combined<const N: usize>(columns: &[[f64; N]; DOF], factors: &JointVector) -> [f64; N] {
    let mut sum = [0.0; N];
    for (column, factor) in columns.iter().zip(factors.iter()) {
        for (sum, entry) in sum.iter_mut().zip(column) {
            *sum += entry * factor;
        }
    }
    sum
}
