//! Disturbance observer: the joint torques that the model, the measured motion and the measured force do not account for.
//!
//! τ − [M(q) q̈ + h(q, q̇) + Jᵀ F_e], with q̈ from the joint speeds of two jobs and τ what the first of them sent, filtered
//! over [`FILTER_S`]. Friction is part of it, and so are a force sensor that lies, a converter that drifts, a joint that
//! hits something. A sensor's bias b leaves −Jᵀ b: the force that explains the torques best is what the sensor shows too
//! much.

use crate::frame::TaskKinematics;
use crate::inverse_dynamics::{Drives, contact_torque, motion_torque};
use arm::{ArmState, DOF, JointVector, Spatial};
use nalgebra::{Matrix3, Vector3};

/// Time constant of the filter, s.
const FILTER_S: f64 = 0.02;

/// What is kept from job to job.
#[derive(Clone, Debug)]
pub struct Disturbance {
    /// Joint speeds of the job before and the torques that it sent; none where no torque was on.
    before: Option<(JointVector, JointVector)>,
    /// Filtered estimate, Nm.
    estimate: JointVector,
    /// The force at the tool point that the sensor shows too much, if all of the estimate is the sensor's, C axes, N.
    force: Vector3<f64>,
}

impl Disturbance {
    /// Nothing known.
    pub fn new() -> Disturbance {
        Disturbance { before: None, estimate: JointVector::zeros(), force: Vector3::zeros() }
    }

    /// The torques of the job before acted for `dt` seconds and led to the motion `arm` with joint speeds `qd`, under the
    /// measured wrench `fe` (N, Nm).
    pub fn observe(
        &mut self,
        drives: &Drives,
        arm: &ArmState,
        tool: &TaskKinematics,
        qd: &JointVector,
        fe: &Spatial,
        dt: f64,
    ) {
        let Some((speed, torque)) = self.before else {
            (self.estimate, self.force) = (JointVector::zeros(), Vector3::zeros());
            return;
        };
        let acceleration = (qd - speed) / dt;
        let unaccounted = torque - motion_torque(arm, drives, &acceleration) - contact_torque(tool, fe);
        self.estimate += (unaccounted - self.estimate) * (dt / (dt + FILTER_S));
        self.force = self.explaining_force(drives, tool);
    }

    /// f of least squares in −J_vᵀ f = estimate, each joint by its torque limit; none where the arm cannot feel every axis.
    fn explaining_force(&self, drives: &Drives, tool: &TaskKinematics) -> Vector3<f64> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for joint in 0..DOF {
            let lever = tool.jacobian.fixed_view::<3, 1>(0, joint) / drives.torque_limit[joint];
            normal += lever * lever.transpose();
            right -= lever * (self.estimate[joint] / drives.torque_limit[joint]);
        }
        normal.cholesky().map_or(Vector3::zeros(), |normal| normal.solve(&right))
    }

    /// Size of the force that the sensor shows too much, N.
    pub fn force_n(&self) -> f64 {
        self.force.norm()
    }

    /// This job sends these torques at these joint speeds; none: the drives are off, or their brakes not yet released.
    pub fn sent(&mut self, qd: &JointVector, torque: Option<JointVector>) {
        self.before = torque.map(|torque| (*qd, torque));
    }

    /// The joint whose torque is the greatest share of its drive's limit, and that share.
    pub fn greatest(&self, drives: &Drives) -> (usize, f64) {
        let share = self.estimate.component_div(&drives.torque_limit).abs();
        let joint = share.imax();
        (joint, share[joint])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::drives::DriveData;
    use arm::{ArmModel, aba};

    #[test]
    fn a_sound_arm_shows_nothing_and_a_torque_that_does_not_arrive_shows_whole() {
        let model = ArmModel::rediestro();
        let drives = Drives::new(&DriveData::rediestro(), 0.0);
        let fe = Spatial::new(2.0, -4.0, 30.0, 0.3, 0.1, -0.2);
        let q = JointVector::from([0.3, -0.4, 0.9, -1.2, 0.5, 0.7, -0.2]);
        let qd = JointVector::repeat(0.1);
        let sent = JointVector::from([5.0, -60.0, -10.0, 70.0, 15.0, -5.0, 0.2]);
        let dt = 1e-3;
        for (lost, joint) in [(0.0, 0), (25.0, 3)] {
            let mut acting = sent;
            acting[joint] -= lost;
            let qdd = aba(&model, &q, &qd, &acting, &drives.rotor_inertia, &-fe);
            let arm = ArmState::new(&model, &q, &qd);
            let tool = arm.tip_motion();
            let mut disturbance = Disturbance::new();
            for _ in 0..400 {
                disturbance.sent(&(qd - qdd * dt), Some(sent));
                disturbance.observe(&drives, &arm, &tool, &qd, &fe, dt);
            }
            let (found, share) = disturbance.greatest(&drives);
            assert!((share - lost / drives.torque_limit[joint]).abs() < 1e-6, "{share}");
            assert!(lost == 0.0 || found == joint);
        }
    }

    #[test]
    fn what_a_sensor_shows_too_much_comes_out_as_that_force() {
        let model = ArmModel::rediestro();
        let drives = Drives::new(&DriveData::rediestro(), 0.0);
        let (fe, bias) = (Spatial::new(2.0, -4.0, 30.0, 0.3, 0.1, -0.2), Vector3::new(-20.0, 9.0, 60.0));
        let q = JointVector::from([0.3, -0.4, 0.9, -1.2, 0.5, 0.7, -0.2]);
        let (qd, dt) = (JointVector::repeat(0.1), 1e-3);
        let arm = ArmState::new(&model, &q, &qd);
        let tool = arm.tip_motion();
        let sent = motion_torque(&arm, &drives, &JointVector::zeros()) + contact_torque(&tool, &fe);
        let shown = fe + crate::frame::spatial(bias, Vector3::zeros());
        let mut disturbance = Disturbance::new();
        for job in 1..=400 {
            disturbance.sent(&qd, Some(sent));
            disturbance.observe(&drives, &arm, &tool, &qd, &shown, dt);
            // a first-order lag of 20 ms
            let risen = 1.0 - (1.0 + dt / FILTER_S).powi(-job);
            assert!((disturbance.force_n() - bias.norm() * risen).abs() < 1e-6, "{}", disturbance.force_n());
        }
        assert!((disturbance.force - bias).norm() < 1e-6);
        disturbance.sent(&qd, None);
        disturbance.observe(&drives, &arm, &tool, &qd, &shown, dt);
        assert_eq!(disturbance.force_n(), 0.0, "nothing is known without torque");
    }
}
