//! A flat patch, tilted or not, that the tool point touches: pad on white-board, table, wall.

use super::{Material, Touch};
use arm::{Pose, Spatial};
use nalgebra::Vector3;
use scenario::{Scenario, Surface};

/// A plane patch in base axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane, m.
    pub point: Vector3<f64>,
    /// Outward unit normal.
    pub normal: Vector3<f64>,
    /// What it is made of.
    pub material: Material,
    /// Two edge directions of the patch and the half lengths along them, m; none = unbounded.
    pub patch: Option<[(Vector3<f64>, f64); 2]>,
}

impl Plane {
    /// The plane that a scenario describes.
    pub fn from_surface(scenario: &Scenario, surface: &Surface) -> Plane {
        let frame = scenario.task_frame();
        let along = |k: usize, half: f64| (frame.r.column(k).into_owned(), half);
        Plane {
            point: frame.p + frame.r * Vector3::from(surface.position_m),
            normal: frame.r * surface.normal(),
            material: Material {
                stiffness: surface.stiffness_n_per_m,
                hunt_crossley: surface.hunt_crossley_s_per_m,
                friction: surface.friction,
            },
            patch: surface.half_size_m.map(|[x, y]| [along(0, x), along(1, y)]),
        }
    }

    /// Penetration (negative: gap) and its rate; `None` beside the patch.
    fn penetration(&self, pose: &Pose, twist: &Spatial) -> Option<(f64, f64)> {
        let from_point = pose.p - self.point;
        if let Some(edges) = &self.patch
            && edges
                .iter()
                .any(|(direction, half)| direction.dot(&from_point).abs() > *half)
        {
            return None;
        }
        Some((
            -from_point.dot(&self.normal),
            -velocity(twist).dot(&self.normal),
        ))
    }

    fn tangential(&self, v: Vector3<f64>) -> Vector3<f64> {
        v - self.normal * self.normal.dot(&v)
    }

    pub(super) fn add_to(
        &self,
        touch: &mut Touch,
        pose: &Pose,
        twist: &Spatial,
        bristle: &Vector3<f64>,
    ) {
        let Some((x, rate)) = self.penetration(pose, twist) else {
            return;
        };
        touch.deepen(x, rate);
        let normal = self.material.normal_force(x, rate);
        if normal > 0.0 {
            let held = self.material.held(*bristle, normal);
            let friction =
                self.material
                    .friction_force(held, self.tangential(velocity(twist)), normal);
            touch.add_point(friction - self.normal * normal, Vector3::zeros());
        }
    }

    pub(super) fn advance(
        &self,
        bristle: &mut Vector3<f64>,
        pose: &Pose,
        twist: &Spatial,
        moving: &Spatial,
        h: f64,
    ) {
        let normal = self
            .penetration(pose, twist)
            .map_or(0.0, |(x, rate)| self.material.normal_force(x, rate));
        *bristle = match normal > 0.0 {
            true => self.material.held(*bristle, normal) + self.tangential(velocity(moving)) * h,
            false => Vector3::zeros(),
        };
    }
}

fn velocity(twist: &Spatial) -> Vector3<f64> {
    Vector3::new(twist[0], twist[1], twist[2])
}
