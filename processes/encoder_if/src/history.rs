//! What the shafts did lately: positions and speeds at the arm's steps, linear between them.
//!
//! Kept for as long as the speed estimator and a delay look back. Before the first sample the shafts are taken
//! to have stood still there. More samples than planned for cost an allocation, nothing else; of far more, which only an
//! arm whose clock runs away sends, the oldest are forgotten.

use arm::drives::DriveData;
use core::f64::consts::TAU;
use messages::{JOINTS, PlantSample};
use std::collections::VecDeque;
use vme::Ns;

/// No stated delay or window reaches back further.
const MOST_SAMPLES: usize = 1 << 16;

/// One value per joint.
pub type PerJoint = [f64; JOINTS];

/// All shafts at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shafts {
    /// Instant, ns: exact for the first 104 days.
    pub t: f64,
    /// Shaft angles in counts, not rounded.
    pub position: PerJoint,
    /// Shaft speeds, counts/s.
    pub speed: PerJoint,
}

/// One shaft at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Instant, ns.
    pub t: f64,
    /// Angle in counts, not rounded.
    pub x: f64,
}

/// The recent past.
#[derive(Clone, Debug)]
pub struct History {
    counts_per_rad: PerJoint,
    span: f64,
    samples: VecDeque<Shafts>,
}

impl History {
    /// A history that reaches back `span`, of encoders on these drives, at about `rate_hz` samples a second.
    pub fn new(drives: &DriveData, span: Ns, rate_hz: f64) -> History {
        // a window may end between two steps of the arm: room for as many of these ends as there are steps
        let capacity = 64 + (2.0 * rate_hz * span as f64 * 1e-9) as usize;
        History {
            counts_per_rad: core::array::from_fn(|i| counts_per_turn(drives, i) / TAU),
            span: span as f64,
            samples: VecDeque::with_capacity(capacity),
        }
    }

    /// Takes in a sample; one that is not newer than the newest is known already.
    pub fn push(&mut self, sample: &PlantSample) {
        let t = sample.t as f64;
        if self.samples.back().is_some_and(|newest| t <= newest.t) {
            return;
        }
        if self.samples.len() == MOST_SAMPLES {
            self.samples.pop_front();
        }
        let in_counts = |rad: &PerJoint| core::array::from_fn(|i| rad[i] * self.counts_per_rad[i]);
        self.samples.push_back(Shafts {
            t,
            position: in_counts(&sample.theta),
            speed: in_counts(&sample.theta_dot),
        });
    }

    /// Forgets what lies so far before `t` that nothing looks back at it.
    pub fn forget(&mut self, t: Ns) {
        let oldest = t as f64 - self.span;
        while self.samples.get(1).is_some_and(|sample| sample.t <= oldest) {
            self.samples.pop_front();
        }
    }

    /// Number of samples at or before `t`.
    pub fn until(&self, t: f64) -> usize {
        self.samples.partition_point(|sample| sample.t <= t)
    }

    /// Sample number `i`, the oldest first.
    pub fn sample(&self, i: usize) -> Option<&Shafts> {
        self.samples.get(i)
    }

    /// True before anything was seen.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Sample number `i` of one joint.
    pub fn point(&self, joint: usize, i: usize) -> Option<Point> {
        self.samples.get(i).map(|sample| Point {
            t: sample.t,
            x: sample.position[joint],
        })
    }

    /// Angle of one shaft at `t`, in counts, not rounded; 0 before anything was seen.
    pub fn position(&self, joint: usize, t: f64) -> f64 {
        self.interpolate(t, |sample| sample.position[joint])
            .unwrap_or(0.0)
    }

    /// Speed of one shaft at `t`, counts/s; 0 before anything was seen.
    pub fn speed(&self, joint: usize, t: f64) -> f64 {
        self.interpolate(t, |sample| sample.speed[joint])
            .unwrap_or(0.0)
    }

    /// Angles of all shafts at `t`, in counts, not rounded.
    pub fn positions(&self, t: f64) -> PerJoint {
        let next = self.until(t);
        let before = next.checked_sub(1).and_then(|i| self.samples.get(i));
        match (before, self.samples.get(next)) {
            (Some(a), Some(b)) => {
                let share = (t - a.t) / (b.t - a.t);
                core::array::from_fn(|i| a.position[i] + share * (b.position[i] - a.position[i]))
            }
            (Some(only), None) | (None, Some(only)) => only.position,
            (None, None) => PerJoint::default(),
        }
    }

    /// Number of the newest sample before number `end` in which a shaft is outside [`cell`, `cell` + 1).
    pub fn last_outside(&self, joint: usize, cell: f64, end: usize) -> Option<usize> {
        let outside = |sample: &Shafts| {
            let x = sample.position[joint];
            x < cell || x >= cell + 1.0
        };
        // the halves of the ring one after the other: nothing to wrap in the loop
        let (old, new) = self.samples.as_slices();
        let of_old = &old[..end.min(old.len())];
        let of_new = &new[..end.saturating_sub(old.len()).min(new.len())];
        (of_new.iter().rposition(outside).map(|i| i + old.len())).or_else(|| of_old.iter().rposition(outside))
    }

    fn interpolate(&self, t: f64, value: impl Fn(&Shafts) -> f64) -> Option<f64> {
        let next = self.until(t);
        let before = next.checked_sub(1).and_then(|i| self.samples.get(i));
        match (before, self.samples.get(next)) {
            (Some(a), Some(b)) => Some(value(a) + (t - a.t) / (b.t - a.t) * (value(b) - value(a))),
            (Some(only), None) | (None, Some(only)) => Some(value(only)),
            (None, None) => None,
        }
    }
}

/// Counts in one turn of the shaft of joint `i`: four to a line.
pub fn counts_per_turn(drives: &DriveData, i: usize) -> f64 {
    4.0 * f64::from(drives.joints[i].encoder_lines)
}
