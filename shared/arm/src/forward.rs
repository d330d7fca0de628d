//! Forward dynamics by the mass matrix: for seven joints cheaper than articulated bodies, because the composite bodies
//! and the bias come from the same pass and seven equations are few.

use crate::bodies::Bodies;
use crate::crba::mass_rows;
use crate::kinematics::{Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair, joints_of, lane};
use crate::model::ArmModel;
use crate::rnea::joint_torques;
use crate::{DOF, JointVector, Spatial};

/// q̈ of (M + diag(armature)) q̈ = τ + Jᵀ f_tip − C q̇ − g.
#[inline(always)]
pub(crate) fn accelerations(
    model: &ArmModel,
    screws: &Screws,
    motion: &Motion,
    tau: &JointVector,
    armature: &JointVector,
    f_tip: &Spatial,
) -> JointVector {
    let bodies = Bodies::new(model, screws);
    let taken = joint_torques(model, screws, motion, &bodies, f_tip);
    let mut rows = mass_rows(screws, bodies);
    let left = tau - joints_of(&taken);
    for i in 0..DOF {
        let mut own = rows[i][i % PAIRS].to_array();
        own[i / PAIRS] += armature[i];
        rows[i][i % PAIRS] = Pair::new(own);
        // the tip's lane holds the right-hand side
        let last = rows[i][PAIRS - 1].low();
        rows[i][PAIRS - 1] = Pair::pair(last, left[i]);
    }
    solve(rows)
}

/// x of M x = b by elimination without pivoting (M = L D Lᵀ); `rows` are those of a positive definite M from the diagonal
/// on, with b in the tip's lane.
#[inline(always)]
fn solve(mut rows: [[Pair; PAIRS]; DOF]) -> JointVector {
    let (mut inverse, mut x) = ([0.0; DOF], JointVector::zeros());
    // one by one, so that the compiler knows every index
    eliminate(&mut rows, &mut inverse, 0);
    eliminate(&mut rows, &mut inverse, 1);
    eliminate(&mut rows, &mut inverse, 2);
    eliminate(&mut rows, &mut inverse, 3);
    eliminate(&mut rows, &mut inverse, 4);
    eliminate(&mut rows, &mut inverse, 5);
    eliminate(&mut rows, &mut inverse, 6);
    substitute(&rows, &inverse, &mut x, 6);
    substitute(&rows, &inverse, &mut x, 5);
    substitute(&rows, &inverse, &mut x, 4);
    substitute(&rows, &inverse, &mut x, 3);
    substitute(&rows, &inverse, &mut x, 2);
    substitute(&rows, &inverse, &mut x, 1);
    substitute(&rows, &inverse, &mut x, 0);
    x
}

/// Takes unknown `k` out of the rows after its own.
#[inline(always)]
fn eliminate(rows: &mut [[Pair; PAIRS]; DOF], inverse: &mut [f64; DOF], k: usize) {
    inverse[k] = 1.0 / lane(&rows[k], k);
    for i in k + 1..DOF {
        let factor = Pair::splat(lane(&rows[k], i) * inverse[k]);
        for c in i.saturating_sub(PAIRS)..PAIRS {
            rows[i][c] -= rows[k][c] * factor;
        }
    }
}

/// Unknown `k` from those after it.
#[inline(always)]
fn substitute(rows: &[[Pair; PAIRS]; DOF], inverse: &[f64; DOF], x: &mut JointVector, k: usize) {
    let mut rest = lane(&rows[k], DOF);
    // the newest unknown last: only that one is waited for
    for i in (k + 1..DOF).rev() {
        rest -= lane(&rows[k], i) * x[i];
    }
    x[k] = rest * inverse[k];
}
