//! Bench for tests of the whole rack: starts `vmerack` for real, watches it, kills it, and looks at what it leaves on the
//! machine.
//!
//! A [`Bench`] has a folder and a `TMPDIR` of its own, so that a test sees its own runs only, whatever else runs at the
//! same time. Every run is under a watchdog of 60 s: one that does not end is killed and fails the test. The commands must
//! have been built before (`scripts/test.sh` does it): cargo builds no other package's programs for a test.

#![warn(missing_docs)]

mod bench;
mod draw;
mod fault_row;
mod fuzz;
mod machine;
mod programs;
mod running;

pub use bench::{Bench, Edit};
pub use draw::Draw;
pub use fault_row::{FaultRow, fault};
pub use fuzz::{fuzz, spoil, spoil_file};
pub use machine::{Process, Signal, signal};
pub use programs::{program, target_folder, workspace};
pub use running::{Outcome, Running};
