//! From one instant to the next: semi-implicit Euler and classical Runge–Kutta.
//!
//! Bristle deflections move with the speeds that the step ends up with; they are cut to what friction can hold when the
//! next state is evaluated. The actuation is constant in a step, but the motor torques may change in it where they move
//! nothing but rotors: semi-implicit Euler takes their mean, and the rotors get the impulse that is theirs.

use crate::plant::{Actuation, Evaluation, Plant};
use crate::state::State;
use arm::{JointVector, Spatial};
use scenario::Integrator;

/// Carries `state`, in which `now` was evaluated, on by `h` seconds. `motor` are the motor torques' means (Nm), with rigid
/// joints or Runge–Kutta those of `now`.
pub fn step(
    plant: &Plant,
    integrator: Integrator,
    state: &mut State,
    now: &Evaluation,
    actuation: &Actuation,
    motor: &JointVector,
    h: f64,
) {
    match integrator {
        Integrator::SemiImplicit => semi_implicit(plant, state, now, motor, h),
        Integrator::Rk4 => rk4(plant, state, now, actuation, h),
    }
}

/// Speeds first, then positions with the new speeds: symplectic for the conservative part, one evaluation a step.
fn semi_implicit(plant: &Plant, state: &mut State, now: &Evaluation, motor: &JointVector, h: f64) {
    let qd = state.qd + now.qdd * h;
    let theta_ddot = now.theta_ddot + (motor - now.motor).component_mul(&plant.drives.mobility);
    let theta_dot = state.theta_dot + theta_ddot * h;
    state.qd = qd;
    state.theta_dot = theta_dot;
    let twist = now.twist + now.acceleration * h;
    drift(plant, state, now, &qd, &theta_dot, &twist, h);
}

/// Moves everything that has a position on by `h` at these speeds.
fn drift(
    plant: &Plant,
    state: &mut State,
    now: &Evaluation,
    qd: &JointVector,
    theta_dot: &JointVector,
    twist: &Spatial,
    h: f64,
) {
    state.q += qd * h;
    let moved = theta_dot * h;
    state.theta += moved;
    state.presliding = now.loss.presliding + moved;
    state.brake = now.loss.brake_deflection + moved;
    state.load = now.transmitted;
    plant.advance_contacts(state, now, twist, h);
}

/// Classical fourth order, four evaluations a step.
fn rk4(plant: &Plant, state: &mut State, k1: &Evaluation, actuation: &Actuation, h: f64) {
    let start = *state;
    // speeds and accelerations of the stage before lead to the next stage
    let stage = |speeds: &State, k: &Evaluation, h: f64| {
        let mut next = start;
        drift(plant, &mut next, k1, &speeds.qd, &speeds.theta_dot, &k.twist, h);
        next.load = start.load;
        next.qd = start.qd + k.qdd * h;
        next.theta_dot = start.theta_dot + k.theta_ddot * h;
        next
    };
    let s2 = stage(&start, k1, 0.5 * h);
    let k2 = plant.evaluate(&s2, actuation);
    let s3 = stage(&s2, &k2, 0.5 * h);
    let k3 = plant.evaluate(&s3, actuation);
    let s4 = stage(&s3, &k3, h);
    let k4 = plant.evaluate(&s4, actuation);

    let sixth = 1.0 / 6.0;
    let qd = (start.qd + (s2.qd + s3.qd) * 2.0 + s4.qd) * sixth;
    let theta_dot = (start.theta_dot + (s2.theta_dot + s3.theta_dot) * 2.0 + s4.theta_dot) * sixth;
    let twist = (k1.twist + (k2.twist + k3.twist) * 2.0 + k4.twist) * sixth;
    drift(plant, state, k1, &qd, &theta_dot, &twist, h);
    state.qd += (k1.qdd + (k2.qdd + k3.qdd) * 2.0 + k4.qdd) * (sixth * h);
    state.theta_dot += (k1.theta_ddot + (k2.theta_ddot + k3.theta_ddot) * 2.0 + k4.theta_ddot) * (sixth * h);
}
