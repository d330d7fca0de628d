//! What the control computer takes for a fault, and how long its stops may take.

use serde::{Deserialize, Serialize};

/// Thresholds of the control computer's detectors and of its safety state machine. A job is one run of the control task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Safety {
    /// Jobs in a row in which a value may be missing or refused (a lost message, an error of the receiver, a saturated force
    /// sensor, a count that jumps) before SS1. Where a card does not answer or the bus is not granted, SS1 comes at once.
    pub max_held_jobs: u32,
    /// Age of a force sample, beyond the time between two of its filter's outputs, from which the arm is held (SS2; ms).
    pub max_force_age_ms: f64,
    /// Jobs in a row with a force sample too old before SS1.
    pub max_old_force_jobs: u32,
    /// Jobs in a row in which all force words may repeat to the bit before the arm is held (SS2); 0 = any number: without
    /// noise, a force at rest repeats.
    pub max_same_force_jobs: u32,
    /// Change of a force from one job to the next that is more than a contact can do (N; moments: a tenth in Nm): the sample
    /// is refused, more than `max_held_jobs` of them in a row hold the arm (SS2); 0 = any change.
    pub max_force_slew_n: f64,
    /// Standard deviation of a force's noise, over some 20 jobs, from which the arm is held (SS2; N, moments: a tenth in
    /// Nm); 0 = any.
    pub max_force_noise_n: f64,
    /// Largest force before the first segment with a force axis, when the tool touches nothing, before SS1 (N); 0 = any, as
    /// a task that presses with its position axes needs it.
    pub max_free_force_n: f64,
    /// Difference between the way of a joint from one job to the next and its speed times the period, from which its count
    /// is refused (rad); 0 = any.
    pub max_count_jump_rad: f64,
    /// Torque that nothing accounts for (model, measured motion and measured force), filtered over 20 ms, from which the
    /// torque goes off, as a share of each joint's torque limit; friction is part of it. 0 = any.
    pub max_residual_share: f64,
    /// Force at the tool that would explain these torques best, from which the sensor is taken to show it too much (bias,
    /// drift) and the arm is stopped (SS1; N). Friction is part of it: in this arm's contact tasks up to some 50 N, 30 where
    /// it slides slowly. 0 = any.
    pub max_force_residual_n: f64,
    /// Speed of a joint whose brake is engaged, from which the torque goes off (rad/s).
    pub max_braked_speed_rad_per_s: f64,
    /// Time after which a released brake must have let go before the torque goes off (ms).
    pub max_brake_time_ms: f64,
    /// Polls that the workstation may miss in a row before the arm is held (SS2); 0 = any number.
    pub max_missed_polls: u32,
    /// Farthest that a command may let the desired position jump (m).
    pub max_command_step_m: f64,
    /// Highest speed of the desired position that a command may ask for (m/s).
    pub max_command_speed_m_per_s: f64,
    /// Jobs in a row that may begin after a lost release before SS1; 0 = any number.
    pub max_late_jobs: u32,
    /// Longest time that SS1 may take before the torque goes off (ms).
    pub stop_time_ms: f64,
    /// Time that a message over the bus may be on its way (ms); checked where faults of messages are planned.
    pub max_message_age_ms: f64,
    /// How far the clocks of two boards may drift apart before they are set anew (µs).
    pub max_clock_error_us: f64,
    /// How long the operator at the workstation sees a stopped arm at rest, with the cause of its stop gone, before it is
    /// acknowledged and the task goes on from there (s); none = never.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acknowledge_s: Option<f64>,
}

impl Default for Safety {
    fn default() -> Self {
        Safety {
            max_held_jobs: 3,
            max_force_age_ms: 15.0,
            max_old_force_jobs: 20,
            max_same_force_jobs: 0,
            max_force_slew_n: 100.0,
            max_force_noise_n: 10.0,
            max_free_force_n: 0.0,
            max_count_jump_rad: 2e-3,
            max_residual_share: 0.3,
            max_force_residual_n: 80.0,
            max_braked_speed_rad_per_s: 0.02,
            max_brake_time_ms: 60.0,
            max_missed_polls: 3,
            max_command_step_m: 0.25,
            max_command_speed_m_per_s: 1.0,
            max_late_jobs: 10,
            stop_time_ms: 200.0,
            max_message_age_ms: 1.0,
            max_clock_error_us: 200.0,
            acknowledge_s: None,
        }
    }
}
