//! One posture and its speeds, with the kinematics pass shared by everything that is asked about them.
//!
//! A controller needs the tip's motion first, decides on joint accelerations from it, and then needs the torques for
//! them: through this type the joint frames are computed once.

use crate::aba::aba_in;
use crate::crba::crba_in;
use crate::kinematics::{Frames, Pose, TipMotion, tip_motion_of};
use crate::model::ArmModel;
use crate::rnea::rnea_in;
use crate::{Jacobian, JointMatrix, JointVector, Spatial};

/// An arm at angles q and speeds q̇.
#[derive(Clone, Copy, Debug)]
pub struct ArmState<'m> {
    model: &'m ArmModel,
    frames: Frames,
    q: JointVector,
    qd: JointVector,
}

impl<'m> ArmState<'m> {
    /// The state at joint angles `q` (rad) and speeds `qd` (rad/s).
    #[inline]
    pub fn new(model: &'m ArmModel, q: &JointVector, qd: &JointVector) -> ArmState<'m> {
        ArmState {
            model,
            frames: Frames::new(model, q),
            q: *q,
            qd: *qd,
        }
    }

    /// See [`crate::forward_kinematics`].
    pub fn pose(&self) -> Pose {
        match &self.model.slide {
            Some(slide) => slide.pose(&self.q),
            None => self.frames.pose(),
        }
    }

    /// See [`crate::jacobian()`].
    pub fn jacobian(&self) -> Jacobian {
        match &self.model.slide {
            Some(slide) => slide.jacobian(),
            None => self.frames.jacobian(),
        }
    }

    /// See [`crate::tip_motion`].
    pub fn tip_motion(&self) -> TipMotion {
        match &self.model.slide {
            Some(slide) => slide.tip_motion(&self.q, &self.qd),
            None => tip_motion_of(&self.frames, &self.qd),
        }
    }

    /// See [`crate::rnea()`].
    pub fn rnea(&self, qdd: &JointVector) -> JointVector {
        match &self.model.slide {
            Some(slide) => slide.rnea(self.model.gravity, qdd),
            None => rnea_in(self.model, &self.frames, &self.qd, qdd),
        }
    }

    /// See [`crate::bias`].
    pub fn bias(&self) -> JointVector {
        self.rnea(&JointVector::zeros())
    }

    /// See [`crate::crba()`].
    pub fn mass_matrix(&self) -> JointMatrix {
        match &self.model.slide {
            Some(slide) => slide.crba(),
            None => crba_in(self.model, &self.frames),
        }
    }

    /// See [`crate::aba()`].
    pub fn aba(&self, tau: &JointVector, armature: &JointVector, f_tip: &Spatial) -> JointVector {
        match &self.model.slide {
            Some(slide) => slide.aba(self.model.gravity, tau, armature, f_tip),
            None => aba_in(self.model, &self.frames, &self.qd, tau, armature, f_tip),
        }
    }
}
