//! Arm, drives, contacts and sensor as one differential equation.
//!
//! Flexible joints (Spong), in output-side quantities: M(q)q̈ + h = τ_s + Jᵀ(−F_e) on the link side and
//! N²J_m (θ̈/N) = τ_m − τ_f − τ_brake − τ_s on the motor side. Rigid joints: (M + N²J_m)q̈ + h = τ_m − τ_f − τ_brake − JᵀF_e.

use crate::contact::{Contact, PegInHole, Plane, Touch};
use crate::drive::Drive;
use crate::drives::{Drives, Driving, Losses};
use crate::sensor::Sensor;
use crate::state::{CONTACT_POINTS, State};
use arm::{ArmModel, ArmState, DOF, FrozenArm, JointVector, Pose, Spatial};
use messages::AmplifierCommand;
use scenario::{Joints, Scenario};

/// What does not change while the arm moves.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The arm as it is (not as the controller knows it).
    pub arm: ArmModel,
    /// One drive per joint.
    pub drives: Drives,
    /// Flexible or rigid transmissions.
    pub joints: Joints,
    /// What the tool may touch.
    pub contacts: Vec<Contact>,
    /// Strain gauges between flange and tool.
    pub sensor: Sensor,
}

/// Share of the tool's speed into a surface that the contact's damper may take in one step.
const LARGEST_DAMPER_STEP: f64 = 0.5;

/// What the amplifiers and brakes are told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuation {
    /// Amplifier inputs, V; 0 where the amplifier is disabled.
    pub volts: [f64; DOF],
    /// Bit i: brake of joint i engaged.
    pub braked: u32,
    /// Share of its torque that each brake holds.
    pub brake_share: [f64; DOF],
}

impl Actuation {
    /// Torque off, brakes engaged.
    pub const SAFE: Actuation = Actuation { volts: [0.0; DOF], braked: 0x7F, brake_share: [1.0; DOF] };

    /// What a command of the D/A and parallel I/O cards means.
    pub fn from_command(command: &AmplifierCommand) -> Actuation {
        let enabled = |i: usize| command.enabled & (1 << i) != 0;
        Actuation {
            volts: std::array::from_fn(|i| if enabled(i) { command.volts[i] } else { 0.0 }),
            braked: !command.brake_released & 0x7F,
            brake_share: [1.0; DOF],
        }
    }

    /// Share of its torque that each joint's brake holds, 0 = released.
    pub fn held(&self) -> [f64; DOF] {
        std::array::from_fn(|i| if self.braked & (1 << i) != 0 { self.brake_share[i] } else { 0.0 })
    }

    /// The brakes are told the same.
    pub fn brakes_like(&self, other: &Actuation) -> bool {
        self.braked == other.braked && self.brake_share == other.brake_share
    }
}

/// Forces and accelerations in one state.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation {
    /// Link accelerations, rad/s².
    pub qdd: JointVector,
    /// Motor accelerations over N, rad/s².
    pub theta_ddot: JointVector,
    /// Motor torques, Nm.
    pub motor: JointVector,
    /// Friction and brakes.
    pub loss: Losses,
    /// Torques through the transmissions, Nm.
    pub transmitted: JointVector,
    /// Pose of the tool.
    pub pose: Pose,
    /// Twist of the tool, base axes.
    pub twist: Spatial,
    /// Acceleration of the tool, base axes.
    pub acceleration: Spatial,
    /// Contact.
    pub touch: Touch,
}

impl Plant {
    /// The plant of a scenario, with its start posture. The message says what cannot be simulated.
    pub fn new(scenario: &Scenario) -> Result<(Plant, State), String> {
        let arm = scenario.plant_arm()?;
        let data = scenario.drives()?;
        let q = scenario.initial_posture()?;
        let plant = &scenario.plant;
        let stiffness = scenario.stiffness().map_err(|problem| format!("{}: {}", problem.key, problem.message))?;
        let planes = scenario.surfaces.iter().map(|surface| Contact::Plane(Plane::from_surface(scenario, surface)));
        let pegs = scenario.holes.iter().map(|hole| Contact::Peg(PegInHole::from_hole(scenario, hole)));
        let mut contacts: Vec<Contact> = planes.chain(pegs).collect();
        let points: usize = contacts.iter().map(Contact::points).sum();
        if points > CONTACT_POINTS {
            return Err(format!("surfaces and hole have {points} contact points, expected at most {CONTACT_POINTS}"));
        }
        for contact in &mut contacts {
            let mobility = stiffness.tool_mobility + contact.lever_squared() * stiffness.turning_mobility;
            contact.limit_damping(LARGEST_DAMPER_STEP * plant.rate_hz / mobility);
        }
        let plant = Plant {
            drives: Drives::new(std::array::from_fn(|i| {
                let braked = stiffness.braked_inertia[i];
                Drive::new(&data.joints[i], plant.friction_scale, plant.kinematic_error, braked)
            })),
            joints: plant.joints,
            contacts,
            sensor: Sensor::new(&scenario.arm, &arm),
            arm,
        };
        let state = plant.braked_at_rest(q);
        Ok((plant, state))
    }

    /// At rest with every brake engaged and carrying the arm's weight: nothing moves when time starts.
    pub fn braked_at_rest(&self, q: JointVector) -> State {
        let mut state = State::at_rest(q);
        let arm = ArmState::new(&self.arm, &q, &JointVector::zeros());
        let touch = self.touch(&arm.pose(), &Spatial::zeros(), &state);
        state.load = arm.dynamics().1 + arm.jacobian().tr_mul(&touch.wrench);
        for (i, drive) in self.drives.iter().enumerate() {
            let torque = state.load[i];
            let mut on_rotor = torque;
            if self.joints == Joints::Flexible {
                state.theta[i] = drive.motor_angle_under(torque, q[i]);
                on_rotor = drive.transmission(drive.gear(state.theta[i]), 0.0, q[i], 0.0).on_rotor;
            }
            state.brake[i] = drive.brake_deflection_under(-on_rotor);
        }
        state
    }

    /// The arm as it is half way through the next `span` seconds, if the joints keep their speeds.
    pub fn frozen(&self, state: &State, span: f64) -> FrozenArm {
        let armature = match self.joints {
            Joints::Flexible => JointVector::zeros(),
            Joints::Rigid => self.drives.rotor,
        };
        FrozenArm::new(&ArmState::new(&self.arm, &(state.q + state.qd * (0.5 * span)), &state.qd), &armature)
    }

    /// Forces and accelerations in `state` under `actuation`.
    pub fn evaluate(&self, state: &State, actuation: &Actuation) -> Evaluation {
        self.evaluate_about(&self.frozen(state, 0.0), state, actuation)
    }

    /// The same with an arm frozen near `state`.
    pub fn evaluate_about(&self, arm: &FrozenArm, state: &State, actuation: &Actuation) -> Evaluation {
        let (pose, twist) = (arm.pose(&state.q), arm.twist(&state.qd));
        let touch = self.touch(&pose, &twist, state);
        let f_tip = -touch.wrench;
        let motor = self.drives.motor_torques(actuation);
        let (qdd, driving) = match self.joints {
            Joints::Flexible => {
                let driving = self.drives.flexible(state, actuation, &motor);
                (arm.accelerations(&driving.on_link, &f_tip), driving)
            }
            Joints::Rigid => {
                let loss = self.drives.rigid(state, actuation);
                let torque = motor - loss.friction - loss.brake;
                let qdd = arm.accelerations(&torque, &f_tip);
                (qdd, Driving { loss, theta_ddot: qdd, on_link: torque - self.drives.rotor.component_mul(&qdd) })
            }
        };
        let Driving { loss, theta_ddot, on_link: transmitted } = driving;
        let acceleration = arm.tip_acceleration(&qdd);
        Evaluation { qdd, theta_ddot, motor, loss, transmitted, pose, twist, acceleration, touch }
    }

    fn touch(&self, pose: &Pose, twist: &Spatial, state: &State) -> Touch {
        let mut touch = Touch::NONE;
        let mut first = 0;
        for contact in &self.contacts {
            contact.add_to(&mut touch, pose, twist, &state.contact[first..first + contact.points()]);
            first += contact.points();
        }
        touch
    }

    /// Moves the contact bristles of `state` on by `h` seconds in which the tool, at `now`, has the twist `moving`.
    pub fn advance_contacts(&self, state: &mut State, now: &Evaluation, moving: &Spatial, h: f64) {
        let mut first = 0;
        for contact in &self.contacts {
            let bristles = &mut state.contact[first..first + contact.points()];
            contact.advance(bristles, &now.pose, &now.twist, moving, h);
            first += contact.points();
        }
    }
}
