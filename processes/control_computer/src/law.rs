//! The control law from X and F_e to joint accelerations: TG → AHIC → ERC → RR, and the target trajectory between jobs.
//!
//! Pure arithmetic on the task frame's quantities; it knows neither the arm's dynamics nor the bus.

use crate::ahic::{Impedance, target_acceleration};
use crate::erc::{Gains, reference_acceleration};
use crate::frame::{Motion, TaskKinematics, spatial};
use crate::joint_limits::{JointLimits, LimitTask};
use crate::redundancy::{Resolution, Weights};
use crate::sensors::Sensed;
use crate::target::{Bounds, Target};
use crate::trajectory::Trajectory;
use arm::{ArmModel, JointVector, Pose, Spatial};
use scenario::{Scenario, Scheme};
use vme::Ns;

/// Parameters of the law, and what it keeps from job to job.
#[derive(Clone, Debug)]
pub struct Law {
    scheme: Scheme,
    gains: Gains,
    weights: Weights,
    joint_limits: Option<JointLimits>,
    /// The joint speeds of Ẋᵗ are wanted (for friction).
    resolves_speed: bool,
    bounds: Bounds,
    /// Impedance where no segment says otherwise.
    resting: Impedance,
    trajectory: Trajectory,
    /// Xᵗ, Ẋᵗ; `None` until the law governs for the first time, or again after a stop.
    target: Option<Target>,
}

/// What the law decided in a job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decided {
    /// Segment in force.
    pub segment: Option<u32>,
    /// F_d (N, Nm).
    pub fd: Spatial,
    /// X_d, Ẋ_d, Ẍ_d.
    pub xd: Motion,
    /// Xᵗ, Ẋᵗ, Ẍᵗ (the original scheme: X and Ẋ in their place).
    pub xt: Motion,
    /// Ẍʳ.
    pub xr_ddot: Spatial,
    /// q̈ᵗ (rad/s²).
    pub qdd: JointVector,
    /// Joint speeds of Ẋᵗ, zero where friction is not fed forward (rad/s).
    pub target_speed: JointVector,
    /// Axes on which |Xᵗ − X| was at its limit: bits 0–2 the translations, bit 3 the rotation.
    pub target_limited: u32,
    /// The joint-limit task was active.
    pub near_joint_limit: bool,
}

impl Decided {
    /// Nothing, with the tool in this pose.
    pub fn nothing(x: Pose) -> Decided {
        Decided {
            segment: None,
            fd: Spatial::zeros(),
            xd: Motion::at_rest(x),
            xt: Motion::at_rest(x),
            xr_ddot: Spatial::zeros(),
            qdd: JointVector::zeros(),
            target_speed: JointVector::zeros(),
            target_limited: 0,
            near_joint_limit: false,
        }
    }
}

impl Law {
    /// The law of this scenario's controller, for this arm.
    pub fn new(scenario: &Scenario, arm: &ArmModel) -> Law {
        let controller = &scenario.controller;
        let limits = &controller.joint_limit;
        let rest = &scenario.impedance;
        let six = |linear: [f64; 3], angular: [f64; 3]| spatial(linear.into(), angular.into());
        let resting = Impedance {
            selection: Spatial::repeat(1.0),
            mass: six(rest.mass_kg, rest.rotational_mass_kg_m2),
            damping: six(rest.damping_ns_per_m, rest.rotational_damping_nms_per_rad),
            stiffness: six(rest.stiffness_n_per_m, rest.rotational_stiffness_nm_per_rad),
            force: Spatial::zeros(),
        };
        let start = Pose { p: scenario.arm.start_position_m.into(), r: scenario::rpy_deg(scenario.arm.start_rpy_deg) };
        Law {
            scheme: controller.scheme,
            gains: Gains { kp: controller.kp, kv: controller.kv },
            weights: Weights {
                task: Spatial::from(controller.task_weight),
                joint: JointVector::from(controller.joint_weight),
                lambda: controller.lambda,
            },
            joint_limits: limits.enabled.then(|| JointLimits {
                lower: *arm.lower_limits(),
                upper: *arm.upper_limits(),
                buffer: limits.buffer_deg.to_radians(),
                kp: limits.kp,
                max_weight: limits.max_weight,
            }),
            resolves_speed: controller.friction_compensation > 0.0,
            bounds: Bounds {
                linear: [controller.max_target_error_m; 3],
                angular: controller.max_target_error_deg.to_radians(),
            },
            resting,
            trajectory: Trajectory::new(start, resting),
            target: None,
        }
    }

    /// TG, for the segments that commands bring.
    pub fn trajectory(&mut self) -> &mut Trajectory {
        &mut self.trajectory
    }

    /// Ends the segment in force and those that wait: X_d rests at `x`.
    pub fn hold(&mut self, x: Pose) {
        self.trajectory.forget_waiting();
        self.trajectory.rest_at(x, self.resting);
    }

    /// The law governs no longer; when it does again it begins at rest where the tool then is.
    pub fn leave(&mut self) {
        self.trajectory.forget_waiting();
        self.target = None;
    }

    /// One job at `now`: TG → AHIC → ERC → RR.
    pub fn decide(&mut self, now: Ns, sensed: &Sensed, tool: &TaskKinematics, fe: &Spatial) -> Decided {
        let (x, x_dot) = (&tool.pose, &tool.twist);
        if self.target.is_none() {
            self.trajectory.rest_at(*x, self.resting);
        }
        // from then on the target is kept, whatever segment starts
        let target = self.target.get_or_insert(Target::at_rest(*x));
        while self.trajectory.start_due(now).is_some() {}
        let xd = self.trajectory.desired(now);
        let impedance = self.trajectory.impedance();

        let (target_limited, xt_ddot, xr_ddot);
        match self.scheme {
            Scheme::Modified => {
                let error;
                (error, target_limited) = target.limit(x, x_dot, &self.bounds);
                xt_ddot = target_acceleration(impedance, &xd, &target.pose, &target.twist, fe);
                xr_ddot = reference_acceleration(&self.gains, &xt_ddot, &(target.twist - x_dot), &error);
            }
            Scheme::Original => {
                *target = Target { pose: *x, twist: *x_dot };
                target_limited = 0;
                xt_ddot = target_acceleration(impedance, &xd, x, x_dot, fe);
                xr_ddot = xt_ddot;
            }
        }

        let limits = match &self.joint_limits {
            Some(limits) => limits.task(&sensed.q, &sensed.qd),
            None => LimitTask::none(),
        };
        let resolution = Resolution::new(&self.weights, tool, &limits);
        Decided {
            segment: self.trajectory.segment(),
            fd: impedance.force,
            xd,
            xt: Motion { pose: target.pose, twist: target.twist, acceleration: xt_ddot },
            xr_ddot,
            qdd: resolution.joint_acceleration(&xr_ddot, &sensed.qd),
            target_speed: if self.resolves_speed {
                resolution.joint_speed(&target.twist)
            } else {
                JointVector::zeros()
            },
            target_limited,
            near_joint_limit: limits.is_active(),
        }
    }

    /// Carries Xᵗ on to the next job, `dt` seconds later. While torques are cut the tool cannot follow, and Xᵗ may not
    /// get further away from it than it is.
    pub fn carry_on(&mut self, decided: &Decided, tool: &TaskKinematics, torque_cut: bool, dt: f64) {
        let Some(target) = &mut self.target else {
            return;
        };
        target.advance(&decided.xt.acceleration, dt);
        if torque_cut {
            let held = (self.bounds).no_further_than(&decided.xt.pose, &tool.pose);
            target.limit(&tool.pose, &tool.twist, &held);
        }
    }
}
