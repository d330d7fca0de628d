//! When each segment was really carried out: as planned, or as stops of the arm have moved it.
//!
//! A stop ends the segment under way and all that wait. Once it is acknowledged, the one that was interrupted begins anew and
//! the others follow it, so much later. A run without a stop has the planned times to the bit.

use crate::trace::{Trace, seconds};
use messages::{Event, EventKind};
use scenario::ResolvedSegment;
use serde::Serialize;

/// Safety state from which the arm is being held or stopped.
const HOLD: f64 = 2.0;

/// How a segment went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// At its planned times.
    AsPlanned,
    /// Later, since a stop came before it.
    Later,
    /// A stop has interrupted it, and it was begun anew.
    Again,
    /// A stop has ended it for good.
    CutOff,
    /// A stop came before it, and it never began.
    NotBegun,
}

impl Course {
    /// What a table says of it.
    pub fn words(self) -> &'static str {
        match self {
            Course::AsPlanned => "as planned",
            Course::Later => "later",
            Course::Again => "again",
            Course::CutOff => "cut off",
            Course::NotBegun => "not begun",
        }
    }
}

/// The last time that a segment was carried out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// Begin and end, s.
    pub start: f64,
    pub end: f64,
    pub course: Course,
    /// From the first time that it began to its end, or, where that was a stop, to what followed, s.
    pub whole: (f64, f64),
}

/// A stretch for each segment of a run that reached `until` s.
pub(crate) fn stretches(segments: &[ResolvedSegment], trace: &Trace, until: f64) -> Vec<Stretch> {
    let of = |kind: EventKind| trace.events.iter().filter(move |event| event.kind == kind as u32);
    let enters_stop = |event: &&Event| event.b >= HOLD && event.a < HOLD;
    let stopped = of(EventKind::SafetyState).filter(enters_stop).chain(of(EventKind::WatchdogExpired));
    let mut stops: Vec<f64> = stopped.map(|event| seconds(event.t)).collect();
    stops.sort_by(f64::total_cmp);
    let begins: Vec<(f64, usize)> =
        of(EventKind::SegmentStart).map(|event| (seconds(event.t), event.a as usize)).collect();
    segments.iter().enumerate().map(|(i, segment)| stretch(i, segment, &stops, &begins, until)).collect()
}

fn stretch(i: usize, segment: &ResolvedSegment, stops: &[f64], begins: &[(f64, usize)], until: f64) -> Stretch {
    let planned = (segment.start_s, segment.end_s);
    let stopped_before = |t: f64| stops.first().is_some_and(|first| *first < t);
    let as_planned = Stretch { start: planned.0, end: planned.1, course: Course::AsPlanned, whole: planned };
    let mut own = begins.iter().filter(|(_, segment)| *segment == i).map(|(at, _)| *at);
    let Some(first) = own.next() else {
        return match stopped_before(planned.0) && planned.0 < until {
            true => Stretch { course: Course::NotBegun, ..as_planned },
            false => as_planned,
        };
    };
    let last = own.next_back();
    let actual = |begin: f64| if stopped_before(begin) { begin } else { planned.0 };
    let start = actual(last.unwrap_or(first));
    let follows = begins.iter().map(|(at, _)| *at).find(|at| *at > last.unwrap_or(first));
    let length = planned.1 - planned.0;
    let end = if start == planned.0 { planned.1 } else { follows.unwrap_or(f64::MAX).min(start + length) };
    match stops.iter().find(|stop| (start..end).contains(*stop)) {
        Some(stop) => {
            let whole = (actual(first), follows.unwrap_or(until));
            Stretch { start, end: *stop, course: Course::CutOff, whole }
        }
        None => {
            let course = match last {
                Some(_) => Course::Again,
                None if start == planned.0 => Course::AsPlanned,
                None => Course::Later,
            };
            Stretch { start, end, course, whole: (actual(first), end) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Severity;

    /// Segments of 1 s, 3 s, 2 s and 2 s, in a run of 8 s.
    fn segments() -> Vec<ResolvedSegment> {
        let mut scenario = scenario::load("table-5-3", &[]).expect("built-in").scenario().expect("built-in");
        scenario.segments.truncate(4);
        for (segment, until_s) in scenario.segments.iter_mut().zip([1.0, 4.0, 6.0, 8.0]) {
            segment.until_s = until_s;
        }
        scenario.resolved_segments()
    }

    fn course(events: &[(f64, EventKind, f64, f64)], until: f64) -> Vec<(Course, f64, f64)> {
        let event = |(t, kind, a, b): &(f64, EventKind, f64, f64)| {
            Event::new((t * 1e9).round() as u64, *kind, Severity::Ok, *a, *b)
        };
        let trace = Trace { events: events.iter().map(event).collect(), ..Trace::default() };
        let rows = stretches(&segments(), &trace, until);
        rows.iter().map(|stretch| (stretch.course, stretch.start, stretch.end)).collect()
    }

    const BEGIN: EventKind = EventKind::SegmentStart;
    const STATE: EventKind = EventKind::SafetyState;

    #[test]
    fn without_a_stop_the_times_are_the_planned_ones_even_where_the_run_ends_early() {
        let begins = [(0.0002, BEGIN, 0.0, 0.0), (1.0002, BEGIN, 1.0, 0.0), (4.0002, BEGIN, 2.0, 0.0)];
        let planned = [(0.0, 1.0), (1.0, 4.0), (4.0, 6.0), (6.0, 8.0)].map(|(a, b)| (Course::AsPlanned, a, b));
        assert_eq!(course(&begins, 5.0), planned);
        // a degraded state is no stop
        assert_eq!(course(&[&begins[..], &[(1.5, STATE, 0.0, 1.0)]].concat(), 5.0), planned);
    }

    #[test]
    fn what_a_stop_interrupts_begins_anew_and_the_rest_follows_later() {
        let events = [
            (0.0002, BEGIN, 0.0, 0.0),
            (1.0002, BEGIN, 1.0, 0.0),
            (2.0, STATE, 0.0, 3.0),
            (2.2, STATE, 3.0, 4.0),
            (3.0, STATE, 4.0, 0.0),
            (3.5, BEGIN, 1.0, 0.0),
            (6.4999, BEGIN, 2.0, 0.0),
        ];
        use Course::*;
        let rows = [(AsPlanned, 0.0, 1.0), (Again, 3.5, 6.4999), (Later, 6.4999, 8.4999), (NotBegun, 6.0, 8.0)];
        assert_eq!(course(&events, 8.0), rows);
    }

    #[test]
    fn what_a_stop_ends_for_good_is_cut_off_there_and_what_waited_never_began() {
        let begun = [(0.0002, BEGIN, 0.0, 0.0), (1.0002, BEGIN, 1.0, 0.0)];
        for stop in [(2.5, STATE, 0.0, 2.0), (2.5, EventKind::WatchdogExpired, 0.0, 0.0)] {
            use Course::*;
            let rows = [(AsPlanned, 0.0, 1.0), (CutOff, 1.0, 2.5), (NotBegun, 4.0, 6.0), (NotBegun, 6.0, 8.0)];
            assert_eq!(course(&[&begun[..], &[stop]].concat(), 8.0), rows);
            assert_eq!(course(&[&begun[..], &[stop]].concat(), 5.0)[3].0, AsPlanned, "the run ended before its time");
        }
    }
}
