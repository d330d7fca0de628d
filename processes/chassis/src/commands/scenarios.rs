//! `vmerack scenarios`: the built-in scenarios, a line each.

use clap::Args;

/// List the built-in scenarios.
#[derive(Debug, Args)]
pub struct ScenariosArgs {}

/// Prints the list.
pub fn run(_: ScenariosArgs) -> miette::Result<u8> {
    let width = scenario::builtin::SCENARIOS.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    for (name, _) in scenario::builtin::SCENARIOS {
        let title = scenario::load(name, &[])?.scenario()?.title;
        println!("{name:width$}  {title}");
    }
    Ok(0)
}
