//! The report of a latency measurement and its files: `latency.json`, `latency.html`, the interval log `latency.hlog`, and
//! `latency.hist` as cyclictest writes its histograms.

use super::cost::{CostRow, MeasuringCost};
use super::journal::Measurement;
use super::row::LatencyRow;
use crate::html::{escape, fill, table as html_table};
use crate::ledger::PathLatency;
use crate::result::{SCHEMA_VERSION, WriteError, write_file};
use crate::text::{LATENCY_HEADINGS, latency_rows, table};
use crate::verdict::Verdict;
use scenario::LatencyLimit;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Buckets of the cyclictest histogram, one per µs.
const HIST_US: usize = 1000;
const HEADINGS: [&str; 11] =
    ["path", "n", "min µs", "p50 µs", "p90 µs", "p99 µs", "p99.9 µs", "p99.99 µs", "max µs", "missed", "p50 / pipe"];
const CHANNEL_HEADINGS: [&str; 7] = ["channel", "reader", "sent", "read", "late", "lost", "twice"];
const CYCLE_HEADINGS: [&str; 7] = [
    "cycle",
    "decided s",
    "arm to sensor µs",
    "sensor to decision µs",
    "decision to D/A µs",
    "whole µs",
    "what happened",
];
const COST_HEADINGS: [&str; 7] =
    ["process", "with µs", "without µs", "difference µs", "95 % from µs", "to µs", "mean difference µs"];
const LIMIT_HEADINGS: [&str; 5] = ["path", "quantile", "value µs", "limit", ""];

/// One limit of the scenario, judged.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyCheck {
    /// Path.
    pub path: String,
    /// Part of the values that the limit holds for.
    pub quantile: f64,
    /// Measured, µs; `None`: there is no such path.
    pub value_us: Option<f64>,
    /// Limit, µs.
    pub max_us: f64,
    /// Whether it holds.
    pub passed: bool,
}

/// A measurement with everything that it must be read with.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyReport {
    /// Version of the file.
    pub schema_version: u32,
    /// Scenario and variant.
    pub scenario: String,
    /// Rate of the control task, Hz.
    pub rate_hz: f64,
    /// Length of the run in real time, s.
    pub seconds: f64,
    /// Kernel, policy, load and what else bears on the figures.
    pub machine: BTreeMap<String, String>,
    /// All limits hold, or not.
    pub verdict: Verdict,
    /// Limits of the scenario.
    pub limits: Vec<LatencyCheck>,
    /// The machine's own means beside the rack's.
    pub baselines: Vec<LatencyRow>,
    /// What the rack did on the wall clock.
    pub measured: Measurement,
    /// The same cycles in simulated time.
    pub modelled: Measurement,
    /// Bus transfers in simulated time.
    pub modelled_transfers: Vec<PathLatency>,
    /// Cost of the measuring itself, where it was asked for.
    pub measuring_cost: Option<MeasuringCost>,
}

impl LatencyReport {
    /// Judges the limits and relates everything to the pipe of the same run.
    pub fn judge(&mut self, limits: &[LatencyLimit]) {
        self.schema_version = SCHEMA_VERSION;
        let pipe = self.baselines.iter().find(|row| row.path == "pipe").map(|row| row.p50_ns as f64);
        for row in self.baselines.iter_mut().chain(&mut self.measured.rows) {
            row.p50_to_pipe = pipe.filter(|pipe| *pipe > 0.0).map(|pipe| row.p50_ns as f64 / pipe);
        }
        let rows = || self.measured.rows.iter().chain(&self.baselines);
        let judged = limits.iter().map(|limit| {
            let row = rows().find(|row| row.path == limit.path);
            let value_us = row.map(|row| row.quantile(limit.quantile) as f64 * 1e-3);
            let passed = value_us.is_some_and(|value| value <= limit.max_us);
            LatencyCheck { path: limit.path.clone(), quantile: limit.quantile, value_us, max_us: limit.max_us, passed }
        });
        self.limits = judged.collect();
        self.verdict = if self.limits.iter().all(|check| check.passed) { Verdict::Passed } else { Verdict::Failed };
    }

    /// Tables for a terminal.
    pub fn text(&self) -> String {
        let facts: String = self.machine.iter().map(|(name, value)| format!("  {name}: {value}\n")).collect();
        let mut out =
            format!("{}, control task at {} Hz, {} s in real time\n{facts}", self.scenario, self.rate_hz, self.seconds);
        for (title, table) in self.tables(table) {
            out += &format!("\n{title}\n{table}");
        }
        out + &format!("\n{}\n", self.remarks().join("\n"))
    }

    /// Every table by its title, drawn by `table`.
    fn tables(&self, table: impl Fn(&[&str], &[Vec<String>]) -> String) -> Vec<(&'static str, String)> {
        let mut tables = vec![
            ("this machine's own means, same run, same size", table(&HEADINGS, &rows(&self.baselines))),
            ("measured on the wall clock", table(&HEADINGS, &rows(&self.measured.rows))),
            ("messages", table(&CHANNEL_HEADINGS, &self.channels())),
            ("longest cycles", table(&CYCLE_HEADINGS, &cycles(&self.measured))),
            ("modelled: cycles in simulated time", table(&HEADINGS, &rows(&self.modelled.rows))),
            (
                "modelled: bus transfers in simulated time",
                table(&LATENCY_HEADINGS, &latency_rows(&self.modelled_transfers)),
            ),
        ];
        if let Some(cost) = &self.measuring_cost {
            tables.push(("processor time of a cycle, measuring and not", table(&COST_HEADINGS, &costs(cost))));
        }
        if !self.limits.is_empty() {
            tables.push(("limits", table(&LIMIT_HEADINGS, &self.checks())));
        }
        tables
    }

    fn channels(&self) -> Vec<Vec<String>> {
        let row = |count: &super::journal::ChannelCount| {
            let figures =
                [count.sent, count.read, count.late, count.lost, count.twice].map(|figure| figure.to_string());
            [vec![count.channel.clone(), count.reader.clone()], figures.to_vec()].concat()
        };
        self.measured.channels.iter().map(row).collect()
    }

    fn checks(&self) -> Vec<Vec<String>> {
        let row = |check: &LatencyCheck| {
            let value = check.value_us.map_or("–".into(), |value| format!("{value:.1}"));
            let result = if check.passed { "ok" } else { "VIOLATED" };
            vec![check.path.clone(), check.quantile.to_string(), value, format!("≤ {}", check.max_us), result.into()]
        };
        self.limits.iter().map(row).collect()
    }

    fn remarks(&self) -> Vec<String> {
        let m = &self.measured;
        let sum: u64 = m.parts_sum_ns.iter().sum();
        let mut remarks = vec![
            format!(
                "{} cycles answered, {} without a torque or decided without their reading",
                m.cycles, m.broken_cycles
            ),
            format!(
                "parts of all cycles {sum} ns, wholes {} ns: difference {} ns",
                m.whole_sum_ns,
                m.whole_sum_ns.abs_diff(sum)
            ),
            format!(
                "values overwritten by newer ones before use {}, writes made late {}",
                m.overwritten, m.delayed_writes
            ),
            format!("messages of measurements lost {}", m.unmeasured),
        ];
        remarks.extend(self.measuring_cost.as_ref().map(MeasuringCost::remark));
        remarks
    }

    /// `latency.json`, `latency.html`, `latency.hlog` and `latency.hist` in that folder.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write_file(folder, "latency.json", self.json().map_err(|error| error.to_string()))?;
        write_file(folder, "latency.html", self.html().map_err(|error| error.to_string()))?;
        write_file(folder, "latency.hlog", Ok(self.hlog()))?;
        write_file(folder, "latency.hist", Ok(self.cyclictest()))
    }

    /// `latency.json`.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self)
    }

    /// HdrHistogram interval log, a line per path and second; the path is the tag.
    fn hlog(&self) -> String {
        let mut lines: Vec<&(u64, String)> = self.measured.rows.iter().flat_map(|row| &row.log).collect();
        lines.sort_by_key(|(second, _)| *second);
        let lines: String = lines.iter().map(|(_, line)| format!("{line}\n")).collect();
        format!("#[vmerack latency of {}; values in ns, maximum in ms]\n{lines}", self.scenario)
    }

    /// As `cyclictest -h` writes it: a line per µs, a column per path that wakes up.
    fn cyclictest(&self) -> String {
        let timers = self.baselines.iter().filter(|row| row.path.starts_with("timer"));
        let columns: Vec<&LatencyRow> =
            timers.chain(self.measured.rows.iter().filter(|row| row.path.starts_with("wake-up"))).collect();
        let mut counts = vec![vec![0_u64; columns.len()]; HIST_US];
        let mut overflows = vec![0_u64; columns.len()];
        for (i, row) in columns.iter().enumerate() {
            for (ns, count) in &row.histogram {
                match counts.get_mut((ns / 1000) as usize) {
                    Some(line) => line[i] += count,
                    None => overflows[i] += count,
                }
            }
        }
        let each = |figure: &dyn Fn(&LatencyRow) -> u64| {
            columns.iter().map(|row| format!("{:05}", figure(row))).collect::<Vec<_>>().join(" ")
        };
        let mean =
            |row: &LatencyRow| row.histogram.iter().map(|(ns, count)| ns / 1000 * count).sum::<u64>() / row.n.max(1);
        let names: String =
            columns.iter().enumerate().map(|(i, row)| format!("# Thread {i}: {}\n", row.path)).collect();
        let lines: String = (0..)
            .zip(&counts)
            .map(|(us, line): (usize, _)| {
                let cells: Vec<String> = line.iter().map(|count| format!("{count:06}")).collect();
                format!("{us:06} {}\n", cells.join("\t"))
            })
            .collect();
        let overflows: Vec<String> = overflows.iter().map(|count| format!("{count:05}")).collect();
        format!(
            "# Histogram\n{lines}# Total: {}\n# Min Latencies: {}\n# Avg Latencies: {}\n# Max Latencies: {}\n\
             # Histogram Overflows: {}\n{names}",
            each(&|row| row.n),
            each(&|row| row.min_ns / 1000),
            each(&mean),
            each(&|row| row.max_ns / 1000),
            overflows.join(" "),
        )
    }

    fn html(&self) -> Result<String, serde_json::Error> {
        let facts = self.machine.iter().map(|(name, value)| format!("{} <b>{}</b>", escape(name), escape(value)));
        let facts: Vec<String> = facts.collect();
        let tables = self.tables(html_table);
        let tables = tables.iter().map(|(title, table)| format!("<section><h2>{title}</h2>{table}</section>"));
        let remarks: String = self.remarks().iter().map(|remark| format!("<p>{}</p>", escape(remark))).collect();
        let (verdict, class) = match self.verdict {
            Verdict::Passed => ("passed", "good"),
            Verdict::Failed => ("FAILED", "bad"),
        };
        let parts = [
            ("scenario", escape(&self.scenario)),
            ("run", format!("control task at {} Hz, {} s in real time", self.rate_hz, self.seconds)),
            ("facts", facts.join("<span class=dot>·</span>")),
            ("verdict", verdict.into()),
            ("verdict_class", class.into()),
            ("tables", tables.collect()),
            ("remarks", remarks),
            ("style", crate::html::style()),
            ("uplot", crate::html::uplot()),
            // "</" must not end the script element
            ("data", serde_json::to_string(&self.curves())?.replace("</", "<\\/")),
            ("script", include_str!("../html/latency.js").to_owned()),
        ];
        Ok(fill(include_str!("../html/latency.html"), &parts))
    }

    /// The buckets of every row, for the pictures.
    fn curves(&self) -> Vec<Curve<'_>> {
        let rows = self.baselines.iter().chain(&self.measured.rows);
        rows.map(|row| Curve { path: &row.path, buckets: &row.histogram }).collect()
    }
}

#[derive(Serialize)]
struct Curve<'a> {
    path: &'a str,
    buckets: &'a [(u64, u64)],
}

/// Cells of a table of latencies.
pub fn rows(rows: &[LatencyRow]) -> Vec<Vec<String>> {
    let cells = |row: &LatencyRow| {
        let times = [row.min_ns, row.p50_ns, row.p90_ns, row.p99_ns, row.p999_ns, row.p9999_ns, row.max_ns];
        let mut cells = vec![row.path.clone(), row.n.to_string()];
        cells.extend(times.map(|ns| format!("{:.1}", ns as f64 * 1e-3)));
        cells.push(row.missed.map_or("–".into(), |missed| missed.to_string()));
        cells.push(row.p50_to_pipe.map_or("–".into(), |ratio| format!("{ratio:.2}")));
        cells
    };
    rows.iter().map(cells).collect()
}

/// The same as a table for a terminal.
pub fn text(of: &[LatencyRow]) -> String {
    table(&HEADINGS[..10], &rows(of).into_iter().map(|row| row[..10].to_vec()).collect::<Vec<_>>())
}

/// The same as a table of a page.
pub(crate) fn html(of: &[LatencyRow]) -> String {
    html_table(&HEADINGS[..10], &rows(of).into_iter().map(|row| row[..10].to_vec()).collect::<Vec<_>>())
}

fn costs(cost: &MeasuringCost) -> Vec<Vec<String>> {
    let row = |row: &CostRow| {
        let [low, high] = row.interval_ns;
        let times = [row.with_ns, row.without_ns, row.difference_ns, low, high, row.mean_ns];
        [vec![row.process.clone()], times.map(|ns| format!("{:.2}", ns * 1e-3)).to_vec()].concat()
    };
    cost.rows().map(row).collect()
}

fn cycles(measured: &Measurement) -> Vec<Vec<String>> {
    let micro = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
    let row = |cycle: &super::cycle::Cycle| {
        let mut cells = vec![cycle.job.to_string(), format!("{:.4}", cycle.decided_s)];
        cells.extend(cycle.parts_ns.map(micro));
        cells.extend([micro(cycle.whole_ns), cycle.notes.join("; ")]);
        cells
    };
    measured.longest.iter().map(row).collect()
}
