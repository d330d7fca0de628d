//! Mechanical energy of arm, rotors and springs: the plant's balance sheet.

use crate::plant::Plant;
use crate::state::State;
use arm::{ArmState, DOF};
use scenario::Joints;

/// Kinetic and potential energy, J; weight counts from the base's origin, springs from no load. Contacts and friction
/// bristles are not in it.
pub fn mechanical(plant: &Plant, state: &State) -> f64 {
    let arm = ArmState::new(&plant.arm, &state.q, &state.qd);
    let mass = arm.mass_matrix();
    let mut energy = arm.potential_energy();
    for i in 0..DOF {
        let momentum: f64 = (0..DOF).map(|j| mass[(i, j)] * state.qd[j]).sum();
        energy += 0.5 * state.qd[i] * momentum;
        let drive = &plant.drives[i];
        energy += 0.5 * drive.rotor * state.theta_dot[i] * state.theta_dot[i];
        if plant.joints == Joints::Flexible {
            let deflection = drive.transmission(drive.gear(state.theta[i]), 0.0, state.q[i], 0.0).deflection;
            energy += 0.5 * drive.stiffness * deflection * deflection;
        }
    }
    energy
}
