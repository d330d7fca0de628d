//! What a process asks of the operating system to be on time: SCHED_FIFO, memory locked, timer slack of 1 ns.
//!
//! Whatever is refused, the run goes on without; the caller says so.

use rustix::mm::{MlockAllFlags, mlockall};
use scenario::Realtime;
use std::num::NonZeroU64;

/// Asks for everything that the scenario wants; what was refused, each with its remedy.
pub(crate) fn ask(wanted: &Realtime) -> Vec<String> {
    let mut refused = Vec::new();
    if rustix::thread::set_current_timer_slack(NonZeroU64::new(1)).is_err() {
        refused.push("timer slack of 1 ns".into());
    }
    // only what is mapped now: under a limit, locking the future makes an allocation fail in the middle of a run
    if wanted.lock_memory && mlockall(MlockAllFlags::CURRENT).is_err() {
        refused.push("locked memory (needs CAP_IPC_LOCK or a higher memlock limit: ulimit -l)".into());
    }
    if wanted.priority > 0 && !fifo(wanted.priority) {
        let priority = wanted.priority;
        refused.push(format!("SCHED_FIFO priority {priority} (needs CAP_SYS_NICE or an rtprio limit: ulimit -r)"));
    }
    refused
}

/// Real-time scheduling of this thread.
fn fifo(priority: u8) -> bool {
    // SAFETY: plain old data, of which every field may be 0
    #[allow(unsafe_code)]
    let mut parameters: libc::sched_param = unsafe { std::mem::zeroed() };
    parameters.sched_priority = priority.into();
    // SAFETY: 0 is the calling thread, and the structure outlives the call
    #[allow(unsafe_code)]
    unsafe {
        libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &parameters) == 0
    }
}
