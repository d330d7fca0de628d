//! Arm, task frame, physics and surfaces.

use serde::{Deserialize, Serialize};

/// Which arm it is and where it stands at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Arm {
    /// `rediestro` (built-in, surrogate dynamics), `slide` (one prismatic axis along z, for checks), or `urdf`.
    pub robot: Robot,
    /// Mass on the slide, where `robot = "slide"`.
    pub slide_mass_kg: f64,
    /// Viscous damping of the slide's bearings, where `robot = "slide"`.
    pub slide_damping_ns_per_m: f64,
    /// URDF file, where `robot = "urdf"`; relative to the scenario file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// Base link of the URDF; default: its root.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_link: Option<String>,
    /// Tip link of the URDF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_link: Option<String>,
    /// Drive-data file; default: the built-in surrogate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drives: Option<String>,
    /// Posture near which the tool is brought to `start_position_m` and `start_rpy_deg` before the run.
    pub posture_deg: [f64; 7],
    /// Tool point at the start, in the task frame.
    pub start_position_m: [f64; 3],
    /// Tool orientation at the start, roll-pitch-yaw in the task frame.
    pub start_rpy_deg: [f64; 3],
    /// Bring the posture exactly to the start pose (default) or take `posture_deg` as it stands.
    pub solve_posture: bool,
    /// Origin of the force sensor in tip axes from the tool point; its axes are parallel to the tip's.
    pub sensor_m: [f64; 3],
    /// What the sensor carries (part of the last link's mass).
    pub tool: ToolModel,
}

/// What hangs on the force sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolModel {
    /// Mass.
    pub mass_kg: f64,
    /// Centre of mass from the sensor origin, in sensor axes.
    pub com_m: [f64; 3],
}

/// Which kinematics and dynamics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Robot {
    /// REDIESTRO: published kinematics, surrogate dynamics.
    Rediestro,
    /// One mass on a frictionless slide along z.
    Slide,
    /// A user's arm.
    Urdf,
}

impl Default for Arm {
    fn default() -> Self {
        Arm {
            robot: Robot::Rediestro,
            slide_mass_kg: 10.0,
            slide_damping_ns_per_m: 0.0,
            urdf: None,
            base_link: None,
            tip_link: None,
            drives: None,
            posture_deg: [69.2, -15.3, -72.0, -132.4, 159.8, 64.7, 104.0],
            start_position_m: [0.0; 3],
            // the yaw of `posture_deg`
            start_rpy_deg: [0.0, 0.0, -73.685],
            solve_posture: true,
            sensor_m: [0.0, 0.0, -0.1],
            tool: ToolModel { mass_kg: 0.8, com_m: [0.0, 0.0, 0.05] },
        }
    }
}

/// The task frame C in the base frame; z points into the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TaskFrame {
    /// Origin.
    pub position_m: [f64; 3],
    /// Roll-pitch-yaw.
    pub rpy_deg: [f64; 3],
}

impl Default for TaskFrame {
    /// The table-top: tool axis down.
    fn default() -> Self {
        TaskFrame { position_m: [0.6, 0.0, 0.9], rpy_deg: [180.0, 0.0, 0.0] }
    }
}

/// How the arm is integrated and what of its physics is switched on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plant {
    /// Steps a second of the integration grid.
    pub rate_hz: f64,
    /// Integration scheme.
    pub integrator: Integrator,
    /// Steps for which semi-implicit Euler holds the arm's mass matrix, bias and Jacobian.
    pub frozen_steps: u32,
    /// Flexible or rigid transmissions.
    pub joints: Joints,
    /// Factor on every friction figure of the drives (0 = none).
    pub friction_scale: f64,
    /// Kinematic error of the gears. Off by default: seen from the motor it varies the gear ratio by a tenth, which alone
    /// keeps the original scheme from regulating, with or without friction.
    pub kinematic_error: bool,
    /// Gravity in the base frame.
    pub gravity_m_per_s2: [f64; 3],
    /// Speed of any joint beyond which the run is a runaway.
    pub runaway_rad_per_s: f64,
    /// The plant's arm differs from the controller's model by this much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mismatch: Option<MismatchConfig>,
}

impl Default for Plant {
    fn default() -> Self {
        Plant {
            rate_hz: 10_000.0,
            integrator: Integrator::SemiImplicit,
            frozen_steps: 10,
            joints: Joints::Flexible,
            friction_scale: 1.0,
            kinematic_error: false,
            gravity_m_per_s2: [0.0, 0.0, -9.81],
            runaway_rad_per_s: 20.0,
            mismatch: None,
        }
    }
}

/// Integration scheme of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Semi-implicit Euler: one evaluation a step, about an arm that is renewed every `frozen_steps`.
    SemiImplicit,
    /// Classical Runge–Kutta of fourth order: four evaluations a step.
    Rk4,
}

/// Transmissions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Joints {
    /// Two inertias and a spring per joint (Spong).
    Flexible,
    /// Motor and link turn as one.
    Rigid,
}

/// Standard deviations of the plant's deviation from the controller's model, drawn from the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MismatchConfig {
    /// Joint origins, each axis.
    pub origin_m: f64,
    /// Joint origins' orientation, each axis.
    pub origin_deg: f64,
    /// Link masses, relative.
    pub mass_ratio: f64,
    /// Link inertias, relative.
    pub inertia_ratio: f64,
    /// Gravity direction.
    pub gravity_deg: f64,
}

impl Default for MismatchConfig {
    fn default() -> Self {
        MismatchConfig { origin_m: 0.0005, origin_deg: 0.05, mass_ratio: 0.05, inertia_ratio: 0.1, gravity_deg: 0.2 }
    }
}

/// A flat patch that the tool point may touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Name.
    pub name: String,
    /// A point of the plane, in the task frame.
    pub position_m: [f64; 3],
    /// Tilt of the plane about x and y of the task frame; 0: its normal is −z.
    #[serde(default)]
    pub tilt_deg: [f64; 2],
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Hunt–Crossley damping factor c in f = k x (1 + 1.5 c ẋ): damping grows with penetration; 0 = none.
    #[serde(default)]
    pub hunt_crossley_s_per_m: f64,
    /// Coulomb friction coefficient μ.
    #[serde(default)]
    pub friction: f64,
    /// Half lengths of the patch along x and y of the task frame; none = unbounded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_size_m: Option<[f64; 2]>,
}
