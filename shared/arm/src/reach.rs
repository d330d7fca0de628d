//! How far an arm reaches: a bound, and a search, since joint limits and twisted links leave no closed form.

use crate::kinematics::frames;
use crate::model::ArmModel;
use crate::small::V3;
use crate::{DOF, JointVector};
use nalgebra::Vector3;
use std::f64::consts::PI;

impl ArmModel {
    /// Origin of the second joint at zero, which joint 1 leaves in place or turns about its axis (base axes, m).
    pub fn shoulder(&self) -> Vector3<f64> {
        (self.joints[0].p + self.joints[0].r * self.joints[1].p).into()
    }

    /// Distance from the second joint's origin to the tip if every link could be stretched out: no posture reaches further
    /// (m). For the slide, its largest position.
    pub fn reach_bound(&self) -> f64 {
        if self.is_slide() {
            return self.upper[0];
        }
        let length = |v: V3| v.dot(v).sqrt();
        self.joints[2..].iter().map(|j| length(j.p)).sum::<f64>() + length(self.tip_p)
    }

    /// Largest distance (m) from the second joint's origin to the tip within the joint limits, found by coordinate ascent
    /// from 32 scattered postures: exact to a millimetre, never too large. For the slide, its largest position.
    pub fn reach(&self) -> f64 {
        if self.is_slide() {
            return self.upper[0];
        }
        (0..32).map(|k| self.ascend(self.scattered(k))).fold(0.0, f64::max)
    }

    fn limits(&self, i: usize) -> (f64, f64) {
        (self.lower[i].max(-PI), self.upper[i].min(PI))
    }

    /// Posture `k` of a sequence that fills the joint ranges evenly (additive recurrence of irrational steps).
    fn scattered(&self, k: u32) -> JointVector {
        JointVector::from_fn(|i, _| {
            let (low, high) = self.limits(i);
            let x = 0.5 + f64::from(k + 1) * (i as f64 + 2.0).sqrt() * 0.618_033_988_749_894_9;
            low + (high - low) * (x - x.floor())
        })
    }

    fn ascend(&self, mut q: JointVector) -> f64 {
        let mut best = self.stretch(&q);
        let mut step = 0.5;
        while step > 1e-3 {
            let before = best;
            for i in 1..DOF {
                for sign in [-1.0, 1.0] {
                    let (low, high) = self.limits(i);
                    let mut next = q;
                    next[i] = (q[i] + sign * step).clamp(low, high);
                    let stretch = self.stretch(&next);
                    if stretch > best {
                        (best, q) = (stretch, next);
                    }
                }
            }
            if best == before {
                step *= 0.5;
            }
        }
        best
    }

    fn stretch(&self, q: &JointVector) -> f64 {
        let frames = frames(self, q);
        let d = V3::from(frames[DOF].o) - V3::from(frames[1].o);
        d.dot(d).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rediestro_reaches_further_than_any_sampled_posture_but_not_further_than_its_links_are_long() {
        let model = ArmModel::rediestro();
        let reach = model.reach();
        assert!(reach < model.reach_bound());
        for k in 0..20_000 {
            assert!(model.stretch(&model.scattered(k)) <= reach);
        }
    }
}
