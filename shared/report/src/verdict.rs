//! Measures against the scenario's limits.

use crate::measures::RunMeasures;
use crate::result::VariantResult;
use crate::segments::SegmentRow;
use crate::trace::Ended;
use scenario::{Limit, Measure, Scenario, Variant};
use serde::Serialize;

/// What a variant, or all of them, came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every limit holds.
    Passed,
    /// A limit is violated, or the run came to a bad end.
    Failed,
}

/// One limit applied to a run or to one of its segments.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What is measured.
    pub measure: Measure,
    /// Segment, where the measure is one of segments.
    pub segment: Option<String>,
    /// Variant whose measure the value is a multiple of; none: the value is the measure itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Value found.
    pub value: Option<f64>,
    /// Least that passes.
    pub min: Option<f64>,
    /// Greatest that passes.
    pub max: Option<f64>,
    /// Whether it passes; `None`: not judged, because the run was asked to end before.
    pub passed: Option<bool>,
    /// Where the limit comes from.
    pub source: String,
}

/// True of measures that each segment has for itself.
fn of_segments(measure: Measure) -> bool {
    use Measure::*;
    matches!(
        measure,
        ForceMeanErrorN
            | ForceRmsErrorN
            | ForceTrackingErrorN
            | ForceMeanN
            | ForceLeastN
            | ForcePeakN
            | ForceRiseS
            | PositionErrorM
            | EncoderPositionErrorM
            | IdealPositionDeviationM
            | IdealTargetDeviationM
    )
}

/// True where a segment of this kind has the measure.
fn is_of(measure: Measure, force_controlled: bool) -> bool {
    use Measure::*;
    match measure {
        ForceMeanErrorN | ForceRmsErrorN | ForceTrackingErrorN | ForceMeanN | ForceLeastN | ForcePeakN | ForceRiseS => {
            force_controlled
        }
        PositionErrorM | EncoderPositionErrorM => !force_controlled,
        _ => true,
    }
}

/// Names of the scenario's segments that have this measure; `None` of one that the whole run has.
pub fn segments_with(scenario: &Scenario, measure: Measure) -> Option<Vec<String>> {
    let axis = scenario.report.force_axis;
    of_segments(measure).then(|| {
        let segments = scenario.resolved_segments().into_iter();
        segments.filter(|segment| is_of(measure, segment.selection[axis] == 0)).map(|segment| segment.name).collect()
    })
}

impl VariantResult {
    /// What a measure came to, of the whole run or of one segment; `None` where it does not exist.
    pub fn measure(&self, measure: Measure, segment: Option<&str>) -> Option<f64> {
        let row = segment.and_then(|name| self.segments.iter().find(|row| row.name == name));
        self.run.value(measure, row)
    }
}

/// Applies the limits that set one variant in relation to another. Where the other one was not run, or a run was cut short,
/// they are not judged.
pub(crate) fn check_relations(limits: &[Limit], variants: &mut [VariantResult]) {
    for limit in limits {
        let Some(name) = &limit.relative_to else { continue };
        let other = variants.iter().position(|variant| variant.name == *name);
        for i in (0..variants.len()).filter(|&i| Some(i) != other) {
            let own = &variants[i];
            if !concerns(limit, &own.name) {
                continue;
            }
            let segments: Vec<Option<String>> = match (of_segments(limit.measure), limit.segments.is_empty()) {
                (false, _) => vec![None],
                (true, false) => limit.segments.iter().cloned().map(Some).collect(),
                (true, true) => {
                    let rows = own.segments.iter().filter(|row| is_of(limit.measure, row.force_controlled));
                    rows.map(|row| Some(row.name.clone())).collect()
                }
            };
            let mut made = Vec::new();
            for segment in segments {
                let of = |variant: &VariantResult| variant.measure(limit.measure, segment.as_deref());
                let value = other.and_then(|other| Some(of(own)? / of(&variants[other])?)).filter(|value| value.is_finite());
                let whole = |variant: &VariantResult| !variant.segments.iter().any(SegmentRow::is_beyond_the_run);
                let unjudged = !other.is_some_and(|other| whole(own) && whole(&variants[other]));
                made.push(check(limit, segment.as_deref(), value, unjudged));
            }
            if made.iter().any(|check| check.passed == Some(false)) {
                variants[i].verdict = Verdict::Failed;
            }
            variants[i].checks.extend(made);
        }
    }
}

fn concerns(limit: &Limit, variant: &str) -> bool {
    limit.variants.is_empty() || limit.variants.iter().any(|name| name == variant)
}

/// All limits of the scenario that apply to the variant alone.
pub(crate) fn checks(
    scenario: &Scenario,
    variant: &Variant,
    ended: &Ended,
    rows: &[SegmentRow],
    run: &RunMeasures,
) -> Vec<Check> {
    let mut checks = Vec::new();
    for limit in scenario.limits.iter().filter(|limit| limit.relative_to.is_none()) {
        if !concerns(limit, &variant.name) {
            continue;
        }
        if !of_segments(limit.measure) {
            let cut_short = rows.iter().any(SegmentRow::is_beyond_the_run);
            checks.push(check(limit, None, run.value(limit.measure, None), cut_short && excused(ended, variant)));
            continue;
        }
        let chosen = |row: &&SegmentRow| match limit.segments.is_empty() {
            true => is_of(limit.measure, row.force_controlled),
            false => limit.segments.contains(&row.name),
        };
        for row in rows.iter().filter(chosen) {
            let unjudged = row.is_beyond_the_run() && excused(ended, variant);
            checks.push(check(limit, Some(&row.name), run.value(limit.measure, Some(row)), unjudged));
        }
    }
    checks
}

/// A run that ended early because it was told to, or because that is a result here.
fn excused(ended: &Ended, variant: &Variant) -> bool {
    match ended {
        Ended::Completed => true,
        Ended::Diverged { .. } => variant.may_diverge,
        Ended::Stopped { .. } => false,
    }
}

fn check(limit: &Limit, segment: Option<&str>, value: Option<f64>, unjudged: bool) -> Check {
    let holds = |value: f64| limit.min.is_none_or(|min| value >= min) && limit.max.is_none_or(|max| value <= max);
    Check {
        measure: limit.measure,
        segment: segment.map(str::to_owned),
        relative_to: limit.relative_to.clone(),
        value,
        min: limit.min,
        max: limit.max,
        passed: (!unjudged).then(|| value.is_some_and(holds)),
        source: limit.source.clone(),
    }
}
