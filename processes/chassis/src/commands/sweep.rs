//! `vmerack sweep`: runs a scenario over the values of one or more keys, in this process, on all cores.
//!
//! Everything is resolved and checked before anything runs. Each point is written to the output folder as soon as it is
//! there, so that an interrupted sweep takes up where it stopped, and `--shard` spreads the points over machines that share
//! the folder (or whose folders are copied together before `--merge`). A run that diverges or fails is a marked row.

mod picture;
mod plan;
mod store;

use crate::commands::run::{chosen, end_on_signals};
use crate::parallel::parallel;
use crate::rack_run::{self, INTERRUPTED, Setting};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr, miette};
use plan::{Plan, Point, Vary};
use report::Ended;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use store::{Row, Store};

/// Run a scenario over the values of keys.
#[derive(Debug, Args)]
pub struct SweepArgs {
    /// A built-in scenario or a file.
    scenario: String,
    /// Key and its values, n of them from a to b; may be repeated: every combination is run.
    #[arg(long, required = true, value_name = "KEY.PATH=A..B:N")]
    vary: Vec<Vary>,
    /// Measure of the table, as in a scenario's limits; may be repeated [default: those of the scenario's limits].
    #[arg(long, value_name = "NAME")]
    measure: Vec<String>,
    /// Run this variant only; may be repeated.
    #[arg(long, value_name = "NAME")]
    variant: Vec<String>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Run the i-th of n parts only.
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Run nothing; put the parts together.
    #[arg(long, conflicts_with = "shard")]
    merge: bool,
    /// Folder for the points, table.csv and one picture per measure.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Part of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    /// From 1.
    part: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let numbers = text.split_once('/').and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if (1..=of).contains(&part) => Ok(Shard { part, of }),
            _ => Err("expected I/N with I from 1 to N, for example 2/8".into()),
        }
    }
}

/// Runs the command and returns its exit code: 0 complete, 1 interrupted or points missing.
pub fn run(args: SweepArgs) -> miette::Result<u8> {
    let document = scenario::load(&args.scenario, &args.set)?;
    let variants = chosen(&document, &args.variant)?.into_iter().map(|(variant, _)| variant.name).collect();
    let plan = Plan::new(&document, args.vary, variants, &args.measure)?;
    let points = plan.points();
    let store = Store::open(&args.out, &plan, args.shard)?;
    if !args.merge {
        // a key that does not exist or a value that it does not take is found here
        points.iter().try_for_each(|point| plan.resolve(&document, point).map(drop))?;
        end_on_signals()?;
        let done = store.rows()?;
        let open: Vec<Point> = points
            .iter()
            .filter(|point| point.index % args.shard.of + 1 == args.shard.part)
            .filter(|point| !done.iter().any(|row| row.index == point.index))
            .cloned()
            .collect();
        carry_out(&document, &plan, &store, &open)?;
        if INTERRUPTED.load(Ordering::Relaxed) {
            eprintln!("interrupted: the same command takes the sweep up again");
            return Ok(1);
        }
    }
    let rows = store.rows()?;
    let missing = points.len() - rows.len();
    if missing > 0 {
        println!("{} of {} points; the other parts are missing: {}", rows.len(), points.len(), args.out.display());
        return Ok(u8::from(args.merge));
    }
    let table = args.out.join("table.csv");
    write(&table, &store::table(&plan, &rows))?;
    for (column, name) in plan.columns().iter().enumerate() {
        if let Some(svg) = picture::of(&plan, &rows, column).map_err(|reason| miette!("cannot draw {name}: {reason}"))? {
            write(&args.out.join(format!("{}.svg", name.replace([':', ' '], "-"))), &svg)?;
        }
    }
    let broken = rows.iter().filter(|row| row.ended != "completed").count();
    println!("{} points, {broken} of them broken: {}", rows.len(), table.display());
    Ok(0)
}

fn write(path: &std::path::Path, text: &str) -> miette::Result<()> {
    std::fs::write(path, text).into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()))
}

fn carry_out(document: &scenario::Document, plan: &Plan, store: &Store, open: &[Point]) -> miette::Result<()> {
    let bar = ProgressBar::new(open.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} points  {elapsed} + {eta}") {
        bar.set_style(style);
    }
    let part = Mutex::new(store.append()?);
    let answers = parallel(open, |point| -> miette::Result<()> {
        if INTERRUPTED.load(Ordering::Relaxed) {
            return Ok(());
        }
        let (variant, scenario) = plan.resolve(document, point)?;
        let setting = Setting { in_process: true, ..Setting::default() };
        let row = match rack_run::run(&scenario, &variant, &setting, &mut |_| {}) {
            Err(reason) => Row::broken(point.index, plan, &reason),
            Ok(finished) => {
                let ended = match &finished.result.ended {
                    Ended::Completed => "completed".into(),
                    Ended::Diverged { at_s } => format!("diverged at {at_s} s"),
                    Ended::Stopped { reason, .. } => reason.clone(),
                };
                Row { index: point.index, ended, values: plan.values(&finished.result) }
            }
        };
        if INTERRUPTED.load(Ordering::Relaxed) {
            // it was cut short
            return Ok(());
        }
        bar.inc(1);
        match part.lock() {
            Ok(mut part) => store.push(&mut part, &row),
            Err(_) => Err(miette!("another run of the sweep has panicked")),
        }
    });
    bar.finish_and_clear();
    answers.into_iter().collect()
}

#[cfg(test)]
mod tests;
