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
                damping_limit: f64::INFINITY,
            },
            patch: surface.half_size_m.map(|[x, y]| [along(0, x), along(1, y)]),
        }
    }

    /// Penetration (negative: gap) and its rate; `None` beside the patch.
    fn penetration(&self, pose: &Pose, twist: &Spatial) -> Option<(f64, f64)> {
        let from_point = pose.p - self.point;
        if let Some(edges) = &self.patch
            && edges.iter().any(|(direction, half)| direction.dot(&from_point).abs() > *half)
        {
            return None;
        }
        Some((-from_point.dot(&self.normal), -velocity(twist).dot(&self.normal)))
    }

    fn tangential(&self, v: Vector3<f64>) -> Vector3<f64> {
        v - self.normal * self.normal.dot(&v)
    }

    pub(super) fn add_to(&self, touch: &mut Touch, pose: &Pose, twist: &Spatial, bristle: &Vector3<f64>) {
        let Some((x, rate)) = self.penetration(pose, twist) else {
            return;
        };
        touch.deepen(x, rate);
        let normal = self.material.normal_force(x, rate);
        if normal > 0.0 {
            let held = self.material.held(*bristle, normal);
            let friction = self.material.friction_force(held, self.tangential(velocity(twist)), normal);
            touch.add_point(friction - self.normal * normal, Vector3::zeros());
        }
    }

    pub(super) fn advance(&self, bristle: &mut Vector3<f64>, pose: &Pose, twist: &Spatial, moving: &Spatial, h: f64) {
        let normal = self.penetration(pose, twist).map_or(0.0, |(x, rate)| self.material.normal_force(x, rate));
        *bristle = match normal > 0.0 {
            true => self.material.held(*bristle, normal) + self.tangential(velocity(moving)) * h,
            false => Vector3::zeros(),
        };
    }
}

fn velocity(twist: &Spatial) -> Vector3<f64> {
    Vector3::new(twist[0], twist[1], twist[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn board(friction: f64) -> Plane {
        let material = Material { stiffness: 1e4, hunt_crossley: 0.0, friction, damping_limit: f64::INFINITY };
        // tilted, to be independent of the axes
        let normal = arm::rotation::exp(&Vector3::new(0.3, -0.2, 0.0)) * Vector3::z();
        Plane { point: Vector3::new(0.1, 0.2, 0.3), normal, material, patch: None }
    }

    /// Drags the tool along the board through these tangential positions at this depth; the force on the board at each.
    fn drag(plane: &Plane, depth: f64, path: impl Iterator<Item = f64>, h: f64) -> Vec<(f64, Vector3<f64>)> {
        let along = plane.normal.cross(&Vector3::x()).normalize();
        let (mut bristle, mut x) = (Vector3::zeros(), 0.0);
        path.map(|next| {
            let v = along * ((next - x) / h);
            let twist = Spatial::new(v.x, v.y, v.z, 0.0, 0.0, 0.0);
            let pose = Pose { p: plane.point - plane.normal * depth + along * x, r: Matrix3::identity() };
            let mut touch = Touch::NONE;
            plane.add_to(&mut touch, &pose, &twist, &bristle);
            plane.advance(&mut bristle, &pose, &twist, &twist, h);
            let power = touch.wrench.dot(&twist);
            x = next;
            (power, touch.wrench.fixed_rows::<3>(0).into_owned())
        })
        .collect()
    }

    #[test]
    fn the_force_stays_in_the_coulomb_cone_and_reaches_its_edge_when_sliding() {
        let plane = board(0.4);
        let h = 1e-4;
        let forces = drag(&plane, 2e-3, (0..20_000).map(|n| 0.03 * libm::sin(6.0 * n as f64 * h)), h);
        let mut edge = 0;
        for (_, force) in &forces {
            let normal = -force.dot(&plane.normal);
            let tangential = (force + plane.normal * normal).norm();
            assert!((normal - 20.0).abs() < 1e-9, "k x");
            assert!(tangential <= 0.4 * normal * (1.0 + 1e-9));
            edge += usize::from(tangential > 0.4 * normal * (1.0 - 1e-9));
        }
        assert!(edge > forces.len() / 2);
    }

    #[test]
    fn a_push_below_the_cone_sticks_and_springs_back() {
        let plane = board(0.4);
        // 0.5 mm is 5 N of the 8 N that stick
        let forces = drag(&plane, 2e-3, (0..=2000).map(|n| 5e-4 * (1.0 - (n as f64 / 1000.0 - 1.0).abs())), 1e-3);
        let back = forces.last().expect("a path").1;
        let rest = back + plane.normal * -back.dot(&plane.normal);
        assert!(rest.norm() < 0.02, "{rest}");
    }

    #[test]
    fn rubbing_to_and_fro_never_yields_energy() {
        let plane = board(0.4);
        let h = 1e-4;
        for (amplitude, omega) in [(3e-4, 20.0), (1e-3, 20.0), (0.02, 6.0)] {
            let forces = drag(&plane, 2e-3, (0..30_000).map(|n| amplitude * libm::sin(omega * n as f64 * h)), h);
            let mut work = 0.0;
            for (power, _) in forces {
                work += power * h;
                assert!(work > -1e-9, "{work} J gained");
            }
        }
    }

    #[test]
    fn beside_the_patch_there_is_nothing_to_touch() {
        let mut plane = board(0.0);
        plane.patch = Some([(Vector3::x(), 0.1), (Vector3::y(), 0.05)]);
        let at = |dx: f64| {
            let mut touch = Touch::NONE;
            let p = plane.point - plane.normal * 1e-3 + Vector3::x() * dx;
            plane.add_to(&mut touch, &Pose { p, r: Matrix3::identity() }, &Spatial::zeros(), &Vector3::zeros());
            touch.wrench.norm()
        };
        assert!(at(0.0) > 0.0 && at(0.2) == 0.0);
    }
}
