//! The processor clock of a process, to the nanosecond: the time for which its threads have run.

/// Processor time of that process so far, ns; `None` where it has ended or belongs to somebody else.
pub fn processor_ns(pid: u32) -> Option<u64> {
    let mut clock = 0;
    // SAFETY: the clock's number is written, and outlives the call
    #[allow(unsafe_code)]
    let refused = unsafe { libc::clock_getcpuclockid(pid.try_into().ok()?, &mut clock) };
    if refused != 0 {
        return None;
    }
    let mut shown = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the time is written, and outlives the call
    #[allow(unsafe_code)]
    let refused = unsafe { libc::clock_gettime(clock, &mut shown) };
    (refused == 0).then_some(shown.tv_sec as u64 * 1_000_000_000 + shown.tv_nsec as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[test]
    fn the_processor_clock_goes_while_the_process_works() {
        let before = processor_ns(std::process::id()).expect("own clock");
        let begun = Instant::now();
        while processor_ns(std::process::id()).expect("own clock") < before + 20_000_000 {
            // the test's own watchdog, not a promise
            assert!(begun.elapsed() < Duration::from_secs(30));
        }
    }

    #[test]
    fn a_process_that_does_not_exist_has_no_clock() {
        assert_eq!(processor_ns(u32::MAX), None);
        // one beyond the largest process number of Linux
        assert_eq!(processor_ns(1 << 22), None);
    }
}
