//! Data of the joints' drives: gears, rotors, friction, amplifiers, brakes, encoders. Read from TOML, checked, constant.
//!
//! The structure is Spong's flexible joint: rotor and link are two inertias with a spring and damper between them, and
//! friction acts on the rotor. All quantities are at the joint's output side (motor quantities times or over the gear
//! ratio N) unless a name says otherwise. REDIESTRO's figures are surrogates; the file says so. A value that no drive can
//! have is refused with the joint, the key, and what was expected.

use crate::{DOF, JointVector};
use serde::Deserialize;

/// Harmonics of the motor angle that the gear's kinematic error has.
pub const KINEMATIC_ERROR_HARMONICS: [f64; 3] = [1.0, 2.0, 4.0];

/// Drives of all joints, joint 1 first.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveData {
    /// One drive per joint.
    pub joints: [JointDrive; DOF],
}

/// Drive of one joint.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointDrive {
    /// Name of the joint.
    pub name: String,
    /// Motor turns per joint turn, N.
    pub gear_ratio: f64,
    /// N² J_m: rotor inertia seen at the output (kg m²).
    pub rotor_inertia_at_output_kg_m2: f64,
    /// K: spring between rotor and link (Nm/rad).
    pub stiffness_nm_per_rad: f64,
    /// Damping ratio of that spring against the rotor inertia; see [`JointDrive::damping_nms_per_rad`].
    pub damping_ratio: f64,
    /// Coulomb friction without load (Nm).
    pub coulomb_nm: f64,
    /// Viscous friction (Nm s/rad).
    pub viscous_nms_per_rad: f64,
    /// Breakaway torque over Coulomb friction, the load's part included.
    pub breakaway_ratio: f64,
    /// Speed at which the Stribeck effect has decayed by the factor e (rad/s).
    pub stribeck_speed_rad_per_s: f64,
    /// Coulomb friction per spring torque (Nm/Nm).
    pub load_part: f64,
    /// Deflection at which sticking gives way to sliding (rad).
    pub presliding_rad: f64,
    /// Amplitudes of the gear's kinematic error at the harmonics of [`KINEMATIC_ERROR_HARMONICS`] (rad).
    pub kinematic_error_rad: [f64; 3],
    /// Phases of the same (rad).
    pub kinematic_error_phase_rad: [f64; 3],
    /// Largest torque, where the amplifier saturates (Nm).
    pub torque_limit_nm: f64,
    /// Amplifier and motor: torque per volt of D/A output (Nm/V).
    pub amplifier_nm_per_v: f64,
    /// Torque that the engaged brake holds (Nm).
    pub brake_nm: f64,
    /// Lines of the encoder on the motor shaft; four counts each.
    pub encoder_lines: u32,
}

/// Why drive data was refused.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
pub enum DriveError {
    /// Not TOML, or a key that is unknown, missing or of the wrong type.
    #[error("drive data at `{path}`: {message}")]
    Format {
        /// Key path, such as `joint[2].coulomb_nm` (joints from 0).
        path: String,
        /// The parser's words.
        message: String,
    },
    /// Not one `[[joint]]` per joint.
    #[error("drive data has {found} [[joint]] tables, expected 7")]
    JointCount {
        /// How many there are.
        found: usize,
    },
    /// A value outside its range.
    #[error("drive data of '{joint}': {key} = {value}, expected {expected}")]
    Value {
        /// Name of the joint.
        joint: String,
        /// The key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
}

impl DriveData {
    /// Drives of the built-in REDIESTRO (surrogate).
    pub fn rediestro() -> DriveData {
        DriveData::from_toml(DriveData::rediestro_toml()).expect("the built-in drive data is tested")
    }

    /// Text of the built-in drive data.
    pub fn rediestro_toml() -> &'static str {
        include_str!("robots/rediestro.drives.toml")
    }

    /// Reads seven `[[joint]]` tables with the keys of [`JointDrive`], all of them required.
    pub fn from_toml(text: &str) -> Result<DriveData, DriveError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            joint: Vec<JointDrive>,
        }
        let format = |path: String, message: String| DriveError::Format { path, message };
        let toml = toml::Deserializer::parse(text).map_err(|e| format("the file".into(), e.to_string()))?;
        let file: File =
            serde_path_to_error::deserialize(toml).map_err(|e| format(e.path().to_string(), e.inner().to_string()))?;
        file.joint.iter().try_for_each(JointDrive::check)?;
        let found = file.joint.len();
        let joints = file.joint.try_into().map_err(|_| DriveError::JointCount { found })?;
        Ok(DriveData { joints })
    }

    /// One quantity of every joint.
    pub fn each(&self, quantity: impl Fn(&JointDrive) -> f64) -> JointVector {
        JointVector::from_fn(|i, _| quantity(&self.joints[i]))
    }

    /// The same drives with all friction (Coulomb, viscous, the load's part) times `factor`.
    pub fn with_friction(mut self, factor: f64) -> DriveData {
        for joint in &mut self.joints {
            joint.coulomb_nm *= factor;
            joint.viscous_nms_per_rad *= factor;
            joint.load_part *= factor;
        }
        self
    }
}

/// Natural frequency of a joint held by its brake, rad/s: the brake's disc and hub are no rigid body either.
const BRAKE_FREQUENCY: f64 = 300.0;

impl JointDrive {
    /// D = 2 ζ √(K N² J_m): damper beside the spring (Nm s/rad).
    pub fn damping_nms_per_rad(&self) -> f64 {
        2.0 * self.damping_ratio * (self.stiffness_nm_per_rad * self.rotor_inertia_at_output_kg_m2).sqrt()
    }

    /// Coulomb friction while the spring carries `load_nm` (Nm).
    pub fn coulomb_at_load_nm(&self, load_nm: f64) -> f64 {
        self.coulomb_nm + self.load_part * load_nm.abs()
    }

    /// Torque at which a resting joint starts to slide while the spring carries `load_nm` (Nm).
    pub fn breakaway_at_load_nm(&self, load_nm: f64) -> f64 {
        self.breakaway_ratio * self.coulomb_at_load_nm(load_nm)
    }

    /// Stiffness of the sticking joint, its friction times `friction_scale` (Nm/rad): an unloaded joint yields after the
    /// presliding deflection; under load it yields later.
    pub fn sticking_stiffness_nm_per_rad(&self, friction_scale: f64) -> f64 {
        // a drive whose friction is the load's alone has its bristle from the load at the torque limit
        let nominal = match self.coulomb_nm > 0.0 {
            true => self.breakaway_at_load_nm(0.0),
            false => self.breakaway_at_load_nm(self.torque_limit_nm),
        };
        friction_scale * nominal / self.presliding_rad
    }

    /// Stiffness of the engaged brake that holds an inertia at the output (kg m²), Nm/rad.
    pub fn brake_stiffness_nm_per_rad(&self, held_kg_m2: f64) -> f64 {
        held_kg_m2 * BRAKE_FREQUENCY * BRAKE_FREQUENCY
    }

    /// Kinematic error of the gear at the output (rad) for a motor angle in rad.
    pub fn kinematic_error(&self, motor_rad: f64) -> f64 {
        let waves = KINEMATIC_ERROR_HARMONICS.iter().zip(&self.kinematic_error_phase_rad);
        let mut error = 0.0;
        for (amplitude, (harmonic, phase)) in self.kinematic_error_rad.iter().zip(waves) {
            error += amplitude * libm::sin(harmonic * motor_rad + phase);
        }
        error
    }

    /// Encoder counts per radian of the joint, four per line of the motor's encoder.
    pub fn counts_per_rad(&self) -> f64 {
        4.0 * f64::from(self.encoder_lines) * self.gear_ratio / std::f64::consts::TAU
    }

    fn check(&self) -> Result<(), DriveError> {
        let positive = |key, value| self.require(key, value, value > 0.0, "a number above 0");
        let not_negative = |key, value| self.require(key, value, value >= 0.0, "a number of at least 0");
        positive("gear_ratio", self.gear_ratio)?;
        positive("rotor_inertia_at_output_kg_m2", self.rotor_inertia_at_output_kg_m2)?;
        positive("stiffness_nm_per_rad", self.stiffness_nm_per_rad)?;
        not_negative("damping_ratio", self.damping_ratio)?;
        not_negative("coulomb_nm", self.coulomb_nm)?;
        not_negative("viscous_nms_per_rad", self.viscous_nms_per_rad)?;
        let ratio = self.breakaway_ratio;
        self.require("breakaway_ratio", ratio, ratio >= 1.0, "a number of at least 1")?;
        positive("stribeck_speed_rad_per_s", self.stribeck_speed_rad_per_s)?;
        // above 1 a loaded joint could not be moved at all
        let load = self.load_part;
        self.require("load_part", load, (0.0..1.0).contains(&load), "a number from 0 to below 1")?;
        positive("presliding_rad", self.presliding_rad)?;
        for amplitude in self.kinematic_error_rad {
            not_negative("kinematic_error_rad", amplitude)?;
        }
        for phase in self.kinematic_error_phase_rad {
            self.require("kinematic_error_phase_rad", phase, true, "a finite number")?;
        }
        positive("torque_limit_nm", self.torque_limit_nm)?;
        positive("amplifier_nm_per_v", self.amplifier_nm_per_v)?;
        not_negative("brake_nm", self.brake_nm)?;
        positive("encoder_lines", f64::from(self.encoder_lines))
    }

    fn require(&self, key: &'static str, value: f64, holds: bool, expected: &'static str) -> Result<(), DriveError> {
        if holds && value.is_finite() {
            return Ok(());
        }
        Err(DriveError::Value { joint: self.name.clone(), key, value, expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArmModel, JointVector, gravity_torque};

    #[test]
    fn ten_volts_ask_for_the_torque_limit_and_the_brake_holds_more_than_the_drive_gives() {
        for joint in DriveData::rediestro().joints {
            assert_eq!(joint.amplifier_nm_per_v * 10.0, joint.torque_limit_nm, "{}", joint.name);
            assert!(joint.brake_nm > joint.torque_limit_nm, "{}", joint.name);
        }
    }

    #[test]
    fn drives_and_urdf_agree_on_names_and_torque_limits() {
        let (model, drives) = (ArmModel::rediestro(), DriveData::rediestro());
        for (i, joint) in drives.joints.iter().enumerate() {
            assert_eq!(joint.name, model.joint_names()[i]);
            assert_eq!(joint.torque_limit_nm, model.effort_limits()[i]);
        }
    }

    #[test]
    fn slow_friction_reaches_30_percent_of_the_gravity_torque_in_some_posture_but_no_more_at_the_table_top() {
        let (model, drives) = (ArmModel::rediestro(), DriveData::rediestro());
        let q = JointVector::from([69.2, -15.3, -72.0, -132.4, 159.8, 64.7, 104.0].map(f64::to_radians));
        let g = gravity_torque(&model, &q);
        let shares: Vec<f64> = (0..DOF)
            .filter(|&i| g[i].abs() >= 15.0)
            .map(|i| drives.joints[i].coulomb_at_load_nm(g[i]) / g[i].abs())
            .collect();
        let (least, most) = shares.iter().fold((1.0_f64, 0.0_f64), |(a, b), &s| (a.min(s), b.max(s)));
        assert_eq!(shares.len(), 4, "joints 2 to 5 carry the arm");
        assert!((0.12..0.14).contains(&least) && (0.28..0.32).contains(&most), "{shares:?}");
    }

    #[test]
    fn kinematic_error_amplitudes_lie_between_a_fifth_of_a_milliradian_and_a_milliradian() {
        for joint in DriveData::rediestro().joints {
            let peak = (0..6283).map(|k| joint.kinematic_error(f64::from(k) * 1e-3).abs()).fold(0.0, f64::max);
            assert!((2e-4..1e-3).contains(&peak), "{}: {peak}", joint.name);
        }
    }

    #[test]
    fn a_bad_value_is_refused_with_joint_key_and_expectation() {
        let text = |from: &str, to: &str| DriveData::rediestro_toml().replacen(from, to, 1);
        let error = DriveData::from_toml(&text("coulomb_nm = 4.0", "coulomb_nm = -4.0")).unwrap_err();
        assert_eq!(error.to_string(), "drive data of 'joint_3': coulomb_nm = -4, expected a number of at least 0");
        let error = DriveData::from_toml(&text("stiffness_nm_per_rad = 20000.0", "stiffness_nm_per_rad = nan"));
        assert!(error.unwrap_err().to_string().contains("'joint_4': stiffness_nm_per_rad = NaN"));
        let error = DriveData::from_toml(&text("gear_ratio = 120.0", "gear_ratios = 120.0")).unwrap_err().to_string();
        assert!(error.contains("joint[3]") && error.contains("gear_ratios"), "{error}");
        let error = DriveData::from_toml(&text("brake_nm = 350.0\n", "")).unwrap_err().to_string();
        assert!(error.contains("joint[0]") && error.contains("brake_nm"), "{error}");
        let seven = DriveData::rediestro_toml();
        let last = seven.rfind("[[joint]]").expect("joints");
        assert_eq!(DriveData::from_toml(&seven[..last]), Err(DriveError::JointCount { found: 6 }));
        assert!(matches!(DriveData::from_toml("\u{1}noise"), Err(DriveError::Format { .. })));
    }
}
