//! The arm about one posture and its speeds: what changes slowly is held, what the joints do is not.
//!
//! For a simulation whose steps are far shorter than the arm takes to change. Mass matrix, bias and Jacobian are those of the
//! posture; the tip follows the joints along this Jacobian, so a force on the tip does the very work that the joints feel.

use crate::kinematics::Pose;
use crate::products::{combined, transposed_times};
use crate::state::ArmState;
use crate::{DOF, Jacobian, JointVector, Spatial};
use nalgebra::Vector3;

/// Joints, and one more to fill pairs.
const ROWS: usize = DOF + 1;

/// An arm whose configuration-dependent terms are held.
#[derive(Clone, Copy, Debug)]
pub struct FrozenArm {
    q: JointVector,
    pose: Pose,
    jacobian: Jacobian,
    jdot_qd: Spatial,
    /// C q̇ + g.
    bias: JointVector,
    /// Columns of the inverse of M + diag(armature).
    mobility: [[f64; ROWS]; DOF],
}

impl FrozenArm {
    /// The arm about `state`. `armature` (kg m²) is added to the mass matrix' diagonal.
    pub fn new(state: &ArmState, armature: &JointVector) -> FrozenArm {
        let (tip, (mass, bias)) = (state.tip_motion(), state.dynamics());
        let mut inertia = [[0.0; ROWS]; DOF];
        for (i, row) in inertia.iter_mut().enumerate() {
            row[..DOF].copy_from_slice(mass.column(i).as_slice());
            row[i] += armature[i];
        }
        FrozenArm {
            q: *state.q(),
            pose: tip.pose,
            jacobian: tip.jacobian,
            jdot_qd: tip.jdot_qd,
            bias,
            mobility: inverted(inertia),
        }
    }

    /// Pose of the tip at angles `q` (rad) nearby.
    #[inline]
    pub fn pose(&self, q: &JointVector) -> Pose {
        let [x, y, z, turn @ ..] = combined(&self.jacobian.data.0, &(q - self.q));
        let turn = Vector3::from(turn);
        let turned = |v: Vector3<f64>| {
            let change = turn.cross(&v);
            v + change + turn.cross(&change) * 0.5
        };
        let mut pose = self.pose;
        pose.p += Vector3::new(x, y, z);
        for mut axis in pose.r.column_iter_mut() {
            axis.copy_from(&turned(axis.clone_owned()));
        }
        pose
    }

    /// Twist of the tip at joint speeds `qd` (rad/s): J q̇ (m/s, rad/s; base axes).
    #[inline]
    pub fn twist(&self, qd: &JointVector) -> Spatial {
        combined(&self.jacobian.data.0, qd).into()
    }

    /// Acceleration of the tip under joint accelerations: J q̈ + J̇q̇ (m/s², rad/s²; base axes).
    #[inline]
    pub fn tip_acceleration(&self, qdd: &JointVector) -> Spatial {
        Spatial::from(combined(&self.jacobian.data.0, qdd)) + self.jdot_qd
    }

    /// q̈ of (M + diag(armature)) q̈ = τ + Jᵀ f_tip − C q̇ − g, for torques `tau` (Nm) and the wrench `f_tip` that acts ON the
    /// tip (N, Nm; base axes, at the tip).
    #[inline]
    pub fn accelerations(&self, tau: &JointVector, f_tip: &Spatial) -> JointVector {
        let left = tau - self.bias + transposed_times(&self.jacobian, f_tip);
        let [qdd @ .., _] = combined(&self.mobility, &left);
        qdd.into()
    }
}

/// Inverse of a symmetric positive definite matrix (Gauss–Jordan in place, which then needs no pivoting).
#[inline(always)]
fn inverted(mut rows: [[f64; ROWS]; DOF]) -> [[f64; ROWS]; DOF] {
    for k in 0..DOF {
        let inverse = 1.0 / rows[k][k];
        let mut pivot = rows[k].map(|entry| entry * inverse);
        pivot[k] = inverse;
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = row[k];
            if i == k {
                *row = pivot;
                continue;
            }
            row[k] = 0.0;
            for (entry, pivot) in row.iter_mut().zip(&pivot) {
                *entry -= pivot * factor;
            }
        }
    }
    rows
}
