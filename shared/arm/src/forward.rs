//! Forward dynamics by the mass matrix: for seven joints cheaper than articulated bodies, because the composite bodies
//! and the bias come from the same pass and seven equations are few.

use crate::bodies::bodies;
use crate::crba::mass_rows;
use crate::kinematics::{Motion, Screws};
use crate::lanes::{Lanes, PAIRS, Pair, lane, pairs_of};
use crate::model::ArmModel;
use crate::rnea::{along, carried};
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
    let bodies = bodies(model, screws);
    let carried = carried(model, motion, &bodies, f_tip);
    let mut rows = mass_rows(screws, &bodies);
    let (tau, armature) = (pairs_of(tau, 0.0), pairs_of(armature, 0.0));
    let left: [Pair; PAIRS] = std::array::from_fn(|k| tau[k] - along(&screws[k], &carried[k]));
    for i in 0..DOF {
        let own = Pair::pair(lane(&armature, i), 0.0);
        rows[i][i % PAIRS] += if i < PAIRS { own } else { Pair::pair(0.0, own.low()) };
        // the tip's lane holds the right-hand side
        rows[i][PAIRS - 1] = Pair::pair(rows[i][PAIRS - 1].low(), lane(&left, i));
    }
    solve(rows)
}

/// x of M x = b by elimination without pivoting (M = L D Lᵀ); `rows` are those of a positive definite M from the diagonal
/// on, with b in the tip's lane.
#[inline(always)]
fn solve(mut rows: [[Pair; PAIRS]; DOF]) -> JointVector {
    // one by one, so that the compiler knows every index
    eliminate(&mut rows, 0);
    eliminate(&mut rows, 1);
    eliminate(&mut rows, 2);
    eliminate(&mut rows, 3);
    eliminate(&mut rows, 4);
    eliminate(&mut rows, 5);
    eliminate(&mut rows, 6);
    let mut x = [0.0; DOF];
    substitute(&rows, &mut x, 6);
    substitute(&rows, &mut x, 5);
    substitute(&rows, &mut x, 4);
    substitute(&rows, &mut x, 3);
    substitute(&rows, &mut x, 2);
    substitute(&rows, &mut x, 1);
    substitute(&rows, &mut x, 0);
    x.into()
}

/// Divides row `k` by its pivot and takes unknown `k` out of the rows after it.
#[inline(always)]
fn eliminate(rows: &mut [[Pair; PAIRS]; DOF], k: usize) {
    let row = rows[k];
    let inverse = Pair::splat(1.0 / lane(&row, k));
    let divided = row.map(|entry| entry * inverse);
    for i in k + 1..DOF {
        let factor = Pair::splat(lane(&divided, i));
        for c in i.saturating_sub(PAIRS)..PAIRS {
            rows[i][c] -= row[c] * factor;
        }
    }
    rows[k] = divided;
}

/// Unknown `k` from those after it.
#[inline(always)]
fn substitute(rows: &[[Pair; PAIRS]; DOF], x: &mut [f64; DOF], k: usize) {
    let mut rest = lane(&rows[k], DOF);
    // the newest unknown last: only that one is waited for
    for i in (k + 1..DOF).rev() {
        rest -= lane(&rows[k], i) * x[i];
    }
    x[k] = rest;
}
