//! The process of `workstation`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(workstation::Workstation::new(&context.scenario)?)))
}
