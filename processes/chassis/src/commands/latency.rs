//! `vmerack latency`: how late things are, on this machine and in the modelled rack, in separate tables.
//!
//! One run of the rack in real time; the machine's own means right after it, at the same rate, with the same rights; the
//! same cycles in simulated time. Exit code 3 where messages, or measurements of them, were lost or counted twice, 4 where a limit of the scenario (`[[realtime.limit]]`) is violated.

use crate::commands::run::{chosen, end_on_signals};
use crate::machine::Conditions;
use crate::rack_run::{self, Finished, Pacing, Setting};
use channels::baseline::{self, Means};
use clap::Args;
use miette::{IntoDiagnostic, WrapErr, miette};
use report::Verdict;
use report::latency::{LatencyReport, LatencyRow, MeasuringCost, Recorder};
use scenario::{Scenario, Variant};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Messages through each of the machine's own means, at the most.
const BASELINE_MESSAGES: f64 = 1000.0;
/// Least length of the run that shows what measuring costs, s: some fifty pairs.
const COST_S: f64 = 20.0;
/// Part of a period that a job may compute where `--rate` makes the scenario's time too long.
const BUSY: f64 = 0.4;

/// Measure how late things are, on this machine and in the modelled rack.
#[derive(Debug, Args)]
pub struct LatencyArgs {
    /// A built-in scenario or a file.
    #[arg(default_value = "table-5-3")]
    scenario: String,
    /// Length of the run in real time.
    #[arg(long, value_name = "N", default_value_t = 10.0)]
    seconds: f64,
    /// Rate of the control task, in place of the scenario's.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Keep every processor busy beside it.
    #[arg(long)]
    load: bool,
    /// Refuse to run without a right that the machine refuses.
    #[arg(long)]
    strict: bool,
    /// Run once more, for 20 s at least, with and without measuring in turn, to show what measuring costs.
    #[arg(long, conflicts_with = "load")]
    cost: bool,
    /// Variant [default: the first].
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Folder for latency.json, latency.html, latency.hlog and latency.hist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print latency.json to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Measures and returns the exit code.
pub fn run(args: LatencyArgs) -> miette::Result<u8> {
    if !(args.seconds > 0.0 && args.seconds <= 86_400.0) || args.rate.is_some_and(|rate| !(1.0..=20_000.0).contains(&rate)) {
        return Err(miette!("--seconds takes more than 0 up to a day, --rate 1 to 20000 Hz"));
    }
    let (variant, scenario) = resolve(&args)?;
    std::fs::create_dir_all(&args.out)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot make the folder {}", args.out.display()))?;
    end_on_signals()?;
    let hogs = args.load.then(Hogs::start);
    let conditions = Conditions::begin();
    let cycle_ns = control_period(&scenario)?;
    let setting = Setting { pacing: Pacing::Realtime, untraced: true, ..Setting::default() };
    let finished = measured(&variant, &scenario, &setting)?;
    let measurement = finished.measurement.ok_or_else(|| miette!("realtime.measure is false: nothing was measured"))?;
    let rate_hz = 1e9 / cycle_ns as f64;
    let baselines = baselines(&scenario, rate_hz, args.seconds)?;
    let machine = conditions.facts();
    drop(hogs);
    let cost = Setting { cost: Some(cycle_ns), ..setting };
    let measuring_cost = if args.cost { Some(cost_of_measuring(&variant, &scenario, &cost)?) } else { None };
    let modelled = simulated_time(&variant, &scenario)?;
    let mut report = LatencyReport {
        schema_version: 0,
        scenario: format!("{}, variant {}{}", args.scenario, variant.name, if args.load { ", under load" } else { "" }),
        rate_hz,
        seconds: args.seconds,
        machine,
        verdict: Verdict::Passed,
        limits: Vec::new(),
        baselines,
        measured: measurement,
        modelled: modelled.measurement.ok_or_else(|| miette!("nothing was measured in simulated time"))?,
        modelled_transfers: modelled.result.transfers,
        measuring_cost,
    };
    report.judge(&scenario.realtime.limits);
    report.write(&args.out).map_err(|error| miette!("{error}"))?;
    if args.json {
        println!("{}", report.json().into_diagnostic()?);
    } else {
        print!("{}", report.text());
        println!("\nlatency.json, latency.html, latency.hlog, latency.hist: {}", args.out.display());
    }
    let uncounted = report.measured.unmeasured > 0;
    Ok(match report.verdict {
        _ if uncounted || report.measured.channels.iter().any(|channel| channel.lost + channel.twice > 0) => 3,
        Verdict::Failed => 4,
        Verdict::Passed => 0,
    })
}

/// The scenario at the rate and length asked for.
fn resolve(args: &LatencyArgs) -> miette::Result<(Variant, Scenario)> {
    let mut overrides = args.set.clone();
    overrides.push(format!("duration_s={:?}", args.seconds));
    overrides.extend(args.strict.then(|| "realtime.strict=true".to_owned()));
    if let Some(rate) = args.rate {
        overrides.push(format!("rack.tasks.control.period_ns={}", (1e9 / rate).round() as u64));
        let plain = scenario::load(&args.scenario, &args.set)?.scenario()?.controller;
        let period_us = 1e6 / rate;
        let busy = plain.execution_us + plain.entry_us;
        if busy > BUSY * period_us {
            let scale = BUSY * period_us / busy;
            overrides.push(format!("controller.execution_us={:?}", plain.execution_us * scale));
            overrides.push(format!("controller.entry_us={:?}", plain.entry_us * scale));
            eprintln!("the control task's {busy} µs do not fit {rate} Hz: modelled as {:.1} µs", busy * scale);
        }
    }
    let document = scenario::load(&args.scenario, &overrides)?;
    let names: Vec<String> = args.variant.iter().cloned().collect();
    chosen(&document, &names)?.into_iter().next().ok_or_else(|| miette!("the scenario has no variant"))
}

fn control_period(scenario: &Scenario) -> miette::Result<u64> {
    let task = scenario.task_of("control_computer").and_then(|task| scenario.rack.tasks.get(usize::from(task)));
    let period = task.map(|task| task.period_ns).filter(|period| *period > 0);
    period.ok_or_else(|| miette!("the control task has no period of its own: give it one, rack.tasks.control.period_ns"))
}

fn measured(variant: &Variant, scenario: &Scenario, setting: &Setting) -> miette::Result<Finished> {
    let finished = rack_run::run(scenario, variant, setting, &mut |_| {}).map_err(|reason| miette!("{reason}"))?;
    match finished.error {
        Some(error) => Err(miette!("{error}")),
        None => Ok(finished),
    }
}

fn simulated_time(variant: &Variant, scenario: &Scenario) -> miette::Result<Finished> {
    measured(variant, scenario, &Setting { in_process: true, measure: true, untraced: true, ..Setting::default() })
}

/// A run in which stretches with and without measuring take turns.
fn cost_of_measuring(variant: &Variant, scenario: &Scenario, setting: &Setting) -> miette::Result<MeasuringCost> {
    let duration_s = Some(scenario.duration().max(COST_S));
    let run = measured(variant, &Scenario { duration_s, ..scenario.clone() }, setting)?;
    run.measuring_cost.ok_or_else(|| miette!("the run ended before it could show what measuring costs"))
}

/// The machine's own means, one after the other.
fn baselines(scenario: &Scenario, rate_hz: f64, seconds: f64) -> miette::Result<Vec<LatencyRow>> {
    let folder = tempfile::tempdir().into_diagnostic()?;
    let this = std::env::current_exe().into_diagnostic()?;
    let period_ns = (1e9 / rate_hz) as u64;
    let count = (seconds * rate_hz).clamp(10.0, BASELINE_MESSAGES) as u32;
    let mut rows = Vec::new();
    for (i, means) in Means::ALL.into_iter().enumerate() {
        let own = folder.path().join(i.to_string());
        std::fs::create_dir(&own).into_diagnostic()?;
        let prefix = format!("vb{}_{i}_", std::process::id());
        let mut receiver = Command::new(&this);
        receiver.args(["receive", means.name(), &prefix]).arg(&own).arg(scenario.realtime.priority.to_string());
        let times = baseline::measure(means, count, period_ns, receiver, &own, &prefix);
        channels::remove_leftovers(&prefix);
        let mut row = Recorder::new(means.name());
        for (i, time) in (0..).zip(times.map_err(|error| miette!("{error}"))?) {
            row.record(i * period_ns, time);
        }
        rows.push(row.finish());
    }
    Ok(rows)
}

/// The other end of a means, with the rights of the rack's processes: `vmerack receive MEANS PREFIX FOLDER PRIORITY`.
pub fn receive(means: &str, prefix: &str, folder: &Path, priority: u8) -> miette::Result<u8> {
    let means = Means::from_name(means).ok_or_else(|| miette!("there are no means `{means}`"))?;
    // what is refused the sender has said
    pacing::ask_for_rights(&scenario::Realtime { priority, ..Default::default() }, None);
    baseline::receive(means, folder, prefix, &mut std::io::stdout()).map_err(|error| miette!("{error}"))?;
    Ok(0)
}

/// Busy loops, one per processor, until dropped.
struct Hogs {
    end: Arc<AtomicBool>,
}

impl Hogs {
    fn start() -> Hogs {
        let end = Arc::new(AtomicBool::new(false));
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            let end = Arc::clone(&end);
            std::thread::spawn(move || {
                while !end.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        Hogs { end }
    }
}

impl Drop for Hogs {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
    }
}
