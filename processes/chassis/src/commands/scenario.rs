//! `vmerack scenario`: check a scenario, or show it resolved.

use crate::rack_run;
use clap::{Args, Subcommand};
use miette::IntoDiagnostic;

/// Check a scenario, or show it resolved.
#[derive(Debug, Args)]
pub struct ScenarioArgs {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Validate a scenario with all its variants.
    Check(Stated),
    /// Print a scenario as TOML, defaults included.
    Show(Stated),
}

#[derive(Debug, Args)]
struct Stated {
    /// A built-in scenario or a file.
    scenario: String,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
}

/// Runs the command and returns its exit code.
pub fn run(args: ScenarioArgs) -> miette::Result<u8> {
    match args.command {
        Command::Check(Stated { scenario, set }) => {
            let document = scenario::load(&scenario, &set)?;
            let variants = document.variants()?;
            for (variant, resolved) in &variants {
                for warning in scenario::warnings(resolved) {
                    eprintln!("warning: variant {}: {warning}", variant.name);
                }
                if let Err(error) = rack_run::check(resolved) {
                    eprintln!("error: variant {}: {error}", variant.name);
                    return Ok(2);
                }
            }
            println!("{scenario}: ok, {} variant(s), {:.1} s each", variants.len(), document.scenario()?.duration());
            Ok(0)
        }
        Command::Show(Stated { scenario, set }) => {
            print!("{}", toml::to_string(&scenario::load(&scenario, &set)?.scenario()?).into_diagnostic()?);
            Ok(0)
        }
    }
}
