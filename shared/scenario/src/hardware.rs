//! The objects that a scenario describes: arms, drives, frames, times.

use crate::file::read_text;
use crate::model::{Robot, Scenario};
use arm::drives::DriveData;
use arm::{ArmModel, JointVector, Mismatch, Pose, rotation};
use nalgebra::{Matrix3, Vector3};

/// A URDF of more bytes is not read.
pub const URDF_LIMIT: u64 = 32 << 20;
/// Neither is a file of drive data.
const DRIVES_LIMIT: u64 = 1 << 20;

impl Scenario {
    /// The arm as the controller knows it. The message names the file and what is wrong with it.
    pub fn controller_arm(&self) -> Result<ArmModel, String> {
        let gravity = Vector3::from(self.plant.gravity_m_per_s2);
        let arm = match self.arm.robot {
            Robot::Rediestro => ArmModel::rediestro(),
            Robot::Slide => ArmModel::slide(self.arm.slide_mass_kg),
            Robot::Urdf => {
                let (Some(file), Some(tip)) = (&self.arm.urdf, &self.arm.tip_link) else {
                    return Err("robot = \"urdf\" needs the keys arm.urdf and arm.tip_link".into());
                };
                let xml = read_text(file, URDF_LIMIT).map_err(|error| format!("{file}: {error}"))?;
                ArmModel::from_urdf(&xml, self.arm.base_link.as_deref(), tip)
                    .map_err(|error| format!("{file}: {error}"))?
            }
        };
        Ok(if arm.is_slide() { arm } else { arm.with_gravity(gravity) })
    }

    /// The arm as it is: the controller's, or one that differs from it by the scenario's mismatch.
    pub fn plant_arm(&self) -> Result<ArmModel, String> {
        let arm = self.controller_arm()?;
        Ok(match &self.plant.mismatch {
            None => arm,
            Some(config) => arm.perturbed(
                &Mismatch {
                    origin_m: config.origin_m,
                    orientation_rad: config.origin_deg.to_radians(),
                    mass_ratio: config.mass_ratio,
                    inertia_ratio: config.inertia_ratio,
                    gravity_direction_rad: config.gravity_deg.to_radians(),
                    ..Mismatch::default()
                },
                self.seed,
            ),
        })
    }

    /// Gears, friction, amplifiers, brakes. The message names the file, the joint and the key.
    pub fn drives(&self) -> Result<DriveData, String> {
        match &self.arm.drives {
            None if self.arm.robot == Robot::Slide => {
                let text = include_str!("../../scenarios/slide.drives.toml");
                let mut drives = DriveData::from_toml(text).map_err(|error| error.to_string())?;
                drives.joints[0].viscous_nms_per_rad = self.arm.slide_damping_ns_per_m;
                Ok(drives)
            }
            None => Ok(DriveData::rediestro()),
            Some(file) => {
                let text = read_text(file, DRIVES_LIMIT).map_err(|error| format!("{file}: {error}"))?;
                DriveData::from_toml(&text).map_err(|error| format!("{file}: {error}"))
            }
        }
    }

    /// The task frame C in the base frame.
    pub fn task_frame(&self) -> Pose {
        Pose { p: Vector3::from(self.task_frame.position_m), r: rpy_deg(self.task_frame.rpy_deg) }
    }

    /// Length of the run, ns.
    pub fn duration_ns(&self) -> vme::Ns {
        nanoseconds(self.duration())
    }

    /// Posture at the start, rad: `posture_deg`, brought to the start pose unless the scenario says not to.
    pub fn initial_posture(&self) -> Result<JointVector, String> {
        let posture = JointVector::from(self.arm.posture_deg.map(f64::to_radians));
        let arm = self.controller_arm()?;
        if !self.arm.solve_posture || arm.is_slide() {
            let mut posture = posture;
            if arm.is_slide() {
                posture = JointVector::zeros();
                posture[0] = self.base_pose(self.arm.start_position_m, self.arm.start_rpy_deg).p.z;
            }
            return Ok(posture);
        }
        let start = self.base_pose(self.arm.start_position_m, self.arm.start_rpy_deg);
        crate::inverse_kinematics(&arm, &start, &posture).map_err(|error| error.to_string())
    }

    /// A pose of the task frame in the base frame.
    pub fn base_pose(&self, position_m: [f64; 3], rpy: [f64; 3]) -> Pose {
        let frame = self.task_frame();
        Pose { p: frame.p + frame.r * Vector3::from(position_m), r: frame.r * rpy_deg(rpy) }
    }

    /// Base address of a card of the rack.
    pub fn card_base(&self, name: &str) -> Option<u32> {
        self.rack.slaves.iter().find(|slave| slave.name == name).map(|slave| slave.base)
    }

    /// The value of a key (as overrides name it), where the scenario has one.
    pub fn value(&self, key: &str) -> Option<toml::Value> {
        let tree = toml::Table::try_from(self).ok()?;
        crate::overrides::get(&tree, key).cloned()
    }

    /// Task of the second processor card, where two share the pipeline: inverse dynamics, safety and D/A.
    pub fn second_control_task(&self) -> Option<u16> {
        let mut tasks = (0..).zip(&self.rack.tasks).filter(|(_, task)| task.board == "control_computer");
        tasks.nth(1).map(|(i, _)| i)
    }

    /// Index of the board's first task.
    pub fn task_of(&self, board: &str) -> Option<u16> {
        self.rack.tasks.iter().position(|task| task.board == board).map(|i| i as u16)
    }
}

/// Rotation of roll-pitch-yaw in degrees.
pub fn rpy_deg(rpy: [f64; 3]) -> Matrix3<f64> {
    let [roll, pitch, yaw] = rpy.map(f64::to_radians);
    rotation::from_rpy(roll, pitch, yaw)
}

/// Seconds as integer nanoseconds, rounded.
pub fn nanoseconds(seconds: f64) -> vme::Ns {
    (seconds * 1e9).round() as vme::Ns
}

impl crate::Hole {
    /// Axis of the hole in the task frame, into it: z tilted about x, then y.
    pub fn axis(&self) -> Vector3<f64> {
        self.axes() * Vector3::z()
    }

    /// Axes of the hole in the task frame.
    pub fn axes(&self) -> Matrix3<f64> {
        rpy_deg([self.tilt_deg[0], self.tilt_deg[1], 0.0])
    }

    /// How deep a point of the task frame lies under the mouth's plane, m.
    pub fn depth_of(&self, position_m: [f64; 3]) -> f64 {
        self.axis().dot(&(Vector3::from(position_m) - Vector3::from(self.position_m)))
    }
}

impl crate::Surface {
    /// Outward normal of the plane in the task frame: −z tilted about x, then y.
    pub fn normal(&self) -> Vector3<f64> {
        rpy_deg([self.tilt_deg[0], self.tilt_deg[1], 0.0]) * -Vector3::z()
    }
}
