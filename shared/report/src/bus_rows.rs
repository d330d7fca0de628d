//! Cells of the tables of bus and processors, the same for terminal and page.

use crate::accounting::{BusAccount, WaterfallAccount};
use vme::Ns;
use vme::accounting::Part;

pub(crate) const MASTER_HEADINGS: [&str; 10] = [
    "master",
    "transfers",
    "bus %",
    "wait mean µs",
    "p99 µs",
    "max µs",
    "service mean µs",
    "max µs",
    "BERR*",
    "access timer",
];
pub(crate) const TASK_HEADINGS: [&str; 9] =
    ["task", "jobs", "lost", "accesses/job", "bus/job µs", "access max µs", "bound µs", "response max µs", "bound µs"];
pub(crate) const AGE_HEADINGS: [&str; 6] = ["age at the decision", "n", "min µs", "p50 µs", "p99 µs", "max µs"];
pub(crate) const WATERFALL_HEADINGS: [&str; 3] = ["sensor to actuator", "mean µs", "in the longest job µs"];

/// One line of what is counted once.
pub(crate) fn counts(bus: &BusAccount) -> String {
    let links: String = bus.links_down.iter().map(|adaptor| format!("; link of {adaptor} down")).collect();
    format!(
        "bus kept for {:.3} % of {:.3} s; {} BERR* ({} of them parity), {} access timer, {} late errors of posted writes, {} interrupts ({} merged), {} polls",
        100.0 * bus.utilisation,
        bus.elapsed_ns as f64 * 1e-9,
        bus.bus_errors,
        bus.parity_errors,
        bus.access_timeouts,
        bus.posted_errors,
        bus.interrupts,
        bus.merged_interrupts,
        bus.polls
    ) + &links
}

/// One row per master that used the bus.
pub(crate) fn masters(bus: &BusAccount) -> Vec<Vec<String>> {
    let used = bus.masters.iter().filter(|master| master.transfers > 0);
    used.map(|master| {
        vec![
            master.name.clone(),
            master.transfers.to_string(),
            format!("{:.3}", 100.0 * master.utilisation),
            format!("{:.3}", 1e-3 * master.wait.mean_ns),
            micro(master.wait.p99_ns),
            micro(master.wait.max_ns),
            format!("{:.3}", 1e-3 * master.service.mean_ns),
            micro(master.service.max_ns),
            master.bus_errors.to_string(),
            master.access_timeouts.to_string(),
        ]
    })
    .collect()
}

/// One row per task.
pub(crate) fn tasks(bus: &BusAccount) -> Vec<Vec<String>> {
    let bound = |bound: Option<Ns>| bound.map_or_else(|| "none".into(), micro);
    bus.tasks
        .iter()
        .map(|task| {
            vec![
                task.name.clone(),
                task.jobs.to_string(),
                task.lost_releases.to_string(),
                format!("{:.1}", task.accesses_per_job),
                format!("{:.3}", 1e-3 * task.bus_per_job_ns),
                micro(task.access_max_ns),
                bound(task.access_bound_ns),
                micro(task.response_max_ns),
                bound(task.response_bound_ns),
            ]
        })
        .collect()
}

/// One row per part, the whole last.
pub(crate) fn waterfall(account: &WaterfallAccount) -> Vec<Vec<String>> {
    let row =
        |name: &str, sum, longest| vec![name.to_owned(), format!("{:.3}", 1e-3 * account.mean_ns(sum)), micro(longest)];
    let parts = account.parts.iter().map(|part| row(part_name(part.part), part.sum_ns, part.in_longest_ns));
    parts.chain([row("whole", account.whole_sum_ns, account.whole_max_ns)]).collect()
}

/// The part in words.
pub(crate) fn part_name(part: Part) -> &'static str {
    match part {
        Part::Filter => "filter",
        Part::Card => "card",
        Part::Arbitration => "arbitration",
        Part::Transfer => "transfer",
        Part::WaitForTask => "wait for task",
        Part::Execution => "execution",
        Part::Write => "write",
    }
}

fn micro(ns: Ns) -> String {
    format!("{:.3}", ns as f64 * 1e-3)
}
