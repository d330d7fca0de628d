//! The chassis: powers the boards up, is the rack's system controller, and is the `vmerack` command.
//!
//! * [`commands`]: one file per subcommand; [`cli`] is their list.
//! * [`rack_run`]: one variant of a scenario from power-up to the last window.
//! * [`parallel`]: independent runs on all cores.
//! * [`boards`]: the built-in board of every role.
//! * [`output`]: results to standard output.

#![warn(missing_docs)]

// first: its `print!` and `println!` are those of all modules below
#[macro_use]
pub mod output;

pub mod boards;
pub mod cli;
pub mod commands;
mod cost_meter;
mod machine;
pub mod parallel;
pub mod rack_run;
mod settled_record;
mod status;
