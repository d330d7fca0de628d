//! What a process asks of the operating system to be on time: SCHED_FIFO, its processors, memory locked and touched, timer
//! slack of 1 ns.
//!
//! Whatever is refused, the run goes on without; the caller says so.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::{CpuSet, sched_setaffinity};
use scenario::{Process, Realtime};
use std::num::NonZeroU64;

/// Stack that a board's step may use without a page fault, bytes.
const STACK: usize = 256 * 1024;

/// Asks for everything that a scenario wants of its processes, and of this one; what was refused, each with its remedy.
pub fn ask(wanted: &Realtime, own: Option<&Process>) -> Vec<String> {
    let mut refused = Vec::new();
    if rustix::thread::set_current_timer_slack(NonZeroU64::new(1)).is_err() {
        refused.push("timer slack of 1 ns".into());
    }
    let cpus = own.map_or(&[][..], |own| &own.cpus);
    let mut set = CpuSet::new();
    cpus.iter().filter(|cpu| **cpu < CpuSet::MAX_CPU).for_each(|cpu| set.set(*cpu));
    if !cpus.is_empty() && sched_setaffinity(None, &set).is_err() {
        refused.push(format!("processors {cpus:?} (this machine does not have or allow them: nproc, taskset -p $$)"));
    }
    touch_stack();
    // only what is mapped now: under a limit, locking the future makes an allocation fail in the middle of a run
    if wanted.lock_memory && mlockall(MlockAllFlags::CURRENT).is_err() {
        refused.push("locked memory (needs CAP_IPC_LOCK or a higher memlock limit: ulimit -l)".into());
    }
    let priority = own.and_then(|own| own.priority).unwrap_or(wanted.priority);
    if priority > 0 && !fifo(priority) {
        refused.push(format!("SCHED_FIFO priority {priority} (needs CAP_SYS_NICE or an rtprio limit: ulimit -r)"));
    }
    refused
}

/// Makes the stack's pages before they are needed.
#[inline(never)]
fn touch_stack() {
    let stack = [1_u8; STACK];
    std::hint::black_box(&stack);
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
