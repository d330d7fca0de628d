//! The process of `encoder_if`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| Ok(Box::new(encoder_if::EncoderIf::new(&context.scenario)?)))
}
