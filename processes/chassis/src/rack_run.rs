//! One variant of a scenario, from power-up to the last window, and what it comes to.

use crate::boards;
use crate::cost_meter::CostMeter;
use crate::status::{self, Shown, Status};
use board::{Mail, Ns};
use clap::ValueEnum;
use messages::{EventKind, Severity, Span, drive_status};
use pacing::{Context, Flow, Lockstep, Observer, Realtime, RunError};
use report::latency::{Clock, Journal, Measurement, MeasuringCost};
use report::{Accounting, BusAccount, Ended, Ledger, Trace, VariantResult};
use scenario::{Scenario, Variant};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};
use vme::{Log, Origin, Program};

/// Set by Ctrl-C; every run of this process ends soon after.
pub static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// How time goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Pacing {
    /// Simulated time, as fast as the machine allows.
    #[default]
    Lockstep,
    /// Wall clock.
    Realtime,
}

impl Pacing {
    fn name(self) -> &'static str {
        match self {
            Pacing::Lockstep => "lock step",
            Pacing::Realtime => "real time",
        }
    }
}

/// What a run needs to know beside its scenario.
#[derive(Clone, Debug, Default)]
pub struct Setting {
    /// How time goes.
    pub pacing: Pacing,
    /// Every board in the chassis.
    pub in_process: bool,
    /// Record to write; none = recording off.
    pub record: Option<PathBuf>,
    /// Measure in simulated time; real time measures anyhow, unless the scenario says otherwise.
    pub measure: bool,
    /// In real time: measure in every other stretch only, and compare the processor time per so long a cycle, ns.
    pub cost: Option<Ns>,
    /// Only what is measured is of interest: what arm and controller did is not kept, however long the run.
    pub untraced: bool,
}

/// Longest rehearsal: every usual task has decided by then.
const REHEARSED: Ns = 1000 * vme::MILLISECOND;
/// Events of severity error that a watcher sees.
const FAULTS: usize = 8;
/// Windows for which the trace has room from the start; a longer run makes more when it needs it.
const ROOM: f64 = 1e5;

/// What a run came to.
pub struct Finished {
    /// Measures, tables, curves.
    pub result: VariantResult,
    /// Why it ended before its time, where it did.
    pub error: Option<RunError>,
    /// What was lost although the run went on, in words.
    pub losses: Vec<String>,
    /// Wall time from the start to the first window.
    pub start_up: Duration,
    /// Wall time of the windows.
    pub windows: Duration,
    /// What was measured, where anything was.
    pub measurement: Option<Measurement>,
    /// What measuring costs, where that was compared.
    pub measuring_cost: Option<MeasuringCost>,
}

/// Runs one variant's scenario to its end, or as far as it goes. `progress` hears the simulated time.
/// The error says what of the scenario cannot be measured.
pub fn run(
    scenario: &Scenario,
    variant: &Variant,
    setting: &Setting,
    progress: &mut dyn FnMut(Ns),
) -> Result<Finished, String> {
    let start = Instant::now();
    let mut witness = Witness {
        trace: Trace::default(),
        untraced: setting.untraced,
        ledger: Ledger::new(scenario),
        accounting: Accounting::new(scenario).map_err(|error| error.to_string())?,
        journal: None,
        cost: None,
        shown: None,
        status: Status {
            pid: std::process::id(),
            run: format!("{}, variant {}", scenario.title, variant.name),
            pacing: setting.pacing.name().into(),
            ..Status::default()
        },
        reached: 0,
        diverged: false,
        losses: Vec::new(),
        windows: 0,
        start_up: Duration::ZERO,
        ended: Duration::ZERO,
        start,
        progress,
    };
    let error = carry_out(scenario, variant, setting, &mut witness).err();
    let windows = witness.ended.saturating_sub(witness.start_up);
    let at_s = witness.reached as f64 * 1e-9;
    let ended = match &error {
        Some(error) => Ended::Stopped { at_s, reason: error.to_string() },
        None if witness.diverged => Ended::Diverged { at_s },
        None => Ended::Completed,
    };
    let measurement = witness.journal.take().map(Journal::finish);
    if let Some(measurement) = measurement.as_ref().filter(|_| setting.pacing == Pacing::Realtime) {
        witness.trace.measured.clone_from(&measurement.rows);
    }
    let mut result = VariantResult::new(scenario, variant, &witness.trace, &witness.ledger, ended, at_s)?;
    result.wall_s = Some(windows.as_secs_f64());
    let Witness { losses, start_up, cost, .. } = witness;
    let measuring_cost = cost.and_then(CostMeter::finish);
    Ok(Finished { result, error, losses, start_up, windows, measurement, measuring_cost })
}

fn carry_out(
    scenario: &Scenario,
    variant: &Variant,
    setting: &Setting,
    witness: &mut Witness<'_>,
) -> Result<(), RunError> {
    let end = scenario.duration_ns();
    let measure = match setting.pacing {
        Pacing::Lockstep => setting.measure,
        Pacing::Realtime => scenario.realtime.measure,
    };
    let (variant, record) = (variant.name.clone(), setting.record.clone());
    let in_process = setting.in_process;
    let shortest = scenario.rack.tasks.iter().map(|task| task.period_ns).filter(|period| *period > 0).min();
    let windows = scenario.duration() * 1e9 / shortest.unwrap_or(vme::MILLISECOND) as f64;
    let room = if setting.untraced { 0 } else { windows.min(ROOM) as usize };
    let context = Context { prefix: String::new(), variant, record, measure, in_process, scenario: scenario.clone() };
    match setting.pacing {
        Pacing::Lockstep => {
            let mut rack = Lockstep::power_up(context, &boards::build, &boards::program, &INTERRUPTED)?;
            witness.start_up = witness.start.elapsed();
            witness.trace.reserve(room);
            witness.journal = measure.then(|| Journal::new(Clock::Simulated, 0));
            witness.shown = rack.folder().map(Shown::new);
            let ran = rack.run(end, witness);
            witness.ended = witness.start.elapsed();
            witness.losses.extend_from_slice(rack.losses());
            witness.trace.bus = Some(witness.accounting.close(rack.timing(), &rack.programs()));
            ran?;
            rack.finish()
        }
        Pacing::Realtime => {
            let mut rack = Realtime::power_up(context, &boards::build, &boards::program, &INTERRUPTED)?;
            witness.start_up = witness.start.elapsed();
            // not before memory has been locked: room is touched when it is used
            witness.trace.reserve(room);
            witness.cost = setting.cost.map(|cycle| CostMeter::new(scenario, &rack, cycle));
            witness.journal = measure.then(|| Journal::new(Clock::Wall, rack.zero()));
            witness.shown = rack.folder().map(Shown::new);
            let ran = rack.run(end, witness);
            witness.ended = witness.start.elapsed();
            witness.losses.extend_from_slice(rack.losses());
            witness.trace.bus = Some(witness.accounting.close(rack.timing(), &rack.programs()));
            ran?;
            rack.finish(witness)
        }
    }
}

/// Runs the start of a scenario in this process, three periods of its slowest task but at most [`REHEARSED`], and returns
/// the longest job of each task with the account of bus and processors. The error says what of the scenario its boards
/// or its rack cannot carry out.
pub fn rehearse(scenario: &Scenario) -> Result<(Vec<Program>, BusAccount), RunError> {
    let longest = scenario.rack.tasks.iter().map(|task| task.period_ns).max().unwrap_or(vme::MILLISECOND);
    let mut listener = Listener(Accounting::new(scenario)?);
    let rack = listen(scenario, longest.saturating_mul(3).min(REHEARSED), &mut listener)?;
    let programs = rack.programs();
    let account = listener.0.close(rack.timing(), &programs);
    Ok((programs, account))
}

/// Runs the start of a scenario in this process, up to `end`, for somebody who listens.
pub fn listen(scenario: &Scenario, end: Ns, observer: &mut dyn Observer) -> Result<Lockstep<'static>, RunError> {
    let scenario = scenario.clone();
    let (prefix, variant) = (String::new(), String::new());
    let context = Context { prefix, variant, record: None, measure: false, in_process: true, scenario };
    let mut rack = Lockstep::power_up(context, &boards::build, &boards::program, &INTERRUPTED)?;
    rack.run(end, observer)?;
    Ok(rack)
}

/// Whether boards and rack can carry the scenario out, as far as a rehearsal shows. What a program of the user's own asks
/// for, it says itself when it runs.
pub fn check(scenario: &Scenario) -> Result<(), RunError> {
    if scenario.processes.iter().any(|process| !process.command.is_empty()) {
        return Ok(());
    }
    match rehearse(scenario) {
        Err(error) if is_of_the_scenario(&error) => Err(error),
        _ => Ok(()),
    }
}

/// Whether a run failed because the scenario asks for what its boards or its rack cannot do.
pub fn is_of_the_scenario(error: &RunError) -> bool {
    matches!(error, RunError::Rack(_) | RunError::Board { .. })
}

struct Listener(Accounting);

impl Observer for Listener {
    fn account(&mut self, until: Ns, log: &Log, record: &mut Mail) {
        self.0.window(until, log, &mut record.masters, &mut record.paths);
    }

    fn window(&mut self, _until: Ns, _mail: &Mail, _log: &Log) -> Flow {
        Flow::Continue
    }
}

/// Collects what a run is measured by, and ends it when the plant has left its domain.
struct Witness<'a> {
    trace: Trace,
    untraced: bool,
    ledger: Ledger,
    accounting: Accounting,
    journal: Option<Journal>,
    cost: Option<CostMeter>,
    /// Where somebody may watch.
    shown: Option<Shown>,
    status: Status,
    reached: Ns,
    diverged: bool,
    losses: Vec<String>,
    windows: u64,
    start_up: Duration,
    /// Wall time from the start to the end of the last window.
    ended: Duration,
    start: Instant,
    progress: &'a mut dyn FnMut(Ns),
}

impl Witness<'_> {
    /// Keeps the status for whoever watches.
    fn show(&mut self, until: Ns, mail: &Mail) {
        let status = &mut self.status;
        if let Some(probe) = mail.control_probe.last() {
            status.state = safety_state(probe.state).into();
        }
        for event in mail.events.iter().filter(|event| event.severity == Severity::Error as u32) {
            let name = EventKind::from_number(event.kind).map_or("unknown", EventKind::name);
            status.faults.truncate(FAULTS - 1);
            status.faults.insert(0, format!("{name} at {:.4} s", event.t as f64 * 1e-9));
        }
        // a look at the clock a few times a millisecond of simulated time is enough
        self.windows += 1;
        let often = if self.journal.is_some() { 16 } else { 256 };
        let Some(shown) = self.shown.as_mut().filter(|_| self.windows % often == 0) else { return };
        if shown.due() {
            status.simulated_s = until as f64 * 1e-9;
            status.wall_s = self.start.elapsed().saturating_sub(self.start_up).as_secs_f64();
            if let Some(journal) = &self.journal {
                status.rows = status::rows(journal, status.wall_s);
            }
            shown.write(status);
        }
    }
}

/// Safety state as people call it.
fn safety_state(number: u32) -> &'static str {
    ["run", "degraded", "SS2 hold", "SS1 stop", "STO"].get(number as usize).copied().unwrap_or("unknown")
}

impl Observer for Witness<'_> {
    fn account(&mut self, until: Ns, log: &Log, record: &mut Mail) {
        self.accounting.window(until, log, &mut record.masters, &mut record.paths);
    }

    fn window(&mut self, until: Ns, mail: &Mail, log: &Log) -> Flow {
        self.reached = until;
        if !self.untraced {
            self.trace.window(&mail.plant_probe, &mail.control_probe, &mail.events);
        }
        let programs = log.transfers.iter().filter(|transfer| transfer.origin == Origin::Program);
        programs.for_each(|transfer| self.ledger.push(transfer));
        for event in mail.events.iter().filter(|event| event.kind == EventKind::RecordLost as u32) {
            let (at_s, reason) = (event.t as f64 * 1e-9, std::io::Error::from_raw_os_error(event.a as i32));
            self.losses.push(format!("the record ends at {at_s:.3} s of simulated time: {reason}"));
        }
        self.diverged |= mail.plant_probe.iter().any(|probe| probe.status & drive_status::DIVERGED != 0);
        if let Some(cost) = &mut self.cost {
            cost.window(until);
        }
        (self.progress)(until);
        self.show(until, mail);
        if self.diverged { Flow::Stop } else { Flow::Continue }
    }

    fn measures(&mut self, from: Ns) -> bool {
        self.cost.is_none() || CostMeter::measures(from)
    }

    fn measured(&mut self, spans: &[Span], lost: u32) {
        if let Some(journal) = &mut self.journal {
            journal.take(spans, lost);
        }
    }
}
