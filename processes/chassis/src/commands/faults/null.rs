//! Runs without a fault: nothing may trip.

use super::draw::run_seed;
use super::plan::Plan;
use super::progress;
use super::watch::{Seen, first_trip, watch_for_trips};
use crate::parallel::parallel;
use crate::rack_run::INTERRUPTED;
use board::Ns;
use miette::miette;
use report::{FalseTrip, NullRuns, Trace};
use scenario::Scenario;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// Most runs at a time; what they come to is looked at between.
const BATCH: usize = 64;

/// The twins of the faults, and runs of `scenario` until the tool has been in contact for the hours asked for.
pub fn runs(plan: &Plan, scenario: &Scenario, seed: u64, twins: &BTreeMap<u64, Seen>) -> miette::Result<NullRuns> {
    let mut null = NullRuns::default();
    for (seed, Seen { trace: twin, .. }) in twins {
        null.runs += 1;
        null.simulated_s += twin.plant.last().map_or(0.0, |probe| seconds(probe.t));
        null.contact_s += seconds(contact(twin));
        null.false_trips.extend(first_trip(&twin.events).map(|trip| trip_of(*seed, trip)));
    }
    let wanted = plan.null.hours * 3600.0;
    let (mut contact_s, mut next, mut batch) = (0.0, plan.twins as u64, 1);
    let bar = progress(wanted as u64, "s in contact without a fault");
    while contact_s < wanted && null.false_trips.is_empty() && !INTERRUPTED.load(Ordering::Relaxed) {
        let seeds: Vec<u64> = (next..next + batch as u64).map(|number| run_seed(seed, number)).collect();
        next += batch as u64;
        let before_s = contact_s;
        for (seed, run) in seeds.iter().zip(parallel(&seeds, |seed| {
            let run = watch_for_trips(Scenario { seed: *seed, ..scenario.clone() });
            if let Ok((quiet, _)) = &run {
                bar.inc(seconds(quiet.contact) as u64);
            }
            run
        })) {
            let (quiet, end) = run.map_err(|reason| miette!("run without a fault, seed {seed}: {reason}"))?;
            null.runs += 1;
            null.simulated_s += quiet.trip.as_ref().map_or(seconds(end), |(t, _)| seconds(*t));
            contact_s += seconds(quiet.contact);
            null.false_trips.extend(quiet.trip.map(|trip| trip_of(*seed, trip)));
        }
        let each_s = (contact_s - before_s) / batch as f64;
        if each_s == 0.0 && null.false_trips.is_empty() {
            return Err(miette!("runs without a fault: the tool touches nothing"));
        }
        // one to see how long the tool is in contact, then as many as it takes
        batch = (((wanted - contact_s) / each_s).ceil() as usize).clamp(1, BATCH);
    }
    bar.finish_and_clear();
    null.contact_s += contact_s;
    Ok(null)
}

fn trip_of(seed: u64, (t, what): (Ns, String)) -> FalseTrip {
    FalseTrip { seed, at_s: seconds(t), what }
}

fn seconds(t: Ns) -> f64 {
    t as f64 * 1e-9
}

/// Time in contact, ns.
fn contact(trace: &Trace) -> Ns {
    let touches = |probe: &messages::PlantProbe| probe.contact[..3].iter().any(|force| *force != 0.0);
    trace.plant.windows(2).filter(|pair| touches(&pair[1])).map(|pair| pair[1].t - pair[0].t).sum()
}
