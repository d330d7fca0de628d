//! One joint's drive: amplifier and motor, rotor, friction, brake, and the flexible transmission with its kinematic error.
//!
//! All quantities are at the output side. Rotor inertia, torques and angles are those of the motor times N², N, 1/N. The
//! equations are written once, for a joint (`f64`) and for two at a time (`Pair`).

use crate::friction::{Bristle, JointFriction};
use arm::drives::JointDrive;
use arm::{Pair, Real};

/// Drive of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive<T = f64> {
    /// N² J_m, kg m².
    pub rotor: T,
    /// Its reciprocal.
    pub mobility: T,
    /// N.
    pub gear_ratio: T,
    /// K, Nm/rad.
    pub stiffness: T,
    damping: T,
    torque_per_volt: T,
    torque_limit: T,
    friction: JointFriction<T>,
    brake: Bristle<T>,
    brake_capacity: T,
    kinematic_error: KinematicError<T>,
}

/// Torques on one rotor and what remains of its bristles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorLoss<T = f64> {
    /// Friction against the motion, Nm.
    pub friction: T,
    /// Brake against the motion, Nm.
    pub brake: T,
    /// Deflection of the friction bristle that remains, rad.
    pub presliding: T,
    /// Deflection of the brake that remains, rad.
    pub brake_deflection: T,
}

/// What the transmission carries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transmission<T = f64> {
    /// Torque on the link, Nm.
    pub on_link: T,
    /// Torque on the rotor that answers it, Nm; differs by the gear's momentary ratio.
    pub on_rotor: T,
    /// Deflection, rad.
    pub deflection: T,
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
            kinematic_error: KinematicError::new(data, if with_kinematic_error { 1.0 } else { 0.0 }),
        }
    }

    /// The gear is without kinematic error.
    pub fn has_true_gear(&self) -> bool {
        self.kinematic_error == KinematicError::default()
    }

    /// The brake's deflection (rad) under a torque (Nm) that it holds at rest.
    pub fn brake_deflection_under(&self, torque: f64) -> f64 {
        self.brake.held(torque / self.brake.stiffness, self.brake_capacity)
    }

    /// Motor angle (over N) at which the transmission carries `torque` to a link resting at `q`.
    pub fn motor_angle_under(&self, torque: f64, q: f64) -> f64 {
        let mut theta = q + torque / self.stiffness;
        // a contraction: the error's slope N e′ is far below 1
        for _ in 0..100 {
            theta = q + torque / self.stiffness - self.kinematic_error.at(self.gear_ratio * theta).0;
        }
        theta
    }
}

impl<T: Real> Drive<T> {
    /// Motor torque for an amplifier input, Nm: current control with saturation.
    #[inline]
    pub fn motor_torque(&self, volts: T) -> T {
        (volts * self.torque_per_volt).within(self.torque_limit)
    }

    /// Friction and brake at rotor speed `v` (rad/s), where `stribeck` is left, while the transmission carries `load` (Nm);
    /// the brake holds this share of its torque, 0 = released.
    #[inline(always)]
    pub fn loss(&self, bristles: (T, T), v: T, stribeck: T, load: T, braked: T) -> RotorLoss<T> {
        let (presliding, brake_deflection) = bristles;
        let (friction, presliding) = self.friction.torque(presliding, v, self.friction.capacity(stribeck, load));
        let capacity = self.brake_capacity * braked;
        let held = self.brake.held(brake_deflection, capacity);
        RotorLoss { friction, brake: self.brake.force(held, v, capacity), presliding, brake_deflection: held }
    }

    /// Where the gear's output would be without load at the motor angle `theta` (over N): θ + e(θ_m) with the kinematic error
    /// e, and how it moves with θ: 1 + N e′.
    #[inline(always)]
    pub fn gear(&self, theta: T) -> (T, T) {
        let (error, slope) = self.kinematic_error.at(self.gear_ratio * theta);
        (theta + error, T::of(1.0) + self.gear_ratio * slope)
    }

    /// Spring and damper behind the gear: deflection θ + e(θ_m) − q, whose rate is θ̇ (1 + N e′) − q̇. The rotor feels the
    /// torque times (1 + N e′), so that the gear conserves power.
    #[inline(always)]
    pub fn transmission(&self, (output, ratio): (T, T), theta_dot: T, q: T, qd: T) -> Transmission<T> {
        let deflection = output - q;
        let on_link = self.stiffness * deflection + self.damping * (theta_dot * ratio - qd);
        Transmission { on_link, on_rotor: on_link * ratio, deflection }
    }

    /// Share of the friction's Stribeck rise that is left at rotor speed `v` (rad/s).
    #[inline(always)]
    pub fn stribeck(&self, v: T) -> T {
        self.friction.stribeck(v)
    }
}

impl Drive<Pair> {
    /// Those of two joints.
    pub fn of_two(a: &Drive, b: &Drive) -> Drive<Pair> {
        let both = |part: fn(&Drive) -> f64| Pair::new([part(a), part(b)]);
        Drive {
            rotor: both(|x| x.rotor),
            mobility: both(|x| x.mobility),
            gear_ratio: both(|x| x.gear_ratio),
            stiffness: both(|x| x.stiffness),
            damping: both(|x| x.damping),
            torque_per_volt: both(|x| x.torque_per_volt),
            torque_limit: both(|x| x.torque_limit),
            friction: JointFriction::of_two(&a.friction, &b.friction),
            brake: Bristle::of_two(&a.brake, &b.brake),
            brake_capacity: both(|x| x.brake_capacity),
            kinematic_error: KinematicError::of_two(&a.kinematic_error, &b.kinematic_error),
        }
    }
}

/// Σ A_k sin(k θ_m + φ_k) for k = 1, 2, 4, as products of the motor angle's sine and cosine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct KinematicError<T = f64> {
    /// A_k cos φ_k.
    in_phase: [T; 3],
    /// A_k sin φ_k.
    quadrature: [T; 3],
}

impl KinematicError {
    /// That of `data`, times `scale`.
    fn new(data: &JointDrive, scale: f64) -> KinematicError {
        let part = |f: fn(f64) -> f64| {
            std::array::from_fn(|k| scale * data.kinematic_error_rad[k] * f(data.kinematic_error_phase_rad[k]))
        };
        KinematicError { in_phase: part(libm::cos), quadrature: part(libm::sin) }
    }
}

impl<T: Real> KinematicError<T> {
    /// Error (rad at the output) and its slope over the motor angle.
    #[inline(always)]
    fn at(&self, motor: T) -> (T, T) {
        let (s1, c1) = motor.sin_cos();
        let twice = |s: T, c: T| (T::of(2.0) * s * c, T::of(1.0) - T::of(2.0) * s * s);
        let (s2, c2) = twice(s1, c1);
        let (s4, c4) = twice(s2, c2);
        let (a, b) = (&self.in_phase, &self.quadrature);
        let error = (a[0] * s1 + b[0] * c1) + (a[1] * s2 + b[1] * c2) + (a[2] * s4 + b[2] * c4);
        let slope =
            (a[0] * c1 - b[0] * s1) + T::of(2.0) * (a[1] * c2 - b[1] * s2) + T::of(4.0) * (a[2] * c4 - b[2] * s4);
        (error, slope)
    }
}

impl KinematicError<Pair> {
    fn of_two(a: &KinematicError, b: &KinematicError) -> KinematicError<Pair> {
        let both = |a: &[f64; 3], b: &[f64; 3]| std::array::from_fn(|k| Pair::new([a[k], b[k]]));
        KinematicError { in_phase: both(&a.in_phase, &b.in_phase), quadrature: both(&a.quadrature, &b.quadrature) }
    }
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
            let error = drive.kinematic_error;
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
    fn two_joints_at_a_time_give_what_each_gives_alone() {
        let ((_, a), (_, b)) = (drive(1), drive(5));
        let pair = Drive::of_two(&a, &b);
        let of = |x: f64, y: f64| Pair::new([x, y]);
        let (theta, v, q, qd) = (of(0.3, -1.1), of(0.2, 0.01), of(0.301, -1.1003), of(0.1, 0.0));
        let (presliding, deflection, braked, volts) = (of(1e-4, -2e-3), of(1e-5, 2e-5), of(0.0, 0.5), of(3.0, -20.0));
        let t = pair.transmission(pair.gear(theta), v, q, qd);
        let loss = pair.loss((presliding, deflection), v, pair.stribeck(v), t.on_link, braked);
        let motor = pair.motor_torque(volts);
        for (lane, drive) in [a, b].iter().enumerate() {
            let only = |x: Pair| x.to_array()[lane];
            let v = only(v);
            let alone = drive.transmission(drive.gear(only(theta)), v, only(q), only(qd));
            assert_eq!(only(t.on_link), alone.on_link);
            assert_eq!((only(t.on_rotor), only(t.deflection)), (alone.on_rotor, alone.deflection));
            let bristles = (only(presliding), only(deflection));
            let lost = drive.loss(bristles, v, drive.stribeck(v), alone.on_link, only(braked));
            assert_eq!((only(loss.friction), only(loss.presliding)), (lost.friction, lost.presliding));
            assert_eq!((only(loss.brake), only(loss.brake_deflection)), (lost.brake, lost.brake_deflection));
            assert_eq!(only(motor), drive.motor_torque(only(volts)));
        }
    }

    #[test]
    fn the_transmission_conserves_power_apart_from_its_damper() {
        let (data, drive) = drive(3);
        let (theta, theta_dot, q, qd) = (0.301, 0.2, 0.3, -0.1);
        let t = drive.transmission(drive.gear(theta), theta_dot, q, qd);
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
            assert!((drive.transmission(drive.gear(theta), 0.0, -0.267, 0.0).on_link - torque).abs() < 1e-9);
        }
    }

    #[test]
    fn an_engaged_brake_holds_up_to_its_torque_and_slips_beyond() {
        let (data, drive) = drive(0);
        // applied at once, so that it rings up to 16 % higher
        for (torque, slips) in [(0.8 * data.brake_nm, false), (1.3 * data.brake_nm, true)] {
            let (mut x, mut v, mut z, mut b, h) = (0.0, 0.0, 0.0, 0.0, 1e-4);
            for _ in 0..20_000 {
                let loss = drive.loss((z, b), v, drive.stribeck(v), 0.0, 1.0);
                v += h * (torque - loss.friction - loss.brake) / drive.rotor;
                x += h * v;
                (z, b) = (loss.presliding + h * v, loss.brake_deflection + h * v);
            }
            assert_eq!(v > 0.1, slips);
            assert_eq!(x > 2.0 * drive.brake_deflection_under(data.brake_nm), slips, "{x}");
        }
    }
}
