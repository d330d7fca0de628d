//! Mechanical energy of arm, rotors and springs: the plant's balance sheet.

use crate::plant::Plant;
use crate::state::State;
use arm::{ArmModel, ArmState, DOF, JointVector, gravity_torque};
use scenario::Joints;

/// Kinetic and potential energy, J; potential energy counts from all joint angles zero and springs without load. Contacts
/// and friction bristles are not in it.
pub fn mechanical(plant: &Plant, state: &State) -> f64 {
    let mass = ArmState::new(&plant.arm, &state.q, &state.qd).mass_matrix();
    let mut energy = gravity_potential(&plant.arm, &state.q);
    for i in 0..DOF {
        let momentum: f64 = (0..DOF).map(|j| mass[(i, j)] * state.qd[j]).sum();
        energy += 0.5 * state.qd[i] * momentum;
        let drive = &plant.drives[i];
        energy += 0.5 * drive.rotor * state.theta_dot[i] * state.theta_dot[i];
        if plant.joints == Joints::Flexible {
            let deflection = drive.transmission(state.theta[i], 0.0, state.q[i], 0.0).deflection;
            energy += 0.5 * drive.stiffness * deflection * deflection;
        }
    }
    energy
}

/// Potential energy U(q) − U(0) from gravity torques ∂U/∂q. In one joint's angle U is a constant plus a sinusoid, so its
/// change on the way of that joint to zero follows from the torque here and a right angle before.
fn gravity_potential(arm: &ArmModel, q: &JointVector) -> f64 {
    let mut energy = 0.0;
    let mut at = *q;
    for i in (0..DOF).rev() {
        let here = gravity_torque(arm, &at)[i];
        at[i] = q[i] - std::f64::consts::FRAC_PI_2;
        let before = gravity_torque(arm, &at)[i];
        let (sin, cos) = libm::sincos(q[i]);
        energy += before * (1.0 - cos) + here * sin;
        at[i] = 0.0;
    }
    energy
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gravity_torque_is_the_gradient_of_the_potential() {
        let arm = ArmModel::rediestro();
        let q = JointVector::from([1.2, -0.27, -1.26, -2.3, 2.8, 1.13, 1.8]);
        let torque = gravity_torque(&arm, &q);
        for i in 0..DOF {
            let moved = |d: f64| {
                let mut q = q;
                q[i] += d;
                gravity_potential(&arm, &q)
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((slope - torque[i]).abs() < 1e-6, "joint {}: {slope} {}", i + 1, torque[i]);
        }
    }
}
