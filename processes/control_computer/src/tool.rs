//! From the sensor's wrench to F_e: tool compensation, tare, and the move to the tool point.
//!
//! The sensor sits between flange and tool and measures what the flange exerts on the tool: m (a − g) + F_e, moment about
//! its own origin, in its own axes, which are parallel to the tip's. The tool's weight (optionally its inertia, with the
//! acceleration from the last two speeds measured, half a period late) is subtracted, then the zero offset found by the
//! tare in free space, and the moment is moved to the tool point. While the tare runs, F_e counts as zero.

use crate::frame::{angular, linear, spatial};
use arm::{Pose, Spatial};
use nalgebra::Vector3;
use vme::Ns;

/// Tool, sensor and tare.
#[derive(Clone, Debug)]
pub struct ToolCompensation {
    /// Mass (kg); 0 where nothing is subtracted.
    mass: f64,
    /// Centre of mass from the sensor origin, sensor axes (m).
    com: Vector3<f64>,
    /// Subtracts m a as well.
    inertia: bool,
    /// Sensor origin from the tool point, tip axes (m).
    sensor: Vector3<f64>,
    /// Gravity in C (m/s²).
    gravity: Vector3<f64>,
    tare: Tare,
    /// Ẋ of the last job, for the acceleration.
    last_twist: Option<Spatial>,
}

/// Zero offset, in sensor axes.
#[derive(Clone, Debug)]
struct Tare {
    /// When it is to be taken; `None` once it is.
    until: Option<Ns>,
    sum: Spatial,
    n: u32,
    offset: Spatial,
}

/// The contact wrench, and whether the tare has just been taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// F_e: wrench of the tool on the environment about the tool point, in C (N, Nm).
    pub fe: Spatial,
    /// The zero offset, in the job that completes the tare (N, Nm; sensor axes).
    pub tared: Option<Spatial>,
}

impl ToolCompensation {
    /// `tool`: mass and centre of mass from the sensor origin in sensor axes, `None` for no compensation; `sensor`:
    /// sensor origin from the tool point in tip axes; `gravity` in C; a tare until `tare_until`, if any.
    pub fn new(
        tool: Option<(f64, Vector3<f64>)>,
        inertia: bool,
        sensor: Vector3<f64>,
        gravity: &Vector3<f64>,
        tare_until: Option<Ns>,
    ) -> ToolCompensation {
        let (mass, com) = tool.unwrap_or((0.0, Vector3::zeros()));
        ToolCompensation {
            mass,
            com,
            inertia,
            sensor,
            gravity: *gravity,
            tare: Tare { until: tare_until, sum: Spatial::zeros(), n: 0, offset: Spatial::zeros() },
            last_twist: None,
        }
    }

    /// Takes no tare.
    pub fn skip_tare(&mut self) {
        self.tare.until = None;
    }

    /// F_e from the wrench measured (sensor axes) with the tool at `x`, moving with `x_dot` (C), at `now`, `dt` seconds
    /// after the last call.
    pub fn contact(&mut self, measured: &Spatial, x: &Pose, x_dot: &Spatial, now: Ns, dt: f64) -> Contact {
        let own = self.own_wrench(x, x_dot, dt);
        self.last_twist = Some(*x_dot);
        let mut wrench = measured - own;
        let mut tared = None;
        if let Some(until) = self.tare.until {
            self.tare.sum += wrench;
            self.tare.n += 1;
            if now < until {
                return Contact { fe: Spatial::zeros(), tared };
            }
            self.tare.until = None;
            self.tare.offset = self.tare.sum / f64::from(self.tare.n);
            tared = Some(self.tare.offset);
        }
        wrench -= self.tare.offset;
        let force = linear(&wrench);
        let moment = angular(&wrench) + self.sensor.cross(&force);
        Contact { fe: spatial(x.r * force, x.r * moment), tared }
    }

    /// What the tool itself makes the sensor show: m (a − g) at its centre of mass, sensor axes.
    fn own_wrench(&self, x: &Pose, x_dot: &Spatial, dt: f64) -> Spatial {
        if self.mass == 0.0 {
            return Spatial::zeros();
        }
        let mut a = -self.gravity;
        if let (true, Some(last)) = (self.inertia, self.last_twist) {
            let tip = (x_dot - last) / dt;
            let w = angular(x_dot);
            let r = x.r * (self.sensor + self.com);
            a += linear(&tip) + angular(&tip).cross(&r) + w.cross(&w.cross(&r));
        }
        let force = x.r.tr_mul(&a) * self.mass;
        spatial(force, self.com.cross(&force))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::rotation;
    use nalgebra::Matrix3;

    const DT: f64 = 5e-3;

    /// Base axes to those of C, which looks down.
    fn to_c() -> Matrix3<f64> {
        rotation::from_rpy(std::f64::consts::PI, 0.0, 0.0).transpose()
    }

    fn compensation(inertia: bool, tare_until: Option<Ns>) -> ToolCompensation {
        ToolCompensation::new(
            Some((0.8, Vector3::new(0.01, -0.02, 0.05))),
            inertia,
            Vector3::new(0.0, 0.0, -0.1),
            &(to_c() * Vector3::new(0.0, 0.0, -9.81)),
            tare_until,
        )
    }

    /// What the flange exerts on a tool with these accelerations (base axes) and this contact wrench about the tool point.
    fn gauges(r: &Matrix3<f64>, a_com: Vector3<f64>, force: Vector3<f64>, moment: Vector3<f64>) -> Spatial {
        let (com, tool_point) = (Vector3::new(0.01, -0.02, 0.05), Vector3::new(0.0, 0.0, 0.1));
        let own = r.transpose() * (a_com - Vector3::new(0.0, 0.0, -9.81)) * 0.8;
        let f = r.transpose() * force;
        spatial(own + f, com.cross(&own) + tool_point.cross(&f) + r.transpose() * moment)
    }

    fn postures() -> Vec<Matrix3<f64>> {
        let angles = [[0.0, 0.0, 0.0], [3.1, 0.2, 1.0], [-1.2, 0.9, 2.0], [1.5, -1.4, -2.5]];
        angles.map(|[r, p, y]| rotation::from_rpy(r, p, y)).to_vec()
    }

    fn pose_in_c(r: &Matrix3<f64>) -> Pose {
        Pose { p: Vector3::zeros(), r: to_c() * r }
    }

    #[test]
    fn at_rest_the_tool_shows_no_contact_in_any_posture() {
        for r in postures() {
            let measured = gauges(&r, Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
            let rest = Spatial::zeros();
            let contact = compensation(false, None).contact(&measured, &pose_in_c(&r), &rest, 0, DT);
            assert!(contact.fe.amax() < 1e-12, "{}", contact.fe);
        }
    }

    #[test]
    fn a_contact_wrench_comes_out_about_the_tool_point_in_the_task_frame() {
        let (force, moment) = (Vector3::new(3.0, -4.0, -60.0), Vector3::new(0.5, 0.2, -0.1));
        for r in postures() {
            let measured = gauges(&r, Vector3::zeros(), force, moment);
            let rest = Spatial::zeros();
            let contact = compensation(false, None).contact(&measured, &pose_in_c(&r), &rest, 0, DT);
            // C looks down: y and z change sign; pushing down is F_z > 0
            let expected = Spatial::new(3.0, 4.0, 60.0, 0.5, -0.2, 0.1);
            assert!((contact.fe - expected).amax() < 1e-12, "{}", contact.fe);
        }
    }

    #[test]
    fn inertia_of_a_turning_and_accelerating_tool_is_subtracted_on_request() {
        // about the base z through the tool point, w(t) = 2t, at t = 0.5 s; the tool point accelerates along y
        let r = rotation::from_rpy(0.3, 0.4, 0.5);
        let c = r * (Vector3::new(0.01, -0.02, 0.05) - Vector3::new(0.0, 0.0, 0.1));
        let (w, dw) = (Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, 0.0, 2.0));
        let a = Vector3::new(0.0, 3.0, 0.0) + dw.cross(&c) + w.cross(&w.cross(&c));
        let measured = gauges(&r, a, Vector3::zeros(), Vector3::zeros());
        let twist =
            |t: f64| spatial(to_c() * Vector3::new(0.0, 3.0 * t, 0.0), to_c() * Vector3::new(0.0, 0.0, 2.0 * t));
        let x = pose_in_c(&r);
        let mut with = compensation(true, None);
        with.contact(&measured, &x, &twist(0.5 - DT), 0, DT);
        let fe = with.contact(&measured, &x, &twist(0.5), 0, DT).fe;
        assert!(fe.amax() < 1e-9, "{fe}");
        let without = compensation(false, None).contact(&measured, &x, &twist(0.5), 0, DT).fe;
        assert!((without[1] + 0.8 * (to_c() * -a)[1]).abs() < 1e-9);
    }

    #[test]
    fn the_tare_takes_the_zero_offset_and_shows_no_force_meanwhile() {
        let offset = Spatial::new(5.0, -3.0, 12.0, 0.1, 0.2, -0.3);
        let mut compensation = compensation(false, Some(20_000_000));
        let rest = Spatial::zeros();
        for (i, r) in postures().iter().cycle().take(4).enumerate() {
            let measured = gauges(r, Vector3::zeros(), Vector3::zeros(), Vector3::zeros()) + offset;
            let contact = compensation.contact(&measured, &pose_in_c(r), &rest, 5_000_000 * i as u64, DT);
            assert_eq!((contact.fe, contact.tared), (Spatial::zeros(), None));
        }
        let r = postures()[2];
        let pushed = gauges(&r, Vector3::zeros(), Vector3::zeros(), Vector3::zeros()) + offset;
        let contact = compensation.contact(&pushed, &pose_in_c(&r), &rest, 20_000_000, DT);
        assert!((contact.tared.unwrap() - offset).amax() < 1e-12);
        let pushed = gauges(&r, Vector3::zeros(), Vector3::new(0.0, 0.0, -7.0), Vector3::zeros()) + offset;
        let contact = compensation.contact(&pushed, &pose_in_c(&r), &rest, 25_000_000, DT);
        assert!((contact.fe - Spatial::new(0.0, 0.0, 7.0, 0.0, 0.0, 0.0)).amax() < 1e-12);
        assert_eq!(contact.tared, None);
    }
}
