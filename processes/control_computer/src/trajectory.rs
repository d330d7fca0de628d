//! TG: the trajectory generator. Segments come as commands; it says where X_d is, how it moves, and which impedance holds.
//!
//! A segment governs from its start until the next one starts. Its path begins where X_d stood at its start and takes
//! `move_time`; afterwards X_d rests at the target. Positions go along the straight line, orientations along the geodesic
//! (constant axis), both under the same time law. Nothing here looks at X or Xᵗ: a change of segment resets neither.

use crate::ahic::Impedance;
use crate::frame::{Motion, angular, difference, linear};
use arm::{Pose, rotation};
use messages::PathKind;
use nalgebra::Vector3;
use vme::Ns;

/// Segments that can wait.
pub const QUEUE: usize = 32;
/// Share of the move time in which a line's speed rises, and again in which it falls.
const BLEND: f64 = 0.2;
/// Greatest speed of a line, as a multiple of the mean one.
pub const LINE_PEAK: f64 = 1.0 / (1.0 - BLEND);
/// Greatest speed from point to point, as a multiple of the mean one.
pub const QUINTIC_PEAK: f64 = 1.875;

/// One segment, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its number.
    pub index: u32,
    /// When it starts to govern, ns.
    pub start: Ns,
    /// Time from `start` in which the path is run, ns.
    pub move_time: Ns,
    /// How X_d moves.
    pub path: PathKind,
    /// Where to, in the task frame.
    pub target: Pose,
    /// Target impedance and desired wrench.
    pub impedance: Impedance,
}

/// The segment in force and those that wait, in the order of their starts.
#[derive(Clone, Debug)]
pub struct Trajectory {
    impedance: Impedance,
    /// Where X_d stood when the path began.
    from: Pose,
    active: Option<Segment>,
    queue: [Option<Segment>; QUEUE],
    first: usize,
    waiting: usize,
}

impl Trajectory {
    /// X_d rests at `pose` under `impedance` until the first segment starts.
    pub fn new(pose: Pose, impedance: Impedance) -> Trajectory {
        Trajectory { impedance, from: pose, active: None, queue: [None; QUEUE], first: 0, waiting: 0 }
    }

    /// X_d rests at `pose` under `impedance` until the next segment starts.
    pub fn rest_at(&mut self, pose: Pose, impedance: Impedance) {
        self.from = pose;
        self.impedance = impedance;
        self.active = None;
    }

    /// Forgets the segments that wait.
    pub fn forget_waiting(&mut self) {
        self.queue = [None; QUEUE];
        self.waiting = 0;
    }

    /// Whether another segment can wait.
    pub fn has_room(&self) -> bool {
        self.waiting < QUEUE
    }

    /// Where the desired position will be at the end of the last segment known.
    pub fn last_target(&self) -> Vector3<f64> {
        let waiting = (0..self.waiting).rev().map(|n| self.queue[(self.first + n) % QUEUE]);
        let mut moving = waiting.chain([self.active]).flatten().filter(|segment| segment.path != PathKind::Hold);
        moving.next().map_or(self.from.p, |segment| segment.target.p)
    }

    /// The last segment known.
    pub fn last(&self) -> Option<&Segment> {
        match self.waiting {
            0 => self.active.as_ref(),
            n => self.queue[(self.first + n - 1) % QUEUE].as_ref(),
        }
    }

    /// Lets a segment wait; the caller has asked [`Trajectory::has_room`].
    pub fn push(&mut self, segment: Segment) {
        self.queue[(self.first + self.waiting) % QUEUE] = Some(segment);
        self.waiting += 1;
    }

    /// Starts what is due at `now`, one segment a call; returns its number.
    pub fn start_due(&mut self, now: Ns) -> Option<u32> {
        let next = self.queue[self.first].filter(|next| next.start <= now)?;
        self.from = self.desired(next.start).pose;
        self.impedance = next.impedance;
        self.active = Some(next);
        self.queue[self.first] = None;
        self.first = (self.first + 1) % QUEUE;
        self.waiting -= 1;
        Some(next.index)
    }

    /// Number of the segment in force.
    pub fn segment(&self) -> Option<u32> {
        self.active.map(|segment| segment.index)
    }

    /// Impedance in force.
    pub fn impedance(&self) -> &Impedance {
        &self.impedance
    }

    /// X_d, Ẋ_d and Ẍ_d at `now`.
    pub fn desired(&self, now: Ns) -> Motion {
        let Some(segment) = &self.active else {
            return Motion::at_rest(self.from);
        };
        let duration = segment.move_time as f64 * 1e-9;
        let u = if segment.move_time == 0 {
            1.0
        } else {
            (now.saturating_sub(segment.start) as f64 / segment.move_time as f64).min(1.0)
        };
        let law = match segment.path {
            PathKind::Hold => return Motion::at_rest(self.from),
            PathKind::Step => return Motion::at_rest(segment.target),
            _ if u >= 1.0 => return Motion::at_rest(segment.target),
            PathKind::PointToPoint => quintic(u),
            PathKind::Line => blended(u),
        };
        let way = difference(&segment.target, &self.from);
        Motion {
            pose: Pose {
                p: self.from.p + linear(&way) * law.s,
                r: rotation::exp(&(angular(&way) * law.s)) * self.from.r,
            },
            twist: way * (law.speed / duration),
            acceleration: way * (law.acceleration / (duration * duration)),
        }
    }
}

/// Share of the way gone, and its derivatives by the share of the time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimeLaw {
    s: f64,
    speed: f64,
    acceleration: f64,
}

/// s = 10u³ − 15u⁴ + 6u⁵: no speed and no acceleration at both ends.
fn quintic(u: f64) -> TimeLaw {
    TimeLaw {
        s: u * u * u * (10.0 + u * (-15.0 + 6.0 * u)),
        speed: 30.0 * u * u * (1.0 - u) * (1.0 - u),
        acceleration: 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
    }
}

/// Constant speed, reached and left under a quintic law of the *speed* over [`BLEND`] at each end: no speed and no
/// acceleration at both ends, no jump of the acceleration in between.
fn blended(u: f64) -> TimeLaw {
    let speed = 1.0 / (1.0 - BLEND);
    let rising = |u: f64| {
        let v = u / BLEND;
        let law = quintic(v);
        TimeLaw {
            // integral of the quintic
            s: speed * BLEND * v * v * v * v * (2.5 + v * (-3.0 + v)),
            speed: speed * law.s,
            acceleration: speed * law.speed / BLEND,
        }
    };
    if u < BLEND {
        rising(u)
    } else if u <= 1.0 - BLEND {
        TimeLaw { s: speed * (u - 0.5 * BLEND), speed, acceleration: 0.0 }
    } else {
        let mirrored = rising(1.0 - u);
        TimeLaw { s: 1.0 - mirrored.s, speed: mirrored.speed, acceleration: -mirrored.acceleration }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::Spatial;
    use nalgebra::{Matrix3, Vector3};

    const SECOND: Ns = 1_000_000_000;

    fn impedance(mass: f64) -> Impedance {
        Impedance {
            selection: Spatial::repeat(1.0),
            mass: Spatial::repeat(mass),
            damping: Spatial::zeros(),
            stiffness: Spatial::zeros(),
            force: Spatial::zeros(),
        }
    }

    fn start() -> Pose {
        Pose { p: Vector3::new(0.1, 0.0, -0.2), r: Matrix3::identity() }
    }

    fn target() -> Pose {
        Pose { p: Vector3::new(0.4, -0.1, 0.2), r: rotation::exp(&Vector3::new(0.3, 1.2, -0.4)) }
    }

    fn segment(index: u32, start: Ns, path: PathKind, target: Pose) -> Segment {
        Segment { index, start, move_time: 2 * SECOND, path, target, impedance: impedance(f64::from(index) + 1.0) }
    }

    fn moving(path: PathKind) -> Trajectory {
        let mut trajectory = Trajectory::new(start(), impedance(9.0));
        trajectory.push(segment(0, SECOND, path, target()));
        assert_eq!(trajectory.start_due(SECOND), Some(0));
        trajectory
    }

    #[test]
    fn paths_begin_and_end_at_rest_in_the_poses_asked_for() {
        for path in [PathKind::PointToPoint, PathKind::Line] {
            let trajectory = moving(path);
            for (at, pose) in [(SECOND, start()), (3 * SECOND, target()), (9 * SECOND, target())] {
                let x = trajectory.desired(at);
                assert!(difference(&x.pose, &pose).amax() < 1e-12);
                assert!(x.twist.amax() < 1e-12 && x.acceleration.amax() < 1e-12, "{path:?} {at}");
            }
        }
    }

    #[test]
    fn speed_and_acceleration_are_the_derivatives_of_the_pose_all_along_the_path() {
        for path in [PathKind::PointToPoint, PathKind::Line] {
            let trajectory = moving(path);
            let h = 1_000_000;
            for k in 1..200 {
                let t = SECOND + k * 10_000_000;
                let (before, x, after) = (trajectory.desired(t - h), trajectory.desired(t), trajectory.desired(t + h));
                let dt = h as f64 * 1e-9;
                let speed = difference(&after.pose, &before.pose) / (2.0 * dt);
                assert!((speed - x.twist).amax() < 1e-4, "{path:?} {k}: {speed} {}", x.twist);
                let acceleration = (after.twist - before.twist) / (2.0 * dt);
                assert!((acceleration - x.acceleration).amax() < 1e-3, "{path:?} {k}");
            }
        }
    }

    #[test]
    fn a_line_has_constant_speed_between_its_blends_and_stays_straight() {
        let trajectory = moving(PathKind::Line);
        let way = target().p - start().p;
        let speed = way.norm() / (2.0 * (1.0 - BLEND));
        for k in 0..=60 {
            let x = trajectory.desired(SECOND + 400_000_000 + k * 20_000_000);
            assert!((linear(&x.twist).norm() - speed).abs() < 1e-12);
            assert!((x.pose.p - start().p).cross(&way).amax() < 1e-12);
        }
    }

    #[test]
    fn hold_stays_and_step_jumps() {
        assert_eq!(moving(PathKind::Hold).desired(5 * SECOND), Motion::at_rest(start()));
        assert_eq!(moving(PathKind::Step).desired(SECOND), Motion::at_rest(target()));
    }

    #[test]
    fn a_segment_governs_from_its_start_and_its_path_begins_where_the_last_one_stood() {
        let mut trajectory = Trajectory::new(start(), impedance(9.0));
        trajectory.push(segment(0, SECOND, PathKind::PointToPoint, target()));
        trajectory.push(segment(1, 2 * SECOND, PathKind::PointToPoint, start()));
        assert_eq!(trajectory.last().map(|last| (last.index, last.start)), Some((1, 2 * SECOND)));
        assert_eq!(trajectory.start_due(SECOND - 1), None);
        assert_eq!((trajectory.segment(), trajectory.impedance().mass[0]), (None, 9.0));
        assert_eq!(trajectory.start_due(SECOND + 5), Some(0));
        let half_way = trajectory.desired(2 * SECOND).pose;
        assert_eq!(trajectory.start_due(2 * SECOND + 5), Some(1));
        assert_eq!((trajectory.segment(), trajectory.impedance().mass[0]), (Some(1), 2.0));
        assert_eq!(trajectory.desired(2 * SECOND).pose, half_way);
    }

    #[test]
    fn the_queue_is_a_ring_that_says_when_it_is_full() {
        let mut trajectory = Trajectory::new(start(), impedance(9.0));
        for round in 0..3 {
            for i in 0..QUEUE as u32 {
                assert!(trajectory.has_room());
                trajectory.push(segment(i, round, PathKind::Hold, start()));
            }
            assert!(!trajectory.has_room());
            let started: Vec<u32> = std::iter::from_fn(|| trajectory.start_due(round)).collect();
            assert!(started.into_iter().eq(0..QUEUE as u32));
        }
    }
}
