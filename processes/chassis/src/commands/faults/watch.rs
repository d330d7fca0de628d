//! One run, watched: what it leaves in memory, ended as soon as there is nothing more to see.

use crate::boards;
use crate::rack_run::INTERRUPTED;
use board::{Mail, Ns};
use messages::{EventKind, drive_status};
use pacing::{Context, Flow, Lockstep, Observer, RunError};
use report::Trace;
use scenario::Scenario;
use std::sync::atomic::Ordering;
use vme::{Log, Origin};

/// A run goes on for so long after all brakes have engaged.
const SETTLE: Ns = 200 * vme::MILLISECOND;
/// All brakes engaged.
const ALL_BRAKES: u32 = drive_status::BRAKE_ENGAGED;

/// What a watched run leaves.
#[derive(Debug, Default)]
pub struct Seen {
    /// Probes and events.
    pub trace: Trace,
    /// When each transfer over the bus ended that a program made, repeated ones too, ns.
    pub transfers: Vec<Ns>,
}

/// Runs a scenario to `end`, or until the arm has been on its brakes for a while after `fault`. In this process, or with a
/// process for each board.
pub fn watch(scenario: Scenario, fault: Ns, end: Ns, processes: bool) -> Result<Seen, String> {
    let mut watcher = Watcher { seen: Seen::default(), fault, braked: None };
    run(scenario, end, !processes, &mut watcher).map_err(|error| error.to_string())?;
    Ok(watcher.seen)
}

/// Runs a scenario without a fault in this process; returns the time that the tool was in contact, and the first thing
/// that tripped.
pub fn watch_for_trips(scenario: Scenario) -> Result<(Quiet, Ns), String> {
    let mut quiet = Quiet::default();
    let end = scenario.duration_ns();
    run(scenario, end, true, &mut quiet).map_err(|error| error.to_string())?;
    Ok((quiet, end))
}

fn run(scenario: Scenario, end: Ns, in_process: bool, observer: &mut dyn Observer) -> Result<(), RunError> {
    let (prefix, variant) = (String::new(), String::new());
    let context = Context { prefix, variant, record: None, measure: false, in_process, scenario };
    let mut rack = Lockstep::power_up(context, &boards::build, &boards::program, &INTERRUPTED)?;
    rack.run(end, observer)?;
    rack.finish()
}

struct Watcher {
    seen: Seen,
    fault: Ns,
    /// Since when all brakes are engaged.
    braked: Option<Ns>,
}

impl Observer for Watcher {
    fn window(&mut self, until: Ns, mail: &Mail, log: &Log) -> Flow {
        self.seen.trace.window(&mail.plant_probe, &mail.control_probe, &mail.events);
        let of_programs = |origin| matches!(origin, Origin::Program | Origin::Repeat);
        let programs = log.transfers.iter().filter(|transfer| of_programs(transfer.origin));
        self.seen.transfers.extend(programs.map(|transfer| transfer.done));
        let mut flow = Flow::Continue;
        for probe in &mail.plant_probe {
            match is_braked(probe) {
                true => self.braked = self.braked.or(Some(probe.t)),
                false => self.braked = None,
            }
            if probe.status & drive_status::DIVERGED != 0 {
                flow = Flow::Stop;
            }
        }
        if self.braked.is_some_and(|since| until >= since.max(self.fault) + SETTLE)
            || INTERRUPTED.load(Ordering::Relaxed)
        {
            flow = Flow::Stop;
        }
        flow
    }
}

/// Whether every brake is engaged: STO.
pub fn is_braked(probe: &messages::PlantProbe) -> bool {
    probe.status & ALL_BRAKES == ALL_BRAKES
}

/// What a run without a fault is watched for.
#[derive(Debug, Default)]
pub struct Quiet {
    /// Time in contact, ns.
    pub contact: Ns,
    /// Instant of the first event that a sound rack does not have, and what it was.
    pub trip: Option<(Ns, String)>,
    last: Ns,
}

impl Observer for Quiet {
    fn window(&mut self, until: Ns, mail: &Mail, _log: &Log) -> Flow {
        let touches = mail.plant_probe.last().is_some_and(|probe| probe.contact[..3].iter().any(|force| *force != 0.0));
        if touches {
            self.contact += until - self.last;
        }
        self.last = until;
        self.trip = self.trip.take().or_else(|| first_trip(&mail.events));
        match self.trip.is_some() || INTERRUPTED.load(Ordering::Relaxed) {
            true => Flow::Stop,
            false => Flow::Continue,
        }
    }
}

/// The first of these events that a sound rack does not have.
pub fn first_trip(events: &[messages::Event]) -> Option<(Ns, String)> {
    let trips = [
        EventKind::Detected,
        EventKind::WatchdogExpired,
        EventKind::AmplifierTrip,
        EventKind::BusError,
        EventKind::OverrunTrip,
        EventKind::CommandRefused,
        EventKind::MessageLost,
        EventKind::Diverged,
    ];
    events.iter().find_map(|event| {
        let kind = EventKind::from_number(event.kind)?;
        let graver = kind == EventKind::SafetyState && event.b > 0.0;
        let detector = messages::Detector::from_number(event.cause).map_or(kind.name(), messages::Detector::name);
        (graver || trips.contains(&kind)).then(|| (event.t, detector.to_owned()))
    })
}
