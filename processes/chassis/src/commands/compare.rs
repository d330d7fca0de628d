//! `vmerack compare`: runs side by side, as tables and as one page with their curves over each other.
//!
//! Reads what `vmerack run` has left in its folders; runs nothing. Exit code 2 where a folder holds no run.

use clap::Args;
use miette::{IntoDiagnostic, WrapErr, miette};
use report::{Comparison, StoredRun};
use std::path::PathBuf;

/// Put runs side by side: what differs between them, and their curves over each other.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Folders that `vmerack run` has written, two or more.
    #[arg(required = true, num_args = 2.., value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Page with the curves over each other.
    #[arg(long, value_name = "FILE.html", default_value = "compare.html")]
    out: PathBuf,
}

/// Runs the command and returns its exit code.
pub fn run(args: CompareArgs) -> miette::Result<u8> {
    let loaded: Result<Vec<StoredRun>, _> = args.runs.iter().map(|folder| StoredRun::load(folder)).collect();
    let runs = match loaded {
        Ok(runs) => runs,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(2);
        }
    };
    let comparison = Comparison::new(runs);
    let page = comparison.html().map_err(|reason| miette!("cannot draw the comparison: {reason}"))?;
    let written = std::fs::write(&args.out, page).into_diagnostic();
    written.wrap_err_with(|| format!("--out: cannot write {}", args.out.display()))?;
    print!("{}", comparison.text());
    println!("\ncurves over each other: {}", args.out.display());
    Ok(0)
}
