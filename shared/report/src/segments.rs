//! The rows of the segment table: what each segment came to. Forces are the true contact force along
//! the report's axis, positions the true tool point's; both of the plant, not as the controller sees them.

use crate::series::Series;
use crate::stretches::{Course, Stretch};
use scenario::ResolvedSegment;
use serde::Serialize;

/// Length of the closing part over which a segment's steady figures are taken, s.
const CLOSING_S: f64 = 1.0;
/// Length of the opening part that the tracking error leaves out, s.
const OPENING_S: f64 = 2.0;

/// One segment of one run. A figure that does not exist is `None`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentRow {
    /// Name.
    pub name: String,
    /// Start, s; of a segment that a stop has interrupted, of the last time that it was carried out.
    pub start_s: f64,
    /// End, s; of one that was cut off, when that was.
    pub end_s: f64,
    /// How it went.
    pub course: Course,
    /// The run was long enough for it, as planned.
    #[serde(skip)]
    pub planned: bool,
    /// From the first time that it began to its end, or, where that was a stop, to what followed, s.
    #[serde(skip)]
    pub whole_s: (f64, f64),
    /// The axis is force-controlled (S = 0).
    pub force_controlled: bool,
    /// The run went through the whole of it.
    pub reached: bool,
    /// F_d, N, of a force-controlled one.
    pub commanded_n: Option<f64>,
    /// Mean force of the last second, N.
    pub mean_n: Option<f64>,
    /// |mean − F_d|, N.
    pub mean_error_n: Option<f64>,
    /// Rms of force − F_d over the last second, N.
    pub rms_error_n: Option<f64>,
    /// Rms of force − F_d over all but the first 2 s, N.
    pub tracking_error_n: Option<f64>,
    /// Least force, N; where a stop has interrupted the segment, from the first time that it began, the stop included.
    pub least_n: Option<f64>,
    /// Greatest force, N, in the same time.
    pub peak_n: Option<f64>,
    /// 90 % rise time, s: from the first contact if that falls into the segment, otherwise from the
    /// segment's start and the force there, to 90 % of the way to F_d.
    pub rise_s: Option<f64>,
    /// |X − X_d| at the end, m, of a position-controlled one.
    pub position_error_m: Option<f64>,
    /// The same of the X that the controller has from the encoders, m.
    pub encoder_position_error_m: Option<f64>,
    /// Greatest |X − ideal|, m.
    pub ideal_position_deviation_m: Option<f64>,
    /// Greatest |Xᵗ − ideal|, m.
    pub ideal_target_deviation_m: Option<f64>,
}

impl SegmentRow {
    /// No stop has kept it from beginning.
    pub(crate) fn begun(&self) -> bool {
        self.course != Course::NotBegun
    }

    /// The run was asked to end before it: nobody can blame the arm for what it lacks.
    pub(crate) fn is_beyond_the_run(&self) -> bool {
        !self.reached && !self.planned
    }
}

/// What rows are made from; all along the report's axis.
pub(crate) struct Signals<'a> {
    pub force: &'a Series,
    pub position: &'a Series,
    /// X as the controller has it; none for the ideal.
    pub encoder_position: Option<&'a Series>,
    pub target: Option<&'a Series>,
    pub desired: &'a Series,
    pub ideal_position: Option<&'a Series>,
    /// First contact, s.
    pub contact: Option<f64>,
    /// End of the run, s.
    pub until: f64,
}

/// One row per segment.
pub(crate) fn rows(
    segments: &[ResolvedSegment],
    stretches: &[Stretch],
    axis: usize,
    signals: &Signals,
) -> Vec<SegmentRow> {
    segments.iter().zip(stretches).map(|(segment, stretch)| row(segment, stretch, axis, signals)).collect()
}

fn row(segment: &ResolvedSegment, stretch: &Stretch, axis: usize, signals: &Signals) -> SegmentRow {
    let Stretch { start, end, course, .. } = *stretch;
    let force_controlled = segment.selection[axis] == 0;
    let within = |end: f64| end <= signals.until + 1e-6;
    let reached = within(end) && !matches!(course, Course::CutOff | Course::NotBegun);
    let begun = reached || course == Course::CutOff;
    let wanted = segment.force[axis];
    let closing = (end - CLOSING_S).max(start);
    let force = signals.force;
    let mean_n = force.mean_of(closing, end, |y| y).filter(|_| reached);
    let deviation = |of: Option<&Series>| {
        let (of, ideal) = (of?, signals.ideal_position?);
        // the ideal is not stopped
        let beside = reached && course == Course::AsPlanned;
        of.greatest(start, end, |t, y| Some((y - ideal.at(t)?).abs())).filter(|_| beside)
    };
    let (first, last) = stretch.whole;
    let extreme = |of: fn(f64) -> f64| force.greatest(first, last, |_, y| Some(of(y))).filter(|_| begun);
    let rms_error = |from: f64| {
        force.mean_of(from, end, |y| (y - wanted) * (y - wanted)).filter(|_| reached && force_controlled).map(f64::sqrt)
    };
    // X_d may jump where the next segment begins
    let position_error = |of: &Series| {
        (reached && !force_controlled).then(|| Some((of.at(end)? - signals.desired.before(end)?).abs())).flatten()
    };
    SegmentRow {
        name: segment.name.clone(),
        start_s: start,
        end_s: end,
        course,
        planned: within(segment.end_s),
        whole_s: stretch.whole,
        force_controlled,
        reached,
        commanded_n: force_controlled.then_some(wanted),
        mean_n,
        mean_error_n: mean_n.filter(|_| force_controlled).map(|mean| (mean - wanted).abs()),
        rms_error_n: rms_error(closing),
        tracking_error_n: rms_error(start + OPENING_S),
        least_n: extreme(|y| -y).map(|least| -least),
        peak_n: extreme(|y| y),
        rise_s: rise(force, start, end.min(signals.until), wanted, signals.contact)
            .filter(|_| force_controlled && course != Course::NotBegun),
        position_error_m: position_error(signals.position),
        encoder_position_error_m: signals.encoder_position.and_then(position_error),
        ideal_position_deviation_m: deviation(Some(signals.position)),
        ideal_target_deviation_m: deviation(signals.target),
    }
}

fn rise(force: &Series, start: f64, end: f64, wanted: f64, contact: Option<f64>) -> Option<f64> {
    let contact = contact?;
    let from = if contact > start { contact } else { start };
    if from >= end {
        return None;
    }
    let initial = if contact > start { 0.0 } else { force.at(start)? };
    if (wanted - initial).abs() < 1e-3 {
        return None;
    }
    Some(force.crossing(from, end, initial + 0.9 * (wanted - initial))? - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rise_time_runs_from_the_first_contact_or_from_the_segments_start() {
        let force = Series { t: vec![0.0, 1.0, 2.0, 4.0, 5.0, 8.0], y: vec![0.0, 0.0, 10.0, 10.0, 20.0, 20.0] };
        let close =
            |actual: Option<f64>, expected: f64| assert!((actual.unwrap() - expected).abs() < 1e-12, "{actual:?}");
        close(rise(&force, 0.5, 4.0, 10.0, Some(1.0)), 0.9);
        close(rise(&force, 4.0, 8.0, 20.0, Some(1.0)), 0.9);
        assert_eq!(rise(&force, 4.0, 8.0, 30.0, Some(1.0)), None);
        assert_eq!(rise(&force, 0.5, 4.0, 10.0, None), None);
    }
}
