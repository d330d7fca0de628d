//! The arm's constants as the algorithms read them.
//!
//! A fixed rotation between two joint axes is Rz(a) Rx(b) Rz(c) whatever it is. Turning each joint frame about its own
//! axis takes the outer two into the joint angles: what remains between two frames is a turn about x. Link i's inertia
//! and the origin of the next frame are given in these turned frames, the inertias two at a time.

use crate::inertia::Inertia;
use crate::lanes::{PAIRS, Pair, paired};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3, v3};
use crate::{DOF, JointVector};

/// Constants of the chain.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Chain {
    /// What the turned frames add to the joint angles (rad).
    pub offset: JointVector,
    /// Axes in the base of the frame before joint 1 has turned.
    pub base: M3,
    /// Cosine and sine of the turn about x from the frame before, from joint 2 on.
    pub twist: [(f64, f64); DOF],
    /// Origin in the frame before (m).
    pub p: [V3; DOF],
    /// Tip in frame 7.
    pub tip_r: M3,
    pub tip_p: V3,
    /// Masses (kg), first moments (kg m) and second moments (kg m²) of the links about their frames' origins; nothing
    /// in the tip's lane.
    pub mass: [Pair; PAIRS],
    pub first: [V3<Pair>; PAIRS],
    pub second: [Sym3<Pair>; PAIRS],
}

impl Chain {
    pub fn of(model: &ArmModel) -> Chain {
        let mut chain = Chain::default();
        let mut bodies = [Inertia::default(); DOF + 1];
        let mut parts = model.joints.each_ref().map(|joint| zxz(joint.r));
        // the first frame is the base's and stays
        chain.base = about_z(parts[0].0) * about_x(parts[0].1);
        parts[0].0 = 0.0;
        for i in 0..DOF {
            let (own, twist, after) = parts[i];
            let next = parts.get(i + 1).map_or(0.0, |part| part.0);
            chain.offset[i] = after + next;
            chain.twist[i] = (libm::cos(twist), libm::sin(twist));
            chain.p[i] = about_z(-own) * model.joints[i].p;
            bodies[i] = model.joints[i].body.turned(about_z(-next));
        }
        (chain.tip_r, chain.tip_p) = (model.tip_r, model.tip_p);
        chain.mass = paired(&bodies.map(|body| body.m));
        chain.first = paired(&bodies.map(|body| body.h));
        chain.second = paired(&bodies.map(|body| body.i.second_moments()));
        chain
    }
}

/// Angles a, b, c with `r` = Rz(a) Rx(b) Rz(c).
fn zxz(r: M3) -> (f64, f64, f64) {
    let a = libm::atan2(r.z.x, -r.z.y);
    let b = libm::atan2((r.z.x * r.z.x + r.z.y * r.z.y).sqrt(), r.z.z);
    // where b is nearly nothing, a is anything: c makes up for it
    let rest = (about_z(a) * about_x(b)).transpose() * r;
    (a, b, libm::atan2(rest.x.y, rest.x.x))
}

fn about_z(angle: f64) -> M3 {
    let (s, c) = libm::sincos(angle);
    M3 { x: v3(c, s, 0.0), y: v3(-s, c, 0.0), z: v3(0.0, 0.0, 1.0) }
}

fn about_x(angle: f64) -> M3 {
    let (s, c) = libm::sincos(angle);
    M3 { x: v3(1.0, 0.0, 0.0), y: v3(0.0, c, s), z: v3(0.0, -s, c) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn every_rotation_is_a_turn_about_z_then_x_then_z() {
        for v in [
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 2.0],
            [1e-12, 1e-13, -1.0],
            [0.3, -2.0, 1.0],
            [3.141_592_653_589_793, 0.0, 0.0],
            [0.0, 3.141_592_653_589_793, 0.0],
        ] {
            let r = rotation::exp(&Vector3::from(v));
            let (a, b, c) = zxz(r.into());
            let back: Matrix3<f64> = (about_z(a) * about_x(b) * about_z(c)).into();
            assert!((back - r).amax() < 1e-15, "{v:?}");
        }
    }
}
