//! AHIC: augmented hybrid impedance control (Table 5-2).
//!
//! Along an axis with s = 1 the target behaves like a mass, spring and dashpot hung on X_d and pushed by the contact
//! force; along an axis with s = 0 like a mass and dashpot pushed by F_d − F_e. Everything is in the task frame; the
//! selection S and M_d, B_d, K_d are diagonal. An infinite or zero mass gives a non-finite result: commands are checked.

use crate::frame::{Motion, difference};
use arm::{Pose, Spatial};

/// Target impedance and desired wrench of a segment, one figure per axis: x y z, then about x y z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impedance {
    /// Diagonal of S: 1 = impedance (position) axis, 0 = force axis.
    pub selection: Spatial,
    /// Diagonal of M_d (kg, kg m²), positive.
    pub mass: Spatial,
    /// Diagonal of B_d (Ns/m, Nms/rad).
    pub damping: Spatial,
    /// Diagonal of K_d (N/m, Nm/rad).
    pub stiffness: Spatial,
    /// F_d: wrench that the tool is to exert on the environment along force axes (N, Nm).
    pub force: Spatial,
}

/// Ẍᵗ = M_d⁻¹ [ −F_e + (I−S) F_d − B_d (Ẋᵗ − S Ẋ_d) − K_d S (Xᵗ − X_d) ] + S Ẍ_d.
///
/// The modified scheme (Figure 5.18) puts in the integrated Xᵗ, Ẋᵗ; the original one (Figure 5.1) the measured X, Ẋ.
pub fn target_acceleration(impedance: &Impedance, xd: &Motion, xt: &Pose, xt_dot: &Spatial, fe: &Spatial) -> Spatial {
    let Impedance { selection: s, mass: m, damping: b, stiffness: k, force: fd } = impedance;
    let (xd_dot, xd_ddot) = (&xd.twist, &xd.acceleration);
    let x = difference(xt, &xd.pose);
    Spatial::from_fn(|i, _| {
        (-fe[i] + (1.0 - s[i]) * fd[i] - b[i] * (xt_dot[i] - s[i] * xd_dot[i]) - k[i] * s[i] * x[i]) / m[i]
            + s[i] * xd_ddot[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::rotation;
    use nalgebra::Vector3;

    fn impedance() -> Impedance {
        Impedance {
            selection: Spatial::new(1.0, 1.0, 0.0, 1.0, 1.0, 0.0),
            mass: Spatial::repeat(2.0),
            damping: Spatial::repeat(10.0),
            stiffness: Spatial::repeat(50.0),
            force: Spatial::repeat(8.0),
        }
    }

    fn pose(p: Vector3<f64>, v: Vector3<f64>) -> Pose {
        Pose { p, r: rotation::exp(&v) }
    }

    #[test]
    fn every_term_acts_on_its_axes_and_with_its_sign() {
        let xd = Motion {
            pose: pose(Vector3::new(0.1, 0.0, 5.0), Vector3::zeros()),
            twist: Spatial::repeat(0.5),
            acceleration: Spatial::repeat(3.0),
        };
        let xt = pose(Vector3::new(0.3, 0.0, 0.0), Vector3::new(0.02, 0.0, 0.0));
        let xt_dot = Spatial::repeat(0.2);
        let fe = Spatial::new(4.0, 0.0, 6.0, 0.0, 1.0, 2.0);
        let a = target_acceleration(&impedance(), &xd, &xt, &xt_dot, &fe);
        // by hand: x: (−4 − 10(0.2−0.5) − 50·0.2)/2 + 3, z: (−6 + 8 − 10·0.2)/2, about x: (3 − 50·0.02)/2 + 3, …
        let expected = Spatial::new(-2.5, 4.5, 0.0, 4.0, 4.0, 2.0);
        assert!((a - expected).amax() < 1e-12, "{a}");
    }

    #[test]
    fn a_turned_target_is_turned_back_to_the_desired_axes_even_beyond_a_quarter_turn() {
        let xd = Motion::at_rest(pose(Vector3::zeros(), Vector3::zeros()));
        for angle in [0.1, 1.0, 2.0, 3.0] {
            let xt = pose(Vector3::zeros(), Vector3::new(0.0, angle, 0.0));
            let a = target_acceleration(&impedance(), &xd, &xt, &Spatial::zeros(), &Spatial::zeros());
            assert!((a[4] + 25.0 * angle).abs() < 1e-9, "{angle}: {}", a[4]);
        }
    }
}
