//! The process of `control_computer`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(control_computer::ControlComputer::new(&context.scenario)?)))
}
