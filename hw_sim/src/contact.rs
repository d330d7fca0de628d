//! What the tool touches. A contact object turns the tool's pose and twist into the wrench that the tool exerts on it.
//!
//! Every point that can touch has a tangential bristle ([`crate::state::State::contact`]): Coulomb friction with true
//! stick–slip. Its deflection is cut to what μN can hold before it is used, so a wrench is a function of the state alone.

mod peg;
mod plane;

pub use peg::PegInHole;
pub use plane::Plane;

use arm::{Pose, Spatial};
use nalgebra::Vector3;

/// An object that the tool touches.
#[derive(Clone, Debug, PartialEq)]
pub enum Contact {
    /// A flat patch under the tool point.
    Plane(Plane),
    /// A peg on the tool and its hole.
    Peg(PegInHole),
}

/// Contact of the tool with its surroundings at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// What the tool exerts on the environment, base axes, about the tool point, N and Nm.
    pub wrench: Spatial,
    /// Greatest penetration, m; negative: least gap; −∞ with nothing to touch.
    pub penetration: f64,
    /// Speed into the surface at that point, m/s.
    pub normal_speed: f64,
}

impl Touch {
    /// Nothing there.
    pub const NONE: Touch = Touch {
        wrench: Spatial::from_array_storage(nalgebra::ArrayStorage([[0.0; 6]])),
        penetration: f64::NEG_INFINITY,
        normal_speed: 0.0,
    };

    fn add_point(&mut self, force: Vector3<f64>, lever: Vector3<f64>) {
        let moment = lever.cross(&force);
        for k in 0..3 {
            self.wrench[k] += force[k];
            self.wrench[k + 3] += moment[k];
        }
    }

    fn deepen(&mut self, penetration: f64, normal_speed: f64) {
        if penetration > self.penetration {
            (self.penetration, self.normal_speed) = (penetration, normal_speed);
        }
    }
}

impl Contact {
    /// Number of points that can touch.
    pub fn points(&self) -> usize {
        match self {
            Contact::Plane(_) => 1,
            Contact::Peg(_) => peg::POINTS,
        }
    }

    /// Square of the longest lever from the tool point at which it can press, m².
    pub fn lever_squared(&self) -> f64 {
        match self {
            Contact::Plane(_) => 0.0,
            Contact::Peg(peg) => peg.peg_radius * peg.peg_radius + peg.depth * peg.depth,
        }
    }

    /// What it is made of.
    pub fn material(&self) -> &Material {
        match self {
            Contact::Plane(plane) => &plane.material,
            Contact::Peg(peg) => &peg.material,
        }
    }

    /// Keeps the dampers of all points together below this, Ns/m.
    pub fn limit_damping(&mut self, limit: f64) {
        match self {
            Contact::Plane(plane) => plane.material.damping_limit = limit,
            Contact::Peg(peg) => peg.material.damping_limit = limit / peg::POINTS as f64,
        }
    }

    /// Adds this contact to `touch`, for the tool at `pose` with `twist` (base axes) and the points' bristles.
    pub fn add_to(&self, touch: &mut Touch, pose: &Pose, twist: &Spatial, bristles: &[Vector3<f64>]) {
        match self {
            Contact::Plane(plane) => plane.add_to(touch, pose, twist, &bristles[0]),
            Contact::Peg(peg) => peg.add_to(touch, pose, twist, bristles),
        }
    }

    /// Moves the bristles on by `h` seconds in which the tool, at `pose` with `twist` now, has the twist `moving`.
    pub fn advance(&self, bristles: &mut [Vector3<f64>], pose: &Pose, twist: &Spatial, moving: &Spatial, h: f64) {
        match self {
            Contact::Plane(plane) => plane.advance(&mut bristles[0], pose, twist, moving, h),
            Contact::Peg(peg) => peg.advance(bristles, pose, twist, moving, h),
        }
    }
}

/// Normal law and friction of one material pairing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// k, N/m.
    pub stiffness: f64,
    /// Hunt–Crossley factor c in f = k x (1 + 1.5 c ẋ), s/m.
    pub hunt_crossley: f64,
    /// μ.
    pub friction: f64,
    /// Strongest damper, Ns/m: 1.5 c k x counts up to here. [`crate::plant::Plant::new`] sets what a step can resolve.
    pub damping_limit: f64,
}

/// Damper beside the tangential spring over its stiffness, s.
const TANGENTIAL_RELAXATION: f64 = 1e-3;

impl Material {
    /// Normal force at penetration `x` (m) growing at `rate` (m/s); never pulls.
    #[inline]
    pub fn normal_force(&self, x: f64, rate: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let spring = self.stiffness * x;
        (spring + (1.5 * self.hunt_crossley * spring).min(self.damping_limit) * rate).max(0.0)
    }

    /// What remains of a tangential deflection under the normal force `normal`. Tangentially as stiff as normally.
    #[inline]
    pub fn held(&self, deflection: Vector3<f64>, normal: f64) -> Vector3<f64> {
        cut(deflection, self.friction * normal / self.stiffness)
    }

    /// Friction that the tool exerts, for a deflection within [`Material::held`] and the tangential velocity.
    #[inline]
    pub fn friction_force(&self, held: Vector3<f64>, velocity: Vector3<f64>, normal: f64) -> Vector3<f64> {
        cut(held * self.stiffness + velocity * (self.stiffness * TANGENTIAL_RELAXATION), self.friction * normal)
    }
}

/// `v`, shortened to `length` where it is longer. Cutting twice changes nothing.
#[inline]
fn cut(v: Vector3<f64>, length: f64) -> Vector3<f64> {
    let square = v.norm_squared();
    if square <= length * length * (1.0 + 1e-12) { v } else { v * (length / square.sqrt()) }
}
