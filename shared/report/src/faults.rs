//! What each injected fault did: when it was seen, what came of it, and what the contact felt.
//!
//! A fault's time runs from its injection to the next one's, or to the end of the run.

use crate::latency::LatencyRow;
use crate::trace::{Trace, seconds};
use messages::drive_status::BRAKE_ENGAGED;
use messages::{Detector, Event, EventKind};
use scenario::Scenario;
use serde::Serialize;
use std::collections::BTreeMap;

/// Names of the control computer's states, by number.
const STATES: [&str; 5] = ["run", "degraded", "hold (SS2)", "stop (SS1)", "off (STO)"];
/// State from which the arm is being stopped.
const HOLD: usize = 2;

/// One injected fault.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultRow {
    /// Number in the scenario's list.
    pub fault: usize,
    /// Target.
    pub target: String,
    /// Kind.
    pub kind: String,
    /// When it began, s.
    pub injected_s: f64,
    /// From its begin to the first event that it caused, s; none = not detected.
    pub detected_after_s: Option<f64>,
    /// That event.
    pub detected_by: Option<String>,
    /// The card that did not answer, where it is one: whose window the address lies in.
    pub card: Option<String>,
    /// From its begin until the control computer began to stop the arm, s.
    pub stopping_after_s: Option<f64>,
    /// From its begin until the brakes of all joints had fallen in for the rest of its time, s; none = they had not.
    pub braked_after_s: Option<f64>,
    /// Gravest state of the control computer.
    pub reaction: String,
    /// Greatest contact force, N.
    pub peak_force_n: f64,
    /// Contact force at its begin, N.
    pub force_before_n: f64,
    /// Greatest motor torque, as a share of its drive's limit.
    pub peak_torque_share: f64,
    /// Greatest distance of the tool from where it was at its begin, m.
    pub distance_m: f64,
}

/// A row for each fault that was injected, in the order of time.
pub fn rows(scenario: &Scenario, trace: &Trace) -> Vec<FaultRow> {
    let is_injection = |event: &&Event| event.kind == EventKind::FaultInjected as u32;
    let injections: Vec<&Event> = trace.events.iter().filter(is_injection).collect();
    let end_of = |i: usize| injections.get(i + 1).map_or(vme::Ns::MAX, |next| next.t);
    (0..injections.len()).filter_map(|i| row(scenario, trace, injections[i], end_of(i))).collect()
}

fn row(scenario: &Scenario, trace: &Trace, injected: &Event, end: vme::Ns) -> Option<FaultRow> {
    let fault = injected.a as usize;
    let stated = scenario.faults.get(fault)?;
    let from = injected.t;
    let within = |t: vme::Ns| (from..end).contains(&t);
    let after = |event: &Event| seconds(event.t) - seconds(from);
    let consequence = |event: &&Event| {
        let seen = [EventKind::WatchdogExpired, EventKind::AmplifierTrip, EventKind::OverrunTrip];
        within(event.t) && (event.cause != 0 || seen.iter().any(|kind| event.kind == *kind as u32))
    };
    // one that is known ahead, such as a time-out, may stand before earlier ones
    let first = trace.events.iter().filter(consequence).min_by_key(|event| event.t);
    let states = trace.events.iter().filter(|event| event.kind == EventKind::SafetyState as u32);
    let at_begin = states.clone().take_while(|event| event.t < from).last();
    let mut states = states.filter(|event| within(event.t));
    let gravest = at_begin.into_iter().chain(states.clone()).map(|event| event.b as usize).max();
    let stopping = states.find(|event| event.b as usize >= HOLD);
    let probes = trace.plant.iter().filter(|probe| within(probe.t));
    let before = probes.clone().next()?;
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let force = |probe: &messages::PlantProbe| size(&probe.contact[..3]);
    let way = |probe: &messages::PlantProbe| {
        let moved: [f64; 3] = std::array::from_fn(|i| probe.position[i] - before.position[i]);
        size(&moved)
    };
    let limits = scenario.drives().ok()?.each(|drive| drive.torque_limit_nm);
    let torque = |probe: &messages::PlantProbe| {
        (0..messages::JOINTS).map(|i| probe.motor_torque[i].abs() / limits[i]).fold(0.0f64, f64::max)
    };
    let is_braked = |probe: &messages::PlantProbe| probe.status & BRAKE_ENGAGED == BRAKE_ENGAGED;
    let mut braked = None;
    for probe in probes.clone() {
        braked = if is_braked(probe) { braked.or(Some(probe.t)) } else { None };
    }
    let (mut peak_force_n, mut peak_torque_share, mut distance_m) = (0.0f64, 0.0f64, 0.0f64);
    for probe in probes {
        peak_force_n = peak_force_n.max(force(probe));
        peak_torque_share = peak_torque_share.max(torque(probe));
        distance_m = distance_m.max(way(probe));
    }
    Some(FaultRow {
        fault,
        target: stated.target.clone(),
        kind: stated.kind.name().into(),
        injected_s: seconds(from),
        detected_after_s: first.map(after),
        detected_by: first.and_then(detector).map(|detector| detector.name().into()),
        card: first.and_then(|event| silent_card(scenario, event)).map(str::to_owned),
        stopping_after_s: stopping.map(after),
        braked_after_s: braked.map(|t| seconds(t) - seconds(from)),
        reaction: STATES.get(gravest.unwrap_or(0)).copied().unwrap_or("unknown").into(),
        peak_force_n,
        force_before_n: force(before),
        peak_torque_share,
        distance_m,
    })
}

/// What fires although no fault has been injected yet, in words; in real time with what the machine has to do with it.
pub(crate) fn trips(trace: &Trace) -> Vec<String> {
    let injected = trace.events.iter().find(|event| event.kind == EventKind::FaultInjected as u32);
    let from = injected.map_or(vme::Ns::MAX, |event| event.t);
    let fired = |event: &&Event| event.kind == EventKind::Detected as u32 && event.t < from;
    let mut times: BTreeMap<Detector, Vec<f64>> = BTreeMap::new();
    for event in trace.events.iter().filter(fired) {
        if let Some(detector) = detector(event) {
            times.entry(detector).or_default().push(seconds(event.t));
        }
    }
    let of_each = times.iter().map(|(detector, times)| {
        let often = if times.len() > 1 { format!(" {} times, first", times.len()) } else { String::new() };
        format!("{} fired{often} at {:.3} s: nothing was injected", detector.name(), times[0])
    });
    let late = if times.is_empty() { None } else { late_steps(&trace.measured) };
    of_each.chain(late).collect()
}

/// How late the machine ran the boards' steps, where it did.
fn late_steps(measured: &[LatencyRow]) -> Option<String> {
    let steps = || measured.iter().filter(|row| row.path.starts_with("wake-up"));
    let (late, all) = (steps().filter_map(|row| row.missed).sum::<u64>(), steps().map(|row| row.n).sum::<u64>());
    let latest = steps().max_by_key(|row| row.max_ns).filter(|_| late > 0)?;
    Some(format!(
        "this machine began {late} of {all} steps more than a stage late, {} by {:.1} ms: what is late then is late in the rack",
        latest.path.trim_start_matches("wake-up "),
        latest.max_ns as f64 * 1e-6
    ))
}

/// The card that has not answered, by the address at which the bus timer ended a cycle. Where the bus was not granted, no card
/// was asked.
fn silent_card<'s>(scenario: &'s Scenario, event: &Event) -> Option<&'s str> {
    let address = match EventKind::from_number(event.kind)? {
        EventKind::BusError => event.b,
        EventKind::Detected => event.a,
        _ => return None,
    };
    let answers = |slave: &&vme::rack::Slave| (address as u32).wrapping_sub(slave.base) < slave.size;
    let of_bus_timer = event.cause == Detector::BusError as u32;
    of_bus_timer.then(|| scenario.rack.slaves.iter().find(answers)).flatten().map(vme::rack::Slave::card)
}

/// Cards that did not answer, each since when, s, and transfers that the bus was not granted for, in the order of time.
pub(crate) fn silences(scenario: &Scenario, trace: &Trace) -> Vec<String> {
    let mut found: Vec<(Option<&str>, f64)> = Vec::new();
    for event in trace.events.iter().filter(|event| event.kind == EventKind::BusError as u32) {
        let card = silent_card(scenario, event);
        let known = card.is_some() || event.cause == Detector::AccessTimer as u32;
        if known && !found.iter().any(|(other, _)| *other == card) {
            found.push((card, seconds(event.t)));
        }
    }
    let words = |(card, at_s): (Option<&str>, f64)| match card {
        Some(card) => format!("card {card} did not answer at {at_s:.4} s (BERR*)"),
        None => format!("the bus was not granted at {at_s:.4} s (access timer)"),
    };
    found.into_iter().map(words).collect()
}

/// What an event was detected by: the detector, or what such an event itself is.
fn detector(event: &Event) -> Option<Detector> {
    let of_kind = match EventKind::from_number(event.kind)? {
        EventKind::WatchdogExpired => Some(Detector::OutputWatchdog),
        EventKind::AmplifierTrip => Some(Detector::AmplifierTrip),
        EventKind::OverrunTrip => Some(Detector::Overrun),
        _ => None,
    };
    Detector::from_number(event.cause).or(of_kind)
}

/// Headings of the fault table.
pub(crate) const HEADINGS: [&str; 10] =
    ["fault", "at s", "detected by", "after ms", "stopping after ms", "braked after ms", "reaction", "force before, peak N", "peak torque %", "moved mm"];

/// Cells of the fault table.
pub(crate) fn cells(rows: &[FaultRow]) -> Vec<Vec<String>> {
    let ms = |after: Option<f64>| after.map_or("–".into(), |after| format!("{:.2}", 1e3 * after));
    let cells = |row: &FaultRow| {
        vec![
            format!("{}: {} of {}", row.fault, row.kind, row.target),
            format!("{:.4}", row.injected_s),
            match (&row.detected_by, &row.card) {
                (Some(detector), Some(card)) => format!("{detector}: {card}"),
                (detector, _) => detector.clone().unwrap_or("undetected".into()),
            },
            ms(row.detected_after_s),
            ms(row.stopping_after_s),
            ms(row.braked_after_s),
            row.reaction.clone(),
            format!("{:.1}, {:.1}", row.force_before_n, row.peak_force_n),
            format!("{:.0}", 1e2 * row.peak_torque_share),
            format!("{:.2}", 1e3 * row.distance_m),
        ]
    };
    rows.iter().map(cells).collect()
}
