//! Pacing: who acts when. Lock step (simulated time, as fast as the machine allows), across processes or inside one,
//! and the life and death of the processes of a run.
//!
//! * [`Lockstep`] runs the windows: timing plane, then the boards in the order of the signal path.
//! * `turns`: who acts after whom in a window, without the chassis between.
//! * [`Realtime`] runs the same windows by the wall clock, peer to peer.
//! * [`Host`] steps the boards of one process; [`serve`] is the whole `main` of a board's process.
//! * [`RunFolder`] and [`Power`]: what a run leaves on the machine, and how it goes away again.
//! * `life` and `lines`: boards that go down and come up again, and what the drives see of it.
//!
//! A peer that dies or stalls is a [`RunError`] within a bounded wall time; a wall-clock limit may only abort a run, never
//! change a simulated value.

#![warn(missing_docs)]

mod acts;
mod affinity;
mod boards;
mod error;
mod faults;
mod holdback;
mod host;
mod life;
mod lines;
mod lockstep;
mod power;
mod processor_clock;
mod realtime;
mod remote;
mod run_folder;
mod serve;
mod turns;

pub use error::RunError;
pub use host::{Answer, Factory, Host};
pub use lockstep::{Flow, Lockstep, Observer};
pub use power::Power;
pub use processor_clock::processor_ns;
pub use realtime::{Realtime, ask_for_rights};
pub use run_folder::{Context, RunFolder, clean_stale, live_runs, part_of, stale_runs};
pub use serve::serve;
