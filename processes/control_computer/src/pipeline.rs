//! The control pipeline of Figure 5.18: TG → AHIC → ERC → RR → inverse dynamics, with forward kinematics feeding X back.
//!
//! One [`Pipeline::step`] is one control job, apart from everything that has to do with the bus; [`Pipeline::law_step`] is
//! one of the first of two cards, without inverse dynamics. It cannot fail; sensor values that are no numbers give torques
//! that are none, which the safety state machine sees.

use crate::frame::TaskKinematics;
use crate::handover::Wanted;
use crate::inverse_dynamics::InverseDynamics;
use crate::law::{Decided, Law};
use crate::safety::State;
use crate::sensors::Sensed;
use crate::tool::{Contact, ToolCompensation};
use crate::trajectory::Trajectory;
use arm::{ArmModel, ArmState, JointVector, Pose, Spatial};
use nalgebra::Vector3;
use scenario::Scenario;
use vme::Ns;

/// What governs the joints in a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The law.
    Law,
    /// The law holds the pose it has been given, blind to the force (SS2): a force that is not to be trusted must not
    /// move the arm.
    Hold,
    /// Motors brake the joints: q̈ = −q̇ · [`BRAKING`] (SS1).
    Brake,
    /// Nothing: no torque (STO).
    Free,
}

/// Rate at which braked joints lose their speed (1/s).
pub const BRAKING: f64 = 20.0;

/// Everything that a job knew and decided; poses, twists and wrenches in the task frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// X.
    pub x: Pose,
    /// Ẋ (m/s, rad/s).
    pub x_dot: Spatial,
    /// F_e, and the tare.
    pub contact: Contact,
    /// What the law decided.
    pub law: Decided,
    /// Torques after limits (Nm).
    pub torque: JointVector,
    /// Joints whose torque was cut, a bit each.
    pub torque_limited: u32,
}

/// The pipeline and what it keeps from job to job.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// Seen from the task frame.
    arm: ArmModel,
    outer: OuterLoop,
    inverse: InverseDynamics,
}

/// The part that closes the loop over the force: F_e, then TG → AHIC → ERC → RR.
#[derive(Clone, Debug)]
struct OuterLoop {
    tool: ToolCompensation,
    law: Law,
    /// F_e of the last job under the law: SS2 feeds it forward, for what is measured then is not to be trusted.
    trusted: Spatial,
}

impl Pipeline {
    /// The pipeline of this scenario's controller. The message says what is wrong with the arm or its drives.
    pub fn new(scenario: &Scenario) -> Result<Pipeline, String> {
        let arm = scenario.controller_arm()?.seen_from(&scenario.task_frame());
        let controller = &scenario.controller;
        let tool = controller.tool.as_ref().unwrap_or(&scenario.arm.tool);
        let known = (tool.mass_kg, Vector3::from(tool.com_m));
        let tare = scenario::nanoseconds(controller.tare_ms * 1e-3);
        let tool = ToolCompensation::new(
            controller.tool_compensation.then_some(known),
            controller.tool_inertia_compensation,
            Vector3::from(scenario.arm.sensor_m),
            &arm.gravity(),
            (tare > 0).then_some(tare),
        );
        let outer = OuterLoop { tool, law: Law::new(scenario, &arm), trusted: Spatial::zeros() };
        Ok(Pipeline { outer, inverse: InverseDynamics::new(scenario)?, arm })
    }

    /// TG, for the segments that commands bring.
    pub fn trajectory(&mut self) -> &mut Trajectory {
        self.outer.law.trajectory()
    }

    /// Takes no tare: the tool may touch, and the force at work is not the sensor's offset.
    pub fn skip_tare(&mut self) {
        self.outer.tool.skip_tare();
    }

    /// Ends the segment in force and those that wait: X_d rests where the tool is.
    pub fn hold(&mut self, sensed: &Sensed) {
        self.outer.law.hold(arm::forward_kinematics(&self.arm, &sensed.q));
    }

    /// One job at `now`, `dt` seconds after the last one.
    pub fn step(&mut self, now: Ns, dt: f64, sensed: &Sensed, mode: Mode) -> Job {
        let arm = ArmState::new(&self.arm, &sensed.q, &sensed.qd);
        let tool = arm.tip_motion();
        let mut job = self.outer.decide(now, dt, sensed, &tool, mode);
        self.inverse.observe(&arm, &tool, &sensed.qd, &job.contact.fe, dt);
        (job.torque, job.torque_limited) = self.inverse.torque(&arm, &tool, &job.wanted(), mode);
        self.outer.carry_on(&job, &tool, mode, dt);
        job
    }

    /// The inverse dynamics, and the observer behind it.
    pub fn inverse(&mut self) -> &mut InverseDynamics {
        &mut self.inverse
    }

    /// One job of the first of two cards; `torque_limited` is what the second card has said last.
    pub fn law_step(&mut self, now: Ns, dt: f64, sensed: &Sensed, mode: Mode, torque_limited: u32) -> Job {
        let arm = ArmState::new(&self.arm, &sensed.q, &sensed.qd);
        let tool = arm.tip_motion();
        let job = Job { torque_limited, ..self.outer.decide(now, dt, sensed, &tool, mode) };
        self.outer.carry_on(&job, &tool, mode, dt);
        job
    }
}

impl OuterLoop {
    /// What is wanted of the joints, no torques yet.
    fn decide(&mut self, now: Ns, dt: f64, sensed: &Sensed, tool: &TaskKinematics, mode: Mode) -> Job {
        let mut contact = (self.tool).contact(&sensed.wrench, &tool.pose, &tool.twist, now, dt);
        match mode {
            Mode::Law => self.trusted = contact.fe,
            Mode::Hold => contact.fe = self.trusted,
            Mode::Brake | Mode::Free => {}
        }
        let mut law = match mode {
            Mode::Law => self.law.decide(now, sensed, tool, &contact.fe),
            Mode::Hold => self.law.decide(now, sensed, tool, &Spatial::zeros()),
            Mode::Brake | Mode::Free => Decided::nothing(tool.pose),
        };
        if mode == Mode::Brake {
            law.qdd = sensed.qd * -BRAKING;
        }
        let torque = JointVector::zeros();
        Job { x: tool.pose, x_dot: tool.twist, contact, law, torque, torque_limited: 0 }
    }

    /// Carries Xᵗ on to the next job.
    fn carry_on(&mut self, job: &Job, tool: &TaskKinematics, mode: Mode, dt: f64) {
        if matches!(mode, Mode::Law | Mode::Hold) {
            (self.law).carry_on(&job.law, tool, job.torque_limited != 0, dt);
        } else {
            self.law.leave();
        }
    }
}

impl Job {
    /// What inverse dynamics is to make torques of.
    pub fn wanted(&self) -> Wanted {
        Wanted {
            qdd: self.law.qdd,
            target_speed: self.law.target_speed,
            fe: self.contact.fe,
            demand: State::Run,
            cause: None,
            acknowledge: false,
        }
    }
}
