//! `vmerack top`: the runs of this user under way, in a terminal; `--once --json` for scripts.

use crate::rack_run::INTERRUPTED;
use crate::status::{self, PERIOD, Status, StatusRow};
use clap::Args;
use miette::IntoDiagnostic;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A run that has not shown itself by then is not shown.
const PATIENCE: Duration = Duration::from_secs(3);

/// Watch the runs under way.
#[derive(Debug, Args)]
pub struct TopArgs {
    /// Show them once and end.
    #[arg(long)]
    once: bool,
    /// Print JSON, a line each time.
    #[arg(long)]
    json: bool,
}

/// Shows the runs until it is interrupted. Exit code 1 where there is none to show once.
pub fn run(args: TopArgs) -> miette::Result<u8> {
    crate::commands::run::end_on_signals()?;
    while !INTERRUPTED.load(Ordering::Relaxed) {
        let runs = look(args.once);
        if args.json {
            println!("{}", serde_json::to_string(&runs).into_diagnostic()?);
        } else {
            let text: String = runs.iter().map(render).collect();
            let text = if text.is_empty() { "no run under way\n".into() } else { text };
            // home, and clear what is below
            print!("{}{text}", if args.once { "" } else { "\x1b[H\x1b[J" });
        }
        if args.once {
            return Ok(u8::from(runs.is_empty()));
        }
        std::thread::sleep(PERIOD);
    }
    Ok(0)
}

/// What every run under way shows; where it `waits`, each gets time to answer anew.
fn look(wait: bool) -> Vec<Status> {
    let folders: Vec<PathBuf> = pacing::live_runs();
    for folder in &folders {
        // a run that has just ended has no folder any more
        let _ = status::ask(folder, wait);
    }
    let since = Instant::now();
    loop {
        let shown: Vec<Status> = folders.iter().filter_map(|folder| status::read(folder)).collect();
        if !wait || shown.len() == folders.len() || since.elapsed() > PATIENCE {
            return shown;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn render(status: &Status) -> String {
    let mut out = format!(
        "{} (pid {}), {}: {:.1} s simulated in {:.1} s, {}\n",
        status.run, status.pid, status.pacing, status.simulated_s, status.wall_s, status.state
    );
    out += &status.faults.iter().map(|fault| format!("  ! {fault}\n")).collect::<String>();
    if !status.rows.is_empty() {
        out += &format!("  {:42} {:>9} {:>10} {:>10} {:>10} {:>7}\n", "", "per s", "p50 µs", "p99 µs", "max µs", "missed");
    }
    for StatusRow { path, per_s, p50_us, p99_us, max_us, missed } in &status.rows {
        let missed = missed.map_or("–".into(), |missed| missed.to_string());
        out += &format!("  {path:42} {per_s:>9.1} {p50_us:>10.1} {p99_us:>10.1} {max_us:>10.1} {missed:>7}\n");
    }
    out + "\n"
}
