//! The `vmerack` command: results to standard output, everything else to standard error.
//!
//! Exit codes: 0 passed, 1 failure, 2 usage or bad scenario, 3 finished with losses, 4 an acceptance limit violated.

use crate::{boards, commands};
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// The VME rack of a force-controlled seven-joint arm, as processes with modelled bus latency.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(commands::run::RunArgs),
    Scenarios(commands::scenarios::ScenariosArgs),
    Scenario(commands::scenario::ScenarioArgs),
    Log(commands::log::LogArgs),
    Arm(commands::arm::ArmArgs),
    Bus(commands::bus::BusArgs),
    Design(commands::design::DesignArgs),
    Sweep(commands::sweep::SweepArgs),
    Margin(commands::margin::MarginArgs),
    Faults(commands::faults::FaultsArgs),
    Compare(commands::compare::CompareArgs),
    Latency(commands::latency::LatencyArgs),
    Doctor(commands::doctor::DoctorArgs),
    Top(commands::top::TopArgs),
    /// Receives what `vmerack latency` sends to compare with.
    #[command(hide = true)]
    Receive {
        /// How it comes.
        means: String,
        /// Prefix in shared memory.
        prefix: String,
        /// Folder.
        folder: std::path::PathBuf,
        /// SCHED_FIFO priority.
        priority: u8,
    },
    /// Hosts the boards of one process; `vmerack run` starts it.
    #[command(hide = true)]
    Host {
        /// Run folder.
        #[arg(long)]
        run: String,
        /// Process.
        #[arg(long)]
        process: String,
    },
}

/// Runs the command that the command line names.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Command::Host { .. } = cli.command {
        return pacing::serve(&boards::build);
    }
    let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let outcome = match cli.command {
        Command::Run(args) => commands::run::run(args),
        Command::Scenarios(args) => commands::scenarios::run(args),
        Command::Scenario(args) => commands::scenario::run(args),
        Command::Log(args) => commands::log::run(args),
        Command::Arm(args) => commands::arm::run(args),
        Command::Bus(args) => commands::bus::run(args),
        Command::Design(args) => commands::design::run(args),
        Command::Sweep(args) => commands::sweep::run(args),
        Command::Margin(args) => commands::margin::run(args),
        Command::Faults(args) => commands::faults::run(args),
        Command::Compare(args) => commands::compare::run(args),
        Command::Latency(args) => commands::latency::run(args),
        Command::Doctor(args) => commands::doctor::run(args),
        Command::Top(args) => commands::top::run(args),
        Command::Receive { means, prefix, folder, priority } => commands::latency::receive(&means, &prefix, &folder, priority),
        Command::Host { .. } => Ok(0),
    };
    match outcome {
        Ok(code) => ExitCode::from(code),
        Err(report) => {
            eprintln!("{report:?}");
            ExitCode::from(if report.downcast_ref::<scenario::ScenarioError>().is_some() { 2 } else { 1 })
        }
    }
}
