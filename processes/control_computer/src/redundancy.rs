//! RR: redundancy resolution at the acceleration level (Table 5-2, §5.5).
//!
//! Of all joint accelerations it takes the one that minimises
//! (J q̈ + J̇q̇ − Ẍʳ)ᵀ W (·) + (q̈ − z̈ʳ)ᵀ W_c (·) + (q̈ + λ q̇)ᵀ W_v (·):
//! the task, the joint-limit task, and the damping of self-motion. W_v also bounds accelerations near a singularity, at
//! the price of the gain σ²/(σ² + w_v) along a singular value σ. Directions without any weight get no acceleration.

use crate::cholesky::{Cholesky, Row};
use crate::frame::TaskKinematics;
use crate::joint_limits::LimitTask;
use arm::{DOF, Jacobian, JointVector, Spatial, dot, transposed_times};

/// Weights of the least-squares problem.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Diagonal of W.
    pub task: Spatial,
    /// Diagonal of W_v.
    pub joint: JointVector,
    /// λ, 1/s.
    pub lambda: f64,
}

/// J, W, W_v and W_c at one posture, factorised.
#[derive(Clone, Copy, Debug)]
pub struct Resolution<'a> {
    weights: &'a Weights,
    tool: &'a TaskKinematics,
    limits: &'a LimitTask,
    normal: Cholesky,
}

impl<'a> Resolution<'a> {
    /// Factorises JᵀWJ + W_c + W_v.
    pub fn new(weights: &'a Weights, tool: &'a TaskKinematics, limits: &'a LimitTask) -> Resolution<'a> {
        let diagonal = weights.joint + limits.weight;
        Resolution {
            weights,
            tool,
            limits,
            normal: Cholesky::new(normal_matrix(&tool.jacobian, &weights.task, &diagonal)),
        }
    }

    /// q̈ᵗ = [JᵀWJ + W_c + W_v]⁻¹ [ JᵀW(Ẍʳ − J̇q̇) + W_c z̈ʳ − λ W_v q̇ ].
    pub fn joint_acceleration(&self, xr_ddot: &Spatial, qd: &JointVector) -> JointVector {
        let Weights { task: w, joint: wv, lambda } = self.weights;
        let (wc, zr_ddot) = (&self.limits.weight, &self.limits.acceleration);
        let weighted = w.component_mul(&(xr_ddot - self.tool.jdot_qd));
        self.normal.solve(
            &(transposed_times(&self.tool.jacobian, &weighted) + wc.component_mul(zr_ddot)
                - wv.component_mul(qd) * *lambda),
        )
    }

    /// Joint speeds that give the tool the twist Ẋ, resolved alike: [JᵀWJ + W_c + W_v]⁻¹ JᵀW Ẋ.
    pub fn joint_speed(&self, twist: &Spatial) -> JointVector {
        let weighted = self.weights.task.component_mul(twist);
        self.normal.solve(&transposed_times(&self.tool.jacobian, &weighted))
    }
}

/// Upper triangle of JᵀWJ + diag.
fn normal_matrix(j: &Jacobian, w: &Spatial, diagonal: &JointVector) -> [Row; DOF] {
    let (j, w) = (&j.data.0, &w.data.0[0]);
    let mut a = [Row::default(); DOF];
    for row in 0..DOF {
        let weighted: [f64; 6] = std::array::from_fn(|k| j[row][k] * w[k]);
        for column in row..DOF {
            a[row][column] = dot(&weighted, &j[column]);
        }
        a[row][row] += diagonal[row];
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::ArmModel;

    const TABLE_TOP_DEG: [f64; 7] = [69.2, -15.3, -72.0, -132.4, 159.8, 64.7, 104.0];

    fn tool_at(q: &JointVector, qd: &JointVector) -> TaskKinematics {
        let model = ArmModel::rediestro();
        arm::tip_motion(&model, q, qd)
    }

    fn table_top() -> JointVector {
        JointVector::from(TABLE_TOP_DEG.map(f64::to_radians))
    }

    fn weights(joint: f64, lambda: f64) -> Weights {
        Weights { task: Spatial::new(1.0, 2.0, 0.5, 1.0, 3.0, 1.0), joint: JointVector::repeat(joint), lambda }
    }

    /// The cost that RR is to minimise, as the module's documentation states it.
    fn cost(
        weights: &Weights,
        tool: &TaskKinematics,
        limits: &LimitTask,
        xr: &Spatial,
        qd: &JointVector,
        qdd: &JointVector,
    ) -> f64 {
        let task = tool.jacobian * qdd + tool.jdot_qd - xr;
        let limit = qdd - limits.acceleration;
        let damping = qdd + qd * weights.lambda;
        task.dot(&weights.task.component_mul(&task))
            + limit.dot(&limits.weight.component_mul(&limit))
            + damping.dot(&weights.joint.component_mul(&damping))
    }

    #[test]
    fn no_other_joint_acceleration_costs_less() {
        let qd = JointVector::from([0.3, -0.2, 0.1, 0.4, -0.3, 0.2, -0.1]);
        let tool = tool_at(&table_top(), &qd);
        let mut limits = LimitTask::none();
        (limits.weight[3], limits.acceleration[3]) = (2.0, -4.0);
        let weights = weights(1e-2, 2.0);
        let xr = Spatial::new(0.5, -1.0, 2.0, 0.3, -0.2, 0.7);
        let best = Resolution::new(&weights, &tool, &limits).joint_acceleration(&xr, &qd);
        let least = cost(&weights, &tool, &limits, &xr, &qd, &best);
        for i in 0..DOF {
            for step in [1e-3, -1e-3] {
                let mut other = best;
                other[i] += step;
                let rise = cost(&weights, &tool, &limits, &xr, &qd, &other) - least;
                // at the minimum the cost rises by ½ h² times its curvature, the same both ways
                let column = tool.jacobian.column(i);
                let curvature = column.component_mul(&weights.task).dot(&column) + weights.joint[i] + limits.weight[i];
                assert!((rise - step * step * curvature).abs() < 1e-12, "{i}: {rise}");
            }
        }
    }

    #[test]
    fn along_a_singular_value_the_gain_is_what_the_weight_leaves_of_it() {
        let tool = tool_at(&table_top(), &JointVector::zeros());
        let svd = tool.jacobian.svd(true, false);
        let w = 1e-2;
        let weights = Weights { task: Spatial::repeat(1.0), ..weights(w, 0.0) };
        let limits = LimitTask::none();
        let rr = Resolution::new(&weights, &tool, &limits);
        let u = svd.u.unwrap();
        for k in 0..6 {
            let direction: Spatial = u.column(k).into();
            let reached = tool.jacobian * rr.joint_acceleration(&direction, &JointVector::zeros());
            let sigma2 = svd.singular_values[k].powi(2);
            assert!((reached - direction * (sigma2 / (sigma2 + w))).amax() < 1e-9, "{k}");
        }
    }

    #[test]
    fn self_motion_decays_with_lambda_and_does_not_move_the_tool() {
        let (lambda, dt) = (2.0, 1e-4);
        let (weights, limits) = (weights(1e-3, lambda), LimitTask::none());
        let mut q = table_top();
        let null = |q: &JointVector| {
            let jt = tool_at(q, &JointVector::zeros()).jacobian.transpose();
            let projector = arm::JointMatrix::identity() - jt * jt.pseudo_inverse(1e-9).unwrap();
            let column: JointVector = projector.column(0).into();
            column / column.norm()
        };
        let mut qd = null(&q) * 0.5;
        let start = tool_at(&q, &qd).pose;
        for _ in 0..10_000 {
            let tool = tool_at(&q, &qd);
            // the task: keep the twist at zero, as ERC would
            let xr = tool.twist * -20.0;
            let qdd = Resolution::new(&weights, &tool, &limits).joint_acceleration(&xr, &qd);
            q += qd * dt + qdd * (0.5 * dt * dt);
            qd += qdd * dt;
        }
        let along = qd.dot(&null(&q)).abs();
        assert!((along / (0.5 * libm::exp(-lambda)) - 1.0).abs() < 0.03, "{along}");
        let end = tool_at(&q, &qd).pose;
        assert!((end.p - start.p).amax() < 2e-3, "{}", end.p - start.p);
    }

    #[test]
    fn one_joint_that_alone_moves_the_tool_needs_no_weight_of_its_own() {
        let model = ArmModel::slide(3.0);
        let zero = JointVector::zeros();
        let tool = arm::tip_motion(&model, &zero, &zero);
        let limits = LimitTask::none();
        for others in [1e-3, 0.0] {
            let mut weights = weights(others, 2.0);
            weights.joint[0] = 0.0;
            let rr = Resolution::new(&weights, &tool, &limits);
            let qdd = rr.joint_acceleration(&Spatial::repeat(1.5), &zero);
            let expected = JointVector::from([1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            assert!((qdd - expected).amax() < 1e-15, "{qdd}");
        }
    }
}
