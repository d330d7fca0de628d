//! The wall clock: CLOCK_MONOTONIC, which all processes of a machine share.

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use std::time::Duration;

/// CLOCK_MONOTONIC, ns.
pub fn wall_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Sleeps until the wall clock shows `due`, or for `limit` if that ends first.
pub fn sleep_until(due: u64, limit: Duration) {
    let at = due.min(wall_ns().saturating_add(limit.as_nanos().try_into().unwrap_or(u64::MAX)));
    let at = Timespec { tv_sec: (at / 1_000_000_000) as _, tv_nsec: (at % 1_000_000_000) as _ };
    // a signal ends it early: the caller looks at the clock again
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &at);
}
