//! ERC: the error reference controller of the modified scheme (Table 5-2).
//!
//! It pulls the tool onto the target trajectory, so that what the model does not know (friction above all) ends up as a
//! bounded difference Xᵗ − X instead of a lost force. Pure arithmetic: nothing here fails.

use arm::Spatial;

/// Gains of the error reference controller, the same on all axes.
#[derive(Clone, Copy, Debug)]
pub struct Gains {
    /// K_p, 1/s².
    pub kp: f64,
    /// K_v, 1/s.
    pub kv: f64,
}

/// Ẍʳ = Ẍᵗ + K_v (Ẋᵗ − Ẋ) + K_p (Xᵗ − X).
pub fn reference_acceleration(gains: &Gains, xt_ddot: &Spatial, error_rate: &Spatial, error: &Spatial) -> Spatial {
    xt_ddot + error_rate * gains.kv + error * gains.kp
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::difference;
    use arm::{Pose, rotation};
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn the_tool_is_accelerated_towards_the_target_and_turned_towards_its_axes() {
        let target = Pose { p: Vector3::new(0.0, 0.0, 0.01), r: rotation::exp(&Vector3::new(0.0, 0.02, 0.0)) };
        let tool = Pose { p: Vector3::zeros(), r: Matrix3::identity() };
        let error_rate = Spatial::new(0.0, 0.2, 0.0, 0.0, 0.0, 0.1);
        let gains = Gains { kp: 100.0, kv: 20.0 };
        let a = reference_acceleration(&gains, &Spatial::repeat(1.0), &error_rate, &difference(&target, &tool));
        assert!((a - Spatial::new(1.0, 5.0, 2.0, 1.0, 3.0, 3.0)).amax() < 1e-12);
    }
}
