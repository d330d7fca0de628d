//! The process of `hw_sim`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(hw_sim::HwSim::new(&context.scenario)?)))
}
