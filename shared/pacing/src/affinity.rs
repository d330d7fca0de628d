//! Lock step on one processor: its boards act one after the other, and a wake-up across idle processors costs ten times
//! one on the same processor. Those that are not waited for run on the others: the recorder, and the chassis where it has
//! granted windows ahead.
//!
//! Where the system refuses, everybody runs anywhere and the run is only slower.

use rustix::process::Pid;
use rustix::thread::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};

/// Keeps this thread, and the processes that it starts, on the processor where it runs, until dropped.
pub(crate) struct OneProcessor {
    before: CpuSet,
    here: CpuSet,
    elsewhere: CpuSet,
}

impl OneProcessor {
    pub fn stay() -> Option<OneProcessor> {
        let before = sched_getaffinity(None).ok()?;
        let mut here = CpuSet::new();
        let processor = sched_getcpu();
        here.set(processor);
        let mut elsewhere = before;
        elsewhere.unset(processor);
        if elsewhere.count() == 0 {
            elsewhere = before;
        }
        sched_setaffinity(None, &here).ok()?;
        Some(OneProcessor { before, here, elsewhere })
    }

    /// This thread leaves the processor to the boards.
    pub fn leave(&self) {
        let _ = sched_setaffinity(None, &self.elsewhere);
    }

    /// Lets this process run where the chassis might before.
    pub fn release(&self, pid: u32) {
        place(pid, &self.before);
    }

    /// Puts a process on this processor, or one that is `apart` on the others.
    pub fn keep(&self, pid: u32, apart: bool) {
        place(pid, if apart { &self.elsewhere } else { &self.here });
    }
}

fn place(pid: u32, processors: &CpuSet) {
    if let Some(pid) = Pid::from_raw(pid as i32) {
        // a process that has just ended needs no processor
        let _ = sched_setaffinity(Some(pid), processors);
    }
}

impl Drop for OneProcessor {
    fn drop(&mut self) {
        // nothing but a slower thread comes of a refusal
        let _ = sched_setaffinity(None, &self.before);
    }
}
