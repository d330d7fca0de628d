//! `vmerack faults`: draws faults of every kind in every phase of a task, runs each beside its fault-free twin, and says
//! what saw it, when, and what came of it.
//!
//! Exit code 0 where everything holds, 1 where a run could not be carried out, 4 where anything falls short: a kind that is
//! detected too seldom or too late, another reaction than expected, too much force, a false trip, a kind without enough
//! faults that have an effect.

mod draw;
mod effect;
mod judge;
mod null;
pub mod plan;
mod shows;
mod watch;

use crate::commands::run::end_on_signals;
use crate::parallel::parallel;
use crate::rack_run::INTERRUPTED;
use clap::Args;
use draw::Draw;
use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr, miette};
use plan::Plan;
use report::{CampaignReport, DrawRow, SCHEMA_VERSION, Verdict};
use scenario::{Problem, Scenario, ScenarioError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use watch::Seen;

/// Put faults of every kind into a task, and judge how each is detected and survived.
#[derive(Debug, Args)]
pub struct FaultsArgs {
    /// A built-in scenario or a file, without faults of its own.
    #[arg(default_value = "campaign")]
    scenario: String,
    /// What is drawn and what is expected, as a TOML file [default: every kind in every phase of the scenario `campaign`].
    #[arg(long, value_name = "FILE")]
    campaign: Option<String>,
    /// These kinds only.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    kinds: Vec<String>,
    /// Faults of each kind in each phase, in place of the campaign's; too few to show anything is no failure then.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: Option<u32>,
    /// Seed of every draw [default: the scenario's].
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u64).range(0..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Simulated hours without a fault in contact, in place of the campaign's.
    #[arg(long, value_name = "H")]
    null_hours: Option<f64>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Folder for campaign.json, campaign.csv and report.html.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Runs the command and returns its exit code.
pub fn run(args: FaultsArgs) -> miette::Result<u8> {
    end_on_signals()?;
    let refused = |origin: &str, problem: Problem| -> ScenarioError {
        ScenarioError::Override { origin: origin.into(), key: problem.key, message: problem.message }
    };
    let document = scenario::load(&args.scenario, &args.set)?;
    let base = document.scenario()?;
    if !base.faults.is_empty() {
        let problem =
            Problem::new("fault", "is stated; expected a scenario without faults: the campaign draws its own");
        return Err(refused(&args.scenario, problem).into());
    }
    let mut plan = Plan::load(args.campaign.as_deref(), &document)?;
    plan.keep(&args.kinds).map_err(|problem| refused("--kinds", problem))?;
    if let Some(repeat) = args.repeat {
        plan.repeats = repeat as usize;
        plan.kinds.iter_mut().for_each(|kind| kind.repeats = None);
    }
    if let Some(hours) = args.null_hours {
        if !(0.0..=1000.0).contains(&hours) {
            let problem = Problem::new("H", format!("is {hours}, expected 0 to 1000"));
            return Err(refused("--null-hours", problem).into());
        }
        plan.null.hours = hours;
    }
    let seed = args.seed.unwrap_or(base.seed);
    let made = make_folder(&args.out)?;
    let draws = draw::draws(&plan, &base, seed);
    let outcome = carry_out(&plan, &base, &draws).and_then(|(rows, twins)| {
        Ok((rows, null::runs(&plan, &plan.null_document(&document)?.scenario()?, seed, &twins)?))
    });
    if INTERRUPTED.load(Ordering::Relaxed) {
        if made {
            // somebody else may have put something there
            let _ = std::fs::remove_dir(&args.out);
        }
        eprintln!("interrupted: nothing is written");
        return Ok(1);
    }
    let (rows, null) = outcome?;
    let strict = args.repeat.is_none();
    let kinds: Vec<_> = plan.kinds.iter().map(|kind| judge::kind_summary(&plan, kind, &rows, strict)).collect();
    let totals = judge::totals(&kinds, &null);
    let passed = totals.false_trips == 0 && kinds.iter().all(|kind| kind.verdict == Verdict::Passed);
    let report = CampaignReport {
        schema_version: SCHEMA_VERSION,
        vmerack: env!("CARGO_PKG_VERSION"),
        scenario: document.name.clone(),
        title: base.title.clone(),
        campaign: args.campaign.clone().unwrap_or("built-in".into()),
        seed,
        period_ms: judge::control_period_ms(&base),
        least_effective: plan.least_effective,
        detected_share: plan.detected_share,
        phases: plan.phases.iter().map(|phase| phase.name.clone()).collect(),
        kinds,
        totals,
        null,
        rows,
        verdict: if passed { Verdict::Passed } else { Verdict::Failed },
    };
    report.write(&args.out).map_err(|error| miette!("{error}"))?;
    print!("{}", report.text());
    println!("\nreport: {}", args.out.join("report.html").display());
    Ok(if passed { 0 } else { 4 })
}

/// Makes the folder; whether it was not there before.
fn make_folder(folder: &Path) -> miette::Result<bool> {
    let new = !folder.exists();
    let made = std::fs::create_dir_all(folder).into_diagnostic();
    made.wrap_err_with(|| format!("--out: cannot make the folder {}", folder.display()))?;
    Ok(new)
}

/// Runs every fault beside its twin; the rows in the order of the draws, and the twins by their seeds.
fn carry_out(plan: &Plan, base: &Scenario, draws: &[Draw]) -> miette::Result<(Vec<DrawRow>, BTreeMap<u64, Seen>)> {
    let failed = |what: &str, reason: String| miette!("{what}: {reason}");
    // a fault that presupposes another one has a twin of its own
    let shared = |draw: &&Draw| draw.faults.len() == 1;
    let mut ends: BTreeMap<u64, vme::Ns> = BTreeMap::new();
    for draw in draws.iter().filter(shared) {
        let end = ends.entry(draw.seed).or_default();
        *end = draw.end.max(*end);
    }
    let seeds: Vec<(u64, vme::Ns)> = ends.into_iter().collect();
    let bar = progress((seeds.len() + draws.len()) as u64, "runs");
    let traces = parallel(&seeds, |(seed, end)| {
        let trace = watch::watch(Scenario { seed: *seed, ..base.clone() }, *end, *end, false);
        bar.inc(1);
        trace.map(|trace| (*seed, trace)).map_err(|reason| failed(&format!("run without a fault, seed {seed}"), reason))
    });
    let twins: BTreeMap<u64, Seen> = traces.into_iter().collect::<miette::Result<_>>()?;
    let rows = parallel(draws, |draw| -> miette::Result<Option<DrawRow>> {
        if INTERRUPTED.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let fault = draw.fault();
        let failed = |reason| {
            failed(
                &format!("{} of {} at {} s, seed {}", fault.kind.name(), fault.target, fault.start_s, draw.seed),
                reason,
            )
        };
        let scenario = draw.scenario(base);
        let own = match shared(&draw) {
            true => None,
            false => Some(watch::watch(draw.twin(base), draw.end, draw.end, false).map_err(failed)?),
        };
        let Some(twin) = own.as_ref().or(twins.get(&draw.seed)) else { return Ok(None) };
        let run = watch::watch(scenario.clone(), draw.at, draw.end, draw.needs_processes()).map_err(failed)?;
        bar.inc(1);
        Ok(Some(judge::row(plan, draw, &scenario, &run, twin)))
    });
    bar.finish_and_clear();
    let rows = rows.into_iter().filter_map(Result::transpose).collect::<miette::Result<_>>()?;
    Ok((rows, twins))
}

/// A bar on a terminal, nothing in a pipe.
fn progress(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}  {elapsed} + {eta}") {
        bar.set_style(style);
    }
    bar.set_message(what.to_owned());
    bar
}
