//! From a pose of the tool to a posture of the arm: damped Newton from a posture nearby.

use arm::{ArmModel, DOF, Jacobian, JointVector, Pose, Spatial, rotation, tip_motion};
use nalgebra::SMatrix;
use thiserror::Error;

/// A pose that the arm does not reach from the posture given.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("the arm does not reach ({:.3}, {:.3}, {:.3}) m in its base frame from the posture given: {position_error_m:.4} m and {orientation_error_rad:.4} rad remain{}", .target[0], .target[1], .target[2], match .beyond_limit { Some(joint) => format!(", joint {} is at its limit", joint + 1), None => String::new() })]
pub struct PostureError {
    /// Position asked for, base frame.
    pub target: [f64; 3],
    /// Distance left.
    pub position_error_m: f64,
    /// Rotation left.
    pub orientation_error_rad: f64,
    /// Joint (from 0) at its limit.
    pub beyond_limit: Option<usize>,
}

const ITERATIONS: usize = 200;
const TOLERANCE: f64 = 1e-12;
const DAMPING: f64 = 1e-6;

/// The posture near `seed` whose tool pose (base frame) is `target`, within the joint limits.
pub fn inverse_kinematics(arm: &ArmModel, target: &Pose, seed: &JointVector) -> Result<JointVector, PostureError> {
    let mut q = *seed;
    let mut error = Spatial::zeros();
    for iteration in 0..ITERATIONS {
        let tip = tip_motion(arm, &q, &JointVector::zeros());
        error.fixed_rows_mut::<3>(0).copy_from(&(target.p - tip.pose.p));
        error.fixed_rows_mut::<3>(3).copy_from(&rotation::log(&(target.r * tip.pose.r.transpose())));
        if error.amax() < TOLERANCE {
            break;
        }
        let Some(step) = newton_step(arm, &q, tip.jacobian, &error, iteration < ITERATIONS / 2) else { break };
        // a large step leaves the linear range
        q += step * (0.3 / step.amax().max(0.3));
        for i in 0..DOF {
            q[i] = q[i].clamp(arm.lower_limits()[i], arm.upper_limits()[i]);
        }
    }
    let (position_error_m, orientation_error_rad) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
    // NaN is no solution either
    if position_error_m < 1e-9 && orientation_error_rad < 1e-9 {
        return Ok(q);
    }
    let beyond_limit = (0..DOF).find(|&i| q[i] <= arm.lower_limits()[i] || q[i] >= arm.upper_limits()[i]);
    Err(PostureError { target: target.p.into(), position_error_m, orientation_error_rad, beyond_limit })
}

/// Distance from a joint limit inside which self-motion turns the joint away from it, rad.
const BUFFER: f64 = 0.15;

/// Least-squares step towards the pose; in the null space, if `avoid`, away from the joint limits (close to a limit that
/// would go on for ever, so the last steps go without). Joints that it would push
/// beyond their limit stay out of it.
fn newton_step(arm: &ArmModel, q: &JointVector, mut j: Jacobian, error: &Spatial, avoid: bool) -> Option<JointVector> {
    let (lower, upper) = (arm.lower_limits(), arm.upper_limits());
    for _ in 0..DOF {
        let normal: SMatrix<f64, 6, 6> = j * j.transpose() + SMatrix::identity() * DAMPING;
        let solver = normal.cholesky()?;
        let away = JointVector::from_fn(|i, _| {
            if avoid { (lower[i] + BUFFER - q[i]).max(0.0) - (q[i] - upper[i] + BUFFER).max(0.0) } else { 0.0 }
        });
        let step: JointVector = away + j.transpose() * solver.solve(&(error - j * away));
        let outward = |i: usize| (q[i] <= lower[i] && step[i] < 0.0) || (q[i] >= upper[i] && step[i] > 0.0);
        match (0..DOF).find(|&i| j.column(i).amax() > 0.0 && outward(i)) {
            Some(held) => j.column_mut(held).fill(0.0),
            None => return Some(step),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::forward_kinematics;

    #[test]
    fn the_posture_found_has_the_pose_asked_for() {
        let arm = ArmModel::rediestro();
        let seed = JointVector::from([69.2, -15.3, -72.0, -132.4, 159.8, 64.7, 104.0]).map(f64::to_radians);
        let mut target = forward_kinematics(&arm, &seed);
        target.p.x -= 0.03;
        target.p.z += 0.02;
        let q = inverse_kinematics(&arm, &target, &seed).expect("reachable");
        assert!((forward_kinematics(&arm, &q).p - target.p).norm() < 1e-9);
    }

    #[test]
    fn a_pose_out_of_reach_is_refused_with_the_distance_left() {
        let arm = ArmModel::rediestro();
        let mut target = forward_kinematics(&arm, &JointVector::zeros());
        target.p.x = 5.0;
        let error = inverse_kinematics(&arm, &target, &JointVector::zeros()).expect_err("out of reach");
        assert!(error.position_error_m > 2.0, "{error}");
    }
}
