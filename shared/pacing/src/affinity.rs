//! Lock step on one processor: its boards act one after the other, and a wake-up across idle processors costs ten times
//! one on the same processor. The recorder, which is not waited for, may run anywhere.
//!
//! Where the system refuses, everybody runs anywhere and the run is only slower.

use rustix::process::Pid;
use rustix::thread::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};

/// Keeps this thread, and the processes that it starts, on the processor where it runs, until dropped.
pub(crate) struct OneProcessor {
    before: CpuSet,
}

impl OneProcessor {
    pub fn stay() -> Option<OneProcessor> {
        let before = sched_getaffinity(None).ok()?;
        let mut here = CpuSet::new();
        here.set(sched_getcpu());
        sched_setaffinity(None, &here).ok()?;
        Some(OneProcessor { before })
    }

    /// Lets this process run where the chassis might before.
    pub fn release(&self, pid: u32) {
        if let Some(pid) = Pid::from_raw(pid as i32) {
            // a process that has just ended needs no processor
            let _ = sched_setaffinity(Some(pid), &self.before);
        }
    }
}

impl Drop for OneProcessor {
    fn drop(&mut self) {
        // nothing but a slower thread comes of a refusal
        let _ = sched_setaffinity(None, &self.before);
    }
}
