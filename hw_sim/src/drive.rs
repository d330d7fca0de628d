//! One joint's drive: amplifier and motor, rotor, friction, brake, and the flexible transmission with its kinematic error.
//!
//! All quantities are at the output side. Rotor inertia, torques and angles are those of the motor times N², N, 1/N.

use crate::friction::{Bristle, JointFriction, within};
use arm::drives::JointDrive;

/// Drive of one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// N² J_m, kg m².
    pub rotor: f64,
    /// Its reciprocal.
    pub mobility: f64,
    /// N.
    pub gear_ratio: f64,
    /// K, Nm/rad.
    pub stiffness: f64,
    damping: f64,
    torque_per_volt: f64,
    torque_limit: f64,
    friction: JointFriction,
    brake: Bristle,
    brake_capacity: f64,
    kinematic_error: Option<KinematicError>,
}

/// Torques on one rotor and what remains of its bristles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorLoss {
    /// Friction against the motion, Nm.
    pub friction: f64,
    /// Brake against the motion, Nm.
    pub brake: f64,
    /// Deflection of the friction bristle that remains, rad.
    pub presliding: f64,
    /// Deflection of the brake that remains, rad.
    pub brake_deflection: f64,
}

/// What the transmission carries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transmission {
    /// Torque on the link, Nm.
    pub on_link: f64,
    /// Torque on the rotor that answers it, Nm; differs by the gear's momentary ratio.
    pub on_rotor: f64,
    /// Deflection, rad.
    pub deflection: f64,
}

impl Drive {
    /// The drive described by `data`, friction times `friction_scale`. `braked_inertia` (kg m²) is what an engaged brake
    /// has to hold: the rotor, with rigid joints the link too.
    pub fn new(data: &JointDrive, friction_scale: f64, with_kinematic_error: bool, braked_inertia: f64) -> Drive {
        Drive {
            rotor: data.rotor_inertia_at_output_kg_m2,
            mobility: 1.0 / data.rotor_inertia_at_output_kg_m2,
            gear_ratio: data.gear_ratio,
            stiffness: data.stiffness_nm_per_rad,
            damping: data.damping_nms_per_rad(),
            torque_per_volt: data.amplifier_nm_per_v,
            torque_limit: data.torque_limit_nm,
            friction: JointFriction::new(data, friction_scale),
            brake: Bristle::holding(data.brake_stiffness_nm_per_rad(braked_inertia), braked_inertia),
            brake_capacity: data.brake_nm,
            kinematic_error: with_kinematic_error.then(|| KinematicError::new(data)),
        }
    }

    /// Motor torque for an amplifier input, Nm: current control with saturation.
    #[inline]
    pub fn motor_torque(&self, volts: f64) -> f64 {
        within(volts * self.torque_per_volt, self.torque_limit)
    }

    /// Friction and brake at rotor speed `v` (rad/s) while the transmission carries `load` (Nm); the brake holds this
    /// share of its torque, 0 = released.
    #[inline]
    pub fn loss(&self, presliding: f64, brake_deflection: f64, v: f64, load: f64, braked: f64) -> RotorLoss {
        let (friction, presliding) = self.friction.torque(presliding, v, load);
        if braked == 0.0 {
            return RotorLoss { friction, presliding, ..RotorLoss::default() };
        }
        let capacity = self.brake_capacity * braked;
        let held = self.brake.held(brake_deflection, capacity);
        let brake = self.brake.force(held, v, capacity);
        RotorLoss { friction, brake, presliding, brake_deflection: held }
    }

    /// The brake's deflection (rad) under a torque (Nm) that it holds at rest.
    pub fn brake_deflection_under(&self, torque: f64) -> f64 {
        self.brake.held(torque / self.brake.stiffness, self.brake_capacity)
    }

    /// Spring, damper and kinematic error e: deflection θ + e(θ_m) − q, whose rate is θ̇ (1 + N e′) − q̇. The rotor feels the
    /// torque times (1 + N e′), so that the gear conserves power.
    #[inline]
    pub fn transmission(&self, theta: f64, theta_dot: f64, q: f64, qd: f64) -> Transmission {
        let (error, slope) = self.kinematic_error.as_ref().map_or((0.0, 0.0), |e| e.at(self.gear_ratio * theta));
        let ratio = 1.0 + self.gear_ratio * slope;
        let deflection = theta + error - q;
        let on_link = self.stiffness * deflection + self.damping * (theta_dot * ratio - qd);
        Transmission { on_link, on_rotor: on_link * ratio, deflection }
    }

    /// Motor angle (over N) at which the transmission carries `torque` to a link resting at `q`.
    pub fn motor_angle_under(&self, torque: f64, q: f64) -> f64 {
        let mut theta = q + torque / self.stiffness;
        // a contraction: the error's slope N e′ is far below 1
        for _ in 0..100 {
            let error = self.kinematic_error.as_ref().map_or(0.0, |e| e.at(self.gear_ratio * theta).0);
            theta = q + torque / self.stiffness - error;
        }
        theta
    }
}

/// Σ A_k sin(k θ_m + φ_k) for k = 1, 2, 4, as products of the motor angle's sine and cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
struct KinematicError {
    /// A_k cos φ_k.
    in_phase: [f64; 3],
    /// A_k sin φ_k.
    quadrature: [f64; 3],
}

impl KinematicError {
    fn new(data: &JointDrive) -> KinematicError {
        let part = |f: fn(f64) -> f64| {
            std::array::from_fn(|k| data.kinematic_error_rad[k] * f(data.kinematic_error_phase_rad[k]))
        };
        KinematicError { in_phase: part(libm::cos), quadrature: part(libm::sin) }
    }

    /// Error (rad at the output) and its slope over the motor angle.
    #[inline]
    fn at(&self, motor: f64) -> (f64, f64) {
        let (s1, c1) = sin_cos(motor);
        let (s2, c2) = (2.0 * s1 * c1, 1.0 - 2.0 * s1 * s1);
        let (s4, c4) = (2.0 * s2 * c2, 1.0 - 2.0 * s2 * s2);
        let (a, b) = (&self.in_phase, &self.quadrature);
        let error = a[0] * s1 + b[0] * c1 + a[1] * s2 + b[1] * c2 + a[2] * s4 + b[2] * c4;
        let slope = a[0] * c1 - b[0] * s1 + 2.0 * (a[1] * c2 - b[1] * s2) + 4.0 * (a[2] * c4 - b[2] * s4);
        (error, slope)
    }
}

/// Sine and cosine to 1e-12 for |x| < 1e6 rad, without branches: faster than the `libm` crate, which reduces
/// large angles in general. Series of a quarter of the angle, doubled twice.
#[inline]
fn sin_cos(x: f64) -> (f64, f64) {
    // adding and subtracting 1.5 2⁵² rounds; 2π = HIGH + LOW, HIGH with 33 bits so that turns · HIGH is exact
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const HIGH: f64 = f64::from_bits(0x4019_21FB_5440_0000);
    const LOW: f64 = std::f64::consts::TAU - HIGH;
    let turns = (x * (1.0 / std::f64::consts::TAU) + ROUND) - ROUND;
    let quarter = ((x - turns * HIGH) - turns * LOW) * 0.25;
    let z = quarter * quarter;
    let series = |a: [f64; 7]| a.iter().rev().fold(1.0, |sum, divisor| 1.0 - z * (1.0 / divisor) * sum);
    let mut s = quarter * series([6.0, 20.0, 42.0, 72.0, 110.0, 156.0, 210.0]);
    let mut c = series([2.0, 12.0, 30.0, 56.0, 90.0, 132.0, 182.0]);
    for _ in 0..2 {
        (s, c) = (2.0 * s * c, 1.0 - 2.0 * s * s);
    }
    (s, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::drives::DriveData;

    fn drive(joint: usize) -> (JointDrive, Drive) {
        let data = DriveData::rediestro().joints[joint].clone();
        let drive = Drive::new(&data, 1.0, true, data.rotor_inertia_at_output_kg_m2);
        (data, drive)
    }

    #[test]
    fn the_kinematic_error_is_the_drive_datas_series_and_its_slope_the_derivative() {
        for joint in 0..7 {
            let (data, drive) = drive(joint);
            let error = drive.kinematic_error.expect("on");
            for k in -50..50 {
                let motor = 0.37 * f64::from(k);
                let (e, slope) = error.at(motor);
                assert!((e - data.kinematic_error(motor)).abs() < 1e-15);
                let difference = (data.kinematic_error(motor + 1e-5) - data.kinematic_error(motor - 1e-5)) / 2e-5;
                assert!((slope - difference).abs() < 1e-12, "{slope} {difference}");
            }
        }
    }

    #[test]
    fn sines_and_cosines_are_those_of_the_libm_crate() {
        for k in -20_000..20_000 {
            let x = 0.0517 * f64::from(k);
            let ((s, c), (sin, cos)) = (sin_cos(x), libm::sincos(x));
            assert!((s - sin).abs() < 1e-12 && (c - cos).abs() < 1e-12, "{x}: {s} {c}");
        }
    }

    #[test]
    fn the_transmission_conserves_power_apart_from_its_damper() {
        let (data, drive) = drive(3);
        let (theta, theta_dot, q, qd) = (0.301, 0.2, 0.3, -0.1);
        let t = drive.transmission(theta, theta_dot, q, qd);
        let motor = data.gear_ratio * theta;
        let error_rate = (data.kinematic_error(motor + 1e-5) - data.kinematic_error(motor - 1e-5)) / 2e-5
            * data.gear_ratio
            * theta_dot;
        let rate = theta_dot + error_rate - qd;
        // power from the rotor = power to the link + power into spring and damper
        assert!((t.on_rotor * theta_dot - (t.on_link * qd + t.on_link * rate)).abs() < 1e-8);
        let spring = t.on_link - data.damping_nms_per_rad() * rate;
        assert!((spring - data.stiffness_nm_per_rad * t.deflection).abs() < 1e-8);
    }

    #[test]
    fn the_amplifier_saturates_at_the_torque_limit() {
        let (data, drive) = drive(0);
        assert_eq!(drive.motor_torque(4.0), 100.0);
        assert_eq!(drive.motor_torque(-11.0), -data.torque_limit_nm);
    }

    #[test]
    fn the_motor_angle_under_a_torque_is_where_the_transmission_carries_it() {
        let (_, drive) = drive(1);
        for torque in [-78.0, 0.0, 169.0] {
            let theta = drive.motor_angle_under(torque, -0.267);
            assert!((drive.transmission(theta, 0.0, -0.267, 0.0).on_link - torque).abs() < 1e-9);
        }
    }

    #[test]
    fn an_engaged_brake_holds_up_to_its_torque_and_slips_beyond() {
        let (data, drive) = drive(0);
        // applied at once, so that it rings up to 16 % higher
        for (torque, slips) in [(0.8 * data.brake_nm, false), (1.3 * data.brake_nm, true)] {
            let (mut x, mut v, mut z, mut b, h) = (0.0, 0.0, 0.0, 0.0, 1e-4);
            for _ in 0..20_000 {
                let loss = drive.loss(z, b, v, 0.0, 1.0);
                v += h * (torque - loss.friction - loss.brake) / drive.rotor;
                x += h * v;
                (z, b) = (loss.presliding + h * v, loss.brake_deflection + h * v);
            }
            assert_eq!(v > 0.1, slips);
            assert_eq!(x > 2.0 * drive.brake_deflection_under(data.brake_nm), slips, "{x}");
        }
    }
}
