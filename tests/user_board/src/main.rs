//! The controller as a process of a rack: `[[process]] command = ["user_board"]`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(user_board::Hold::new(&context.scenario)?)))
}
