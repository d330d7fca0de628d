//! Whether the plant's integration can resolve the stiffness that a scenario names.
//!
//! The fastest oscillation is bounded from above at the start posture, with everything sticking and the tool in contact:
//! the sum of the bounds of each kind of spring (Weyl). In other postures the arm may be lighter: the limit leaves room.

use crate::error::Problem;
use crate::model::{Joints, Scenario};
use arm::drives::JointDrive;
use arm::{DOF, JointMatrix, JointVector};

/// Largest angle by which the fastest oscillation may turn in one step: semi-implicit Euler is stable below 2, Runge–Kutta
/// below 2.8; the rest is for postures in which the arm is lighter than at the start.
const LARGEST_PHASE_STEP: f64 = 1.0;

/// What a step of the integration meets at the start posture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// Upper bound of the natural frequencies, rad/s.
    pub fastest_rad_per_s: f64,
    /// Sum of the reciprocal masses that forces on the tool along x, y and z feel, 1/kg.
    pub tool_mobility: f64,
    /// Sum of the reciprocal inertias that moments on the tool about x, y and z feel, 1/(kg m²).
    pub turning_mobility: f64,
    /// Inertia that an engaged brake holds, per joint, kg m²: the rotor's, with rigid joints the link's too.
    pub braked_inertia: JointVector,
}

impl Scenario {
    /// What the plant's steps have to resolve. Names the key that makes it too much for `plant.rate_hz`.
    pub fn stiffness(&self) -> Result<Stiffness, Problem> {
        let arm = self.plant_arm().map_err(|message| Problem::new("arm", message))?;
        let drives = self.drives().map_err(|message| Problem::new("arm.drives", message))?;
        let q = self.initial_posture().map_err(|message| Problem::new("arm.start_position_m", message))?;
        let rotors = drives.each(|drive| drive.rotor_inertia_at_output_kg_m2);
        let singular = || Problem::new("arm.posture_deg", "the arm's mass matrix at the start posture is singular");
        let links = arm::crba(&arm, &q);
        let felt = links.try_inverse().ok_or_else(singular)?.diagonal().map(|mobility| 1.0 / mobility);
        let flexible = self.plant.joints == Joints::Flexible;
        let (moving, braked_inertia) = match flexible {
            true => (links, rotors),
            false => (links + JointMatrix::from_diagonal(&rotors), rotors + felt),
        };
        let mobility = moving.try_inverse().ok_or_else(singular)?;
        let jacobian = arm::jacobian(&arm, &q);
        let along = |k: usize| (jacobian.row(k) * mobility * jacobian.row(k).transpose())[0];
        let (linear, angular): (f64, f64) = ((0..3).map(along).sum(), (3..6).map(along).sum());

        let holding = |i: usize, drive: &JointDrive| {
            drive.sticking_stiffness_nm_per_rad(self.plant.friction_scale) + drive.brake_stiffness_nm_per_rad(braked_inertia[i])
        };
        let of_drives: f64 = if flexible {
            let on_link = |i: usize| drives.joints[i].stiffness_nm_per_rad * mobility[(i, i)];
            let on_rotor = |i: usize| (drives.joints[i].stiffness_nm_per_rad + holding(i, &drives.joints[i])) / rotors[i];
            (0..DOF).map(on_link).sum::<f64>() + (0..DOF).map(on_rotor).fold(0.0, f64::max)
        } else {
            (0..DOF).map(|i| holding(i, &drives.joints[i]) * mobility[(i, i)]).sum()
        };
        // every point of a peg may touch, at a lever from the tool point
        let on_surfaces = self.surfaces.iter().map(|surface| surface.stiffness_n_per_m * linear);
        let on_holes = self.holes.iter().map(|hole| {
            let lever = hole.peg_radius_m * hole.peg_radius_m + hole.depth_m * hole.depth_m;
            crate::Hole::POINTS as f64 * hole.stiffness_n_per_m * (linear + lever * angular)
        });
        let keyed = |list: &str, i: usize| format!("{list}.{i}.stiffness_n_per_m");
        let contacts = on_surfaces.enumerate().map(|(i, square)| (keyed("surface", i), square));
        let contacts = contacts.chain(on_holes.enumerate().map(|(i, square)| (keyed("hole", i), square)));
        let worst = contacts.max_by(|a, b| a.1.total_cmp(&b.1));

        let rate = self.plant.rate_hz;
        let resolved = rate * LARGEST_PHASE_STEP;
        let contact = worst.as_ref().map_or(0.0, |(_, square)| *square);
        let fastest = (of_drives + contact).sqrt();
        // no frequency is no answer either
        if fastest.is_nan() || fastest > resolved {
            let hertz = fastest / std::f64::consts::TAU;
            let least = fastest / LARGEST_PHASE_STEP;
            return Err(match worst {
                Some((key, _)) if of_drives.sqrt() <= resolved => Problem::new(
                    key,
                    format!("with this stiffness the tool swings at up to {hertz:.0} Hz; expected a softer one, or plant.rate_hz of at least {least:.0} (it is {rate})"),
                ),
                _ => Problem::new(
                    "plant.rate_hz",
                    format!("is {rate}, expected at least {least:.0}: drives, brakes and surfaces of this stiffness swing at up to {hertz:.0} Hz"),
                ),
            });
        }
        Ok(Stiffness { fastest_rad_per_s: fastest, tool_mobility: linear, turning_mobility: angular, braked_inertia })
    }
}

#[cfg(test)]
mod tests {
    fn key_refused(settings: &[&str]) -> Option<String> {
        let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        match crate::load("table-5-3", &settings) {
            Ok(_) => None,
            Err(crate::ScenarioError::Text { key, .. } | crate::ScenarioError::Override { key, .. }) => Some(key),
            Err(other) => panic!("{other}"),
        }
    }

    #[test]
    fn steps_too_coarse_for_the_drives_are_refused_with_the_rate() {
        let settings = ["plant.rate_hz=1000.0", "plant.friction_scale=10.0"];
        assert_eq!(key_refused(&settings).as_deref(), Some("plant.rate_hz"));
    }

    #[test]
    fn a_surface_too_stiff_for_the_steps_is_refused_with_its_stiffness() {
        let slide = ["arm.robot=slide", "arm.slide_mass_kg=0.2", "plant.joints=rigid", "plant.rate_hz=2000.0"];
        let with = |stiffness: &'static str| {
            let mut settings = slide.to_vec();
            settings.extend(["segment.free.position_m=[0.0, 0.0, 0.0]", stiffness]);
            key_refused(&settings)
        };
        assert_eq!(with("surface.0.stiffness_n_per_m=1e6").as_deref(), Some("surface.0.stiffness_n_per_m"));
        assert_eq!(with("surface.0.stiffness_n_per_m=1e5"), None);
    }

    #[test]
    fn every_stiffness_that_may_be_named_is_resolved_at_the_default_rate() {
        for joints in ["flexible", "rigid"] {
            let joints = format!("plant.joints={joints}");
            let stiffest = ["surface.0.stiffness_n_per_m=1e6", "plant.friction_scale=10.0", &joints];
            assert_eq!(key_refused(&stiffest), None);
        }
    }
}
