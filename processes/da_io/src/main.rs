//! The process of `da_io`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(da_io::DaIo::new(&context.scenario)?)))
}
