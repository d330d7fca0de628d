//! Everything that the plant remembers between two instants.

use arm::JointVector;
use nalgebra::Vector3;

/// Most contact points that a plant can have: planes count one, a peg its sampled points.
pub const CONTACT_POINTS: usize = 64;

/// State of arm, drives and contacts. Motor quantities are divided by the gear ratio; with rigid joints they equal the
/// link's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Link angles, rad.
    pub q: JointVector,
    /// Link speeds, rad/s.
    pub qd: JointVector,
    /// Motor angles, rad.
    pub theta: JointVector,
    /// Motor speeds, rad/s.
    pub theta_dot: JointVector,
    /// Deflections of the friction bristles, rad.
    pub presliding: JointVector,
    /// Deflections of the engaged brakes, rad; 0 where released.
    pub brake: JointVector,
    /// Torques that the transmissions carried in the step before, Nm: the load of rigid joints' friction.
    pub load: JointVector,
    /// Tangential deflections of the contact points, base axes, m; 0 out of contact.
    pub contact: [Vector3<f64>; CONTACT_POINTS],
}

impl State {
    /// At rest at these link angles, nothing deflected.
    pub fn at_rest(q: JointVector) -> State {
        let zero = JointVector::zeros();
        State {
            q,
            qd: zero,
            theta: q,
            theta_dot: zero,
            presliding: zero,
            brake: zero,
            load: zero,
            contact: [Vector3::zeros(); CONTACT_POINTS],
        }
    }

    /// First joint, with its value, that is not finite or moves faster than `speed_limit` (rad/s).
    pub fn out_of_domain(&self, speed_limit: f64) -> Option<(usize, f64)> {
        let limits =
            [(&self.qd, speed_limit), (&self.theta_dot, speed_limit), (&self.q, f64::MAX), (&self.theta, f64::MAX)];
        // without a branch for each: what is no number is not within a limit either
        let within = limits.iter().fold(true, |all, (v, limit)| v.iter().fold(all, |all, x| all & (x.abs() <= *limit)));
        if within {
            return None;
        }
        (0..arm::DOF).find_map(|i| limits.iter().find(|(v, limit)| !(v[i].abs() <= *limit)).map(|(v, _)| (i, v[i])))
    }
}
