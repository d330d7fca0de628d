//! The control law's parameters.

use super::ToolModel;
use serde::{Deserialize, Serialize};

/// Augmented hybrid impedance control and what follows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Controller {
    /// Which form of the AHIC.
    pub scheme: Scheme,
    /// ERC position gain K_p, 1/s².
    pub kp: f64,
    /// ERC velocity gain K_v, 1/s.
    pub kv: f64,
    /// Diagonal of the task weight W.
    pub task_weight: [f64; 6],
    /// Diagonal of the joint weight W_v.
    pub joint_weight: [f64; 7],
    /// Self-motion damping λ, 1/s.
    pub lambda: f64,
    /// Joint-limit avoidance as an additional task of RR.
    pub joint_limit: JointLimitTask,
    /// Adds Jᵀ F_e to the inverse dynamics.
    pub force_feed_forward: bool,
    /// Share of the modelled Coulomb and viscous friction that is fed forward on the target velocity (0 = none).
    pub friction_compensation: f64,
    /// Limit of |Xᵗ − X| per translation axis (anti-windup).
    pub max_target_error_m: f64,
    /// Limit of the rotation between Xᵗ and X (anti-windup).
    pub max_target_error_deg: f64,
    /// Tool between sensor and tool point, as the controller knows it; default: as it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<ToolModel>,
    /// Subtracts the tool's weight from the force measured.
    pub tool_compensation: bool,
    /// Subtracts the tool's inertial force as well.
    pub tool_inertia_compensation: bool,
    /// Tare over this long at the start, with the tool in free space; 0 = none.
    pub tare_ms: f64,
    /// Kind of processor card: gives `execution_us` and `entry_us` where the scenario does not state them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub processor: Option<vme::processor::Preset>,
    /// Processor time from the last read to the first D/A write; to the hand-over, where two cards share the pipeline.
    pub execution_us: f64,
    /// Processor time from the release to the first read (interrupt and context switch).
    pub entry_us: f64,
    /// The second of two cards that share the pipeline; the rack then has a second task of the control computer.
    pub second_card: SecondCard,
}

/// The card that runs inverse dynamics, safety and D/A where two share the pipeline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SecondCard {
    /// Kind of processor card, where it is another one than the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub processor: Option<vme::processor::Preset>,
    /// Processor time from the last read to the first D/A write.
    pub execution_us: f64,
    /// Processor time from the release to the first read.
    pub entry_us: f64,
}

impl Default for SecondCard {
    fn default() -> Self {
        SecondCard { processor: None, execution_us: 400.0, entry_us: 130.0 }
    }
}

impl Default for Controller {
    fn default() -> Self {
        Controller {
            scheme: Scheme::Modified,
            kp: 100.0,
            kv: 20.0,
            task_weight: [1.0; 6],
            joint_weight: [1e-3; 7],
            lambda: 2.0,
            joint_limit: JointLimitTask::default(),
            force_feed_forward: true,
            friction_compensation: 0.0,
            max_target_error_m: 0.5,
            max_target_error_deg: 45.0,
            tool: None,
            tool_compensation: true,
            tool_inertia_compensation: false,
            tare_ms: 0.0,
            processor: None,
            execution_us: 1500.0,
            entry_us: 130.0,
            second_card: SecondCard::default(),
        }
    }
}

/// Form of the AHIC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Figure 5.18: target trajectory integrated online, error reference controller.
    Modified,
    /// Figure 5.1: measured X, Ẋ in the place of Xᵗ, Ẋᵗ, no error reference controller.
    Original,
}

/// Seraji-style additional task near the joint limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointLimitTask {
    /// On or off.
    pub enabled: bool,
    /// Width of the buffer inside each limit.
    pub buffer_deg: f64,
    /// Position gain k_p, 1/s²; the velocity gain is 2√k_p.
    pub kp: f64,
    /// Greatest weight w_max.
    pub max_weight: f64,
}

impl Default for JointLimitTask {
    fn default() -> Self {
        JointLimitTask { enabled: true, buffer_deg: 10.0, kp: 100.0, max_weight: 10.0 }
    }
}
