//! Results of variants, and the report over all of them.

use crate::accounting::BusAccount;
use crate::chart::{Curves, charts};
use crate::faults::{self, FaultRow};
use crate::ideal::{Ideal, ideal};
use crate::latency::LatencyRow;
use crate::ledger::{Ledger, PathLatency};
use crate::measures::{Bounds, RunMeasures, first_contact};
use crate::path::Way;
use crate::segments::{SegmentRow, Signals, rows};
use crate::series::Series;
use crate::stretches::{Stretch, stretches};
use crate::trace::{Ended, Trace, seconds};
use crate::verdict::{Check, Verdict, check_relations, checks};
use messages::EventKind;
use scenario::{Scenario, Variant};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Version of `report.json`; a key that changes its meaning raises it.
pub const SCHEMA_VERSION: u32 = 1;

/// What one variant came to.
#[derive(Clone, Debug, Serialize)]
pub struct VariantResult {
    /// Name.
    pub name: String,
    /// Passed, or not.
    pub verdict: Verdict,
    /// How the run ended.
    pub ended: Ended,
    /// What a reader must know before the figures: never touched, diverged, limits that acted.
    pub findings: Vec<String>,
    /// Simulated time reached, s.
    pub simulated_s: f64,
    /// Wall time of the windows, s, where the host says it.
    pub wall_s: Option<f64>,
    /// Measures of the whole run.
    pub run: RunMeasures,
    /// One row per segment.
    pub segments: Vec<SegmentRow>,
    /// The same of the ideal one-axis impedance; empty where the scenario does not ask for it.
    pub ideal: Vec<SegmentRow>,
    /// The scenario's limits, applied.
    pub checks: Vec<Check>,
    /// One row per injected fault.
    pub faults: Vec<FaultRow>,
    /// Modelled latency per transfer path.
    pub transfers: Vec<PathLatency>,
    /// Transfers that ended in BERR* or time-out.
    pub transfer_errors: u64,
    /// Account of bus and processors, where the host made one.
    pub bus: Option<BusAccount>,
    /// Latency measured in real time; empty in simulated time.
    pub measured: Vec<LatencyRow>,
    /// File name of the record, where one was written.
    pub record: Option<String>,
    /// Digest, where it was computed.
    pub digest: Option<String>,
    /// What the record lacks: a recorder that was down, or could not write, from and to, s.
    pub unrecorded: Vec<(f64, f64)>,
    #[serde(skip)]
    pub(crate) curves: Curves,
}

impl VariantResult {
    /// Measures a run of `variant` with its resolved `scenario`, which reached `reached_s`. The error says
    /// what of the scenario cannot be read.
    pub fn new(
        scenario: &Scenario,
        variant: &Variant,
        trace: &Trace,
        ledger: &Ledger,
        ended: Ended,
        reached_s: f64,
    ) -> Result<VariantResult, String> {
        let axis = scenario.report.force_axis;
        let segments = scenario.resolved_segments();
        let plant =
            |f: &dyn Fn(&messages::PlantProbe) -> f64| series(trace.plant.iter().map(|probe| (probe.t, f(probe))));
        let control =
            |f: &dyn Fn(&messages::ControlProbe) -> f64| series(trace.control.iter().map(|probe| (probe.t, f(probe))));
        let force = plant(&|probe| probe.contact[axis]);
        let position = plant(&|probe| probe.position[axis]);
        let encoder_position = control(&|probe| probe.x[axis]);
        let target = control(&|probe| probe.xt[axis]);
        let desired = control(&|probe| probe.xd[axis]);
        let until = match &ended {
            Ended::Completed => reached_s,
            Ended::Diverged { at_s } | Ended::Stopped { at_s, .. } => at_s.min(reached_s),
        };
        let ideal = scenario.report.ideal.then(|| ideal(scenario, &segments, axis, &desired, until));
        let contact = first_contact(trace);
        let courses = stretches(&segments, trace, until);
        let segment_rows = rows(
            &segments,
            &courses,
            axis,
            &Signals {
                force: &force,
                position: &position,
                encoder_position: Some(&encoder_position),
                target: Some(&target),
                desired: &desired,
                ideal_position: ideal.as_ref().map(|ideal| &ideal.position),
                contact,
                until,
            },
        );
        // nothing stops the ideal
        let planned = stretches(&segments, &Trace::default(), until);
        let ideal_rows =
            ideal.as_ref().map_or_else(Vec::new, |ideal| ideal_rows(&segments, &planned, axis, ideal, &desired, until));
        let bounds = Bounds::of(scenario)?;
        let run = RunMeasures::of(
            trace,
            &segment_rows,
            &force,
            &position,
            ideal.as_ref().map(|ideal| &ideal.force),
            &bounds,
            until,
        );
        let checks = checks(scenario, variant, &ended, &segment_rows, &run);
        let mut bad = checks.iter().any(|check| check.passed == Some(false));
        let mut findings = Vec::new();
        match &ended {
            Ended::Completed => {}
            Ended::Diverged { at_s } => {
                bad |= !variant.may_diverge;
                findings.push(format!("diverged at {at_s:.3} s{}", expected(variant.may_diverge)));
            }
            Ended::Stopped { at_s, reason } => {
                bad = true;
                findings.push(format!("stopped at {at_s:.3} s: {reason}"));
            }
        }
        let pushes = segment_rows.iter().any(|row| row.reached && row.commanded_n.is_some_and(|wanted| wanted > 0.0));
        if pushes && contact.is_none() && !(scenario.surfaces.is_empty() && scenario.holes.is_empty()) {
            bad |= !variant.may_miss_surface;
            findings.push(format!("never touched the surface{}", expected(variant.may_miss_surface)));
        }
        let acted = |bit: u32| trace.control.iter().filter(|probe| probe.limits & bit != 0).count();
        for (bit, what) in [
            (messages::limits::TARGET_ERROR, "the limit on |Xᵗ − X| acted"),
            (messages::limits::TORQUE, "a joint torque was saturated"),
        ] {
            if acted(bit) > 0 {
                findings.push(format!("{what} in {} of {} control jobs", acted(bit), trace.control.len()));
            }
        }
        if ledger.errors() > 0 {
            findings.push(format!("{} bus transfers ended in BERR* or time-out", ledger.errors()));
        }
        findings.extend(faults::silences(scenario, trace));
        for task in trace.bus.iter().flat_map(|bus| &bus.tasks) {
            if task.lost_releases > 0 {
                findings
                    .push(format!("task {} lost {} releases: the job before still ran", task.name, task.lost_releases));
            }
        }
        findings.extend(faults::trips(trace));
        let tripped = |event: &&messages::Event| event.kind == EventKind::OverrunTrip as u32;
        for event in trace.events.iter().filter(tripped) {
            let task = scenario.rack.tasks.get(event.b as usize);
            findings.push(format!(
                "task {} was stopped at {:.3} s: its job overran and its policy is to trip",
                task.map_or("?", |task| &task.name),
                seconds(event.t)
            ));
        }
        let torque = std::array::from_fn(|i| control(&|probe| 100.0 * probe.torque[i] / bounds.torque_nm[i]));
        Ok(VariantResult {
            name: variant.name.clone(),
            verdict: if bad { Verdict::Failed } else { Verdict::Passed },
            ended,
            findings,
            simulated_s: until,
            wall_s: None,
            run,
            segments: segment_rows,
            ideal: ideal_rows,
            checks,
            faults: faults::rows(scenario, trace),
            transfers: ledger.paths(),
            transfer_errors: ledger.errors(),
            bus: trace.bus.clone(),
            measured: trace.measured.clone(),
            record: None,
            digest: None,
            unrecorded: Vec::new(),
            curves: Curves {
                force,
                position: std::array::from_fn(|k| plant(&|probe| probe.position[k])),
                desired,
                target,
                turn: control(&|probe| angle_between(&probe.x_orientation, &probe.xd_orientation).to_degrees()),
                angle: std::array::from_fn(|i| {
                    let (low, high) = (bounds.lower_rad[i], bounds.upper_rad[i]);
                    control(&|probe| 100.0 * (2.0 * probe.q[i] - low - high) / (high - low))
                }),
                torque,
                ideal: ideal.unwrap_or_default(),
                way: way(scenario, trace)?,
            },
        })
    }

    /// The record lacks what happened from one instant to the other, s.
    pub fn lacks(&mut self, from_s: f64, to_s: f64) {
        self.unrecorded.push((from_s, to_s));
        self.findings.push(format!("nothing is recorded from {from_s:.3} to {to_s:.3} s"));
    }
}

fn expected(is: bool) -> &'static str {
    if is { " (expected of this variant)" } else { "" }
}

fn series(samples: impl Iterator<Item = (vme::Ns, f64)>) -> Series {
    let mut series = Series::default();
    for (t, y) in samples.filter(|(_, y)| y.is_finite()) {
        series.push(seconds(t), y);
    }
    series
}

/// Angle of the rotation between two unit quaternions, rad.
fn angle_between(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    // the vector part of a* b, and its scalar part
    let ([aw, ax, ay, az], [bw, bx, by, bz]) = (*a, *b);
    let x = aw * bx - ax * bw - ay * bz + az * by;
    let y = aw * by + ax * bz - ay * bw - az * bx;
    let z = aw * bz - ax * by + ay * bx - az * bw;
    let w = aw * bw + ax * bx + ay * by + az * bz;
    2.0 * (x * x + y * y + z * z).sqrt().atan2(w.abs())
}

/// The tool's way, and the arm at its beginning and end.
fn way(scenario: &Scenario, trace: &Trace) -> Result<Way, String> {
    let model = scenario.controller_arm()?;
    let ends = [trace.plant.first(), trace.plant.last()];
    let arm = match model.is_slide() {
        true => Vec::new(),
        false => ends
            .into_iter()
            .flatten()
            .filter(|probe| probe.q.iter().all(|q| q.is_finite()))
            .map(|probe| arm::joint_origins(&model, &probe.q.into()).iter().map(|origin| (*origin).into()).collect())
            .collect(),
    };
    let finite = trace.plant.iter().map(|probe| probe.position).filter(|p| p.iter().all(|p| p.is_finite()));
    Ok(Way { tool: Way::thin(finite.collect()), arm })
}

fn ideal_rows(
    segments: &[scenario::ResolvedSegment],
    stretches: &[Stretch],
    axis: usize,
    ideal: &Ideal,
    desired: &Series,
    until: f64,
) -> Vec<SegmentRow> {
    let contact = ideal.force.t.iter().zip(&ideal.force.y).find(|(_, force)| **force > 0.0).map(|(t, _)| *t);
    let signals = Signals {
        force: &ideal.force,
        position: &ideal.position,
        encoder_position: None,
        target: None,
        desired,
        ideal_position: None,
        contact,
        until,
    };
    rows(segments, stretches, axis, &signals)
}

/// A key varied over values.
#[derive(Clone, Debug, Serialize)]
pub struct Sweep {
    /// Key path.
    pub key: String,
    /// Second key path, where two are varied.
    pub across: Option<String>,
    /// One run each.
    pub points: Vec<SweepPoint>,
}

/// One run of a sweep.
#[derive(Clone, Debug, Serialize)]
pub struct SweepPoint {
    /// Value of the key.
    pub value: f64,
    /// Value of the second key.
    pub across: Option<f64>,
    /// Whether the run held the scenario's limits.
    pub passed: bool,
    /// Variant.
    pub variant: String,
    /// How the run ended.
    pub ended: Ended,
    /// Measures of the whole run.
    pub run: RunMeasures,
    /// One row per segment.
    pub segments: Vec<SegmentRow>,
}

impl SweepPoint {
    /// Sums a run up.
    pub fn new(value: f64, across: Option<f64>, result: &VariantResult) -> SweepPoint {
        SweepPoint {
            value,
            across,
            passed: result.verdict == Verdict::Passed,
            variant: result.name.clone(),
            ended: result.ended.clone(),
            run: result.run.clone(),
            segments: result.segments.clone(),
        }
    }
}

/// Everything about the runs of a scenario.
#[derive(Clone, Debug, Serialize)]
pub struct RunReport {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program.
    pub vmerack: &'static str,
    /// Name of the scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// Its description.
    pub description: String,
    /// Its seed.
    pub seed: u64,
    /// How time went: `lockstep`, `realtime` or `in-process`.
    pub pacing: String,
    /// Axis of the report: `x`, `y` or `z`.
    pub axis: &'static str,
    /// Passed where every variant did.
    pub verdict: Verdict,
    /// One result each.
    pub variants: Vec<VariantResult>,
    /// Sweeps beyond the variants.
    pub sweeps: Vec<Sweep>,
}

/// A report that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct WriteError {
    /// Which file.
    pub path: PathBuf,
    /// Why.
    pub reason: String,
}

impl RunReport {
    /// Puts the results together.
    pub fn new(
        name: &str,
        scenario: &Scenario,
        pacing: &str,
        mut variants: Vec<VariantResult>,
        sweeps: Vec<Sweep>,
    ) -> RunReport {
        check_relations(&scenario.limits, &mut variants);
        RunReport {
            schema_version: SCHEMA_VERSION,
            vmerack: env!("CARGO_PKG_VERSION"),
            scenario: name.to_owned(),
            title: scenario.title.clone(),
            description: scenario.description.clone(),
            seed: scenario.seed,
            pacing: pacing.to_owned(),
            axis: ["x", "y", "z"].get(scenario.report.force_axis).copied().unwrap_or("?"),
            verdict: variants.iter().map(|variant| variant.verdict).max().unwrap_or(Verdict::Failed),
            variants,
            sweeps,
        }
    }

    /// Every number of the report.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self)
    }

    /// X, Y or Z of three: the report's axis.
    pub(crate) fn along<'a, T>(&self, three: &'a [T; 3]) -> &'a T {
        match self.axis {
            "x" => &three[0],
            "y" => &three[1],
            _ => &three[2],
        }
    }

    /// Writes `report.json`, `charts.json` (the curves, which `vmerack compare` reads) and `report.html` into the folder.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let write = |name: &str, content: Result<String, String>| write_file(folder, name, content);
        write("report.json", self.json().map_err(|error| error.to_string()))?;
        let charts = charts(self);
        write("charts.json", serde_json::to_string(&charts).map_err(|error| error.to_string()))?;
        write("report.html", crate::html::render(self, &charts))
    }
}

/// Writes one file of a report, where its content could be made.
pub(crate) fn write_file(folder: &Path, name: &str, content: Result<String, String>) -> Result<(), WriteError> {
    let path = folder.join(name);
    content
        .and_then(|content| std::fs::write(&path, content).map_err(|error| error.to_string()))
        .map_err(|reason| WriteError { path, reason })
}
