//! Peg in a chamfered hole (Whitney): sampled points of the peg's rim against plane, chamfer cone, bore and floor, sampled
//! points of the bore's lip against the peg's side.
//!
//! The peg is a cylinder about the tool's z axis whose end face is centred on the tool point; the hole is fixed in the
//! base. One-point, two-point and line contact, wedging and jamming follow from the points' normal forces and friction.

use super::{Material, Touch};
use arm::{Pose, Spatial};
use nalgebra::{Matrix3, Vector3};
use scenario::{Hole, Scenario};
use std::sync::LazyLock;

/// Points on the rim, and on the lip.
const SAMPLES: usize = Hole::SAMPLES;
/// Contact points of one peg and hole.
pub const POINTS: usize = Hole::POINTS;

/// Cosine and sine of the angles at which the points sit.
static CIRCLE: LazyLock<[(f64, f64); SAMPLES]> = LazyLock::new(|| {
    std::array::from_fn(|n| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * n as f64 / SAMPLES as f64);
        (cos, sin)
    })
});

/// A peg on the tool and a hole in the base. The stiffness of `material` is that of one point.
#[derive(Clone, Debug, PartialEq)]
pub struct PegInHole {
    /// r, m.
    pub peg_radius: f64,
    /// How far the peg's side reaches back from its end face, m.
    pub peg_length: f64,
    /// Centre of the hole's mouth in the base, m.
    pub mouth: Vector3<f64>,
    /// Axes of the hole in the base: z points into it.
    pub axes: Matrix3<f64>,
    /// R of the bore, m.
    pub bore_radius: f64,
    /// Width of the 45° chamfer, m: the mouth's radius is R + w, the bore begins at depth w.
    pub chamfer: f64,
    /// Depth of the floor under the mouth, m.
    pub depth: f64,
    /// What both are made of.
    pub material: Material,
}

/// A point where peg and hole may press on each other, in base axes.
#[derive(Clone, Copy)]
struct Point {
    /// From the tool point.
    lever: Vector3<f64>,
    /// Outward normal of the hole's material.
    normal: Vector3<f64>,
    /// Penetration; negative: gap.
    penetration: f64,
}

impl PegInHole {
    /// The peg and hole that a scenario describes.
    pub fn from_hole(scenario: &Scenario, hole: &Hole) -> PegInHole {
        let frame = scenario.task_frame();
        PegInHole {
            peg_radius: hole.peg_radius_m,
            peg_length: hole.peg_length_m,
            mouth: frame.p + frame.r * Vector3::from(hole.position_m),
            axes: frame.r * hole.axes(),
            bore_radius: hole.bore_radius_m,
            chamfer: hole.chamfer_m,
            depth: hole.depth_m,
            material: Material {
                stiffness: hole.stiffness_n_per_m,
                hunt_crossley: hole.hunt_crossley_s_per_m,
                friction: hole.friction,
                damping_limit: f64::INFINITY,
            },
        }
    }

    fn point(&self, pose: &Pose, n: usize) -> Point {
        let (cos, sin) = CIRCLE[n % SAMPLES];
        if n < SAMPLES {
            self.rim(pose, Vector3::new(cos, sin, 0.0) * self.peg_radius)
        } else {
            self.lip(pose, Vector3::new(self.bore_radius * cos, self.bore_radius * sin, self.chamfer))
        }
    }

    /// A point of the peg's rim (tool axes) against the hole's faces: the least of the distances out of the material.
    fn rim(&self, pose: &Pose, on_peg: Vector3<f64>) -> Point {
        let lever = pose.r * on_peg;
        let at = self.axes.tr_mul(&(pose.p + lever - self.mouth));
        let radius = at.x.hypot_of(at.y);
        let inward = match radius > 0.0 {
            true => Vector3::new(-at.x / radius, -at.y / radius, 0.0),
            false => Vector3::zeros(),
        };
        let up = -Vector3::z();
        let wall = radius - self.bore_radius;
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        let mut nearest = (at.z, up);
        for (distance, normal) in [(wall, inward), ((wall - self.chamfer + at.z) * diagonal, (inward + up) * diagonal)]
        {
            if distance < nearest.0 {
                nearest = (distance, normal);
            }
        }
        // above the mouth the bore's wall and the chamfer's cone are no faces
        if at.z <= 0.0 {
            nearest = (at.z, up);
        }
        let floor = at.z - self.depth;
        if floor > 0.0 && wall < 0.0 || floor > nearest.0 {
            nearest = (floor, up);
        }
        Point { lever, normal: self.axes * nearest.1, penetration: nearest.0 }
    }

    /// A point of the bore's lip (hole axes) against the peg's side.
    fn lip(&self, pose: &Pose, on_hole: Vector3<f64>) -> Point {
        let lever = self.mouth + self.axes * on_hole - pose.p;
        let on_peg = pose.r.tr_mul(&lever);
        let radius = on_peg.x.hypot_of(on_peg.y);
        let outward = match radius > 0.0 {
            true => Vector3::new(on_peg.x / radius, on_peg.y / radius, 0.0),
            false => Vector3::zeros(),
        };
        // beside the side's length, or nearer to the end face (which the rim's points see), there is no side
        let inside = self.peg_radius - radius;
        let behind = -on_peg.z;
        let beside = behind <= 0.0 || behind > self.peg_length || inside > behind;
        Point { lever, normal: pose.r * -outward, penetration: if beside { f64::NEG_INFINITY } else { inside } }
    }

    pub(super) fn add_to(&self, touch: &mut Touch, pose: &Pose, twist: &Spatial, bristles: &[Vector3<f64>]) {
        for (n, bristle) in bristles.iter().enumerate() {
            let point = self.point(pose, n);
            let velocity = at_lever(twist, &point.lever);
            let rate = -velocity.dot(&point.normal);
            touch.deepen(point.penetration, rate);
            let normal = self.material.normal_force(point.penetration, rate);
            if normal > 0.0 {
                let held = self.material.held(*bristle, normal);
                let friction = self.material.friction_force(held, tangential(velocity, &point.normal), normal);
                touch.add_point(friction - point.normal * normal, point.lever);
            }
        }
    }

    pub(super) fn advance(
        &self,
        bristles: &mut [Vector3<f64>],
        pose: &Pose,
        twist: &Spatial,
        moving: &Spatial,
        h: f64,
    ) {
        for (n, bristle) in bristles.iter_mut().enumerate() {
            let point = self.point(pose, n);
            let rate = -at_lever(twist, &point.lever).dot(&point.normal);
            let normal = self.material.normal_force(point.penetration, rate);
            *bristle = match normal > 0.0 {
                true => {
                    self.material.held(*bristle, normal) + tangential(at_lever(moving, &point.lever), &point.normal) * h
                }
                false => Vector3::zeros(),
            };
        }
    }
}

/// Velocity of the tool's material at a lever from the tool point.
fn at_lever(twist: &Spatial, lever: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(twist[0], twist[1], twist[2]) + Vector3::new(twist[3], twist[4], twist[5]).cross(lever)
}

fn tangential(v: Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    v - normal * normal.dot(&v)
}

/// √(x² + y²) without the system's mathematics library.
trait Hypot {
    fn hypot_of(self, other: f64) -> f64;
}

impl Hypot for f64 {
    fn hypot_of(self, other: f64) -> f64 {
        (self * self + other * other).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const R_PEG: f64 = 0.02;
    const CLEARANCE: f64 = 1e-4;

    fn hole(friction: f64) -> PegInHole {
        PegInHole {
            peg_radius: R_PEG,
            peg_length: 0.08,
            mouth: Vector3::zeros(),
            axes: Matrix3::identity(),
            bore_radius: R_PEG + CLEARANCE,
            chamfer: 0.003,
            depth: 0.04,
            material: Material { stiffness: 1e6, hunt_crossley: 0.0, friction, damping_limit: f64::INFINITY },
        }
    }

    /// Tool point at lateral x under the lip by `depth`, tilted about y so that the rim leans to +x.
    fn pose(hole: &PegInHole, x: f64, depth: f64, tilt: f64) -> Pose {
        let r = arm::rotation::exp(&Vector3::new(0.0, tilt, 0.0));
        Pose { p: Vector3::new(x, 0.0, hole.chamfer + depth), r }
    }

    fn touch(hole: &PegInHole, pose: &Pose, twist: &Spatial, bristles: &[Vector3<f64>]) -> Touch {
        let mut touch = Touch::NONE;
        hole.add_to(&mut touch, pose, twist, bristles);
        touch
    }

    const LOOSE: [Vector3<f64>; POINTS] = [Vector3::new(0.0, 0.0, 0.0); POINTS];

    #[test]
    fn a_peg_that_lands_within_the_chamfer_is_guided_in_and_one_beyond_it_stands_on_the_plane() {
        let hole = hole(0.0);
        let inside = hole.chamfer + CLEARANCE;
        for (error, guided) in
            [(0.5 * inside, true), (0.97 * inside, true), (1.1 * inside, false), (2.0 * inside, false)]
        {
            // lowered until it touches with 20 µm
            let mut z = -1e-3;
            let at = |z: f64| Pose { p: Vector3::new(error, 0.0, z), r: Matrix3::identity() };
            while touch(&hole, &at(z), &Spatial::zeros(), &LOOSE).penetration < 2e-5 {
                z += 1e-6;
            }
            let wrench = touch(&hole, &at(z), &Spatial::zeros(), &LOOSE).wrench;
            assert!(wrench[2] > 0.0);
            // the tool pushes the chamfer outwards, so the chamfer pushes the tool towards the axis
            assert_eq!(wrench[0] > 0.3 * wrench[2], guided, "{error}: {wrench}");
            assert_eq!(wrench[0].abs() < 1e-9, !guided, "{error}: {wrench}");
        }
    }

    #[test]
    fn two_point_contact_begins_at_whitneys_depth() {
        let hole = hole(0.0);
        for tilt in [0.006, 0.01, 0.02] {
            // deepest pose that has room for the peg somewhere across the hole
            let fits = |depth: f64| {
                (-4000..=4000).any(|k| {
                    let at = pose(&hole, f64::from(k) * 1e-7, depth, tilt);
                    touch(&hole, &at, &Spatial::zeros(), &LOOSE).wrench.norm() == 0.0
                })
            };
            let (mut low, mut high) = (0.0, 0.037);
            while high - low > 1e-6 {
                let middle = 0.5 * (low + high);
                if fits(middle) { low = middle } else { high = middle }
            }
            let whitney = 2.0 * CLEARANCE / tilt;
            assert!((low - whitney).abs() < 0.05 * whitney, "tilt {tilt}: depth {low}, 2(R-r)/tilt {whitney}");
        }
    }

    /// Two-point contact at `depth` with a tilt beyond what fits.
    fn pressed(hole: &PegInHole, depth: f64, tilt: f64) -> Pose {
        // across the hole so that rim and lip are pressed alike
        let (mut low, mut high) = (-2e-3, 2e-3);
        let side = |x: f64| {
            let at = pose(hole, x, depth, tilt);
            hole.point(&at, 0).penetration - hole.point(&at, SAMPLES + SAMPLES / 2).penetration
        };
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if side(middle) < 0.0 { low = middle } else { high = middle }
        }
        pose(hole, low, depth, tilt)
    }

    #[test]
    fn sliding_in_two_point_contact_lies_on_the_jamming_parallelogram() {
        for friction in [0.1, 0.3] {
            // a tight fit: the theory neglects the tilt beside the friction angle
            let clearance = 4e-6;
            let hole = PegInHole { bore_radius: R_PEG + clearance, ..hole(friction) };
            for depth in [0.008, 0.02] {
                // a slight press: one point of the rim and one of the lip
                let mut at = pressed(&hole, depth, 1.02 * 2.0 * clearance / depth);
                for shift in [-3e-8, 0.0, 6e-8] {
                    at.p.x += shift;
                    let sliding = Spatial::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
                    let wrench = touch(&hole, &at, &sliding, &LOOSE).wrench;
                    let (fx, fz, moment) = (wrench[0], wrench[2], wrench[4]);
                    let lambda = depth / (2.0 * R_PEG * friction);
                    let line = lambda - friction * (1.0 + lambda) * fx / fz;
                    assert!(fz > 0.0 && (fx / fz).abs() <= 1.0 / friction);
                    assert!(
                        (moment / (R_PEG * fz) - line).abs() < 0.03 * lambda.max(1.0),
                        "{} {line}",
                        moment / (R_PEG * fz)
                    );
                }
            }
        }
    }

    #[test]
    fn a_peg_wedges_only_where_two_point_contact_comes_before_the_depth_mu_times_diameter() {
        let friction = 0.3;
        let hole = hole(friction);
        for (depth, wedges) in [(0.7 * friction * 2.0 * R_PEG, true), (1.3 * friction * 2.0 * R_PEG, false)] {
            // tilted a little more than fits
            let at = pressed(&hole, depth, 1.3 * 2.0 * CLEARANCE / depth);
            // the bristles push the forces of rim and lip into the line between them
            let mut bristles = LOOSE;
            for (n, bristle) in bristles.iter_mut().enumerate() {
                let point = hole.point(&at, n);
                if point.penetration > 0.0 {
                    let other = hole.point(&at, if n < SAMPLES { SAMPLES + SAMPLES / 2 } else { 0 });
                    let line = point.lever - other.lever;
                    let along = line / line.dot(&-point.normal);
                    *bristle = tangential(along, &point.normal) * point.penetration;
                }
            }
            let free = touch(&hole, &at, &Spatial::zeros(), &LOOSE);
            let held = touch(&hole, &at, &Spatial::zeros(), &bristles);
            // wedged: the two forces cancel with nobody pushing
            let axial = held.wrench[2].abs() + held.wrench[4].abs() / R_PEG;
            let unheld = free.wrench[4].abs() / R_PEG;
            assert_eq!(axial < 0.12 * unheld, wedges, "depth {depth}: {axial} N of {unheld} N");
        }
    }

    #[test]
    fn the_floor_stops_the_peg() {
        let hole = hole(0.0);
        let at = Pose { p: Vector3::new(0.0, 0.0, hole.depth + 1e-5), r: Matrix3::identity() };
        let wrench = touch(&hole, &at, &Spatial::zeros(), &LOOSE).wrench;
        assert!((wrench[2] - SAMPLES as f64 * 1e6 * 1e-5).abs() < 1e-6, "{wrench}");
    }
}
