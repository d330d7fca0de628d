//! The arm's constants as the algorithms read them.
//!
//! A fixed rotation between two joint axes is Rz(a) Rx(b) Rz(c) whatever it is. Turning each joint frame about its own
//! axis takes the outer two into the joint angles: what remains between two frames is a turn about x. Link i's inertia
//! and the origin of the next frame are given in these turned frames, the inertias two at a time. The tip is an eighth
//! joint that stays where it is.
//!
//! The inertias are the base parameters (Khalil and Dombre): a mass on a joint's axis does not feel the joint, so what of
//! a link is equal to a rod on its joint's axis is counted with the link before. Neither torques nor energy differ, and
//! of a link's ten parameters seven remain.

use crate::DOF;
use crate::bodies::Body;
use crate::inertia::Inertia;
use crate::lanes::{PAIRS, Pair, paired};
use crate::model::ArmModel;
use crate::small::{M3, Sym3, V3, v3};

/// Constants of the chain.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Chain {
    /// What the turned frames add to the joint angles (rad); the tip's is its angle.
    pub offset: [Pair; PAIRS],
    /// Axes in the base of the frame before joint 1 has turned.
    pub base: M3,
    /// Cosine and sine of the turn about x from the frame before, from joint 2 on.
    pub twist: [(f64, f64); DOF + 1],
    /// Origin in the frame before (m).
    pub p: [V3; DOF + 1],
    /// Moments of the links about their frames' origins, less what sits on the joint's axis: no mass, and nothing along z
    /// alone. The diagonal second moments are halved. Nothing in the tip's lane.
    pub links: [Body<Pair>; PAIRS],
    /// First moment of what never moves: all that sits on axis 1, base axes about the base's origin (kg m).
    pub fixed: V3,
}

/// Moments of a body's mass about the origin of the frame it is given in.
#[derive(Clone, Copy, Default)]
struct Moments {
    mass: f64,
    first: V3,
    second: Sym3,
}

impl Chain {
    pub fn of(model: &ArmModel) -> Chain {
        let mut chain = Chain::default();
        let mut bodies = [Moments::default(); DOF + 1];
        let place = |i: usize| model.joints.get(i).map_or((model.tip_r, model.tip_p), |joint| (joint.r, joint.p));
        let mut parts: [_; DOF + 1] = std::array::from_fn(|i| zxz(place(i).0));
        // the first frame is the base's and stays
        chain.base = about_z(parts[0].0) * about_x(parts[0].1);
        parts[0].0 = 0.0;
        let mut offset = [0.0; DOF + 1];
        for i in 0..=DOF {
            let (own, twist, after) = parts[i];
            let next = parts.get(i + 1).map_or(0.0, |part| part.0);
            offset[i] = after + next;
            chain.twist[i] = (libm::cos(twist), libm::sin(twist));
            chain.p[i] = about_z(-own) * place(i).1;
            if let Some(joint) = model.joints.get(i) {
                bodies[i] = Moments::of(&joint.body.turned(about_z(-next)));
            }
        }
        chain.offset = paired(&offset);
        for i in (1..DOF).rev() {
            let (cos, sin) = chain.twist[i];
            let rod = bodies[i].take_rod(chain.p[i], v3(0.0, -sin, cos));
            bodies[i - 1].add(&rod);
        }
        chain.fixed = bodies[0].take_rod(chain.p[0], chain.base.z).first;
        chain.links =
            paired(&bodies.map(|Moments { first, second, .. }| Body { first, second: second.with_halved_diagonal() }));
        chain
    }
}

impl Moments {
    fn of(body: &Inertia) -> Moments {
        Moments { mass: body.m, first: body.h, second: body.i.second_moments() }
    }

    /// Takes out what is equal to a rod on the z axis; returns the rod as seen from a frame in which that axis passes
    /// through `p` in the direction `z`.
    fn take_rod(&mut self, p: V3, z: V3) -> Moments {
        let mass = std::mem::take(&mut self.mass);
        let first = std::mem::take(&mut self.first.z);
        let second = std::mem::take(&mut self.second.zz);
        Moments {
            mass,
            first: p * mass + z * first,
            second: Sym3::outer_sum(p, p * (0.5 * mass) + z * first) + Sym3::outer_sum(z, z * (0.5 * second)),
        }
    }

    fn add(&mut self, b: &Moments) {
        self.mass += b.mass;
        self.first += b.first;
        self.second = self.second + b.second;
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
    use crate::{ArmState, JointVector, rotation};
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

    #[test]
    fn with_whichever_link_it_is_counted_all_mass_weighs_at_its_place() {
        let (model, q) = (ArmModel::rediestro(), JointVector::from([0.3, -1.0, 0.7, 1.9, -0.4, 0.8, 2.2]));
        let (mut r, mut p, mut moment) = (M3::IDENTITY, V3::ZERO, V3::ZERO);
        for (joint, q) in model.joints.iter().zip(&q) {
            p += r * joint.p;
            r = r * joint.r * about_z(*q);
            moment += p * joint.body.m + r * joint.body.h;
        }
        let energy = ArmState::new(&model, &q, &JointVector::zeros()).potential_energy();
        assert!((energy + model.gravity.dot(moment)).abs() < 1e-11, "{energy} J");
    }
}
