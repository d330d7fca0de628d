//! Dry friction that truly sticks: elasto-plastic bristles.
//!
//! Below breakaway a bristle is a spring (with damper), so a body at rest stays where it is for ever, under ripple too, in
//! both directions. At breakaway it yields: the force stays at the capacity and the bristle is dragged along (return
//! mapping; the limit of Dupont's elasto-plastic model for a sharp transition). Neither drag nor yield can create energy.
//! Nothing here fails; a capacity of zero is no friction.

use arm::drives::JointDrive;

/// Damping of sticking bristles, as a ratio of the critical damping of the rotor on them.
const STICKING_DAMPING_RATIO: f64 = 0.5;

/// A spring and damper that yields at a capacity (units of one axis: N or Nm, m or rad).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle {
    /// Force per deflection.
    pub stiffness: f64,
    /// Deflection per force; 0 where there is no friction.
    compliance: f64,
    /// Force per speed while sticking.
    pub damping: f64,
}

/// `x` cut to ±`limit`, which is not negative.
#[inline(always)]
pub(crate) fn within(x: f64, limit: f64) -> f64 {
    // two instructions; `clamp` first looks for a limit that is no number
    let below = if x > limit { limit } else { x };
    if below < -limit { -limit } else { below }
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

    /// The deflection that remains of `deflection` when the bristle carries at most `capacity`.
    #[inline(always)]
    pub fn held(&self, deflection: f64, capacity: f64) -> f64 {
        within(deflection, capacity * self.compliance)
    }

    /// Friction force against a motion with speed `v`, for a deflection within [`Bristle::held`].
    #[inline(always)]
    pub fn force(&self, deflection: f64, v: f64, capacity: f64) -> f64 {
        within(self.stiffness * deflection + self.damping * v, capacity)
    }
}

/// Friction of one drive at the output side: Stribeck curve between breakaway and Coulomb friction, a part proportional to
/// the load, viscous friction, and sticking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFriction {
    coulomb: f64,
    load_part: f64,
    viscous: f64,
    /// Breakaway over Coulomb friction, less 1.
    stribeck_rise: f64,
    /// s/rad.
    per_stribeck_speed: f64,
    bristle: Bristle,
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

    /// Largest dry friction at speed `v` (rad/s) while the transmission carries `load` (Nm): breakaway at rest.
    #[inline(always)]
    pub fn capacity(&self, v: f64, load: f64) -> f64 {
        let coulomb = self.coulomb + self.load_part * load.abs();
        let s = v * self.per_stribeck_speed;
        coulomb * (1.0 + self.stribeck_rise * stribeck(s * s))
    }

    /// Torque against the motion (Nm) and the deflection that remains, for a deflection (rad) and speed (rad/s).
    #[inline(always)]
    pub fn torque(&self, deflection: f64, v: f64, load: f64) -> (f64, f64) {
        let capacity = self.capacity(v, load);
        let held = self.bristle.held(deflection, capacity);
        (self.bristle.force(held, v, capacity) + self.viscous * v, held)
    }
}

/// exp(−x) for x ≥ 0: a series to the last bit where joints stick or creep, nothing where it is below the last bit of 1.
#[inline(always)]
fn stribeck(x: f64) -> f64 {
    if x < 1.0 / 16.0 {
        const SERIES: [f64; 9] =
            [1.0 / 40_320.0, -1.0 / 5_040.0, 1.0 / 720.0, -1.0 / 120.0, 1.0 / 24.0, -1.0 / 6.0, 1.0 / 2.0, -1.0, 1.0];
        SERIES.iter().fold(0.0, |sum, a| sum * x + a)
    } else if x < 37.2 {
        libm::exp(-x)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::drives::DriveData;

    fn joint_2() -> JointDrive {
        DriveData::rediestro().joints[1].clone()
    }

    /// A rotor alone with its friction, for `seconds` at 10 kHz; its travel and final speed.
    fn travel(friction: &JointFriction, inertia: f64, seconds: f64, torque: impl Fn(f64) -> f64) -> (f64, f64) {
        let (mut x, mut v, mut z, h) = (0.0, 0.0, 0.0, 1e-4);
        for n in 0..(seconds / h) as u64 {
            let (f, held) = friction.torque(z, v, 0.0);
            v += h * (torque(n as f64 * h) - f) / inertia;
            x += h * v;
            z = held + h * v;
        }
        (x, v)
    }

    #[test]
    fn the_stribeck_curve_is_the_exponential_to_the_last_bit() {
        for k in 0..100_000 {
            let x = f64::from(k) * 4e-4;
            let error = (stribeck(x) - libm::exp(-x)).abs();
            assert!(error <= f64::EPSILON, "{x}: {error:e}");
        }
        assert!(stribeck(f64::NAN) == 0.0, "a runaway is found by its speed");
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
            assert!((friction.capacity(0.0, -78.0) - scale * drive.breakaway_at_load_nm(78.0)).abs() < 1e-12);
            assert!((friction.capacity(1.0, 78.0) - scale * drive.coulomb_at_load_nm(78.0)).abs() < 1e-12);
            assert!(
                (friction.torque(0.0, 1.0, 0.0).0 - scale * (drive.coulomb_nm + drive.viscous_nms_per_rad)).abs()
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
                let (f, held) = friction.torque(z, v, 0.0);
                work += f * v * h;
                z = held + h * v;
                assert!(work >= -1e-9, "{work} J gained");
            }
        }
    }
}
