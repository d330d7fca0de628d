//! `vmerack`: see [`chassis::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    chassis::cli::main()
}
