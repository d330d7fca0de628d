//! Joint-limit avoidance as an additional task of redundancy resolution (§5.5; Seraji's configuration control).
//!
//! Each joint has a buffer inside its limits. In it the task J_c = eᵢᵀ asks for a return to the buffer's inner edge, with
//! a weight that grows smoothly from zero at the edge to its greatest value at the limit. A continuous joint (infinite
//! limits) never is in a buffer.

use arm::{DOF, JointVector};

/// Parameters of the task.
#[derive(Clone, Debug)]
pub struct JointLimits {
    /// Lower limits (rad).
    pub lower: JointVector,
    /// Upper limits (rad).
    pub upper: JointVector,
    /// Width of the buffer inside each limit (rad).
    pub buffer: f64,
    /// k_p (1/s²); k_v = 2√k_p.
    pub kp: f64,
    /// Weight at the limit and beyond it.
    pub max_weight: f64,
}

/// What the task asks for: W_c and z̈ʳ, joint by joint (J_c is the identity, J̇_c = 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitTask {
    /// Diagonal of W_c; zero for a joint outside its buffers.
    pub weight: JointVector,
    /// z̈ʳ (rad/s²).
    pub acceleration: JointVector,
}

impl LimitTask {
    /// Nothing asked for.
    pub fn none() -> LimitTask {
        LimitTask { weight: JointVector::zeros(), acceleration: JointVector::zeros() }
    }

    /// Whether a joint is in a buffer.
    pub fn is_active(&self) -> bool {
        self.weight.iter().any(|&w| w > 0.0)
    }
}

impl JointLimits {
    /// z̈ʳ = k_p (q_edge − qᵢ) − k_v q̇ᵢ with weight w_max · ½(1 − cos πs), s = depth/buffer in [0, 1].
    pub fn task(&self, q: &JointVector, qd: &JointVector) -> LimitTask {
        let mut task = LimitTask::none();
        for i in 0..DOF {
            let edge = q[i].clamp(self.lower[i] + self.buffer, self.upper[i] - self.buffer);
            if q[i] == edge {
                continue;
            }
            let s = ((q[i] - edge).abs() / self.buffer).min(1.0);
            task.weight[i] = self.max_weight * 0.5 * (1.0 - libm::cos(std::f64::consts::PI * s));
            task.acceleration[i] = self.kp * (edge - q[i]) - 2.0 * self.kp.sqrt() * qd[i];
        }
        task
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> JointLimits {
        JointLimits {
            lower: JointVector::repeat(-2.0),
            upper: JointVector::from([2.0, 2.0, 2.0, 2.0, 2.0, 2.0, f64::INFINITY]),
            buffer: 0.2,
            kp: 100.0,
            max_weight: 10.0,
        }
    }

    #[test]
    fn each_joint_in_its_buffer_is_sent_back_to_the_inner_edge() {
        let q = JointVector::from([0.0, 1.8, 1.9, -1.9, 2.1, -1.85, 50.0]);
        let qd = JointVector::from([1.0, 1.0, 0.5, 0.0, 0.0, -0.1, 1.0]);
        let task = limits().task(&q, &qd);
        let weight = [0.0, 0.0, 5.0, 5.0, 10.0];
        assert!((0..5).all(|i| (task.weight[i] - weight[i]).abs() < 1e-9));
        // s = 1/4: ½(1 − cos 45°)
        assert!((task.weight[5] - 10.0 * 0.5 * (1.0 - 0.5f64.sqrt())).abs() < 1e-9);
        assert!((task.acceleration[2] - (100.0 * -0.1 - 20.0 * 0.5)).abs() < 1e-9);
        assert!((task.acceleration[3] - 10.0).abs() < 1e-9);
        assert!((task.acceleration[5] - (5.0 + 2.0)).abs() < 1e-9);
        assert_eq!((task.weight[6], task.acceleration[6]), (0.0, 0.0));
        assert!(task.is_active());
    }

    #[test]
    fn in_the_middle_of_its_range_no_joint_is_asked_for_anything() {
        let task = limits().task(&JointVector::repeat(0.3), &JointVector::repeat(9.0));
        assert_eq!(task, LimitTask::none());
        assert!(!task.is_active());
    }
}
