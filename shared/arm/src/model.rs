//! Constant data of an arm: where the joints sit, what the links weigh, what they are allowed to do.
//!
//! Joint frame i has its origin on joint axis i and its z along that axis, whatever the URDF's axis is: so every joint
//! turns about z and the algorithms need no case distinction. Link i is everything that moves rigidly with joint i. What
//! the algorithms read is derived from it (`chain`).

use crate::chain::Chain;
use crate::inertia::{BodyInertia, Inertia};
use crate::slide::Slide;
use crate::small::{M3, V3, v3};
use crate::{DOF, JointVector, Pose, STANDARD_GRAVITY, UrdfError};
use nalgebra::{Matrix3, Vector3};
use std::sync::LazyLock;

/// One joint and the link it moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Joint {
    /// Axes of this joint's frame at q = 0, in the frame of the joint before it (base: base link).
    pub r: M3,
    /// Origin of this joint's frame, in the frame of the joint before it (m).
    pub p: V3,
    /// Link's inertia in this joint's frame.
    pub body: Inertia,
}

/// Constant data of a seven-joint arm. Cheap to clone, never changed in place.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmModel {
    pub(crate) name: String,
    pub(crate) joint_names: [String; DOF],
    pub(crate) joints: [Joint; DOF],
    /// Tip frame in the frame of joint 7.
    pub(crate) tip_r: M3,
    pub(crate) tip_p: V3,
    pub(crate) gravity: V3,
    pub(crate) lower: JointVector,
    pub(crate) upper: JointVector,
    pub(crate) speed: JointVector,
    pub(crate) effort: JointVector,
    /// Joints off the chain that were fixed at zero, by name.
    pub(crate) held: Vec<String>,
    /// Set for the one-axis test arm, which replaces the chain.
    pub(crate) slide: Option<Slide>,
    /// The same constants as the algorithms read them: made anew by [`ArmModel::settled`].
    pub(crate) chain: Chain,
}

/// A tool bolted to the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the tip frame (m).
    pub com: Vector3<f64>,
    /// Inertia tensor about the centre of mass, axes of the tip frame (kg m²).
    pub inertia: Matrix3<f64>,
}

impl ArmModel {
    /// The built-in REDIESTRO: kinematics from its Denavit–Hartenberg table, everything else a surrogate (the URDF says so).
    pub fn rediestro() -> ArmModel {
        static MODEL: LazyLock<ArmModel> = LazyLock::new(|| {
            ArmModel::from_urdf(ArmModel::rediestro_urdf(), None, "tool").expect("the built-in URDF is tested")
        });
        MODEL.clone()
    }

    /// Text of the built-in URDF.
    pub fn rediestro_urdf() -> &'static str {
        include_str!("robots/rediestro.urdf")
    }

    /// Reads a URDF; the seven revolute joints from `base` (default: the root link) to `tip` become the arm, gravity
    /// 9.81 m/s² along −z of the base. Joints off that chain are held at zero, their links' inertia included.
    pub fn from_urdf(xml: &str, base: Option<&str>, tip: &str) -> Result<ArmModel, UrdfError> {
        crate::urdf::read(xml, base, tip)
    }

    /// A one-axis test arm: joint 1 is a frictionless slide along base z that carries `mass_kg` (position in m, force in
    /// N), its tip at (0, 0, q₁) with the axes of the base. Joints 2 to 7 turn unit inertias that move nothing. No gravity.
    pub fn slide(mass_kg: f64) -> ArmModel {
        let limit = |slide: f64, rest: f64| JointVector::from_fn(|i, _| if i == 0 { slide } else { rest });
        let joint = Joint { r: M3::IDENTITY, p: V3::ZERO, body: Inertia::default() };
        ArmModel {
            name: "slide".into(),
            joint_names: std::array::from_fn(|i| if i == 0 { "slide".into() } else { format!("idle_{}", i + 1) }),
            joints: std::array::from_fn(|_| joint.clone()),
            tip_r: M3::IDENTITY,
            tip_p: V3::ZERO,
            gravity: V3::ZERO,
            lower: limit(-10.0, -std::f64::consts::PI),
            upper: limit(10.0, std::f64::consts::PI),
            speed: limit(10.0, 10.0),
            effort: limit(1e4, 1e3),
            held: Vec::new(),
            slide: Some(Slide { mass: mass_kg, r: M3::IDENTITY, p: V3::ZERO }),
            chain: Chain::default(),
        }
    }

    /// After any change of joints, links or tip.
    pub(crate) fn settled(mut self) -> ArmModel {
        self.chain = Chain::of(&self);
        self
    }

    /// Name given in the URDF.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Joint names, base first.
    pub fn joint_names(&self) -> &[String; DOF] {
        &self.joint_names
    }

    /// Lower joint limits (rad); −∞ for a continuous joint.
    pub fn lower_limits(&self) -> &JointVector {
        &self.lower
    }

    /// Upper joint limits (rad); ∞ for a continuous joint.
    pub fn upper_limits(&self) -> &JointVector {
        &self.upper
    }

    /// Joint speed limits (rad/s).
    pub fn speed_limits(&self) -> &JointVector {
        &self.speed
    }

    /// Joint torque limits (Nm).
    pub fn effort_limits(&self) -> &JointVector {
        &self.effort
    }

    /// Gravity in base axes (m/s²).
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity.into()
    }

    /// Masses of the moving links (kg), joint 1's first.
    pub fn link_masses(&self) -> JointVector {
        match &self.slide {
            Some(slide) => JointVector::from_fn(|i, _| if i == 0 { slide.mass } else { 0.0 }),
            None => JointVector::from_fn(|i, _| self.joints[i].body.m),
        }
    }

    /// Inertia of the link that joint `i` (from 0) moves, in that joint's frame (z along the joint axis).
    pub fn link_inertia(&self, i: usize) -> BodyInertia {
        (&self.joints[i].body).into()
    }

    /// Names of joints off the chain that are held at zero.
    pub fn held_joints(&self) -> &[String] {
        &self.held
    }

    /// Whether this is the one-axis test arm of [`ArmModel::slide`].
    pub fn is_slide(&self) -> bool {
        self.slide.is_some()
    }

    /// The same arm under another gravity vector (m/s², base axes).
    pub fn with_gravity(mut self, gravity: Vector3<f64>) -> ArmModel {
        self.gravity = gravity.into();
        self
    }

    /// The same arm seen from another frame, which takes the place of the base: `base` in the present base.
    pub fn seen_from(mut self, base: &Pose) -> ArmModel {
        let turn = M3::from(base.r).transpose();
        let place = |p: V3| turn * (p - V3::from(base.p));
        self.joints[0].r = turn * self.joints[0].r;
        self.joints[0].p = place(self.joints[0].p);
        if let Some(slide) = &mut self.slide {
            (slide.r, slide.p) = (turn * slide.r, place(slide.p));
        }
        self.gravity = turn * self.gravity;
        self.settled()
    }

    /// The same arm with a tool bolted to the tip; the tip frame stays where it is.
    pub fn with_tool(mut self, tool: &Tool) -> ArmModel {
        match &mut self.slide {
            Some(slide) => slide.mass += tool.mass,
            None => {
                let body = Inertia::at_com(tool.mass, tool.com.into(), tool.inertia.into());
                self.joints[6].body = self.joints[6].body.plus(&body.moved(self.tip_r, self.tip_p));
            }
        }
        self.settled()
    }

    /// The same arm with the tip frame moved: axes `r` and origin `p` (m) in the present tip frame.
    pub fn with_tip(mut self, r: Matrix3<f64>, p: Vector3<f64>) -> ArmModel {
        self.tip_p += self.tip_r * V3::from(p);
        self.tip_r = self.tip_r * M3::from(r);
        self.settled()
    }
}

pub(crate) const DEFAULT_GRAVITY: V3 = v3(0.0, 0.0, -STANDARD_GRAVITY);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Spatial, rnea, rotation, tip_motion};

    #[test]
    fn seen_from_another_frame_an_arm_does_the_same_in_other_axes() {
        let base = Pose { p: Vector3::new(0.6, -0.1, 0.9), r: rotation::from_rpy(3.0, 0.2, -0.4) };
        let to = base.r.transpose();
        let both = |s: &Spatial| {
            let (linear, angular) = (to * s.fixed_rows::<3>(0), to * s.fixed_rows::<3>(3));
            Spatial::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        };
        let q = JointVector::from([0.3, -1.0, 0.7, 1.9, -0.4, 0.8, 2.2]);
        let (qd, qdd) = (q * -0.7, JointVector::repeat(1.5));
        for arm in [ArmModel::rediestro(), ArmModel::slide(3.0).with_gravity(Vector3::new(0.0, 1.0, -9.0))] {
            let seen = arm.clone().seen_from(&base);
            let (there, here) = (tip_motion(&arm, &q, &qd), tip_motion(&seen, &q, &qd));
            assert!((here.pose.p - to * (there.pose.p - base.p)).amax() < 1e-14);
            assert!((here.pose.r - to * there.pose.r).amax() < 1e-14);
            assert!((here.twist - both(&there.twist)).amax() < 1e-14);
            assert!((here.jdot_qd - both(&there.jdot_qd)).amax() < 1e-13);
            for i in 0..DOF {
                assert!((here.jacobian.column(i) - both(&there.jacobian.column(i).into())).amax() < 1e-14);
            }
            assert!((rnea(&seen, &q, &qd, &qdd) - rnea(&arm, &q, &qd, &qdd)).amax() < 1e-11);
        }
    }
}
