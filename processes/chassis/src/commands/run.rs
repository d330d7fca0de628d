//! `vmerack run`: runs every variant of a scenario, prints the tables, writes records and report.
//!
//! Exit code 0 where every limit holds, 1 where a run could not be carried out, 3 where a process was lost on the way or a
//! record is incomplete, 4 where a limit is violated.

use crate::parallel::parallel;
use crate::settled_record;
use crate::rack_run::{self, Finished, INTERRUPTED, Pacing, Setting};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr, miette};
use report::{RunReport, Sweep, SweepPoint, Verdict};
use messages::BoardId;
use scenario::{Document, Restart, Scenario, ScenarioError, Variant};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Run every variant of a scenario.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// A built-in scenario or a file.
    scenario: String,
    /// Simulated time in lock step (reproducible to the bit), or wall clock.
    #[arg(long, value_enum, default_value_t = Pacing::Lockstep)]
    pacing: Pacing,
    /// Run every board in this process.
    #[arg(long, conflicts_with = "pacing")]
    in_process: bool,
    /// In real time: refuse to run without a right that the machine refuses.
    #[arg(long)]
    strict: bool,
    /// Folder for report.json, report.html and one record per variant [default: a new folder in runs/].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of every random stream.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Simulated length, in place of the scenario's.
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Run this variant only; may be repeated.
    #[arg(long, value_name = "NAME")]
    variant: Vec<String>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// How often a process that dies unplanned is started again (never, once, always); may be repeated.
    #[arg(long, value_name = "PROCESS=POLICY")]
    restart: Vec<String>,
    /// Write no record.
    #[arg(long)]
    no_record: bool,
    /// Print report.json to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Runs the command and returns its exit code.
pub fn run(args: RunArgs) -> miette::Result<u8> {
    let mut overrides = args.set.clone();
    overrides.extend(args.seed.map(|seed| format!("seed={seed}")));
    overrides.extend(args.strict.then(|| "realtime.strict=true".to_owned()));
    overrides.extend(args.duration.map(|seconds| format!("duration_s={seconds:?}")));
    let document = scenario::load(&args.scenario, &overrides)?;
    let mut variants = chosen(&document, &args.variant)?;
    for (_, scenario) in &mut variants {
        args.restart.iter().try_for_each(|policy| set_restart(scenario, policy))?;
    }
    end_on_signals()?;
    for (variant, scenario) in &variants {
        for warning in scenario::warnings(scenario) {
            eprintln!("warning: variant {}: {warning}", variant.name);
        }
        if let Err(error) = rack_run::check(scenario) {
            eprintln!("error: variant {}: {error}", variant.name);
            return Ok(2);
        }
    }
    let folder = out_folder(args.out.as_deref(), &document.name)?;

    let mut results = Vec::new();
    let (mut failed, mut losses) = (false, false);
    for (variant, scenario) in &variants {
        let record = (!args.no_record).then(|| folder.join(format!("{}.mcap", variant.name)));
        if let Some(record) = &record {
            // of a run before in the same folder
            settled_record::parts(record).skip(1).try_for_each(std::fs::remove_file).into_diagnostic()?;
        }
        let (pacing, in_process) = (args.pacing, args.in_process);
        let setting = Setting { pacing, in_process, record: record.clone(), ..Setting::default() };
        let finished = run_with_progress(scenario, variant, &setting)?;
        let mut result = finished.result;
        if let Some(error) = &finished.error {
            eprintln!("error: variant {}: {error}", variant.name);
            if rack_run::is_of_the_scenario(error) {
                return Ok(2);
            }
            failed = true;
        }
        for loss in &finished.losses {
            eprintln!("warning: variant {}: {loss}", variant.name);
            result.findings.push(loss.clone());
        }
        losses |= !finished.losses.is_empty();
        // a run that ends before it begins has none
        if let Some(record) = record.as_ref().filter(|record| !failed || record.exists()) {
            let is_recorder_down = |outage: &scenario::Outage| outage.boards.contains(&BoardId::BusAnalyzer);
            let broken =
                failed || !finished.losses.is_empty() || scenario.outages().iter().any(is_recorder_down);
            match settled_record::settle(record, broken, result.simulated_s) {
                Ok(settled) => {
                    result.digest = Some(settled.digest);
                    for (from_s, to_s) in settled.unrecorded {
                        eprintln!("warning: variant {}: nothing is recorded from {from_s:.3} to {to_s:.3} s", variant.name);
                        result.lacks(from_s, to_s);
                        losses = true;
                    }
                }
                Err(reason) => {
                    eprintln!("error: {reason}");
                    losses = true;
                }
            }
            result.record = record.file_name().map(|name| name.to_string_lossy().into_owned());
        }
        results.push(result);
        if failed {
            break;
        }
    }
    let sweeps = if failed { Vec::new() } else { sweeps(&document, &variants)? };

    let pacing = match (args.pacing, args.in_process) {
        (Pacing::Lockstep, true) => "lock step in one process",
        (Pacing::Lockstep, false) => "lock step across processes",
        (Pacing::Realtime, _) => "real time across processes",
    };
    let base = document.scenario()?;
    let report = RunReport::new(&document.name, &base, pacing, results, sweeps);
    report.write(&folder).map_err(|error| miette!("{error}"))?;
    if args.json {
        println!("{}", report.json().into_diagnostic()?);
    } else {
        print!("{}", report::text::render(&report));
        println!("\nrecord and report: {}", folder.display());
    }
    Ok(match (failed, losses, report.verdict) {
        (true, ..) => 1,
        (false, true, _) => 3,
        (false, false, Verdict::Failed) => 4,
        (false, false, Verdict::Passed) => 0,
    })
}

/// The variants of those names; no names: all of them.
pub(crate) fn chosen(document: &Document, names: &[String]) -> miette::Result<Vec<(Variant, Scenario)>> {
    let mut variants = document.variants()?;
    if let Some(unknown) = names.iter().find(|name| !variants.iter().any(|(variant, _)| variant.name == **name)) {
        let known: Vec<&str> = variants.iter().map(|(variant, _)| variant.name.as_str()).collect();
        return Err(scenario::ScenarioError::Override {
            origin: "--variant".into(),
            key: unknown.clone(),
            message: format!("there is no such variant, expected one of {}", known.join(", ")),
        }
        .into());
    }
    variants.retain(|(variant, _)| names.is_empty() || names.contains(&variant.name));
    Ok(variants)
}

/// The folder asked for, or the first free `runs/NAME-NNN`.
fn out_folder(asked: Option<&Path>, name: &str) -> miette::Result<PathBuf> {
    let make = |folder: &Path| {
        std::fs::create_dir_all(folder).into_diagnostic().wrap_err_with(|| format!("cannot make the folder {}", folder.display()))
    };
    if let Some(folder) = asked {
        make(folder)?;
        return std::path::absolute(folder).into_diagnostic();
    }
    make(Path::new("runs"))?;
    for number in 1.. {
        let folder = Path::new("runs").join(format!("{name}-{number:03}"));
        match std::fs::create_dir(&folder) {
            Ok(()) => return std::path::absolute(folder).into_diagnostic(),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).into_diagnostic().wrap_err_with(|| format!("cannot make the folder {}", folder.display())),
        }
    }
    Err(miette!("no free folder in runs/"))
}

/// The first Ctrl-C or SIGTERM ends the run in order, the second one at once.
pub(crate) fn end_on_signals() -> miette::Result<()> {
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(&INTERRUPTED)).into_diagnostic()?;
        signal_hook::flag::register(signal, Arc::clone(&INTERRUPTED)).into_diagnostic()?;
    }
    Ok(())
}

fn run_with_progress(scenario: &Scenario, variant: &Variant, setting: &Setting) -> miette::Result<Finished> {
    let end = scenario.duration_ns();
    let bar = if std::io::stderr().is_terminal() { ProgressBar::new(end) } else { ProgressBar::hidden() };
    if let Ok(style) = ProgressStyle::with_template("{prefix:24} {bar:40} {percent:>3} %  {elapsed} + {eta}") {
        bar.set_style(style);
    }
    bar.set_prefix(variant.name.clone());
    // a bar needs no more than a few dozen updates
    let mut next = 0;
    let finished = rack_run::run(scenario, variant, setting, &mut |until| {
        if until >= next {
            bar.set_position(until);
            next = until + end / 50;
        }
    });
    bar.finish_and_clear();
    finished.map_err(|reason| miette!("variant {}: {reason}", variant.name))
}

/// Sets the policy of `PROCESS=POLICY`.
fn set_restart(scenario: &mut Scenario, text: &str) -> Result<(), ScenarioError> {
    let (name, policy) = text.split_once('=').unwrap_or((text, ""));
    let policy = match policy {
        "never" => Restart::Never,
        "once" => Restart::Once,
        "always" => Restart::Always,
        _ => return Err(refused("--restart", text, "expected PROCESS=never, PROCESS=once or PROCESS=always")),
    };
    let names: Vec<&str> = scenario.processes.iter().map(|process| process.name.as_str()).collect();
    let unknown = format!("there is no process `{name}`, expected one of {}", names.join(", "));
    let Some(process) = scenario.processes.iter_mut().find(|process| process.name == name) else {
        return Err(refused("--restart", text, &unknown));
    };
    if policy != Restart::Never && !process.is_dispensable() {
        return Err(refused("--restart", text, "the run ends with a process of any board but workstation and bus_analyzer"));
    }
    process.restart = Some(policy);
    Ok(())
}

fn refused(origin: &str, key: &str, message: &str) -> ScenarioError {
    ScenarioError::Override { origin: origin.into(), key: key.into(), message: message.into() }
}

/// The report's sweeps, in this process, on every core.
fn sweeps(document: &Document, variants: &[(Variant, Scenario)]) -> miette::Result<Vec<Sweep>> {
    let mut sweeps = Vec::new();
    for sweep in &document.scenario()?.report.sweeps {
        let across: Vec<Option<f64>> =
            sweep.across.as_ref().map_or(vec![None], |across| across.values.iter().copied().map(Some).collect());
        let mut jobs = Vec::new();
        for (value, second) in sweep.values.iter().flat_map(|value| across.iter().map(move |second| (*value, *second))) {
            let mut varied = document.with(&sweep.key, toml::Value::Float(value))?;
            if let (Some(across), Some(second)) = (&sweep.across, second) {
                varied = varied.with(&across.key, toml::Value::Float(second))?;
            }
            for (variant, scenario) in varied.variants()? {
                if sweep.variants.contains(&variant.name) && variants.iter().any(|(run, _)| run.name == variant.name) {
                    jobs.push((value, second, variant, scenario));
                }
            }
        }
        let mut points = parallel(&jobs, |(value, second, variant, scenario)| {
            let setting = Setting { in_process: true, ..Setting::default() };
            rack_run::run(scenario, variant, &setting, &mut |_| {})
                .map(|finished| SweepPoint::new(*value, *second, &finished.result))
        });
        let points = points
            .drain(..)
            .collect::<Result<Vec<_>, String>>()
            .map_err(|reason| miette!("sweep {}: {reason}", sweep.key))?;
        let across = sweep.across.as_ref().map(|across| across.key.clone());
        sweeps.push(Sweep { key: sweep.key.clone(), across, points });
    }
    Ok(sweeps)
}
