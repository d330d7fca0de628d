//! What of this machine bears on real time, as the kernel shows it in `/proc` and `/sys`.
//!
//! What cannot be read is `unknown`, never an error.

use rustix::process::{Resource, getrlimit};
use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::path::Path;

const UNKNOWN: &str = "unknown";

fn text(path: &str) -> Option<String> {
    read_to_string(path).ok().map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())
}

fn or_unknown(value: Option<String>) -> String {
    value.unwrap_or_else(|| UNKNOWN.into())
}

/// Kernel release.
pub fn kernel() -> String {
    or_unknown(text("/proc/sys/kernel/osrelease"))
}

/// How the kernel lets itself be interrupted: `PREEMPT_RT`, the mode chosen of `PREEMPT_DYNAMIC`, or what it was built as.
pub fn preemption() -> String {
    if text("/sys/kernel/realtime").as_deref() == Some("1") {
        return "PREEMPT_RT".into();
    }
    // "none voluntary (full) lazy"
    let chosen = text("/sys/kernel/debug/sched/preempt")
        .and_then(|modes| modes.split(['(', ')']).nth(1).map(|mode| format!("PREEMPT_DYNAMIC, {mode}")));
    let version = text("/proc/sys/kernel/version").unwrap_or_default();
    let built = ["PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"].into_iter().find(|model| version.contains(model));
    chosen.unwrap_or_else(|| built.unwrap_or("voluntary or none").into())
}

/// Frequency governor of the first processor.
pub fn governor() -> String {
    text("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor").unwrap_or_else(|| "none visible".into())
}

/// Part of a second that real-time tasks may have, µs of 1 s; `None` where they are not throttled.
pub fn throttling() -> Option<(i64, i64)> {
    let number = |name: &str| text(&format!("/proc/sys/kernel/{name}")).and_then(|text| text.parse::<i64>().ok());
    let (runtime, period) = (number("sched_rt_runtime_us")?, number("sched_rt_period_us")?);
    (runtime >= 0 && runtime < period).then_some((runtime, period))
}

/// Whose virtual machine this is, where it is one.
pub fn hypervisor() -> Option<String> {
    let flags = text("/proc/cpuinfo")?;
    let virtual_machine = flags.lines().any(|line| line.starts_with("flags") && line.contains(" hypervisor"));
    virtual_machine.then(|| text("/sys/class/dmi/id/sys_vendor").unwrap_or_else(|| "unnamed".into()))
}

/// Names of the processor's idle states that take more than 50 µs to leave.
pub fn deep_idle_states() -> Vec<String> {
    let state = |i: usize, name: &str| text(&format!("/sys/devices/system/cpu/cpu0/cpuidle/state{i}/{name}"));
    (0..16)
        .map_while(|i| state(i, "latency").map(|latency| (i, latency)))
        .filter(|(i, latency)| latency.parse().is_ok_and(|us: u32| us > 50) && state(*i, "disable").as_deref() != Some("1"))
        .map(|(i, latency)| format!("{} ({latency} µs)", or_unknown(state(i, "name"))))
        .collect()
}

/// Clock source of the kernel.
pub fn clock_source() -> String {
    or_unknown(text("/sys/devices/system/clocksource/clocksource0/current_clocksource"))
}

/// Soft limits of this process: real-time priority, locked memory in bytes; `None`: no limit.
pub fn limits() -> [Option<u64>; 2] {
    [Resource::Rtprio, Resource::Memlock].map(|resource| getrlimit(resource).current)
}

/// Free bytes of shared memory.
pub fn free_shared_memory() -> Option<u64> {
    let stat = rustix::fs::statvfs(Path::new("/dev/shm")).ok()?;
    Some(stat.f_bavail * stat.f_frsize)
}

/// Capabilities in force of this process, as a bit set.
pub fn capabilities() -> u64 {
    status("CapEff").and_then(|set| u64::from_str_radix(&set, 16).ok()).unwrap_or(0)
}

fn status(key: &str) -> Option<String> {
    let status = text("/proc/self/status")?;
    status.lines().find_map(|line| Some(line.strip_prefix(key)?.strip_prefix(':')?.trim().to_owned()))
}

/// Policy and priority of this thread.
fn policy() -> String {
    let stat = text("/proc/thread-self/stat").unwrap_or_default();
    // the name in parentheses may hold anything
    let fields: Vec<&str> = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace().collect();
    match (fields.get(38), fields.get(37)) {
        (Some(&"1"), Some(priority)) => format!("SCHED_FIFO, priority {priority}"),
        (Some(&"2"), Some(priority)) => format!("SCHED_RR, priority {priority}"),
        (Some(&"0"), _) => "time sharing".into(),
        _ => UNKNOWN.into(),
    }
}

/// Time stolen by the hypervisor and all time of all processors, clock ticks.
fn steal() -> Option<(u64, u64)> {
    let stat = text("/proc/stat")?;
    let times: Vec<u64> = stat.lines().next()?.split_whitespace().skip(1).filter_map(|time| time.parse().ok()).collect();
    // guest time is contained in user time
    Some((*times.get(7)?, times.iter().take(8).sum()))
}

/// Watches load and steal while something is measured.
pub struct Conditions {
    steal: Option<(u64, u64)>,
    load: String,
}

impl Conditions {
    /// From now on.
    pub fn begin() -> Conditions {
        Conditions { steal: steal(), load: load() }
    }

    /// Everything that a figure measured since must be read with.
    pub fn facts(&self) -> BTreeMap<String, String> {
        let stolen = match (self.steal, steal()) {
            (Some((stolen, all)), Some((stolen_now, all_now))) if all_now > all => {
                format!("{:.2} %", 100.0 * (stolen_now - stolen) as f64 / (all_now - all) as f64)
            }
            _ => UNKNOWN.into(),
        };
        let processors = std::thread::available_parallelism().map_or(0, usize::from);
        let facts = [
            ("kernel", kernel()),
            ("preemption", preemption()),
            ("governor", governor()),
            ("hypervisor", hypervisor().unwrap_or_else(|| "none".into())),
            ("processors", processors.to_string()),
            ("affinity", or_unknown(status("Cpus_allowed_list"))),
            ("policy", policy()),
            ("timer slack", text("/proc/self/timerslack_ns").map_or(UNKNOWN.into(), |slack| format!("{slack} ns"))),
            ("locked memory", or_unknown(status("VmLck"))),
            ("load", format!("{} before, {} after", self.load, load())),
            ("steal", stolen),
        ];
        facts.map(|(name, value)| (name.to_owned(), value)).into()
    }
}

fn load() -> String {
    let load = or_unknown(text("/proc/loadavg"));
    load.split_whitespace().take(3).collect::<Vec<_>>().join(" ")
}
