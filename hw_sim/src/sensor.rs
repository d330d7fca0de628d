//! Force sensor between flange and tool: what its strain gauges feel.

use crate::plant::Evaluation;
use arm::ArmModel;
use nalgebra::Vector3;

/// Where the sensor sits and what hangs on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Origin in tip axes from the tool point, m; its axes are parallel to the tip's.
    origin: Vector3<f64>,
    /// Mass of the tool, kg.
    mass: f64,
    /// Its centre of mass in sensor axes from the sensor origin, m.
    com: Vector3<f64>,
    /// Gravity, base axes, m/s².
    gravity: Vector3<f64>,
}

impl Sensor {
    /// The sensor that a scenario describes, on this arm.
    pub fn new(config: &scenario::Arm, arm: &ArmModel) -> Sensor {
        Sensor {
            origin: Vector3::from(config.sensor_m),
            mass: config.tool.mass_kg,
            com: Vector3::from(config.tool.com_m),
            gravity: arm.gravity(),
        }
    }

    /// Force and moment that the flange exerts on the tool, about the sensor origin, in sensor axes (N, Nm):
    /// m (a_com − g) + F_e. The tool is a point mass at its centre of mass.
    #[inline]
    pub fn wrench(&self, now: &Evaluation) -> [f64; 6] {
        let part = |v: &arm::Spatial, k: usize| Vector3::new(v[k], v[k + 1], v[k + 2]);
        let r = &now.pose.r;
        let from_tip = r * (self.origin + self.com);
        let (omega, alpha) = (part(&now.twist, 3), part(&now.acceleration, 3));
        let a_com = part(&now.acceleration, 0) + alpha.cross(&from_tip) + omega.cross(&omega.cross(&from_tip));
        let inertial = (a_com - self.gravity) * self.mass;
        let contact = part(&now.touch.wrench, 0);
        let force = inertial + contact;
        let tip_from_sensor = r * -self.origin;
        let moment = (r * self.com).cross(&inertial) + tip_from_sensor.cross(&contact) + part(&now.touch.wrench, 3);
        let (force, moment) = (r.tr_mul(&force), r.tr_mul(&moment));
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }
}
