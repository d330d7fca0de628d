//! One posture and its speeds, with the kinematics pass shared by everything that is asked about them.
//!
//! A controller needs the tip's motion first, decides on joint accelerations from it, and then needs the torques for
//! them: through this type the joint frames are computed once.

use crate::aba::aba_in;
use crate::bodies::bodies;
use crate::crba::crba_in;
use crate::kinematics::{Motion, Pose, Screws, TipMotion, frames, jacobian_of, screws, tip_motion_of};
use crate::lanes::{from_tip, lane};
use crate::model::ArmModel;
use crate::rnea::rnea_in;
use crate::{DOF, Jacobian, JointMatrix, JointVector, Spatial};

/// An arm at angles q and speeds q̇.
#[derive(Clone, Copy, Debug)]
pub struct ArmState<'m> {
    model: &'m ArmModel,
    pose: Pose,
    screws: Screws,
    motion: Motion,
    q: JointVector,
    qd: JointVector,
}

impl<'m> ArmState<'m> {
    /// The state at joint angles `q` (rad) and speeds `qd` (rad/s).
    #[inline]
    pub fn new(model: &'m ArmModel, q: &JointVector, qd: &JointVector) -> ArmState<'m> {
        let frames = frames(model, q);
        let screws = screws(&frames);
        ArmState { model, pose: frames[DOF].pose(), screws, motion: Motion::new(&screws, qd), q: *q, qd: *qd }
    }

    /// Joint angles (rad).
    pub fn q(&self) -> &JointVector {
        &self.q
    }

    /// See [`crate::forward_kinematics`].
    pub fn pose(&self) -> Pose {
        match &self.model.slide {
            Some(slide) => slide.pose(&self.q),
            None => self.pose,
        }
    }

    /// See [`crate::jacobian()`].
    pub fn jacobian(&self) -> Jacobian {
        match &self.model.slide {
            Some(slide) => slide.jacobian(),
            None => jacobian_of(&self.screws),
        }
    }

    /// See [`crate::tip_motion`].
    pub fn tip_motion(&self) -> TipMotion {
        match &self.model.slide {
            Some(slide) => slide.tip_motion(&self.q, &self.qd),
            None => tip_motion_of(self.pose, &self.screws, &self.motion),
        }
    }

    /// See [`crate::rnea()`].
    pub fn rnea(&self, qdd: &JointVector) -> JointVector {
        match &self.model.slide {
            Some(slide) => slide.rnea(self.model.gravity, qdd),
            None => {
                let motion = self.motion.accelerated(&self.screws, qdd);
                rnea_in(self.model, &self.screws, &motion, &bodies(self.model, &self.screws))
            }
        }
    }

    /// See [`crate::crba()`].
    pub fn mass_matrix(&self) -> JointMatrix {
        self.dynamics().0
    }

    /// Mass matrix M(q) (kg m²) and bias C(q, q̇) q̇ + g(q) (Nm), which share the links' moments.
    pub fn dynamics(&self) -> (JointMatrix, JointVector) {
        match &self.model.slide {
            Some(slide) => (slide.crba(), slide.rnea(self.model.gravity, &JointVector::zeros())),
            None => {
                let bodies = bodies(self.model, &self.screws);
                (crba_in(&self.screws, &bodies), rnea_in(self.model, &self.screws, &self.motion, &bodies))
            }
        }
    }

    /// See [`crate::aba()`].
    pub fn aba(&self, tau: &JointVector, armature: &JointVector, f_tip: &Spatial) -> JointVector {
        match &self.model.slide {
            Some(slide) => slide.aba(self.model.gravity, tau, armature, f_tip),
            None => aba_in(self.model, &self.screws, &self.motion, tau, armature, f_tip),
        }
    }

    /// Potential energy of the links' weight, counted from the base's origin (J).
    pub fn potential_energy(&self) -> f64 {
        match &self.model.slide {
            Some(slide) => slide.potential_energy(self.model.gravity, &self.q),
            None => {
                let all = lane(&from_tip(&bodies(self.model, &self.screws)), 0);
                -self.model.gravity.dot(all.first + self.model.chain.fixed)
            }
        }
    }
}
