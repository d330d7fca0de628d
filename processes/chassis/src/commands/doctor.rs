//! `vmerack doctor`: what on this machine hurts real time, each with its remedy; `--clean` removes what dead runs left.

use crate::machine;
use clap::Args;
use miette::IntoDiagnostic;
use serde::Serialize;

const CAP_IPC_LOCK: u64 = 1 << 14;
const CAP_SYS_NICE: u64 = 1 << 23;
/// A run of seven processes takes less than this of shared memory.
const SHARED_MEMORY: u64 = 256 << 20;
/// Memory that the processes lock.
const LOCKED: u64 = 64 << 20;

/// Say what on this machine hurts real time, and the remedy.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Remove the folders and shared memory of runs that nobody holds any more.
    #[arg(long)]
    clean: bool,
}

/// One thing looked at.
#[derive(Debug, Serialize)]
struct Finding {
    subject: &'static str,
    found: String,
    hurts: bool,
    /// What to do; empty where nothing hurts.
    remedy: &'static str,
}

fn finding(subject: &'static str, found: impl Into<String>, hurts: bool, remedy: &'static str) -> Finding {
    Finding { subject, found: found.into(), hurts, remedy: if hurts { remedy } else { "" } }
}

/// Looks at everything. Nothing found is no failure: the exit code is 0.
pub fn run(args: DoctorArgs) -> miette::Result<u8> {
    let findings = look(args.clean);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&findings).into_diagnostic()?);
        return Ok(0);
    }
    for Finding { subject, found, hurts, remedy } in &findings {
        println!("{} {subject:18} {found}", if *hurts { "!" } else { " " });
        if *hurts {
            println!("  {:18} -> {remedy}", "");
        }
    }
    let hurting = findings.iter().filter(|finding| finding.hurts).count();
    println!("\n{hurting} of {} hurt real time; lock step needs none of it", findings.len());
    Ok(0)
}

fn look(clean: bool) -> Vec<Finding> {
    let capabilities = machine::capabilities();
    let [priority, locked] = machine::limits();
    let limit = |limit: Option<u64>| limit.map_or("no limit".into(), |limit| limit.to_string());
    let may_fifo = capabilities & CAP_SYS_NICE != 0 || priority.is_none_or(|priority| priority > 0);
    let may_lock = capabilities & CAP_IPC_LOCK != 0 || locked.is_none_or(|bytes| bytes >= LOCKED);
    let (preemption, governor) = (machine::preemption(), machine::governor());
    let hypervisor = machine::hypervisor();
    let throttling = machine::throttling();
    let idle = machine::deep_idle_states();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let shared = machine::free_shared_memory();
    let stale = if clean { pacing::clean_stale() } else { pacing::stale_runs() };
    let names: Vec<String> = stale.iter().map(|path| path.display().to_string()).collect();
    let clock = machine::clock_source();
    vec![
        finding("kernel", machine::kernel(), false, ""),
        finding(
            "preemption",
            preemption.as_str(),
            preemption != "PREEMPT_RT",
            "boot a PREEMPT_RT kernel (Debian: linux-image-rt-amd64); with PREEMPT_DYNAMIC at least preempt=full",
        ),
        finding("governor", governor.as_str(), !["performance", "none visible"].contains(&governor.as_str()), "cpupower frequency-set -g performance"),
        finding("idle states", if idle.is_empty() { "none that is slow to leave".into() } else { idle.join(", ") }, !idle.is_empty(), "cpupower idle-set -D 50, or hold /dev/cpu_dma_latency open"),
        finding("SCHED_FIFO", format!("rtprio limit {}", limit(priority)), !may_fifo, "rtprio 99 for this user in /etc/security/limits.d, or CAP_SYS_NICE"),
        finding("locked memory", format!("memlock limit {}", limit(locked)), !may_lock, "memlock unlimited for this user in /etc/security/limits.d, or CAP_IPC_LOCK"),
        finding(
            "RT throttling",
            throttling.map_or("off".into(), |(runtime, period)| format!("{runtime} µs of {period} µs")),
            throttling.is_some(),
            "sysctl kernel.sched_rt_runtime_us=-1 (a real-time loop that never rests then keeps its processor)",
        ),
        finding(
            "hypervisor",
            hypervisor.as_deref().unwrap_or("none"),
            hypervisor.is_some(),
            "measure on the bare machine: a host that takes the processor away shows as steal and as latency",
        ),
        finding("processors", processors.to_string(), processors < 2, "give the rack two or more processors"),
        finding("clock source", clock.as_str(), !["tsc", "arch_sys_counter", "kvm-clock"].contains(&clock.as_str()), "a slow clock makes every stamp slow: clocksource=tsc"),
        finding(
            "shared memory",
            shared.map_or("unknown".into(), |bytes| format!("{} MB free in /dev/shm", bytes >> 20)),
            shared.is_some_and(|bytes| bytes < SHARED_MEMORY),
            "mount -o remount,size=1G /dev/shm (docker: --shm-size=1g)",
        ),
        finding(
            "stale runs",
            match (names.is_empty(), clean) {
                (true, _) => "none".into(),
                (false, true) => format!("removed {}", names.join(", ")),
                (false, false) => names.join(", "),
            },
            !names.is_empty() && !clean,
            "vmerack doctor --clean",
        ),
    ]
}
