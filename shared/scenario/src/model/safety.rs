//! What the control computer takes for a fault, and how long its stops may take.

use serde::{Deserialize, Serialize};

/// Thresholds of the control computer's safety state machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Safety {
    /// Jobs in a row in which a value may be missing (BERR*, an error of the receiver, a saturated force sensor) before SS1.
    pub max_held_jobs: u32,
    /// Age of a force sample, beyond the time between two of its filter's outputs, from which the arm is held (SS2; ms).
    pub max_force_age_ms: f64,
    /// Jobs in a row with a force sample too old before SS1.
    pub max_old_force_jobs: u32,
    /// Jobs in a row in which all force words may repeat to the bit before the arm is held (SS2); 0 = any number: without
    /// noise, a force at rest repeats.
    pub max_same_force_jobs: u32,
    /// Longest time that SS1 may take before the torque goes off (ms).
    pub stop_time_ms: f64,
}

impl Default for Safety {
    fn default() -> Self {
        Safety {
            max_held_jobs: 3,
            max_force_age_ms: 15.0,
            max_old_force_jobs: 20,
            max_same_force_jobs: 0,
            stop_time_ms: 200.0,
        }
    }
}
