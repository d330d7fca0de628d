//! `vmerack log`: what can be done with a record after the run.

use clap::{Args, Subcommand};
use miette::{IntoDiagnostic, Result};
use std::path::PathBuf;

/// Arguments of `vmerack log`.
#[derive(Debug, Args)]
pub struct LogArgs {
    #[command(subcommand)]
    command: LogCommand,
}

#[derive(Debug, Subcommand)]
enum LogCommand {
    /// Print the digest of a record: SHA-256 of everything that it says in simulated time
    Digest {
        /// Record (.mcap)
        file: PathBuf,
    },
    /// Make a truncated or damaged record whole and say what is missing
    Recover {
        /// Record (.mcap)
        file: PathBuf,
        /// Where the whole record goes
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}

/// Runs the command; the exit code is 0, or 3 where the recovered record lacks something.
pub fn run(args: LogArgs) -> Result<u8> {
    match args.command {
        LogCommand::Digest { file } => {
            println!("{}", bus_analyzer::digest_file(&file).into_diagnostic()?);
            Ok(0)
        }
        LogCommand::Recover { file, output } => {
            let recovered = bus_analyzer::recover(&file, &output).into_diagnostic()?;
            println!("{recovered}");
            Ok(if recovered.is_complete() { 0 } else { 3 })
        }
    }
}
