//! `vmerack bus`: the VMEbus by itself. `show` prints a scenario's memory map, bus programs and rack;
//! `sim` loads the arbiter alone with random requests and prints how long they wait.
//!
//! Arguments and their reading are here, the words of `show` in `show`, those of `sim` in `sim`. Exit
//! code 2 for arguments, scenarios or racks that make no sense.

pub mod show;
mod sim;

use crate::rack_run;
use clap::{Args, Subcommand};

/// The VMEbus by itself: a scenario's rack, or its arbiter under load.
#[derive(Debug, Clone, Args)]
pub struct BusArgs {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Clone, Subcommand)]
enum Command {
    /// Print a scenario's memory map and bus programs, and draw its rack.
    Show {
        /// A built-in scenario or a file.
        scenario: String,
    },
    /// Load the arbiter alone and print the waits at each level.
    Sim(sim::SimArgs),
}

/// Runs the command and returns its exit code.
pub fn run(args: BusArgs) -> miette::Result<u8> {
    match args.command {
        Command::Show { scenario } => show_scenario(&scenario),
        Command::Sim(args) => Ok(sim::run(&args)),
    }
}

fn show_scenario(name: &str) -> miette::Result<u8> {
    let scenario = match scenario::load(name, &[]).and_then(|document| document.scenario()) {
        Ok(scenario) => scenario,
        Err(error) => {
            eprintln!("{:?}", miette::Report::new(error));
            return Ok(2);
        }
    };
    let rehearsed = rack_run::rehearse(&scenario);
    let (programs, account) = match &rehearsed {
        Ok((programs, account)) => (programs.as_slice(), Some(account)),
        Err(error) if rack_run::is_of_the_scenario(error) => {
            eprintln!("error: {error}");
            return Ok(2);
        }
        Err(reason) => {
            eprintln!("warning: no bus programs: {reason}");
            (&[][..], None)
        }
    };
    match show::rack(&scenario.rack, programs, account) {
        Ok(text) => {
            print!("{text}");
            Ok(0)
        }
        Err(error) => {
            eprintln!("error: {error}");
            Ok(2)
        }
    }
}
