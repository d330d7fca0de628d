//! The process of `bus_analyzer`.

use bus_analyzer::BusAnalyzer;
use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| {
        let resolved = context.resolved().map_err(|error| error.to_string())?;
        Ok(Box::new(BusAnalyzer::new(
            &context.scenario,
            context.record.as_deref(),
            &resolved,
        )?))
    })
}
