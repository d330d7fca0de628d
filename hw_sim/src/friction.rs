//! Dry friction that truly sticks: elasto-plastic bristles.
//!
//! Below breakaway a bristle is a spring (with damper), so a body at rest stays where it is for ever, under ripple too, in
//! both directions. At breakaway it yields: the force stays at the capacity and the bristle is dragged along (return
//! mapping; the limit of Dupont's elasto-plastic model for a sharp transition). Neither drag nor yield can create energy.
//! Nothing here fails; a capacity of zero is no friction.

use arm::drives::JointDrive;
use arm::{Pair, Real};

/// Damping of sticking bristles, as a ratio of the critical damping of the rotor on them.
const STICKING_DAMPING_RATIO: f64 = 0.5;

/// A spring and damper that yields at a capacity (units of one axis: N or Nm, m or rad).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle<T = f64> {
    /// Force per deflection.
    pub stiffness: T,
    /// Deflection per force; 0 where there is no friction.
    compliance: T,
    /// Force per speed while sticking.
    pub damping: T,
}

impl Bristle {
    /// A bristle on which `inertia` rings with `STICKING_DAMPING_RATIO`.
    pub fn holding(stiffness: f64, inertia: f64) -> Bristle {
        Bristle {
            stiffness,
            compliance: if stiffness > 0.0 { 1.0 / stiffness } else { 0.0 },
            damping: 2.0 * STICKING_DAMPING_RATIO * (stiffness * inertia).sqrt(),
        }
    }
}

impl<T: Real> Bristle<T> {
    /// The deflection that remains of `deflection` when the bristle carries at most `capacity`.
    #[inline(always)]
    pub fn held(&self, deflection: T, capacity: T) -> T {
        deflection.within(capacity * self.compliance)
    }

    /// Friction force against a motion with speed `v`, for a deflection within [`Bristle::held`].
    #[inline(always)]
    pub fn force(&self, deflection: T, v: T, capacity: T) -> T {
        (self.stiffness * deflection + self.damping * v).within(capacity)
    }
}

/// Friction of one drive at the output side: Stribeck curve between breakaway and Coulomb friction, a part proportional to
/// the load, viscous friction, and sticking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFriction<T = f64> {
    coulomb: T,
    load_part: T,
    viscous: T,
    /// Breakaway over Coulomb friction, less 1.
    stribeck_rise: T,
    /// s/rad.
    per_stribeck_speed: T,
    bristle: Bristle<T>,
}

impl JointFriction {
    /// Friction of `drive`, all of it times `scale`.
    pub fn new(drive: &JointDrive, scale: f64) -> JointFriction {
        let stiffness = drive.sticking_stiffness_nm_per_rad(scale);
        JointFriction {
            coulomb: scale * drive.coulomb_nm,
            load_part: scale * drive.load_part,
            viscous: scale * drive.viscous_nms_per_rad,
            stribeck_rise: drive.breakaway_ratio - 1.0,
            per_stribeck_speed: 1.0 / drive.stribeck_speed_rad_per_s,
            bristle: Bristle::holding(stiffness, drive.rotor_inertia_at_output_kg_m2),
        }
    }
}

impl<T: Real> JointFriction<T> {
    /// Share of the Stribeck rise that is left at speed `v` (rad/s): all at rest.
    #[inline(always)]
    pub fn stribeck(&self, v: T) -> T {
        let s = v * self.per_stribeck_speed;
        (s * s).exp_minus()
    }

    /// Largest dry friction, where `stribeck` is left, while the transmission carries `load` (Nm): breakaway at rest.
    #[inline(always)]
    pub fn capacity(&self, stribeck: T, load: T) -> T {
        let coulomb = self.coulomb + self.load_part * load.abs();
        coulomb + coulomb * self.stribeck_rise * stribeck
    }

    /// Torque against the motion (Nm) and the deflection that remains, for a deflection (rad), a speed (rad/s) and the
    /// capacity at it (Nm).
    #[inline(always)]
    pub fn torque(&self, deflection: T, v: T, capacity: T) -> (T, T) {
        let held = self.bristle.held(deflection, capacity);
        (self.bristle.force(held, v, capacity) + self.viscous * v, held)
    }
}

impl Bristle<Pair> {
    /// Those of two joints.
    pub fn of_two(a: &Bristle, b: &Bristle) -> Bristle<Pair> {
        let both = |part: fn(&Bristle) -> f64| Pair::new([part(a), part(b)]);
        Bristle { stiffness: both(|x| x.stiffness), compliance: both(|x| x.compliance), damping: both(|x| x.damping) }
    }
}

impl JointFriction<Pair> {
    /// That of two joints.
    pub fn of_two(a: &JointFriction, b: &JointFriction) -> JointFriction<Pair> {
        let both = |part: fn(&JointFriction) -> f64| Pair::new([part(a), part(b)]);
        JointFriction {
            coulomb: both(|x| x.coulomb),
            load_part: both(|x| x.load_part),
            viscous: both(|x| x.viscous),
            stribeck_rise: both(|x| x.stribeck_rise),
            per_stribeck_speed: both(|x| x.per_stribeck_speed),
            bristle: Bristle::of_two(&a.bristle, &b.bristle),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::drives::DriveData;

    fn joint_2() -> JointDrive {
        DriveData::rediestro().joints[1].clone()
    }

    fn capacity(friction: &JointFriction, v: f64, load: f64) -> f64 {
        friction.capacity(friction.stribeck(v), load)
    }

    /// A rotor alone with its friction, for `seconds` at 10 kHz; its travel and final speed.
    fn travel(friction: &JointFriction, inertia: f64, seconds: f64, torque: impl Fn(f64) -> f64) -> (f64, f64) {
        let (mut x, mut v, mut z, h) = (0.0, 0.0, 0.0, 1e-4);
        for n in 0..(seconds / h) as u64 {
            let (f, held) = friction.torque(z, v, capacity(friction, v, 0.0));
            v += h * (torque(n as f64 * h) - f) / inertia;
            x += h * v;
            z = held + h * v;
        }
        (x, v)
    }

    #[test]
    fn a_joint_below_breakaway_stays_at_rest_for_60_s_in_both_directions_under_ripple_too() {
        let drive = joint_2();
        let friction = JointFriction::new(&drive, 1.0);
        let breakaway = drive.breakaway_at_load_nm(0.0);
        for sign in [1.0, -1.0] {
            for ripple in [0.0, 0.3] {
                let torque =
                    |t: f64| sign * breakaway * (0.65 + ripple * libm::sin(2.0 * std::f64::consts::PI * 50.0 * t));
                let (x_1, _) = travel(&friction, 4.0, 1.0, torque);
                let (x_60, v_60) = travel(&friction, 4.0, 60.0, torque);
                assert!((x_60 - x_1).abs() < 1e-7, "creep {} rad", x_60 - x_1);
                assert!(x_60.abs() < drive.presliding_rad && (ripple > 0.0 || v_60.abs() < 1e-12));
            }
        }
    }

    #[test]
    fn a_joint_above_breakaway_slides_at_the_speed_that_viscous_and_coulomb_friction_leave() {
        let drive = joint_2();
        let friction = JointFriction::new(&drive, 1.0);
        for sign in [1.0, -1.0] {
            let (_, v) = travel(&friction, 4.0, 5.0, |_| sign * 1.05 * drive.breakaway_at_load_nm(0.0));
            let expected = (1.05 * drive.breakaway_at_load_nm(0.0) - drive.coulomb_nm) / drive.viscous_nms_per_rad;
            assert!((v - sign * expected).abs() < 1e-3 * expected, "{v} {expected}");
        }
    }

    #[test]
    fn breakaway_grows_with_the_load_and_all_of_it_with_the_scale() {
        let drive = joint_2();
        for scale in [0.0, 1.0, 2.0] {
            let friction = JointFriction::new(&drive, scale);
            assert!((capacity(&friction, 0.0, -78.0) - scale * drive.breakaway_at_load_nm(78.0)).abs() < 1e-12);
            assert!((capacity(&friction, 1.0, 78.0) - scale * drive.coulomb_at_load_nm(78.0)).abs() < 1e-12);
            assert!(
                (friction.torque(0.0, 1.0, capacity(&friction, 1.0, 0.0)).0
                    - scale * (drive.coulomb_nm + drive.viscous_nms_per_rad))
                    .abs()
                    < 1e-12
            );
        }
    }

    #[test]
    fn a_closed_path_never_yields_energy() {
        let friction = JointFriction::new(&joint_2(), 1.0);
        // an oscillation that slides, sticks and reverses: work done against friction, bristle at rest at both ends
        for (amplitude, omega) in [(1e-4, 100.0), (3e-4, 30.0), (0.02, 5.0), (0.3, 3.0)] {
            let (mut z, mut work, h) = (0.0, 0.0, 1e-5);
            for n in 0..(4.0 * std::f64::consts::PI / omega / h) as u64 {
                let v = amplitude * omega * libm::cos(omega * n as f64 * h);
                let (f, held) = friction.torque(z, v, capacity(&friction, v, 0.0));
                work += f * v * h;
                z = held + h * v;
                assert!(work >= -1e-9, "{work} J gained");
            }
        }
    }
}
