//! The drives of all joints, two at a time: neighbours share a pair, the last joint has none.

use crate::drive::{Drive, RotorLoss, Transmission};
use crate::plant::Actuation;
use crate::state::State;
use arm::{DOF, JointVector, Pair};
use std::ops::Index;

/// Pairs that hold seven joints.
const PAIRS: usize = DOF.div_ceil(2);

/// One drive per joint.
#[derive(Clone, Debug)]
pub struct Drives {
    joints: [Drive; DOF],
    pairs: [Drive<Pair>; PAIRS],
    /// No gear has a kinematic error.
    true_gears: bool,
    /// N² J_m, kg m².
    pub rotor: JointVector,
    /// Their reciprocals.
    pub mobility: JointVector,
    /// N.
    pub gear_ratio: JointVector,
}

/// Friction, brakes and what remains of their bristles, joint by joint.
pub type Losses = RotorLoss<JointVector>;

/// What drives and transmissions do in one state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Driving {
    /// Friction and brakes.
    pub loss: Losses,
    /// Motor accelerations over N, rad/s².
    pub theta_ddot: JointVector,
    /// Torques on the links, Nm.
    pub on_link: JointVector,
}

impl Drives {
    /// These drives, joint 1's first.
    pub fn new(joints: [Drive; DOF]) -> Drives {
        let each = |part: fn(&Drive) -> f64| JointVector::from_fn(|i, _| part(&joints[i]));
        Drives {
            pairs: std::array::from_fn(|k| Drive::of_two(&joints[2 * k], &joints[(2 * k + 1).min(DOF - 1)])),
            true_gears: joints.iter().all(Drive::has_true_gear),
            rotor: each(|drive| drive.rotor),
            mobility: each(|drive| drive.mobility),
            gear_ratio: each(|drive| drive.gear_ratio),
            joints,
        }
    }

    /// Joint 1's first.
    pub fn iter(&self) -> std::slice::Iter<'_, Drive> {
        self.joints.iter()
    }

    /// Torques of the motors, Nm.
    pub(crate) fn motor_torques(&self, actuation: &Actuation) -> JointVector {
        let mut torques = JointVector::zeros();
        for (k, pair) in self.pairs.iter().enumerate() {
            store(&mut torques, k, pair.motor_torque(load(&actuation.volts, k)));
        }
        torques
    }

    /// Behind flexible joints: transmissions, friction and brakes of `state` under the motors' torques.
    pub(crate) fn flexible(&self, state: &State, actuation: &Actuation, motor: &JointVector) -> Driving {
        let mut driving = Driving::default();
        let held = actuation.held();
        // the long series by themselves, so that the processor can work at several joints at once
        let gears: [_; PAIRS] = match self.true_gears {
            true => std::array::from_fn(|k| (of(&state.theta, k), Pair::ONE)),
            false => std::array::from_fn(|k| self.pairs[k].gear(of(&state.theta, k))),
        };
        let stribeck: [_; PAIRS] = std::array::from_fn(|k| self.pairs[k].stribeck(of(&state.theta_dot, k)));
        for (k, pair) in self.pairs.iter().enumerate() {
            let v = of(&state.theta_dot, k);
            let Transmission { on_link, on_rotor, .. } =
                pair.transmission(gears[k], v, of(&state.q, k), of(&state.qd, k));
            let bristles = (of(&state.presliding, k), of(&state.brake, k));
            let loss = pair.loss(bristles, v, stribeck[k], on_link, load(&held, k));
            let left = of(motor, k) - loss.friction - loss.brake - on_rotor;
            store(&mut driving.theta_ddot, k, left * pair.mobility);
            store(&mut driving.on_link, k, on_link);
            driving.loss.store(k, &loss);
        }
        driving
    }

    /// With rigid joints: friction and brakes of `state`, under the load of the step before.
    pub(crate) fn rigid(&self, state: &State, actuation: &Actuation) -> Losses {
        let mut losses = Losses::default();
        let held = actuation.held();
        for (k, pair) in self.pairs.iter().enumerate() {
            let (v, bristles) = (of(&state.qd, k), (of(&state.presliding, k), of(&state.brake, k)));
            let loss = pair.loss(bristles, v, pair.stribeck(v), of(&state.load, k), load(&held, k));
            losses.store(k, &loss);
        }
        losses
    }
}

impl Losses {
    fn store(&mut self, k: usize, loss: &RotorLoss<Pair>) {
        store(&mut self.friction, k, loss.friction);
        store(&mut self.brake, k, loss.brake);
        store(&mut self.presliding, k, loss.presliding);
        store(&mut self.brake_deflection, k, loss.brake_deflection);
    }
}

impl Index<usize> for Drives {
    type Output = Drive;
    fn index(&self, joint: usize) -> &Drive {
        &self.joints[joint]
    }
}

#[inline(always)]
fn of(v: &JointVector, k: usize) -> Pair {
    load(&v.data.0[0], k)
}

/// Joints 2k and 2k + 1 (from 0).
#[inline(always)]
fn load(v: &[f64; DOF], k: usize) -> Pair {
    Pair::new([v[2 * k], if 2 * k + 1 < DOF { v[2 * k + 1] } else { 0.0 }])
}

#[inline(always)]
fn store(v: &mut JointVector, k: usize, pair: Pair) {
    let [low, high] = pair.to_array();
    v[2 * k] = low;
    if 2 * k + 1 < DOF {
        v[2 * k + 1] = high;
    }
}
