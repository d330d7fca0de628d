//! Measures of a whole run.

use crate::envelope::Envelope;
use crate::segments::SegmentRow;
use crate::series::Series;
use crate::trace::Trace;
use messages::JOINTS;
use scenario::{Hole, Measure, Scenario};
use serde::Serialize;

/// One number each; `None` where it does not exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunMeasures {
    /// First contact, s.
    pub first_contact_s: Option<f64>,
    /// First force peak after the first contact, N.
    pub first_peak_n: Option<f64>,
    /// Greatest |force − ideal force|, N.
    pub ideal_force_deviation_n: Option<f64>,
    /// Force segments whose mean force is off by more than half of F_d.
    pub incapable_segments: Option<f64>,
    /// Pairs of force segments whose mean forces are not in the order of their F_d.
    pub force_order_violations: Option<f64>,
    /// Growth of the oscillation of X in the last segment, per period.
    pub envelope_growth: Option<f64>,
    /// Periods over which that was taken.
    pub envelope_periods: Option<f64>,
    /// Greatest joint torque sent, as a share of its limit.
    pub torque_share: Option<f64>,
    /// Greatest joint speed in the last second, rad/s.
    pub self_motion_rad_per_s: Option<f64>,
    /// Least distance of a joint from its limit, rad.
    pub joint_limit_distance_rad: Option<f64>,
    /// Greatest depth of the peg's end under the hole's mouth, m.
    pub insertion_depth_m: Option<f64>,
    /// Greatest contact force across the hole's axis, N.
    pub lateral_force_peak_n: Option<f64>,
    /// Share of the time for which the bus was kept.
    pub bus_load: Option<f64>,
    /// Releases lost by tasks whose job before still ran.
    pub lost_releases: Option<f64>,
    /// Longest time from what the force sensor felt to the D/A's change, s.
    pub sensor_to_actuator_s: Option<f64>,
}

/// Data of the arm that measures compare with.
pub(crate) struct Bounds {
    pub torque_nm: [f64; JOINTS],
    pub lower_rad: [f64; JOINTS],
    pub upper_rad: [f64; JOINTS],
    pub hole: Option<Hole>,
}

impl Bounds {
    pub fn of(scenario: &Scenario) -> Result<Bounds, String> {
        let arm = scenario.controller_arm()?;
        let drives = scenario.drives()?;
        Ok(Bounds {
            torque_nm: drives.each(|joint| joint.torque_limit_nm).into(),
            lower_rad: (*arm.lower_limits()).into(),
            upper_rad: (*arm.upper_limits()).into(),
            hole: scenario.holes.first().cloned(),
        })
    }
}

impl RunMeasures {
    pub(crate) fn of(
        trace: &Trace,
        rows: &[SegmentRow],
        force: &Series,
        position: &Series,
        ideal_force: Option<&Series>,
        bounds: &Bounds,
        until: f64,
    ) -> RunMeasures {
        let contact = first_contact(trace);
        let last = rows.iter().rfind(|row| row.begun() && row.start_s < until);
        let envelope = last.and_then(|row| Envelope::of(position, row.start_s, row.end_s.min(until)));
        RunMeasures {
            first_contact_s: contact,
            first_peak_n: contact.and_then(|contact| first_peak(force, rows, contact, until)),
            ideal_force_deviation_n: ideal_force
                .and_then(|ideal| force.greatest(0.0, until, |t, y| Some((y - ideal.at(t)?).abs()))),
            incapable_segments: incapable(rows),
            force_order_violations: order_violations(rows),
            envelope_growth: envelope.map(|envelope| envelope.growth),
            envelope_periods: envelope.map(|envelope| envelope.periods),
            torque_share: greatest(
                trace.control.iter().flat_map(|probe| (0..JOINTS).map(|i| probe.torque[i].abs() / bounds.torque_nm[i])),
            ),
            self_motion_rad_per_s: greatest(
                trace
                    .plant
                    .iter()
                    .filter(|probe| crate::trace::seconds(probe.t) >= until - 1.0)
                    .flat_map(|probe| probe.qd.into_iter().map(f64::abs)),
            ),
            joint_limit_distance_rad: greatest(trace.plant.iter().flat_map(|probe| {
                (0..JOINTS).map(|i| -(probe.q[i] - bounds.lower_rad[i]).min(bounds.upper_rad[i] - probe.q[i]))
            }))
            .map(|least| -least),
            insertion_depth_m: bounds.hole.as_ref().and_then(|hole| {
                greatest(trace.plant.iter().map(|probe| hole.depth_of(probe.position)))
            }),
            lateral_force_peak_n: bounds.hole.as_ref().and_then(|hole| {
                greatest(trace.plant.iter().map(|probe| lateral(&probe.contact, hole)))
            }),
            bus_load: trace.bus.as_ref().map(|bus| bus.utilisation),
            lost_releases: trace.bus.as_ref().map(|bus| bus.lost_releases() as f64),
            sensor_to_actuator_s: trace
                .bus
                .as_ref()
                .filter(|bus| bus.waterfall.jobs > 0)
                .map(|bus| crate::trace::seconds(bus.waterfall.whole_max_ns)),
        }
    }

    /// The measure of the run, or of one segment of it.
    pub(crate) fn value(&self, measure: Measure, row: Option<&SegmentRow>) -> Option<f64> {
        use Measure::*;
        match measure {
            ForceMeanErrorN => row?.mean_error_n,
            ForceRmsErrorN => row?.rms_error_n,
            ForceTrackingErrorN => row?.tracking_error_n,
            ForceMeanN => row?.mean_n,
            ForceLeastN => row?.least_n,
            ForcePeakN => row?.peak_n,
            ForceRiseS => row?.rise_s,
            PositionErrorM => row?.position_error_m,
            EncoderPositionErrorM => row?.encoder_position_error_m,
            IdealPositionDeviationM => row?.ideal_position_deviation_m,
            IdealTargetDeviationM => row?.ideal_target_deviation_m,
            FirstPeakN => self.first_peak_n,
            IdealForceDeviationN => self.ideal_force_deviation_n,
            IncapableSegments => self.incapable_segments,
            ForceOrderViolations => self.force_order_violations,
            EnvelopeGrowth => self.envelope_growth,
            TorqueShare => self.torque_share,
            SelfMotionRadPerS => self.self_motion_rad_per_s,
            JointLimitDistanceRad => self.joint_limit_distance_rad,
            InsertionDepthM => self.insertion_depth_m,
            LateralForcePeakN => self.lateral_force_peak_n,
            BusLoad => self.bus_load,
            LostReleases => self.lost_releases,
            SensorToActuatorS => self.sensor_to_actuator_s,
        }
    }
}

/// Instant of the first contact force, s.
pub(crate) fn first_contact(trace: &Trace) -> Option<f64> {
    let touches = |contact: &[f64; 6]| contact[..3].iter().any(|force| force.abs() > 1e-9);
    trace.plant.iter().find(|probe| touches(&probe.contact)).map(|probe| crate::trace::seconds(probe.t))
}

/// Part of a contact wrench's force (task frame) across a hole's axis, N.
fn lateral(contact: &[f64; 6], hole: &Hole) -> f64 {
    let (force, axis) = (&contact[..3], hole.axis());
    let along: f64 = force.iter().zip(axis.iter()).map(|(f, a)| f * a).sum();
    let square: f64 = force.iter().map(|f| f * f).sum();
    (square - along * along).max(0.0).sqrt()
}

/// Greatest of finite numbers.
fn greatest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.filter(|value| value.is_finite()).reduce(f64::max)
}

/// The running maximum at the moment at which the force has first fallen 5 % of F_d below it, or at the
/// end of the segment in which the contact began.
fn first_peak(force: &Series, rows: &[SegmentRow], contact: f64, until: f64) -> Option<f64> {
    let row = rows.iter().find(|row| row.begun() && row.whole_s.0 <= contact && contact < row.whole_s.1)?;
    let end = row.whole_s.1.min(until);
    let fall = 0.05 * row.commanded_n.unwrap_or(0.0).abs();
    let mut peak: Option<f64> = None;
    for (_, y) in force.within(contact, end) {
        match peak {
            Some(highest) if y < highest - fall => break,
            _ => peak = Some(peak.map_or(y, |highest| highest.max(y))),
        }
    }
    peak
}

fn incapable(rows: &[SegmentRow]) -> Option<f64> {
    let pairs: Vec<_> = rows.iter().filter_map(|row| Some((row.commanded_n?, row.mean_error_n?))).collect();
    let judged = pairs.iter().filter(|(wanted, _)| *wanted > 0.0);
    let off = judged.clone().filter(|(wanted, error)| *error > 0.5 * wanted).count();
    (judged.count() > 0).then_some(off as f64)
}

fn order_violations(rows: &[SegmentRow]) -> Option<f64> {
    let pairs: Vec<_> = rows.iter().filter_map(|row| Some((row.commanded_n?, row.mean_n?))).collect();
    let mut violations = 0;
    for (i, (wanted, mean)) in pairs.iter().enumerate() {
        violations += pairs[i + 1..]
            .iter()
            .filter(|(other_wanted, other_mean)| {
                wanted != other_wanted && ((wanted < other_wanted) != (mean < other_mean) || mean == other_mean)
            })
            .count();
    }
    (pairs.len() > 1).then_some(f64::from(violations as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(wanted: f64, mean: Option<f64>) -> SegmentRow {
        SegmentRow {
            name: String::new(),
            start_s: 0.0,
            end_s: 9.0,
            course: crate::Course::AsPlanned,
            planned: true,
            whole_s: (0.0, 9.0),
            force_controlled: true,
            reached: true,
            commanded_n: Some(wanted),
            mean_n: mean,
            mean_error_n: mean.map(|mean| (mean - wanted).abs()),
            rms_error_n: None,
            tracking_error_n: None,
            least_n: None,
            peak_n: None,
            rise_s: None,
            position_error_m: None,
            encoder_position_error_m: None,
            ideal_position_deviation_m: None,
            ideal_target_deviation_m: None,
        }
    }

    #[test]
    fn a_surface_never_touched_makes_every_force_segment_incapable() {
        let rows = [60.0, 80.0, 40.0, 0.0].map(|wanted| row(wanted, Some(0.0)));
        assert_eq!(incapable(&rows), Some(3.0));
        assert_eq!(order_violations(&rows), Some(6.0));
    }

    #[test]
    fn the_lateral_force_is_the_part_across_a_tilted_holes_axis() {
        let document = scenario::load("peg-in-hole", &["hole.0.tilt_deg=[0.0, 30.0]".into()]).expect("valid");
        let hole = document.scenario().expect("valid").holes.remove(0);
        let axis = hole.axis();
        let along = [3.0 * axis.x, 3.0 * axis.y, 3.0 * axis.z, 0.0, 0.0, 0.0];
        assert!(lateral(&along, &hole) < 1e-7);
        assert!((lateral(&[0.0, 0.0, 2.0, 0.0, 0.0, 0.0], &hole) - 1.0).abs() < 1e-12);
        assert!((lateral(&[0.0, 5.0, 0.0, 0.0, 0.0, 9.0], &hole) - 5.0).abs() < 1e-12);
        let at = |depth: f64| std::array::from_fn(|k| hole.position_m[k] + depth * axis[k]);
        assert!((hole.depth_of(at(0.02)) - 0.02).abs() < 1e-15);
    }

    #[test]
    fn forces_in_the_order_of_their_commands_violate_nothing() {
        let rows = [(60.0, 62.5), (80.0, 81.3), (40.0, 40.0), (0.0, 0.1)].map(|(wanted, mean)| row(wanted, Some(mean)));
        assert_eq!((incapable(&rows), order_violations(&rows)), (Some(0.0), Some(0.0)));
        let rows = [(60.0, 85.0), (80.0, 81.3)].map(|(wanted, mean)| row(wanted, Some(mean)));
        assert_eq!(order_violations(&rows), Some(1.0));
        assert_eq!(order_violations(&[row(60.0, None), row(80.0, None)]), None);
    }

    #[test]
    fn the_first_peak_ends_where_the_force_has_clearly_fallen() {
        let force = Series { t: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], y: vec![0.0, 50.0, 49.0, 70.0, 60.0, 90.0] };
        assert_eq!(first_peak(&force, &[row(60.0, None)], 0.0, 9.0), Some(70.0));
    }
}
