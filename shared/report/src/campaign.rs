//! A fault campaign: a row per fault that was drawn, what each kind comes to, false trips, the verdict.
//!
//! Nothing here depends on a wall clock, on the number of cores or on the order of the runs: the same campaign and seed
//! give the same bytes.

mod html;
mod matrix;
mod table;

use crate::result::{WriteError, write_file};
use crate::verdict::Verdict;
use serde::Serialize;
use std::path::Path;

/// What one drawn fault came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DrawVerdict {
    /// Detected within its bound, with the reaction that was expected and no more force than was allowed.
    Passed,
    /// The run does not differ from its fault-free twin by the stated amount.
    NoEffect,
    /// Detected, but after its bound.
    Late,
    /// Detected in time, but the reaction is another.
    WrongReaction,
    /// The contact force grew beyond its bound after STO.
    TooMuchForce,
    /// It had an effect and nothing saw it.
    Undetected,
    /// Nobody carried it out.
    NotInjected,
}

impl DrawVerdict {
    /// As tables show it.
    pub fn name(self) -> &'static str {
        match self {
            DrawVerdict::Passed => "passed",
            DrawVerdict::NoEffect => "no effect",
            DrawVerdict::Late => "late",
            DrawVerdict::WrongReaction => "wrong reaction",
            DrawVerdict::TooMuchForce => "too much force",
            DrawVerdict::Undetected => "undetected",
            DrawVerdict::NotInjected => "not injected",
        }
    }
}

/// One drawn fault.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DrawRow {
    /// Kind.
    pub kind: String,
    /// Target.
    pub target: String,
    /// Phase of the task in which it began.
    pub phase: String,
    /// Seed of its run and of the twin beside it.
    pub seed: u64,
    /// How much, in its kind's unit.
    pub amount: f64,
    /// When it began, s.
    pub injected_s: f64,
    /// The run differs from its twin by more than the stated amount.
    pub effect: bool,
    /// What saw it first.
    pub detected_by: Option<String>,
    /// From its begin to then, ms.
    pub detected_after_ms: Option<f64>,
    /// Bound of that time, ms.
    pub bound_ms: f64,
    /// From its begin until the arm was held (SS2) or without torque on its brakes (STO), ms.
    pub safe_after_ms: Option<f64>,
    /// Gravest state of the control computer, or STO where all brakes were engaged.
    pub reaction: String,
    /// The reactions that pass.
    pub expected: String,
    /// Contact force at its begin, N.
    pub force_before_n: f64,
    /// Greatest contact force from then on, N.
    pub peak_force_n: f64,
    /// Greatest contact force after STO less the one at its begin, N; none without STO.
    pub force_growth_n: Option<f64>,
    /// Greatest motor torque, as a share of its drive's limit.
    pub peak_torque_share: f64,
    /// Greatest distance of the tool from where it was at its begin, mm.
    pub distance_mm: f64,
    /// What it came to.
    pub verdict: DrawVerdict,
}

/// All faults of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindSummary {
    /// Kind.
    pub kind: String,
    /// Faults drawn.
    pub draws: usize,
    /// Those that had an effect.
    pub effective: usize,
    /// Of those, detected within their bound.
    pub in_bound: usize,
    /// Middle and greatest time to detect of the effective ones, ms.
    pub median_ms: Option<f64>,
    /// See `median_ms`.
    pub greatest_ms: Option<f64>,
    /// Greatest bound, ms.
    pub bound_ms: f64,
    /// Greatest time until safe, ms.
    pub safe_ms: Option<f64>,
    /// Undetected although effective, or never carried out.
    pub undetected: usize,
    /// Detected late.
    pub late: usize,
    /// Another reaction than expected.
    pub wrong_reaction: usize,
    /// Too much force after STO.
    pub too_much_force: usize,
    /// Enough effective draws for a claim.
    pub shown: bool,
    /// Passed, or not; a kind that is not shown passes only in a campaign that was cut short on purpose.
    pub verdict: Verdict,
}

/// A run without a fault in which something tripped.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FalseTrip {
    /// Seed of the run.
    pub seed: u64,
    /// When, s.
    pub at_s: f64,
    /// What fired, or the state that was taken.
    pub what: String,
}

/// The runs without a fault.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NullRuns {
    /// How many.
    pub runs: usize,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Of it, the tool in contact, s.
    pub contact_s: f64,
    /// What tripped, the first of each run.
    pub false_trips: Vec<FalseTrip>,
}

/// Sums over all kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Totals {
    /// Faults drawn.
    pub draws: usize,
    /// Those with an effect.
    pub effective: usize,
    /// Undetected, or never carried out.
    pub undetected: usize,
    /// Detected late.
    pub late: usize,
    /// Another reaction than expected.
    pub wrong_reaction: usize,
    /// Too much force after STO.
    pub too_much_force: usize,
    /// Kinds with too few effective draws for a claim.
    pub not_shown: usize,
    /// Runs without a fault that tripped.
    pub false_trips: usize,
}

/// A whole campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignReport {
    /// [`crate::SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program.
    pub vmerack: &'static str,
    /// Scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// Campaign: file or built-in name.
    pub campaign: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Period of the control task, ms.
    pub period_ms: f64,
    /// Effective draws that a kind needs.
    pub least_effective: usize,
    /// Share of them to be detected in time.
    pub detected_share: f64,
    /// Phases of the task, in order.
    pub phases: Vec<String>,
    /// One summary per kind.
    pub kinds: Vec<KindSummary>,
    /// Sums.
    pub totals: Totals,
    /// Runs without a fault.
    pub null: NullRuns,
    /// One row per fault.
    pub rows: Vec<DrawRow>,
    /// Passed where every kind did and nothing tripped without a fault.
    pub verdict: Verdict,
}

impl CampaignReport {
    /// Tables for the terminal.
    pub fn text(&self) -> String {
        table::text(self)
    }

    /// Writes `campaign.json`, `campaign.csv` and `report.html` into the folder.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write_file(folder, "campaign.json", serde_json::to_string_pretty(self).map_err(|error| error.to_string()))?;
        write_file(folder, "campaign.csv", Ok(table::csv(&self.rows)))?;
        write_file(folder, "report.html", Ok(html::render(self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn row(phase: &str, verdict: DrawVerdict) -> DrawRow {
        DrawRow {
            kind: "stuck".into(),
            target: "force_sensor".into(),
            phase: phase.into(),
            seed: 3,
            amount: 0.0,
            injected_s: 1.25,
            effect: verdict != DrawVerdict::NoEffect,
            detected_by: Some("force-frozen".into()),
            detected_after_ms: Some(51.25),
            bound_ms: 60.0,
            safe_after_ms: None,
            reaction: "hold (SS2)".into(),
            expected: "hold (SS2) to off (STO)".into(),
            force_before_n: 40.0,
            peak_force_n: 41.5,
            force_growth_n: None,
            peak_torque_share: 0.2,
            distance_mm: 0.5,
            verdict,
        }
    }

    pub(super) fn report(rows: Vec<DrawRow>) -> CampaignReport {
        CampaignReport {
            schema_version: crate::SCHEMA_VERSION,
            vmerack: env!("CARGO_PKG_VERSION"),
            scenario: "a <scenario>".into(),
            title: "made up".into(),
            campaign: "built-in".into(),
            seed: 1,
            period_ms: 5.0,
            least_effective: 20,
            detected_share: 0.99,
            phases: vec!["free motion".into(), "contact".into()],
            kinds: vec![KindSummary {
                kind: "stuck".into(),
                draws: rows.len(),
                effective: rows.len(),
                in_bound: rows.len(),
                median_ms: Some(51.25),
                greatest_ms: Some(51.25),
                bound_ms: 60.0,
                safe_ms: None,
                undetected: 0,
                late: 0,
                wrong_reaction: 0,
                too_much_force: 0,
                shown: true,
                verdict: Verdict::Passed,
            }],
            totals: Totals { draws: rows.len(), ..Totals::default() },
            null: NullRuns::default(),
            rows,
            verdict: Verdict::Passed,
        }
    }
}
