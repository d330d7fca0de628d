//! Inverse dynamics: torques for q̈ᵗ, τ = M(q) q̈ᵗ + h(q, q̇) + Jᵀ F_e, with what the drives add.
//!
//! M contains the rotors' inertia N²J_m seen at the output, q and q̇ are motor-side (θ/N). Jᵀ F_e feeds the measured
//! contact force forward and can be switched off; friction is fed forward on the *target* velocity, so that it does not
//! close another loop. Torques beyond a drive's limit are cut there and reported.

use crate::disturbance::Disturbance;
use crate::findings::Findings;
use crate::frame::TaskKinematics;
use crate::handover::Wanted;
use crate::pipeline::Mode;
use crate::safety::State;
use arm::drives::DriveData;
use arm::{ArmState, DOF, JointVector, Spatial, transposed_times};
use messages::Detector;
use scenario::Scenario;

/// Torques for what the law wants.
#[derive(Clone, Debug)]
pub struct InverseDynamics {
    drives: Drives,
    force_feed_forward: bool,
    disturbance: Disturbance,
}

impl InverseDynamics {
    /// Of this scenario's controller. The message says what is wrong with the drives.
    pub fn new(scenario: &Scenario) -> Result<InverseDynamics, String> {
        let controller = &scenario.controller;
        Ok(InverseDynamics {
            drives: Drives::new(&scenario.drives()?, controller.friction_compensation),
            force_feed_forward: controller.force_feed_forward,
            disturbance: Disturbance::new(),
        })
    }

    /// Compares what the arm did in the `dt` seconds since the last job with the torques that it sent.
    pub fn observe(&mut self, arm: &ArmState, tool: &TaskKinematics, qd: &JointVector, fe: &Spatial, dt: f64) {
        self.disturbance.observe(&self.drives, arm, tool, qd, fe, dt);
    }

    /// The job sends these torques at these joint speeds; none: the drives are off or still on their brakes.
    pub fn sent(&mut self, qd: &JointVector, torque: Option<JointVector>) {
        self.disturbance.sent(qd, torque);
    }

    /// Reports the torques that nothing accounts for, where they are more than friction can be.
    pub fn report(&self, limits: &scenario::Safety, findings: &mut Findings) {
        let (joint, share) = self.disturbance.greatest(&self.drives);
        if limits.max_residual_share > 0.0 && share > limits.max_residual_share {
            findings.report(Detector::TrackingResidual, State::Off, joint as f64);
        }
        let force = self.disturbance.force_n();
        if limits.max_force_residual_n > 0.0 && force > limits.max_force_residual_n {
            findings.report(Detector::ForceResidual, State::Stop, force);
        }
    }

    /// τ within the drives' limits, and the joints that were cut there, a bit each.
    pub fn torque(&self, arm: &ArmState, tool: &TaskKinematics, wanted: &Wanted, mode: Mode) -> (JointVector, u32) {
        let mut torque = match mode {
            Mode::Free => return (JointVector::zeros(), 0),
            Mode::Brake => motion_torque(arm, &self.drives, &wanted.qdd),
            Mode::Law | Mode::Hold => {
                motion_torque(arm, &self.drives, &wanted.qdd) + self.drives.friction(&wanted.target_speed)
            }
        };
        if matches!(mode, Mode::Law | Mode::Hold) && self.force_feed_forward {
            torque += contact_torque(tool, &wanted.fe);
        }
        let cut = self.drives.saturate(&mut torque);
        (torque, cut)
    }
}

/// What the controller knows of the drives.
#[derive(Clone, Debug)]
pub struct Drives {
    /// N²J_m (kg m²).
    pub rotor_inertia: JointVector,
    /// Largest torques (Nm).
    pub torque_limit: JointVector,
    /// Coulomb friction fed forward, its share included (Nm).
    coulomb: JointVector,
    /// Viscous friction fed forward, its share included (Nms/rad).
    viscous: JointVector,
    /// Speeds over which the fed-forward Coulomb friction changes its sign (rad/s).
    smoothing: JointVector,
}

impl Drives {
    /// Of these drives, with this share of their friction fed forward.
    pub fn new(data: &DriveData, friction_share: f64) -> Drives {
        Drives {
            rotor_inertia: data.each(|d| d.rotor_inertia_at_output_kg_m2),
            torque_limit: data.each(|d| d.torque_limit_nm),
            coulomb: data.each(|d| friction_share * d.coulomb_nm),
            viscous: data.each(|d| friction_share * d.viscous_nms_per_rad),
            smoothing: data.each(|d| d.stribeck_speed_rad_per_s),
        }
    }

    /// Friction to feed forward at target joint speeds (Nm): Coulomb with a smoothed sign, and viscous.
    pub fn friction(&self, target_speed: &JointVector) -> JointVector {
        JointVector::from_fn(|i, _| {
            let (v, width) = (target_speed[i], self.smoothing[i]);
            self.coulomb[i] * v / (v * v + width * width).sqrt() + self.viscous[i] * v
        })
    }

    /// Cuts torques at the drives' limits; bit i of the result: joint i was cut.
    pub fn saturate(&self, torque: &mut JointVector) -> u32 {
        let mut cut = 0;
        for i in 0..DOF {
            let limit = self.torque_limit[i];
            if torque[i].abs() > limit {
                torque[i] = limit.copysign(torque[i]);
                cut |= 1 << i;
            }
        }
        cut
    }
}

/// M(q) q̈ᵗ + h(q, q̇), rotors included (Nm).
pub fn motion_torque(arm: &ArmState, drives: &Drives, qdd: &JointVector) -> JointVector {
    arm.rnea(qdd) + drives.rotor_inertia.component_mul(qdd)
}

/// Jᵀ F_e (Nm).
pub fn contact_torque(tool: &TaskKinematics, fe: &Spatial) -> JointVector {
    transposed_times(&tool.jacobian, fe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::{ArmModel, aba};

    #[test]
    fn the_torques_give_the_accelerations_asked_for_on_an_arm_with_rotors_in_contact() {
        let model = ArmModel::rediestro();
        let drives = Drives::new(&DriveData::rediestro(), 0.0);
        let q = JointVector::from([0.3, -0.4, 0.9, -1.2, 0.5, 0.7, -0.2]);
        let (qd, qdd) = (JointVector::repeat(0.4), JointVector::from_fn(|i, _| i as f64 - 3.0));
        let fe = Spatial::new(3.0, -5.0, 60.0, 1.0, 0.5, -0.2);
        let state = ArmState::new(&model, &q, &qd);
        let contact = transposed_times(&state.jacobian(), &fe);
        let torque = motion_torque(&state, &drives, &qdd) + contact;
        let got = aba(&model, &q, &qd, &torque, &drives.rotor_inertia, &-fe);
        assert!((got - qdd).amax() < 1e-9, "{got}");
    }

    #[test]
    fn friction_is_fed_forward_in_its_share_with_a_smooth_sign() {
        let data = DriveData::rediestro();
        let drives = Drives::new(&data, 0.8);
        let (coulomb, viscous) = (data.joints[0].coulomb_nm, data.joints[0].viscous_nms_per_rad);
        let at = |v: f64| drives.friction(&JointVector::repeat(v))[0];
        assert_eq!(at(0.0), 0.0);
        assert!((at(1.0) - 0.8 * (coulomb + viscous)).abs() < 1e-3);
        assert_eq!(at(-0.3), -at(0.3));
        let width = data.joints[0].stribeck_speed_rad_per_s;
        assert!((at(width) - 0.8 * (coulomb * 0.5f64.sqrt() + viscous * width)).abs() < 1e-12);
        let none = Drives::new(&data, 0.0).friction(&JointVector::repeat(0.3));
        assert_eq!(none, JointVector::zeros());
    }

    #[test]
    fn torques_beyond_the_limit_are_cut_and_named() {
        let drives = Drives::new(&DriveData::rediestro(), 0.0);
        let mut torque = drives.torque_limit;
        torque[1] *= -1.5;
        torque[6] += 1.0;
        assert_eq!(drives.saturate(&mut torque), 1 << 1 | 1 << 6);
        let mut limit = drives.torque_limit;
        limit[1] *= -1.0;
        assert_eq!(torque, limit);
    }
}
